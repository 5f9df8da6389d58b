//! What is said of memory beforehand against what the command then holds, which needs a process of its own.
#![cfg(target_os = "linux")]

use std::path::{Path, PathBuf};
use std::process::Command;

/// What `cli::footprint` counts for the process itself, in bytes: code, stacks, batches of rays.
const PROCESS: f64 = 16.0 * MIB;
const MIB: f64 = 1024.0 * 1024.0;

/// A run of the command with two threads.
struct Run {
    exit: Option<i32>,
    stdout: String,
    stderr: String,
}

impl Run {
    fn new(arguments: &[&str]) -> Self {
        let output = Command::new(env!("CARGO_BIN_EXE_luxel"))
            .args(arguments)
            .args(["-v", "-j", "2", "--progress", "none", "--json"])
            .output()
            .expect("the command runs");
        let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
        Self {
            exit: output.status.code(),
            stdout: text(output.stdout),
            stderr: text(output.stderr),
        }
    }

    /// The largest amount that was expected, in bytes. Two digits of it are told, or three.
    fn expected(&self) -> f64 {
        let amounts = self.stderr.lines().filter_map(|line| {
            let mut words = line.strip_prefix("memory: at most ")?.split(' ');
            let number: f64 = words.next()?.parse().ok()?;
            let unit = match words.next()? {
                "MiB" => MIB,
                "GiB" => 1024.0 * MIB,
                other => panic!("not expected in {other}"),
            };
            Some(number * unit)
        });
        amounts.fold(0.0, f64::max)
    }

    /// What was held in the end, in bytes.
    fn peak(&self) -> f64 {
        let json: serde_json::Value = serde_json::from_str(&self.stdout).expect("JSON");
        json["memory"]["peak"].as_f64().expect("Linux tells")
    }

    /// The option that the message of a refusal says would fit.
    fn suggested(&self) -> (String, String) {
        let (_, remedy) = self
            .stderr
            .split_once("--max-memory; ")
            .expect(&self.stderr);
        let mut words = remedy.split(' ');
        let mut next = || words.next().expect(remedy).to_owned();
        (next(), next())
    }
}

fn scene(name: &str) -> String {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/data");
    let path = data.join(name).join(format!("{name}.toml"));
    path.to_str().expect("a path in UTF-8").to_owned()
}

/// A table of points on the floor of the Cornell box, evenly.
fn points(folder: &Path, count: usize) -> PathBuf {
    let line = |i: usize| {
        let along = |ratio: f64| 0.01 + 0.53 * (ratio * i as f64).fract();
        let [x, z] = [0.754_877_666, 0.569_840_291].map(along);
        format!("{x:.6},0,{z:.6},0,1,0\n")
    };
    let lines: Vec<String> = (0..count).map(line).collect();
    let text = format!("x,y,z,nx,ny,nz\n{}", lines.concat());
    let path = folder.join(format!("{count}.csv"));
    std::fs::write(&path, text).expect("a writable folder");
    path
}

/// Asserts that what is expected is enough, and not much more than enough. The allocator keeps some of what was freed,
/// and not all is held at once: half as much again, beside the process, which is counted more generously.
#[track_caller]
fn is_expected(arguments: &[&str]) {
    let run = Run::new(arguments);
    assert!(matches!(run.exit, Some(0 | 6)), "{}", run.stderr);
    let (expected, peak) = (run.expected(), run.peak());
    assert!(
        (peak..=1.5 * peak + PROCESS).contains(&expected),
        "{arguments:?}: {} MiB were expected, {} MiB held: {}",
        expected / MIB,
        peak / MIB,
        run.stderr
    );
}

#[test]
fn points_hold_what_is_expected() {
    let folder = tempfile::tempdir().expect("a folder");
    let cornell = scene("cornell");
    for (count, error) in [(1000, "5%"), (100_000, "1.5%")] {
        let table = points(folder.path(), count);
        let table = table.to_str().expect("UTF-8");
        let out = folder.path().join("out.csv");
        let out = out.to_str().expect("UTF-8");
        is_expected(&[
            "probe", &cornell, "--points", table, "-o", out, "--error", error,
        ]);
    }
}

#[test]
fn solutions_hold_what_is_expected() {
    let (cornell, office) = (scene("cornell"), scene("office"));
    is_expected(&["solve", &cornell, "--patch-size", "0.008", "--rays", "32"]);
    is_expected(&["solve", &cornell, "--patch-size", "0.02", "--rays", "1024"]);
    is_expected(&["solve", &office, "--patch-size", "0.1", "--rays", "16"]);
}

#[test]
fn matrices_hold_what_is_expected() {
    let cornell = scene("cornell");
    let dense = ["solve", &cornell, "--patch-size", "0.03", "--form-factors"];
    for method in [
        ["raycast", "--rays", "64"],
        ["hemicube", "--resolution", "16"],
    ] {
        is_expected(&[&dense[..], &method[..]].concat());
    }
    let raycast = [&dense[..], &["raycast", "--rays", "64"]].concat();
    for solver in ["southwell", "cg", "direct"] {
        let coarse = ["--patch-size", "0.03"];
        assert_eq!(raycast[2..4], coarse);
        is_expected(&[&raycast[..], &["--solver", solver, "--tolerance", "0.1"]].concat());
    }
}

