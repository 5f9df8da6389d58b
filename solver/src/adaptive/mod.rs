//! Irradiance at receivers to a stated error: mesh, rows, gather rays and shadow rays are chosen from
//! what a pilot measures.
//!
//! 1. A mesh and four solutions are guessed from the error that is asked for ([`Budget::pilot`]).
//! 2. Some of the receivers are gathered with few rays; the parts of their error
//!    ([`ErrorParts`]) say what the cheapest sufficient budget is ([`Budget::for_error`]).
//! 3. When more patches are due, the scene is meshed and solved anew, with at most four times as many, and
//!    the pilot repeated.
//! 4. All receivers are gathered with half of the rays; the parts of the error are measured again, on all of
//!    them, and the missing rays follow from that until 19 of 20 such runs are within the error
//!    ([`ErrorParts::upper`]). Gather rays are kept: their sequences go on. Only where rays cannot make up for
//!    the mesh a new one is made, and begins a new gather.
//!
//! Every decision follows from sampled values, never from a clock, so that the result is the same at
//! any thread count; a [`Control`] that measures time may end the work earlier.

mod budget;

use budget::even;

pub use budget::{Budget, Mesh, ROW_RAYS, fewest_rays};

use crate::gather::{
    Components, ErrorParts, GatherConfig, Key, Lookup, MAX_REPLICATES, SkyRays, Solutions, Tally,
    error_parts, gather,
};
use crate::patches::{Density, Patches};
use crate::pilot::{self, PilotError};
use crate::radiosity::{self, RadiosityConfig, RadiositySolution};
use crate::solvers::{Config, SystemError, Tolerance};
use crate::world::{Receiver, World};

/// How far below the error asked for the budget is planned from a pilot, which knows its parts to a tenth
/// or two, and how far below what 19 of 20 runs may not exceed from a gather at all receivers. Smaller, and
/// many runs need one more round; larger, and all pay for it.
const SAFETY: f64 = 1.25;
const MARGIN: f64 = 1.03;

/// Share of the planned gather rays that are cast first: the rest follows from what they tell. Smaller,
/// and the second plan knows no more than the first; larger, and more rays are cast in vain.
const FIRST_SHARE: f64 = 0.5;

/// The largest growth of the gather rays in a round: where an error is out of reach no number suffices.
const RAY_GROWTH: usize = 4;

/// The largest growth of a mesh from one pilot to the next. The error of coarse meshes falls faster than
/// any exponent says: a larger growth makes meshes twice as fine as they need to be.
const MESH_GROWTH: usize = 4;

/// Receivers of a pilot: their mean square error is then known to a tenth.
const PILOT_RECEIVERS: usize = 128;

/// A new mesh must be this much finer to be worth a new gather.
const WORTHWHILE: f64 = 1.5;

/// Share of the error asked for that mesh and solution may have before a gather is begun anew with a finer
/// mesh. Smaller, and gathers are thrown away; larger, and the rest costs very many rays.
const MESH_SHARE: f64 = 0.8;

/// Rounds after which an error counts as out of reach: each doubles something.
const MAX_ROUNDS: usize = 24;

/// Rays for the sky that are begun with, and the largest growth of their number in a round. Once they
/// have found the openings their error falls much faster than that of other rays, which no
/// extrapolation knows of: fewer tell nothing (160 % stated at 328 rays behind a small window, where
/// 5000 have 0.1 %), and a larger growth casts a hundred times too many.
const FIRST_SKY_RAYS: usize = 1024;
const SKY_GROWTH: usize = 4;

/// Independent gathers when there are receivers enough to tell the noise together, and the fewest such
/// receivers. The more gathers share the rays, the less evenly each fills the hemisphere: with two
/// instead of four the error of bare rooms is 15 % smaller, of a furnished office 7 %; with one it
/// would not be known.
const GATHERS: usize = 2;
const MANY_RECEIVERS: usize = 64;

/// Parts in which receivers are gathered, so that the control hears of them, and the fewest receivers
/// of a part: fewer, and threads wait for each other.
const PARTS: usize = 50;
const SMALLEST_PART: usize = 64;

/// Bound on the error that the iteration may leave, relative to the brightest patch: a hundredth of
/// the smallest error that can be asked for would be 1e-7; sweeps are cheap beside rows.
const TOLERANCE: f64 = 1e-7;

