//! A disk that is full in the middle, which needs a process of its own: no half of a file has a final name, no manifest says that
//! the folder is complete, and the message names a file and what to do.
#![cfg(unix)]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn cornell() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/data/cornell/cornell.toml")
}

/// Runs the command as one whose files cannot grow beyond 64 blocks (32 or 64 KiB, as the shell counts them): a write beyond
/// that fails in the middle, as on a disk that is full, with EFBIG instead of ENOSPC. Children inherit the limit, and that the signal
/// which would end them is ignored.
fn with_little_space(arguments: &[&str]) -> Output {
    Command::new("sh")
        .args([
            "-c",
            "trap '' XFSZ && ulimit -f 64 && exec \"$0\" \"$@\"",
            env!("CARGO_BIN_EXE_luxel"),
        ])
        .args(arguments)
        .output()
        .expect("a shell")
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let names = entries.map(|entry| entry.expect("an entry").file_name());
    names
        .map(|name| name.into_string().expect("UTF-8"))
        .collect()
}

/// Every file that is there can be read to its end.
fn assert_whole(folder: &Path) {
    for name in names(folder) {
        let path = folder.join(&name);
        let extension = path.extension().and_then(|e| e.to_str());
        match extension {
            Some("exr") => drop(luxel::image::exr::read(&path).expect("a whole picture")),
            Some("png") => {
                let bytes = std::fs::read(&path).expect("readable");
                image::load_from_memory(&bytes).expect("a whole picture");
            }
            Some("ktx2") => {
                let bytes = std::fs::read(&path).expect("readable");
                ktx2::Reader::new(bytes).expect("a whole texture");
            }
            Some("glb") => {
                let bytes = std::fs::read(&path).expect("readable");
                let length = u32::from_le_bytes(bytes[8..12].try_into().expect("four"));
                assert_eq!(length as usize, bytes.len(), "{name}");
            }
            Some("obj" | "mtl" | "rs") => {}
            other => panic!("{name} ({other:?}) is left behind"),
        }
    }
}

fn assert_told(output: &Output, folder: &Path) {
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert_eq!(output.stdout, b"", "no result");
    let (_, told) = told.split_once("cannot write ").expect("what failed");
    assert!(told.starts_with(text(folder)), "a file: {told}");
    assert!(told.contains("free space"), "a remedy: {told}");
    assert!(!folder.join("manifest.json").exists(), "not complete");
    assert_whole(folder);
}

#[test]
fn bakes_and_exports_leave_whole_files_and_no_manifest() {
    let folder = tempfile::tempdir().expect("a folder");
    let [baked, small] = ["baked", "small"].map(|name| folder.path().join(name));
    let scene = cornell();
    let bake = |out: &Path, side| {
        let scene = text(&scene).to_owned();
        let options = ["--for", "bevy", "--error", "20%", "--size", side];
        let mut all = vec!["bake".to_owned(), scene, "-o".into(), text(out).to_owned()];
        all.extend(options.map(str::to_owned));
        all
    };
    let run = |arguments: &[String]| {
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        with_little_space(&arguments)
    };
    let without_limit = |out: &Path, side| {
        let status = Command::new(env!("CARGO_BIN_EXE_luxel"))
            .args(bake(out, side))
            .status();
        assert!(status.expect("a command").success());
        assert!(out.join("manifest.json").exists());
    };
    // Into an empty folder, and into one that was complete.
    assert_told(&run(&bake(&small, "256")), &small);
    without_limit(&small, "16");
    assert_told(&run(&bake(&small, "256")), &small);

    without_limit(&baked, "256");
    let out = folder.path().join("exported");
    let export = ["export", text(&baked), "-o", text(&out), "--for", "three"];
    assert_told(&with_little_space(&export), &out);
}

#[test]
fn an_old_picture_survives() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out.exr");
    std::fs::write(&out, "old").expect("a file");
    let scene = cornell();
    let output = with_little_space(&[
        "render",
        text(&scene),
        "--size",
        "128x128",
        "--spp",
        "4",
        "-o",
        text(&out),
    ]);
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(
        told.contains(text(&out)) && told.contains("free space"),
        "{told}"
    );
    assert_eq!(std::fs::read(&out).expect("still there"), b"old");
    assert_eq!(names(folder.path()), ["out.exr"]);
}
