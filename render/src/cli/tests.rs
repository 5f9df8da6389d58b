//! The command from its arguments to its exit code, stdout, stderr and files.

use super::*;
use crate::image::exr::{Origin, read};
use std::fs;
use std::path::PathBuf;

mod converge;
mod results;
mod view;
mod views;

/// Runs the command and returns exit code, stdout and stderr.
fn luxel(args: &[&str]) -> (ExitCode, String, String) {
    let (mut stdout, mut stderr) = (Vec::new(), Vec::new());
    let args = std::iter::once("luxel").chain(args.iter().copied());
    let exit = run(args, &mut stdout, &mut stderr);
    let text = |bytes| String::from_utf8(bytes).expect("text");
    (exit, text(stdout), text(stderr))
}

fn json(stdout: &str) -> serde_json::Value {
    serde_json::from_str(stdout).expect("JSON on stdout")
}

/// The path of an example scene.
fn example(name: &str) -> String {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/data");
    format!("{folder}/{name}/{name}.toml")
}

/// A temporary folder with files.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    fn path(&self, name: &str) -> String {
        let path: PathBuf = self.0.path().join(name);
        path.to_str().expect("a text path").to_owned()
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        let path = self.path(name);
        fs::write(&path, content).expect("a writable folder");
        path
    }

    /// A scene of one dark square, seen from above.
    fn dark_scene(&self) -> String {
        self.write(
            "dark.obj",
            "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n",
        );
        self.write(
            "dark.toml",
            "geometry = [\"dark.obj\"]\n[[camera]]\nname = \"top\"\nposition = [0.5, 0.5, 2]\n\
             look_at = [0.5, 0.5, 0]\nup = [0, 1, 0]\nfov = 40\nfov_axis = \"x\"\nsize = [8, 8]\n",
        )
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).expect("a folder");
        let mut names: Vec<String> = entries
            .map(|entry| entry.expect("an entry").file_name())
            .map(|name| name.to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }
}

#[test]
fn the_arguments_are_consistent() {
    use clap::CommandFactory;
    Arguments::command().debug_assert();
}

#[test]
fn help_and_version_are_results() {
    let (exit, stdout, stderr) = luxel(&["--version"]);
    assert_eq!((exit, stderr.as_str()), (ExitCode::Ok, ""));
    assert!(stdout.starts_with("luxel "));
    for verb in [
        "render",
        "solve",
        "probe",
        "bake",
        "export",
        "view",
        "form-factors",
        "converge",
        "check",
        "diff",
    ] {
        let (exit, stdout, _) = luxel(&[verb, "--help"]);
        assert_eq!(exit, ExitCode::Ok);
        assert!(stdout.contains("--seed"), "{verb}");
    }
}

#[test]
fn usage_errors_exit_with_2_and_leave_stdout_empty() {
    let scene = example("furnace");
    for args in [
        &[][..],
        &["frobnicate"],
        &["diff"],
        &["diff", "a.exr", "b.exr", "-j", "0"],
        &["diff", "a.exr", "b.exr", "--max-rel-rmse", "-1"],
        &["render", &scene],
        &["render", &scene, "-o", "picture.png"],
        &["render", &scene, "-o", "a.exr", "--size", "10"],
        &["render", &scene, "-o", "a.exr", "--spp", "0"],
        &["render", &scene, "-o", "a.exr", "--max-distance", "1"],
        &["render", &scene, "-o", "a.exr", "--png", "a.exr"],
        &["probe", &scene, "--points", "p.csv", "--max-distance", "1"],
        &["solve", &scene, "--patch-size", "-1"],
        &["solve", &scene, "--tolerance", "nan"],
        &["solve", &scene, "--solver", "jacobi"],
        &["form-factors", &scene, "-o", "f.txt"],
        &["form-factors", &scene, "--resolution", "64"],
        &[
            "form-factors",
            &scene,
            "--method",
            "hemicube",
            "--rays",
            "64",
        ],
    ] {
        let (exit, stdout, stderr) = luxel(args);
        assert_eq!((exit, stdout.as_str()), (ExitCode::Usage, ""), "{args:?}");
        assert!(!stderr.is_empty());
    }
}

