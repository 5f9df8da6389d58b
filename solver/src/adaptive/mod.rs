//! Irradiance at receivers to a stated error: mesh, rows, gather rays and shadow rays are chosen from
//! what a pilot measures.
//!
//! 1. A mesh and four solutions are guessed from the error that is asked for ([`Budget::pilot`]).
//! 2. Some of the receivers are gathered with few rays; the parts of their error
//!    ([`ErrorParts`]) say what the cheapest sufficient budget is (`budget`).
//! 3. When more patches are due, the scene is meshed and solved anew, with at most four times as many, and
//!    the pilot repeated.
//! 4. All receivers are gathered with half of the rays; the parts of the error are measured again, on all of
//!    them, and the missing rays follow from that until what 19 of 20 such runs do not exceed
//!    ([`ErrorParts::upper`]) is within the error. Gather rays are kept: their sequences go on. Shadow rays are
//!    cast anew where they make noise (`penumbrae`). Only where rays cannot make up for the mesh a new one is
//!    made, and begins a new gather.
//!
//! Many receivers are joined in the planes that they lie in ([`crate::gather::joined`]) before their errors are
//! measured: each then needs few rays.
//!
//! Every decision follows from sampled values, never from a clock, so that the result is the same at
//! any thread count; a [`Control`] that measures time may end the work earlier. While receivers are gathered the control
//! is shown a [`Checkpoint`] again and again, from which [`resume`] goes on to the same bits.

mod adapted;
mod budget;
mod checkpoint;
mod gathering;
mod indirect_field;
mod memory;
mod penumbrae;

pub use adapted::Adapted;
pub use budget::{Budget, ROW_RAYS, fewest_rays};
pub use checkpoint::Checkpoint;
pub use indirect_field::FieldGather;
pub use memory::{bytes_to_gather, bytes_to_refine, bytes_to_solve, first_patches};

use crate::bounces::Bounces;
use crate::gather::{Components, ErrorParts, Lookup, Tally};
use crate::pilot::PilotError;
use crate::solvers::Ledger;
use crate::world::{Receiver, World};
use budget::{Changes, JOINED_FROM, Planned, even, least_rays};
use gathering::{Gathering, gathers};
use penumbrae::Penumbrae;

/// How far below the error asked for the budget is planned from a pilot, which knows its parts to a tenth
/// or two, and how far the upper estimate is planned below it from a gather at all receivers. Smaller, and
/// many runs need one more round; larger, and all pay for it.
const SAFETY: f64 = 1.25;
const MARGIN: f64 = 1.03;

/// Share of the planned gather rays that are cast first: the rest follows from what they tell. Smaller,
/// and the second plan knows no more than the first; larger, and more rays are cast in vain.
const FIRST_SHARE: f64 = 0.5;

/// The same where receivers are joined: the pilot does not know how much that lessens the noise.
const FIRST_SHARE_JOINED: f64 = 0.25;

/// The largest growth of the gather rays in a round: where an error is out of reach no number suffices.
const RAY_GROWTH: usize = 4;

/// A new mesh must be this much finer to be worth a new gather.
const WORTHWHILE: f64 = 1.5;

/// Share of the error asked for that mesh and solution may have before a gather is begun anew with a finer
/// mesh. Smaller, and gathers are thrown away; larger, and the rest costs very many rays.
const MESH_SHARE: f64 = 0.8;

/// Rounds after which an error counts as out of reach: each doubles something.
const MAX_ROUNDS: usize = 24;

/// Shadow rays that each of many receivers begins with: enough to tell penumbrae from what sees a light wholly, which
/// gets no more. Fewer, and the outer parts of penumbrae seem to be outside of them: errors over what is stated for them, root mean
/// square, are 2.7 at 16, 2.1 at 24, 1.3 at 32 and about 1 from 48 on.
const FIRST_JOINED_SHADOW_RAYS: usize = 48;

/// Rays for the sky that are begun with, and the largest growth of their number in a round. Once they
/// have found the openings their error falls much faster than that of other rays, which no
/// extrapolation knows of: fewer tell nothing (160 % stated at 328 rays behind a small window, where
/// 5000 have 0.1 %), and a larger growth casts a hundred times too many.
const FIRST_SKY_RAYS: usize = 1024;
const SKY_GROWTH: usize = 4;

/// Watches over the work and may end it.
pub trait Control {
    /// Work of about `cost` gather rays on `what` begins, in `parts` equal parts. Returns the share
    /// of it that may be done, from 0 (none: stop here) to 1.
    fn begin(&mut self, what: Stage, cost: f64, parts: usize) -> f64;

    /// One of the parts is done. False stops the work; what it has made so far is lost.
    fn advance(&mut self) -> bool;

    /// All receivers have been gathered, with these errors. True when they suit.
    fn suits(&mut self, parts: &ErrorParts) -> bool;

