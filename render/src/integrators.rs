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
mod specular;
mod vertex;
pub mod whitted;

use crate::camera::{CameraFrame, CameraRay};
use crate::film::Film;
use crate::progress::Progress;
use glam::DVec2;
use luxel_scenes::Rgb;
use luxel_solver::bvh::{Hit, Ray};
use luxel_solver::gather::MAX_REPLICATES;
use luxel_solver::sampling::{Sequence, Stage};
use luxel_solver::world::World;
use std::ops::{AddAssign, Mul};

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

/// What a camera sample sees, in the integrator's unit.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Seen {
    /// The value.
    pub value: Rgb,
    /// How it differs from what a coarser mesh would show; zero where nothing is looked up in a mesh.
    pub mesh_difference: Rgb,
}

impl From<Rgb> for Seen {
    /// A value that owes nothing to a mesh.
    fn from(value: Rgb) -> Self {
        Self {
            value,
            mesh_difference: Rgb::ZERO,
        }
    }
}

impl AddAssign for Seen {
    fn add_assign(&mut self, other: Self) {
        self.value += other.value;
        self.mesh_difference += other.mesh_difference;
    }
}

impl Mul<Seen> for Rgb {
    type Output = Seen;

    fn mul(self, seen: Seen) -> Seen {
        Seen {
            value: self * seen.value,
            mesh_difference: self * seen.mesh_difference,
        }
    }
}

/// Computes what is seen along rays.
pub trait Integrator: Sync {
    /// Writes what each ray sees to `seen`. It depends on the ray and its key alone, not on the
    /// batch.
    ///
    /// # Panics
    /// When the slices differ in length.
    fn estimate(&self, rays: &[CameraRay], keys: &[SampleKey], seen: &mut [Seen]);
}

/// Which camera samples of every pixel to take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Samples {
    /// Independent replicates, from one to [`MAX_REPLICATES`]; from two on the film knows its
    /// standard error.
    pub replicates: u32,
    /// Samples of each replicate that the film holds already.
    pub before: u32,
    /// Samples of each replicate to add, at least one; powers of two fill the pixel best.
    pub per_replicate: u32,
    /// Seed of all randomness.
    pub seed: u64,
}

impl Samples {
    /// `total` samples a pixel, in as many equal replicates as possible, up to four: more would
    /// lose what the even filling gains, fewer make the standard error itself uncertain (one part
    /// in √(2(n − 1))).
    pub fn new(total: u32, seed: u64) -> Self {
        let replicates = (1..=MAX_REPLICATES as u32)
            .rev()
            .find(|n| total.is_multiple_of(*n))
            .unwrap_or(1);
        Self {
            replicates,
            before: 0,
            per_replicate: (total / replicates).max(1),
            seed,
        }
    }

    /// Samples of a pixel after these.
    pub fn total(&self) -> u32 {
        self.replicates * (self.before + self.per_replicate)
    }
}

/// Exposes a film of the camera's size: box filter. The same bytes at any number of threads.
/// Progress counts pixels.
pub fn expose(
    integrator: &dyn Integrator,
    camera: &CameraFrame,
    samples: Samples,
    progress: &dyn Progress,
) -> Film {
    let mut film = Film::new(camera.size(), samples.replicates);
    expose_further(&mut film, integrator, camera, samples, progress);
    film
}

/// Adds samples to a film. What `samples.before` says must be what the film holds: the sequences go
/// on from there.
///
/// # Panics
/// When the film's size or replicates differ.
pub fn expose_further(
    film: &mut Film,
    integrator: &dyn Integrator,
    camera: &CameraFrame,
    samples: Samples,
    progress: &dyn Progress,
) {
    let [width, height] = camera.size();
    assert_eq!(film.size(), [width, height], "the film fits the camera");
    assert_eq!(film.replicates(), samples.replicates, "as many replicates");
    progress.start("rendering", (width * height) as u64);
    film.expose(samples.per_replicate, |first, pixels| {
        let count = pixels.len();
        let mut seen = vec![Seen::default(); count];
        let mut rays = Vec::with_capacity(count);
        let mut keys = Vec::with_capacity(count);
        for replicate in 0..samples.replicates {
            for index in samples.before..samples.before + samples.per_replicate {
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
                integrator.estimate(&rays, &keys, &mut seen);
                for (pixel, seen) in pixels.iter_mut().zip(&seen) {
                    pixel.add(replicate, *seen);
                }
            }
        }
        progress.advance(count as u64);
    });
    progress.finish();
}

#[cfg(test)]
mod tests;