/// Sweeps after which the iteration gives up: enough for reflectances up to 0.999.
const MAX_ITERATIONS: usize = 20_000;

/// Watches over the work and may end it.
pub trait Control {
    /// Work of about `cost` gather rays on `what` begins, in `parts` equal parts. Returns the share
    /// of it that may be done, from 0 (none: stop here) to 1.
    fn begin(&mut self, what: Stage, cost: f64, parts: usize) -> f64;

    /// One of the parts is done. False stops the work; what it has made so far is lost.
    fn advance(&mut self) -> bool;

    /// All receivers have been gathered, with these errors. True when they suit.
    fn suits(&mut self, parts: &ErrorParts) -> bool;
}

/// What work is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Rows are cast and solved.
    Solving,
    /// Some receivers are gathered to choose the budget.
    Pilot,
    /// All receivers are gathered.
    Gathering,
}

/// Why no more was done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The error suits.
    Reached,
    /// The control stopped it.
    Stopped,
    /// More rays or patches than there may be would be needed.
    OutOfReach,
}

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdaptiveConfig {
    /// Relative error to plan for, rms over mean of all receivers.
    pub error: f64,
    /// Which light.
    pub components: Components,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// Irradiance at receivers, and how it came about.
pub struct Adaptive {
    /// One tally a receiver; empty when the work was stopped before there was any.
    pub tallies: Vec<Tally>,
    /// Relative errors of the tallies.
    pub parts: ErrorParts,
    /// Bound on what the iteration of the solutions left at any receiver, in W/m².
    pub solver_bound: f64,
    /// What was spent in the end.
    pub budget: Budget,
    /// Patches of the mesh that was looked up.
    pub patches: usize,
    /// Why no more was done.
    pub ending: Ending,
}

/// A scene with the density of patches that follows its light.
pub struct Adapted<'w, 's> {
    world: &'w World<'s>,
    density: Density,
    seed: u64,
}

impl<'w, 's> Adapted<'w, 's> {
    /// Finds out where the light is.
    ///
    /// # Errors
    /// As [`pilot::density`].
    pub fn new(world: &'w World<'s>, seed: u64) -> Result<Self, PilotError> {
        let density = pilot::density(world, seed)?;
        Ok(Self {
            world,
            density,
            seed,
        })
    }

    /// Solutions of about `patches` patches, and of a quarter of them. `Ok(None)` when `control`
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
        let (fine, coarse) = (mesh(patches)?, mesh(patches / 4)?);
        if control.begin(Stage::Solving, budget::solve_cost(patches), MAX_REPLICATES) < 1.0 {
            return Ok(None);
        }
        let mut on_fine = Vec::new();
        let mut on_coarse = Vec::new();
        for replicate in 0..MAX_REPLICATES as u64 {
            on_fine.push(self.solve_once(&fine, replicate)?);
            on_coarse.push(self.solve_once(&coarse, replicate)?);
            if !control.advance() {
                return Ok(None);
            }
        }
        let lookup = Lookup::new(fine, &on_fine).with_coarse(coarse, &on_coarse);
        Ok(Some(lookup))
    }

    fn solve_once(
        &self,
        patches: &Patches,
        replicate: u64,
    ) -> Result<RadiositySolution, SystemError> {
        let config = RadiosityConfig {
            rays: ROW_RAYS,
            shadow_rays: 1,
            solver: Config {
                tolerance: Tolerance::Error(TOLERANCE),
                max_iterations: MAX_ITERATIONS,
            },
            seed: self.seed,
            replicate,
        };
        radiosity::solve(self.world, patches, &config)
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
        let share = sample.len().div_ceil(PILOT_RECEIVERS).max(1);
        let sample: Vec<Receiver> = sample.iter().copied().step_by(share).collect();
        loop {
            let Some(lookup) = self.solve(pilot.patches, control)? else {
                return Ok(None);
            };
            let mut gathering = Gathering::new(self.world, &sample, gathers(count), config);
            if !gathering.go_on(Some(&lookup), &pilot, Stage::Pilot, control) {
                return Ok(None);
            }
            let parts = error_parts(&gathering.tallies);
            let planned = plan(self.world, &pilot, error, &parts, count, Mesh::Free);
            if planned.patches as f64 <= WORTHWHILE * pilot.patches as f64 {
                let patches = pilot.patches;
                return Ok(Some((lookup, Budget { patches, ..planned })));
            }
            pilot.patches = planned.patches.min(MESH_GROWTH * pilot.patches);
        }
    }
}

