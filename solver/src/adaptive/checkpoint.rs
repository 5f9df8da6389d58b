//! Where adaptive work is, so that it can go on in another process.
//!
//! What has been gathered and what is due of the round in progress is kept; meshes, pilots and solutions are made anew,
//! because they follow from scene and settings alone. What goes on from a checkpoint therefore ends with the same bits
//! as what was never interrupted. Size: that of the tallies, some 750 bytes a receiver.

use super::budget::Budget;
use crate::gather::Tally;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// The state of [`super::irradiance`] between two parts of its work, for [`super::resume`]. It says nothing of the scene,
/// the receivers and the settings: whoever keeps it must see to it that they are the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint<'a> {
    pub(super) round: Round,
    /// What was spent in the rounds before and in those steps of this one that are complete.
    pub(super) spent: Budget,
    /// What is due in this round, from the step in progress on.
    pub(super) steps: Cow<'a, [Step]>,
    /// Receivers of the step in progress that have been gathered at.
    pub(super) done: usize,
    pub(super) tallies: Cow<'a, [Tally]>,
}

impl Checkpoint<'_> {
    /// Whether it can be of so many receivers.
    pub fn is_of(&self, receivers: usize) -> bool {
        let in_range = |step: &Step| step.receivers.iter().all(|&r| (r as usize) < receivers);
        let first = self.steps.first().map_or(0, |step| step.receivers.len());
        self.tallies.len() == receivers && self.steps.iter().all(in_range) && self.done <= first
    }
}

/// How far the rounds have come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(super) struct Round {
    /// Rounds before this one.
    pub(super) before: usize,
    /// Whether a finer mesh was due that memory did not allow.
    pub(super) is_held_back: bool,
}

/// Rays that are due at some receivers.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Step {
    pub(super) rays: Rays,
    /// Positions of the receivers.
    pub(super) receivers: Vec<u32>,
}

/// Rays of each receiver, over all gathers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Rays {
    /// Gather rays beside those that were cast before.
    Gather(usize),
    /// Shadow rays in the place of those that were cast before.
    Shadow(usize),
}

impl Rays {
    /// How many.
    pub(super) fn count(self) -> usize {
        match self {
            Self::Gather(rays) | Self::Shadow(rays) => rays,
        }
    }
}
