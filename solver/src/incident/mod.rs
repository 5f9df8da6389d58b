//! Incident radiance at points, projected on spherical harmonics: what a normal that is not known yet would receive.
//!
//! L_k = ∫ L Y_k dω over the hemisphere above a luxel, or over all directions around a probe in the air ([`harmonics`]). Light of sources
//! is projected by shadow rays (`direct`), everything else by rays of a known density p that look the radiosity solution up as the final gather's
//! do, near chains included ([`crate::gather`]): (1/M) Σ L(ω_m) Y_k(ω_m) / p(ω_m). Probes cast their rays evenly, for which no
//! coefficient is better known than another (Σ Y_lm² over m is the same in all directions); luxels half evenly and half by the cosine
//! ([`mixed_hemisphere`]), because the cosine alone would give light at the horizon weights without bound.
//!
//! Replicate r is gather r with what solution r shows more than the mean of all, so that the scatter of [`MAX_REPLICATES`] replicates tells
//! the noise of both ([`estimate`]). Unbiased but for the finite size of patches, which a coarser mesh at the same hits makes known, and for
//! penumbrae of sources as `direct` says. Cost: M rays and S shadow rays a place, half of them continued once.

mod direct;
pub mod estimate;
pub mod harmonics;
mod joined;
mod polygon;
mod refine;

pub use joined::joined;
pub use refine::{Aim, Outcome, Treatment, bytes_to_gather, until};

use crate::bvh::Ray;
use crate::gather::{Chains, Components, Found, Key, Lookup, MAX_REPLICATES, Solutions};
use crate::sampling::{Frame, Sequence, Stage, hash, mixed_hemisphere, sphere};
use crate::world::{Receiver, World};
use direct::Projector;
use glam::{DVec3, Vec3};
use harmonics::basis;
use luxel_scenes::{Radiosity, Rgb};
use rayon::prelude::*;

/// Rays that a parallel task aims at: what each found is held on its own, 300 bytes.
const RAYS_PER_TASK: usize = 4096;

/// A point at which radiance arrives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Position in the unit frame.
    pub position: DVec3,
    /// Origin for rays.
    pub origin: Vec3,
    /// The unit normal of the surface that it lies on, below whose horizon nothing arrives; `None` for a point in the air.
    pub horizon: Option<DVec3>,
}

impl From<&Receiver> for Place {
    fn from(receiver: &Receiver) -> Self {
        Self {
            position: receiver.position,
            origin: receiver.origin,
            horizon: Some(receiver.normal),
        }
    }
}

impl Place {
    /// A point in the air, given in the unit frame.
    pub fn in_air(position: DVec3) -> Self {
        Self {
            position,
            origin: position.as_vec3(),
            horizon: None,
        }
    }
}

/// Coefficients by replicate, in W/m² sr^−½; single precision, as what is looked up.
pub type Replicates<const N: usize> = [[Vec3; N]; MAX_REPLICATES];

/// What arrives at a place, by replicate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incident<const N: usize> {
    /// From sources, by shadow rays.
    pub direct: Replicates<N>,
    /// What gather rays found.
    pub gathered: Replicates<N>,
    /// What they found less what a coarser mesh shows, by solution.
    pub difference: Replicates<N>,
    /// Gather rays of each replicate.
    pub rays: u32,
    /// Shadow rays of each replicate, about.
    pub shadow_rays: u32,
}

impl<const N: usize> Default for Incident<N> {
    fn default() -> Self {
        let none = [[Vec3::ZERO; N]; MAX_REPLICATES];
        Self {
            direct: none,
            gathered: none,
            difference: none,
            rays: 0,
            shadow_rays: 0,
        }
    }
}

impl<const N: usize> Incident<N> {
    /// Adds further rays at the same place; direct light is that of the larger number of shadow rays.
    fn join(&mut self, other: &Self) {
        let all = (self.rays + other.rays).max(1) as f32;
        let [old, new] = [self.rays, other.rays].map(|rays| rays as f32 / all);
        for r in 0..MAX_REPLICATES {
            for k in 0..N {
                self.gathered[r][k] = self.gathered[r][k] * old + other.gathered[r][k] * new;
                self.difference[r][k] = self.difference[r][k] * old + other.difference[r][k] * new;
            }
        }
        self.rays += other.rays;
        if other.shadow_rays > self.shadow_rays {
            self.direct = other.direct;
            self.shadow_rays = other.shadow_rays;
        }
    }
}

/// What to cast from each place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IncidentConfig {
    /// Gather rays of each replicate.
    pub rays: u32,
    /// Those that were cast before for the same items: sequences go on from there.
    pub rays_before: u32,
    /// Shadow rays of each replicate.
    pub shadow_rays: u32,
    /// Which light.
    pub components: Components,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// Radiance incident at each place. `items` tell their random numbers apart; a result does not depend on what else is gathered along.
