//! Direct light at many points at once, with shadow rays in batches.
//!
//! E = Σ_lights E_i V_i, where E_i is the exact unoccluded irradiance and V_i the mean visibility
//! of points of light i that are distributed as its kernel ([`super::kernel`]). Few rays for many lights
//! are given to lights by rough weights ([`super::importance`]), and only the E_i of these are computed. More rays
//! are shared out by contribution: a light that is due half a ray or more gets whole rays. The many small
//! contributions that are due less share a few rays by systematic sampling: each ray stands for
//! Σ E / n of the light that it is cast to. Bounded by the unoccluded irradiance, and exact where a light
//! is wholly visible or wholly hidden; by rough weights bounded by five times that, and exact on average only. Unbiased
//! but for lights of [`MANY_RAYS`] rays and more, whose bias is far below their noise.

use super::kernel::Scratch;
use super::lights::{Lights, Source};
use super::lit::{Lit, LitSum};
use crate::bvh::{Bvh, Ray};
use crate::geometry::ray_target;
use crate::sampling::Sequence;
use glam::{DVec3, Vec3};
use luxel_scenes::{Irradiance, Rgb};

/// Rays to one light from which their mean is a ratio of stratified points and not a mean of
/// rejected ones: the bias is then below a thousandth, and the noise a fifth lower.
const MANY_RAYS: u32 = 8;

/// Lights a ray from which their contributions are not all computed to choose among them: with fewer that costs
/// little, and where nothing is hidden the sum of them all has no noise.
const MANY_LIGHTS: usize = 8;

/// How many shadow rays a point may cast.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShadowRays {
    /// One ray, to a light chosen by its contribution, roughly where there are many.
    One,
    /// About this many, shared out by contribution.
    About(usize),
}

/// A point at which direct light is wanted.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Position in the unit frame.
    pub position: DVec3,
    /// Unit normal.
    pub normal: DVec3,
    /// Origin for rays, off the surface.
    pub origin: Vec3,
    /// Where its random numbers come from.
    pub sequence: Sequence,
    /// Index of the first of them.
    pub index: u32,
}

/// What one light contributes at a point.
#[derive(Clone, Copy)]
struct Contribution {
    source: u32,
    irradiance: Rgb,
    /// Sum of the channels: what rays are shared out by.
    weight: f64,
}

/// A set of rays whose mean visibility scales one irradiance.
struct Group {
    sample: u32,
    irradiance: Rgb,
    first_ray: u32,
}

/// Scratch space for batches of samples.
pub struct DirectSampler<'a> {
    lights: &'a Lights,
    bvh: &'a Bvh,
    contributions: Vec<Contribution>,
    importance: Vec<f64>,
    groups: Vec<Group>,
    rays: Vec<Ray>,
    weights: Vec<f64>,
    blocked: Vec<bool>,
    scratch: Scratch,
}

impl<'a> DirectSampler<'a> {
    /// A sampler of the given lights.
    pub fn new(lights: &'a Lights, bvh: &'a Bvh) -> Self {
        Self {
            lights,
            bvh,
            contributions: Vec::new(),
            importance: Vec::new(),
            groups: Vec::new(),
            rays: Vec::new(),
            weights: Vec::new(),
            blocked: Vec::new(),
            scratch: Scratch::default(),
        }
    }

    /// Direct irradiance of each sample in W/m², written to `irradiance`.
    ///
    /// # Panics
    /// When `irradiance` is not as long as `samples`.
    pub fn irradiance(
        &mut self,
        samples: &[Sample],
        shadow_rays: ShadowRays,
        irradiance: &mut [Irradiance],
    ) {
        assert_eq!(
            samples.len(),
            irradiance.len(),
            "one irradiance for each sample"
        );
        irradiance.fill(Irradiance::ZERO);
        self.cast_all(samples, shadow_rays);
        for (index, group) in self.groups.iter().enumerate() {
            let (visible, _) = self.visible(index);
            if visible > 0.0 {
                irradiance[group.sample as usize].0 += group.irradiance * visible;
            }
        }
    }

