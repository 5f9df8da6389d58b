//! Prints `BENCHMARKS.md`: how fast luxel is, with the error beside every time. Progress goes to stderr.
//!
//! Usage: `cargo run --release -p luxel-tests --bin benchmarks [-- RUNS] > BENCHMARKS.md`: runs of which
//! medians are taken, 5 without; about five minutes on two cores that have nothing else to do.

use luxel_tests::benchmarks::document;

const RUNS: u64 = 5;

fn main() -> Result<(), String> {
    let runs = match std::env::args().nth(1) {
        None => RUNS,
        Some(text) => match text.parse() {
            Ok(runs) if runs > 0 => runs,
            _ => return Err(format!("{text:?} is no number of runs: 1, 2, 3, …")),
        },
    };
    print!("{}", document(runs, &mut |done| eprintln!("{done}")));
    Ok(())
}
