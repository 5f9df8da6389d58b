//! Direct light at many points at once, with shadow rays in batches.
//!
//! E = Σ_lights E_i V_i, where E_i is the exact unoccluded irradiance and V_i the mean visibility
//! of points of light i that are distributed as its kernel ([`super::kernel`]). Rays are shared out
//! by contribution: a light that is due half a ray or more gets whole rays. The many small
//! contributions that are due less share a few rays by systematic sampling: each ray stands for
//! Σ E / n of the light that it is cast to. Bounded by the unoccluded irradiance; exact where a light
//! is wholly visible or wholly hidden; unbiased but for lights of [`MANY_RAYS`] rays and more, whose
//! bias is far below their noise.

use super::lights::{Lights, Source};
use crate::bvh::{Bvh, Ray};
use crate::geometry::ray_target;
use crate::sampling::Sequence;
use glam::{DVec3, Vec3};
use luxel_scenes::{Irradiance, Rgb};

/// Rays to one light from which their mean is a ratio of stratified points and not a mean of
/// rejected ones: the bias is then below a thousandth, and the noise a fifth lower.
const MANY_RAYS: u32 = 8;

/// How many shadow rays a point may cast.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShadowRays {
    /// One ray, to a light chosen by its contribution.
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
    groups: Vec<Group>,
    rays: Vec<Ray>,
    weights: Vec<f64>,
    blocked: Vec<bool>,
    clipped: Vec<DVec3>,
}

impl<'a> DirectSampler<'a> {
    /// A sampler of the given lights.
    pub fn new(lights: &'a Lights, bvh: &'a Bvh) -> Self {
        Self {
            lights,
            bvh,
            contributions: Vec::new(),
            groups: Vec::new(),
            rays: Vec::new(),
            weights: Vec::new(),
            blocked: Vec::new(),
            clipped: Vec::new(),
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
        self.groups.clear();
        self.rays.clear();
        self.weights.clear();
        for (index, sample) in samples.iter().enumerate() {
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
        for (index, group) in self.groups.iter().enumerate() {
            let first = group.first_ray as usize;
            let end = self
                .groups
                .get(index + 1)
                .map_or(self.rays.len(), |g| g.first_ray as usize);
            let mut total = 0.0;
            let mut visible = 0.0;
            for ray in first..end {
                total += self.weights[ray];
                visible += if self.blocked[ray] {
                    0.0
                } else {
                    self.weights[ray]
                };
            }
            if visible > 0.0 {
                irradiance[group.sample as usize].0 += group.irradiance * (visible / total);
            }
        }
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
                for ray in 0..rays {
                    self.cast(sample, contribution.source, sample.index * rays + ray, rays);
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
        let step = total / f64::from(count);
        let [offset, _] = sample
            .sequence
            .dimension_set(u32::MAX - set)
            .point2(sample.index);
        let mut next = offset * step;
        let mut sum = 0.0;
        for contribution in &contributions {
            sum += contribution.weight;
            while next < sum {
                let share = step / contribution.weight;
                self.open_group(index, contribution.irradiance * share);
                self.cast(sample, contribution.source, sample.index, 1);
                next += step;
            }
        }
        self.contributions = contributions;
    }

    fn open_group(&mut self, index: usize, irradiance: Rgb) {
        self.groups.push(Group {
            sample: index as u32,
            irradiance,
            first_ray: self.rays.len() as u32,
        });
    }

    /// Casts one ray of the last group, which has `count` of them, to a source.
    fn cast(&mut self, sample: &Sample, source: u32, index: u32, count: u32) {
        let mut weight = 1.0;
        let target = match &self.lights.sources()[source as usize] {
            Source::Polygon {
                shape,
                normal,
                extent,
                ..
            } => {
                let sequence = sample.sequence.dimension_set(source);
                let point = if count < MANY_RAYS {
                    shape.sample(
                        sample.position,
                        sample.normal,
                        sequence,
                        index,
                        &mut self.clipped,
                    )
                } else {
                    let u = sequence.point2(index);
                    let (position, normal) = (sample.position, sample.normal);
                    shape
                        .warped(position, normal, u, &mut self.clipped)
                        .map(|(point, kernel)| {
                            weight = kernel;
                            point
                        })
                };
                // Without solid angle in f64 there is no irradiance beyond rounding either.
                let point = point.unwrap_or(shape.corners()[0]);
                ray_target(point, *normal, *extent, sample.origin)
            }
            Source::Point { position, .. } => position.as_vec3(),
            Source::Directional { towards, .. } => {
                self.rays.push(Ray::new(sample.origin, towards.as_vec3()));
                self.weights.push(weight);
                return;
            }
        };
        self.rays.push(Ray::segment(sample.origin, target));
        self.weights.push(weight);
    }
}
