//! What the verbs that print numbers print.

use super::{Folder, example, json, luxel};
use crate::cli::ExitCode;
use crate::image::Image;
use crate::image::exr::{Picture, encode};
use std::fs;

#[test]
fn solve_reports_objects_energy_and_a_mesh() {
    let folder = Folder::new();
    let mesh = folder.path("mesh.ply");
    let (exit, stdout, stderr) = luxel(&[
        "solve",
        &example("furnace"),
        "--json",
        "--patch-size",
        "whole",
        "-o",
        &mesh,
    ]);
    assert_eq!(exit, ExitCode::Ok, "{stderr}");
    let result = json(&stdout);
    assert_eq!(result["patches"], 192);
    let two_pi = 2.0 * std::f64::consts::PI;
    // Closed, M = π and ρ = 1/2: E = B = 2π everywhere, up to the tolerance of 1e-7.
    for quantity in ["radiosity", "irradiance"] {
        let value = result["objects"]["walls"][quantity][1].as_f64();
        let value = value.expect("a number");
        assert!((value / two_pi - 1.0).abs() < 1e-7, "{quantity}: {value}");
    }
    let energy = |key: &str| result["energy"][key][0].as_f64().expect("a number");
    let balance = energy("emitted") - energy("absorbed") - energy("escaped") - energy("residual");
    assert!(balance.abs() < 1e-9 * energy("emitted"), "{balance}");
    assert!(energy("escaped").abs() < 1e-9, "a closed scene");
    assert!(
        result["error"]["solver"]
            .as_f64()
            .is_some_and(|e| e <= 1e-7)
    );
    assert!(result["seconds"]["total"].is_number());
    let bytes = fs::read(mesh).expect("a mesh");
    assert!(bytes.starts_with(b"ply\n"));
    let (exit, stdout, _) = luxel(&["solve", &example("furnace"), "--rays", "16"]);
    assert_eq!(exit, ExitCode::Ok);
    assert!(stdout.contains("walls") && stdout.contains("escaped"));
}

#[test]
fn form_factors_of_a_cube_are_exact_closed_and_written() {
    let folder = Folder::new();
    let furnace = example("furnace");
    let npy = folder.path("f.npy");
    let (exit, stdout, stderr) = luxel(&["form-factors", &furnace, "--json", "-o", &npy]);
    assert_eq!(exit, ExitCode::Ok, "{stderr}");
    let result = json(&stdout);
    let objects = result["objects"].as_array().expect("a list");
    assert_eq!(objects.len(), 3);
    let place = |name: &str| objects.iter().position(|o| o == name).expect("an object");
    let (floor, ceiling) = (place("floor"), place("ceiling"));
    let number = |value: &serde_json::Value| value.as_f64().expect("a number");
    // Opposite faces of a cube (Howell C-11); 192 triangles of a relative accuracy of 1e-12 each.
    let opposite = number(&result["F"][floor][ceiling]);
    assert!(
        (opposite - 0.199_824_895_698_387_1).abs() < 1e-11,
        "{opposite}"
    );
    for row in 0..3 {
        assert!(
            (number(&result["row_sums"][row]) - 1.0).abs() < 1e-11,
            "row {row}"
        );
    }
    assert!(number(&result["reciprocity"]) < 1e-14);
    assert_eq!(number(&result["standard_error"][floor][ceiling]), 0.0);
    assert!(fs::read(npy).expect("a file").starts_with(b"\x93NUMPY"));

    let args = [
        "form-factors",
        &furnace,
        "--method",
        "raycast",
        "--json",
        "--rays",
        "65536",
    ];
    let (exit, stdout, stderr) = luxel(&args);
    assert_eq!(exit, ExitCode::Ok, "{stderr}");
    let cast = json(&stdout);
    let difference = number(&cast["F"][floor][ceiling]) - opposite;
    let error = number(&cast["standard_error"][floor][ceiling]);
    assert!(
        error > 0.0 && difference.abs() < 4.0 * error,
        "{difference} +- {error}"
    );
}

