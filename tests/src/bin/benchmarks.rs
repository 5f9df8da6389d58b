//! Prints `BENCHMARKS.md`: how fast luxel is, with the error beside every time. Progress goes to stderr.
//!
//! Usage: `cargo run --release -p luxel-tests --bin benchmarks [-- RUNS] > BENCHMARKS.md`: runs of which
//! medians are taken, 5 without; about ten minutes on two cores that have nothing else to do.

use luxel_tests::benchmarks::document;
use luxel_tests::command::count_argument;

const RUNS: u64 = 5;

fn main() -> Result<(), String> {
    let runs = count_argument("runs", RUNS)?;
    print!("{}", document(runs, &mut |done| eprintln!("{done}")));
    Ok(())
}
