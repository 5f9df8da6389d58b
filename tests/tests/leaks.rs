//! `luxel check` on rooms with and without gaps.

use glam::DVec3;
use luxel::cli::ExitCode;
use luxel_tests::builder::{Part, room, scene};
use luxel_tests::command::{Outcome, arg, luxel};
use luxel_tests::scene_files;

/// Checks a room of 4 × 5 × 3 m whose north wall stands `shift` metres too far out.
fn check(shift: f64, arguments: &[&str]) -> Outcome {
    let mut faces = room(DVec3::ZERO, DVec3::new(4.0, 5.0, 3.0));
    let mut north = faces.remove(3);
    for corner in &mut north {
        corner.y += shift;
    }
    let parts = [
        Part::lamp("walls", 1.0, faces),
        Part::grey("north", 0.5, vec![north]),
    ];
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = scene_files::write(&scene("room", parts), folder.path(), "");
    let mut all = vec!["check", arg(&file)];
    all.extend(arguments);
    luxel(&all)
}

#[test]
fn a_gap_is_named_and_strict_checks_fail() {
    let outcome = check(0.005, &["--strict", "--json"]);
    assert_eq!(outcome.exit, ExitCode::LimitExceeded);
    let json = outcome.json();
    let findings = json["findings"].as_array().expect("a list");
    let gaps: Vec<_> = findings.iter().filter(|f| f["kind"] == "gap").collect();
    assert_eq!(gaps.len(), 1, "{json}");
    let gap = gaps[0];
    assert_eq!(gap["severity"], "warning");
    let mut objects: Vec<&str> = gap["objects"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|object| object.as_str())
        .collect();
    objects.sort_unstable();
    assert_eq!(objects, ["north", "walls"]);
    // Between the wall and where it should be.
    let y = gap["position"][1].as_f64().expect("a position");
    assert!((y - 5.0025).abs() < 1e-6, "{y}");
    // 14 m of 5 mm in 94 m² of walls.
    let share = gap["fraction"].as_f64().expect("a fraction");
    assert!(
        (share / (14.0 * 0.005 / 94.0) - 1.0).abs() < 1e-4,
        "{share}"
    );
}

/// A millionth of the size is named, but shows in no result.
#[test]
fn a_hairline_is_a_note() {
    let outcome = check(5e-6, &["--strict"]);
    assert_eq!(outcome.exit, ExitCode::Ok, "{}", outcome.stdout);
    assert!(
        outcome.stdout.contains("note: light leaks to the outside"),
        "{}",
        outcome.stdout
    );
    assert!(outcome.stdout.contains("`north`"), "{}", outcome.stdout);
}

#[test]
fn a_closed_room_passes() {
    let outcome = check(0.0, &["--strict"]);
    assert_eq!(outcome.exit, ExitCode::Ok);
    assert_eq!(outcome.stdout.trim(), "nothing suspicious");
}
