//! The final gather: irradiance at any point, direct light exact and indirect light from the
//! coarse radiosity solution.
//!
//! E = E^direct + (1/M) Σ_m B(hit_m) over M cosine-distributed rays, where B = ρ(hit) E(patch) is
//! looked up at the hit. A hit that is nearer than the size of its patch is not looked up, because
//! the patch says nothing about variation below its size: the path goes on from there
//! (`near_chain`).
//!
//! The rays are split evenly over independent randomisations ("gathers"), and every hit is looked up
//! in several independent solutions ([`Lookup`]): the mean of all is the result, and the scatters
//! over gathers and over solutions are its noise ([`Tally`]). Directions are Owen-scrambled Sobol'
//! points: the noise falls as M^-0.6 to M^-0.7. Biased by the finite size of patches, O(h) and below,
//! which a coarser mesh looked up at the same hits makes known.
//!
//! Sources: M. C. Reichert, "A Two-Pass Radiosity Method Driven by Lights and Viewer Position",
//! master's thesis, Cornell, 1992 (the gather into a radiosity solution); the near chain and the
//! classes of a patch are luxel's own. Cost: M rays and S shadow rays a receiver; half the rays of a
//! furnished room continue once.

mod error_parts;
mod guide;
mod interaction;
mod joined;
mod lookup;
mod near_chain;
mod tally;

pub use error_parts::{ErrorParts, error_parts};
pub(crate) use guide::Guides;
pub(crate) use interaction::share_of_solutions;
pub(crate) use joined::COLUMNS as JOINED_COLUMNS;
pub use joined::{IndirectField, joined};
pub(crate) use lookup::orders;
pub use lookup::{Lookup, MAX_REPLICATES, Solutions};
pub(crate) use near_chain::{Chains, Found};
pub(crate) use tally::SHADOW_EXPONENT;
pub use tally::{Gathered, Tally, finish};

use crate::bounces::Bounces;
use crate::direct::{DirectSampler, Dome, DomeRays, Lit, Sample, ShadowRays};
use crate::sampling::{Sequence, Stage, hash};
use crate::world::{Receiver, World};
use rayon::prelude::*;

/// Rays that a parallel task aims at, so that batches are long even for few rays a receiver.
const RAYS_PER_TASK: usize = 4096;

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

impl Components {
    /// What is left of it where light may be reflected so often: direct light where it may not, and nothing (`None`) of
    /// reflected light.
    pub fn within(self, bounces: Bounces) -> Option<Self> {
        match self {
            _ if bounces.reflect() => Some(self),
            Self::All | Self::Direct => Some(Self::Direct),
            Self::Indirect => None,
        }
    }
}

/// What finds the light of the sky at a receiver.
///
/// Which is better depends on how many rays there are. Largest relative errors of rays apart and of as
/// many gather rays, at 1024, 4096, 16 384 and 65 536 rays: below a roof opening 5.1 and 2.5, 0.8 and
/// 0.9, 0.14 and 0.22, 0.015 and 0.11 %; behind a small window 9 and 29, 1.3 and 5.7, 0.23 and 1.9, 0.06
/// and 0.8 %.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SkyRays {
    /// The gather rays that leave the scene; they cost nothing.
    Gather,
    /// Rays of its own, as many as shadow rays, at the outlines of openings
    /// (`direct::dome`).
    Apart,
}

/// How much to spend on a receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GatherConfig {
    /// Rays for indirect light, over all gathers; none when zero.
    pub rays: usize,
    /// Rays of each gather that were cast before for the same keys: the sequences go on from there.
    pub rays_before: usize,
    /// Shadow rays for direct light, over all gathers; none when zero.
    pub shadow_rays: usize,
    /// Whether gather rays find the sky.
    pub sky: SkyRays,
    /// Independent randomisations, from one to [`MAX_REPLICATES`]. One gives no standard error.
    pub gathers: usize,
    /// Which solutions are looked up.
    pub solutions: Solutions,
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

/// Gathers at each receiver. `keys` tells the random numbers of receivers apart; a tally does not
/// depend on which other receivers are gathered along with one. [`finish`] makes light of tallies.
///
/// `lookup` may be missing when only direct light is wanted.
///
/// # Panics
/// When `keys` is not as long as `receivers`, the number of gathers is out of range, or indirect
/// light is wanted and there is nothing to look up.
pub fn gather(
    world: &World,
    lookup: Option<&Lookup>,
    receivers: &[Receiver],
    keys: &[Key],
    config: &GatherConfig,
) -> Vec<Tally> {
    gather_guided(world, lookup, None, receivers, keys, config)
}

