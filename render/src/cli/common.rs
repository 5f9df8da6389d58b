//! Options that every verb takes.

use super::goal::{Goal, RelativeError};
use super::memory::MemoryLimit;
use clap::ValueEnum;
use std::num::NonZeroUsize;
use std::time::{Duration, Instant};

/// Options that every verb takes, before or after its name. Verbs that do not sample ignore seed, error
/// and time, so that scripts can pass the same options to all.
#[derive(clap::Args, Clone, Debug)]
#[command(next_help_heading = "Common options")]
pub(super) struct Common {
    /// Seed of all randomness: the same input and seed give the same bytes
    #[arg(long, global = true, value_name = "N", default_value_t = 0)]
    pub(super) seed: u64,

    /// Relative error to reach, root mean square over mean of the receivers [default: 2%]
    #[arg(long, global = true, value_name = "P%", value_parser = super::goal::parse_error, allow_hyphen_values = true)]
    pub(super) error: Option<RelativeError>,

    /// Time to spend, such as 30s: the smallest error that can be reached in it
    #[arg(long, global = true, value_name = "T", value_parser = super::goal::parse_time, allow_hyphen_values = true)]
    pub(super) time: Option<Duration>,

    /// Memory that may be held, such as 4G or 512M: what needs more is refused before it begins, and no result is
    /// refined beyond it [default: no limit]
    #[arg(long, global = true, value_name = "M", value_parser = super::memory::parse_memory, allow_hyphen_values = true)]
    pub(super) max_memory: Option<MemoryLimit>,

    /// Number of threads [default: all cores]; does not change results
    #[arg(short = 'j', long, global = true, value_name = "N")]
    pub(super) jobs: Option<NonZeroUsize>,

    /// How progress is shown on stderr
    #[arg(
        long,
        global = true,
        value_enum,
        value_name = "HOW",
        default_value = "auto"
    )]
    pub(super) progress: ProgressMode,

    /// Print results as JSON
    #[arg(long, global = true)]
    pub(super) json: bool,

    /// Tell more on stderr
    #[arg(short, long, global = true, conflicts_with = "quiet")]
    pub(super) verbose: bool,

    /// Tell nothing but errors on stderr
    #[arg(short, long, global = true)]
    pub(super) quiet: bool,
}

/// How progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum ProgressMode {
    /// A bar on a terminal, plain lines otherwise
    Auto,
    /// A bar with the time left (plain lines when stderr is no terminal)
    Bar,
    /// A line of text every few seconds
    Plain,
    /// A line of JSON twice a second
    Json,
    /// Nothing
    None,
}

impl Common {
    /// What was asked for, by a run that began at `started`.
    pub(super) fn goal(&self, started: Instant) -> Goal {
        Goal::new(self.error, self.time, started)
    }

    /// Runs `work` on a thread pool of the requested size.
    ///
    /// # Errors
    /// When the system gives no threads.
    pub(super) fn install<T: Send>(
        &self,
        work: impl FnOnce() -> T + Send,
    ) -> Result<T, rayon::ThreadPoolBuildError> {
        let threads = self.jobs.map_or(0, NonZeroUsize::get);
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()?;
        Ok(pool.install(work))
    }
}
