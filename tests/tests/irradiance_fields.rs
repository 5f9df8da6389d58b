//! Direct light at points against closed forms.

use luxel_tests::builder::scene;
use luxel_tests::cases::irradiance_fields;
use luxel_tests::irradiance_fields::{points, setup};
use luxel_tests::probe::Probe;

/// Seeds over which means are taken where visibility or the sky is sampled.
const SEEDS: u64 = 5;

/// Number of points of all cases, which share the level of significance.
const POINTS: usize = 63;

#[test]
fn every_case_within_its_noise() {
    let cases = irradiance_fields();
    let count: usize = cases.iter().map(|case| case.receivers.len()).sum();
    assert_eq!(count, POINTS);
    let mut failures = Vec::new();
    for case in &cases {
        let setup = setup(case);
        // Relative to the brightest point of the case: dark ones see the same light.
        let brightest = case.values.iter().copied().fold(0.0, f64::max);
        let probe = Probe {
            scene: &scene("field", setup.parts),
            toml: &setup.toml,
            points: points(case),
            arguments: setup.arguments,
        };
        let outcome = probe.agree(&case.values, setup.relative * brightest, SEEDS, POINTS);
        failures.extend(
            outcome
                .err()
                .map(|error| format!("{} {}: {error}", case.id, case.title)),
        );
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
