//! Coefficients with their errors, and the error of the irradiance that they describe.
//!
//! The scatter of four replicates is that of all noise. Where one coefficient of a place is noisy the others are too, so that
//! the scatters of each are [moderated](crate::error::moderate) towards a share of the sum of them all, the same everywhere.
//! What patches of finite size leave is judged from the difference from a coarser mesh ([`crate::error::discretisation`]).
//!
//! Because the basis is orthonormal, the variance of E(n), the mean over all n, follows from those of the coefficients without their
//! covariances ([`harmonics::mean_square`](super::harmonics::mean_square)): errors of all places together are made of it.

use super::harmonics::{mean_irradiance, mean_square, vector_irradiance};
use super::{Incident, Replicates};
use crate::error::{discretisation, moderate};
use crate::gather::{ErrorParts, MAX_REPLICATES};
use glam::{DVec3, Vec3};
use luxel_scenes::Rgb;

/// Coefficients of a place in W/m² sr^−½.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate<const N: usize> {
    /// The mean of all replicates.
    pub coefficients: [Rgb; N],
    /// Standard error of each: noise, and what patches leave.
    pub standard_error: [Rgb; N],
}

/// Relative spread of the square of the part that patches leave, as in `gather::error_parts`.
const MESH_SPREAD: f64 = 0.7;

impl<const N: usize> Incident<N> {
    /// The means of all replicates.
    pub fn coefficients(&self) -> [Rgb; N] {
        let (direct, gathered) = (mean(&self.direct), mean(&self.gathered));
        std::array::from_fn(|k| direct[k] + gathered[k])
    }

    /// The same in proportion to the irradiance at a normal: replicates differ from their mean only by what does not follow from their irradiance.
    /// With R = L/E and means L̄ and Ē, L_r becomes L̄ + (L_r − L̄) − R (E_r − Ē): the scatter is that of R to first order, times Ē.
    ///
    /// Source: W. G. Cochran, "Sampling Techniques", 3rd ed., 1977, §6.4 (the variance of a ratio).
    #[must_use]
    pub fn given_irradiance(&self, normal: DVec3) -> Self {
        let all = self.coefficients();
        let level = flux(&all, normal);
        let ratio: [Rgb; N] = std::array::from_fn(|k| {
            let is_lit = level.cmpgt(Rgb::ZERO);
            Rgb::select(is_lit, all[k] / level, Rgb::ZERO)
        });
        let without = |replicates: &Replicates<N>, about: [Rgb; N]| -> Replicates<N> {
            replicates.map(|row| {
                let own: [Rgb; N] = std::array::from_fn(|k| row[k].as_dvec3() - about[k]);
                let more = flux(&own, normal);
                std::array::from_fn(|k| (about[k] + own[k] - ratio[k] * more).as_vec3())
            })
        };
        Self {
            direct: without(&self.direct, mean(&self.direct)),
            gathered: without(&self.gathered, mean(&self.gathered)),
            difference: without(&self.difference, [Rgb::ZERO; N]),
            ..*self
        }
    }
}

/// n · ∫ L ω dω.
fn flux<const N: usize>(coefficients: &[Rgb; N], normal: DVec3) -> Rgb {
    let [x, y, z] = vector_irradiance(coefficients);
    x * normal.x + y * normal.y + z * normal.z
}

fn mean<const N: usize>(replicates: &Replicates<N>) -> [Rgb; N] {
    std::array::from_fn(|k| {
        let sum: Rgb = replicates.iter().map(|row| row[k].as_dvec3()).sum();
        sum / MAX_REPLICATES as f64
    })
}

/// Variances of the means of replicates, unbiased.
fn scatter<const N: usize>(replicates: &Replicates<N>) -> [Rgb; N] {
    let mean = mean(replicates);
    std::array::from_fn(|k| {
        let squares = replicates.iter().map(|row| {
            let own = row[k].as_dvec3() - mean[k];
            own * own
        });
        squares.sum::<Rgb>() / (MAX_REPLICATES * (MAX_REPLICATES - 1)) as f64
    })
}

