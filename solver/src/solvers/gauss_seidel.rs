//! Gauss–Seidel iteration: B_i ← (S_i + ρ_i Σ_{j≠i} F_ij B_j) / (1 − ρ_i F_ii), rows in order, each
//! using the newest values.
//!
//! Source: M. F. Cohen, D. P. Greenberg, "The hemi-cube: a radiosity solution for complex
//! environments", SIGGRAPH 1985 (its use for radiosity); R. S. Varga, "Matrix Iterative Analysis",
//! 1962 (its rate: in a closed scene of uniform ρ near 1, that of Jacobi squared). Valid for
//! ‖ρF‖∞ < 1. Cost: one gather per sweep, sequential and in exact order.
//!
//! The residual after a sweep is r_i = ρ_i Σ_{j>i} F_ij δ_j, δ the step of the sweep, because row i
//! held exactly when it was visited. So |r_i| ≤ ρ_i Σ_j F_ij max_{j>i} |δ_j| bounds it without a
//! second gather; the true residual is evaluated when this bound comes near the tolerance.

use super::report::Residual;
use super::{Config, Outcome, Progress, Solution, System};
use luxel_scenes::{Irradiance, Radiosity, Rgb};
use std::ops::ControlFlow;

/// The true residual is evaluated once its bound is within this factor of the tolerance. The bound
/// is about twice the residual; a smaller factor risks a sweep too many, a larger one costs gathers.
const NEAR: f64 = 4.0;

/// Solves a system by Gauss–Seidel iteration from B = S.
///
/// `progress` is called after each sweep and may stop the solver.
pub fn gauss_seidel(
    system: &System,
    config: &Config,
    mut progress: impl FnMut(Progress) -> ControlFlow<()>,
) -> Solution {
    let transport = system.transport();
    let mut radiosity = system.source().to_vec();
    let mut irradiance = vec![Irradiance::ZERO; system.len()];
    let mut steps = vec![Rgb::ZERO; system.len()];

    transport.gather(&radiosity, &mut irradiance);
    let first = system.residual(&radiosity, &irradiance);
    let mut residual = first;
    let mut is_exact = true;
    let mut history = vec![first.largest];
    let outcome = loop {
        let limit = config.tolerance.limit(system, &first, &radiosity);
        if !is_exact && residual.is_within(&limit, NEAR) {
            transport.gather(&radiosity, &mut irradiance);
            residual = system.residual(&radiosity, &irradiance);
            is_exact = true;
        }
        let iteration = history.len() - 1;
        history[iteration] = residual.largest;
        if is_exact && residual.is_within(&limit, 1.0) {
            break Outcome::Converged;
        }
        if iteration >= config.max_iterations {
            break Outcome::IterationLimit;
        }
        if iteration > 0
            && progress(Progress {
                iteration,
                residual: residual.largest,
            })
            .is_break()
        {
            break Outcome::Interrupted;
        }
        sweep(system, &mut radiosity, &mut steps);
        residual = residual_bound(system, &steps);
        is_exact = false;
        history.push(residual.largest);
    };
    if !is_exact {
        transport.gather(&radiosity, &mut irradiance);
        residual = system.residual(&radiosity, &irradiance);
        history.pop();
        history.push(residual.largest);
    }
    Solution {
        radiosity,
        irradiance,
        outcome,
        iterations: history.len() - 1,
        residual: residual.largest,
        error_bound: system.error_bound(residual.largest),
        residual_history: history,
    }
}

/// Updates every row in order and leaves the step of each.
fn sweep(system: &System, radiosity: &mut [Radiosity], steps: &mut [Rgb]) {
    let transport = system.transport();
    for i in 0..system.len() {
        let rho = system.reflectance()[i].0;
        let own = transport.coupling(i);
        let old = radiosity[i].0;
        let others = transport.gather_row(i, radiosity).0 - old * own;
        let new = (system.source()[i].0 + rho * others) / (Rgb::ONE - rho * own);
        steps[i] = new - old;
        radiosity[i] = Radiosity(new);
    }
}

/// The size of ρ_i Σ_j F_ij max_{j>i} |δ_j|, an upper bound on the residual after a sweep with steps δ.
fn residual_bound(system: &System, steps: &[Rgb]) -> Residual {
    let mut later = Rgb::ZERO;
    let mut bounds = vec![Rgb::ZERO; steps.len()];
    for i in (0..steps.len()).rev() {
        bounds[i] = system.reflectance()[i].0 * system.transport().row_sum(i) * later;
        later = later.max(steps[i].abs());
    }
    Residual::of(system.areas(), bounds.into_iter())
}

#[cfg(test)]
mod tests {
    use super::super::{Tolerance, direct, jacobi, no_progress};
    use super::*;
    use crate::transport::Dense;
    use luxel_scenes::Reflectance;

    #[test]
    fn it_agrees_with_jacobi_and_lu_with_a_coupled_diagonal() {
        let n = 6;
        // A concave patch sees itself: F_ii > 0; rows sum to 1.
        let entries = (0..n * n)
            .map(|k| if k % (n + 1) == 0 { 0.5 } else { 0.1 })
            .collect();
        let dense = Dense::new(n, entries).expect("a valid matrix");
        let rho: Vec<_> = (0..n)
            .map(|k| Reflectance::new(0.15 * k as f64, 0.5, 0.8))
            .collect();
        let s: Vec<_> = (0..n)
            .map(|k| Radiosity::splat(f64::from(u8::from(k == 2))))
            .collect();
        let areas = vec![1.0; n];
        let system = System::new(&dense, &areas, &rho, &s).expect("a valid system");
        let config = Config {
            tolerance: Tolerance::Error(1e-12),
            max_iterations: 10_000,
        };
        let lu = direct(&system).expect("a regular matrix");
        let gs = gauss_seidel(&system, &config, no_progress);
        let jacobi = jacobi(&system, &config, no_progress);
        assert!(gs.iterations < jacobi.iterations, "newest values help");
        for i in 0..n {
            // Each is within its bound; the bound of LU is rounding.
            let bound = gs.error_bound + lu.error_bound + 1e-14;
            assert!(
                (gs.radiosity[i].0 - lu.radiosity[i].0)
                    .abs()
                    .cmple(bound)
                    .all(),
                "row {i}"
            );
        }
    }

    #[test]
    fn the_bound_of_the_residual_holds_after_every_sweep() {
        let n = 9;
        let entries = (0..n * n)
            .map(|k| ((k * 7 % 13) as f64) / (13.0 * n as f64))
            .collect();
        let dense = Dense::new(n, entries).expect("a valid matrix");
        let rho = vec![Reflectance::splat(0.95); n];
        let mut radiosity = vec![Radiosity::splat(1.0); n];
        let s = radiosity.clone();
        let areas = vec![1.0; n];
        let system = System::new(&dense, &areas, &rho, &s).expect("a valid system");
        let mut steps = vec![Rgb::ZERO; n];
        let mut irradiance = vec![Irradiance::ZERO; n];
        for _ in 0..10 {
            sweep(&system, &mut radiosity, &mut steps);
            system.transport().gather(&radiosity, &mut irradiance);
            let residual = system.residual(&radiosity, &irradiance);
            let bound = residual_bound(&system, &steps);
            // The bound is exact arithmetic; the residual rounds by n units of B.
            assert!(
                residual.largest.cmple(bound.largest + 1e-13).all()
                    && residual.flux.cmple(bound.flux + 1e-12).all(),
                "{residual:?} {bound:?}"
            );
        }
    }
}