#[test]
fn pictures_hold_what_is_expected() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out.exr");
    let out = out.to_str().expect("UTF-8");
    let cornell = scene("cornell");
    let render = ["render", &cornell, "-o", out];
    is_expected(&[&render[..], &["--size", "256x256", "--error", "5%"]].concat());
    is_expected(
        &[
            &render[..],
            &["--size", "600x600", "--spp", "1", "--integrator", "ao"],
        ]
        .concat(),
    );
    is_expected(
        &[
            &render[..],
            &[
                "--size",
                "400x400",
                "--error",
                "60%",
                "--integrator",
                "path",
            ],
        ]
        .concat(),
    );
}

#[test]
fn bakes_hold_what_is_expected() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().to_str().expect("UTF-8");
    let (cornell, pavilion) = (scene("cornell"), scene("pavilion"));
    let bake = |scene: &str, options: &str| {
        let words: Vec<&str> = options.split(' ').collect();
        is_expected(&[&["bake", scene, "-o", out], &words[..]].concat());
    };
    bake(&cornell, "--size 256 --error 15%");
    bake(&cornell, "--size 256 --error 30% --include direct,masks,ao");
    bake(&cornell, "--size 256 --error 10% --bounces 6");
    bake(&cornell, "--size 256 --error 90% --integrator path");
    bake(&pavilion, "--size 256 --error 30% --include all,direct");
}

/// Asserts that a run is refused for want of memory, and that what its message says would fit does.
#[track_caller]
fn suggestion_fits(arguments: &[&str], option: &str) {
    let refused = Run::new(arguments);
    assert_eq!(refused.exit, Some(7), "{}", refused.stderr);
    assert!(refused.stdout.is_empty());
    let (name, value) = refused.suggested();
    assert_eq!(name, option, "{}", refused.stderr);
    let mut again: Vec<&str> = arguments.to_vec();
    match again.iter().position(|argument| *argument == name) {
        Some(place) => again[place + 1] = &value,
        None => again.extend([name.as_str(), &value]),
    }
    let run = Run::new(&again);
    assert!(matches!(run.exit, Some(0 | 6)), "{again:?}: {}", run.stderr);
}

#[test]
fn what_is_suggested_fits() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out.exr");
    let out = out.to_str().expect("UTF-8");
    let cornell = scene("cornell");
    let refused = |arguments: &str, limit: &str, option: &str| {
        let arguments = arguments.replace("OUT", out);
        let words: Vec<&str> = arguments.split(' ').collect();
        let (verb, rest) = words.split_first().expect("a verb");
        let limit = ["--max-memory", limit];
        suggestion_fits(&[&[*verb, &cornell], rest, &limit].concat(), option);
    };
    refused("solve --patch-size 0.002 --rays 2", "24M", "--patch-size");
    refused("solve --patch-size 0.05 --rays 16384", "40M", "--rays");
    refused("solve --error 0.1%", "22M", "--error");
    let dense = "solve --form-factors raycast --rays 64";
    refused(&format!("{dense} --patch-size 0.01"), "24M", "--patch-size");
    refused(dense, "24M", "--patch-size");
    let bake = "bake -o OUT.maps --error 30% --include ao,direct --size 512";
    refused(bake, "150M", "--size");
    let ao = "render -o OUT --integrator ao --spp 1 --size 1000x300";
    refused(ao, "24M", "--size");
}

#[test]
fn so_many_points_as_are_suggested_fit() {
    let folder = tempfile::tempdir().expect("a folder");
    let cornell = scene("cornell");
    let limit = ["--max-memory", "20M", "--rays", "8"];
    let probe = |count: usize| {
        let table = points(folder.path(), count);
        let table = table.to_str().expect("UTF-8").to_owned();
        Run::new(&[&["probe", &cornell, "--points", &table][..], &limit].concat())
    };
    let refused = probe(20_000);
    assert_eq!(refused.exit, Some(7), "{}", refused.stderr);
    let (_, remedy) = refused
        .stderr
        .split_once("a table of ")
        .expect(&refused.stderr);
    let count: usize = remedy
        .split(' ')
        .next()
        .and_then(|n| n.parse().ok())
        .expect(remedy);
    assert!((1..20_000).contains(&count));
    assert_eq!(probe(count).exit, Some(0));
    assert_eq!(probe(count + 1).exit, Some(7), "as many as fit");
}

/// What is known of the first round is kept; without the limit further rounds reach the error.
#[test]
fn what_may_not_grow_stops_and_says_so() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out.ply");
    let out = out.to_str().expect("UTF-8");
    let cornell = scene("cornell");
    let solve = ["solve", &cornell, "--error", "0.7%", "-o", out];
    let run = Run::new(&[&solve[..], &["--max-memory", "28M"]].concat());
    assert_eq!(run.exit, Some(6), "{}", run.stderr);
    let reason = "more memory than the 28 MiB";
    assert!(run.stderr.contains(reason), "{}", run.stderr);
    assert!(Path::new(out).exists(), "the result is written");
    let free = Run::new(&solve);
    assert_eq!(free.exit, Some(0), "{}", free.stderr);
    assert!(!free.stderr.contains("more memory than"));
}

#[test]
fn nonsense_is_no_limit() {
    for bad in ["0", "-1G", "4X", "", "NaN"] {
        let run = Run::new(&["solve", "any.toml", "--max-memory", bad]);
        assert_eq!(run.exit, Some(2), "{bad}");
        assert!(run.stderr.contains("such as 4G"), "{}", run.stderr);
    }
}
