//! The sampling part of stated errors against the scatter over many seeds of a small scene.
//!
//! With x_k the value of seed k of n, s_k its stated noise and x̄ the mean over seeds,
//! z² = (x_k − x̄)²/s_k² · n/(n − 1): the factor makes up for the mean's own noise. Its mean over seeds
//! and values is one when s² is right on average where it matters. The mesh is the same for all seeds,
//! so that its error, which stays, plays no part. Values share the noise of their solutions, so that
//! their z² go together within a seed; the seeds are independent.

use crate::builder::{Part, parallelogram, room, scene, solid_box};
use glam::DVec3;
use luxel::camera::CameraFrame;
use luxel::film::{Alike, Film};
use luxel::integrators::gather::{Config as FilmConfig, Gatherer};
use luxel::integrators::{Samples, expose, expose_further};
use luxel::progress::Silent;
use luxel_scenes::{Camera, FieldOfView, Projection, Reflectance, Rgb, Scene};
use luxel_solver::adaptive::ROW_RAYS;
use luxel_solver::gather::{
    Components, GatherConfig, Key, Lookup, MAX_REPLICATES, SkyRays, Solutions, finish, gather,
};
use luxel_solver::patches::PatchSize;
use luxel_solver::radiosity::{RadiosityConfig, solve};
use luxel_solver::solvers::{Config, Tolerance};
use luxel_solver::world::{Receiver, World};

/// Patches of the mesh, and of the coarser one beside it.
const PATCHES: usize = 200;

/// Gather and shadow rays of a receiver, and of a camera sample.
const RAYS: usize = 128;
const SHADOW_RAYS: usize = 64;
const RAYS_OF_SAMPLE: usize = 16;

/// Side of the film in pixels.
const PIXELS: usize = 20;

/// Receivers along each side of a wall.
const ACROSS: u32 = 5;

/// Values of one seed, each with its stated noise.
type Values = Vec<(f64, f64)>;

/// A room of 2 m with a red wall, a lamp below its ceiling, and a block that hangs in its light.
fn small_room() -> Scene {
    let mut walls = room(DVec3::ZERO, DVec3::splat(2.0));
    let red = walls.remove(0);
    let lamp = parallelogram(DVec3::new(0.7, 0.8, 1.95), DVec3::Y * 0.5, DVec3::X * 0.6);
    let block = solid_box(DVec3::new(0.6, 0.5, 0.6), DVec3::new(1.3, 1.1, 0.9));
    let mut red = Part::grey("red", 0.5, vec![red]);
    red.reflectance = Reflectance::new(0.7, 0.2, 0.1);
    scene(
        "small",
        [
            Part::grey("walls", 0.6, walls),
            red,
            Part::grey("block", 0.4, block),
            Part::lamp("lamp", 10.0, vec![lamp]),
        ],
    )
}

/// 25 points on the floor and on each of three walls: in the light, in half shadow, in the shadow.
fn receivers(world: &World) -> Vec<Receiver> {
    let sides = [
        (DVec3::ZERO, DVec3::X, DVec3::Y),
        (DVec3::ZERO, DVec3::Y, DVec3::Z),
        (DVec3::ZERO, DVec3::Z, DVec3::X),
        (DVec3::X * 2.0, DVec3::Z, DVec3::Y),
    ];
    let place = |k: u32| (2.0 * f64::from(k) + 1.0) / f64::from(ACROSS);
    let places = sides.into_iter().flat_map(|(corner, u, v)| {
        let cells = (0..ACROSS * ACROSS).map(|cell| (cell / ACROSS, cell % ACROSS));
        cells.map(move |(i, j)| (corner + u * place(i) + v * place(j), u.cross(v)))
    });
    let (positions, normals): (Vec<_>, Vec<_>) = places.unzip();
    world.receivers(&positions, &normals)
}

/// Four solutions on the mesh and on the coarser one.
fn lookup(world: &World, seed: u64) -> Lookup {
    let mesh = |count| world.mesh(PatchSize::Count(count)).expect("few patches");
    let (fine, coarse) = (mesh(PATCHES), mesh(PATCHES / 4));
    let solutions = |patches| -> Vec<_> {
        let config = |replicate| RadiosityConfig {
            rays: ROW_RAYS,
            shadow_rays: 1,
            solver: Config {
                tolerance: Tolerance::Error(1e-7),
                max_iterations: 1000,
            },
            seed,
            replicate,
        };
        (0..MAX_REPLICATES as u64)
            .map(|replicate| solve(world, patches, &config(replicate)).expect("dark walls"))
            .collect()
    };
    let (on_fine, on_coarse) = (solutions(&fine), solutions(&coarse));
    Lookup::new(fine, &on_fine).with_coarse(coarse, &on_coarse)
}

/// Mean z² of the irradiance at 100 points over `seeds` seeds, the rays shared out over `gathers`
/// independent gathers.
///
/// # Panics
/// With fewer than two seeds or gathers, or a value that is stated to be exact and is not.
pub fn points(seeds: u64, gathers: usize) -> f64 {
    let scene = small_room();
    let world = World::new(&scene);
    let receivers = receivers(&world);
    let keys: Vec<Key> = (0..receivers.len() as u64).map(Key::of).collect();
    let of_seed = |seed| -> Values {
        let config = GatherConfig {
            rays: RAYS,
            rays_before: 0,
            shadow_rays: SHADOW_RAYS,
            sky: SkyRays::Apart,
            gathers,
            solutions: Solutions::All,
            components: Components::All,
            seed,
        };
        let lookup = lookup(&world, seed);
        let gathered = finish(&gather(&world, Some(&lookup), &receivers, &keys, &config));
        let pairs = gathered
            .iter()
            .flat_map(|g| channels(g.irradiance().0, g.sampling().0));
        pairs.collect()
    };
    mean_z_squared(&(0..seeds).map(of_seed).collect::<Vec<_>>())
}

