//! Jacobi iteration: B ← S + ρ F B, all rows from the same old B.
//!
//! Sources: C. M. Goral, K. E. Torrance, D. P. Greenberg, B. Battaile, "Modeling the interaction of
//! light between diffuse surfaces", SIGGRAPH 1984 (the system); any text on iterative methods. From
//! B = S the k-th iterate is the light of up to k bounces, so that B grows monotonically. Valid for
//! ‖ρF‖∞ < 1; the residual shrinks by ‖ρF‖∞ or better per sweep, by exactly ρ in a closed scene of
//! uniform ρ. Cost: one gather per sweep, parallel; the residual of an iterate is the step to the
//! next one and comes for free.

use super::{Config, Outcome, Progress, Solution, System};
use luxel_scenes::{Irradiance, Rgb};
use std::ops::ControlFlow;

/// Solves a system by Jacobi's iteration from B = S.
///
/// `progress` is called after each sweep and may stop the solver.
pub fn jacobi(
    system: &System,
    config: &Config,
    mut progress: impl FnMut(Progress) -> ControlFlow<()>,
) -> Solution {
    let mut radiosity = system.source().to_vec();
    let mut irradiance = vec![Irradiance::ZERO; system.len()];
    let mut history: Vec<Rgb> = Vec::new();
    let mut first = None;
    let (outcome, residual) = loop {
        system.transport().gather(&radiosity, &mut irradiance);
        let residual = system.residual(&radiosity, &irradiance);
        history.push(residual.largest);
        let iteration = history.len() - 1;
        let first = first.get_or_insert(residual);
        let limit = config.tolerance.limit(system, first, &radiosity);
        if residual.is_within(&limit, 1.0) {
            break (Outcome::Converged, residual.largest);
        }
        if iteration >= config.max_iterations {
            break (Outcome::IterationLimit, residual.largest);
        }
        if iteration > 0
            && progress(Progress {
                iteration,
                residual: residual.largest,
            })
            .is_break()
        {
            break (Outcome::Interrupted, residual.largest);
        }
        for (((b, &s), &rho), &e) in radiosity
            .iter_mut()
            .zip(system.source())
            .zip(system.reflectance())
            .zip(&irradiance)
        {
            *b = s + rho * e;
        }
    };
    Solution {
        radiosity,
        irradiance,
        outcome,
        iterations: history.len() - 1,
        residual,
        error_bound: system.error_bound(residual),
        residual_history: history,
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Tolerance, no_progress};
    use super::*;
    use crate::transport::{Dense, Transport};
    use luxel_scenes::{Radiosity, Reflectance};

    /// Five patches that each see the others equally: a closed scene.
    fn closed() -> Dense {
        let entries = (0..25)
            .map(|k| if k % 6 == 0 { 0.0 } else { 0.25 })
            .collect();
        Dense::new(5, entries).expect("a valid matrix")
    }

    #[test]
    fn iterates_grow_monotonically_from_the_source() {
        let dense = closed();
        let rho = [
            Reflectance::new(0.9, 0.5, 0.1),
            Reflectance::splat(0.3),
            Reflectance::splat(0.99),
            Reflectance::ZERO,
            Reflectance::splat(0.6),
        ];
        let mut s = [Radiosity::ZERO; 5];
        s[1] = Radiosity::new(1.0, 2.0, 3.0);
        let system = System::new(&dense, &[1.0; 5], &rho, &s).expect("a valid system");
        let mut last = s.to_vec();
        for max_iterations in 1..60 {
            let config = Config {
                tolerance: Tolerance::Error(0.0),
                max_iterations,
            };
            let solution = jacobi(&system, &config, no_progress);
            for (new, old) in solution.radiosity.iter().zip(&last) {
                // Sums of five rounded products grow up to a few units of rounding.
                assert!(
                    new.0.cmpge(old.0 * (1.0 - 8.0 * f64::EPSILON)).all(),
                    "sweep {max_iterations}"
                );
            }
            last = solution.radiosity;
        }
    }

    #[test]
    fn the_residual_shrinks_by_exactly_rho_in_a_uniform_closed_scene() {
        let dense = closed();
        let rho = [Reflectance::splat(0.5); 5];
        let s = [Radiosity::splat(1.0); 5];
        let system = System::new(&dense, &[1.0; 5], &rho, &s).expect("a valid system");
        let config = Config {
            tolerance: Tolerance::Residual(1e-6),
            max_iterations: 100,
        };
        let solution = jacobi(&system, &config, no_progress);
        assert_eq!(solution.iterations, 20, "0.5^20 < 1e-6 < 0.5^19");
        for pair in solution.residual_history.windows(2) {
            assert!((pair[1] / pair[0] - 0.5).abs().max_element() < 1e-9, "rate");
        }
        // B = S / (1 - rho) = 2, within the stated bound.
        let error = (solution.radiosity[0].0 - 2.0).abs().max_element();
        assert!(
            error <= solution.error_bound.x * (1.0 + 1e-9),
            "{error} against the bound {}",
            solution.error_bound.x
        );
    }

    #[test]
    fn a_black_channel_keeps_its_source_to_the_bit() {
        let dense = closed();
        let rho = [Reflectance::new(0.8, 0.0, 0.8); 5];
        let s = [0.1, 0.2, 0.3, 0.4, 0.7].map(Radiosity::splat);
        let system = System::new(&dense, &[1.0; 5], &rho, &s).expect("a valid system");
        let config = Config {
            tolerance: Tolerance::Error(1e-9),
            max_iterations: 1000,
        };
        let solution = jacobi(&system, &config, no_progress);
        assert_eq!(solution.outcome, Outcome::Converged, "converges");
        for (b, s) in solution.radiosity.iter().zip(&s) {
            assert_eq!(b.0.y.to_bits(), s.0.y.to_bits(), "green is black");
        }
    }

    #[test]
    fn progress_can_stop_it() {
        let dense = closed();
        let rho = [Reflectance::splat(0.9); 5];
        let s = [Radiosity::splat(1.0); 5];
        let system = System::new(&dense, &[1.0; 5], &rho, &s).expect("a valid system");
        let config = Config {
            tolerance: Tolerance::Error(1e-9),
            max_iterations: 1000,
        };
        let solution = jacobi(&system, &config, |p| {
            if p.iteration < 3 {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(())
            }
        });
        assert_eq!(solution.outcome, Outcome::Interrupted, "stopped");
        assert_eq!(solution.iterations, 3, "after three sweeps");
        assert!(dense.len() == 5, "the operator is left alone");
    }
}
