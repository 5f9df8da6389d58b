//! How much is measured, and when a method has had enough.

use super::family::Family;
use super::reference::Effort;
use std::time::Instant;

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Budget {
    /// As many sizes as fit into about these seconds, everything included. How many rows there are
    /// depends on the machine.
    Seconds(f64),
    /// This many sizes of each family, however long they take: the same rows everywhere.
    Steps(u32),
}

/// Share of the time for luxel's own reference.
const REFERENCE_SHARE: f64 = 0.25;

/// Share of the time for false-colour pictures, and for the reference that they need.
const PICTURE_SHARE: f64 = 0.15;

impl Budget {
    /// The effort of luxel's own reference.
    pub fn reference(self) -> Effort {
        match self {
            Self::Seconds(seconds) => Effort::Seconds(REFERENCE_SHARE * seconds),
            // Sixteen times the longest run of the path tracer.
            Self::Steps(steps) => Effort::Paths(path_rays(steps + 1)),
        }
    }

    /// The effort of the reference of false-colour pictures.
    pub(super) fn pictures(self) -> Effort {
        match self {
            Self::Seconds(seconds) => Effort::Seconds(PICTURE_SHARE * seconds),
            Self::Steps(steps) => Effort::Paths(path_rays(steps).min(256)),
        }
    }
}

/// Paths of a receiver in a step of the path tracer.
pub(super) fn path_rays(step: u32) -> usize {
    4 << (2 * step)
}

/// Gather rays of a receiver in a step of the final gather.
pub(super) fn gather_rays(step: u32) -> usize {
    16 << (2 * step)
}

/// Says when a family has had enough.
pub(super) struct Clock {
    started: Instant,
    share: Option<f64>,
    steps: u32,
}

/// Why a family stops before its largest size.
pub(super) enum Stop {
    /// As many sizes are done as were asked for.
    Steps,
    /// The next size would take `next` seconds, more than is left of `share`.
    Time { next: f64, share: f64 },
}

impl Clock {
    /// For the `index`-th family, `elapsed` seconds into the work: its share of the time that is left.
    pub(super) fn new(budget: Budget, elapsed: f64, index: usize) -> Self {
        let weights: f64 = Family::ALL[index..].iter().map(|f| f.weight()).sum();
        let (share, steps) = match budget {
            Budget::Steps(steps) => (None, steps),
            Budget::Seconds(seconds) => {
                let left = seconds * (1.0 - PICTURE_SHARE) - elapsed;
                let share = left.max(0.0) * Family::ALL[index].weight() / weights;
                (Some(share), u32::MAX)
            }
        };
        Self {
            started: Instant::now(),
            share,
            steps,
        }
    }

    /// Most sizes of a family.
    pub(super) fn max_steps(&self, family: Family) -> u32 {
        self.steps.min(family.max_steps())
    }

    /// Whether a next step that takes about `next` seconds fits.
    pub(super) fn allows(&self, step: u32, next: f64) -> Result<(), Stop> {
        if step >= self.steps {
            return Err(Stop::Steps);
        }
        match self.share {
            Some(share) if self.started.elapsed().as_secs_f64() + next > share => {
                Err(Stop::Time { next, share })
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_of_steps_does_not_know_the_time() {
        let clock = Clock::new(Budget::Steps(2), 1e9, 0);
        assert!(clock.allows(1, 1e9).is_ok());
        assert!(matches!(clock.allows(2, 0.0), Err(Stop::Steps)));
        assert_eq!(clock.max_steps(Family::Path), 2);
    }

    #[test]
    fn what_families_leave_goes_to_those_after_them() {
        let share = |elapsed, index| Clock::new(Budget::Seconds(100.0), elapsed, index).share;
        let last = Family::ALL.len() - 1;
        // The pictures keep their part.
        assert_eq!(share(45.0, last), Some(40.0));
        assert!(share(0.0, 0) < share(0.0, last));
        assert_eq!(share(200.0, 0), Some(0.0), "late, but no longer");
        let late = Clock::new(Budget::Seconds(100.0), 90.0, 0);
        assert!(matches!(late.allows(1, 1.0), Err(Stop::Time { .. })));
    }
}
