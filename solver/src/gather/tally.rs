//! What the rays of a receiver add up to, and how wrong it is.
//!
//! With x_gs the light that gather randomisation g finds when it looks up solution s, the result is
//! the mean over all g and s, and
//!
//!   Var = Var_g(mean over s) / G + Var_s(mean over g) / S,
//!
//! because gathers and solutions are independent of each other (crossed random effects; the
//! interaction is counted twice, which is on the safe side and small). Direct light has its own
//! randomisations and a term of its own. Each scatter has G − 1 or S − 1 degrees of freedom and is
//! [moderated](crate::error::moderate) by those of all receivers.
//!
//! The discretisation error is judged from D, the light looked up in the mesh less that looked up in
//! a coarser one at the same hits ([`crate::error::discretisation`]).
//!
//! Source: S. R. Searle, G. Casella, C. E. McCulloch, "Variance Components", 1992 (crossed effects).

use super::lookup::{MAX_REPLICATES, PerSolution};
use crate::error::{discretisation, moderate};
use luxel_scenes::{Irradiance, Rgb};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Exponent with which the noise of direct light falls with its shadow rays, measured on the reference scenes
/// (0.6–0.75).
pub(crate) const SHADOW_EXPONENT: f64 = 0.7;

/// Sums over the rays of a receiver. Tallies of the same receiver from different rays can be joined.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Tally {
    /// Direct irradiance by gather: from shadow rays, a mean.
    pub(super) direct: [Rgb; MAX_REPLICATES],
    /// What the variance of the mean of these is expected to be, but for a factor that is the same at all receivers
    /// with as many shadow rays, in W²/m⁴ ([`crate::direct::Lit`]).
    pub(super) direct_variance: Rgb,
    /// Direct light that gather rays found, a sum over rays by gather.
    pub(super) found: [Rgb; MAX_REPLICATES],
    /// Indirect light, a sum over rays by gather; the mean over solutions.
    pub(super) indirect: [Rgb; MAX_REPLICATES],
    /// The same by solution, over the rays of all gathers.
    pub(super) by_solution: PerSolution,
    /// Light looked up less that of the coarser mesh, over the rays of all gathers.
    pub(super) difference: PerSolution,
    /// Sum of the squares of what rays found.
    pub(super) squares: Rgb,
    /// Rays of each gather.
    pub(super) rays: u32,
    /// Shadow rays of each gather.
    pub(super) shadow_rays: u32,
    /// Rays that met the back of a one-sided face.
    pub(super) backs: u32,
    /// Independent gathers.
    pub(super) gathers: u8,
    /// Solutions.
    pub(super) solutions: u8,
    /// Receivers that share the noise of the gather rays with this one, itself included, once they are
    /// joined; zero before.
    pub(super) shared: f64,
}

/// Irradiance at a receiver with its error.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Gathered {
    /// Direct irradiance in W/m².
    pub direct: Irradiance,
    /// Indirect irradiance in W/m².
    pub indirect: Irradiance,
    /// Standard error of the direct light's shadow rays in W/m².
    pub direct_noise: Irradiance,
    /// Standard error of the gather's rays in W/m².
    pub gather_noise: Irradiance,
    /// Standard error that the noise of the solutions leaves, in W/m².
    pub solution_noise: Irradiance,
    /// Estimated error of the mesh in W/m²: what its difference from the coarser mesh suggests, here
    /// and at all receivers. Zero without a coarser mesh.
    pub discretisation: Irradiance,
    /// Fraction of the rays that met the back of a one-sided face: near one inside a solid.
    pub back_fraction: f64,
}

impl Gathered {
    /// Direct and indirect irradiance together, in W/m².
    pub fn irradiance(&self) -> Irradiance {
        self.direct + self.indirect
    }

    /// Standard error of sampling (direct, gather and solution) in W/m².
    pub fn sampling(&self) -> Irradiance {
        let parts = [self.direct_noise, self.gather_noise, self.solution_noise];
        quadrature(&parts)
    }

    /// Standard error in W/m²: sampling and discretisation.
    pub fn standard_error(&self) -> Irradiance {
        quadrature(&[self.sampling(), self.discretisation])
    }
}

/// The root of the sum of squares, by channel.
fn quadrature(parts: &[Irradiance]) -> Irradiance {
    let squares: Rgb = parts.iter().map(|part| part.0 * part.0).sum();
    Irradiance(squares.map(f64::sqrt))
}

