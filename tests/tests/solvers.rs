//! Solvers at their theoretical rates, and the energy ledger of whole scenes.

use glam::DVec3;
use luxel_scenes::{Exitance, Irradiance, Radiosity, Reflectance, Rgb, load};
use luxel_solver::form_factors::{
    AnalyticConfig, Polygon, RayCastConfig, analytic_factors, ray_cast, unoccluded_matrix,
};
use luxel_solver::patches::PatchSize;
use luxel_solver::solvers::{
    Ambient, Config, Ledger, Outcome, Solution, System, Tolerance, conjugate_gradient, direct,
    gauss_seidel, jacobi, no_progress, source, southwell,
};
use luxel_solver::transport::{Dense, Symmetrised, Transport};
use luxel_solver::world::World;
use luxel_tests::builder::{parallelogram, room};
use luxel_tests::command::luxel;
use std::path::Path;

/// The inside of a room of 4 m × 3 m × 2.5 m, each face cut into `across`² patches.
struct Room {
    areas: Vec<f64>,
    matrix: Dense,
    source: Vec<Radiosity>,
}

impl Room {
    fn new(across: usize) -> Self {
        let mut patches = Vec::new();
        for face in room(DVec3::ZERO, DVec3::new(4.0, 3.0, 2.5)) {
            let (side, other) = (face[1] - face[0], face[3] - face[0]);
            let step = 1.0 / across as f64;
            for cell in 0..across * across {
                let (u, v) = ((cell / across) as f64, (cell % across) as f64);
                let corner = face[0] + (side * u + other * v) * step;
                let patch = parallelogram(corner, side * step, other * step);
                patches.push(Polygon::new(&patch).expect("patches have an area"));
            }
        }
        // One lamp that is not in the middle of anything, in three colours.
        let mut source = vec![Radiosity::ZERO; patches.len()];
        source[1] = Radiosity::new(3.0, 1.0, 0.1);
        Self {
            areas: patches.iter().map(Polygon::area).collect(),
            matrix: unoccluded_matrix(&patches, 1e-12),
            source,
        }
    }

    /// Solves with one reflectance everywhere.
    fn solve(&self, rho: f64, solve: impl Fn(&System) -> Solution) -> Solution {
        let reflectance = vec![Reflectance::splat(rho); self.areas.len()];
        let system = System::new(&self.matrix, &self.areas, &reflectance, &self.source);
        solve(&system.expect("a closed room"))
    }
}

#[test]
fn conjugate_gradient_needs_few_iterations_in_bright_rooms() {
    let config = Config {
        tolerance: Tolerance::Residual(1e-10),
        max_iterations: 300,
    };
    for across in [1, 8] {
        let room = Room::new(across);
        for (rho, most) in [(0.99, 60), (0.9999, 300)] {
            let name = format!("{across} x {across} patches a face, rho {rho}");
            let solution = room.solve(rho, |system| {
                conjugate_gradient(system, &config, no_progress).expect("reciprocal")
            });
            assert_eq!(solution.outcome, Outcome::Converged, "{name}");
            assert!(solution.iterations <= most, "{name}: {solution:?}");
            // The eigenvalue near 1 takes one iteration. The others of F lie within 1/sqrt(2) of zero,
            // the norm of the exchange across a right-angled edge: condition 5.8, a factor of 0.41 an
            // iteration, 27 for ten digits and a constant of two.
            assert!(
                solution.iterations <= 28,
                "{name}: {} iterations",
                solution.iterations
            );
            let exact = room.solve(rho, |system| direct(system).expect("a regular matrix"));
            let scale = exact.radiosity[1].0;
            for (b, exact) in solution.radiosity.iter().zip(&exact.radiosity) {
                // Both bounds, and the rounding of 384 terms amplified by 1/(1 - rho).
                let rounding = scale * (384.0 * f64::EPSILON / (1.0 - rho));
                let bound = solution.error_bound + exact_bound(rounding);
                assert!((b.0 - exact.0).abs().cmple(bound).all(), "{name}: {b:?}");
            }
        }
    }
}

