//! The same work with one thread and with two.

use super::measured;
use crate::accuracy::median;
use crate::command::{arg, luxel};
use crate::picture::example;
use crate::references::IrradianceReference;

/// Seconds of the same command with one thread and with two, medians of `runs` each, in turns.
fn in_turns(runs: u64, run: impl Fn(&str)) -> [f64; 2] {
    let mut seconds = [Vec::new(), Vec::new()];
    for _ in 0..runs.max(1) {
        for (list, threads) in seconds.iter_mut().zip(["1", "2"]) {
            list.push(measured(1, |_| run(threads)).0);
        }
    }
    seconds.map(median)
}

/// Rows, gather and image of the office: what is done and the seconds with one thread and with two.
///
/// # Panics
/// When a command fails.
pub fn office(runs: u64) -> [(&'static str, [f64; 2]); 3] {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [points, table, picture] =
        ["points.csv", "out.csv", "out.exr"].map(|name| folder.path().join(name));
    let reference = IrradianceReference::load("office");
    std::fs::write(&points, reference.points_csv()).expect("a table of points");
    let file = example("office");
    let command = |verb: &str, options: &[&str]| {
        let head = [verb, arg(&file), "-q"];
        luxel(&[head.as_slice(), options].concat()).assert_success();
    };
    let rows = in_turns(runs, |threads| {
        command(
            "solve",
            &["--rays", "256", "--patch-size", "0.15", "-j", threads],
        );
    });
    let (points, table, picture) = (arg(&points), arg(&table), arg(&picture));
    let gather = in_turns(runs, |threads| {
        let files = ["--points", points, "-o", table];
        command(
            "probe",
            &[files.as_slice(), &["--rays", "2048", "-j", threads]].concat(),
        );
    });
    let image = in_turns(runs, |threads| {
        let options = ["-o", picture, "--size", "128x128", "--error", "5%"];
        command("render", &[options.as_slice(), &["-j", threads]].concat());
    });
    [
        (
            "rows and their solution, `solve --rays 256 --patch-size 0.15`",
            rows,
        ),
        ("gather, `probe --rays 2048`", gather),
        ("image, `render --size 128x128 --error 5%`", image),
    ]
}
