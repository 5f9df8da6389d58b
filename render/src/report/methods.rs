//! luxel's own methods at the receivers of a comparison: coarse solution, final gather, path tracer.
//!
//! The one place that calls them, so that what they state of their errors is read here alone.

use super::checks::{Check, Energy};
use super::target::{Kind, Target};
use crate::film::{Alike, Film, Moments};
use crate::integrators::gather::{Config as PixelGather, Gatherer};
use crate::integrators::path::PathTracer;
use crate::integrators::{Integrator, Samples, expose};
use crate::points::Estimate;
use crate::progress::Silent;
use luxel_scenes::{Irradiance, Rgb};
use luxel_solver::gather::{
    Components, GatherConfig, Key, Lookup, SkyRays, Solutions, finish, gather,
};
use luxel_solver::patches::{MeshError, PatchSize, Patches};
use luxel_solver::radiosity::{RadiosityConfig, RadiositySolution, solve};
use luxel_solver::solvers::{Config, SystemError, Tolerance};
use luxel_solver::world::World;

/// Independent randomisations, from which standard errors come; as in the commands.
pub(super) const REPLICATES: usize = 4;

/// Rays of a patch's row in each solution that a gather looks up, as in the commands.
const GATHER_ROW_RAYS: usize = 32;

/// The same where the solution itself is looked up.
const VIEW_ROW_RAYS: usize = 64;

/// Shadow rays of each sample point of a patch, as in the commands.
const SHADOW_RAYS: usize = 1;

/// Most shadow rays of a point, as in the commands.
const MAX_SHADOW_RAYS: usize = 1024;

/// Most gather rays of a camera sample, as in the commands; with fewer for a pixel, a sample gets its share. A
/// quarter as many shadow rays go with them.
const PIXEL_RAYS: usize = 16;

/// Bound on the error that the iteration may leave, relative to the brightest patch, as in the commands.
const TOLERANCE: f64 = 1e-7;

/// Sweeps after which the iteration gives up.
const MAX_ITERATIONS: usize = 20_000;

