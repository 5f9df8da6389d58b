//! Prints, as a Markdown table, how far luxel is from the exact values of the tests of CIE 171:2006.
//!
//! Usage: `cargo run --release -p luxel-tests --bin cie171 [-- CASE ...]`.

use luxel_tests::cie171::{Row, cases, markdown, run};

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let rows: Vec<Row> = cases()
        .iter()
        .filter(|case| wanted.is_empty() || wanted.contains(&case.id))
        .flat_map(run)
        .collect();
    print!("{}", markdown(&rows));
}
