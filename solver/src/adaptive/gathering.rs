//! Receivers with what has been gathered at them, round after round: gather rays are added to those that
//! were cast, shadow rays are cast anew.

use super::budget::JOINED_FROM;
use super::{Adaptive, AdaptiveConfig, Budget, Control, Ending, Stage};
use crate::gather::{
    GatherConfig, Key, Lookup, MAX_REPLICATES, SkyRays, Solutions, Tally, error_parts, gather,
    joined,
};
use crate::world::{Receiver, World};

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

/// Receivers of a part of a gather of so many rays at each.
pub(super) fn receivers_of_part(receivers: usize, rays: usize) -> usize {
    (receivers / PARTS).max(RAYS_OF_PART / rays.max(1)).max(1)
}

/// Gathers at all receivers, each an item of its own, `part` of them between two words of the control; `None`
/// when that stops.
pub(super) fn gather_in_parts(
    world: &World,
    lookup: Option<&Lookup>,
    receivers: &[Receiver],
    part: usize,
    config: &GatherConfig,
    control: &mut dyn Control,
) -> Option<Vec<Tally>> {
    let mut tallies = Vec::with_capacity(receivers.len());
    for receivers in receivers.chunks(part) {
        let first = tallies.len() as u64;
        let keys: Vec<Key> = (first..first + receivers.len() as u64)
            .map(Key::of)
            .collect();
        tallies.extend(gather(world, lookup, receivers, &keys, config));
        if !control.advance() {
            return None;
        }
    }
    Some(tallies)
}

/// Receivers with what has been gathered at them.
pub(super) struct Gathering<'a> {
    world: &'a World<'a>,
    receivers: &'a [Receiver],
    gathers: usize,
    config: AdaptiveConfig,
    pub(super) tallies: Vec<Tally>,
    pub(super) spent: Budget,
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
            tallies: vec![Tally::default(); receivers.len()],
            spent: Budget::default(),
        }
    }

    /// What there is now.
    pub(super) fn state(&self, lookup: Option<&Lookup>) -> Adaptive {
        let tallies = if self.receivers.len() >= JOINED_FROM {
            joined(self.receivers, &self.tallies)
        } else {
            self.tallies.clone()
        };
        Adaptive {
            parts: error_parts(&tallies),
            tallies,
            solver_bound: lookup.map_or(0.0, Lookup::solver_bound),
            budget: self.spent,
            patches: lookup.map_or(0, |lookup| lookup.patches().len()),
            ending: Ending::Stopped,
        }
    }

    /// Gathers what is missing from what was spent to `budget`: gather rays are added, shadow rays
    /// cast anew. False when `control` stops; the tallies are then as they were.
    pub(super) fn go_on(
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
        let part = receivers_of_part(self.receivers.len(), round.rays + round.shadow_rays);
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
        let gathered = gather_in_parts(self.world, lookup, self.receivers, part, &config, control);
        let Some(tallies) = gathered else {
            return false;
        };
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