/// Why a method could not be run.
#[derive(Debug, thiserror::Error)]
pub(super) enum MethodError {
    #[error(transparent)]
    Mesh(#[from] MeshError),
    #[error(transparent)]
    System(#[from] SystemError),
}

/// What a method made of a size.
pub(super) struct Outcome {
    pub(super) estimates: Vec<Estimate>,
    pub(super) patches: Option<usize>,
    /// Rays that leave patches and receivers, with those to lights; paths for the path tracer.
    pub(super) rays: u64,
    /// Bound on the error of an irradiance that the iteration leaves, W/m².
    pub(super) error_bound: f64,
    /// Discretisation error that the method states at each receiver, where it does.
    pub(super) discretisation: Option<Vec<Rgb>>,
    pub(super) iterations: Option<usize>,
    pub(super) check: Option<Check>,
    /// The mesh with its irradiance, to be looked up elsewhere.
    pub(super) field: Option<(Patches, Vec<Irradiance>)>,
}

/// Coarse solutions over one mesh.
struct Solved {
    patches: Patches,
    solutions: Vec<RadiositySolution>,
    rays: u64,
    error_bound: f64,
}

fn solve_all(
    world: &World<'_>,
    count: usize,
    rays: usize,
    seed: u64,
) -> Result<Solved, MethodError> {
    let patches = world.mesh(PatchSize::Count(count))?;
    let solutions = (0..REPLICATES as u64)
        .map(|replicate| {
            let config = RadiosityConfig {
                rays,
                shadow_rays: SHADOW_RAYS,
                solver: Config {
                    tolerance: Tolerance::Error(TOLERANCE),
                    max_iterations: MAX_ITERATIONS,
                },
                seed,
                replicate,
            };
            solve(world, &patches, &config)
        })
        .collect::<Result<Vec<_>, _>>()?;
    let cast: usize = solutions.iter().map(|solution| solution.row_rays).sum();
    let shadow = cast / 2 * SHADOW_RAYS;
    let bounds = solutions.iter().map(|s| s.error_bound.max_element());
    Ok(Solved {
        error_bound: bounds.fold(0.0, f64::max),
        rays: (cast + shadow) as u64,
        patches,
        solutions,
    })
}

impl Solved {
    fn check(&self) -> Check {
        let ledgers: Vec<_> = self.solutions.iter().map(|s| s.ledger).collect();
        Check {
            patches: self.patches.len(),
            factors: None,
            energy: Energy::of(&ledgers),
        }
    }

    fn iterations(&self) -> Option<usize> {
        self.solutions.iter().map(|s| s.iterations).max()
    }
}

/// The coarse solution, looked up.
pub(super) fn radiosity(
    world: &World<'_>,
    target: &Target,
    count: usize,
    seed: u64,
) -> Result<Outcome, MethodError> {
    let solved = solve_all(world, count, VIEW_ROW_RAYS, seed)?;
    let mut moments = vec![Moments::default(); target.len()];
    let mut mean = vec![Irradiance::ZERO; solved.patches.len()];
    for solution in &solved.solutions {
        let ids = solved.patches.ids();
        let irradiance: Vec<Irradiance> = ids.map(|id| solution.mean_irradiance(id)).collect();
        let values = target.values(world, &solved.patches, &irradiance);
        for (moments, value) in moments.iter_mut().zip(values) {
            moments.add(value);
        }
        for (mean, &e) in mean.iter_mut().zip(&irradiance) {
            *mean += e * (1.0 / REPLICATES as f64);
        }
    }
    Ok(Outcome {
        estimates: estimates(&moments),
        patches: Some(solved.patches.len()),
        rays: solved.rays,
        error_bound: solved.error_bound,
        discretisation: None,
        iterations: solved.iterations(),
        check: Some(solved.check()),
        field: Some((solved.patches, mean)),
    })
}

/// The final gather with `rays` rays a receiver, into a solution of about `count` patches.
pub(super) fn final_gather(
    world: &World<'_>,
    target: &Target,
    count: usize,
    rays: usize,
    seed: u64,
) -> Result<Outcome, MethodError> {
    let solved = solve_all(world, count, GATHER_ROW_RAYS, seed)?;
    let coarse = solve_all(world, (count / 4).max(1), GATHER_ROW_RAYS, seed)?;
    let (check, iterations) = (solved.check(), solved.iterations());
    let solving = solved.rays + coarse.rays;
    let lookup = Lookup::new(solved.patches, &solved.solutions)
        .with_coarse(coarse.patches, &coarse.solutions);
    let (found, spent) = match target.kind() {
        Kind::Points(receivers) => {
            let config = GatherConfig {
                rays,
                rays_before: 0,
                shadow_rays: (rays * 3 / 4).clamp(1, MAX_SHADOW_RAYS),
                sky: SkyRays::Apart,
                gathers: REPLICATES,
                solutions: Solutions::All,
                components: Components::All,
                seed,
            };
            let keys: Vec<Key> = (0..receivers.len() as u64).map(Key::of).collect();
            let tallies = gather(world, Some(&lookup), receivers, &keys, &config);
            let found = finish(&tallies)
                .into_iter()
                .map(|gathered| {
                    let estimate = Estimate {
                        value: gathered.irradiance().0,
                        standard_error: gathered.sampling().0,
                    };
                    (estimate, gathered.discretisation.0)
                })
                .collect();
            let each = config.rays + config.shadow_rays;
            (found, receivers.len() * each)
        }
        Kind::Pixels(_) => {
            let samples = (rays / PIXEL_RAYS).max(REPLICATES);
            let rays = (rays / samples).max(1);
            let config = PixelGather {
                rays,
                shadow_rays: (rays / 4).max(1),
                seed,
            };
            let gatherer = Gatherer::new(world, &lookup, config);
            let found = pixels(&gatherer, target, samples, seed);
            let each = samples * (config.rays + config.shadow_rays);
            (found, target.len() * each)
        }
    };
    let (estimates, discretisation): (Vec<Estimate>, Vec<Rgb>) = found.into_iter().unzip();
    Ok(Outcome {
        estimates,
        patches: Some(lookup.patches().len()),
        rays: solving + spent as u64,
        error_bound: lookup.solver_bound(),
        discretisation: Some(discretisation),
        iterations,
        check: Some(check),
        field: None,
    })
}

/// The path tracer with `paths` paths a receiver (a multiple of [`REPLICATES`]).
pub(super) fn path(world: &World<'_>, target: &Target, paths: usize, seed: u64) -> Outcome {
    let tracer = PathTracer::new(world, seed);
    let each = (paths / REPLICATES).max(1);
    let found = match target.kind() {
        Kind::Points(receivers) => {
            let mut film = Film::new([receivers.len(), 1], REPLICATES as u32);
            let paths = film.evenly(each as u32);
            tracer.irradiance(&mut film, receivers, Components::All, &paths, &Silent);
            estimates_of(&film, Alike::Values)
        }
        Kind::Pixels(_) => pixels(&tracer, target, paths, seed),
    };
    let estimates = found.into_iter().map(|(estimate, _)| estimate).collect();
    Outcome {
        estimates,
        patches: None,
        rays: (target.len() * paths) as u64,
        error_bound: 0.0,
        discretisation: None,
        iterations: None,
        check: None,
        field: None,
    }
}

/// A picture of `samples` samples a pixel, in as many replicates as everywhere; also the
/// discretisation error of each pixel.
fn pixels(
    integrator: &dyn Integrator,
    target: &Target,
    samples: usize,
    seed: u64,
) -> Vec<(Estimate, Rgb)> {
    let Kind::Pixels(frame) = target.kind() else {
        return Vec::new();
    };
    let samples = Samples {
        replicates: REPLICATES as u32,
        per_replicate: (samples / REPLICATES).max(1) as u32,
        seed,
    };
    let film = expose(integrator, frame, samples, &Silent);
    estimates_of(&film, Alike::Neighbours)
}

/// Estimates with their noise, and their discretisation errors.
fn estimates_of(film: &Film, alike: Alike) -> Vec<(Estimate, Rgb)> {
    let errors = film.errors(alike).unwrap_or_default();
    film.values()
        .zip(errors)
        .map(|(value, error)| {
            let estimate = Estimate {
                value,
                standard_error: error.sampling,
            };
            (estimate, error.discretisation)
        })
        .collect()
}

fn estimates(moments: &[Moments]) -> Vec<Estimate> {
    let estimate = |moments: &Moments| Estimate {
        value: moments.mean(),
        standard_error: moments.standard_error().unwrap_or_default(),
    };
    moments.iter().map(estimate).collect()
}
