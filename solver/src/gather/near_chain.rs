//! Gather rays whose hits are too near to be looked up go on as paths.
//!
//! At a hit y nearer than about the size of its patch ([`REACH`]), B(y) = ρ(y) (E^direct(y) +
//! B(next)): direct light by one shadow ray to a light chosen by its contribution, and one
//! cosine-distributed ray onwards, until a hit is far enough to be looked up in its far class. From
//! the second link on the path goes on with a probability q (Russian roulette), with what the
//! solution shows at y, E', as control variate:
//!
//!   E(y) = E' + (0, or with probability q: (E^direct(y) + B(next) − E') / q).
//!
//! The mean is that of the chain whatever E' is; where the solution shows what the chain finds, as in a
//! furnace, the choice makes no noise. After [`MAX_LINKS`] links the class of the distance answers.
//!
//! Where reflections are counted, every hit is one: that at the end of link l shows light which was reflected l times less
//! than the first may show, whether it is looked up or gone on from, so that a chain never finds light of more bounces than are
//! asked for. The last reflection gets the light of sources alone.
//!
//! Source: L. Szécsi, L. Szirmay-Kalos, C. Kelemen, "Variance Reduction for Russian-roulette",
//! Journal of WSCG 11(3), 2003.
//!
//! Measured on furnished rooms: the error that finite patches make falls 1.3–3 times, and the
//! relative error in dark places from 219 % to 4.5 %.

use super::guide::Guides;
use super::lookup::{Lookup, MAX_REPLICATES, PerSolution, Seen, Solutions};
use super::{Key, Tally};
use crate::bvh::{Hit, Ray};
use crate::direct::{DirectSampler, Sample, ShadowRays};
use crate::patches::Side;
use crate::sampling::{self, Sequence, Stage, cosine_hemisphere, hash};
use crate::world::{Receiver, World};
use glam::Vec3;
use luxel_scenes::{Irradiance, Rgb, Sidedness};
use std::ops::Range;

/// Links after which a chain is looked up wherever it is: light in crevices of that depth is
/// below 1 % of what entered for ρ ≤ 0.75. More measured no different.
pub(super) const MAX_LINKS: u32 = 16;

/// Distance, in sizes of the patch that is hit, from which it is looked up: a tuned value. Smaller,
/// and fine meshes get dark gaps wrong (17 000 patches of a furnished office at 1, 1.5 and 2: 9.4,
/// 4.2 and 2.7 % relRMSE, 0.91, 0.84 and 0.81 % nRMSE); larger, and longer chains bring noise (the
/// default budget: 1.26, 1.26 and 1.27 %, bare rooms 3 % of the error more at 2) and time.
const REACH: f32 = 1.5;

/// How much the difference from the coarser mesh counts at hits that are looked up, and would be gone on
/// from with that mesh: a tuned value. At 0 the crevices of a furnished office are missing (at 6000 and
/// 16 000 patches 0.34 and 0.15 % are stated where 0.46 and 0.23 % are wrong), at 1 coarse meshes
/// state far too much (at 3000 1.7 where 0.4 % is wrong).
const NEAR_WEIGHT: f64 = 0.5;

/// A path on its way: what it will add to its receiver is its throughput times B at the next hit.
#[derive(Clone, Copy)]
struct Path {
    receiver: u32,
    ray: u32,
    throughput: Rgb,
    /// What it has found so far.
    found: Rgb,
}

/// What the rays of a receiver found, as sums of B over them.
#[derive(Clone, Copy, Default)]
pub(crate) struct Found {
    /// Light of sources that shadow rays do not reach: the sky unless it has rays of its own, emission
    /// beyond the exact sources.
    pub(crate) direct: Rgb,
    /// Reflected light of chains: what is the same in every solution.
    pub(crate) chained: Rgb,
    /// Reflected light that was looked up, by solution.
    pub(crate) looked_up: PerSolution,
    /// What was looked up less what the coarser mesh shows there, by solution.
    pub(crate) difference: PerSolution,
    /// Squares of what each ray found altogether.
    squares: Rgb,
    /// Rays that met the back of a one-sided face.
    backs: u32,
}

impl Found {
    /// Takes in light that is emitted where a chain's link ends.
    fn add_emitted(&mut self, path: &mut Path, link: u32, light: Rgb) {
        if link == 0 {
            self.add_square(path, light);
            self.direct += light;
        } else {
            self.add_chained(path, light);
        }
    }

    /// Takes in direct light that a near hit reflects.
    fn add_chained(&mut self, path: &mut Path, light: Rgb) {
        self.add_square(path, light);
        self.chained += light;
    }

    /// Makes the square of what a ray has found the square of that and more: (a + b)² = a² + b (2a + b).
    fn add_square(&mut self, path: &mut Path, light: Rgb) {
        self.squares += light * (2.0 * path.found + light);
        path.found += light;
    }

    /// Takes in what was looked up at a hit.
    #[inline]
    fn look_up(&mut self, path: &mut Path, throughput: Rgb, shown: &[Vec3], range: Range<usize>) {
        let share = 1.0 / range.len() as f64;
        let mut mean = Rgb::ZERO;
        for s in range {
            let light = throughput * shown[s].as_dvec3();
            self.looked_up[s] += light;
            mean += light * share;
        }
        self.add_square(path, mean);
    }

