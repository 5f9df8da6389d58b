//! Receivers with what has been gathered at them, round after round: gather rays are added to those that
//! were cast, shadow rays are cast anew where more are due.

use super::budget::{JOINED_FROM, even, gather_cost};
use super::checkpoint::{Checkpoint, Rays, Round, Step};
use super::penumbrae::Penumbrae;
use super::{Adaptive, AdaptiveConfig, Budget, Control, Ending, Stage};
use crate::gather::{
    GatherConfig, Guides, Key, Lookup, MAX_REPLICATES, SkyRays, Solutions, Tally, error_parts,
    gather_guided, joined,
};
use crate::world::{Receiver, World};
use std::borrow::Cow;

/// Independent gathers when there are receivers enough to tell the noise together, and the fewest such
/// receivers. The more gathers share the rays, the less evenly each fills the hemisphere: with two
/// instead of four the error of bare rooms is 15 % smaller, of a furnished office 7 %; with one it
/// would not be known. Joined receivers have four: cells follow from the noise of a few neighbours, which
/// the differences of two gathers tell badly (a third too little was stated).
const GATHERS: usize = 2;
const MANY_RECEIVERS: usize = 64;

/// Parts in which receivers are gathered, so that the control hears of them, and the fewest rays of a part, shadow rays
/// among them: threads wait for each other at its end. A second of one thread holds some four times as many.
const PARTS: usize = 50;
const RAYS_OF_PART: usize = 1 << 19;

/// Independent gathers of so many receivers.
pub(super) fn gathers(receivers: usize) -> usize {
    if (MANY_RECEIVERS..JOINED_FROM).contains(&receivers) {
        GATHERS
    } else {
        MAX_REPLICATES
    }
}

/// Receivers of a part, unless there are more than this times [`PARTS`]: what is gathered at them is held beside what was
/// gathered before.
const RECEIVERS_OF_PART: usize = 1 << 13;

/// Receivers of a part of a gather of so many rays at each.
fn receivers_of_part(receivers: usize, rays: usize) -> usize {
    let of_rays = (RAYS_OF_PART / rays.max(1)).min(RECEIVERS_OF_PART);
    (receivers / PARTS).max(of_rays).max(1)
}

/// Gathers at some receivers, each an item of its own, and joins what that found to their tallies.
fn add_part(
    world: &World,
    lookup: Option<&Lookup>,
    guides: Option<&Guides>,
    receivers: &[Receiver],
    positions: &[u32],
    config: &GatherConfig,
    tallies: &mut [Tally],
) {
    let of_part = positions
        .iter()
        .map(|&position| receivers[position as usize]);
    let of_part: Vec<Receiver> = of_part.collect();
    let keys = positions.iter().map(|&position| Key::of(position.into()));
    let keys: Vec<Key> = keys.collect();
    let found = gather_guided(world, lookup, guides, &of_part, &keys, config);
    for (&position, more) in positions.iter().zip(&found) {
        tallies[position as usize].join(more);
    }
}

/// Gathers at all receivers, part after part, and joins what that found to their tallies. False when `control` stops;
/// some parts are then joined and some not.
pub(super) fn add(
    world: &World,
    lookup: Option<&Lookup>,
    guides: Option<&Guides>,
    receivers: &[Receiver],
    config: &GatherConfig,
    tallies: &mut [Tally],
    control: &mut dyn Control,
) -> bool {
    let part = receivers_of_part(receivers.len(), config.rays + config.shadow_rays);
    all(receivers.len()).chunks(part).all(|positions| {
        add_part(world, lookup, guides, receivers, positions, config, tallies);
        control.advance()
    })
}

/// Number of parts in which so many of all receivers are gathered, with so many rays each.
pub(super) fn parts(some: usize, all: usize, rays: usize) -> usize {
    some.div_ceil(receivers_of_part(all, rays))
}

