//! `luxel probe --error` at the thousand points of the reference scenes.

use super::measured;
use crate::accuracy::median;
use crate::accuracy::scenes::{Run, reference, run};

/// What is asked for.
pub const TARGETS: [(&str, f64); 6] = [
    ("cornell", 1.0),
    ("corridor", 1.0),
    ("office", 1.0),
    ("cornell", 0.5),
    ("corridor", 0.5),
    ("office", 0.5),
];

/// Runs of a scene and an error, each with a seed of its own.
#[derive(Clone, Debug)]
pub struct Probe {
    /// Seconds of a run, the median.
    pub seconds: f64,
    /// Peak memory in bytes.
    pub peak: Option<u64>,
    /// The runs.
    pub runs: Vec<Run>,
}

/// Probes a scene `runs` times for an error of `percent`.
///
/// # Panics
/// As [`run`].
pub fn probe(scene: &str, percent: f64, runs: u64) -> Probe {
    let reference = reference(scene);
    let mut done = Vec::new();
    let (_, peak, ()) = measured(runs, |seed| done.push(run(&reference, percent, seed)));
    // The command's own clock: what scores a run against the reference is not its work.
    Probe {
        seconds: median(done.iter().map(|run| run.seconds)),
        peak,
        runs: done,
    }
}