///
/// `lookup` may be missing where only direct light is wanted.
///
/// # Panics
/// When there is not one item for each place, or reflected light is wanted and there are not [`MAX_REPLICATES`] solutions to look up.
pub fn incident<const N: usize>(
    world: &World,
    lookup: Option<&Lookup>,
    places: &[Place],
    items: &[u64],
    config: &IncidentConfig,
) -> Vec<Incident<N>> {
    assert_eq!(places.len(), items.len(), "one item for each place");
    let lights = world.lights();
    let wants_indirect = config.components != Components::Direct && config.rays > 0;
    assert!(
        !wants_indirect || lookup.is_some_and(|lookup| lookup.solutions() == MAX_REPLICATES),
        "reflected light is looked up in a solution for each replicate"
    );
    let lookup = lookup.filter(|_| wants_indirect);
    let follows = config.rays > 0 && (wants_indirect || lights.are_found_by_rays());
    let shadows = config.shadow_rays > 0 && config.components != Components::Indirect;
    let seeds: [u64; MAX_REPLICATES] =
        std::array::from_fn(|r| hash::key(config.seed, Stage::INCIDENT, r as u64));
    let chunk = (RAYS_PER_TASK / config.rays.max(config.shadow_rays).max(1) as usize).clamp(1, 256);
    let of_chunk = |(places, items): (&[Place], &[u64])| {
        let mut found = vec![Incident::<N>::default(); places.len()];
        if shadows {
            let mut projector = Projector::<N>::new(lights, world.bvh());
            let projected = projector.project(places, items, &seeds, config.shadow_rays);
            for (found, projected) in found.iter_mut().zip(projected) {
                found.direct = projected.map(|row| row.map(Rgb::as_vec3));
            }
        }
        if follows {
            let mut chains = Chains::new(world, lookup, Solutions::All, false);
            let sums = gathered::<N>(&mut chains, lookup, places, items, &seeds, config);
            for (found, sums) in found.iter_mut().zip(sums) {
                sums.finish(found, config.rays);
            }
        }
        for found in &mut found {
            found.rays = config.rays;
            found.shadow_rays = config.shadow_rays;
        }
        found
    };
    places
        .par_chunks(chunk)
        .zip(items.par_chunks(chunk))
        .flat_map_iter(of_chunk)
        .collect()
}

/// Sums over the gather rays of a place.
#[derive(Clone)]
struct RaySums<const N: usize> {
    by_gather: [[Rgb; N]; MAX_REPLICATES],
    by_solution: [[Rgb; N]; MAX_REPLICATES],
    difference: [[Rgb; N]; MAX_REPLICATES],
}

impl<const N: usize> RaySums<N> {
    const NONE: Self = Self {
        by_gather: [[Rgb::ZERO; N]; MAX_REPLICATES],
        by_solution: [[Rgb::ZERO; N]; MAX_REPLICATES],
        difference: [[Rgb::ZERO; N]; MAX_REPLICATES],
    };

    /// Takes in what a ray of a gather found; `values` are those of the basis over the density.
    fn add(
        &mut self,
        gather: usize,
        found: &Found,
        components: Components,
        solutions: usize,
        values: &[f64; N],
    ) {
        let looked_up: Rgb = found.looked_up.iter().sum::<Rgb>() / solutions.max(1) as f64;
        let light = match components {
            Components::All => found.direct + found.chained + looked_up,
            Components::Direct => found.direct,
            Components::Indirect => found.chained + looked_up,
        };
        let radiance = |light: Rgb| Radiosity(light).to_radiance().0;
        let light = radiance(light);
        for (k, value) in values.iter().enumerate() {
            self.by_gather[gather][k] += light * *value;
        }
        for s in 0..solutions {
            let [shown, less] = [found.looked_up[s], found.difference[s]].map(radiance);
            for (k, value) in values.iter().enumerate() {
                self.by_solution[s][k] += shown * *value;
                self.difference[s][k] += less * *value;
            }
        }
    }

    /// Writes means.
    fn finish(&self, found: &mut Incident<N>, rays: u32) {
        let of_gather = 1.0 / f64::from(rays);
        let of_all = of_gather / MAX_REPLICATES as f64;
        for k in 0..N {
            let solutions = self.by_solution.iter().map(|row| row[k]).sum::<Rgb>();
            for r in 0..MAX_REPLICATES {
                let more = self.by_solution[r][k] - solutions / MAX_REPLICATES as f64;
                let value = self.by_gather[r][k] * of_gather + more * of_all;
                found.gathered[r][k] = value.as_vec3();
                found.difference[r][k] = (self.difference[r][k] * of_all).as_vec3();
            }
        }
    }
}

/// What the gather rays of some places find.
fn gathered<const N: usize>(
    chains: &mut Chains<'_>,
    lookup: Option<&Lookup>,
    places: &[Place],
    items: &[u64],
    seeds: &[u64; MAX_REPLICATES],
    config: &IncidentConfig,
) -> Vec<RaySums<N>> {
    let solutions = lookup.map_or(0, Lookup::solutions);
    let per_place = config.rays as usize;
    let mut sums = vec![RaySums::<N>::NONE; places.len()];
    let mut keys = Vec::with_capacity(places.len() * per_place);
    let mut rays = Vec::with_capacity(places.len() * per_place);
    let mut values: Vec<[f64; N]> = Vec::with_capacity(places.len() * per_place);
    for (gather, &seed) in seeds.iter().enumerate() {
        keys.clear();
        rays.clear();
        values.clear();
        for (place, &item) in places.iter().zip(items) {
            let sequence = Sequence::new(seed, Stage::GATHER, item);
            let frame = place.horizon.map(|normal| Frame::around(normal.as_vec3()));
            for index in (0..config.rays).map(|ray| config.rays_before.wrapping_add(ray)) {
                let u = sequence.point2_f32(index);
                let (direction, density) = match &frame {
                    Some(frame) => {
                        let local = mixed_hemisphere::sample(u);
                        (frame.to_world(local), mixed_hemisphere::pdf(local.z))
                    }
                    None => (sphere::sample_sphere(u), sphere::pdf_sphere()),
                };
                let weight = 1.0 / f64::from(density);
                values.push(basis::<N>(direction.as_dvec3()).map(|y| y * weight));
                rays.push(Ray::new(place.origin, direction));
                keys.push(Key { item, index });
            }
        }
        chains.follow(&rays, &keys, seed, |ray, found| {
            let sums = &mut sums[ray / per_place];
            sums.add(gather, &found, config.components, solutions, &values[ray]);
        });
    }
    sums
}

#[cfg(test)]
mod tests;
