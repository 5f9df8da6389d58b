//! Solutions that are good enough for a picture, and how to gather from them.

use super::SHADOW_RAYS;
use crate::camera::CameraFrame;
use crate::cli::Context;
use crate::cli::exit::Failure;
use crate::cli::goal::Goal;
use crate::cli::steering::{Steering, first_error};
use crate::integrators::{gather, unit_ray};
use glam::DVec2;
use luxel_solver::adaptive::{Adapted, AdaptiveConfig};
use luxel_solver::bvh::{Hit, Ray};
use luxel_solver::gather::{Components, Lookup};
use luxel_solver::world::{Receiver, World};

/// Rays for indirect light of a camera sample: with 16 samples 256 a pixel.
const GATHER_RAYS: usize = 16;

/// The same where an error is asked for: the rays of all samples of a pixel fill the hemisphere
/// together, so that few a sample leave the edges more. The Cornell box to 2 % takes about 45 samples a
/// pixel; fewer of 16 rays took as long.
const REFINED_GATHER_RAYS: usize = 4;

/// Patches of the solution for a fixed number of samples.
const GATHER_PATCHES: usize = 6000;

/// What a gather looks up, and how.
pub(super) struct Prepared<'w, 's> {
    pub(super) scene: Adapted<'w, 's>,
    pub(super) lookup: Lookup,
    pub(super) patches: usize,
    pub(super) config: gather::Config,
}

/// Solutions that are good enough for the goal at what the camera sees, and how to gather from them.
pub(super) fn prepare<'w, 's>(
    world: &'w World<'s>,
    frame: &CameraFrame,
    goal: Option<&Goal>,
    context: &Context<'_>,
) -> Result<Option<Prepared<'w, 's>>, Failure> {
    let seed = context.common.seed;
    let mut steering = Steering::new(context, goal);
    let scene = Adapted::new(world, seed)?;
    let mut config = gather::Config {
        rays: GATHER_RAYS,
        shadow_rays: SHADOW_RAYS,
        seed,
    };
    let seen = first_hits(world, frame);
    if goal.is_none() || seen.is_empty() {
        let solved = scene.solve(GATHER_PATCHES, &mut steering)?;
        return Ok(solved.map(|lookup| Prepared {
            scene,
            lookup,
            patches: GATHER_PATCHES,
            config,
        }));
    }
    let wanted = AdaptiveConfig {
        error: first_error(goal),
        components: Components::All,
        seed,
    };
    let [width, height] = frame.size();
    let prepared = scene.prepare(&seen, width * height, &wanted, &mut steering)?;
    Ok(prepared.map(|(lookup, budget)| {
        let ratio = budget.shadow_rays as f64 / budget.rays as f64;
        let shadow_rays = (ratio * REFINED_GATHER_RAYS as f64).round() as usize;
        config.rays = REFINED_GATHER_RAYS;
        config.shadow_rays = shadow_rays.clamp(1, REFINED_GATHER_RAYS);
        Prepared {
            scene,
            lookup,
            patches: budget.patches,
            config,
        }
    }))
}

/// What the camera sees in a regular grid of pixels.
fn first_hits(world: &World<'_>, frame: &CameraFrame) -> Vec<Receiver> {
    /// Pixels along a side.
    const GRID: usize = 24;
    let [width, height] = frame.size();
    let rays: Vec<Ray> = (0..GRID * GRID)
        .map(|index| {
            let along = |i: usize, side: usize| (i as f64 + 0.5) / GRID as f64 * side as f64;
            let pixel = DVec2::new(along(index % GRID, width), along(index / GRID, height));
            unit_ray(world, &frame.ray(pixel))
        })
        .collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    world.bvh().closest_hits(&rays, &mut hits);
    rays.iter()
        .zip(&hits)
        .filter_map(|(ray, hit)| Some(world.interaction(ray, hit)?.receiver))
        .collect()
}
