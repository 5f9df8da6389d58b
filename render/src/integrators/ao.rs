//! Ambient occlusion.
//!
//! A(x) = (1/π) ∫ V(x, ω) cos θ dω over the hemisphere of the normal: 1 in the open, 0 where
//! everything is blocked. With ω drawn by the cosine the estimate is the mean of V. Any face
//! blocks, front or back. With a maximum distance d only what is nearer than d blocks: fully
//! ([`Falloff::Sharp`]), or by 1 − (t/d)² at distance t ([`Falloff::Smooth`]), which has no edge
//! at d. Source: S. Zhukov, A. Iones, G. Kronin, "An ambient light illumination model", EGWR 1998.
//! Unbiased. Cost: one ray a sample.

use super::vertex::Vertex;
use super::{Integrator, SampleKey, Seen, cast};
use crate::camera::CameraRay;
use crate::film::Film;
use crate::progress::Progress;
use luxel_scenes::Rgb;
use luxel_solver::bvh::{Hit, Ray};
use luxel_solver::sampling::{Frame, Sequence, Stage, cosine_hemisphere};
use luxel_solver::world::{Receiver, World};

/// How a blocker counts that is nearer than the maximum distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Falloff {
    /// Fully
    Sharp,
    /// By 1 − (t/d)² at distance t of d
    Smooth,
}

/// What counts as occlusion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// Rays for each point (image: for each camera sample), at least one.
    pub rays: u32,
    /// Distance in metres beyond which nothing blocks; `None` for no limit.
    pub max_distance: Option<f64>,
    /// How near blockers count when there is a limit.
    pub falloff: Falloff,
    /// Seed of all randomness.
    pub seed: u64,
}

/// The integrator: ambient occlusion of what the camera sees, 1 where it sees nothing.
pub struct AmbientOcclusion<'w> {
    world: &'w World<'w>,
    config: Config,
}

/// Rays that are cast together: bounds the memory of a batch.
const BATCH: usize = 4096;

impl<'w> AmbientOcclusion<'w> {
    /// Ambient occlusion in `world`.
    pub fn new(world: &'w World<'w>, config: Config) -> Self {
        Self { world, config }
    }

    /// Adds estimates of the ambient occlusion at receivers, the same in all channels, to a film of
    /// one row: `samples` times the configured rays for each replicate of every receiver. Progress
    /// counts samples.
    ///
    /// # Panics
    /// When the film has not one pixel for each receiver, or `samples` not one number.
    pub fn at_receivers(
        &self,
        film: &mut Film,
        receivers: &[Receiver],
        samples: &[u32],
        progress: &dyn Progress,
    ) {
        assert_eq!(film.size(), [receivers.len(), 1], "a pixel a receiver");
        progress.start("ambient occlusion", film.cost(samples));
        film.expose(samples, |due, seen| {
            let keyed = due.iter().map(|due| Some((receivers[due.pixel], due.key)));
            self.see(&keyed.collect::<Vec<_>>(), seen);
            progress.advance(due.len() as u64);
        });
        progress.finish();
    }

    /// The openness of each receiver, in all channels.
    fn see(&self, receivers: &[Option<(Receiver, SampleKey)>], seen: &mut [Seen]) {
        let mut openness = vec![0.0; seen.len()];
        self.openness(receivers, &mut openness);
        for (seen, openness) in seen.iter_mut().zip(openness) {
            *seen = Rgb::splat(openness).into();
        }
    }

    /// The mean of V for each receiver; 1 where there is none.
    fn openness(&self, receivers: &[Option<(Receiver, SampleKey)>], openness: &mut [f64]) {
        let rays_each = self.config.rays as usize;
        let metres = self.world.surfaces().geometry().frame().metres_per_unit;
        let limit = self
            .config
            .max_distance
            .map_or(f32::INFINITY, |d| (d / metres) as f32);
        let mut rays = Vec::with_capacity(BATCH);
        let mut slots = Vec::with_capacity(BATCH);
        let mut blocked = vec![0.0; receivers.len()];
        for (slot, receiver) in receivers.iter().enumerate() {
            let Some((receiver, key)) = receiver else {
                continue;
            };
            let sequence = Sequence::new(self.config.seed, Stage::AO, key.item);
            let frame = Frame::around(receiver.normal.as_vec3());
            for ray in 0..rays_each {
                let u = sequence.point2_f32(key.index * self.config.rays + ray as u32);
                let mut ray = Ray::new(
                    receiver.origin,
                    frame.to_world(cosine_hemisphere::sample(u)).normalize(),
                );
                ray.tmax = limit;
                rays.push(ray);
                slots.push(slot);
                if rays.len() == BATCH {
                    self.block(&mut rays, &mut slots, &mut blocked);
                }
            }
        }
        self.block(&mut rays, &mut slots, &mut blocked);
        for (open, blocked) in openness.iter_mut().zip(&blocked) {
            *open = 1.0 - blocked / rays_each as f64;
        }
    }

    /// Casts rays, adds how far each is blocked to its slot, and empties the lists.
    fn block(&self, rays: &mut Vec<Ray>, slots: &mut Vec<usize>, blocked: &mut [f64]) {
        if self.config.max_distance.is_some() && self.config.falloff == Falloff::Smooth {
            let mut hits = vec![Hit::MISS; rays.len()];
            self.world.bvh().closest_hits(rays, &mut hits);
            for ((ray, hit), &slot) in rays.iter().zip(&hits).zip(slots.iter()) {
                if hit.triangle().is_some() {
                    blocked[slot] += 1.0 - f64::from(hit.t / ray.tmax).powi(2);
                }
            }
        } else {
            let mut answers = vec![false; rays.len()];
            self.world.bvh().occluded(rays, &mut answers);
            for (&answer, &slot) in answers.iter().zip(slots.iter()) {
                blocked[slot] += f64::from(answer);
            }
        }
        rays.clear();
        slots.clear();
    }
}

impl Integrator for AmbientOcclusion<'_> {
    fn estimate(&self, rays: &[CameraRay], keys: &[SampleKey], seen: &mut [Seen]) {
        let (rays, hits) = cast(self.world, rays);
        let receivers: Vec<_> = rays
            .iter()
            .zip(&hits)
            .zip(keys)
            .map(|((ray, hit), key)| Some((Vertex::new(self.world, ray, hit)?.receiver(), *key)))
            .collect();
        self.see(&receivers, seen);
    }
}
