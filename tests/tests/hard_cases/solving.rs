//! Systems whose answers amplify errors, and scenes whose energy must be accounted for.

use glam::DVec3;
use luxel_scenes::{Exitance, Irradiance, Radiosity, Reflectance, Rgb};
use luxel_solver::form_factors::{
    AnalyticConfig, Polygon, analytic_factors, closure, unoccluded_matrix,
};
use luxel_solver::patches::PatchSize;
use luxel_solver::solvers::{
    Ambient, Config, Ledger, Solution, System, Tolerance, conjugate_gradient, direct, gauss_seidel,
    jacobi, no_progress, source, southwell,
};
use luxel_solver::transport::{Dense, Transport};
use luxel_solver::world::World;
use luxel_tests::builder::{self, Part, flipped, parallelogram, room, scene};
use luxel_tests::command::{arg, luxel};
use luxel_tests::scene_files;
use std::f64::consts::PI;
use std::ops::ControlFlow;

/// A closed unit cube, each face cut into `across`² patches.
fn cube(across: usize) -> (Vec<f64>, Dense) {
    let step = 1.0 / across as f64;
    let patches: Vec<Polygon> = room(DVec3::ZERO, DVec3::ONE)
        .iter()
        .flat_map(|face| {
            let (side, other) = ((face[1] - face[0]) * step, (face[3] - face[0]) * step);
            (0..across * across).map(move |cell| {
                let (u, v) = ((cell / across) as f64, (cell % across) as f64);
                let corner = face[0] + side * u + other * v;
                Polygon::new(&parallelogram(corner, side, other)).expect("a patch")
            })
        })
        .collect();
    let areas = patches.iter().map(Polygon::area).collect();
    (areas, unoccluded_matrix(&patches, 1e-13))
}

/// A solver of a system.
type Solver = fn(&System, &Config) -> Solution;

const SOLVERS: [(&str, Solver); 5] = [
    ("jacobi", |s, c| jacobi(s, c, no_progress)),
    ("gauss-seidel", |s, c| gauss_seidel(s, c, no_progress)),
    ("southwell", |s, c| {
        southwell(s, Ambient::None, c, no_progress)
    }),
    ("conjugate gradient", |s, c| {
        conjugate_gradient(s, c, no_progress).expect("reciprocal")
    }),
    ("direct", |s, _| direct(s).expect("a regular matrix")),
];

