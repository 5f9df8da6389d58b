//! The error of a radiosity solution in its three parts, by patch and in all.
//!
//! Of each patch: the sampling error from the scatter of independent replicates of the whole chain
//! (rows, direct light, solve), moderated by all patches, since four replicates alone know little
//! ([`error::moderate`]); the discretisation error from parents against children
//! ([`error::discretisation`]); the solver's from its rigorous bound. They are combined as
//! independent: e² = sampling² + discretisation² + solver². In all: the root of the area-weighted
//! mean of the squares, over the area-weighted mean irradiance. Patches inside solids receive
//! nothing and do not count.

use luxel_scenes::{Irradiance, Rgb};
use luxel_solver::error;

/// A part of the error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// What the iteration leaves.
    Solver,
    /// Noise of rays.
    Sampling,
    /// Patches of finite size.
    Discretisation,
}

impl Part {
    /// Its name in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Solver => "solver",
            Self::Sampling => "sampling",
            Self::Discretisation => "discretisation",
        }
    }
}

/// Estimated errors, root mean square over the patches' areas relative to the mean irradiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativeErrors {
    /// Bound on what the iteration leaves.
    pub solver: f64,
    /// Standard error; `None` where the method's error is no noise (hemicubes).
    pub sampling: Option<f64>,
    /// One standard deviation of what finite patches cost.
    pub discretisation: f64,
}

impl RelativeErrors {
    /// All parts together.
    pub fn total(&self) -> f64 {
        let sampling = self.sampling.unwrap_or(0.0);
        (self.solver.powi(2) + sampling.powi(2) + self.discretisation.powi(2)).sqrt()
    }

    /// The largest part.
    pub fn dominant(&self) -> Part {
        let sampling = self.sampling.unwrap_or(0.0);
        if self.solver > sampling.max(self.discretisation) {
            Part::Solver
        } else if self.discretisation > sampling {
            Part::Discretisation
        } else {
            Part::Sampling
        }
    }
}

/// The irradiance of patches (or other receivers) with its error, by channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Accuracy {
    /// Mean over the replicates in W/m².
    pub irradiance: Vec<Irradiance>,
    /// Square of the standard error from sampling.
    pub sampling: Vec<Rgb>,
    /// Square of the error from finite patches.
    pub discretisation: Vec<Rgb>,
}

/// What [`error::discretisation`] is told of a difference between meshes that share their rays: it is
/// tuned for points, which see more of what patches hide than the means over patches do. Measured
/// (error over difference, with this and its own factor 0.5): cornell 0.29–0.52 at 600 to 5000
/// patches, corridor 0.38–0.54. Smaller, and the estimate would be too low where it is needed.
const RECEIVER_SHARE: f64 = 0.7;

/// Independent replicates of one receiver's value, each with its difference from larger patches.
pub struct Replicates {
    /// Value of each replicate.
    pub values: Vec<Rgb>,
    /// What larger patches would have given less, in each.
    pub coarsening: Vec<Rgb>,
}

impl Accuracy {
    /// Memory of the accuracy of so many receivers, in bytes, while it is judged from so many replicates of each.
    pub fn bytes_for(receivers: usize, replicates: usize) -> usize {
        let judging = size_of::<Replicates>()
            + 2 * replicates * size_of::<Rgb>()
            + 2 * size_of::<(Rgb, Rgb)>()
            + size_of::<[f64; 10]>();
        receivers * (3 * size_of::<Rgb>() + if replicates > 0 { judging } else { 0 })
    }

    /// The accuracy of receivers from at least two replicates of each.
    ///
    /// # Panics
    /// With fewer than two replicates.
    pub fn of(receivers: &[Replicates]) -> Self {
        let statistics = |pick: fn(&Replicates) -> &Vec<Rgb>| -> Vec<(Rgb, Rgb)> {
            receivers
                .iter()
                .map(|r| mean_and_scatter(pick(r)))
                .collect()
        };
        let values = statistics(|r| &r.values);
        let differences = statistics(|r| &r.coarsening);
        let degrees = receivers.first().map_or(1, |r| r.values.len() as u32 - 1);
        let count = receivers.len().max(1) as f64;
        let mean = values.iter().map(|(mean, _)| *mean).sum::<Rgb>() / count;
        let mut accuracy = Self {
            irradiance: values.iter().map(|(mean, _)| Irradiance(*mean)).collect(),
            sampling: vec![Rgb::ZERO; values.len()],
            discretisation: vec![Rgb::ZERO; values.len()],
        };
        for channel in 0..3 {
            let scatters: Vec<f64> = values.iter().map(|(_, s)| s[channel]).collect();
            // Rays count light like events: variances grow with the light itself.
            let expected: Vec<f64> = values
                .iter()
                .map(|(own, _)| (own[channel] * mean[channel]).max(0.0))
                .collect();
            let moderated = error::moderate(&scatters, &expected, degrees);
            let scale = RECEIVER_SHARE;
            let pairs: Vec<(f64, f64)> = differences
                .iter()
                .map(|(d, noise)| (scale * d[channel], scale * scale * noise[channel]))
                .collect();
            let levels: Vec<f64> = values.iter().map(|(own, _)| own[channel].powi(2)).collect();
            let squared = error::discretisation(&pairs, &levels);
            for (index, (variance, square)) in moderated.into_iter().zip(squared).enumerate() {
                accuracy.sampling[index][channel] = variance;
                accuracy.discretisation[index][channel] = square;
            }
        }
        accuracy
    }