/// How the samples of a film are spread over its pixels.
#[derive(Clone, Copy, Debug)]
pub enum Spread {
    /// So many in every pixel.
    Even(u32),
    /// Eight in every pixel, then rounds that quarter the variance of the film where it is largest.
    WhereNoisy {
        /// How many rounds.
        rounds: u32,
    },
}

/// The pixels of a small film, an edge of the lamp in view.
#[derive(Clone, Copy, Debug)]
pub struct Pixels {
    /// Mean z² of all values of all seeds.
    pub z_squared: f64,
    /// Mean square of the films' errors over the mean of the squares that they state.
    pub variance_ratio: f64,
    /// Mean samples of a pixel.
    pub samples: f64,
    /// Mean of all values.
    pub mean: f64,
    /// Its standard error over the seeds.
    pub standard_error: f64,
}

/// The pixels of a small film over `seeds` seeds.
///
/// # Panics
/// With fewer than two seeds, or a value that is stated to be exact and is not.
pub fn pixels(seeds: u64, spread: Spread) -> Pixels {
    let scene = small_room();
    let world = World::new(&scene);
    let camera = Camera {
        name: "main".to_owned(),
        position: DVec3::new(1.8, 1.9, 1.0),
        look_at: DVec3::new(0.7, 0.6, 0.8),
        up: DVec3::Z,
        projection: Projection::Perspective {
            fov: FieldOfView::Horizontal(1.4),
        },
        size: [PIXELS; 2],
    };
    let frame = CameraFrame::new(&camera, camera.size).expect("a camera in the room");
    let mut films = Vec::new();
    let mut of_seed = |seed| -> Values {
        let config = FilmConfig {
            rays: RAYS_OF_SAMPLE,
            shadow_rays: RAYS_OF_SAMPLE,
            seed,
        };
        let lookup = lookup(&world, seed);
        let gatherer = Gatherer::new(&world, &lookup, config);
        let film = film(&gatherer, &frame, spread, seed);
        let pixels = film.values().map(Rgb::element_sum).sum::<f64>();
        let sampling = film.relative_error(Alike::Neighbours).sampling;
        let mean = pixels / (3 * PIXELS * PIXELS) as f64;
        films.push((mean, (sampling * mean).powi(2), film.sample_counts().mean));
        let errors = film.errors(Alike::Neighbours).expect("replicates");
        let pairs = film.values().zip(errors);
        pairs
            .flat_map(|(value, error)| channels(value, error.sampling))
            .collect()
    };
    let values: Vec<Values> = (0..seeds).map(&mut of_seed).collect();
    let n = seeds as f64;
    let mean_of = |of: &dyn Fn(&(f64, f64, f64)) -> f64| films.iter().map(of).sum::<f64>() / n;
    let mean = mean_of(&|film| film.0);
    let scatter = mean_of(&|film| (film.0 - mean).powi(2));
    Pixels {
        z_squared: mean_z_squared(&values),
        variance_ratio: mean_square(&values) / mean_of(&|film| film.1),
        samples: mean_of(&|film| film.2),
        mean,
        standard_error: (scatter / (n - 1.0)).sqrt(),
    }
}

/// A film whose samples are spread as asked for.
fn film(gatherer: &Gatherer<'_>, frame: &CameraFrame, spread: Spread, seed: u64) -> Film {
    match spread {
        Spread::Even(samples) => expose(gatherer, frame, Samples::new(samples, seed), &Silent),
        Spread::WhereNoisy { rounds } => {
            let mut film = expose(gatherer, frame, Samples::new(8, seed), &Silent);
            for _ in 0..rounds {
                let further = film.where_noisy(4.0);
                expose_further(&mut film, gatherer, frame, seed, &further, &Silent);
            }
            film
        }
    }
}

fn channels(value: Rgb, noise: Rgb) -> impl Iterator<Item = (f64, f64)> {
    value.to_array().into_iter().zip(noise.to_array())
}

/// Mean squared error of the values of all seeds, as they scatter about their means.
fn mean_square(seeds: &[Values]) -> f64 {
    let n = seeds.len() as f64;
    let variance = |index: usize| {
        let own = || seeds.iter().map(|values| values[index].0);
        let mean = own().sum::<f64>() / n;
        own().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0)
    };
    let count = seeds[0].len();
    (0..count).map(variance).sum::<f64>() / count as f64
}

/// Mean of z² over the values of all seeds.
fn mean_z_squared(seeds: &[Values]) -> f64 {
    let n = seeds.len() as f64;
    assert!(n > 1.0, "one seed has no scatter");
    let (mut sum, mut count) = (0.0, 0.0);
    for index in 0..seeds[0].len() {
        let own = || seeds.iter().map(|values| values[index]);
        let mean = own().map(|(x, _)| x).sum::<f64>() / n;
        for (x, noise) in own() {
            let off = (x - mean).abs();
            if noise > 0.0 {
                sum += (off / noise).powi(2) * n / (n - 1.0);
                count += 1.0;
            } else {
                let rounding = super::ROUNDING * mean.abs();
                assert!(off <= rounding, "value {index} is off by {off} of {mean}");
            }
        }
    }
    sum / count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_seeds_by_hand() {
        // The mean is 2; z² is 2 and 1/2, each times n/(n − 1) = 2.
        let z = mean_z_squared(&[vec![(1.0, 1.0), (5.0, 0.0)], vec![(3.0, 2.0), (5.0, 0.0)]]);
        assert!((z - 1.25).abs() < 1e-15, "{z}");
    }
}