impl Tally {
    /// Adds further rays of the same receiver, gathers and solutions. Direct light from shadow rays
    /// is that of whichever of the two has it; `other`'s counts when both have.
    ///
    /// # Panics
    /// When gathers or solutions are not as many.
    pub fn join(&mut self, other: &Self) {
        if self.gathers == 0 {
            *self = *other;
            return;
        }
        assert_eq!(self.gathers, other.gathers, "as many gathers");
        if other.solutions > 0 {
            assert!(
                self.solutions == 0 || self.solutions == other.solutions,
                "as many solutions"
            );
            self.solutions = other.solutions;
        }
        if other.shadow_rays > 0 {
            self.direct = other.direct;
            self.direct_variance = other.direct_variance;
            self.shadow_rays = other.shadow_rays;
        }
        for r in 0..MAX_REPLICATES {
            self.found[r] += other.found[r];
            self.indirect[r] += other.indirect[r];
            self.by_solution[r] += other.by_solution[r];
            self.difference[r] += other.difference[r];
        }
        self.squares += other.squares;
        self.rays += other.rays;
        self.backs += other.backs;
    }

    /// Notes that the noise of direct light is expected to be in proportion to that light where there is any: of
    /// rays for the sky no more is known. Without any scatter a receiver sees each light wholly or not at all.
    pub(super) fn expect_noise_as_light(&mut self) {
        let used = &self.direct[..usize::from(self.gathers)];
        let scatters = used.iter().any(|direct| *direct != used[0]);
        let mean = used.iter().sum::<Rgb>() / used.len() as f64;
        self.direct_variance = if scatters { mean * mean } else { Rgb::ZERO };
    }

    /// A tally of so many shadow rays of each gather, with an expected variance, for tests.
    #[cfg(test)]
    pub(crate) fn with_direct_variance(variance: Rgb, shadow_rays: u32, gathers: u8) -> Self {
        Self {
            direct_variance: variance,
            shadow_rays,
            gathers,
            ..Self::default()
        }
    }

    /// Shadow rays of all gathers.
    pub(crate) fn all_shadow_rays(&self) -> usize {
        self.shadow_rays as usize * usize::from(self.gathers)
    }

    /// What does not depend on a mesh: the direct light that shadow rays found.
    #[must_use]
    pub(crate) fn direct_alone(&self) -> Self {
        Self {
            direct: self.direct,
            direct_variance: self.direct_variance,
            shadow_rays: self.shadow_rays,
            gathers: self.gathers,
            ..Self::default()
        }
    }

    /// Expected variance of direct light, but for a factor that is the same at all receivers: even samples lessen
    /// it faster than one over their number.
    pub(crate) fn expected_direct_variance(&self) -> Rgb {
        let shadow_rays = f64::from(self.shadow_rays.max(1));
        self.direct_variance * shadow_rays.powf(1.0 - 2.0 * SHADOW_EXPONENT)
    }

    /// Direct and indirect irradiance in W/m².
    pub fn irradiance(&self) -> Irradiance {
        self.means().irradiance()
    }

    /// Irradiance less that which a coarser mesh would give, in W/m²; zero without a coarser mesh.
    pub fn mesh_difference(&self) -> Irradiance {
        let looked_up = f64::from(self.rays) * f64::from(self.gathers) * f64::from(self.solutions);
        Irradiance(self.difference.iter().sum::<Rgb>() / looked_up.max(1.0))
    }

    /// The means, without errors.
    pub(super) fn means(&self) -> Gathered {
        let gathers = usize::from(self.gathers).max(1);
        let rays = f64::from(self.rays.max(1));
        let mean =
            |sums: &[Rgb; MAX_REPLICATES]| sums[..gathers].iter().sum::<Rgb>() / gathers as f64;
        Gathered {
            direct: Irradiance(mean(&self.direct) + mean(&self.found) / rays),
            indirect: Irradiance(mean(&self.indirect) / rays),
            back_fraction: f64::from(self.backs) / (rays * gathers as f64),
            ..Gathered::default()
        }
    }
}

/// Tallies that one thread takes at a time.
const AT_ONCE: usize = 1024;

/// The means of all tallies, without errors.
pub(super) fn means(tallies: &[Tally]) -> Vec<Gathered> {
    let all = tallies.par_iter().with_min_len(AT_ONCE);
    all.map(Tally::means).collect()
}

