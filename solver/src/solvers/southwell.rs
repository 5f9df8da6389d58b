//! Southwell relaxation, known as progressive shooting or progressive refinement: the unknown with the
//! largest unshot flux A ΔB hands it on,
//!
//! ΔB_i ← ΔB_i + ρ_i F_ij ΔB_j for all i, ΔB_j ← its own part ρ_j F_jj ΔB_j,
//!
//! and what has arrived counts at once: B = X + ΔB, X what was shot.
//!
//! Sources: R. V. Southwell, "Stress-calculation in frameworks by the method of systematic relaxation of
//! constraints", 1935; M. F. Cohen, S. E. Chen, J. R. Wallace, D. P. Greenberg, "A progressive refinement
//! approach to fast radiosity image generation", SIGGRAPH 1988 (the order and the ambient term);
//! S. J. Gortler, M. F. Cohen, P. Slusallek, "Radiosity and relaxation methods", IEEE Computer Graphics and
//! Applications 14, 1994 (that the one is the other: ΔB is the residual of X). Valid for ‖ρF‖∞ < 1: what is
//! shot comes back smaller. Of flux in several channels the largest one decides. Cost of a shot: the
//! column of j and a search over n unknowns, sequential; memory: the columns of F (12 bytes an entry). n
//! shots count as a sweep, and a sweep of shots does as much as one of Gauss–Seidel or a little more;
//! what is special is the first fraction of a sweep, which brings most of the light.
//!
//! The residual is evaluated after every sweep, by one gather. That of B is ρF ΔB, at most
//! ρ_i Σ_j F_ij max |ΔB|; where it is larger, rounding has gathered in the recurrence, and ΔB begins anew
//! from the true residual.

use super::report::Residual;
use super::{Config, Outcome, Progress, Solution, System};
use crate::transport::Columns;
use luxel_scenes::{Irradiance, Radiosity, Rgb};
use std::ops::ControlFlow;

/// What the result contains of light that has not been shot yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ambient {
    /// Nothing beyond what has arrived: B grows monotonically.
    None,
    /// An estimate: the mean of ΔB over all area, reflected on and on between surfaces of mean
    /// reflectance ρ̄, adds ρ_i ΔB̄ / (1 − ρ̄) to each B_i. Better in closed scenes while much is
    /// unshot, too bright in open ones, and nothing once all is shot. It touches the iteration only
    /// where that begins anew from the result.
    Estimated,
}

