//! The same input and seed give the same bytes: at any number of threads, and every time.

use luxel_tests::command::{arg, luxel};
use luxel_tests::references::IrradianceReference;
use std::path::{Path, PathBuf};

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../scenes/data/{name}/{name}.toml"))
}

/// What a verb writes, byte by byte, and what it prints.
fn bytes(arguments: &[&str], output: &Path, threads: &str, seed: &str) -> (Vec<u8>, String) {
    let mut all = arguments.to_vec();
    all.extend(["-o", arg(output), "-j", threads, "--seed", seed]);
    let outcome = luxel(&all);
    outcome.assert_success();
    let written = std::fs::read(output).expect("an output");
    std::fs::remove_file(output).expect("an output");
    (written, outcome.stdout)
}

/// Asserts that a verb that writes `output` (a file name) is deterministic; `seeded` says that
/// another seed gives other bytes.
fn deterministic(arguments: &[&str], output: &str, seeded: bool) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = folder.path().join(output);
    let first = bytes(arguments, &output, "1", "3");
    for threads in ["1", "3"] {
        let again = bytes(arguments, &output, threads, "3");
        assert!(
            first.0 == again.0,
            "{arguments:?} differs at {threads} threads"
        );
    }
    if seeded {
        let other = bytes(arguments, &output, "2", "4");
        assert!(
            first.0 != other.0,
            "{arguments:?} does not depend on the seed"
        );
    }
}

#[test]
fn pictures() {
    // Odd sizes: tiles at the border are not whole.
    let cornell = example("cornell");
    for integrator in ["gather", "path", "radiosity", "whitted", "ao"] {
        let arguments = [
            "render",
            arg(&cornell),
            "--size",
            "19x11",
            "--spp",
            "2",
            "--integrator",
            integrator,
        ];
        deterministic(&arguments, "a.exr", integrator != "ao");
    }
}

#[test]
fn tables() {
    // Small objects that are clustered into patches, many lamps, several bounces.
    for scene in ["office", "corridor"] {
        let reference = IrradianceReference::load(scene);
        let csv = reference.points_csv();
        let folder = tempfile::tempdir().expect("a temporary folder");
        let points = folder.path().join("points.csv");
        let lines: Vec<&str> = csv.lines().take(40).collect();
        std::fs::write(&points, lines.join("\n")).expect("a writable folder");
        let path = example(scene);
        let probe = [
            "probe",
            arg(&path),
            "--points",
            arg(&points),
            "--rays",
            "64",
        ];
        deterministic(&probe, "a.csv", true);
    }
}

#[test]
fn solutions_and_form_factors() {
    let cornell = example("cornell");
    deterministic(&["solve", arg(&cornell), "--rays", "16"], "a.ply", true);
    // Patches and rays chosen from what was sampled.
    deterministic(&["solve", arg(&cornell), "--error", "6%"], "a.ply", true);
    let raycast = [
        "form-factors",
        arg(&cornell),
        "--method",
        "raycast",
        "--rays",
        "1000",
    ];
    deterministic(&raycast, "a.csv", true);
    deterministic(
        &["form-factors", arg(&cornell), "--method", "analytic"],
        "a.csv",
        false,
    );
}
