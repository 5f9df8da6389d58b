//! Prints `tests/ACCURACY.md`: how accurate luxel is, and how honest about it. Progress goes to
//! stderr.
//!
//! Usage: `cargo run --release -p luxel-tests --bin accuracy [-- SEEDS] > tests/ACCURACY.md`: seeds of
//! each scene and error, 40 without. A seed takes one to two minutes on two cores, most of it for the office at
//! 0.5 %; what does not depend on their number, five.

use luxel_tests::accuracy::document;
use luxel_tests::command::count_argument;

/// Seeds with which a share of 95 % of the runs can be told from 90 %.
const SEEDS: u64 = 40;

fn main() -> Result<(), String> {
    let seeds = count_argument("seeds", SEEDS)?;
    print!("{}", document(seeds, &mut |done| eprintln!("{done}")));
    Ok(())
}
