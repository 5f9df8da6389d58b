//! Solutions that are good enough for a picture, and how to gather from them.

use super::SHADOW_RAYS;
use crate::camera::{CameraFrame, CameraRay};
use crate::cli::Context;
use crate::cli::exit::Failure;
use crate::cli::goal::Goal;
use crate::cli::steering::{Steering, first_error};
use crate::integrators::gather::{self, Gatherer};
use crate::integrators::{Vertex, cast};
use glam::DVec2;
use luxel_scenes::Rgb;
use luxel_solver::adaptive::{Adapted, AdaptiveConfig, FieldGather};
use luxel_solver::bounces::Bounces;
use luxel_solver::gather::{Components, IndirectField, Lookup};
use luxel_solver::sampling::hash;
use luxel_solver::world::{Receiver, World};
use std::f64::consts::PI;

/// Rays for indirect light of a camera sample: with 16 samples 256 a pixel.
const GATHER_RAYS: usize = 16;

/// The same where an error is asked for, and no field is known: the rays of all samples of a pixel fill the
/// hemisphere together, so that few a sample leave the edges more.
const REFINED_GATHER_RAYS: usize = 4;

/// Patches of the solution for a fixed number of samples.
pub(super) const GATHER_PATCHES: usize = 6000;

/// Pixels that share their gather rays, roughly: what the mesh is planned for.
const JOINED: usize = 16;

/// Share of the error asked for that the noise of the indirect light may have: samples lessen the rest.
const FIELD_SHARE: f64 = 0.5;

/// What sets the random numbers of a field apart from those of the film.
const FIELD: u64 = 0xf1e1_d000;

/// Most receivers of a field: of larger pictures not every pixel is one.
const MOST_RECEIVERS: usize = 40_000;

/// What a gather looks up, and how.
pub(super) struct Prepared<'w, 's> {
    pub(super) scene: Adapted<'w, 's>,
    pub(super) lookup: Lookup,
    pub(super) patches: usize,
    pub(super) config: gather::Config,
    /// How well indirect light is to be known, where that is worth a field of its own.
    pub(super) field_error: Option<f64>,
}

/// How direct light alone is gathered: the rays find the sky, and emission that is not a source.
pub(super) fn of_direct_light(seed: u64) -> gather::Config {
    gather::Config {
        rays: REFINED_GATHER_RAYS,
        shadow_rays: SHADOW_RAYS,
        seed,
    }
}

/// Solutions of `most_patches` at most that are good enough for the goal at what the camera sees, and how to gather from them.
pub(super) fn prepare<'w, 's>(
    world: &'w World<'s>,
    frame: &CameraFrame,
    most_patches: usize,
    bounces: Bounces,
    goal: Option<&Goal>,
    context: &Context<'_>,
) -> Result<Option<Prepared<'w, 's>>, Failure> {
    let seed = context.common.seed;
    let mut steering = Steering::new(context, goal);
    let mut config = gather::Config {
        rays: GATHER_RAYS,
        shadow_rays: SHADOW_RAYS,
        seed,
    };
    let seen = first_hits(world, frame);
    let scene = Adapted::new(world, &seen, bounces, seed)?;
    if goal.is_none() || seen.is_empty() {
        let solved = scene.solve(GATHER_PATCHES, &mut steering)?;
        return Ok(solved.map(|lookup| Prepared {
            scene,
            lookup,
            patches: GATHER_PATCHES,
            config,
            field_error: None,
        }));
    }
    let wanted = AdaptiveConfig {
        error: first_error(goal),
        components: Components::All,
        bounces,
        most_patches,
        seed,
    };
    let [width, height] = frame.size();
    let count = (width * height).div_ceil(JOINED).max(seen.len());
    let prepared = scene.prepare(&seen, count, &wanted, &mut steering)?;
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
            field_error: Some(FIELD_SHARE * first_error(goal)),
        }
    }))
}

/// Receivers of the field of a picture of some size, along its sides.
pub(super) fn receivers([width, height]: [usize; 2]) -> [usize; 2] {
    let every = ((width * height) as f64 / MOST_RECEIVERS as f64)
        .sqrt()
        .max(1.0);
    [width, height].map(|side| (side as f64 / every).ceil() as usize)
}

/// Indirect light where the camera sees diffuse faces, as exact as the picture needs it; `None` when it was stopped, or
/// no light is seen that an error could be relative to.
pub(super) fn indirect_field(
    world: &World<'_>,
    lookup: &Lookup,
    frame: &CameraFrame,
    config: gather::Config,
    error: f64,
    steering: &mut Steering<'_, '_>,
) -> Option<IndirectField> {
    let cells = receivers(frame.size());
    let mut seen = views(world, frame, cells);
    seen.retain(|vertex| vertex.reflectance().0.max_element() > 0.0);
    let share = seen.len() as f64 / (cells[0] * cells[1]) as f64;
    let weight = |vertex: &Vertex<'_>| vertex.reflectance().0 * (share.sqrt() / PI);
    let places: Vec<Receiver> = seen.iter().map(Vertex::receiver).collect();
    let weights: Vec<Rgb> = seen.iter().map(weight).collect();
    let level = Gatherer::new(world, lookup, config).level(&rays(frame, [GRID; 2]));
    if level <= 0.0 {
        return None;
    }
    let seed = hash::mix64(config.seed ^ FIELD);
    FieldGather::new(world, lookup, &places, seed).until(error * level, &weights, steering)
}

/// Cells along each side of the grid by which a picture is judged.
const GRID: usize = 24;

/// What the camera sees in that grid.
fn first_hits(world: &World<'_>, frame: &CameraFrame) -> Vec<Receiver> {
    let views = views(world, frame, [GRID; 2]);
    views
        .iter()
        .map(|vertex| vertex.interaction.receiver)
        .collect()
}

/// Camera rays through the middles of a grid of so many cells.
fn rays(frame: &CameraFrame, cells: [usize; 2]) -> Vec<CameraRay> {
    let [width, height] = frame.size();
    (0..cells[0] * cells[1])
        .map(|index| {
            let along =
                |i: usize, cells: usize, side: usize| (i as f64 + 0.5) / cells as f64 * side as f64;
            let x = along(index % cells[0], cells[0], width);
            let y = along(index / cells[0], cells[1], height);
            frame.ray(DVec2::new(x, y))
        })
        .collect()
}

/// Where those rays meet something.
fn views<'w>(world: &'w World<'_>, frame: &CameraFrame, cells: [usize; 2]) -> Vec<Vertex<'w>> {
    let (rays, hits) = cast(world, &rays(frame, cells));
    let vertices = rays.iter().zip(&hits);
    vertices
        .filter_map(|(ray, hit)| Vertex::new(world, ray, hit))
        .collect()
}
