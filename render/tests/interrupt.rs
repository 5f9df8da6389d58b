//! Ctrl-C, which needs a process of its own: what was asked for is left in its last complete state or
//! not at all, and the exit code is 130.
#![cfg(unix)]

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

fn start(arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_luxel"))
        .args(arguments)
        .args(["--progress", "json"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts")
}

/// Waits for a line of progress that `says` something, then interrupts; the exit code.
fn interrupt_when(mut child: Child, says: &str) -> Option<i32> {
    let stderr = child.stderr.take().expect("a pipe");
    let mut lines = BufReader::new(stderr).lines();
    let seen = lines.any(|line| line.is_ok_and(|line| line.contains(says)));
    assert!(seen, "no line says {says:?}");
    let pid = child.id().to_string();
    let killed = Command::new("kill").args(["-INT", &pid]).status();
    assert!(killed.is_ok_and(|status| status.success()), "kill");
    // The rest must be read, or the child waits for its pipe.
    lines.for_each(drop);
    child.wait().expect("it ends").code()
}

fn scene(name: &str) -> String {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/data");
    let path = data.join(name).join(format!("{name}.toml"));
    path.to_str().expect("a path in UTF-8").to_owned()
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    entries
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .into_string()
                .expect("UTF-8")
        })
        .collect()
}

#[test]
fn a_picture_is_left_as_far_as_it_came() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out.exr");
    let cornell = scene("cornell");
    let child = start(&[
        "render",
        &cornell,
        "--size",
        "64x64",
        "--error",
        "0.3%",
        "-o",
        out.to_str().expect("UTF-8"),
    ]);
    // From the second round on the stage tells the estimate so far.
    assert_eq!(interrupt_when(child, "sampling ("), Some(130));
    let picture = luxel::image::exr::read(&out).expect("a whole file");
    assert_eq!((picture.image.width, picture.image.height), (64, 64));
    let lit = picture
        .image
        .pixels
        .iter()
        .flatten()
        .any(|&value| value > 0.0);
    assert!(lit, "something was rendered");
    assert_eq!(names(folder.path()), ["out.exr"]);
}

#[test]
fn what_has_nothing_to_keep_ends_at_once_and_leaves_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out.ply");
    let office = scene("office");
    let child = start(&[
        "solve",
        &office,
        "--form-factors",
        "raycast",
        "--patch-size",
        "0.3",
        "-o",
        out.to_str().expect("UTF-8"),
    ]);
    assert_eq!(interrupt_when(child, "elapsed"), Some(130));
    assert_eq!(names(folder.path()), Vec::<String>::new());
}
