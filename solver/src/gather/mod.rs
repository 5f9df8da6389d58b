//! The final gather: irradiance at any point, direct light exact and indirect light from the
//! coarse radiosity solution.
//!
//! E = E^direct + (1/M) Σ_m B(hit_m) over M cosine-distributed rays, where B = ρ(hit) E(patch) is
//! looked up at the hit. A hit that is nearer than the size of its patch is not looked up, because
//! the patch says nothing about variation below its size: the path goes on from there
//! (`near_chain`).
//!
//! The budget is split evenly over independent randomisations ("replicates"), each with a radiosity
//! solution and gather rays of its own; their mean is the result and their scatter its standard
//! error, noise of the solution included. Directions are Owen-scrambled Sobol' points: the noise
//! falls as M^-0.6 to M^-0.7. Biased by the finite size of patches, O(h) and below.
//!
//! Sources: M. C. Reichert, "A Two-Pass Radiosity Method Driven by Lights and Viewer Position",
//! master's thesis, Cornell, 1992 (the gather into a radiosity solution); the near chain and the
//! classes of a patch are luxel's own. Cost: M rays and S shadow rays a receiver; half the rays of a
//! furnished room continue once.

mod near_chain;

use crate::direct::{DirectSampler, Dome, DomeRays, Sample, ShadowRays};
use crate::patches::Patches;
use crate::radiosity::RadiositySolution;
use crate::sampling::{Sequence, Stage, hash};
use crate::world::{Receiver, World};
use luxel_scenes::{Irradiance, Rgb};
use near_chain::Chains;
use rayon::prelude::*;

/// Rays that a parallel task aims at, so that batches are long even for few rays a receiver.
const RAYS_PER_TASK: usize = 4096;

/// Rays of a receiver from which the sky gets as many of its own: a tuned value. With fewer, the rays
/// that leave the scene anyway tell more of it, and cost nothing. Largest relative errors of the two at
/// 1024, 4096, 16 384 and 65 536 rays: below a roof opening 5.1 and 2.5, 0.8 and 0.9, 0.14 and
/// 0.22, 0.015 and 0.11 %; behind a small window 9 and 29, 1.3 and 5.7, 0.23 and 1.9, 0.06 and 0.8 %.
const SKY_APART: usize = 8192;

/// Which light to gather.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Components {
    /// Direct and indirect.
    All,
    /// From the sources without reflection.
    Direct,
    /// After at least one reflection.
    Indirect,
}

/// How much to spend on a receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GatherConfig {
    /// Rays for indirect light, over all replicates; if they are many, as many again for the sky.
    pub rays: usize,
    /// Shadow rays for direct light, over all replicates.
    pub shadow_rays: usize,
    /// Independent randomisations, from one to [`MAX_REPLICATES`]. One gives no standard error.
    pub replicates: usize,
    /// Which light.
    pub components: Components,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// Where a receiver's random numbers come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key {
    /// What is gathered for: a point, a pixel. Items are independent of each other.
    pub item: u64,
    /// Which gather of the item this is: gathers 0, 1, 2, … of one item (the camera samples of a
    /// pixel) draw consecutive parts of one sequence, so that together they are spread as evenly
    /// as one gather of all their rays.
    pub index: u32,
}

impl Key {
    /// The only gather of an item.
    pub fn of(item: u64) -> Self {
        Self { item, index: 0 }
    }
}

/// Irradiance at a receiver.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Gathered {
    /// Direct irradiance in W/m².
    pub direct: Irradiance,
    /// Indirect irradiance in W/m².
    pub indirect: Irradiance,
    /// Standard error of the sum in W/m², from the replicates; zero for a single replicate.
    pub standard_error: Irradiance,
    /// Fraction of the rays that met the back of a one-sided face: near one inside a solid.
    pub back_fraction: f64,
}

impl Gathered {
    /// Direct and indirect irradiance together, in W/m².
    pub fn irradiance(&self) -> Irradiance {
        self.direct + self.indirect
    }
}