/// Both kinds of light by replicate.
fn together<const N: usize>(incident: &Incident<N>) -> Replicates<N> {
    let mut sum = incident.direct;
    for (row, more) in sum.iter_mut().zip(&incident.gathered) {
        for (value, more) in row.iter_mut().zip(more) {
            *value += *more;
        }
    }
    sum
}

/// Squares of what patches leave, of all coefficients of all places in a row.
fn of_patches<const N: usize>(incidents: &[Incident<N>]) -> Vec<[Rgb; N]> {
    let mut squares = vec![[Rgb::ZERO; N]; incidents.len()];
    for channel in 0..3 {
        let (mut differences, mut levels) = (Vec::new(), Vec::new());
        for incident in incidents {
            let (difference, noise) = (mean(&incident.difference), scatter(&incident.difference));
            let level = mean(&incident.gathered)[0][channel];
            for k in 0..N {
                differences.push((difference[k][channel], noise[k][channel]));
                levels.push(level * level);
            }
        }
        let found = discretisation(&differences, &levels);
        for (square, found) in squares.iter_mut().zip(found.chunks_exact(N)) {
            for (square, found) in square.iter_mut().zip(found) {
                square[channel] = *found;
            }
        }
    }
    squares
}

/// Coefficients with their errors, moderated over all places.
pub fn finish<const N: usize>(incidents: &[Incident<N>]) -> Vec<Estimate<N>> {
    let of_patches = of_patches(incidents);
    let scatters: Vec<[Rgb; N]> = incidents.iter().map(|i| scatter(&together(i))).collect();
    let mut estimates: Vec<Estimate<N>> = incidents
        .iter()
        .map(|incident| Estimate {
            coefficients: incident.coefficients(),
            standard_error: [Rgb::ZERO; N],
        })
        .collect();
    for channel in 0..3 {
        let usual: Vec<f64> = scatters
            .iter()
            .map(|row| row.iter().map(|s| s[channel]).sum())
            .collect();
        for k in 0..N {
            let own: Vec<f64> = scatters.iter().map(|row| row[k][channel]).collect();
            let noise = moderate(&own, &usual, MAX_REPLICATES as u32 - 1);
            let places = estimates.iter_mut().zip(noise).zip(&of_patches);
            for ((estimate, noise), mesh) in places {
                estimate.standard_error[k][channel] = (noise + mesh[k][channel]).sqrt();
            }
        }
    }
    estimates
}

/// Relative errors of E(n) of all places, root mean square over places, normals and channels, over the mean. The noise of solutions is part of that
/// of the gather.
pub fn error_parts<const N: usize>(incidents: &[Incident<N>]) -> ErrorParts {
    let mut squares = [Rgb::ZERO; 3];
    let mut level = Rgb::ZERO;
    for (incident, mesh) in incidents.iter().zip(of_patches(incidents)) {
        level += mean_irradiance(&incident.coefficients()).0;
        let parts = [scatter(&incident.direct), scatter(&incident.gathered), mesh];
        for (square, part) in squares.iter_mut().zip(parts) {
            *square += mean_square(&part);
        }
    }
    let count = 3.0 * incidents.len().max(1) as f64;
    let level = level.element_sum() / count;
    let [direct, gather, mesh] = squares.map(|square| {
        let square = square.element_sum() / count;
        if level > 0.0 {
            square.sqrt() / level
        } else {
            0.0
        }
    });
    // Each place has noise of its own, known from 3 degrees of freedom; solutions are common to all.
    let noise = direct * direct + gather * gather;
    let own = noise * (2.0 / incidents.len().max(1) as f64).sqrt();
    ErrorParts {
        direct,
        gather,
        solution: 0.0,
        mesh,
        spread: own.hypot(MESH_SPREAD * mesh * mesh),
    }
}

/// Replicates farther apart, about the same mean.
pub(super) fn widened<const N: usize>(replicates: &Replicates<N>, widening: f32) -> Replicates<N> {
    let mean = mean(replicates).map(Rgb::as_vec3);
    replicates.map(|row| -> [Vec3; N] {
        std::array::from_fn(|k| mean[k] + (row[k] - mean[k]) * widening)
    })
}