/// What LU and residuals leave to rounding.
fn exact_bound(rounding: Rgb) -> Rgb {
    rounding.max(Rgb::splat(1e-13))
}

#[test]
fn sweeps_shrink_the_residual_at_the_rates_of_theory() {
    let room = Room::new(6);
    for rho in [0.5, 0.9, 0.99, 0.999, 0.9999] {
        // Later residuals of dark rooms are rounding.
        let (sweeps, halvings) = if rho > 0.5 { (40, 20) } else { (20, 10) };
        let rate = |solve: &dyn Fn(&System, &Config) -> Solution| {
            let config = Config {
                tolerance: Tolerance::Residual(0.0),
                max_iterations: sweeps,
            };
            // Exact at the end of a run, whatever the solver reports on the way.
            let residual = |max_iterations| {
                let config = Config {
                    max_iterations,
                    ..config
                };
                room.solve(rho, |system| solve(system, &config)).residual.x
            };
            residual(sweeps) / residual(sweeps - 1)
        };
        let slow = rate(&|system, config| jacobi(system, config, no_progress));
        // The other eigenvalues, below 1/sqrt(2) of the first, have died out.
        let rest = 2.0 * 0.5_f64.powi(halvings);
        assert!((slow / rho - 1.0).abs() < rest, "jacobi, {rho}: {slow}");
        let fast = rate(&|system, config| gauss_seidel(system, config, no_progress));
        // Against log ρ² the rate is that of the ordering, from 1.85 (ρ = 0.5) to 2 (ρ near 1).
        let ratio = fast.ln() / rho.ln();
        assert!(
            (1.85..=2.0).contains(&ratio),
            "gauss-seidel, {rho}: {ratio}"
        );
    }
}

#[test]
fn shooting_brings_most_light_first() {
    let room = Room::new(6);
    let exact = room.solve(0.8, |system| direct(system).expect("a regular matrix"));
    let error = |ambient, sweeps| {
        let config = Config {
            tolerance: Tolerance::Residual(0.0),
            max_iterations: sweeps,
        };
        let solution = room.solve(0.8, |system| {
            southwell(system, ambient, &config, no_progress)
        });
        let flux = |of: &dyn Fn(usize) -> f64| -> f64 {
            let terms = room.areas.iter().enumerate();
            terms.map(|(k, area)| area * of(k)).sum()
        };
        flux(&|k| (solution.radiosity[k].0 - exact.radiosity[k].0).x.abs())
            / flux(&|k| exact.radiosity[k].0.x)
    };
    // Before any shot only the lamp is lit, with 1 - rho of the light. The ambient estimate has the
    // rest, though not where it belongs.
    let (dark, estimated) = (error(Ambient::None, 0), error(Ambient::Estimated, 0));
    assert!(dark > 0.79 && estimated < 0.5 * dark, "{dark} {estimated}");
    let (none, ambient) = (error(Ambient::None, 1), error(Ambient::Estimated, 1));
    assert!(ambient < 0.5 * none, "after a sweep: {none} {ambient}");
    // Two of Jacobi's sweeps leave 0.8^3 of the light; a sweep of shots does more.
    assert!(none < 0.512, "a sweep: {none}");
}

/// A scene of `scenes/data`.
fn path(scene: &str) -> String {
    let root = env!("CARGO_MANIFEST_DIR");
    format!("{root}/../scenes/data/{scene}/{scene}.toml")
}

