//! Casts the rows of the system and the direct light at the same points.
//!
//! From each of K/2 points of a patch two cosine-distributed rays leave. A ray belongs, at its hit,
//! to the [class](Class) of its length against the size of the patch that it meets, and the point
//! that it leaves counts for the class of its partner's length: places that see nearby surfaces
//! (corners, crevices, the desk beneath a sheet of paper) are seen by short rays, the open parts of
//! the same patch by long ones. Weighting by the partner and not by the ray itself keeps the
//! classes' irradiances unbiased by the ray's own length. It costs no ray. Without classes the
//! light that falls on the open part of a patch leaks into what the patch hides and is absorbed
//! there; see [`Class::COUNT`] for what they save.
//!
//! Points both of whose rays meet the back of a one-sided face lie inside a solid (the floor under
//! a box) and are dropped; a single back hit is black.
//!
//! Source: the classes are luxel's own; ray-cast form factors after T. J. V. Malley, "A Shading
//! Method for Computer Generated Images", 1988. Cost: one ray per entry.

use super::{Class, RadiosityConfig, unknown};
use crate::bvh::{Hit, Ray};
use crate::direct::{DirectSampler, Sample, ShadowRays};
use crate::patches::{PatchId, Patches};
use crate::sampling::{self, Sequence, Stage, cosine_hemisphere};
use crate::transport::{Row, SparseRows};
use crate::world::World;
use luxel_scenes::{Irradiance, Rgb};
use rayon::prelude::*;

/// Patches per parallel task: batches of a few thousand rays.
const CHUNK: usize = 32;

/// Patches that draw consecutive parts of one sequence of points and directions. Each part by itself is as even as a
/// sequence of its own, and all together are: neighbours in index are mostly neighbours in space, which light through
/// an opening reaches alike, and the noise of what they send on together falls faster than that of independent rows. In a dark
/// corridor behind two corners 3400 patches leave half the noise (3.5 % for 5 %), in rooms without such openings as much as before.
const TOGETHER: u32 = 1024;

/// What casting gives.
pub(super) struct CastRows {
    /// Transport between the unknowns.
    pub(super) rows: SparseRows,
    /// Direct irradiance of each unknown, sky included.
    pub(super) direct: Vec<Irradiance>,
    /// Rays that speak for each class of each patch: their shares are the shares of its area.
    pub(super) weights: Vec<u32>,
    pub(super) cast_rays: usize,
    pub(super) buried_points: usize,
}

/// The rows of some patches.
#[derive(Default)]
struct Part {
    entries: Vec<u32>,
    /// Of each class of each patch: entries of its row, and rays.
    counts: Vec<[[u32; 2]; Class::COUNT]>,
    direct: Vec<[Irradiance; Class::COUNT]>,
    buried_points: usize,
}

/// What a ray of a row met.
#[derive(Clone, Copy)]
enum Met {
    Unknown(u32),
    Nothing(Rgb),
    Back,
}

pub(super) fn cast(world: &World, patches: &Patches, config: &RadiosityConfig) -> CastRows {
    let count = patches.len();
    let parts: Vec<Part> = (0..count.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(count);
            cast_part(world, patches, config, range.map(PatchId::new))
        })
        .collect();
    let mut entries = Vec::with_capacity(parts.iter().map(|part| part.entries.len()).sum());
    let mut rows = Vec::with_capacity(Class::COUNT * count);
    let mut direct = Vec::with_capacity(Class::COUNT * count);
    let mut weights = Vec::with_capacity(Class::COUNT * count);
    let mut buried_points = 0;
    for part in parts {
        let mut first = entries.len();
        for (counts, class_direct) in part.counts.iter().zip(&part.direct) {
            let mut own = [Row {
                first,
                end: first,
                rays: 0,
            }; Class::COUNT];
            for (row, &[count, rays]) in own.iter_mut().zip(counts) {
                *row = Row {
                    first,
                    end: first + count as usize,
                    rays,
                };
                first = row.end;
            }
            weights.extend(own.iter().map(|row| row.rays));
            for class in 0..Class::COUNT {
                let stand_in = stand_in(&own, class);
                rows.push(own[stand_in]);
                direct.push(class_direct[stand_in]);
            }
        }
        entries.extend(part.entries);
        buried_points += part.buried_points;
    }
    let cast_rays = count * (config.rays / 2) * 2;
    CastRows {
        rows: SparseRows::new(entries, rows),
        direct,
        weights,
        cast_rays,
        buried_points,
    }
}