    /// Takes in how much less a coarser mesh shows at a hit; `throughput` holds the weight of the comparison.
    fn compare(&mut self, throughput: Rgb, fine: &[Vec3], coarse: &[Vec3], range: Range<usize>) {
        for s in range {
            self.difference[s] += throughput * (fine[s] - coarse[s]).as_dvec3();
        }
    }

    /// Adds the indirect light to a tally.
    pub(super) fn add_indirect_to(&self, tally: &mut Tally, gather: usize, solutions: usize) {
        let looked_up: Rgb = self.looked_up.iter().sum();
        tally.indirect[gather] += self.chained + looked_up / solutions.max(1) as f64;
        for s in 0..MAX_REPLICATES {
            tally.by_solution[s] += self.looked_up[s];
            tally.difference[s] += self.difference[s];
        }
        tally.squares += self.squares;
        tally.backs += self.backs;
    }
}

/// Scratch space for gathering a batch of receivers.
pub(crate) struct Chains<'a> {
    world: &'a World<'a>,
    lookup: Option<&'a Lookup>,
    solutions: Solutions,
    /// Whether receivers get the light of the sky by other rays.
    sky_is_apart: bool,
    guides: Option<&'a Guides>,
    direct: DirectSampler<'a>,
    paths: Vec<Path>,
    rays: Vec<Ray>,
    hits: Vec<Hit>,
}

impl<'a> Chains<'a> {
    pub(crate) fn new(
        world: &'a World<'a>,
        lookup: Option<&'a Lookup>,
        solutions: Solutions,
        sky_is_apart: bool,
    ) -> Self {
        Self {
            world,
            lookup,
            solutions,
            sky_is_apart,
            guides: None,
            direct: DirectSampler::new(world.lights(), world.bvh()),
            paths: Vec::new(),
            rays: Vec::new(),
            hits: Vec::new(),
        }
    }

    /// Lets the rays of receivers go where guides tell, whose items the receivers are.
    pub(super) fn follow_guides(&mut self, guides: Option<&'a Guides>) {
        self.guides = guides;
    }

    /// Casts `rays` rays from each receiver, after the `before` first of its sequence, and follows
    /// them; `add` is called once a receiver with its position in the batch and what its rays found.
    /// With nothing to look up only the light of sources that rays find is collected.
    pub(super) fn gather(
        &mut self,
        receivers: &[Receiver],
        keys: &[Key],
        seed: u64,
        before: u32,
        rays: u32,
        add: impl FnMut(usize, Found),
    ) {
        self.start(receivers, keys, seed, before, rays);
        self.follow_all(keys, seed, add);
    }

    /// Follows given rays, one for each of `keys`, of which it is the ray with the key's index. `add` is called once
    /// a ray with its position and what it found.
    ///
    /// # Panics
    /// When there is not one ray for each key.
    pub(crate) fn follow(
        &mut self,
        rays: &[Ray],
        keys: &[Key],
        seed: u64,
        add: impl FnMut(usize, Found),
    ) {
        assert_eq!(rays.len(), keys.len(), "one key for each ray");
        self.rays.clear();
        self.rays.extend_from_slice(rays);
        self.paths.clear();
        self.paths
            .extend(keys.iter().enumerate().map(|(slot, key)| Path {
                receiver: slot as u32,
                ray: key.index,
                throughput: Rgb::ONE,
                found: Rgb::ZERO,
            }));
        self.follow_all(keys, seed, add);
    }

    /// Follows the rays that were started until none is left.
    fn follow_all(&mut self, keys: &[Key], seed: u64, mut add: impl FnMut(usize, Found)) {
        let mut found = vec![Found::default(); keys.len()];
        for link in 0.. {
            if self.paths.is_empty() {
                break;
            }
            self.hits.resize(self.rays.len(), Hit::MISS);
            self.world.bvh().closest_hits(&self.rays, &mut self.hits);
            let near = self.look_up(keys, seed, link, &mut found);
            self.go_on(near, keys, seed, link, &mut found);
        }
        for (slot, found) in found.into_iter().enumerate() {
            add(slot, found);
        }
    }

    fn start(&mut self, receivers: &[Receiver], keys: &[Key], seed: u64, before: u32, rays: u32) {
        self.paths.clear();
        self.rays.clear();
        for (slot, (receiver, key)) in receivers.iter().zip(keys).enumerate() {
            let sequence = Sequence::new(seed, Stage::GATHER, key.item);
            let frame = sampling::Frame::around(receiver.normal.as_vec3());
            let first = before.wrapping_add(key.index.wrapping_mul(rays));
            let guide = self.guides.map(|guides| guides.of(key));
            for ray in (0..rays).map(|ray| first.wrapping_add(ray)) {
                let even = sequence.point2_f32(ray);
                let (point, weight) = guide.map_or((even, 1.0), |guide| guide.sample(even));
                let local = cosine_hemisphere::sample(point);
                self.rays
                    .push(Ray::new(receiver.origin, frame.to_world(local)));
                self.paths.push(Path {
                    receiver: slot as u32,
                    ray,
                    throughput: Rgb::splat(f64::from(weight)),
                    found: Rgb::ZERO,
                });
            }
        }
    }

