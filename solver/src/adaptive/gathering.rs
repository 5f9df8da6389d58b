//! Receivers with what has been gathered at them, round after round: gather rays are added to those that
//! were cast, shadow rays are cast anew where more are due.

use super::budget::{JOINED_FROM, even, gather_cost};
use super::penumbrae::Penumbrae;
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

/// Receivers of a part, unless there are more than this times [`PARTS`]: what is gathered at them is held beside what was
/// gathered before.
const RECEIVERS_OF_PART: usize = 1 << 13;

/// Receivers of a part of a gather of so many rays at each.
fn receivers_of_part(receivers: usize, rays: usize) -> usize {
    let of_rays = (RAYS_OF_PART / rays.max(1)).min(RECEIVERS_OF_PART);
    (receivers / PARTS).max(of_rays).max(1)
}

/// Gathers at some receivers, each an item of its own, and joins what that found to their tallies, part after part.
/// False when `control` stops; some parts are then joined and some not.
pub(super) fn add(
    world: &World,
    lookup: Option<&Lookup>,
    receivers: &[Receiver],
    positions: &[u32],
    config: &GatherConfig,
    tallies: &mut [Tally],
    control: &mut dyn Control,
) -> bool {
    let part = receivers_of_part(receivers.len(), config.rays + config.shadow_rays);
    for positions in positions.chunks(part) {
        let of_part = positions
            .iter()
            .map(|&position| receivers[position as usize]);
        let of_part: Vec<Receiver> = of_part.collect();
        let keys = positions.iter().map(|&position| Key::of(position.into()));
        let keys: Vec<Key> = keys.collect();
        let found = gather(world, lookup, &of_part, &keys, config);
        for (&position, more) in positions.iter().zip(&found) {
            tallies[position as usize].join(more);
        }
        if !control.advance() {
            return false;
        }
    }
    true
}

/// Number of parts in which [`add`] gathers so many of all receivers, with so many rays each.
pub(super) fn parts(some: usize, all: usize, rays: usize) -> usize {
    some.div_ceil(receivers_of_part(all, rays))
}

/// The positions of so many receivers.
pub(super) fn all(receivers: usize) -> Vec<u32> {
    (0..receivers as u32).collect()
}

/// Receivers, by position, that get so many shadow rays.
pub(super) type ShadowRound = (usize, Vec<u32>);

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
        let further = rays - self.spent.rays;
        let count = self.receivers.len();
        let mut cost = count as f64 * gather_cost(further, 0);
        let mut all_parts = parts(count, count, further);
        for (rays, receivers) in &shadow_rounds {
            cost += receivers.len() as f64 * gather_cost(0, *rays);
            all_parts += parts(receivers.len(), count, *rays);
        }
        let share = control.begin(stage, cost, all_parts);
        if share <= 0.0 {
            return false;
        }
        let scaled = |rays: usize| even(rays as f64 * share.min(1.0));
        let of_rays = GatherConfig {
            rays: scaled(further),
            rays_before: self.spent.rays / self.gathers,
            shadow_rays: 0,
            sky: SkyRays::Apart,
            gathers: self.gathers,
            solutions: Solutions::All,
            components: self.config.components,
            seed: self.config.seed,
        };
        let mut goes_on = self.add(lookup, &all(count), &of_rays, control);
        for (rays, mut receivers) in shadow_rounds {
            let of_shadow_rays = GatherConfig {
                rays: 0,
                shadow_rays: scaled(rays),
                ..of_rays
            };
            receivers.retain(|&r| self.tallies[r as usize].all_shadow_rays() < scaled(rays));
            goes_on = goes_on && self.add(None, &receivers, &of_shadow_rays, control);
        }
        let shadow_rays: usize = self.tallies.iter().map(Tally::all_shadow_rays).sum();
        self.spent.rays += of_rays.rays;
        self.spent.shadow_rays = shadow_rays.div_ceil(count.max(1));
        goes_on
    }

    fn add(
        &mut self,
        lookup: Option<&Lookup>,
        positions: &[u32],
        config: &GatherConfig,
        control: &mut dyn Control,
    ) -> bool {
        let (world, receivers) = (self.world, self.receivers);
        add(
            world,
            lookup,
            receivers,
            positions,
            config,
            &mut self.tallies,
            control,
        )
    }
}