/// Gathers at each receiver. `keys` tells the random numbers of receivers apart; the result does not
/// depend on which other receivers are gathered along with one.
///
/// `solutions` holds one radiosity solution for each replicate, or is empty when only direct light
/// is wanted.
///
/// # Panics
/// When `keys` is not as long as `receivers`, the number of replicates is out of range, or indirect
/// light is wanted and there is not one solution for each replicate.
pub fn gather(
    world: &World,
    patches: &Patches,
    solutions: &[RadiositySolution],
    receivers: &[Receiver],
    keys: &[Key],
    config: &GatherConfig,
) -> Vec<Gathered> {
    assert_eq!(receivers.len(), keys.len(), "one key for each receiver");
    let replicates = config.replicates;
    assert!(
        (1..=MAX_REPLICATES).contains(&replicates),
        "between one and {MAX_REPLICATES} replicates"
    );
    let wants_indirect = config.components != Components::Direct;
    let wants_direct = config.components != Components::Indirect;
    let lights = world.lights();
    let sky_is_apart = lights.has_sky() && config.rays >= SKY_APART;
    let rays_find_direct = lights.has_unlisted_emission() || lights.has_sky() && !sky_is_apart;
    assert!(
        !wants_indirect || solutions.len() == replicates,
        "one solution for each replicate"
    );
    let chunk = (RAYS_PER_TASK / config.rays.max(1)).clamp(1, 256);
    receivers
        .par_chunks(chunk)
        .zip(keys.par_chunks(chunk))
        .flat_map_iter(|(receivers, keys)| {
            let mut totals = vec![Totals::default(); receivers.len()];
            let mut direct = DirectSampler::new(world.lights(), world.bvh());
            let mut chains = Chains::new(world, patches, sky_is_apart);
            if sky_is_apart && wants_direct {
                add_sky(world, receivers, keys, config, &mut totals);
            }
            for replicate in 0..replicates {
                if wants_direct {
                    let rays = share(config.shadow_rays, replicates, replicate);
                    add_direct(
                        &mut direct,
                        receivers,
                        keys,
                        config,
                        replicate,
                        rays,
                        &mut totals,
                    );
                }
                if wants_indirect || rays_find_direct {
                    let rays = share(config.rays, replicates, replicate);
                    let seed = replicate_seed(config.seed, replicate);
                    let solution = solutions.get(replicate).filter(|_| wants_indirect);
                    chains.gather(solution, receivers, keys, seed, rays, |slot, found| {
                        let total = &mut totals[slot];
                        if wants_direct {
                            total.direct[replicate] += found.direct / rays as f64;
                        }
                        total.indirect[replicate] += found.indirect / rays as f64;
                        total.backs += found.backs;
                        total.rays += rays;
                    });
                }
            }
            totals
                .into_iter()
                .map(move |total| total.finish(replicates))
        })
        .collect()
}

/// Largest number of replicates whose scatter is kept apart.
pub const MAX_REPLICATES: usize = 8;

/// The `index`-th share of `total` split evenly into `parts`, at least one.
fn share(total: usize, parts: usize, index: usize) -> usize {
    ((total * (index + 1)) / parts - (total * index) / parts).max(1)
}

/// Replicates draw from sequences of their own.
fn replicate_seed(seed: u64, replicate: usize) -> u64 {
    hash::mix64(seed ^ hash::mix64(replicate as u64))
}

/// What a receiver has collected, by replicate.
#[derive(Clone, Copy, Default)]
struct Totals {
    direct: [Rgb; MAX_REPLICATES],
    indirect: [Rgb; MAX_REPLICATES],
    backs: usize,
    rays: usize,
}

impl Totals {
    fn finish(&self, replicates: usize) -> Gathered {
        let count = replicates as f64;
        let direct = self.direct[..replicates].iter().sum::<Rgb>() / count;
        let indirect = self.indirect[..replicates].iter().sum::<Rgb>() / count;
        let mean = direct + indirect;
        let scatter: Rgb = (0..replicates)
            .map(|r| {
                let deviation = self.direct[r] + self.indirect[r] - mean;
                deviation * deviation
            })
            .sum();
        let degrees = (replicates as f64 - 1.0).max(1.0);
        Gathered {
            direct: Irradiance(direct),
            indirect: Irradiance(indirect),
            standard_error: Irradiance((scatter / (degrees * count)).map(f64::sqrt)),
            back_fraction: self.backs as f64 / self.rays.max(1) as f64,
        }
    }
}

/// Adds the light of the sky by rays of its own.
fn add_sky(
    world: &World,
    receivers: &[Receiver],
    keys: &[Key],
    config: &GatherConfig,
    totals: &mut [Totals],
) {
    let mut dome = Dome::new(world.lights(), world.surfaces(), world.bvh());
    let seeds = |index: u32| {
        let seed = hash::mix64(config.seed ^ u64::from(index));
        move |replicate| replicate_seed(seed, replicate)
    };
    for ((receiver, key), total) in receivers.iter().zip(keys).zip(totals) {
        let replicate_seeds: Vec<u64> = (0..config.replicates).map(seeds(key.index)).collect();
        let rays = DomeRays {
            count: config.rays,
            seed: seeds(key.index)(usize::MAX),
            replicate_seeds: &replicate_seeds,
            item: key.item,
        };
        dome.irradiance(receiver, &rays, |replicate, irradiance| {
            total.direct[replicate] += irradiance;
        });
    }
}

fn add_direct(
    sampler: &mut DirectSampler,
    receivers: &[Receiver],
    keys: &[Key],
    config: &GatherConfig,
    replicate: usize,
    rays: usize,
    totals: &mut [Totals],
) {
    let seed = replicate_seed(config.seed, replicate);
    let samples: Vec<Sample> = receivers
        .iter()
        .zip(keys)
        .map(|(receiver, key)| Sample {
            position: receiver.position,
            normal: receiver.normal,
            origin: receiver.origin,
            sequence: Sequence::new(seed, Stage::DIRECT, key.item),
            index: key.index,
        })
        .collect();
    let mut irradiance = vec![Irradiance::ZERO; samples.len()];
    sampler.irradiance(&samples, ShadowRays::About(rays), &mut irradiance);
    for (total, direct) in totals.iter_mut().zip(irradiance) {
        total.direct[replicate] += direct.0;
    }
}

#[cfg(test)]
mod tests;
