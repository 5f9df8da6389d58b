//! When to stop: at a stated error, after a time, or both.

use std::time::{Duration, Instant};

/// Error that is aimed at when neither an error nor a time is asked for.
const DEFAULT_ERROR: RelativeError = RelativeError(0.02);

/// The smallest error that can be asked for. Rays are f32: positions are known to 6e-8 of the scene,
/// and what grazes an edge is decided anew at that level; a hundred times that is still honest.
const SMALLEST_ERROR: f64 = 1e-5;

/// A relative root mean square error over the receivers, rms(x − x*) / mean(x*), above 0 and below 1.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(super) struct RelativeError(pub(super) f64);

/// What ends the refinement of a result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Goal {
    /// The estimated error to reach.
    pub(super) error: Option<RelativeError>,
    /// When to be done.
    deadline: Option<Deadline>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Deadline {
    started: Instant,
    time: Duration,
}

impl Goal {
    /// The goal of a run that began at `started`; [`DEFAULT_ERROR`] without any wish.
    pub(super) fn new(
        error: Option<RelativeError>,
        time: Option<Duration>,
        started: Instant,
    ) -> Self {
        Self {
            error: match time {
                Some(_) => error,
                None => Some(error.unwrap_or(DEFAULT_ERROR)),
            },
            deadline: time.map(|time| Deadline { started, time }),
        }
    }

    /// The same with another error to reach, where there is one.
    pub(super) fn with_error(&self, error: f64) -> Self {
        Self {
            error: self.error.map(|_| RelativeError(error)),
            ..*self
        }
    }

    /// The goal of the first `done` of several pieces of work that have to be finished in the same time.
    pub(super) fn part(&self, done: usize, of: usize) -> Self {
        let share = done as f64 / of as f64;
        let deadline = self.deadline.map(|deadline| Deadline {
            time: deadline.time.mul_f64(share),
            ..deadline
        });
        Self { deadline, ..*self }
    }

    /// Whether an estimated relative error is what was asked for. False for `NaN`, and without an
    /// error to reach.
    pub(super) fn is_met_by(&self, estimate: f64) -> bool {
        self.error.is_some_and(|target| estimate <= target.0)
    }

    /// Time left; `None` without a limit.
    pub(super) fn time_left(&self) -> Option<Duration> {
        let deadline = self.deadline?;
        Some(deadline.time.saturating_sub(deadline.started.elapsed()))
    }
}

/// Reads a percentage, the percent sign included.
pub(super) fn parse_error(text: &str) -> Result<RelativeError, String> {
    let number = text
        .strip_suffix('%')
        .ok_or("a percentage is needed, such as 1%")?;
    let percent: f64 = number
        .trim_end()
        .parse()
        .map_err(|_| "a percentage is needed, such as 1%")?;
    let error = percent / 100.0;
    if !(error > 0.0 && error < 1.0) {
        return Err("an error above 0% and below 100% is needed, such as 1%".into());
    }
    if error < SMALLEST_ERROR {
        return Err(format!(
            "rays are single-precision: no error below {}% can be stated",
            100.0 * SMALLEST_ERROR
        ));
    }
    Ok(RelativeError(error))
}

/// Reads a number with a unit of time.
pub(super) fn parse_time(text: &str) -> Result<Duration, String> {
    let help = || "a time above 0 with its unit is needed, such as 30s, 500ms, 5m or 1h".to_owned();
    let split = text
        .find(|c: char| c.is_ascii_alphabetic())
        .ok_or_else(help)?;
    let (number, unit) = text.split_at(split);
    let seconds = match unit {
        "ms" => 1e-3,
        "s" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => return Err(help()),
    };
    let number: f64 = number.trim_end().parse().map_err(|_| help())?;
    if number.is_nan() || number <= 0.0 {
        return Err(help());
    }
    Duration::try_from_secs_f64(number * seconds).map_err(|_| help())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_percentages() {
        assert_eq!(parse_error("1%"), Ok(RelativeError(0.01)));
        assert_eq!(parse_error("0.5 %"), Ok(RelativeError(0.005)));
        for bad in [
            "", "%", "1", "0%", "-1%", "100%", "NaN%", "inf%", "0.0001%", "x%",
        ] {
            assert!(parse_error(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn times_have_units() {
        assert_eq!(parse_time("500ms"), Ok(Duration::from_millis(500)));
        assert_eq!(parse_time("1.5m"), Ok(Duration::from_secs(90)));
        for bad in [
            "", "s", "3", "0s", "-1s", "NaNs", "infs", "1d", "1e300h", "1 2s",
        ] {
            assert!(parse_time(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn an_error_is_aimed_at_unless_only_time_counts() {
        let started = Instant::now();
        let hour = Duration::from_secs(3600);
        assert!(Goal::new(None, None, started).is_met_by(0.02));
        assert!(!Goal::new(None, None, started).is_met_by(f64::NAN));
        let timed = Goal::new(None, Some(hour), started);
        assert!(!timed.is_met_by(0.0) && timed.time_left() <= Some(hour));
        let both = Goal::new(Some(RelativeError(0.5)), Some(hour), started);
        assert!(both.is_met_by(0.5) && both.time_left() <= Some(hour));
        assert_eq!(Goal::new(None, None, started).time_left(), None);
        // A third of the time for the first of three, all of it for the last, and the same error.
        let [third, all] = [1, 3].map(|done| both.part(done, 3));
        assert!(third.time_left() <= Some(hour / 3) && third.is_met_by(0.5));
        assert_eq!(all.deadline, both.deadline);
    }
}
