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
use crate::film::{Due, Film};
use crate::progress::Progress;
use glam::DVec2;
use luxel_scenes::Rgb;
use luxel_solver::bvh::{Hit, Ray};
use luxel_solver::gather::MAX_REPLICATES;
use luxel_solver::sampling::{Sequence, Stage};
use luxel_solver::world::World;
use std::ops::{AddAssign, Mul};
pub(crate) use vertex::Vertex;

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
pub(crate) fn cast(world: &World<'_>, rays: &[CameraRay]) -> (Vec<Ray>, Vec<Hit>) {
    let rays: Vec<Ray> = rays.iter().map(|ray| unit_ray(world, ray)).collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    world.bvh().closest_hits(&rays, &mut hits);
    (rays, hits)
}

/// Radiance from beyond the scene along a ray that met nothing.
pub(crate) fn background(world: &World<'_>, ray: &Ray) -> Rgb {
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

/// Which camera samples to take of every pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Samples {
    /// Independent replicates, from one to [`MAX_REPLICATES`]; from two on the film knows its
    /// standard error.
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
        let replicates = (1..=MAX_REPLICATES as u32)
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

/// Exposes a film of the camera's size: box filter. The same bytes at any number of threads.
/// Progress counts samples.
pub fn expose(
    integrator: &dyn Integrator,
    camera: &CameraFrame,
    samples: Samples,
    progress: &dyn Progress,
) -> Film {
    let mut film = Film::new(camera.size(), samples.replicates);
    let further = film.evenly(samples.per_replicate);
    expose_further(
        &mut film,
        integrator,
        camera,
        samples.seed,
        &further,
        progress,
    );
    film
}

/// Adds `further` samples to each replicate of every pixel of a film, with the random numbers of
/// `seed`: the sequences go on from where each pixel's stand. Progress counts samples.
///
/// # Panics
/// When the film's size differs from the camera's, or `further` has not one number for each pixel.
pub fn expose_further(
    film: &mut Film,
    integrator: &dyn Integrator,
    camera: &CameraFrame,
    seed: u64,
    further: &[u32],
    progress: &dyn Progress,
) {
    let [width, height] = camera.size();
    assert_eq!(film.size(), [width, height], "the film fits the camera");
    progress.start("rendering", film.cost(further));
    film.expose(further, |due, seen| {
        let ray = |due: &Due| {
            let sequence = Sequence::new(seed, Stage::CAMERA, due.key.item);
            let corner = DVec2::new((due.pixel % width) as f64, (due.pixel / width) as f64);
            let jitter = DVec2::from_array(sequence.point2(due.key.index));
            camera.ray(corner + jitter)
        };
        let rays: Vec<CameraRay> = due.iter().map(ray).collect();
        let keys: Vec<SampleKey> = due.iter().map(|due| due.key).collect();
        integrator.estimate(&rays, &keys, seen);
        progress.advance(due.len() as u64);
    });
    progress.finish();
}

#[cfg(test)]
mod tests;
