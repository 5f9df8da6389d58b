//! Indirect light on the planes of many receivers, to a stated error: few rays a receiver, joined.
//!
//! All receivers are gathered with few rays, joined ([`IndirectField`]), and what noise is left is measured; rays
//! are added until it suits. The noise of n rays at each receiver falls as n^−0.4 where there are many, because cells
//! shrink as it does, and as n^−1 where the first few show a shape. Gather rays are kept; their sequences go on.
//!
//! A picture's other noise, that of its samples, must fit beside that of the field, and both are cheapest when the
//! costlier one has the larger share: where many rays are due, a larger error suits.

use super::gathering::{add, parts};
use super::{Control, Stage};
use crate::gather::{
    Components, GatherConfig, Guides, IndirectField, Lookup, MAX_REPLICATES, SkyRays, Solutions,
    Tally,
};
use crate::world::{Receiver, World};
use luxel_scenes::Rgb;

/// Rays of each gather of a receiver that are begun with.
const FIRST_RAYS: usize = 2;

/// Most rays of each gather of a receiver.
const MOST_RAYS: usize = 1 << 12;

/// Rays of each gather that are many: more than a picture's samples cost.
const MANY_RAYS: usize = 32;

/// The error that suits when so many were cast, over the one asked for: with four fifths of a picture's error in
/// place of half, its samples cost twice as much and a field a third.
const MANY_ERROR: f64 = 1.6;

/// How the noise of joined gathers falls with their rays, few and many.
const EXPONENT: f64 = 0.6;
const EXPONENT_OF_MANY: f64 = 0.4;

/// The smallest and the largest growth of the rays in a round.
const GROWTH: [f64; 2] = [1.5, 4.0];

/// Receivers at which noise is measured.
const MEASURED: usize = 1 << 11;

/// Receivers gathered so far.
pub struct FieldGather<'a> {
    world: &'a World<'a>,
    lookup: &'a Lookup,
    receivers: &'a [Receiver],
    guides: Guides,
    tallies: Vec<Tally>,
    /// Rays of each gather so far.
    rays: usize,
    seed: u64,
}

impl<'a> FieldGather<'a> {
    /// Nothing gathered yet; receivers have found out where their light comes from.
    pub fn new(
        world: &'a World<'a>,
        lookup: &'a Lookup,
        receivers: &'a [Receiver],
        seed: u64,
    ) -> Self {
        Self {
            world,
            lookup,
            receivers,
            guides: Guides::learn(world, lookup, receivers, seed),
            tallies: vec![Tally::default(); receivers.len()],
            rays: 0,
            seed,
        }
    }

    /// Gathers until the noise of the field, the irradiance of each receiver times its weight, root mean square
    /// over receivers and channels, is below `error`, or somewhat above it where that takes many rays, or as far as it goes. `None` when `control` stops before
    /// there is a field.
    ///
    /// # Panics
    /// When there is not one weight for each receiver.
    pub fn until(
        mut self,
        error: f64,
        weights: &[Rgb],
        control: &mut dyn Control,
    ) -> Option<IndirectField> {
        assert_eq!(weights.len(), self.receivers.len(), "a weight a receiver");
        let mut field = None;
        let mut further = FIRST_RAYS;
        let stride = self.receivers.len().div_ceil(MEASURED).max(1);
        let measured: Vec<Receiver> = self.receivers.iter().copied().step_by(stride).collect();
        let weights: Vec<Rgb> = weights.iter().copied().step_by(stride).collect();
        while self.add(further, control) {
            let found = IndirectField::new(self.receivers, &self.tallies);
            let reached = found.gather_noise(&measured, &weights);
            field = Some(found);
            let (aim, exponent) = if self.rays < MANY_RAYS {
                (error, EXPONENT)
            } else {
                (MANY_ERROR * error, EXPONENT_OF_MANY)
            };
            if reached <= aim || self.rays >= MOST_RAYS {
                break;
            }
            let growth = (reached / aim)
                .powf(1.0 / exponent)
                .clamp(GROWTH[0], GROWTH[1]);
            let rays = (growth * self.rays as f64).ceil() as usize;
            further = rays.min(MOST_RAYS) - self.rays;
        }
        field
    }

    /// Adds rays to each gather of all receivers. False when `control` stops; there is then no going on.
    fn add(&mut self, rays: usize, control: &mut dyn Control) -> bool {
        let all_rays = rays * MAX_REPLICATES;
        let cost = (all_rays * self.receivers.len()) as f64;
        let count = self.receivers.len();
        if control.begin(Stage::Gathering, cost, parts(count, count, all_rays)) < 1.0 {
            return false;
        }
        let config = GatherConfig {
            rays: all_rays,
            rays_before: self.rays,
            shadow_rays: 0,
            sky: SkyRays::Gather,
            gathers: MAX_REPLICATES,
            solutions: Solutions::All,
            components: Components::All,
            seed: self.seed,
        };
        self.rays += rays;
        let (world, lookup, guides) = (self.world, Some(self.lookup), Some(&self.guides));
        let (receivers, tallies) = (self.receivers, &mut self.tallies);
        add(world, lookup, guides, receivers, &config, tallies, control)
    }
}