#[test]
fn a_closed_stdout_is_no_failure() {
    struct Closed;
    impl Write for Closed {
        fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
            Err(std::io::ErrorKind::BrokenPipe.into())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let scene = example("furnace");
    for args in [&["luxel", "--help"][..], &["luxel", "check", &scene]] {
        let mut stderr = Vec::new();
        let exit = run(args.iter().copied(), &mut Closed, &mut stderr);
        assert_eq!(exit, ExitCode::Ok);
    }
}

#[test]
fn outputs_are_refused_before_the_work_and_named() {
    let folder = Folder::new();
    let missing = folder.path("missing/a.exr");
    let (exit, stdout, stderr) = luxel(&["render", &example("furnace"), "-o", &missing]);
    assert_eq!((exit, stdout.as_str()), (ExitCode::Failure, ""));
    assert!(
        stderr.contains("missing/a.exr") && stderr.contains("mkdir -p"),
        "{stderr}"
    );
}

#[test]
fn inputs_that_are_missing_wrong_or_empty_have_their_exit_codes() {
    let folder = Folder::new();
    let out = folder.path("a.exr");
    let (exit, _, stderr) = luxel(&["render", "missing.toml", "-o", &out]);
    assert!(stderr.starts_with("error: ") && stderr.contains("missing.toml"));
    assert_ne!(exit, ExitCode::Ok);
    let broken = folder.write("broken.toml", "geometry = [\"x.obj\"]\nbananas = 1\n");
    let (exit, _, stderr) = luxel(&["check", &broken]);
    assert_eq!(exit, ExitCode::InvalidInput);
    assert!(
        stderr.contains("broken.toml") && stderr.contains('2'),
        "{stderr}"
    );

    let dark = folder.dark_scene();
    let (exit, _, stderr) = luxel(&["render", &dark, "-o", &out]);
    assert_eq!(exit, ExitCode::NothingToDo, "{stderr}");
    let (exit, _, stderr) = luxel(&["solve", &dark]);
    assert_eq!(exit, ExitCode::NothingToDo, "{stderr}");
    let (exit, _, stderr) = luxel(&["render", &dark, "-o", &out, "--camera", "nobody"]);
    assert_eq!(exit, ExitCode::Usage);
    assert!(stderr.contains("nobody") && stderr.contains("top"));

    let furnace = example("furnace");
    let probe = |points: &str| {
        let points = folder.write("points.csv", points);
        luxel(&["probe", &furnace, "--points", &points])
    };
    let (exit, _, stderr) = probe("x,y,z,nx,ny,nz\n");
    assert_eq!(exit, ExitCode::NothingToDo, "{stderr}");
    let (exit, _, stderr) = probe("x,y,z,nx,ny,nz\n0,0,0,0,0,0\n");
    assert_eq!(exit, ExitCode::InvalidInput);
    assert!(stderr.contains("points.csv, line 2"), "{stderr}");
    let (exit, ..) = luxel(&["probe", &furnace, "--points", "missing.csv"]);
    assert_eq!(exit, ExitCode::Failure);
}

#[test]
fn every_integrator_writes_a_picture_of_the_furnace() {
    let folder = Folder::new();
    let (exr, png) = (folder.path("a.exr"), folder.path("a.png"));
    for (integrator, expected) in [
        ("radiosity", 2.0),
        ("gather", 2.0),
        ("whitted", 2.0),
        ("path", 2.0),
        // A closed box: everything is occluded.
        ("ao", 0.0),
    ] {
        let (exit, stdout, stderr) = luxel(&[
            "render",
            &example("furnace"),
            "-o",
            &exr,
            "--png",
            &png,
            "--size",
            "8x6",
            "--spp",
            "16",
            "--integrator",
            integrator,
        ]);
        assert_eq!(exit, ExitCode::Ok, "{stderr}");
        assert_eq!(stdout, format!("{exr}\n{png}\n"));
        let picture = read(std::path::Path::new(&exr)).expect("an EXR file");
        assert_eq!((picture.image.width, picture.image.height), (8, 6));
        let Some(Origin::Rendered(origin)) = picture.origin else {
            panic!("luxel says where a picture is from");
        };
        assert_eq!(
            (
                origin.integrator.as_str(),
                origin.samples.min,
                origin.samples.max
            ),
            (integrator, 16, 16)
        );
        assert!(picture.layers.iter().any(|(name, _)| name == "error"));
        let values = picture.image.pixels.iter().flatten();
        let mean = values.map(|&v| f64::from(v)).sum::<f64>() / (3.0 * 48.0);
        // The noisiest is the path tracer: 0.6 % of the mean, from the standard error layer.
        assert!((mean - expected).abs() < 0.05, "{integrator}: {mean}");
    }
    assert_eq!(folder.names(), ["a.exr", "a.png"], "nothing is left behind");
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let folder = Folder::new();
    let cornell = example("cornell");
    let points = folder.write(
        "points.csv",
        "x,y,z,nx,ny,nz\n0.2,0,0.2,0,1,0\n0.3,0.5487,0.1,0,-1,0\n",
    );
    let run = |threads: &str, args: &[&str]| {
        let mut all = args.to_vec();
        all.extend(["-j", threads, "--seed", "7"]);
        let (exit, stdout, stderr) = luxel(&all);
        assert_eq!(exit, ExitCode::Ok, "{stderr}");
        stdout
    };
    for integrator in ["radiosity", "gather", "path"] {
        let picture = |threads: &str| {
            let out = folder.path(&format!("{threads}.exr"));
            let args = [
                "render", &cornell, "-o", &out, "--size", "24x24", "--spp", "4",
            ];
            run(
                threads,
                &[&args[..], &["--integrator", integrator]].concat(),
            );
            fs::read(out).expect("a picture")
        };
        assert!(picture("1") == picture("2"), "{integrator}");
    }
    for more in [
        &["--rays", "64"][..],
        &["--integrator", "path", "--rays", "64"],
        &["--quantity", "ao", "--rays", "64"],
    ] {
        let args = [&["probe", &cornell, "--points", &points][..], more].concat();
        let table = run("1", &args);
        assert_eq!(table.lines().count(), 3);
        assert_eq!(table, run("2", &args));
    }
    let solve = |threads: &str| {
        let args = ["solve", &cornell, "--json", "--rays", "16"];
        let mut result = json(&run(threads, &args));
        for what_varies in ["seconds", "memory"] {
            result.as_object_mut().map(|map| map.remove(what_varies));
        }
        result
    };
    assert_eq!(solve("1"), solve("2"));
}

#[test]
fn probes_keep_their_columns_and_tell_components_apart() {
    let folder = Folder::new();
    let points = folder.write("p.csv", "id,x,y,z,nx,ny,nz\na,1,0,1,0,2,0\n");
    let out = folder.path("out.csv");
    let value = |components: &str| {
        let (exit, stdout, stderr) = luxel(&[
            "probe",
            &example("furnace"),
            "--points",
            &points,
            "-o",
            &out,
            "--components",
            components,
        ]);
        assert_eq!(
            (exit, stdout),
            (ExitCode::Ok, format!("{out}\n")),
            "{stderr}"
        );
        let table = fs::read_to_string(&out).expect("a table");
        let lines: Vec<&str> = table.lines().collect();
        assert_eq!(lines[0], "id,x,y,z,nx,ny,nz,e_r,e_g,e_b,se_r,se_g,se_b");
        assert!(lines[1].starts_with("a,1,0,1,0,2,0,"));
        let field = lines[1].split(',').nth(7).expect("e_r");
        field.parse::<f64>().expect("a number")
    };
    // E = 2π, half of it direct; what is left is the noise of shadow rays and near chains.
    let pi = std::f64::consts::PI;
    let [all, direct, indirect] = ["all", "direct", "indirect"].map(value);
    assert!((all - 2.0 * pi).abs() < 0.02 * pi, "{all}");
    assert!((direct - pi).abs() < 0.01 * pi, "{direct}");
    assert!((indirect - pi).abs() < 0.02 * pi, "{indirect}");
}

#[test]
fn progress_and_summaries_stay_out_of_stdout() {
    let scene = example("furnace");
    let (exit, stdout, stderr) = luxel(&[
        "solve",
        &scene,
        "--json",
        "--rays",
        "8",
        "--progress",
        "json",
        "-v",
    ]);
    assert_eq!(exit, ExitCode::Ok);
    assert!(json(&stdout).is_object());
    assert!(stderr.lines().any(|line| line.starts_with("{\"done\":0")));
    let (_, _, stderr) = luxel(&["solve", &scene, "--rays", "8", "-q"]);
    assert_eq!(stderr, "");
}
