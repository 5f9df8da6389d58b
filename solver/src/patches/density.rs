//! How densely to mesh which place: patches per area, relative to the mean of the scene.
//!
//! Where a receiver's light comes from, errors of the mesh weigh as much as the light is bright, so
//! that bright places are worth more patches than dark ones: density ∝ clamp(0.3 + 0.7 E/Ē, 0.3, 4)
//! with the irradiance E of a coarse pilot solution and its mean Ē. The form and its constants are
//! measured: nothing finer (nearness of other surfaces, both together) gained consistently.
//!
//! Where receivers are known, so is what an error on a patch means to them, its importance Ψ
//! ([`crate::radiosity`]). Rows of scatter σ leave a noise of Σ Ψ² σ²/n at the receivers, which a density in proportion to
//! Ψσ lessens most (J. Neyman, 1934). A pilot knows Ψ and σ of dark places badly and the size of patches asks for
//! more even ones: the root of it is taken.
//! Validity: any pilot; its noise makes patches uneven, not wrong. Cost: one lookup in the pilot's
//! patches for each of the samples of a new patch.

use super::{Patches, Side};
use crate::surface::Surfaces;
use glam::DVec3;
use luxel_scenes::FaceId;

/// Density of a place without light. Lower, and dark rooms lose the patches that carry what little
/// light they have.
const DARK: f64 = 0.3;

/// Largest density. Higher, and the patches beside a lamp take those of the rest of the room.
const BRIGHTEST: f64 = 4.0;

/// The same where receivers are known. Wider: a dark room that they stand in needs most of the patches, and the lit one behind
/// a door, which is a thousand times as bright, few.
const UNIMPORTANT: f64 = 0.05;
const MOST_IMPORTANT: f64 = 64.0;

/// Patches per area relative to the mean of the scene, from a coarse pilot mesh.
pub struct Density {
    pilot: Patches,
    /// Of each patch of the pilot; both sides of a two-sided face have the larger of theirs.
    of_patch: Vec<f64>,
    /// Of each face, the mean over its region.
    of_face: Vec<f64>,
}

impl Density {
    /// The density of the given relative patches per area, one positive number for each patch of
    /// `pilot`; scaled so that its mean over the scene's area is one.
    ///
    /// # Panics
    /// When there is not one number per patch.
    pub fn new(surfaces: &Surfaces, pilot: Patches, mut of_patch: Vec<f64>) -> Self {
        assert_eq!(of_patch.len(), pilot.len(), "one density for each patch");
        let faces = surfaces.geometry().face_count();
        let mut of_face = vec![1.0; faces];
        let (mut sum, mut total) = (0.0, 0.0);
        for region in &pilot.regions {
            let (mut own, mut area) = (0.0, 0.0);
            for element in 0..region.element_count() {
                let front = (region.first + element) as usize;
                let mut value = of_patch[front];
                if let Some(back) = region.first_back.map(|first| (first + element) as usize) {
                    value = value.max(of_patch[back]);
                    of_patch[back] = value;
                }
                of_patch[front] = value;
                own += value * pilot.area[front];
                area += pilot.area[front];
            }
            for face in &region.faces {
                of_face[face.index()] = own / area;
            }
            sum += own;
            total += area;
        }
        let scale = total / sum;
        for value in of_patch.iter_mut().chain(&mut of_face) {
            *value *= scale;
        }
        Self {
            pilot,
            of_patch,
            of_face,
        }
    }

    /// The density that follows the light: `irradiance` is that of each patch of `pilot`, in any
    /// unit. Uniform where there is no light at all.
    ///
    /// # Panics
    /// When there is not one irradiance per patch.
    pub fn following(surfaces: &Surfaces, pilot: Patches, irradiance: &[f64]) -> Self {
        Self::between(surfaces, pilot, irradiance, [DARK, BRIGHTEST])
    }