/// The positions of so many receivers.
fn all(receivers: usize) -> Vec<u32> {
    (0..receivers as u32).collect()
}

/// Receivers, by position, that get so many shadow rays.
pub(super) type ShadowRound = (usize, Vec<u32>);

/// Receivers with what has been gathered at them.
pub(super) struct Gathering<'a> {
    pub(super) world: &'a World<'a>,
    pub(super) receivers: &'a [Receiver],
    gathers: usize,
    config: AdaptiveConfig,
    pub(super) round: Round,
    pub(super) tallies: Vec<Tally>,
    pub(super) spent: Budget,
    /// What is due, and how many receivers of the first step have been gathered at.
    steps: Vec<Step>,
    done: usize,
}

impl<'a> Gathering<'a> {
    pub(super) fn new(
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
            round: Round::default(),
            tallies: vec![Tally::default(); receivers.len()],
            spent: Budget::default(),
            steps: Vec::new(),
            done: 0,
        }
    }

    /// What a checkpoint holds; all receivers are gathered alike.
    ///
    /// # Panics
    /// When it is not of so many receivers.
    pub(super) fn from_checkpoint(
        world: &'a World<'a>,
        receivers: &'a [Receiver],
        config: &AdaptiveConfig,
        checkpoint: Checkpoint<'_>,
    ) -> Self {
        assert!(checkpoint.is_of(receivers.len()), "of these receivers");
        let mut gathering = Self::new(world, receivers, gathers(receivers.len()), config);
        gathering.round = checkpoint.round;
        gathering.tallies = checkpoint.tallies.into_owned();
        gathering.spent = checkpoint.spent;
        gathering.steps = checkpoint.steps.into_owned();
        gathering.done = checkpoint.done;
        gathering
    }

    fn checkpoint(&self) -> Checkpoint<'_> {
        Checkpoint {
            round: self.round,
            spent: self.spent,
            steps: Cow::Borrowed(&self.steps),
            done: self.done,
            tallies: Cow::Borrowed(&self.tallies),
        }
    }

    /// What there is now.
    pub(super) fn state(&self, lookup: Option<&Lookup>) -> Adaptive {
        let tallies = if self.receivers.len() >= JOINED_FROM {
            joined(self.world, self.receivers, &self.tallies)
        } else {
            self.tallies.clone()
        };
        Adaptive {
            parts: error_parts(&tallies),
            tallies,
            solver_bound: lookup.map_or(0.0, Lookup::solver_bound),
            budget: self.spent,
            patches: lookup.map_or(0, |lookup| lookup.patches().len()),
            ledger: lookup.map(Lookup::ledger),
            ending: Ending::Stopped,
        }
    }

    /// The same receivers with their direct light alone: what a new mesh leaves.
    pub(super) fn with_direct_alone(mut self) -> Self {
        for tally in &mut self.tallies {
            *tally = tally.direct_alone();
        }
        self.spent.rays = 0;
        self
    }

    /// Receivers by the noise of their direct light, which is a part `error` of the relative error of all. That of a
    /// sky's is not known beforehand: all are alike.
    pub(super) fn penumbrae(&self, error: f64, has_sky: bool) -> Penumbrae {
        if has_sky {
            let rays = self.spent.shadow_rays;
            Penumbrae::even(self.receivers.len(), rays, rays, error)
        } else {
            Penumbrae::new(&self.tallies, error)
        }
    }

    /// All receivers with the same number of shadow rays.
    pub(super) fn evenly(&self, shadow_rays: usize) -> Vec<ShadowRound> {
        vec![(shadow_rays, all(self.receivers.len()))]
    }

    /// Adds gather rays to those of all receivers up to `rays`, and casts shadow rays anew where they are due. False
    /// when `control` stops; there is then no going on.
    pub(super) fn go_on(
        &mut self,
        lookup: Option<&Lookup>,
        rays: usize,
        shadow_rounds: Vec<ShadowRound>,
        stage: Stage,
        control: &mut dyn Control,
    ) -> bool {
        self.steps = vec![Step {
            rays: Rays::Gather(rays - self.spent.rays),
            receivers: all(self.receivers.len()),
        }];
        let of_shadow_rays = |(rays, receivers)| Step {
            rays: Rays::Shadow(rays),
            receivers,
        };
        self.steps
            .extend(shadow_rounds.into_iter().map(of_shadow_rays));
        self.done = 0;
        let share = self.begin(stage, control);
        if share <= 0.0 {
            return false;
        }
        let scaled = |rays: usize| even(rays as f64 * share.min(1.0));
        for step in &mut self.steps {
            match &mut step.rays {
                Rays::Gather(rays) => *rays = scaled(*rays),
                Rays::Shadow(rays) => {
                    *rays = scaled(*rays);
                    let tallies = &self.tallies;
                    let few = |r: &u32| tallies[*r as usize].all_shadow_rays() < *rays;
                    step.receivers.retain(few);
                }
            }
        }
        self.work(lookup, stage, control)
    }

    /// Does what a checkpoint left of its round. False when `control` stops; there is then no going on.
    pub(super) fn go_on_after_checkpoint(
        &mut self,
        lookup: Option<&Lookup>,
        control: &mut dyn Control,
    ) -> bool {
        self.begin(Stage::Gathering, control) > 0.0 && self.work(lookup, Stage::Gathering, control)
    }

    /// Tells `control` what is due; the share of it that may be done.
    fn begin(&self, stage: Stage, control: &mut dyn Control) -> f64 {
        let count = self.receivers.len();
        let (mut cost, mut all_parts) = (0.0, 0);
        let mut done = self.done;
        for step in &self.steps {
            let left = step.receivers.len() - std::mem::take(&mut done);
            cost += left as f64
                * match step.rays {
                    Rays::Gather(rays) => gather_cost(rays, 0),
                    Rays::Shadow(rays) => gather_cost(0, rays),
                };
            all_parts += parts(left, count, step.rays.count());
        }
        control.begin(stage, cost, all_parts)
    }

    /// Does what is due.
    fn work(&mut self, lookup: Option<&Lookup>, stage: Stage, control: &mut dyn Control) -> bool {
        let (world, receivers) = (self.world, self.receivers);
        while let Some(step) = self.steps.first() {
            let rays = step.rays;
            let config = self.config_of(rays);
            let part = receivers_of_part(receivers.len(), rays.count());
            while self.done < self.steps[0].receivers.len() {
                let due = &self.steps[0].receivers[self.done..];
                let positions = &due[..part.min(due.len())];
                let lookup = lookup.filter(|_| config.rays > 0);
                let tallies = &mut self.tallies;
                add_part(world, lookup, None, receivers, positions, &config, tallies);
                self.done += positions.len();
                let goes_on = control.advance();
                // A pilot is made anew.
                if stage == Stage::Gathering {
                    control.keep(self.checkpoint());
                }
                if !goes_on {
                    return false;
                }
            }
            self.spent.rays += config.rays;
            self.steps.remove(0);
            self.done = 0;
        }
        let shadow_rays: usize = self.tallies.iter().map(Tally::all_shadow_rays).sum();
        self.spent.shadow_rays = shadow_rays.div_ceil(receivers.len().max(1));
        true
    }

    fn config_of(&self, rays: Rays) -> GatherConfig {
        let (gather_rays, shadow_rays) = match rays {
            Rays::Gather(rays) => (rays, 0),
            Rays::Shadow(rays) => (0, rays),
        };
        GatherConfig {
            rays: gather_rays,
            rays_before: self.spent.rays / self.gathers,
            shadow_rays,
            sky: SkyRays::Apart,
            gathers: self.gathers,
            solutions: Solutions::All,
            components: self.config.components,
            seed: self.config.seed,
        }
    }
}