    /// The same with what is to be expected of its noise.
    ///
    /// # Panics
    /// When `lit` is not as long as `samples`.
    pub fn light(&mut self, samples: &[Sample], shadow_rays: ShadowRays, lit: &mut [Lit]) {
        assert_eq!(samples.len(), lit.len(), "one result for each sample");
        lit.fill(Lit::default());
        self.cast_all(samples, shadow_rays);
        let mut sum = LitSum::default();
        for (index, group) in self.groups.iter().enumerate() {
            let (visible, rays) = self.visible(index);
            sum.add(group.irradiance, visible, rays);
            let next = self.groups.get(index + 1);
            if next.is_none_or(|next| next.sample != group.sample) {
                lit[group.sample as usize] = std::mem::take(&mut sum).finish();
            }
        }
    }

    /// Casts the rays of all samples.
    fn cast_all(&mut self, samples: &[Sample], shadow_rays: ShadowRays) {
        self.groups.clear();
        self.rays.clear();
        self.weights.clear();
        let count = match shadow_rays {
            ShadowRays::One => 1,
            ShadowRays::About(count) => count,
        };
        let are_many = self.lights.sources().len() >= MANY_LIGHTS * count;
        for (index, sample) in samples.iter().enumerate() {
            if are_many {
                self.cast_by_importance(index, sample, count as u32);
                continue;
            }
            let total = self.contribute(sample);
            if total > 0.0 {
                match shadow_rays {
                    ShadowRays::One => self.cast_shared(index, sample, total, 1, 0),
                    ShadowRays::About(count) => self.share_out(index, sample, total, count),
                }
            }
        }
        self.blocked.resize(self.rays.len(), false);
        self.bvh.occluded(&self.rays, &mut self.blocked);
    }

    /// The share of a group's light that its rays let through, and how many they are.
    fn visible(&self, group: usize) -> (f64, usize) {
        let first = self.groups[group].first_ray as usize;
        let end = self
            .groups
            .get(group + 1)
            .map_or(self.rays.len(), |next| next.first_ray as usize);
        let mut total = 0.0;
        let mut visible = 0.0;
        for (weight, &blocked) in self.weights[first..end]
            .iter()
            .zip(&self.blocked[first..end])
        {
            total += weight;
            visible += if blocked { 0.0 } else { *weight };
        }
        let share = if visible > 0.0 { visible / total } else { 0.0 };
        (share, end - first)
    }

    /// Collects what each light contributes at a point; returns the sum of weights.
    fn contribute(&mut self, sample: &Sample) -> f64 {
        self.contributions.clear();
        let mut total = 0.0;
        for (index, source) in self.lights.sources().iter().enumerate() {
            let irradiance = source.irradiance(sample.position, sample.normal);
            let weight = irradiance.element_sum();
            if weight > 0.0 {
                total += weight;
                self.contributions.push(Contribution {
                    source: index as u32,
                    irradiance,
                    weight,
                });
            }
        }
        total
    }

    /// Whole rays for the lights that are due them, shared rays for the rest.
    fn share_out(&mut self, index: usize, sample: &Sample, total: f64, count: usize) {
        let per_weight = count as f64 / total;
        let contributions = std::mem::take(&mut self.contributions);
        let mut rest = Vec::new();
        let mut rest_weight = 0.0;
        for contribution in &contributions {
            let due = contribution.weight * per_weight;
            if due >= 0.5 {
                let rays = match self.lights.sources()[contribution.source as usize] {
                    Source::Polygon { .. } => due.round() as u32,
                    // One ray says all about a point.
                    Source::Point { .. } | Source::Directional { .. } => 1,
                };
                self.open_group(index, contribution.irradiance);
                if rays < MANY_RAYS {
                    for ray in 0..rays {
                        self.cast(sample, contribution.source, sample.index * rays + ray);
                    }
                } else {
                    self.cast_many(sample, contribution.source, rays);
                }
            } else {
                rest.push(*contribution);
                rest_weight += contribution.weight;
            }
        }
        self.contributions = rest;
        if rest_weight > 0.0 {
            let rays = (rest_weight * per_weight).ceil() as u32;
            self.cast_shared(index, sample, rest_weight, rays, 1);
        }
        self.contributions = contributions;
    }