/// Row 4: errors of row sums are amplified by ρ/(1 − ρ), and a small step hides a large error.
#[test]
fn a_white_furnace_is_as_right_as_its_closure() {
    let (areas, matrix) = cube(2);
    let defect = closure(&matrix).largest_defect;
    assert!(defect <= 1e-8, "row sums are off by {defect:e}");
    let n = areas.len();
    for rho in [0.999, 0.9999] {
        let reflectance = vec![Reflectance::splat(rho); n];
        let source = vec![Radiosity::splat(1.0 - rho); n];
        let system = System::new(&matrix, &areas, &reflectance, &source).expect("it contracts");
        let config = Config {
            tolerance: Tolerance::Error(1e-6),
            max_iterations: 1_000_000,
        };
        for (name, solve) in SOLVERS {
            let solution = solve(&system, &config);
            for b in &solution.radiosity {
                let error = (b.0.x - 1.0).abs();
                // Row sums, what the solver states, and 24 roundings, the last two amplified, too.
                let rounding = 24.0 * f64::EPSILON / (1.0 - rho);
                let bound = defect * rho / (1.0 - rho) + solution.error_bound.x + rounding;
                assert!(error <= bound, "{name}, {rho}: {error:e} above {bound:e}");
                assert!(error <= 1e-4, "{name}, {rho}: {error:e}");
            }
        }
    }
    // Jacobi's residual is its step. At 1e-6 the error is still 1 %, and the bound says so.
    let reflectance = vec![Reflectance::splat(0.9999); n];
    let source = vec![Radiosity::splat(1e-4); n];
    let system = System::new(&matrix, &areas, &reflectance, &source).expect("it contracts");
    let config = Config {
        tolerance: Tolerance::Error(1e-9),
        max_iterations: 1_000_000,
    };
    let early = jacobi(&system, &config, |progress| {
        if progress.residual.x > 1e-6 {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    });
    let error = 1.0 - early.radiosity[0].0.x;
    assert!((error - 0.01).abs() < 1e-4, "{error}");
    assert!(early.residual.x <= 1e-6 && early.error_bound.x >= error * (1.0 - 1e-6));
}

/// Row 13.
#[test]
fn a_bright_lamp_does_not_drown_a_dim_one() {
    let (areas, matrix) = cube(2);
    let n = areas.len();
    let reflectance: Vec<_> = (0..n)
        .map(|k| Reflectance::splat(0.1 + 0.035 * k as f64))
        .collect();
    let light = |bright: f64, dim: f64| -> Vec<Radiosity> {
        let mut source = vec![Radiosity::ZERO; n];
        source[0] = Radiosity::new(bright, dim, 0.0);
        source[n - 1] = Radiosity::new(dim, 0.0, dim);
        source
    };
    // A fixed number of sweeps is linear in the light, converged or not.
    let config = Config {
        tolerance: Tolerance::Residual(0.0),
        max_iterations: 40,
    };
    for (name, solve) in SOLVERS.into_iter().filter(|(name, _)| {
        // The order of shots and the directions of conjugate gradient follow the light.
        !["southwell", "conjugate gradient"].contains(name)
    }) {
        let solved = |source: &[Radiosity]| {
            let system = System::new(&matrix, &areas, &reflectance, source).expect("a system");
            solve(&system, &config).radiosity
        };
        let (both, one, other) = (
            solved(&light(1e8, 1.0)),
            solved(&light(1.0, 0.0)),
            solved(&light(0.0, 1.0)),
        );
        for k in 0..n {
            let sum = one[k].0.x * 1e8 + other[k].0.x;
            let error = (both[k].0.x / sum - 1.0).abs();
            assert!(error <= 1e-12, "{name}, patch {k}: {error:e}");
        }
    }
    // A dim channel beside a bright one is as accurate as alone: tolerances are each channel's own.
    let config = Config {
        tolerance: Tolerance::Error(1e-10),
        max_iterations: 10_000,
    };
    let source = light(1e8, 1.0);
    let system = System::new(&matrix, &areas, &reflectance, &source).expect("a system");
    let exact = direct(&system).expect("a regular matrix").radiosity;
    for (name, solve) in SOLVERS {
        for (b, exact) in solve(&system, &config).radiosity.iter().zip(&exact) {
            for channel in 0..3 {
                let error = (b.0[channel] - exact.0[channel]).abs();
                let brightest = [1.1e8, 1.1, 1.1][channel];
                assert!(error <= 1.1e-10 * brightest, "{name}: {b:?} {exact:?}");
            }
        }
    }
}

/// Row 21: a room with a corner that hides parts of it from others.
#[test]
fn an_l_shaped_furnace_is_even() {
    let up = |x: f64, y: f64, w: f64, h: f64| {
        parallelogram(DVec3::new(x, y, 0.0), DVec3::X * w, DVec3::Y * h)
    };
    let raised = |f: builder::Polygon| -> builder::Polygon {
        flipped(f.into_iter().map(|v| v + DVec3::Z).collect())
    };
    let corners = [
        [0.0, 0.0],
        [2.0, 0.0],
        [2.0, 1.0],
        [1.0, 1.0],
        [1.0, 2.0],
        [0.0, 2.0],
    ];
    let mut faces = vec![up(0.0, 0.0, 2.0, 1.0), up(0.0, 1.0, 1.0, 1.0)];
    faces.extend(faces.clone().into_iter().map(raised));
    for k in 0..6 {
        let at = |k: usize| DVec3::new(corners[k % 6][0], corners[k % 6][1], 0.0);
        // Counter-clockwise outlines: the inside is on the left.
        faces.push(flipped(parallelogram(at(k), at(k + 1) - at(k), DVec3::Z)));
    }
    let scene = scene("l", [Part::grey("room", 0.5, faces)]);
    let world = World::new(&scene);
    let patches = world.mesh(PatchSize::Whole).expect("a mesh");
    let config = AnalyticConfig {
        accuracy: 1e-11,
        points: 2000,
        seed: 1,
    };
    let matrix = analytic_factors(&world, &patches, &config).matrix;
    let defect = closure(&matrix).largest_defect;
    assert!(defect < 1e-3, "closure {defect:e}");
    for rho in [0.5, 0.9] {
        let reflectance = vec![Reflectance::splat(rho); patches.len()];
        let source = vec![Radiosity::splat(1.0 - rho); patches.len()];
        let system = System::new(&matrix, patches.areas(), &reflectance, &source);
        for b in direct(&system.expect("it contracts"))
            .expect("regular")
            .radiosity
        {
            let error = (b.0.x - 1.0).abs();
            let bound = defect * rho / (1.0 - rho) * (1.0 + 2.0 * defect / (1.0 - rho)) + 1e-12;
            assert!(error <= bound, "{rho}: {error:e} above {bound:e}");
        }
    }
}

/// Row 22.
#[test]
fn an_open_box_is_not_closed_by_force() {
    let mut faces = room(DVec3::ZERO, DVec3::ONE);
    let closed: Vec<Polygon> = faces
        .iter()
        .map(|f| Polygon::new(f).expect("a face"))
        .collect();
    let closed = unoccluded_matrix(&closed, 1e-13);
    faces.truncate(5);
    let open: Vec<Polygon> = faces
        .iter()
        .map(|f| Polygon::new(f).expect("a face"))
        .collect();
    let matrix = unoccluded_matrix(&open, 1e-13);
    for row in 0..5 {
        let escapes = closed.get(row, 5);
        // What is missing is the factor to the face that was taken away.
        let defect = (matrix.row_sum(row) - (1.0 - escapes)).abs();
        assert!(escapes > 0.19 && defect < 1e-12, "row {row}: {defect:e}");
    }
    let areas = [1.0; 5];
    let reflectance = [0.2, 0.4, 0.6, 0.8, 0.9].map(Reflectance::splat);
    let emission = [1.0, 0.0, 0.0, 2.0, 0.0].map(Exitance::splat);
    let none = [Irradiance::ZERO; 5];
    let s = source(&emission, &reflectance, &none);
    let system = System::new(&matrix, &areas, &reflectance, &s).expect("a system");
    let config = Config {
        tolerance: Tolerance::Error(1e-7),
        max_iterations: 1000,
    };
    for (name, solve) in SOLVERS {
        let solution = solve(&system, &config);
        let ledger = Ledger::new(&system, &solution, &emission, &none);
        let open = ledger.emitted.0 - ledger.absorbed.0 - ledger.escaped.0;
        let share = (open / ledger.emitted.0).abs().max_element();
        assert!(share <= 1e-6, "{name}: {share:e}");
        let escaped: Rgb = (0..5)
            .map(|k| solution.radiosity[k].0 * closed.get(k, 5))
            .sum();
        let difference = (escaped - ledger.escaped.0).abs().max_element();
        assert!(difference < 1e-11, "{name}: {difference:e} through the top");
    }
}

/// Row 23, through the whole command: what is black in green keeps its emission.
#[test]
fn a_black_channel_keeps_its_emission_to_the_bit() {
    let mut coloured = Part::grey("room", 0.0, room(DVec3::ZERO, DVec3::ONE));
    coloured.reflectance = Reflectance::new(0.7, 0.0, 0.3);
    coloured.emission = luxel_scenes::Radiance::new(0.1, 0.2, 0.3);
    let scene = scene("black", [coloured]);
    let world = World::new(&scene);
    let patches = world.mesh(PatchSize::Count(100)).expect("a mesh");
    let config = AnalyticConfig {
        accuracy: 1e-9,
        points: 40,
        seed: 1,
    };
    let matrix = analytic_factors(&world, &patches, &config).matrix;
    let none = vec![Irradiance::ZERO; patches.len()];
    let s = source(patches.emissions(), patches.reflectances(), &none);
    let system = System::new(&matrix, patches.areas(), patches.reflectances(), &s);
    let system = system.expect("a system");
    let config = Config {
        tolerance: Tolerance::Error(1e-6),
        max_iterations: 1000,
    };
    for (name, solve) in SOLVERS {
        for (b, emission) in solve(&system, &config)
            .radiosity
            .iter()
            .zip(patches.emissions())
        {
            assert_eq!(b.0.y.to_bits(), emission.0.y.to_bits(), "{name}");
            assert!(b.0.x > emission.0.x && b.0.z > emission.0.z, "{name}");
        }
    }
}

/// Row 24: 6.6e-4 of the light of the lit end arrives at the other.
#[test]
fn the_dark_end_of_a_corridor_is_relatively_right() {
    // EN-COR-01: 1 × 1 × 20, reflectance 0.6, z− emits 1 W/m².
    let faces = room(DVec3::ZERO, DVec3::new(1.0, 1.0, 20.0));
    let part = |name, range: std::ops::Range<usize>, emission: f64| Part {
        emission: luxel_scenes::Radiance::splat(emission / PI),
        ..Part::grey(name, 0.6, faces[range].to_vec())
    };
    let scene = scene(
        "corridor",
        [
            part("walls", 0..4, 0.0),
            part("lit", 4..5, 1.0),
            part("dark", 5..6, 0.0),
        ],
    );
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = scene_files::write(&scene, folder.path(), "");
    let dense = ["--form-factors", "analytic", "--solver", "cg"];
    let outcome = luxel(&[&["solve", arg(&file), "--json", "-q"], &dense[..]].concat());
    outcome.assert_success();
    let json = outcome.json();
    for (object, exact) in [("lit", 1.138_894_650), ("dark", 0.000_664_118_008)] {
        let b = json["objects"][object]["radiosity"][0]
            .as_f64()
            .expect("a number");
        assert!(
            (b / exact - 1.0).abs() <= 0.01,
            "{object}: {b} against {exact}"
        );
    }
}
