//! The convergence report, end to end on small scenes.

use super::{Folder, example, json, luxel};
use crate::cli::ExitCode;
use std::fs;

/// A report of one size of each method.
fn report(folder: &Folder, scene: &str, more: &[&str]) -> (ExitCode, String, String) {
    let out = folder.path("report.html");
    let args = ["converge", scene, "-o", &out, "--steps", "1"];
    luxel(&[&args[..], more].concat())
}

#[test]
fn a_report_is_one_page_that_needs_nothing_else() {
    let folder = Folder::new();
    let (exit, stdout, stderr) = report(&folder, &example("furnace"), &["--csv"]);
    assert_eq!(exit, ExitCode::Ok, "{stderr}");
    let (html, csv) = (folder.path("report.html"), folder.path("report.csv"));
    assert_eq!(stdout, format!("{html}\n{csv}\n"));
    assert_eq!(folder.names(), ["report.csv", "report.html"]);

    let page = fs::read_to_string(html).expect("a page");
    assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</html>\n"));
    for anchor in [
        "setup", "time", "size", "order", "honesty", "parts", "solvers", "physics", "pictures",
        "rows",
    ] {
        assert!(page.contains(&format!("id=\"{anchor}\"")), "{anchor}");
        assert!(page.contains(&format!("href=\"#{anchor}\"")), "{anchor}");
    }
    assert!(page.contains("The exact answer. The scene is a furnace"));
    for name in [
        "nRMSE",
        "relRMSE",
        "Jacobi",
        "Gauss–Seidel",
        "LU",
        "path tracer",
    ] {
        assert!(page.contains(name), "{name}");
    }
    assert!(page.matches("<svg").count() > 8 && page.matches("data:image/png;base64,").count() > 6);
    // The only addresses are names of SVG's own namespace; nothing is loaded.
    let addresses = page.matches("http").count();
    assert_eq!(
        addresses,
        page.matches("xmlns=\"http://www.w3.org/2000/svg\"").count()
    );
    for loader in ["<script", "<link", "<iframe", "@import", "url("] {
        assert!(!page.contains(loader), "{loader}");
    }
    // Every element that is opened is closed.
    for tag in [
        "section", "table", "tr", "td", "th", "figure", "svg", "div", "p", "span", "nav",
    ] {
        let opened =
            page.matches(&format!("<{tag}>")).count() + page.matches(&format!("<{tag} ")).count();
        assert_eq!(opened, page.matches(&format!("</{tag}>")).count(), "{tag}");
    }

    let table = fs::read_to_string(csv).expect("a table");
    let lines: Vec<&str> = table.lines().collect();
    assert!(lines[0].starts_with("method,solver,step,patches,rays,iterations,seconds"));
    for method in [
        "analytic",
        "hemicube",
        "raycast",
        "raycast-rows",
        "radiosity",
        "gather",
        "path",
    ] {
        let rows = lines
            .iter()
            .filter(|line| line.starts_with(&format!("{method},")));
        assert!(rows.count() >= 1, "{method}");
    }
}

#[test]
fn the_furnace_is_solved_by_all() {
    let folder = Folder::new();
    let (exit, stdout, stderr) = report(&folder, &example("furnace"), &["--json"]);
    assert_eq!(exit, ExitCode::Ok, "{stderr}");
    let value = json(&stdout);
    assert_eq!(value["reference"]["source"]["kind"], "exact");
    for family in value["families"].as_array().expect("families") {
        let rows = family["rows"].as_array().expect("rows");
        let last = rows.last().expect("at least one row");
        let error = last["error"]["nrmse"].as_f64().expect("a number");
        // The noisiest is the path tracer: four paths, whose length is geometric with ρ = 1/2 and which bring
        // L = 1 a vertex, so that E is off by √2 / 2 / √4 of itself at most; five such errors of 256 points.
        assert!(error < 0.36 * (1.0 + 5.0 / 256_f64.sqrt()), "{family:#}");
    }
}

#[test]
fn rows_depend_on_the_seed_and_not_on_threads() {
    let folder = Folder::new();
    let run = |more: &[&str]| {
        let more = [&["--json"][..], more].concat();
        let (exit, stdout, stderr) = report(&folder, &example("cornell"), &more);
        assert_eq!(exit, ExitCode::Ok, "{stderr}");
        let mut value = json(&stdout);
        timeless(&mut value);
        value.to_string()
    };
    let first = run(&["-j", "1"]);
    assert!(first == run(&["-j", "3"]));
    assert!(first != run(&["--seed", "1"]));
}

/// Removes what is not the same everywhere.
fn timeless(value: &mut serde_json::Value) {
    match value {
        serde_json::Value::Object(map) => {
            for key in ["seconds", "solver_seconds", "machine", "memory"] {
                map.remove(key);
            }
            map.values_mut().for_each(timeless);
        }
        serde_json::Value::Array(list) => list.iter_mut().for_each(timeless),
        _ => {}
    }
}