/// Solves a system by shooting from B = S.
///
/// `progress` is called after each sweep of n shots and may stop the solver.
pub fn southwell(
    system: &System,
    ambient: Ambient,
    config: &Config,
    mut progress: impl FnMut(Progress) -> ControlFlow<()>,
) -> Solution {
    let transport = system.transport();
    let columns = Columns::new(transport);
    let mut shooting = Shooting::new(system);
    let mut irradiance = vec![Irradiance::ZERO; system.len()];
    // What "relative to the start" means does not depend on the ambient estimate.
    transport.gather(system.source(), &mut irradiance);
    let first = system.residual(system.source(), &irradiance);
    let mut history: Vec<Rgb> = Vec::new();
    let (outcome, radiosity) = loop {
        let radiosity = shooting.result(system, ambient);
        transport.gather(&radiosity, &mut irradiance);
        let residual = system.residual(&radiosity, &irradiance);
        history.push(residual.largest);
        let iteration = history.len() - 1;
        let limit = config.tolerance.limit(system, &first, &radiosity);
        if residual.is_within(&limit, 1.0) {
            break (Outcome::Converged, radiosity);
        }
        if iteration >= config.max_iterations {
            break (Outcome::IterationLimit, radiosity);
        }
        if iteration > 0
            && progress(Progress {
                iteration,
                residual: residual.largest,
            })
            .is_break()
        {
            break (Outcome::Interrupted, radiosity);
        }
        if residual.exceeds(&shooting.residual_bound(system, ambient)) {
            shooting.restart(system, &radiosity, &irradiance);
        }
        shooting.sweep(system, &columns);
    };
    let residual = history.last().copied().unwrap_or(Rgb::ZERO);
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

/// Light that has arrived, and the part of it that has not been handed on, in W/m².
struct Shooting {
    /// B.
    radiosity: Vec<Radiosity>,
    /// ΔB.
    unshot: Vec<Rgb>,
}

impl Shooting {
    /// All light is where it is emitted.
    fn new(system: &System) -> Self {
        Self {
            radiosity: system.source().to_vec(),
            unshot: system.source().iter().map(|s| s.0).collect(),
        }
    }

    /// Begins anew from a radiosity that counts as shot, and its residual, `irradiance` being F B.
    fn restart(&mut self, system: &System, radiosity: &[Radiosity], irradiance: &[Irradiance]) {
        self.radiosity.copy_from_slice(radiosity);
        let residuals = system.residuals(radiosity, irradiance);
        for ((b, unshot), r) in self
            .radiosity
            .iter_mut()
            .zip(&mut self.unshot)
            .zip(residuals)
        {
            *unshot = r;
            // Where nothing is reflected r is zero, and B = S holds to the bit.
            b.0 += r;
        }
    }

    /// n shots.
    fn sweep(&mut self, system: &System, columns: &Columns) {
        for _ in 0..system.len() {
            let Some(shooter) = self.brightest(system) else {
                break;
            };
            let shot = std::mem::take(&mut self.unshot[shooter]);
            for (row, factor) in columns.column(shooter) {
                let arrived = system.reflectance()[row].0 * shot * factor;
                self.unshot[row] += arrived;
                self.radiosity[row].0 += arrived;
            }
        }
    }

    /// The first unknown with the largest unshot flux in any channel; `None` when there is none.
    fn brightest(&self, system: &System) -> Option<usize> {
        let (mut brightest, mut largest) = (None, 0.0);
        for (unknown, (unshot, area)) in self.unshot.iter().zip(system.areas()).enumerate() {
            let flux = area * unshot.abs().max_element();
            if flux > largest {
                (brightest, largest) = (Some(unknown), flux);
            }
        }
        brightest
    }

    /// ΔB̄ / (1 − ρ̄) in W/m²: the irradiance that everything unshot is going to make.
    fn ambient(&self, system: &System, ambient: Ambient) -> Rgb {
        let area: f64 = system.areas().iter().sum();
        if ambient == Ambient::None || area == 0.0 {
            return Rgb::ZERO;
        }
        let mean = |values: &mut dyn Iterator<Item = Rgb>| -> Rgb {
            let weighted = values.zip(system.areas()).map(|(value, &a)| value * a);
            weighted.sum::<Rgb>() / area
        };
        let unshot = mean(&mut self.unshot.iter().copied());
        let reflectance = mean(&mut system.reflectance().iter().map(|rho| rho.0));
        unshot / (Rgb::ONE - reflectance)
    }

    /// B with the ambient estimate.
    fn result(&self, system: &System, ambient: Ambient) -> Vec<Radiosity> {
        let ambient = Irradiance(self.ambient(system, ambient));
        let pairs = self.radiosity.iter().zip(system.reflectance());
        pairs.map(|(&b, &rho)| b + rho * ambient).collect()
    }

    /// Bounds on the residual of the result. Without ambient term it is ρF ΔB; a term ρa adds
    /// ρ(Fρ − 1)a, which is at most ρ a for row sums up to 1/ρ.
    fn residual_bound(&self, system: &System, ambient: Ambient) -> Residual {
        let largest = (self.unshot.iter()).fold(Rgb::ZERO, |m, unshot| m.max(unshot.abs()));
        let ambient = self.ambient(system, ambient).abs();
        let rows = system.reflectance().iter().enumerate();
        let bounds =
            rows.map(|(i, rho)| rho.0 * (largest * system.transport().row_sum(i) + ambient));
        Residual::of(system.areas(), bounds)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Tolerance, direct, no_progress};
    use super::*;
    use crate::transport::Dense;
    use luxel_scenes::Reflectance;

    /// A closed scene, the inside of a sphere cut into equal patches.
    fn sphere(n: usize) -> Dense {
        Dense::new(n, vec![1.0 / n as f64; n * n]).expect("a valid matrix")
    }

    fn config(max_iterations: usize) -> Config {
        Config {
            tolerance: Tolerance::Error(1e-12),
            max_iterations,
        }
    }

    #[test]
    fn the_brightest_shoots_first_and_its_light_arrives_at_once() {
        let n = 20;
        let dense = sphere(n);
        let areas = vec![1.0; n];
        let rho = vec![Reflectance::splat(0.5); n];
        let mut s = vec![Radiosity::ZERO; n];
        s[7] = Radiosity::splat(20.0);
        let system = System::new(&dense, &areas, &rho, &s).expect("a valid system");
        let mut shooting = Shooting::new(&system);
        assert_eq!(shooting.brightest(&system), Some(7));
        let columns = Columns::new(&dense);
        let shot = std::mem::take(&mut shooting.unshot[7]);
        for (row, factor) in columns.column(7) {
            shooting.unshot[row] += rho[row].0 * shot * factor;
        }
        // Everyone, the shooter too, received 20/20 and reflects half; the first of equals is next.
        assert!(shooting.unshot.iter().all(|u| *u == Rgb::splat(0.5)));
        assert_eq!(shooting.brightest(&system), Some(0));
    }

    #[test]
    fn the_bound_of_the_residual_holds_after_every_sweep() {
        let n = 9;
        let entries = (0..n * n)
            .map(|k| ((k * 7 % 13) as f64) / (13.0 * n as f64))
            .collect();
        let dense = Dense::new(n, entries).expect("a valid matrix");
        let areas: Vec<f64> = (1..=n).map(|k| k as f64).collect();
        let rho = vec![Reflectance::new(0.95, 0.5, 0.0); n];
        let s = vec![Radiosity::splat(1.0); n];
        let system = System::new(&dense, &areas, &rho, &s).expect("a valid system");
        let columns = Columns::new(&dense);
        for ambient in [Ambient::None, Ambient::Estimated] {
            let mut shooting = Shooting::new(&system);
            for sweep in 0..10 {
                let radiosity = shooting.result(&system, ambient);
                let mut irradiance = vec![Irradiance::ZERO; n];
                system.transport().gather(&radiosity, &mut irradiance);
                let residual = system.residual(&radiosity, &irradiance);
                let bound = shooting.residual_bound(&system, ambient);
                // The bound is exact arithmetic; the residual rounds by n units of B.
                assert!(
                    residual.largest.cmple(bound.largest + 1e-13).all()
                        && residual.flux.cmple(bound.flux + 1e-12).all(),
                    "sweep {sweep}, {ambient:?}: {residual:?} {bound:?}"
                );
                shooting.sweep(&system, &columns);
            }
        }
    }

    #[test]
    fn the_ambient_estimate_is_exact_where_all_see_all_alike() {
        // In a sphere the mean is everywhere: before any shot the result is the solution.
        let n = 12;
        let dense = sphere(n);
        let areas = vec![1.0; n];
        let rho: Vec<_> = (0..n)
            .map(|k| Reflectance::new(0.08 * k as f64, 0.9, 0.0))
            .collect();
        let mut s = vec![Radiosity::ZERO; n];
        s[3] = Radiosity::new(1.0, 2.0, 3.0);
        let system = System::new(&dense, &areas, &rho, &s).expect("a valid system");
        let exact = direct(&system).expect("a regular matrix").radiosity;
        let error = |ambient, sweeps| {
            let solution = southwell(&system, ambient, &config(sweeps), no_progress);
            let pairs = solution.radiosity.iter().zip(&exact);
            let largest = pairs.fold(Rgb::ZERO, |m, (b, e)| m.max((b.0 - e.0).abs()));
            // A bound that is itself rounding says nothing of rounding.
            assert!(
                largest.cmple(solution.error_bound + 1e-13).all(),
                "{largest} against {}",
                solution.error_bound
            );
            largest.max_element()
        };
        assert!(error(Ambient::Estimated, 0) < 1e-13, "exact at once");
        assert!(error(Ambient::None, 0) > 0.1, "dark without it");
        assert!(error(Ambient::None, 1000) < 1e-11, "and in the end");
    }
}