/// Irradiance at receivers, until `control` is satisfied.
///
/// # Errors
/// When the scene cannot be meshed or its system not be solved, which a scene that was read without
/// errors excludes.
pub fn irradiance(
    world: &World,
    receivers: &[Receiver],
    config: &AdaptiveConfig,
    control: &mut dyn Control,
) -> Result<Adaptive, PilotError> {
    let mut error = config.error / SAFETY;
    let mut budget = first_budget(world, error, receivers.len());
    let mut gathering = Gathering::new(world, receivers, gathers(receivers.len()), config);
    let mut adapted = None;
    let mut lookup = None;
    if config.components != Components::Direct {
        let scene = adapted.insert(Adapted::new(world, config.seed)?);
        match scene.prepare(receivers, receivers.len(), config, control)? {
            Some((solved, planned)) => {
                let fewest = first_budget(world, error, receivers.len()).rays;
                let first = even(FIRST_SHARE * planned.rays as f64).max(fewest);
                let rays = first.min(planned.rays);
                (lookup, budget) = (Some(solved), Budget { rays, ..planned });
            }
            None => return Ok(Adaptive::none()),
        }
    }
    let mut result = Adaptive::none();
    for _ in 0..MAX_ROUNDS {
        if !gathering.go_on(lookup.as_ref(), &budget, Stage::Gathering, control) {
            return Ok(result);
        }
        result = gathering.state(lookup.as_ref());
        if control.suits(&result.parts) {
            result.ending = Ending::Reached;
            return Ok(result);
        }
        let (total, upper) = (result.parts.total(), result.parts.upper());
        error = config.error / MARGIN * (total / upper.max(f64::MIN_POSITIVE));
        // More is wanted than was planned for: half of what was reached.
        error = if total <= error { 0.5 * total } else { error };
        let count = receivers.len();
        let plan = |mesh| plan(world, &gathering.spent, error, &result.parts, count, mesh);
        let mut next = plan(Mesh::Kept);
        // A new mesh begins a new gather: only where rays cannot make up for the old one.
        let fixed = result.parts.solution.hypot(result.parts.mesh);
        let mut solved = None;
        if let Some(scene) = adapted.as_ref().filter(|_| fixed > MESH_SHARE * error) {
            let free = plan(Mesh::Free);
            if free.patches > budget.patches {
                let worthwhile = (WORTHWHILE * budget.patches as f64) as usize;
                let patches = free.patches.max(worthwhile);
                next = Budget { patches, ..free };
                solved = scene.solve(patches, control)?;
            }
        }
        let spent = gathering.spent;
        next = Budget {
            patches: next.patches,
            rays: next.rays.clamp(spent.rays, RAY_GROWTH * spent.rays),
            shadow_rays: next.shadow_rays.max(spent.shadow_rays),
        };
        if next == gathering.spent {
            result.ending = Ending::OutOfReach;
            return Ok(result);
        }
        if solved.is_some() {
            lookup = solved;
            gathering = Gathering::new(world, receivers, gathers(receivers.len()), config);
        }
        budget = next;
    }
    result.ending = Ending::OutOfReach;
    Ok(result)
}

/// Irradiance at receivers for a given budget, whatever its error; `config.error` does not matter.
///
/// # Errors
/// As [`irradiance`].
pub fn irradiance_for(
    world: &World,
    receivers: &[Receiver],
    budget: &Budget,
    config: &AdaptiveConfig,
    control: &mut dyn Control,
) -> Result<Adaptive, PilotError> {
    let mut lookup = None;
    if config.components != Components::Direct {
        lookup = Adapted::new(world, config.seed)?.solve(budget.patches, control)?;
        if lookup.is_none() {
            return Ok(Adaptive::none());
        }
    }
    let mut gathering = Gathering::new(world, receivers, gathers(receivers.len()), config);
    if !gathering.go_on(lookup.as_ref(), budget, Stage::Gathering, control) {
        return Ok(Adaptive::none());
    }
    let mut result = gathering.state(lookup.as_ref());
    if control.suits(&result.parts) {
        result.ending = Ending::Reached;
    }
    Ok(result)
}

impl Adaptive {
    fn none() -> Self {
        Self {
            tallies: Vec::new(),
            parts: ErrorParts::default(),
            solver_bound: 0.0,
            budget: Budget::default(),
            patches: 0,
            ending: Ending::Stopped,
        }
    }
}