/// Every solver's ledger on a scene; the share of the light that is unaccounted for is at most what
/// the solver was asked for.
fn check_ledgers(
    name: &str,
    transport: &dyn Transport,
    areas: &[f64],
    reflectance: &[Reflectance],
    emission: &[Exitance],
) {
    let none = vec![Irradiance::ZERO; areas.len()];
    let source = source(emission, reflectance, &none);
    let system = System::new(transport, areas, reflectance, &source).expect("a valid system");
    for tolerance in [1e-4, 1e-9] {
        let config = Config {
            tolerance: Tolerance::Error(tolerance),
            max_iterations: 10_000,
        };
        for (solver, solution, limit) in [
            ("jacobi", jacobi(&system, &config, no_progress), tolerance),
            (
                "gauss-seidel",
                gauss_seidel(&system, &config, no_progress),
                tolerance,
            ),
            (
                "southwell",
                southwell(&system, Ambient::None, &config, no_progress),
                tolerance,
            ),
            (
                "conjugate gradient",
                conjugate_gradient(&system, &config, no_progress).expect("reciprocal"),
                tolerance,
            ),
            // Sums of some hundred terms.
            ("direct", direct(&system).expect("a regular matrix"), 1e-13),
        ] {
            let ledger = Ledger::new(&system, &solution, emission, &none);
            let open = ledger.emitted.0 - ledger.absorbed.0 - ledger.escaped.0;
            let share = (open / ledger.emitted.0).abs().max_element();
            assert!(share <= limit, "{name} by {solver}: {share:e}");
        }
    }
}

#[test]
fn the_ledger_closes_in_every_scene() {
    for (name, size) in [
        ("cornell", PatchSize::Whole),
        ("furnace", PatchSize::Whole),
        ("corridor", PatchSize::Whole),
        ("office", PatchSize::Count(400)),
    ] {
        let scene = load(Path::new(&path(name)))
            .expect("the scene is good")
            .scene;
        let world = World::new(&scene);
        let patches = world.mesh(size).expect("a mesh");
        let frame = world.surfaces().geometry().frame();
        let areas = patches.areas().iter().map(|&a| frame.area_to_world(a));
        let areas: Vec<f64> = areas.collect();
        // What is left must not depend on how exact the factors are, only on their being reciprocal.
        let transport: Box<dyn Transport> = if name == "office" {
            // Too many faces for exact factors of every pair: rays, made reciprocal.
            let config = RayCastConfig {
                rays: 1024,
                seed: 1,
            };
            let cast = ray_cast(&world, &patches, &config);
            let factors = Dense::new(patches.len(), cast.factors).expect("factors");
            Box::new(Symmetrised::new(&factors, &areas))
        } else {
            let config = AnalyticConfig {
                accuracy: 1e-6,
                points: 40,
                seed: 1,
            };
            Box::new(analytic_factors(&world, &patches, &config).matrix)
        };
        let (reflectance, emission) = (patches.reflectances(), patches.emissions());
        check_ledgers(name, &*transport, &areas, reflectance, emission);
    }
}

#[test]
fn the_command_reports_a_ledger_that_closes() {
    for (factors, solver, tolerance, limit) in [
        ("analytic", "direct", "1e-3", 1e-13),
        ("analytic", "jacobi", "1e-5", 1e-5),
        ("analytic", "gauss-seidel", "1e-9", 1e-9),
        ("analytic", "southwell", "1e-6", 1e-6),
        ("analytic", "cg", "1e-8", 1e-8),
        // Rays and hemicubes are made reciprocal for conjugate gradient.
        ("raycast", "cg", "1e-9", 1e-9),
        ("hemicube", "cg", "1e-9", 1e-9),
    ] {
        let outcome = luxel(&[
            "solve",
            &path("cornell"),
            "--json",
            "-q",
            "--patch-size",
            "whole",
            "--form-factors",
            factors,
            "--solver",
            solver,
            "--tolerance",
            tolerance,
        ]);
        outcome.assert_success();
        let energy = &outcome.json()["energy"];
        let flux = |name: &str, c: usize| energy[name][c].as_f64().expect("a flux");
        for c in 0..3 {
            let open = flux("emitted", c) - flux("absorbed", c) - flux("escaped", c);
            let share = open.abs() / flux("emitted", c);
            assert!(share <= limit, "{factors}, {solver}: {share:e}");
        }
        let bound = outcome.json()["error"]["solver_rms"].as_f64();
        // Relative to the mean instead of the brightest: the lamp is a hundred times brighter.
        assert!(bound.expect("reciprocal") <= 300.0 * limit, "{solver}");
    }
}