    /// Casts `count` rays to the collected contributions by systematic sampling of their weights.
    fn cast_shared(&mut self, index: usize, sample: &Sample, total: f64, count: u32, set: u32) {
        let contributions = std::mem::take(&mut self.contributions);
        let weights = contributions.iter().map(|contribution| contribution.weight);
        let step = total / f64::from(count);
        systematic(weights, step, offset(sample, set), |chosen, share| {
            let contribution = &contributions[chosen];
            self.open_group(index, contribution.irradiance * share);
            self.cast(sample, contribution.source, sample.index);
        });
        self.contributions = contributions;
    }

    /// Casts `count` rays by systematic sampling of rough weights of the lights.
    fn cast_by_importance(&mut self, index: usize, sample: &Sample, count: u32) {
        let (lights, position, normal) = (self.lights, sample.position, sample.normal);
        let mut importance = std::mem::take(&mut self.importance);
        lights.weigh(position, normal, &mut importance);
        let step = importance.iter().sum::<f64>() / f64::from(count);
        let weights = importance.iter().copied();
        systematic(weights, step, offset(sample, 0), |chosen, share| {
            let irradiance = lights.sources()[chosen].irradiance(position, normal);
            if irradiance != Rgb::ZERO {
                self.open_group(index, irradiance * share);
                self.cast(sample, chosen as u32, sample.index);
            }
        });
        self.importance = importance;
    }

    fn open_group(&mut self, index: usize, irradiance: Rgb) {
        self.groups.push(Group {
            sample: index as u32,
            irradiance,
            first_ray: self.rays.len() as u32,
        });
    }

    /// Casts one ray of the last group to a source.
    fn cast(&mut self, sample: &Sample, source: u32, index: u32) {
        let ray = match &self.lights.sources()[source as usize] {
            Source::Polygon {
                shape,
                normal,
                extent,
                ..
            } => {
                let point = shape.sample(
                    sample.position,
                    sample.normal,
                    sample.sequence.dimension_set(source),
                    index,
                    &mut self.scratch,
                );
                // Without solid angle in f64 there is no irradiance beyond rounding either.
                let point = point.unwrap_or(shape.corners()[0]);
                Ray::segment(
                    sample.origin,
                    ray_target(point, *normal, *extent, sample.origin),
                )
            }
            Source::Point { position, .. } => Ray::segment(sample.origin, position.as_vec3()),
            Source::Directional { towards, .. } => Ray::new(sample.origin, towards.as_vec3()),
        };
        self.rays.push(ray);
        self.weights.push(1.0);
    }

    /// Casts the `count` rays of the last group to a polygon.
    fn cast_many(&mut self, sample: &Sample, source: u32, count: u32) {
        let Source::Polygon {
            shape,
            normal,
            extent,
            ..
        } = &self.lights.sources()[source as usize]
        else {
            return self.cast(sample, source, sample.index);
        };
        let sequence = sample.sequence.dimension_set(source);
        let warp = shape.warp(sample.position, sample.normal, &mut self.scratch);
        for ray in 0..count {
            let u = sequence.point2(sample.index * count + ray);
            // As for one ray.
            let (point, weight) = warp.sample(u).unwrap_or((shape.corners()[0], 1.0));
            let target = ray_target(point, *normal, *extent, sample.origin);
            self.rays.push(Ray::segment(sample.origin, target));
            self.weights.push(weight);
        }
    }
}

/// Where systematic sampling begins, as a share of its step.
fn offset(sample: &Sample, set: u32) -> f64 {
    let sequence = sample.sequence.dimension_set(u32::MAX - set);
    let [offset, _] = sequence.point2(sample.index);
    offset
}

/// Visits what lies at every `step` of the sum of weights, with step over weight: what a visit stands for.
pub(crate) fn systematic(
    weights: impl Iterator<Item = f64>,
    step: f64,
    offset: f64,
    mut visit: impl FnMut(usize, f64),
) {
    let mut next = offset * step;
    let mut sum = 0.0;
    for (index, weight) in weights.enumerate() {
        sum += weight;
        while next < sum {
            visit(index, step / weight);
            next += step;
        }
    }
}

#[cfg(test)]
#[path = "sampler_tests.rs"]
mod tests;