/// As [`gather`], with gather rays in directions that guides tell; the item of a key is the receiver's position among those
/// that the guides were learned for.
///
/// # Panics
/// As [`gather`], and when a guide is missing.
pub(crate) fn gather_guided(
    world: &World,
    lookup: Option<&Lookup>,
    guides: Option<&Guides>,
    receivers: &[Receiver],
    keys: &[Key],
    config: &GatherConfig,
) -> Vec<Tally> {
    assert_eq!(receivers.len(), keys.len(), "one key for each receiver");
    assert!(
        (1..=MAX_REPLICATES).contains(&config.gathers),
        "between one and {MAX_REPLICATES} gathers"
    );
    let wants_indirect = config.components != Components::Direct && config.rays > 0;
    assert!(
        !wants_indirect || lookup.is_some(),
        "indirect light is looked up"
    );
    let lookup = lookup.filter(|_| wants_indirect);
    let solutions = lookup.map_or(0, |lookup| lookup.range(config.solutions).len());
    let lights = world.lights();
    let sky_is_apart = lights.has_sky() && config.sky == SkyRays::Apart;
    let rays_find_direct = lights.has_unlisted_emission() || lights.has_sky() && !sky_is_apart;
    let follows = wants_indirect || config.rays > 0 && rays_find_direct;
    let wants_direct = config.components != Components::Indirect;
    let rays = config.rays.max(config.shadow_rays);
    let chunk = (RAYS_PER_TASK / rays.max(1)).clamp(1, 256);
    receivers
        .par_chunks(chunk)
        .zip(keys.par_chunks(chunk))
        .flat_map_iter(|(receivers, keys)| {
            let empty = Tally {
                gathers: config.gathers as u8,
                solutions: solutions as u8,
                shadow_rays: if wants_direct {
                    share(config.shadow_rays, config.gathers)
                } else {
                    0
                },
                rays: if follows {
                    share(config.rays, config.gathers)
                } else {
                    0
                },
                ..Tally::default()
            };
            let mut tallies = vec![empty; receivers.len()];
            let mut direct = DirectSampler::new(world.lights(), world.bvh());
            let mut chains = Chains::new(world, lookup, config.solutions, sky_is_apart);
            chains.follow_guides(guides);
            if sky_is_apart && wants_direct && config.shadow_rays > 0 {
                add_sky(world, receivers, keys, config, &mut tallies);
            }
            for gather in 0..config.gathers {
                let seed = gather_seed(config.seed, gather);
                if wants_direct && config.shadow_rays > 0 {
                    let rays = share(config.shadow_rays, config.gathers) as usize;
                    let found = shadowed(&mut direct, receivers, keys, seed, rays);
                    for (tally, lit) in tallies.iter_mut().zip(found) {
                        tally.direct[gather] += lit.irradiance.0;
                        tally.direct_variance += lit.variance / (config.gathers.pow(2) as f64);
                    }
                }
                if follows {
                    let rays = share(config.rays, config.gathers);
                    let before = config.rays_before as u32;
                    chains.gather(receivers, keys, seed, before, rays, |slot, found| {
                        let tally = &mut tallies[slot];
                        if wants_direct {
                            tally.found[gather] += found.direct;
                        }
                        found.add_indirect_to(tally, gather, solutions);
                    });
                }
            }
            if sky_is_apart {
                for tally in &mut tallies {
                    tally.expect_noise_as_light();
                }
            }
            tallies
        })
        .collect()
}

/// The share of each of `parts` in `total` rays, rounded up.
fn share(total: usize, parts: usize) -> u32 {
    total.div_ceil(parts) as u32
}

/// Gathers draw from sequences of their own.
fn gather_seed(seed: u64, gather: usize) -> u64 {
    hash::mix64(seed ^ hash::mix64(gather as u64))
}

/// Adds the light of the sky by rays of its own.
fn add_sky(
    world: &World,
    receivers: &[Receiver],
    keys: &[Key],
    config: &GatherConfig,
    tallies: &mut [Tally],
) {
    let mut dome = Dome::new(world.lights(), world.surfaces(), world.bvh());
    let seeds = |index: u32| {
        let seed = hash::mix64(config.seed ^ u64::from(index));
        move |gather| gather_seed(seed, gather)
    };
    for ((receiver, key), tally) in receivers.iter().zip(keys).zip(tallies) {
        let replicate_seeds: Vec<u64> = (0..config.gathers).map(seeds(key.index)).collect();
        let rays = DomeRays {
            count: config.shadow_rays,
            seed: seeds(key.index)(usize::MAX),
            replicate_seeds: &replicate_seeds,
            item: key.item,
        };
        dome.irradiance(receiver, &rays, |gather, irradiance| {
            tally.direct[gather] += irradiance;
        });
    }
}

/// Direct light from shadow rays.
fn shadowed(
    sampler: &mut DirectSampler,
    receivers: &[Receiver],
    keys: &[Key],
    seed: u64,
    rays: usize,
) -> Vec<Lit> {
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
    let mut lit = vec![Lit::default(); samples.len()];
    sampler.light(&samples, ShadowRays::About(rays), &mut lit);
    lit
}

#[cfg(test)]
mod tests;
