//! Radiance that arrives straight from the sources, projected.
//!
//! A polygon that covers the solid angle Ω with radiance L and of which n directions ω_j, even over Ω, are visible (v_j = 1) or not gives
//!
//!   L (Ω/n Σ v_j Y(ω_j) + v̄ (∫ Y dω − Ω/n Σ Y(ω_j))),   v̄ = Σ v_j / n:
//!
//! the exact coefficients where it is wholly visible, none where it is wholly hidden. In penumbrae the second part has a bias of the covariance
//! of v and Y over n; it is left out for fewer than [`MANY_RAYS`] rays. Points and parallel light are single directions. Rays are shared out among
//! sources by their fluence rate, as [`crate::direct`] does it by irradiance: a source that is due half a ray or more has rays of its own,
//! the rest share theirs by systematic sampling, and of very many only those that rough weights choose are looked at.
//!
//! Below the horizon of a point on a surface nothing arrives. Cost: about 0.3 µs for each source, and the rays.

use super::Place;
use super::harmonics::basis;
use super::polygon::{Slice, coefficients, fan};
use crate::bvh::{Bvh, Ray};
use crate::direct::{Lights, Source, systematic};
use crate::form_factors::{Plane, clip};
use crate::gather::MAX_REPLICATES;
use crate::geometry::ray_target;
use crate::sampling::{Sequence, Stage};
use glam::{DVec3, Vec3};
use luxel_scenes::Rgb;

/// Rays from which the exact coefficients are a control: with fewer the bias would show.
const MANY_RAYS: u32 = 8;

/// Lights a ray from which not all are looked at: their exact coefficients cost more than rays.
const MANY_LIGHTS: usize = 8;

/// By replicate and coefficient.
pub(super) type Projected<const N: usize> = [[Rgb; N]; MAX_REPLICATES];

/// A source as a place sees it, if nothing is in between.
#[derive(Clone, Copy)]
struct Seen<const N: usize> {
    source: u32,
    /// Of radiance one, of a point or parallel light for fluence rate one.
    coefficients: [f64; N],
    /// Radiance, or fluence rate.
    colour: Rgb,
    /// In sr; zero for a single direction.
    solid_angle: f64,
    /// Fluence rate, the sum of the channels: what rays are shared out by.
    weight: f64,
}

/// Rays to one source from one place for one replicate.
struct Group<const N: usize> {
    place: u32,
    replicate: u8,
    seen: Seen<N>,
    share: f64,
    first_ray: u32,
}

/// Scratch space for batches of places.
pub(super) struct Projector<'a, const N: usize> {
    lights: &'a Lights,
    bvh: &'a Bvh,
    groups: Vec<Group<N>>,
    rays: Vec<Ray>,
    directions: Vec<DVec3>,
    blocked: Vec<bool>,
    clipped: Vec<DVec3>,
    slices: Vec<Slice>,
    weights: Vec<f64>,
}

impl<'a, const N: usize> Projector<'a, N> {
    pub(super) fn new(lights: &'a Lights, bvh: &'a Bvh) -> Self {
        Self {
            lights,
            bvh,
            groups: Vec::new(),
            rays: Vec::new(),
            directions: Vec::new(),
            blocked: Vec::new(),
            clipped: Vec::new(),
            slices: Vec::new(),
            weights: Vec::new(),
        }
    }