fn cast_part(
    world: &World,
    patches: &Patches,
    config: &RadiosityConfig,
    ids: impl Iterator<Item = PatchId> + Clone,
) -> Part {
    let points = config.rays / 2;
    let geometry = world.surfaces().geometry();
    let mut part = Part::default();
    let mut rays = Vec::new();
    let mut samples = Vec::new();
    for patch in ids.clone() {
        let item = (config.replicate << 32) | u64::from(patch.0 / TOGETHER);
        let first = (patch.0 % TOGETHER) * points as u32;
        let positions = Sequence::new(config.seed, Stage::PATCHES, item);
        let directions = Sequence::new(config.seed, Stage::ROWS, item);
        let lights = Sequence::new(config.seed, Stage::PATCH_DIRECT, item);
        for point in first..first + points as u32 {
            let surface = patches.sample(geometry, patch, positions.point2(point));
            let frame = sampling::Frame::around(surface.normal.as_vec3());
            // Four dimensions, not two consecutive points of two: those lie in opposite halves of
            // the square, and the class that a ray's partner speaks for must not depend on it.
            let [a, b, c, d] = directions.point4_f32(point);
            for u in [[a, b], [c, d]] {
                let local = cosine_hemisphere::sample(u);
                rays.push(Ray::new(surface.origin, frame.to_world(local)));
            }
            samples.push(Sample {
                position: surface.position,
                normal: surface.normal,
                origin: surface.origin,
                sequence: lights,
                index: point,
            });
        }
    }
    let mut hits = vec![Hit::MISS; rays.len()];
    world.bvh().closest_hits(&rays, &mut hits);
    let mut direct = vec![Irradiance::ZERO; samples.len()];
    DirectSampler::new(world.lights(), world.bvh()).irradiance(
        &samples,
        ShadowRays::About(config.shadow_rays),
        &mut direct,
    );
    for (slot, patch) in ids.enumerate() {
        let size = patches.size(patch);
        let mut lists: [Vec<u32>; Class::COUNT] = Default::default();
        let mut ray_counts = [0u32; Class::COUNT];
        let mut sums = [Rgb::ZERO; Class::COUNT];
        let range = slot * points..(slot + 1) * points;
        for (point, direct) in range.clone().zip(&direct[range]) {
            let pair = [2 * point, 2 * point + 1];
            let met = pair.map(|ray| meet(world, patches, &rays[ray], &hits[ray]));
            if met.iter().all(|met| matches!(met, Met::Back)) {
                part.buried_points += 1;
                continue;
            }
            for (ray, met) in met.into_iter().enumerate() {
                let partner = hits[pair[1 - ray]].t;
                let class = Class::at(partner, size).index();
                ray_counts[class] += 1;
                sums[class] += direct.0;
                match met {
                    Met::Unknown(unknown) => lists[class].push(unknown),
                    Met::Nothing(sky) => sums[class] += sky,
                    Met::Back => {}
                }
            }
        }
        let classes = Class::all().map(Class::index);
        part.direct.push(
            classes.map(|class| Irradiance(sums[class] / f64::from(ray_counts[class].max(1)))),
        );
        part.counts
            .push(classes.map(|class| [lists[class].len() as u32, ray_counts[class]]));
        for list in lists {
            part.entries.extend(list);
        }
    }
    part
}

/// The class whose row stands in for one that no ray speaks for: the next farther one,
/// else the next nearer one. Either order measured the same.
fn stand_in(rows: &[Row; Class::COUNT], class: usize) -> usize {
    let filled = |&other: &usize| rows[other].rays > 0;
    let farther = (0..=class).rev().find(filled);
    farther
        .or_else(|| (class..Class::COUNT).find(filled))
        .unwrap_or(class)
}

/// The unknown that a ray met, or the sky's share of E: π L of the direction that it left in.
fn meet(world: &World, patches: &Patches, ray: &Ray, hit: &Hit) -> Met {
    if hit.triangle().is_none() {
        let sky = world
            .lights()
            .sky(world.surfaces(), ray.direction.as_dvec3());
        return Met::Nothing(sky.to_irradiance().0);
    }
    match world.patch_hit(patches, ray, hit) {
        None => Met::Back,
        Some(patch) => {
            let class = Class::at(hit.t, patches.size(patch));
            Met::Unknown(unknown(patch, class) as u32)
        }
    }
}
