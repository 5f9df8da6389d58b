//! Integrators: from camera rays to pixel values.
//!
//! An [`Integrator`] answers batches of rays, never one, because the ray kernel hides latency
//! across rays. [`expose`] drives it over a film. Which integrator is biased, and how, stands at
//! the head of its file.

pub mod ao;
pub mod gather;
mod next_event;
pub mod path;
pub mod radiosity;
mod smooth;
mod specular;
mod vertex;
pub mod whitted;

use crate::camera::{CameraFrame, CameraRay};
use crate::film::Film;
use crate::progress::Progress;
use glam::DVec2;
use luxel_scenes::Rgb;
use luxel_solver::bvh::{Hit, Ray};
use luxel_solver::sampling::{Sequence, Stage};
use luxel_solver::world::World;

/// A camera ray in the unit frame. An eye far outside the scene is moved along its ray to where the
/// scene's surroundings begin, so that f32 holds its position.
pub(crate) fn unit_ray(world: &World<'_>, ray: &CameraRay) -> Ray {
    /// Radius of a ball about the frame's origin that holds the scene: √3/2, rounded up.
    const RADIUS: f64 = 0.9;
    let origin = world.surfaces().geometry().frame().to_unit(ray.origin);
    let start = (-origin.dot(ray.direction) - RADIUS).max(0.0);
    Ray::new(
        (origin + ray.direction * start).as_vec3(),
        ray.direction.as_vec3(),
    )
}

/// The first hit of each camera ray, with the rays in the unit frame.
fn cast(world: &World<'_>, rays: &[CameraRay]) -> (Vec<Ray>, Vec<Hit>) {
    let rays: Vec<Ray> = rays.iter().map(|ray| unit_ray(world, ray)).collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    world.bvh().closest_hits(&rays, &mut hits);
    (rays, hits)
}

/// Radiance from beyond the scene along a ray that met nothing.
fn background(world: &World<'_>, ray: &Ray) -> Rgb {
    let direction = ray.direction.as_dvec3();
    world.lights().sky(world.surfaces(), direction).0
}

/// Where the random numbers of a camera sample come from: point `index` of sequence `item`. Items
/// are independent of each other; the points of one item fill their cube evenly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleKey {
    /// Pixel and replicate.
    pub item: u64,
    /// The replicate alone.
    pub replicate: u32,
    /// Number of the sample in its replicate.
    pub index: u32,
}

/// Computes what is seen along rays.
pub trait Integrator: Sync {
    /// Writes the value of each ray, in the integrator's unit, to `values`. The value of a ray
    /// depends on the ray and its key alone, not on its batch.
    ///
    /// # Panics
    /// When the slices differ in length.
    fn estimate(&self, rays: &[CameraRay], keys: &[SampleKey], values: &mut [Rgb]);
}

/// How many camera samples a pixel gets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Samples {
    /// Independent replicates, at least one; from two on the film knows its standard error.
    pub replicates: u32,
    /// Samples of each replicate, at least one; powers of two fill the pixel best.
    pub per_replicate: u32,
    /// Seed of all randomness.
    pub seed: u64,
}

impl Samples {
    /// `total` samples a pixel, in as many equal replicates as possible, up to four: more would
    /// lose what the even filling gains, fewer make the standard error itself uncertain (one part
    /// in √(2(n − 1))).
    pub fn new(total: u32, seed: u64) -> Self {
        let replicates = (1..=4)
            .rev()
            .find(|n| total.is_multiple_of(*n))
            .unwrap_or(1);
        Self {
            replicates,
            per_replicate: (total / replicates).max(1),
            seed,
        }
    }
}

/// Exposes a film of the camera's size: box filter, one value per pixel and replicate. The same
/// bytes at any number of threads. Progress counts pixels.
pub fn expose(
    integrator: &dyn Integrator,
    camera: &CameraFrame,
    samples: Samples,
    progress: &dyn Progress,
) -> Film {
    let [width, height] = camera.size();
    let mut film = Film::new([width, height]);
    progress.start("rendering", (width * height) as u64);
    film.expose(|first, pixels| {
        let count = pixels.len();
        let mut values = vec![Rgb::ZERO; count];
        let mut rays = Vec::with_capacity(count);
        let mut keys = Vec::with_capacity(count);
        for replicate in 0..samples.replicates {
            let mut sums = vec![Rgb::ZERO; count];
            for index in 0..samples.per_replicate {
                rays.clear();
                keys.clear();
                for pixel in first..first + count {
                    let item = pixel as u64 * u64::from(samples.replicates) + u64::from(replicate);
                    let sequence = Sequence::new(samples.seed, Stage::CAMERA, item);
                    let corner = DVec2::new((pixel % width) as f64, (pixel / width) as f64);
                    let jitter = DVec2::from_array(sequence.point2(index));
                    rays.push(camera.ray(corner + jitter));
                    keys.push(SampleKey {
                        item,
                        replicate,
                        index,
                    });
                }
                integrator.estimate(&rays, &keys, &mut values);
                for (sum, value) in sums.iter_mut().zip(&values) {
                    *sum += *value;
                }
            }
            for (pixel, sum) in pixels.iter_mut().zip(&sums) {
                pixel.add(*sum / f64::from(samples.per_replicate));
            }
        }
        progress.advance(count as u64);
    });
    progress.finish();
    film
}

#[cfg(test)]
mod tests;
