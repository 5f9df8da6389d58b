//! Solvers at their theoretical rates, and the energy ledger of whole scenes.

use luxel_scenes::Rgb;
use luxel_solver::solvers::{
    Ambient, Config, Outcome, Tolerance, conjugate_gradient, direct, gauss_seidel, jacobi,
    no_progress, southwell,
};
use luxel_tests::closed_box::ClosedBox;
use luxel_tests::command::{arg, luxel};
use luxel_tests::ledgers::ledgers;
use luxel_tests::picture::example;

#[test]
fn conjugate_gradient_needs_few_iterations_in_bright_rooms() {
    let config = Config {
        tolerance: Tolerance::Residual(1e-10),
        max_iterations: 300,
    };
    for across in [1, 8] {
        let room = ClosedBox::new(across);
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
    let room = ClosedBox::new(6);
    for rho in [0.5, 0.9, 0.99, 0.999, 0.9999] {
        // Later residuals of dark rooms are rounding.
        let (sweeps, halvings) = if rho > 0.5 { (40, 20) } else { (20, 10) };
        let slow = room.rate(rho, sweeps, |system, config| {
            jacobi(system, config, no_progress)
        });
        // The other eigenvalues, below 1/sqrt(2) of the first, have died out.
        let rest = 2.0 * 0.5_f64.powi(halvings);
        assert!((slow / rho - 1.0).abs() < rest, "jacobi, {rho}: {slow}");
        let fast = room.rate(rho, sweeps, |system, config| {
            gauss_seidel(system, config, no_progress)
        });
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
    let room = ClosedBox::new(6);
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

#[test]
fn the_ledger_closes_in_every_scene() {
    for scene in ["cornell", "furnace", "corridor", "office"] {
        let entries = ledgers(scene);
        assert!(!entries.is_empty(), "{scene}");
        for entry in entries {
            // Sums of some hundred terms are left by LU.
            let limit = entry.tolerance.unwrap_or(1e-13);
            assert!(entry.unaccounted <= limit, "{scene}: {entry:?}");
        }
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
            arg(&example("cornell")),
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