/// Values with their errors, moderated over all the tallies.
pub fn finish(tallies: &[Tally]) -> Vec<Gathered> {
    let mut gathered = means(tallies);
    for channel in 0..3 {
        let [direct, gather, solution, mesh] =
            Scatters::new(tallies, &gathered, channel).moderated();
        for (index, gathered) in gathered.iter_mut().enumerate() {
            gathered.direct_noise.0[channel] = direct[index].sqrt();
            gathered.gather_noise.0[channel] = gather[index].sqrt();
            gathered.solution_noise.0[channel] = solution[index].sqrt();
            gathered.discretisation.0[channel] = mesh[index].sqrt();
        }
    }
    gathered
}

/// What the errors of all receivers in one channel are judged from: variances of means, with what
/// they are expected to be in proportion to.
pub(super) struct Scatters {
    gathers: u8,
    solutions: u8,
    pub(super) direct: Vec<f64>,
    direct_level: Vec<f64>,
    pub(super) gather: Vec<f64>,
    of_rays: Vec<f64>,
    pub(super) solution: Vec<f64>,
    pub(super) indirect_level: Vec<f64>,
    pub(super) differences: Vec<(f64, f64)>,
}

impl Scatters {
    pub(super) fn new(tallies: &[Tally], gathered: &[Gathered], channel: usize) -> Self {
        let gathers = tallies.first().map_or(0, |tally| tally.gathers);
        let solutions = tallies.iter().map(|t| t.solutions).max().unwrap_or(0);
        let by = |value: &(dyn Fn(&Tally, &Gathered) -> f64 + Sync)| -> Vec<f64> {
            let all = tallies.par_iter().zip(gathered).with_min_len(AT_ONCE);
            all.map(|(tally, gathered)| value(tally, gathered))
                .collect()
        };
        let count = |tally: &Tally| f64::from(tally.rays.max(1)) * f64::from(gathers.max(1));
        Self {
            gathers,
            solutions,
            direct: by(&|tally, _| scatter(&tally.direct, gathers, channel)),
            direct_level: by(&|tally, _| tally.expected_direct_variance()[channel]),
            gather: by(&|tally, _| {
                let sums: [Rgb; MAX_REPLICATES] =
                    std::array::from_fn(|g| tally.found[g] + tally.indirect[g]);
                scatter(&sums, gathers, channel) / f64::from(tally.rays.max(1)).powi(2)
            }),
            // The variance of single rays: even samples lessen it by about the same factor
            // everywhere.
            of_rays: by(&|tally, _| {
                let sum: Rgb = tally.found.iter().chain(&tally.indirect).sum();
                let count = count(tally);
                let variance = tally.squares[channel] / count - (sum[channel] / count).powi(2);
                variance.max(0.0) / count
            }),
            solution: by(&|tally, _| {
                scatter(&tally.by_solution, solutions, channel) / count(tally).powi(2)
            }),
            indirect_level: by(&|_, gathered| gathered.indirect.0[channel].powi(2)),
            differences: tallies
                .par_iter()
                .with_min_len(AT_ONCE)
                .map(|tally| {
                    let noise =
                        scatter(&tally.difference, solutions, channel) / count(tally).powi(2);
                    (tally.mesh_difference().0[channel], noise)
                })
                .collect(),
        }
    }

    /// Squared errors of each receiver: direct, gather, solution, mesh.
    fn moderated(&self) -> [Vec<f64>; 4] {
        let by = |scatters: &[f64], expected: &[f64], replicates: u8| {
            if replicates < 2 {
                vec![0.0; scatters.len()]
            } else {
                moderate(scatters, expected, u32::from(replicates) - 1)
            }
        };
        [
            by(&self.direct, &self.direct_level, self.gathers),
            by(&self.gather, &self.of_rays, self.gathers),
            by(&self.solution, &self.indirect_level, self.solutions),
            discretisation(&self.differences, &self.indirect_level),
        ]
    }
}

/// Variance of the mean of the first `count` values, from their scatter; zero for fewer than two.
fn scatter(values: &[Rgb; MAX_REPLICATES], count: u8, channel: usize) -> f64 {
    let values = &values[..usize::from(count)];
    if values.len() < 2 {
        return 0.0;
    }
    let n = values.len() as f64;
    let mean = values.iter().map(|value| value[channel]).sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v[channel] - mean).powi(2)).sum();
    squares / (n * (n - 1.0))
}