#[test]
fn every_estimator_and_solver_agrees_on_the_furnace() {
    let two_pi = 2.0 * std::f64::consts::PI;
    for (method, solver) in [
        ("analytic", "jacobi"),
        ("analytic", "gauss-seidel"),
        ("analytic", "direct"),
        ("raycast", "gauss-seidel"),
        ("hemicube", "gauss-seidel"),
    ] {
        let fineness = if method == "hemicube" {
            "--resolution"
        } else {
            "--rays"
        };
        let (exit, stdout, stderr) = luxel(&[
            "solve",
            &example("furnace"),
            "--json",
            "--patch-size",
            "whole",
            "--form-factors",
            method,
            "--solver",
            solver,
            fineness,
            "64",
        ]);
        assert_eq!(exit, ExitCode::Ok, "{stderr}");
        let result = json(&stdout);
        // Every row of either matrix sums to one, so that B = 2π up to the tolerance of 1e-7 and
        // the closure of the rows.
        let value = result["objects"]["floor"]["radiosity"][0].as_f64();
        let value = value.expect("a number");
        assert!(
            (value / two_pi - 1.0).abs() < 1e-7,
            "{method} {solver}: {value}"
        );
    }
}

#[test]
fn check_tells_notes_from_warnings() {
    let folder = Folder::new();
    let (exit, stdout, _) = luxel(&["check", &example("furnace"), "--strict"]);
    assert_eq!(
        (exit, stdout.as_str()),
        (ExitCode::Ok, "nothing suspicious\n")
    );
    let (exit, stdout, _) = luxel(&["check", &example("cornell"), "--strict", "--json"]);
    assert_eq!(exit, ExitCode::Ok, "an open front is a note");
    let result = json(&stdout);
    assert_eq!(result["warnings"], 0);
    assert!(result["notes"].as_u64().is_some_and(|notes| notes > 0));
    // The same square twice.
    let doubled = folder.write(
        "doubled.obj",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\nf 1 2 3 4\n",
    );
    let (exit, stdout, _) = luxel(&["check", &doubled, "--strict"]);
    assert_eq!(exit, ExitCode::LimitExceeded);
    assert!(stdout.contains("warning: "), "{stdout}");
}

#[test]
fn diff_measures_and_limits() {
    let folder = Folder::new();
    let write = |name: &str, width: usize, value: f32| {
        let picture = Picture {
            image: Image {
                width,
                height: 2,
                pixels: vec![[value; 3]; width * 2],
            },
            layers: vec![],
            origin: None,
        };
        folder.write(name, encode(&picture).expect("encodable"))
    };
    let one = write("one.exr", 2, 1.0);
    let more = write("more.exr", 2, 1.1);
    let wide = write("wide.exr", 3, 1.0);

    let (exit, stdout, _) = luxel(&["diff", &more, &one, "--json"]);
    assert_eq!(exit, ExitCode::Ok);
    let result = json(&stdout);
    // 10 % in f32, and the regulariser 0.01² in the relative form.
    let near = |key: &str, expected: f64| {
        let value = result[key].as_f64().expect("a number");
        assert!((value - expected).abs() < 1e-6, "{key}: {value}");
    };
    near("rmse", 0.1);
    near("rel_rmse", 0.1 / 1.0001_f64.sqrt());
    near("bias", 0.1);
    near("max", 0.1);

    let (exit, stdout, _) = luxel(&["diff", &more, &one, "--max-rel-rmse", "0.2"]);
    assert_eq!(exit, ExitCode::Ok);
    assert!(stdout.starts_with("RMSE"));
    let (exit, ..) = luxel(&["diff", &more, &one, "--max-rel-rmse", "0.05"]);
    assert_eq!(exit, ExitCode::LimitExceeded);
    let (exit, stdout, stderr) = luxel(&["diff", &wide, &one]);
    assert_eq!((exit, stdout.as_str()), (ExitCode::InvalidInput, ""));
    assert!(stderr.contains("3x2 against 2x2"));
    let (exit, _, stderr) = luxel(&["diff", "missing.exr", &one]);
    assert_eq!(exit, ExitCode::Failure);
    assert!(stderr.contains("missing.exr") && stderr.contains("because"));
}
