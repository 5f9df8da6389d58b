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
const BATCH: u64 = 1024;

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
    let mut factors = vec![0.0; len * len];
    let mut standard_error = vec![0.0; len * len];
    factors
        .par_chunks_mut(len.max(1))
        .zip(standard_error.par_chunks_mut(len.max(1)))
        .enumerate()
        .for_each_init(
            || Counts::new(len),
            |counts, (i, (row, errors))| {
                counts.fill_row(world, patches, PatchId::new(i), config, row, errors);
            },
        );
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
    let len = patches.len();
    let (mut row, mut errors) = (vec![0.0; len], vec![0.0; len]);
    Counts::new(len).fill_row(world, patches, patch, config, &mut row, &mut errors);
    (row, errors)
}

/// Scratch space for rows one after another.
struct Counts {
    /// Rays of one replicate that met each patch.
    counts: Vec<u32>,
    /// The patches that any of them met.
    met: Vec<PatchId>,
}

impl Counts {
    fn new(patches: usize) -> Self {
        Self {
            counts: vec![0; patches],
            met: Vec::new(),
        }
    }

    /// Computes a row, which must be zero before, and its standard errors.
    fn fill_row(
        &mut self,
        world: &World,
        patches: &Patches,
        patch: PatchId,
        config: &RayCastConfig,
        row: &mut [f64],
        errors: &mut [f64],
    ) {
        let rays = (config.rays as u64).div_ceil(REPLICATES).max(1) as u32;
        let sequences: Vec<Sequence> = (0..REPLICATES)
            .map(|replicate| {
                let item = (replicate << 32) | u64::from(patch.0);
                Sequence::new(config.seed, Stage::FORM_FACTORS, item)
            })
            .collect();
        let mut current = 0;
        cast(world, patches, patch, &sequences, rays, |replicate, met| {
            if replicate != current {
                self.add_replicate(rays, row, errors);
                current = replicate;
            }
            let count = &mut self.counts[met.index()];
            if *count == 0 {
                self.met.push(met);
            }
            *count += 1;
        });
        self.add_replicate(rays, row, errors);
        // Sums over replicates become the mean and its standard error.
        let n = REPLICATES as f64;
        for (factor, error) in row.iter_mut().zip(errors) {
            *factor /= n;
            let variance = (*error / n - *factor * *factor).max(0.0) / (n - 1.0);
            *error = variance.sqrt();
        }
    }

    /// Adds the fractions that a replicate found, and their squares.
    fn add_replicate(&mut self, rays: u32, sums: &mut [f64], squares: &mut [f64]) {
        for met in self.met.drain(..) {
            let count = std::mem::take(&mut self.counts[met.index()]);
            let fraction = f64::from(count) / f64::from(rays);
            sums[met.index()] += fraction;
            squares[met.index()] += fraction * fraction;
        }
    }
}

/// Calls `visit` with the patch that each of the first `rays` rays of some sequences from a patch meets and the
/// number of the sequence, in their order; rays that meet none are left out.
pub(super) fn cast(
    world: &World,
    patches: &Patches,
    patch: PatchId,
    sequences: &[Sequence],
    rays: u32,
    mut visit: impl FnMut(usize, PatchId),
) {
    let mut hits = Vec::new();
    let all = sequences.len() as u64 * u64::from(rays);
    let mut batch = Vec::with_capacity(all.min(BATCH) as usize);
    for first in (0..all).step_by(BATCH as usize) {
        batch.clear();
        for ray in first..all.min(first + BATCH) {
            let (sequence, index) = (ray / u64::from(rays), ray % u64::from(rays));
            let [x, y, u, v] = sequences[sequence as usize].point4(index as u32);
            let point = patches.sample(world.surfaces().geometry(), patch, [x, y]);
            let frame = sampling::Frame::around(point.normal.as_vec3());
            let local = cosine_hemisphere::sample([u as f32, v as f32]);
            batch.push(Ray::new(point.origin, frame.to_world(local)));
        }
        hits.resize(batch.len(), Hit::MISS);
        world.bvh().closest_hits(&batch, &mut hits);
        for ((ray, hit), index) in batch.iter().zip(&hits).zip(first..) {
            if let Some(met) = world.patch_hit(patches, ray, hit) {
                visit((index / u64::from(rays)) as usize, met);
            }
        }
    }
}