    /// Coefficients at each of some places, by about `count` rays for each replicate.
    pub(super) fn project(
        &mut self,
        places: &[Place],
        items: &[u64],
        seeds: &[u64; MAX_REPLICATES],
        count: u32,
    ) -> Vec<Projected<N>> {
        self.groups.clear();
        self.rays.clear();
        self.directions.clear();
        let are_many = self.lights.sources().len() >= MANY_LIGHTS * count as usize;
        for (number, (place, &item)) in places.iter().zip(items).enumerate() {
            let sequences = seeds.map(|seed| Sequence::new(seed, Stage::INCIDENT, item));
            let number = number as u32;
            if are_many {
                self.cast_by_importance(number, place, &sequences, count);
            } else {
                self.share_out(number, place, &sequences, count);
            }
        }
        self.blocked.resize(self.rays.len(), false);
        self.bvh.occluded(&self.rays, &mut self.blocked);
        let mut projected = vec![[[Rgb::ZERO; N]; MAX_REPLICATES]; places.len()];
        for (index, group) in self.groups.iter().enumerate() {
            let end = self.groups.get(index + 1);
            let end = end.map_or(self.rays.len(), |next| next.first_ray as usize);
            let sums = &mut projected[group.place as usize][usize::from(group.replicate)];
            let values = self.visible(group, end);
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += group.seen.colour * (value * group.share);
            }
        }
        projected
    }

    /// What the rays of a group let through, of radiance (or fluence rate) one.
    fn visible(&self, group: &Group<N>, end: usize) -> [f64; N] {
        let rays = group.first_ray as usize..end;
        let count = rays.len() as f64;
        let seen = &group.seen;
        let (mut through, mut all, mut visible) = ([0.0; N], [0.0; N], 0.0);
        for ray in rays {
            let is_visible = f64::from(u8::from(!self.blocked[ray]));
            visible += is_visible / count;
            let values = basis::<N>(self.directions[ray]);
            for (k, y) in values.into_iter().enumerate() {
                through[k] += is_visible * y * seen.solid_angle / count;
                all[k] += y * seen.solid_angle / count;
            }
        }
        std::array::from_fn(|k| {
            if seen.solid_angle <= 0.0 {
                visible * seen.coefficients[k]
            } else if count < f64::from(MANY_RAYS) {
                through[k]
            } else {
                through[k] + visible * (seen.coefficients[k] - all[k])
            }
        })
    }

    /// Whole rays for the sources that are due them, shared ones for the rest.
    fn share_out(
        &mut self,
        number: u32,
        place: &Place,
        sequences: &[Sequence; MAX_REPLICATES],
        count: u32,
    ) {
        let sources = 0..self.lights.sources().len() as u32;
        let mut seen: Vec<Seen<N>> = sources.filter_map(|s| self.see(place, s)).collect();
        let total: f64 = seen.iter().map(|seen| seen.weight).sum();
        if total <= 0.0 {
            return;
        }
        let due = |seen: &Seen<N>| f64::from(count) * seen.weight / total;
        for seen in seen.iter().filter(|seen| due(seen) >= 0.5) {
            let rays = if seen.solid_angle > 0.0 {
                due(seen).round() as u32
            } else {
                // One ray says all about a point.
                1
            };
            self.outline(place, seen.source);
            for (replicate, sequence) in sequences.iter().enumerate() {
                self.open(number, replicate, *seen, 1.0);
                self.cast(place, seen, sequence, rays);
            }
        }
        seen.retain(|seen| due(seen) < 0.5);
        let rest: f64 = seen.iter().map(|seen| seen.weight).sum();
        if rest <= 0.0 {
            return;
        }
        let rays = (f64::from(count) * rest / total).ceil();
        for (replicate, sequence) in sequences.iter().enumerate() {
            let weights = seen.iter().map(|seen| seen.weight);
            systematic(weights, rest / rays, offset(sequence), |chosen, share| {
                let seen = seen[chosen];
                self.outline(place, seen.source);
                self.open(number, replicate, seen, share);
                self.cast(place, &seen, sequence, 1);
            });
        }
    }

    /// Rays to sources that rough weights choose: the sum of what each of six sides would receive is between one and √3 times
    /// what the point does.
    fn cast_by_importance(
        &mut self,
        number: u32,
        place: &Place,
        sequences: &[Sequence; MAX_REPLICATES],
        count: u32,
    ) {
        let mut sum = vec![0.0; self.lights.sources().len()];
        let mut weights = std::mem::take(&mut self.weights);
        for axis in DVec3::AXES {
            for normal in [axis, -axis] {
                self.lights.weigh(place.position, normal, &mut weights);
                for (sum, weight) in sum.iter_mut().zip(&weights) {
                    *sum += weight;
                }
            }
        }
        self.weights = weights;
        let step = sum.iter().sum::<f64>() / f64::from(count);
        if step <= 0.0 {
            return;
        }
        for (replicate, sequence) in sequences.iter().enumerate() {
            let weights = sum.iter().copied();
            systematic(weights, step, offset(sequence), |chosen, share| {
                if let Some(seen) = self.see(place, chosen as u32) {
                    self.open(number, replicate, seen, share);
                    self.cast(place, &seen, sequence, 1);
                }
            });
        }
    }

    /// A source as seen from a place, its outline left in the scratch space; `None` where nothing of it arrives.
    fn see(&mut self, place: &Place, source: u32) -> Option<Seen<N>> {
        let lights = self.lights;
        let is_above = |direction: DVec3| {
            place
                .horizon
                .is_none_or(|normal| normal.dot(direction) > 0.0)
        };
        let single = |towards: DVec3, fluence: Rgb| {
            let weight = fluence.element_sum();
            (weight > 0.0 && is_above(towards)).then(|| Seen {
                source,
                coefficients: basis(towards),
                colour: fluence,
                solid_angle: 0.0,
                weight,
            })
        };
        match &lights.sources()[source as usize] {
            Source::Polygon { radiance, .. } => {
                let solid_angle = self.outline(place, source);
                let weight = radiance.0.element_sum() * solid_angle;
                (weight > 0.0).then(|| Seen {
                    source,
                    coefficients: coefficients(place.position, &self.clipped, solid_angle),
                    colour: radiance.0,
                    solid_angle,
                    weight,
                })
            }
            Source::Point {
                position,
                intensity,
                distribution,
            } => {
                let to = *position - place.position;
                let squared = to.length_squared();
                let towards = to / squared.sqrt();
                if squared <= 0.0 {
                    return None;
                }
                single(
                    towards,
                    *intensity * (distribution.relative(-towards) / squared),
                )
            }
            Source::Directional {
                towards,
                irradiance,
            } => single(*towards, *irradiance),
        }
    }

    /// Leaves the part of a polygon that a place sees in the scratch space, and its fan; returns the solid angle.
    fn outline(&mut self, place: &Place, source: u32) -> f64 {
        self.clipped.clear();
        self.slices.clear();
        let Source::Polygon { shape, normal, .. } = &self.lights.sources()[source as usize] else {
            return 0.0;
        };
        let corners = shape.corners();
        if (place.position - corners[0]).dot(*normal) <= 0.0 {
            return 0.0;
        }
        match place.horizon {
            Some(normal) => {
                let point = place.position;
                clip(corners, &Plane { point, normal }, &mut self.clipped);
            }
            None => self.clipped.extend_from_slice(corners),
        }
        fan(place.position, &self.clipped, &mut self.slices)
    }

    fn open(&mut self, place: u32, replicate: usize, seen: Seen<N>, share: f64) {
        self.groups.push(Group {
            place,
            replicate: replicate as u8,
            seen,
            share,
            first_ray: self.rays.len() as u32,
        });
    }

    /// Casts the rays of the last group to a source whose outline is in the scratch space.
    fn cast(&mut self, place: &Place, seen: &Seen<N>, sequence: &Sequence, count: u32) {
        let origin = place.origin;
        match &self.lights.sources()[seen.source as usize] {
            Source::Polygon { normal, extent, .. } => {
                let sequence = sequence.dimension_set(seen.source);
                for index in 0..count {
                    let Some((direction, point)) =
                        draw(&self.slices, seen.solid_angle, sequence.point2(index))
                    else {
                        continue;
                    };
                    let target = ray_target(point, *normal, *extent, origin);
                    self.rays.push(Ray::segment(origin, target));
                    self.directions.push(direction);
                }
            }
            Source::Point { position, .. } => {
                let target: Vec3 = position.as_vec3();
                self.rays.push(Ray::segment(origin, target));
                self.directions
                    .push((*position - place.position).normalize_or_zero());
            }
            Source::Directional { towards, .. } => {
                self.rays.push(Ray::new(origin, towards.as_vec3()));
                self.directions.push(*towards);
            }
        }
    }
}

/// A direction to the polygon of a fan and the point that it meets, even by solid angle.
fn draw(slices: &[Slice], solid_angle: f64, [x, y]: [f64; 2]) -> Option<(DVec3, DVec3)> {
    let mut rest = x * solid_angle;
    let mut chosen = None;
    for slice in slices {
        let own = slice.triangle.solid_angle();
        chosen = Some((slice, (rest / own).clamp(0.0, 1.0 - f64::EPSILON)));
        if rest < own {
            break;
        }
        rest -= own;
    }
    let (slice, share) = chosen?;
    let drawn = slice.triangle.sample([share, y]);
    let [a, b, c] = slice.corners;
    let [u, v, w] = drawn.barycentric;
    Some((drawn.direction, a * u + b * v + c * w))
}

/// Where systematic sampling begins, as a share of its step.
fn offset(sequence: &Sequence) -> f64 {
    let [offset, _] = sequence.dimension_set(u32::MAX).point2(0);
    offset
}