/// What to begin with at so many receivers.
fn first_budget(world: &World, error: f64, receivers: usize) -> Budget {
    let budget = Budget::pilot(error);
    let shadow_rays = if world.lights().has_sky() {
        FIRST_SKY_RAYS
    } else {
        budget.shadow_rays
    };
    let fewest = fewest_rays(receivers);
    Budget {
        rays: budget.rays.max(fewest),
        shadow_rays: shadow_rays.max(fewest),
        ..budget
    }
}

/// The next budget for an error, after one that had certain parts.
fn plan(
    world: &World,
    spent: &Budget,
    error: f64,
    parts: &ErrorParts,
    receivers: usize,
    mesh: Mesh,
) -> Budget {
    let mut planned = spent.for_error(error, parts, receivers, mesh);
    if world.lights().has_sky() {
        let most = spent.shadow_rays * SKY_GROWTH;
        planned.shadow_rays = planned.shadow_rays.clamp(FIRST_SKY_RAYS, most);
    }
    planned
}

/// Independent gathers of so many receivers.
fn gathers(receivers: usize) -> usize {
    if receivers < MANY_RECEIVERS {
        MAX_REPLICATES
    } else {
        GATHERS
    }
}

/// Receivers with what has been gathered at them.
struct Gathering<'a> {
    world: &'a World<'a>,
    receivers: &'a [Receiver],
    gathers: usize,
    config: AdaptiveConfig,
    tallies: Vec<Tally>,
    spent: Budget,
}

impl<'a> Gathering<'a> {
    fn new(
        world: &'a World<'a>,
        receivers: &'a [Receiver],
        gathers: usize,
        config: &AdaptiveConfig,
    ) -> Self {
        Self {
            world,
            receivers,
            gathers,
            config: *config,
            tallies: vec![Tally::default(); receivers.len()],
            spent: Budget::default(),
        }
    }

    /// What there is now.
    fn state(&self, lookup: Option<&Lookup>) -> Adaptive {
        Adaptive {
            tallies: self.tallies.clone(),
            parts: error_parts(&self.tallies),
            solver_bound: lookup.map_or(0.0, Lookup::solver_bound),
            budget: self.spent,
            patches: lookup.map_or(0, |lookup| lookup.patches().len()),
            ending: Ending::Stopped,
        }
    }

    /// Gathers what is missing from what was spent to `budget`: gather rays are added, shadow rays
    /// cast anew. False when `control` stops; the tallies are then as they were.
    fn go_on(
        &mut self,
        lookup: Option<&Lookup>,
        budget: &Budget,
        stage: Stage,
        control: &mut dyn Control,
    ) -> bool {
        let round = Budget {
            patches: budget.patches,
            rays: budget.rays - self.spent.rays,
            shadow_rays: if budget.shadow_rays == self.spent.shadow_rays {
                0
            } else {
                budget.shadow_rays
            },
        };
        let cost = round.gather_cost(self.receivers.len());
        let part = (self.receivers.len() / PARTS).max(SMALLEST_PART);
        let parts = self.receivers.len().div_ceil(part);
        let share = control.begin(stage, cost, parts);
        if share <= 0.0 {
            return false;
        }
        let round = round.scaled(share);
        let config = GatherConfig {
            rays: round.rays,
            rays_before: self.spent.rays / self.gathers,
            shadow_rays: round.shadow_rays,
            sky: SkyRays::Apart,
            gathers: self.gathers,
            solutions: Solutions::All,
            components: self.config.components,
            seed: self.config.seed,
        };
        let mut tallies = Vec::with_capacity(self.receivers.len());
        for receivers in self.receivers.chunks(part) {
            let first = tallies.len() as u64;
            let keys: Vec<Key> = (first..first + receivers.len() as u64)
                .map(Key::of)
                .collect();
            tallies.extend(gather(self.world, lookup, receivers, &keys, &config));
            if !control.advance() {
                return false;
            }
        }
        for (tally, more) in self.tallies.iter_mut().zip(&tallies) {
            tally.join(more);
        }
        self.spent = Budget {
            patches: budget.patches,
            rays: self.spent.rays + round.rays,
            shadow_rays: self.spent.shadow_rays.max(round.shadow_rays),
        };
        true
    }
}

#[cfg(test)]
mod tests;
