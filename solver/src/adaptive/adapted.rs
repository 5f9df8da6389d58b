//! A scene with what is looked up in it: solutions on meshes whose density follows the light.

use super::budget::{self, JOINED_FROM, fewest_shadow_rays};
use super::gathering::{Gathering, gathers};
use super::penumbrae::Penumbrae;
use super::{
    AdaptiveConfig, Budget, Changes, Control, ROW_RAYS, SAFETY, Spent, Stage, WORTHWHILE,
    first_budget,
};
use crate::bounces::Bounces;
use crate::error;
use crate::gather::{Lookup, MAX_REPLICATES, error_parts, orders, share_of_solutions};
use crate::patches::{Density, Patches};
use crate::pilot::{self, PilotError};
use crate::radiosity::{self, RadiosityConfig};
use crate::solvers::{Config, SystemError, Tolerance};
use crate::world::{Receiver, World};

/// The largest growth of a mesh from one pilot to the next. The error of coarse meshes falls faster than
/// any exponent says: a larger growth makes meshes twice as fine as they need to be.
const MESH_GROWTH: usize = 4;

/// Receivers of a pilot: their mean square error is then known to a tenth.
const PILOT_RECEIVERS: usize = 128;

/// By how much joining lessens the noise of gather rays where there are receivers enough, roughly: rooms 10,
/// furnished ones 5.
const USUAL_GAIN: f64 = 5.0;

/// Bound on the error that the iteration may leave, relative to the brightest patch: a hundredth of
/// the smallest error that can be asked for would be 1e-7; sweeps are cheap beside rows.
const TOLERANCE: f64 = 1e-7;

/// Sweeps after which the iteration gives up: enough for reflectances up to 0.999.
const MAX_ITERATIONS: usize = 20_000;

/// A scene with the density of patches that follows its light.
pub struct Adapted<'w, 's> {
    world: &'w World<'s>,
    density: Density,
    bounces: Bounces,
    seed: u64,
}

impl<'w, 's> Adapted<'w, 's> {
    /// Finds out where the light is, and where `receivers`, if there are any, need it. Solutions will be such that what is gathered from them was reflected as often as
    /// `bounces` says.
    ///
    /// # Errors
    /// As [`pilot::density`].
    ///
    /// # Panics
    /// When no bounce is asked for: nothing is then looked up.
    pub fn new(
        world: &'w World<'s>,
        receivers: &[Receiver],
        bounces: Bounces,
        seed: u64,
    ) -> Result<Self, PilotError> {
        assert!(bounces.reflect(), "solutions hold reflected light");
        let density = pilot::density(world, receivers, seed)?;
        Ok(Self {
            world,
            density,
            bounces,
            seed,
        })
    }

    /// Solutions of about `patches` patches, with what a quarter of them would show. `Ok(None)` when `control`
    /// stops.
    ///
    /// # Errors
    /// When the scene cannot be meshed or the system not be solved.
    pub fn solve(
        &self,
        patches: usize,
        control: &mut dyn Control,
    ) -> Result<Option<Lookup>, PilotError> {
        let mesh = |count: usize| self.world.mesh_with_density(count.max(1), &self.density);
        let (fine, coarse) = rayon::join(|| mesh(patches), || mesh(patches / 4));
        let (fine, coarse) = (fine?, coarse?);
        if control.begin(Stage::Solving, budget::solve_cost(patches), MAX_REPLICATES) < 1.0 {
            return Ok(None);
        }
        let lookup = match self.bounces {
            Bounces::All => {
                let parents = error::parents(self.world.surfaces(), &fine, &coarse);
                let sizes = parents.iter().map(|&parent| coarse.size(parent)).collect();
                drop(coarse);
                let once = |replicate| {
                    let config = self.config(replicate);
                    radiosity::solve_beside(self.world, &fine, &parents, &config)
                };
                replicates(control, once)?
                    .map(|solutions| Lookup::new(fine, &solutions).with_parents(sizes, &solutions))
            }
            Bounces::AtMost(most) => {
                let once = |replicate| {
                    let (orders, config) = (orders(self.bounces), self.config(replicate));
                    let solve = |patches: &Patches| {
                        radiosity::solve_partial(self.world, patches, most, orders, &config)
                    };
                    Ok((solve(&fine)?, solve(&coarse)?))
                };
                replicates(control, once)?.map(|solutions| {
                    let (on_fine, on_coarse): (Vec<_>, Vec<_>) = solutions.into_iter().unzip();
                    Lookup::new(fine, &on_fine).with_coarse(coarse, &on_coarse)
                })
            }
        };
        Ok(lookup)
    }