    /// The density for receivers at which each patch of `pilot` makes so much noise, in any unit: importance per area
    /// times scatter. Uniform where there is none at all.
    ///
    /// # Panics
    /// When there is not one number per patch.
    pub fn lessening(surfaces: &Surfaces, pilot: Patches, noise: &[f64]) -> Self {
        let root: Vec<f64> = noise.iter().map(|noise| noise.sqrt()).collect();
        Self::between(surfaces, pilot, &root, [UNIMPORTANT, MOST_IMPORTANT])
    }

    /// The density that rises from the least with a weight, relative to its mean over the area, up to the largest.
    fn between(
        surfaces: &Surfaces,
        pilot: Patches,
        weights: &[f64],
        [least, largest]: [f64; 2],
    ) -> Self {
        let area: f64 = pilot.area.iter().sum();
        let weighted = pilot.area.iter().zip(weights).map(|(a, w)| a * w);
        let mean = weighted.sum::<f64>() / area;
        let of_patch = weights
            .iter()
            .map(|weight| {
                let relative = if mean > 0.0 { weight / mean } else { 1.0 };
                (least + (1.0 - least) * relative).clamp(least, largest)
            })
            .collect();
        Self::new(surfaces, pilot, of_patch)
    }

    /// Mean density over a face (and what it is meshed with).
    pub fn face(&self, face: FaceId) -> f64 {
        self.of_face[face.index()]
    }

    /// Density at a point of one of `faces`, which share a region; in the unit frame.
    pub(super) fn at(&self, surfaces: &Surfaces, faces: &[FaceId], position: DVec3) -> f64 {
        let point = surfaces.locate(faces, position);
        self.pilot
            .at(
                surfaces.geometry(),
                point.triangle,
                point.u,
                point.v,
                Side::Front,
            )
            .map_or(1.0, |patch| self.of_patch[patch.index()])
    }
}

/// Samples along each side of a region from which the density of its grid is chosen.
const REGION_SAMPLES: usize = 8;

/// Samples along each side of a node that tell whether it is divided.
const NODE_SAMPLES: usize = 2;

/// Grids of different density that are tried for a region, over the factor of four between two
/// levels of its quadtrees.
const GRIDS: usize = 8;

/// Centres of a regular grid of `count`² cells of the unit square.
pub(super) fn centres(count: usize) -> impl Iterator<Item = [f64; 2]> {
    let centre = move |index: usize| (index as f64 + 0.5) / count as f64;
    (0..count * count).map(move |index| [centre(index % count), centre(index / count)])
}

/// The density of a region's grid, from samples of the wanted one: quadtrees over it can have
/// 4^level of it, and it is chosen such that these come nearest to what is wanted.
pub(super) fn grid_density(wanted: &[f64]) -> f64 {
    let least = wanted.iter().copied().fold(f64::INFINITY, f64::min);
    let mismatch = |grid: f64| -> f64 {
        let of = |w: &f64| {
            let level = (w / grid).log(4.0);
            level - level.round().max(0.0)
        };
        wanted.iter().map(|w| of(w) * of(w)).sum()
    };
    // From half of the least to twice of it: the least may be rounded up or down.
    let candidates = (0..=GRIDS).map(|k| least * 4f64.powf(k as f64 / GRIDS as f64 - 0.5));
    let best = candidates
        .map(|grid| (mismatch(grid), grid))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    // A bare mean fits one level better than any of the candidates.
    let mean = wanted.iter().map(|w| w.ln()).sum::<f64>() / wanted.len() as f64;
    let mean = mean.exp();
    match best {
        Some((least, grid)) if least < mismatch(mean) => grid,
        _ => mean,
    }
}

/// Samples along each side of a region with about `cells` elements.
pub(super) fn region_samples(cells: f64) -> usize {
    (cells.sqrt().ceil() as usize).clamp(1, REGION_SAMPLES)
}

/// True when a node of `node` times the mean density should be divided, its wanted density being
/// that of `at` over the unit square of the node.
pub(super) fn divides(node: f64, at: impl Fn([f64; 2]) -> f64) -> bool {
    let count = (NODE_SAMPLES * NODE_SAMPLES) as f64;
    let wanted = centres(NODE_SAMPLES).map(at).sum::<f64>() / count;
    wanted > 2.0 * node
}
