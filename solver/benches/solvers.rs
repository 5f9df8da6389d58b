//! Solvers: iterations and time over the reflectance of a closed room.
//!
//! The number of sweeps or iterations to a residual of 10⁻¹⁰ stands in the name of each benchmark. The
//! room has 6 × 8 × 8 patches; LU stands beside them.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::DVec3;
use luxel_scenes::{Radiosity, Reflectance};
use luxel_solver::form_factors::{Polygon, unoccluded_matrix};
use luxel_solver::solvers::{
    Ambient, Config, Solution, System, Tolerance, conjugate_gradient, direct, gauss_seidel, jacobi,
    no_progress, southwell,
};
use std::hint::black_box;

/// Patches along each edge of the room.
const ACROSS: usize = 8;

/// The inside of a room of 4 m × 3 m × 2.5 m.
fn room() -> Vec<Polygon> {
    let size = DVec3::new(4.0, 3.0, 2.5);
    let mut patches = Vec::new();
    for axis in 0..3 {
        for is_far in [false, true] {
            for cell in 0..ACROSS * ACROSS {
                let corner = |u: usize, v: usize| {
                    let mut unit = [0.0; 3];
                    unit[axis] = f64::from(u8::from(is_far));
                    unit[(axis + 1) % 3] = (cell / ACROSS + u) as f64 / ACROSS as f64;
                    unit[(axis + 2) % 3] = (cell % ACROSS + v) as f64 / ACROSS as f64;
                    DVec3::from_array(unit) * size
                };
                let mut face = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                if is_far {
                    face.reverse();
                }
                patches.push(Polygon::new(&face).expect("a patch"));
            }
        }
    }
    patches
}

/// A solver of a system.
type Solver = fn(&System, &Config) -> Solution;

const SOLVERS: [(&str, Solver); 5] = [
    ("jacobi", |s, c| jacobi(s, c, no_progress)),
    ("gauss-seidel", |s, c| gauss_seidel(s, c, no_progress)),
    ("southwell", |s, c| {
        southwell(s, Ambient::None, c, no_progress)
    }),
    ("cg", |s, c| {
        conjugate_gradient(s, c, no_progress).expect("a reciprocal room")
    }),
    ("direct", |s, _| direct(s).expect("a regular matrix")),
];

fn reflectances(criterion: &mut Criterion) {
    let patches = room();
    let areas: Vec<f64> = patches.iter().map(Polygon::area).collect();
    let matrix = unoccluded_matrix(&patches, 1e-10);
    let mut source = vec![Radiosity::ZERO; patches.len()];
    source[0] = Radiosity::new(3.0, 2.0, 1.0);
    let config = Config {
        tolerance: Tolerance::Residual(1e-10),
        max_iterations: 1_000_000,
    };
    let mut group = criterion.benchmark_group("solvers");
    group.sample_size(10);
    for rho in [0.5, 0.9, 0.99, 0.999] {
        let reflectance = vec![Reflectance::splat(rho); patches.len()];
        let system = System::new(&matrix, &areas, &reflectance, &source).expect("a closed room");
        for (name, solve) in SOLVERS {
            let iterations = solve(&system, &config).iterations;
            let id = BenchmarkId::new(name, format!("rho {rho}, {iterations} iterations"));
            group.bench_function(id, |bencher| {
                bencher.iter(|| solve(black_box(&system), &config));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, reflectances);
criterion_main!(benches);