    /// Another part of the receivers has been gathered: this is all that [`resume`] needs. Called after
    /// [`Control::advance`], also when that ended the work.
    fn keep(&mut self, _checkpoint: Checkpoint<'_>) {}
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
    /// More patches than [`AdaptiveConfig::most_patches`] would be needed.
    TooManyPatches,
}

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdaptiveConfig {
    /// Relative error to plan for, rms over mean of all receivers.
    pub error: f64,
    /// Which light.
    pub components: Components,
    /// How often it may be reflected.
    pub bounces: Bounces,
    /// Patches that no mesh may be asked to have more of, for want of memory: rays make up for the mesh
    /// as far as they can.
    pub most_patches: usize,
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
    /// Where the flux goes in its solutions; `None` where none was looked up.
    pub ledger: Option<Ledger>,
    /// Why no more was done.
    pub ending: Ending,
}

impl AdaptiveConfig {
    /// The same, of the light that there is within its bounces.
    fn within_bounces(&self) -> Self {
        let components = self.components.within(self.bounces);
        Self {
            components: components
                .expect("without a bounce there is no reflected light to ask for"),
            ..*self
        }
    }
}

/// Irradiance at receivers, until `control` is satisfied.
///
/// # Errors
/// When the scene cannot be meshed or its system not be solved, which a scene that was read without
/// errors excludes.
///
/// # Panics
/// When reflected light alone is asked for, and no bounce.
pub fn irradiance(
    world: &World,
    receivers: &[Receiver],
    config: &AdaptiveConfig,
    control: &mut dyn Control,
) -> Result<Adaptive, PilotError> {
    let config = &config.within_bounces();
    let error = config.error / SAFETY;
    let mut budget = first_budget(world, error, receivers.len());
    let mut lookup = None;
    let mut adapted = None;
    if config.components != Components::Direct {
        let scene = adapted.insert(Adapted::new(world, receivers, config.bounces, config.seed)?);
        match scene.prepare(receivers, receivers.len(), config, control)? {
            Some((solved, planned)) => {
                let (share, fewest) = if receivers.len() >= JOINED_FROM {
                    (FIRST_SHARE_JOINED, least_rays(receivers.len()))
                } else {
                    (FIRST_SHARE, budget.rays)
                };
                let first = even(share * planned.rays as f64).max(fewest);
                lookup = Some(solved);
                budget.patches = planned.patches;
                budget.rays = first.min(planned.rays);
            }
            None => return Ok(Adaptive::none()),
        }
    }
    let mut gathering = Gathering::new(world, receivers, gathers(receivers.len()), config);
    gathering.spent.patches = budget.patches;
    let evenly = gathering.evenly(budget.shadow_rays);
    let stage = Stage::Gathering;
    if !gathering.go_on(lookup.as_ref(), budget.rays, evenly, stage, control) {
        return Ok(Adaptive::none());
    }
    refine(gathering, adapted.as_ref(), lookup, config, control)
}

/// Goes on from a checkpoint of [`irradiance`] with the same world, receivers and configuration, to the same result.
///
/// # Errors
/// As [`irradiance`].
///
/// # Panics
/// When the checkpoint is not of so many receivers ([`Checkpoint::is_of`]).
pub fn resume(
    world: &World,
    receivers: &[Receiver],
    config: &AdaptiveConfig,
    checkpoint: Checkpoint<'_>,
    control: &mut dyn Control,
) -> Result<Adaptive, PilotError> {
    let config = &config.within_bounces();
    let mut gathering = Gathering::from_checkpoint(world, receivers, config, checkpoint);
    let mut lookup = None;
    let mut adapted = None;
    if config.components != Components::Direct {
        let scene = adapted.insert(Adapted::new(world, receivers, config.bounces, config.seed)?);
        lookup = scene.solve(gathering.spent.patches, control)?;
        if lookup.is_none() {
            return Ok(Adaptive::none());
        }
    }
    if !gathering.go_on_after_checkpoint(lookup.as_ref(), control) {
        return Ok(Adaptive::none());
    }
    refine(gathering, adapted.as_ref(), lookup, config, control)
}

/// Judges what was gathered, and gathers more until `control` is satisfied.
fn refine(
    mut gathering: Gathering<'_>,
    adapted: Option<&Adapted<'_, '_>>,
    mut lookup: Option<Lookup>,
    config: &AdaptiveConfig,
    control: &mut dyn Control,
) -> Result<Adaptive, PilotError> {
    loop {
        let mut result = gathering.state(lookup.as_ref());
        if control.suits(&result.parts) {
            result.ending = Ending::Reached;
            return Ok(result);
        }
        gathering.round.before += 1;
        let (total, upper) = (result.parts.total(), result.parts.upper());
        let error = config.error / MARGIN * (total / upper.max(f64::MIN_POSITIVE));
        // More is wanted than was planned for: half of what was reached.
        let error = if total <= error { 0.5 * total } else { error };
        let before = gathering.spent;
        let (count, has_sky) = (
            gathering.receivers.len(),
            gathering.world.lights().has_sky(),
        );
        let spent = Spent {
            budget: before,
            parts: result.parts,
            penumbrae: gathering.penumbrae(result.parts.direct, has_sky),
            has_sky,
        };
        let mut next = spent.plan(error, count, Changes::Rays);
        // A new mesh begins a new gather: only where rays cannot make up for the old one.
        let fixed = result.parts.solution.hypot(result.parts.mesh);
        let mut solved = None;
        let mut is_stopped = false;
        if let Some(scene) = adapted.filter(|_| fixed > MESH_SHARE * error) {
            let free = spent.plan(error, count, Changes::All);
            let worthwhile = (WORTHWHILE * before.patches as f64) as usize;
            let grows = free.budget.patches > before.patches;
            if grows && worthwhile > config.most_patches {
                gathering.round.is_held_back = true;
                // What the mesh leaves is too much by itself.
                if fixed >= error {
                    result.ending = Ending::TooManyPatches;
                    return Ok(result);
                }
            } else if grows {
                let patches = free.budget.patches.max(worthwhile).min(config.most_patches);
                next = free;
                solved = scene
                    .solve(patches, control)?
                    .map(|lookup| (lookup, patches));
                is_stopped = solved.is_none();
            }
        }
        let rays = next
            .budget
            .rays
            .clamp(before.rays, RAY_GROWTH * before.rays);
        let shadow_rounds = spent.penumbrae.due(&next.shadow_rays);
        let is_futile = rays == before.rays && solved.is_none() && shadow_rounds.is_empty();
        if is_futile || gathering.round.before == MAX_ROUNDS {
            result.ending = if is_stopped {
                Ending::Stopped
            } else if gathering.round.is_held_back {
                Ending::TooManyPatches
            } else {
                Ending::OutOfReach
            };
            return Ok(result);
        }
        if let Some((finer, patches)) = solved {
            lookup = Some(finer);
            gathering = gathering.with_direct_alone();
            gathering.spent.patches = patches;
        }
        if !gathering.go_on(
            lookup.as_ref(),
            rays,
            shadow_rounds,
            Stage::Gathering,
            control,
        ) {
            return Ok(result);
        }
    }
}

/// Irradiance at receivers for a given budget, whatever its error; `config.error` does not matter.
///
/// # Errors
/// As [`irradiance`].
///
/// # Panics
/// As [`irradiance`].
pub fn irradiance_for(
    world: &World,
    receivers: &[Receiver],
    budget: &Budget,
    config: &AdaptiveConfig,
    control: &mut dyn Control,
) -> Result<Adaptive, PilotError> {
    let config = &config.within_bounces();
    let mut lookup = None;
    if config.components != Components::Direct {
        lookup = Adapted::new(world, receivers, config.bounces, config.seed)?
            .solve(budget.patches, control)?;
        if lookup.is_none() {
            return Ok(Adaptive::none());
        }
    }
    let mut gathering = Gathering::new(world, receivers, gathers(receivers.len()), config);
    gathering.spent.patches = budget.patches;
    let evenly = gathering.evenly(budget.shadow_rays);
    if !gathering.go_on(
        lookup.as_ref(),
        budget.rays,
        evenly,
        Stage::Gathering,
        control,
    ) {
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
            ledger: None,
            ending: Ending::Stopped,
        }
    }
}

/// What to begin with at so many receivers.
fn first_budget(world: &World, error: f64, receivers: usize) -> Budget {
    let budget = Budget::pilot(error);
    let shadow_rays = if world.lights().has_sky() {
        FIRST_SKY_RAYS
    } else if receivers >= JOINED_FROM {
        FIRST_JOINED_SHADOW_RAYS
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

/// What was spent, and the error that it left.
struct Spent {
    budget: Budget,
    parts: ErrorParts,
    penumbrae: Penumbrae,
    has_sky: bool,
}

impl Spent {
    /// The next budget for an error at `count` receivers.
    fn plan(&self, error: f64, count: usize, changes: Changes) -> Planned {
        let mut planned =
            self.budget
                .for_error(error, &self.parts, &self.penumbrae, count, changes);
        if self.has_sky {
            // All receivers are of one class.
            let most = self.budget.shadow_rays * SKY_GROWTH;
            let rays = planned.budget.shadow_rays.clamp(FIRST_SKY_RAYS, most);
            planned.budget.shadow_rays = rays;
            planned.shadow_rays = vec![rays];
        }
        planned
    }
}

#[cfg(test)]
mod checkpoint_tests;
#[cfg(test)]
mod tests;
