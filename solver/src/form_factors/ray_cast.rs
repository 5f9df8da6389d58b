//! Ray-cast form factors: F_ij is the fraction of the cosine-distributed rays from i that meet j
//! first.
//!
//! F_ij = (1 / (π A_i)) ∫_{A_i} ∫ V cos θ dω dA over the directions in which j is seen, estimated
//! with points spread evenly over i and directions by cosine, four-dimensional Owen-scrambled
//! Sobol' points. Unbiased. The rays of a patch are split over independent scrambles, whose scatter
//! gives the standard error; it falls as N^-0.5 to N^-0.75.
//!
//! Source: T. J. V. Malley, "A Shading Method for Computer Generated Images", master's thesis,
//! University of Utah, 1988. Valid for any geometry, occluded or not. Cost: one ray a sample, n
//! numbers a row.

use crate::bvh::{Hit, Ray};
use crate::patches::{PatchId, Patches};
use crate::sampling::{self, Sequence, Stage, cosine_hemisphere};
use crate::world::World;
use rayon::prelude::*;

/// Independent randomisations of a row. The standard error has one degree of freedom fewer; more
/// randomisations make it surer but leave fewer points for each to spread evenly.
pub const REPLICATES: u64 = 32;

/// Rays per batch.
const BATCH: u32 = 1024;

/// How many rays to cast.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RayCastConfig {
    /// Rays of each row, rounded up to a multiple of [`REPLICATES`].
    pub rays: usize,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// Rows of form factors with their standard errors, row-major n×n.
#[derive(Clone, Debug, PartialEq)]
pub struct RayCastFactors {
    /// Number of patches n.
    pub len: usize,
    /// F_ij at `i * len + j`.
    pub factors: Vec<f64>,
    /// Standard error of each factor. Zero where no ray, or every ray, met: an upper limit is then
    /// 3 / N (95 %).
    pub standard_error: Vec<f64>,
}

/// The form factors between all patches, front to front (each side of a two-sided face is a patch
/// of its own).
pub fn ray_cast(world: &World, patches: &Patches, config: &RayCastConfig) -> RayCastFactors {
    let len = patches.len();
    let rows: Vec<(Vec<f64>, Vec<f64>)> = (0..len)
        .into_par_iter()
        .map(|i| ray_cast_row(world, patches, PatchId::new(i), config))
        .collect();
    let mut factors = Vec::with_capacity(len * len);
    let mut standard_error = Vec::with_capacity(len * len);
    for (row, error) in rows {
        factors.extend(row);
        standard_error.extend(error);
    }
    RayCastFactors {
        len,
        factors,
        standard_error,
    }
}

/// One row of [`ray_cast`]: the form factors from `patch` to each patch, and their standard errors.
pub fn ray_cast_row(
    world: &World,
    patches: &Patches,
    patch: PatchId,
    config: &RayCastConfig,
) -> (Vec<f64>, Vec<f64>) {
    let per_replicate = (config.rays as u64).div_ceil(REPLICATES).max(1) as u32;
    let counts: Vec<Vec<u32>> = (0..REPLICATES)
        .into_par_iter()
        .map(|replicate| {
            let item = (replicate << 32) | u64::from(patch.0);
            let sequence = Sequence::new(config.seed, Stage::FORM_FACTORS, item);
            count_hits(world, patches, patch, sequence, per_replicate)
        })
        .collect();
    let mut sum = vec![0.0; patches.len()];
    let mut square = vec![0.0; patches.len()];
    for counts in &counts {
        for (j, &count) in counts.iter().enumerate() {
            let fraction = f64::from(count) / f64::from(per_replicate);
            sum[j] += fraction;
            square[j] += fraction * fraction;
        }
    }
    let n = REPLICATES as f64;
    let mean: Vec<f64> = sum.iter().map(|s| s / n).collect();
    let error = mean
        .iter()
        .zip(&square)
        .map(|(mean, square)| ((square / n - mean * mean).max(0.0) / (n - 1.0)).sqrt())
        .collect();
    (mean, error)
}

/// How many of the first `rays` rays of a sequence from a patch meet each patch.
fn count_hits(
    world: &World,
    patches: &Patches,
    patch: PatchId,
    sequence: Sequence,
    rays: u32,
) -> Vec<u32> {
    let mut counts = vec![0; patches.len()];
    cast(world, patches, patch, sequence, rays, |met| {
        counts[met.index()] += 1;
    });
    counts
}

/// Calls `visit` with the patch that each of the first `rays` rays of a sequence from a patch meets, in
/// the order of the sequence; rays that meet none are left out.
pub(super) fn cast(
    world: &World,
    patches: &Patches,
    patch: PatchId,
    sequence: Sequence,
    rays: u32,
    mut visit: impl FnMut(PatchId),
) {
    let mut batch = Vec::with_capacity(BATCH as usize);
    let mut hits = Vec::new();
    for first in (0..rays).step_by(BATCH as usize) {
        batch.clear();
        for index in first..rays.min(first + BATCH) {
            let [x, y, u, v] = sequence.point4(index);
            let point = patches.sample(world.surfaces().geometry(), patch, [x, y]);
            let frame = sampling::Frame::around(point.normal.as_vec3());
            let local = cosine_hemisphere::sample([u as f32, v as f32]);
            batch.push(Ray::new(point.origin, frame.to_world(local)));
        }
        hits.resize(batch.len(), Hit::MISS);
        world.bvh().closest_hits(&batch, &mut hits);
        for (ray, hit) in batch.iter().zip(&hits) {
            if let Some(met) = world.patch_hit(patches, ray, hit) {
                visit(met);
            }
        }
    }
}
