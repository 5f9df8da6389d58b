//! What the size of the patches costs, from the same rays looked up in patches four times as large.
//!
//! With R the mean over the patches of a coarser mesh and P its values spread over them again, the
//! light found with that mesh obeys E' = E^direct + F P R B'. From the solution B of the fine one,
//! d = E − E' = F (B − P R B) + F P R ρ d, which converges as radiosity does. Both sides share every
//! ray, so that the noise of F drops out of the first term to first order: what is left is the noise
//! that B has within a coarse patch, independent between replicates.
//!
//! Parent against children after D. Lischinski, F. Tampieri, D. P. Greenberg, "Combining
//! Hierarchical Radiosity and Discontinuity Meshing", SIGGRAPH 1993, and M. F. Cohen,
//! D. P. Greenberg, D. S. Immel, P. J. Brock, "An Efficient Radiosity Approach for Realistic Image
//! Synthesis", IEEE CG&A 6(3), 1986. Cost: as many gathers as the solution took sweeps, no ray.

use crate::patches::{PatchId, Patches};
use crate::surface::Surfaces;
use crate::transport::Transport;
use luxel_scenes::{Irradiance, Radiosity, Reflectance, Rgb};

/// Change of d, relative to its largest value, at which the iteration ends: d is an estimate, and two
/// digits of it are enough.
const ENOUGH: f64 = 1e-3;

/// Sweeps after which it ends anyway.
const MAX_SWEEPS: usize = 200;

/// What larger patches would have given less, by the same operator: d = E − E' in W/m² of each unknown.
///
/// Unknowns of the same number in `parents` are averaged, by their `weights` (areas in any unit);
/// unknowns without weight keep their own value. `radiosity` is the solution in W/m².
///
/// # Panics
/// When the slices are not as long as the operator.
pub fn coarsening(
    transport: &dyn Transport,
    parents: &[u32],
    weights: &[f64],
    reflectance: &[Reflectance],
    radiosity: &[Radiosity],
) -> Vec<Irradiance> {
    for length in [parents.len(), weights.len(), reflectance.len()] {
        assert_eq!(length, transport.len(), "one value per unknown");
    }
    let averaged = average_radiosity(parents, weights, radiosity);
    let within: Vec<Radiosity> = radiosity
        .iter()
        .zip(&averaged)
        .map(|(b, mean)| Radiosity(b.0 - mean.0))
        .collect();
    let mut first = vec![Irradiance::ZERO; transport.len()];
    transport.gather(&within, &mut first);
    let mut d = first.clone();
    let mut next = first.clone();
    for _ in 0..MAX_SWEEPS {
        let reflected: Vec<Radiosity> = reflectance
            .iter()
            .zip(&d)
            .map(|(rho, e)| Radiosity(rho.0 * e.0))
            .collect();
        transport.gather(&average_radiosity(parents, weights, &reflected), &mut next);
        let (mut change, mut largest) = (0.0_f64, 0.0_f64);
        for ((value, start), next) in d.iter_mut().zip(&first).zip(&next) {
            let updated = start.0 + next.0;
            change = change.max((updated - value.0).abs().max_element());
            largest = largest.max(updated.abs().max_element());
            value.0 = updated;
        }
        if change <= ENOUGH * largest {
            break;
        }
    }
    d
}

/// P R x: each value's mean over the unknowns of the same parent, by their weights. Unknowns without weight keep their own.
pub(crate) fn average(parents: &[u32], weights: &[f64], values: &[Rgb]) -> Vec<Rgb> {
    let count = parents.iter().map(|&parent| parent + 1).max().unwrap_or(0);
    let mut sums = vec![(Rgb::ZERO, 0.0); count as usize];
    for ((&parent, weight), &value) in parents.iter().zip(weights).zip(values) {
        let sum = &mut sums[parent as usize];
        sum.0 += value * *weight;
        sum.1 += weight;
    }
    parents
        .iter()
        .zip(weights)
        .zip(values)
        .map(|((&parent, &weight), &own)| {
            let (sum, total) = sums[parent as usize];
            if weight > 0.0 { sum / total } else { own }
        })
        .collect()
}

/// The same of radiosities.
fn average_radiosity(parents: &[u32], weights: &[f64], radiosity: &[Radiosity]) -> Vec<Radiosity> {
    let values: Vec<Rgb> = radiosity.iter().map(|b| b.0).collect();
    let means = average(parents, weights, &values);
    means.into_iter().map(Radiosity).collect()
}

/// The patch of `coarse` that each patch of `fine` lies in, by one of its points; both are meshes of the
/// same scene.
///
/// # Panics
/// When they are not.
pub fn parents(surfaces: &Surfaces, fine: &Patches, coarse: &Patches) -> Vec<PatchId> {
    let geometry = surfaces.geometry();
    fine.ids()
        .map(|patch| {
            let (faces, side) = fine.faces(patch);
            let centre = fine.sample(geometry, patch, [0.5, 0.5]);
            let point = surfaces.locate(faces, centre.position);
            let parent = coarse.at(geometry, point.triangle, point.u, point.v, side);
            parent.expect("a face has the same sides in every mesh")
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::Dense;

    /// Two unknowns that see two others of one parent, against the solution with one value for both.
    #[test]
    fn the_difference_is_that_of_the_coarse_solution() {
        let f = vec![
            0.0, 0.0, 0.5, 0.1, //
            0.0, 0.0, 0.2, 0.6, //
            0.3, 0.3, 0.0, 0.0, //
            0.2, 0.4, 0.0, 0.0,
        ];
        let transport = Dense::new(4, f).expect("a square matrix");
        let parents = [0, 1, 2, 2];
        let weights = [1.0, 1.0, 2.0, 1.0];
        let rho = [0.5, 0.8, 0.6, 0.6].map(Reflectance::splat);
        let source = [1.0, 0.0, 0.0, 3.0].map(Radiosity::splat);
        // B = S + ρ F [P R] B, by as many sweeps as rounding asks for.
        let solve = |coarse: bool| {
            let mut b = source.to_vec();
            let mut e = vec![Irradiance::ZERO; 4];
            for _ in 0..200 {
                let seen = if coarse {
                    average_radiosity(&parents, &weights, &b)
                } else {
                    b.clone()
                };
                transport.gather(&seen, &mut e);
                for (((b, s), rho), e) in b.iter_mut().zip(&source).zip(&rho).zip(&e) {
                    *b = *s + *rho * *e;
                }
            }
            (b, e)
        };
        let (b, fine) = solve(false);
        let (_, coarse) = solve(true);
        let d = coarsening(&transport, &parents, &weights, &rho, &b);
        for ((d, fine), coarse) in d.iter().zip(&fine).zip(&coarse) {
            let exact = fine.0.x - coarse.0.x;
            // The iteration ends at a change of 1e-3.
            assert!(
                (d.0.x - exact).abs() < 5e-3 * exact.abs().max(0.1),
                "{} {exact}",
                d.0.x
            );
        }
    }
}
