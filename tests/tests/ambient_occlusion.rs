//! Ambient occlusion at points against closed forms.

use luxel_tests::cases::ambient_occlusion;
use luxel_tests::occlusion::{TOLERANCE, groups};
use luxel_tests::probe::Probe;

/// Seeds over which means are taken.
const SEEDS: u64 = 8;

#[test]
fn every_case_within_its_noise() {
    let cases = ambient_occlusion();
    let points = cases.iter().map(|case| case.points.len()).sum();
    let mut failures = Vec::new();
    for case in &cases {
        for mut group in groups(case) {
            let rays = ["--rays", "4096"].map(str::to_owned);
            group.arguments.extend(rays);
            let probe = Probe {
                scene: &group.scene,
                toml: "",
                points: group.points,
                arguments: group.arguments,
            };
            let outcome = probe.agree(&group.values, TOLERANCE, SEEDS, points);
            failures.extend(
                outcome
                    .err()
                    .map(|error| format!("{} {}: {error}", case.id, case.title)),
            );
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
