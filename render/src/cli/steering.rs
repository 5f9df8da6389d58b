//! Steers refinement: shows its progress, and ends it at the goal, when time is up, or on an
//! interrupt.

use super::Context;
use super::checkpoint::{Current, Keeper};
use super::goal::Goal;
use super::interrupt::{Interrupt, Listening};
use super::refine::Refined;
use super::reporter::Reporter;
use crate::progress::Progress;
use luxel_solver::adaptive::{Checkpoint, Control, Stage};
use luxel_solver::gather::ErrorParts;
use std::time::{Duration, Instant};

/// The estimate of a film or a mesh is known to a tenth or so (its noise comes from four replicates, its mesh
/// part from one difference), and counts as reached when it is this factor better than asked for. Smaller, and
/// more than one run in twenty is worse than asked for; larger, and all pay for it.
pub(super) const CONFIDENCE: f64 = 1.1;

/// The error that is planned for first when time is limited: what it takes is had in a moment.
const FIRST_ERROR: f64 = 0.05;

/// The error to plan for first. Under a limit of time a rough result comes before a good one.
pub(super) fn first_error(goal: Option<&Goal>) -> f64 {
    let error = goal.and_then(|goal| goal.error).map(|error| error.0);
    let timed = goal.is_some_and(|goal| goal.time_left().is_some());
    match error {
        Some(error) if !timed => error,
        _ => error.unwrap_or(FIRST_ERROR).max(FIRST_ERROR),
    }
}

/// Work is not begun when less than this share of it fits into the time left: its results would not
/// be worth the wait. The first result is worth it anyhow.
const LEAST_SHARE: f64 = 0.05;

/// The name of a stage with the error so far and the one that is aimed at.
pub(super) fn stage(name: &str, estimate: Option<f64>, goal: Option<&Goal>) -> String {
    match (estimate, goal.and_then(|goal| goal.error)) {
        (Some(now), Some(aim)) => format!("{name} ({:.2} % → {} %)", 100.0 * now, 100.0 * aim.0),
        (Some(now), None) => format!("{name} ({:.2} %)", 100.0 * now),
        (None, _) => name.to_owned(),
    }
}

/// A control with a goal.
pub(super) struct Steering<'a, 'r> {
    reporter: &'a Reporter<'r>,
    interrupt: &'a Interrupt,
    goal: Option<&'a Goal>,
    /// Work done, in units of cost, and the time that it took.
    done: (f64, Duration),
    current: Option<(f64, Instant)>,
    estimate: Option<f64>,
    keeper: Option<&'a Keeper<'a, 'r>>,
    _listening: Listening,
}

impl<'a, 'r> Steering<'a, 'r> {
    /// A control that ends at `goal`; without one at the first complete result.
    pub(super) fn new(context: &'a Context<'r>, goal: Option<&'a Goal>) -> Self {
        Self {
            reporter: &context.reporter,
            interrupt: &context.interrupt,
            goal,
            done: (0.0, Duration::ZERO),
            current: None,
            estimate: None,
            keeper: None,
            _listening: context.interrupt.listen(),
        }
    }

    /// The same, with checkpoints.
    pub(super) fn keeping(self, keeper: &'a Keeper<'a, 'r>) -> Self {
        let keeper = Some(keeper);
        Self { keeper, ..self }
    }

    /// A piece of a film has been exposed.
    pub(super) fn keep_film(&self, refined: Refined<'_>) {
        if let Some(keeper) = self.keeper {
            keeper.keep(Current::Film(refined));
        }
    }

    /// How long work should take at the pace so far; `None` when nothing is known.
    fn expected(&self, cost: f64) -> Option<Duration> {
        (self.done.0 > 0.0).then(|| self.done.1.mul_f64(cost / self.done.0))
    }

    /// What was begun is complete.
    fn settle(&mut self) {
        if let Some((cost, started)) = self.current.take() {
            self.done.0 += cost;
            self.done.1 += started.elapsed();
            self.reporter.finish();
        }
    }

    /// The share of work that may be done.
    pub(super) fn allow(&mut self, cost: f64) -> f64 {
        self.settle();
        if self.interrupt.is_set() {
            return 0.0;
        }
        let left = self.goal.and_then(Goal::time_left);
        let (Some(left), Some(expected)) = (left, self.expected(cost)) else {
            return 1.0;
        };
        let share = left.as_secs_f64() / expected.as_secs_f64();
        if share >= 1.0 {
            1.0
        } else if self.estimate.is_none() {
            share.max(LEAST_SHARE)
        } else if share < LEAST_SHARE {
            0.0
        } else {
            share
        }
    }

    /// Work begins.
    pub(super) fn start(&mut self, name: &str, cost: f64, parts: usize) {
        let name = stage(name, self.estimate, self.goal);
        self.reporter.start(&name, parts as u64);
        self.current = Some((cost, Instant::now()));
    }

    /// Whether to end at once: an interrupt, or no time left for anything.
    pub(super) fn must_stop(&self) -> bool {
        self.interrupt.is_set()
            || (self.estimate.is_some()
                && self
                    .goal
                    .is_some_and(|goal| goal.time_left() == Some(Duration::ZERO)))
    }

    /// Progress of a piece of what was started.
    pub(super) fn piece(&self) -> Piece<'a, 'r> {
        Piece(self.reporter)
    }

    /// A complete result has this relative error. True when it suits.
    pub(super) fn judge(&mut self, error: f64) -> bool {
        self.settle();
        self.estimate = Some(error);
        self.goal
            .is_none_or(|goal| goal.is_met_by(CONFIDENCE * error))
    }
}

impl Control for Steering<'_, '_> {
    fn begin(&mut self, what: Stage, cost: f64, parts: usize) -> f64 {
        let share = self.allow(cost);
        let name = match what {
            Stage::Solving => "solving radiosity",
            Stage::Pilot => "choosing the budget",
            Stage::Gathering => "gathering",
        };
        // A solution cannot be had in part. The first one must be.
        let share = match what {
            Stage::Solving | Stage::Pilot if self.estimate.is_none() && share > 0.0 => 1.0,
            _ => share,
        };
        if share > 0.0 {
            self.start(name, cost * share, parts);
        }
        share
    }

    fn advance(&mut self) -> bool {
        self.reporter.advance(1);
        !self.interrupt.is_set()
    }

    fn suits(&mut self, parts: &ErrorParts) -> bool {
        self.settle();
        self.estimate = Some(parts.total());
        self.goal.is_none_or(|goal| goal.is_met_by(parts.upper()))
    }

    fn keep(&mut self, checkpoint: Checkpoint<'_>) {
        if let Some(keeper) = self.keeper {
            keeper.keep(Current::Gather(checkpoint));
        }
    }
}

/// Progress of a piece of a stage, which neither begins nor ends it.
pub(super) struct Piece<'a, 'r>(&'a Reporter<'r>);

impl Progress for Piece<'_, '_> {
    fn start(&self, _stage: &str, _total: u64) {}

    fn advance(&self, samples: u64) {
        self.0.advance(samples);
    }

    fn finish(&self) {}
}