    fn config(&self, replicate: u64) -> RadiosityConfig {
        RadiosityConfig {
            rays: ROW_RAYS,
            shadow_rays: 1,
            solver: Config {
                tolerance: Tolerance::Error(TOLERANCE),
                max_iterations: MAX_ITERATIONS,
            },
            seed: self.seed,
            replicate,
        }
    }

    /// Solutions that are good enough for a relative error at `count` receivers of which `sample`
    /// are some, and the budget that a pilot gather at the sample suggests for all of them.
    ///
    /// # Errors
    /// As [`Self::solve`].
    pub fn prepare(
        &self,
        sample: &[Receiver],
        count: usize,
        config: &AdaptiveConfig,
        control: &mut dyn Control,
    ) -> Result<Option<(Lookup, Budget)>, PilotError> {
        let error = config.error / SAFETY;
        let mut pilot = first_budget(self.world, error, sample.len().min(PILOT_RECEIVERS));
        pilot.patches = pilot.patches.min(config.most_patches);
        let share = sample.len().div_ceil(PILOT_RECEIVERS).max(1);
        let sample: Vec<Receiver> = sample.iter().copied().step_by(share).collect();
        loop {
            let Some(lookup) = self.solve(pilot.patches, control)? else {
                return Ok(None);
            };
            let mut gathering = Gathering::new(self.world, &sample, gathers(count), config);
            let evenly = gathering.evenly(pilot.shadow_rays);
            let half = pilot.rays / 2;
            if !gathering.go_on(Some(&lookup), half, Vec::new(), Stage::Pilot, control) {
                return Ok(None);
            }
            let first = gathering.tallies.clone();
            if !gathering.go_on(Some(&lookup), 2 * half, evenly, Stage::Pilot, control) {
                return Ok(None);
            }
            let mut parts = error_parts(&gathering.tallies);
            let share = share_of_solutions(&first, &gathering.tallies);
            parts.gather = parts.gather.hypot(parts.solution * (1.0 - share).sqrt());
            parts.solution *= share.sqrt();
            if count >= JOINED_FROM {
                parts.gather /= USUAL_GAIN;
            }
            let penumbrae = Penumbrae::even(
                sample.len(),
                pilot.shadow_rays,
                fewest_shadow_rays(count),
                parts.direct,
            );
            let has_sky = self.world.lights().has_sky();
            let spent = Spent {
                budget: pilot,
                parts,
                penumbrae,
                has_sky,
            };
            let planned = spent.plan(error, count, Changes::All).budget;
            let finer = planned.patches.min(config.most_patches);
            if finer as f64 <= WORTHWHILE * pilot.patches as f64 {
                let patches = pilot.patches;
                return Ok(Some((lookup, Budget { patches, ..planned })));
            }
            pilot.patches = finer.min(MESH_GROWTH * pilot.patches);
        }
    }
}

/// What `once` makes of each replicate; `Ok(None)` when `control` stops.
fn replicates<T>(
    control: &mut dyn Control,
    once: impl Fn(u64) -> Result<T, SystemError>,
) -> Result<Option<Vec<T>>, PilotError> {
    let mut made = Vec::new();
    for replicate in 0..MAX_REPLICATES as u64 {
        made.push(once(replicate)?);
        if !control.advance() {
            return Ok(None);
        }
    }
    Ok(Some(made))
}
