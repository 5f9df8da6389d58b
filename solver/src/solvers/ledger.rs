//! The energy ledger: where the flux goes, in W per channel.
//!
//! With B = S + ρE − r, E = F B and S = M + ρ E^direct, summing A B over all unknowns gives
//!
//! emitted + direct = absorbed + escaped + defect + residual,
//!
//! | entry | value |
//! |---|---|
//! | emitted | Σ A M |
//! | direct | Σ A E^direct: what lights that are not patches deliver |
//! | absorbed | Σ A (1 − ρ)(E + E^direct) |
//! | escaped | Σ A B (1 − Σ_j F_ij): leaves through the openings of the scene |
//! | defect | Σ_j B_j (A_j Σ_i F_ji − Σ_i A_i F_ij): made or lost because A_i F_ij ≠ A_j F_ji |
//! | residual | Σ A r: what the unconverged iteration leaves |
//!
//! The identity is algebraic: it closes to rounding for any F and any B, so that an imbalance means a
//! bug, while defect and residual are the errors of form factors and of the solver.

use super::{Solution, System};
use luxel_scenes::{Exitance, Flux, Irradiance, Reflectance, Rgb};

/// Where the flux of a solution comes from and goes to, in W per channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ledger {
    /// Σ A M: emitted by patches.
    pub emitted: Flux,
    /// Σ A E^direct: delivered to patches by lights that are not patches.
    pub direct: Flux,
    /// Σ A (1 − ρ)(E + E^direct): absorbed by patches.
    pub absorbed: Flux,
    /// Σ A B (1 − Σ_j F_ij): leaves the scene; negative when rows sum to more than 1.
    pub escaped: Flux,
    /// What non-reciprocal form factors lose (positive) or make (negative).
    pub defect: Flux,
    /// Σ A r: what the unconverged iteration has not handed on yet.
    pub residual: Flux,
}

impl Ledger {
    /// The ledger of a solution. `emission` M and `direct` E^direct in W/m² of each unknown; the
    /// system's source must be S = M + ρ E^direct.
    ///
    /// # Panics
    /// When a slice does not have one element per unknown.
    pub fn new(
        system: &System,
        solution: &Solution,
        emission: &[Exitance],
        direct: &[Irradiance],
    ) -> Self {
        let n = system.len();
        assert_eq!(emission.len(), n, "one emission per unknown");
        assert_eq!(direct.len(), n, "one direct irradiance per unknown");
        let mut ledger = Self {
            emitted: Flux::ZERO,
            direct: Flux::ZERO,
            absorbed: Flux::ZERO,
            escaped: Flux::ZERO,
            defect: Flux::ZERO,
            residual: Flux::ZERO,
        };
        let residuals = system.residuals(&solution.radiosity, &solution.irradiance);
        for (i, r) in residuals.enumerate() {
            let area = system.areas()[i];
            let Reflectance(rho) = system.reflectance()[i];
            let b = solution.radiosity[i].0;
            let e = solution.irradiance[i].0;
            let row_sum = system.transport().row_sum(i);
            ledger.emitted.0 += emission[i].0 * area;
            ledger.direct.0 += direct[i].0 * area;
            ledger.absorbed.0 += (Rgb::ONE - rho) * (e + direct[i].0) * area;
            ledger.escaped.0 += b * (1.0 - row_sum) * area;
            ledger.defect.0 += (b * row_sum - e) * area;
            ledger.residual.0 += r * area;
        }
        ledger
    }

    /// The mean of the ledgers of independent solutions.
    ///
    /// # Panics
    /// When there is none.
    pub fn mean(ledgers: &[Self]) -> Self {
        assert!(!ledgers.is_empty(), "a ledger to take the mean of");
        let mean = |entry: fn(&Self) -> Flux| {
            let sum: Rgb = ledgers.iter().map(|ledger| entry(ledger).0).sum();
            Flux(sum / ledgers.len() as f64)
        };
        Self {
            emitted: mean(|ledger| ledger.emitted),
            direct: mean(|ledger| ledger.direct),
            absorbed: mean(|ledger| ledger.absorbed),
            escaped: mean(|ledger| ledger.escaped),
            defect: mean(|ledger| ledger.defect),
            residual: mean(|ledger| ledger.residual),
        }
    }

    /// (in − out) / in per channel, where in = emitted + direct and out is everything else: zero to
    /// rounding. Zero in a channel without light.
    pub fn imbalance(&self) -> Rgb {
        let given = self.emitted.0 + self.direct.0;
        let taken = self.absorbed.0 + self.escaped.0 + self.defect.0 + self.residual.0;
        relative(given - taken, given)
    }

    /// The share of the light that form factors and solver account for wrongly: (|defect| +
    /// |residual|) / in per channel. Zero in a channel without light.
    pub fn unaccounted(&self) -> Rgb {
        let given = self.emitted.0 + self.direct.0;
        relative(self.defect.0.abs() + self.residual.0.abs(), given)
    }
}

/// a / b per channel, zero where b is zero.
fn relative(a: Rgb, b: Rgb) -> Rgb {
    Rgb::select(b.cmpeq(Rgb::ZERO), Rgb::ZERO, a / b)
}

#[cfg(test)]
mod tests {
    use super::super::{Config, Tolerance, gauss_seidel, no_progress, source};
    use super::*;
    use crate::transport::Dense;

    #[test]
    fn it_closes_for_any_factors_and_any_state_of_convergence() {
        let n = 8;
        // Neither closed nor reciprocal.
        let entries = (0..n * n)
            .map(|k| ((k * 5 % 11) as f64) / (12.0 * n as f64))
            .collect();
        let dense = Dense::new(n, entries).expect("a valid matrix");
        let rho: Vec<_> = (0..n)
            .map(|k| Reflectance::new(0.1 * k as f64, 0.9, 0.0))
            .collect();
        let areas: Vec<_> = (1..=n).map(|k| k as f64).collect();
        let emission: Vec<_> = (0..n).map(|k| Exitance::splat((k % 3) as f64)).collect();
        let direct: Vec<_> = (0..n).map(|k| Irradiance::splat((k % 2) as f64)).collect();
        let s = source(&emission, &rho, &direct);
        let system = System::new(&dense, &areas, &rho, &s).expect("a valid system");
        for max_iterations in [0, 1, 3, 1000] {
            let config = Config {
                tolerance: Tolerance::Error(1e-10),
                max_iterations,
            };
            let solution = gauss_seidel(&system, &config, no_progress);
            let ledger = Ledger::new(&system, &solution, &emission, &direct);
            // Sums of eight terms of either sign, a few units of rounding each.
            assert!(
                ledger.imbalance().abs().max_element() < 1e-13,
                "{max_iterations} sweeps: {}",
                ledger.imbalance()
            );
            assert!(ledger.escaped.0.min_element() > 0.0, "the scene is open");
        }
    }

    #[test]
    fn darkness_balances() {
        let dense = Dense::new(1, vec![0.0]).expect("a valid matrix");
        let s = [luxel_scenes::Radiosity::ZERO];
        let system = System::new(&dense, &[1.0], &[Reflectance::ZERO], &s).expect("a valid system");
        let solution = super::super::direct(&system).expect("a regular matrix");
        let ledger = Ledger::new(&system, &solution, &[Exitance::ZERO], &[Irradiance::ZERO]);
        assert_eq!(ledger.imbalance(), Rgb::ZERO, "no light");
    }
}
