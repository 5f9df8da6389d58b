//! How fast luxel is, with the error beside every time: what `BENCHMARKS.md` tabulates.
//!
//! [`preparing`] reads large scenes and builds their ray trees; [`probing`], [`fields`] and [`rendering`] run the command on
//! the reference scenes, as a user would; [`transport`] casts form factors and sparse rows; [`scaling`] does the same work with one thread and with two. Times are
//! of this machine, now: medians of a few runs, reading the scene and building the tree included unless the
//! table says otherwise. Peak memory is that of the process, from the system (Linux).

mod document;
pub mod fields;
mod memory;
pub mod preparing;
pub mod probing;
pub mod rendering;
pub mod scaling;
pub mod transport;

pub use document::document;

use crate::accuracy::median;
use std::time::Instant;

/// Median seconds of some runs, the largest peak of memory among them, and what the last one gave.
fn measured<T>(runs: u64, mut run: impl FnMut(u64) -> T) -> (f64, Option<u64>, T) {
    let mut seconds = Vec::new();
    let mut last = None;
    memory::forget_peak();
    for k in 0..runs.max(1) {
        let start = Instant::now();
        last = Some(run(k));
        seconds.push(start.elapsed().as_secs_f64());
    }
    let last = last.expect("at least one run");
    (median(seconds), memory::peak(), last)
}