#[test]
fn names_from_files_are_escaped() {
    let folder = Folder::new();
    let name = "<b onload='x'>&";
    let obj = "mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
    folder.write("m.mtl", "newmtl m\nKd 0.5 0.5 0.5\nKe 1 1 1\n");
    let scene = folder.write(&format!("{name}.obj"), obj);
    let wall = "v 0 0 1\nv 0 1 1\nv 1 1 1\nv 1 0 1\nf 5 6 7 8\n";
    fs::write(&scene, format!("{obj}{wall}")).expect("a writable folder");
    let (exit, _, stderr) = report(&folder, &scene, &[]);
    assert_eq!(exit, ExitCode::Ok, "{stderr}");
    let page = fs::read_to_string(folder.path("report.html")).expect("a page");
    assert!(!page.contains("<b onload") && page.contains("&lt;b onload=&#39;x&#39;&gt;&amp;"));
    assert!(page.contains("The scene has no camera."));
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let folder = Folder::new();
    let cornell = example("cornell");
    let with = |reference: &str| {
        let (exit, stdout, stderr) = report(&folder, &cornell, &["--reference", reference]);
        assert_eq!(stdout, "");
        (exit, stderr)
    };
    let columns = folder.write("columns.csv", "x,y,z,nx,ny,nz\n0.2,0,0.2,0,1,0\n");
    let (exit, stderr) = with(&columns);
    assert_eq!(exit, ExitCode::InvalidInput);
    assert!(
        stderr.contains("columns.csv") && stderr.contains("e_r"),
        "{stderr}"
    );
    let header = "x,y,z,nx,ny,nz,e_r,e_g,e_b\n";
    let nan = folder.write("nan.csv", format!("{header}0.2,0,0.2,0,1,0,1,nan,1\n"));
    let (exit, stderr) = with(&nan);
    assert_eq!(exit, ExitCode::InvalidInput);
    assert!(stderr.contains("nan.csv, line 2"), "{stderr}");
    let black = folder.write("black.csv", format!("{header}0.2,0,0.2,0,1,0,0,0,0\n"));
    let (exit, stderr) = with(&black);
    assert_eq!(exit, ExitCode::InvalidInput, "{stderr}");

    let wide = folder.path("wide.exr");
    let (exit, ..) = luxel(&[
        "render", &cornell, "-o", &wide, "--size", "16x8", "--spp", "4",
    ]);
    assert_eq!(exit, ExitCode::Ok);
    let (exit, stderr) = with(&wide);
    assert_eq!(exit, ExitCode::InvalidInput);
    assert!(
        stderr.contains("wide.exr") && stderr.contains("16x8"),
        "{stderr}"
    );
    let (exit, stderr) = with(&folder.path("r.png"));
    assert_eq!(exit, ExitCode::Usage, "{stderr}");
    let (exit, stderr) = with(&folder.path("missing.csv"));
    assert_eq!(exit, ExitCode::Failure, "{stderr}");

    let (exit, _, stderr) = report(&folder, &folder.dark_scene(), &[]);
    assert_eq!(exit, ExitCode::NothingToDo, "{stderr}");
    let (exit, _, stderr) = luxel(&["converge", &cornell, "-o", &folder.path("no/r.html")]);
    assert_eq!(exit, ExitCode::Failure);
    assert!(stderr.contains("mkdir -p"), "{stderr}");
    let (exit, ..) = luxel(&["converge", &cornell, "-o", "report.txt"]);
    assert_eq!(exit, ExitCode::Usage);
    assert!(
        !folder.names().contains(&"report.html".to_owned()),
        "nothing half done"
    );
}

#[test]
fn pictures_and_tables_of_luxels_own_are_references() {
    let folder = Folder::new();
    let cornell = example("cornell");
    let picture = folder.path("r.exr");
    let args = ["render", &cornell, "-o", &picture, "--size", "16x16"];
    let (exit, _, stderr) = luxel(&[&args[..], &["--integrator", "path", "--spp", "64"]].concat());
    assert_eq!(exit, ExitCode::Ok, "{stderr}");
    let (exit, stdout, stderr) = report(&folder, &cornell, &["--reference", &picture, "--json"]);
    assert_eq!(exit, ExitCode::Ok, "{stderr}");
    let value = json(&stdout);
    assert_eq!(
        (&value["quantity"], &value["receivers"]),
        (&"radiance".into(), &256.into())
    );
    assert!(
        value["reference"]["noise"]
            .as_f64()
            .is_some_and(|noise| noise > 0.0)
    );

    let points = folder.write(
        "p.csv",
        "x,y,z,nx,ny,nz\n0.2,0,0.2,0,1,0\n0.3,0.2,0.1,0,1,0\n",
    );
    let table = folder.path("r.csv");
    let (exit, ..) = luxel(&["probe", &cornell, "--points", &points, "-o", &table]);
    assert_eq!(exit, ExitCode::Ok);
    let (exit, stdout, stderr) = report(&folder, &cornell, &["--reference", &table, "--json"]);
    assert_eq!(exit, ExitCode::Ok, "{stderr}");
    let value = json(&stdout);
    // The second point floats.
    assert_eq!(value["receivers"], 2);
    assert_eq!(value["receivers_on_surfaces"], 1);
}