    /// Adds what can be looked up; returns the paths that must go on.
    fn look_up(
        &self,
        keys: &[Key],
        seed: u64,
        link: u32,
        found: &mut [Found],
    ) -> Vec<(Path, Receiver)> {
        let surfaces = self.world.surfaces();
        let lights = self.world.lights();
        let mut near = Vec::new();
        for ((path, ray), hit) in self.paths.iter().zip(&self.rays).zip(&self.hits) {
            let found = &mut found[path.receiver as usize];
            let mut path = *path;
            let Some(interaction) = self.world.interaction(ray, hit) else {
                if link == 0 && self.sky_is_apart {
                    continue;
                }
                let sky = lights.sky(surfaces, ray.direction.as_dvec3());
                let light = path.throughput * sky.to_irradiance().0;
                found.add_emitted(&mut path, link, light);
                continue;
            };
            let (point, side) = (interaction.point, interaction.side);
            let one_sided = surfaces.material(interaction.face).sidedness == Sidedness::Front;
            if side == Side::Back && one_sided {
                found.backs += u32::from(link == 0);
                continue;
            }
            if !lights.is_source(interaction.face) {
                let emitted = surfaces.emission(point).to_radiosity();
                let light = path.throughput * emitted.0;
                found.add_emitted(&mut path, link, light);
            }
            let Some(lookup) = self.lookup.filter(|lookup| lookup.reflects(link)) else {
                continue;
            };
            let throughput = path.throughput * surfaces.reflectance(point).0;
            if throughput == Rgb::ZERO {
                continue;
            }
            let patches = lookup.patches();
            let origin = ray.origin.as_dvec3();
            let (triangle, position) = (point.triangle, interaction.receiver.position);
            let Some(patch) = patches.seen_from(origin, triangle, || position, side) else {
                continue;
            };
            let shown = lookup.irradiance(link, patch, hit.t);
            let range = lookup.range(self.solutions);
            if hit.t >= REACH * patches.size(patch) || link == MAX_LINKS {
                found.look_up(&mut path, throughput, shown, range.clone());
                let seen = Seen {
                    origin,
                    triangle,
                    position,
                    side,
                    distance: hit.t,
                    patch,
                };
                if let Some((coarse, size)) = lookup.coarse_irradiance(link, &seen) {
                    let is_near = hit.t < REACH * size;
                    let weight = if is_near { NEAR_WEIGHT } else { 1.0 };
                    found.compare(throughput * weight, shown, coarse, range);
                }
                continue;
            }
            let mut after = throughput;
            if link > 0 {
                let survival = throughput.max_element().min(1.0);
                let key = keys[path.receiver as usize];
                let choice = u64::from(path.ray) * u64::from(MAX_LINKS) + u64::from(link);
                if hash::uniform(seed, Stage::CHOICE, key.item, choice) < survival {
                    after = throughput / survival;
                } else {
                    after = Rgb::ZERO;
                }
                found.look_up(&mut path, throughput - after, shown, range);
            }
            if after != Rgb::ZERO {
                path.throughput = after;
                near.push((path, interaction.receiver));
            }
        }
        near
    }

    /// Direct light at the near hits, and the next ray of those that survive.
    fn go_on(
        &mut self,
        near: Vec<(Path, Receiver)>,
        keys: &[Key],
        seed: u64,
        link: u32,
        found: &mut [Found],
    ) {
        let sequence = |path: &Path, stage| {
            Sequence::new(seed, stage, keys[path.receiver as usize].item).dimension_set(link)
        };
        let samples: Vec<Sample> = near
            .iter()
            .map(|(path, receiver)| Sample {
                position: receiver.position,
                normal: receiver.normal,
                origin: receiver.origin,
                sequence: sequence(path, Stage::NEAR_DIRECT),
                index: path.ray,
            })
            .collect();
        let mut direct = vec![Irradiance::ZERO; samples.len()];
        self.direct
            .irradiance(&samples, ShadowRays::One, &mut direct);
        self.paths.clear();
        self.rays.clear();
        // After the last reflection only light that shadow rays do not reach is left to find.
        let reflects = self.lookup.is_some_and(|lookup| lookup.reflects(link + 1));
        let goes_on = reflects || self.world.lights().are_found_by_rays();
        for ((mut path, receiver), direct) in near.into_iter().zip(direct) {
            let light = path.throughput * direct.0;
            found[path.receiver as usize].add_chained(&mut path, light);
            if !goes_on {
                continue;
            }
            let u = sequence(&path, Stage::NEAR_CHAIN).point4_f32(path.ray);
            let frame = sampling::Frame::around(receiver.normal.as_vec3());
            let local = cosine_hemisphere::sample([u[0], u[1]]);
            self.rays
                .push(Ray::new(receiver.origin, frame.to_world(local)));
            self.paths.push(path);
        }
    }
}
