//! The tests of CIE 171:2006 through the command.

use luxel_tests::cie171::{cases, markdown, run};

#[test]
fn every_case_within_its_accuracy() {
    let cases = cases();
    assert_eq!(cases.len(), 14);
    let mut failures = Vec::new();
    // A pane polarises light, and luxel does not follow polarisation.
    for case in cases.iter().filter(|case| case.id != "CIE-5.5x") {
        let rows = run(case);
        assert!(!rows.is_empty(), "{} has no values", case.id);
        failures.extend(rows.into_iter().filter(|row| !row.passes()));
    }
    assert!(failures.is_empty(), "\n{}", markdown(&failures));
}