    /// The accuracy of each patch from at least two replicates of its irradiance, and from what larger
    /// patches would have given less, both by replicate and patch.
    ///
    /// # Panics
    /// With fewer than two replicates.
    pub fn of_patches(irradiance: &[Vec<Irradiance>], coarsening: &[Vec<Irradiance>]) -> Self {
        let of = |from: &[Vec<Irradiance>], patch: usize| -> Vec<Rgb> {
            from.iter().map(|values| values[patch].0).collect()
        };
        let patches = irradiance.first().map_or(0, Vec::len);
        let receivers: Vec<Replicates> = (0..patches)
            .map(|patch| Replicates {
                values: of(irradiance, patch),
                coarsening: of(coarsening, patch),
            })
            .collect();
        Self::of(&receivers)
    }

    /// One standard deviation of everything but the solver, by receiver and channel.
    pub fn standard_error(&self) -> impl Iterator<Item = Irradiance> + '_ {
        self.sampling
            .iter()
            .zip(&self.discretisation)
            .map(|(sampling, discretisation)| {
                Irradiance((*sampling + *discretisation).map(f64::sqrt))
            })
    }

    /// The errors in all, with receivers of the given weights (areas) and the solver's bound.
    pub fn relative(&self, weights: &[f64], solver: Rgb) -> RelativeErrors {
        let grey = |value: &Rgb| value.element_sum() / 3.0;
        let mean = |values: &mut dyn Iterator<Item = f64>| -> f64 {
            let sum: f64 = values
                .zip(weights)
                .map(|(value, weight)| value * weight)
                .sum();
            sum / weights.iter().sum::<f64>()
        };
        let level = mean(&mut self.irradiance.iter().map(|e| grey(&e.0)));
        if level.is_nan() || level <= 0.0 {
            return RelativeErrors {
                solver: 0.0,
                sampling: Some(0.0),
                discretisation: 0.0,
            };
        }
        RelativeErrors {
            solver: solver.max_element() / level,
            sampling: Some(mean(&mut self.sampling.iter().map(grey)).sqrt() / level),
            discretisation: mean(&mut self.discretisation.iter().map(grey)).sqrt() / level,
        }
    }
}

/// Mean of at least two values and the variance of that mean.
fn mean_and_scatter(values: &[Rgb]) -> (Rgb, Rgb) {
    assert!(values.len() > 1, "a scatter needs two values");
    let count = values.len() as f64;
    let mean = values.iter().sum::<Rgb>() / count;
    let squares: Rgb = values.iter().map(|v| (*v - mean) * (*v - mean)).sum();
    (mean, squares / (count * (count - 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn parts_add_in_squares_and_the_largest_dominates() {
        let errors = RelativeErrors {
            solver: 0.0,
            sampling: Some(0.03),
            discretisation: 0.04,
        };
        assert!((errors.total() - 0.05).abs() < 1e-15);
        assert_eq!(errors.dominant(), Part::Discretisation);
    }

    #[test]
    fn exact_replicates_have_no_error() {
        let receiver = || Replicates {
            values: vec![DVec3::new(2.0, 1.0, 0.5); 4],
            coarsening: vec![DVec3::ZERO; 4],
        };
        let accuracy = Accuracy::of(&[receiver(), receiver()]);
        assert_eq!(accuracy.irradiance[0].0, DVec3::new(2.0, 1.0, 0.5));
        let relative = accuracy.relative(&[1.0, 3.0], Rgb::ZERO);
        assert!(relative.total() < 1e-12, "{relative:?}");
    }

    #[test]
    fn no_light_is_no_error() {
        let accuracy = Accuracy::of(&[]);
        assert!(accuracy.relative(&[], Rgb::ZERO).total() < 1e-300);
    }
}
