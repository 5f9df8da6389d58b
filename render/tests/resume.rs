//! Bakes that are killed at any moment and go on to the same bytes, which needs processes of their own.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// How often a bake is killed, in chains of so many.
const KILLS: usize = 20;
const CHAIN: usize = 4;

/// Long enough for some rounds, short enough to be done again and again.
const OPTIONS: [&str; 12] = [
    "--size",
    "48",
    "--error",
    "1.5%",
    "--include",
    "all,ao,masks",
    "--max-distance",
    "0.3",
    "--directional",
    "sh1",
    "--volume-probes",
    "2x2x2",
];

fn scene() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/data/cornell/cornell.toml")
}

/// A bake into `folder`.
fn bake(folder: &Path, further: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_luxel"));
    command
        .arg("bake")
        .arg(scene())
        .arg("-o")
        .arg(folder)
        .args(OPTIONS)
        .args(["--checkpoint-every", "20ms", "--progress", "none"])
        .args(further)
        .stdout(Stdio::null());
    command
}

/// Contents by name, but for what a killed process may leave: a checkpoint and temporary files.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    entries
        .map(|entry| entry.expect("an entry"))
        .map(|entry| {
            (
                entry.file_name().into_string().expect("UTF-8"),
                entry.path(),
            )
        })
        .filter(|(name, _)| !name.starts_with(".luxel-") && !name.starts_with("checkpoint"))
        .map(|(name, path)| (name, std::fs::read(path).expect("readable")))
        .collect()
}

/// Whether a folder, which need not exist, has a file whose name begins so.
fn holds(folder: &Path, prefix: &str) -> bool {
    let mut entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.any(|entry| entry.file_name().to_string_lossy().starts_with(prefix))
}

/// Weyl's sequence: evenly spread moments.
fn moment(index: usize, whole: Duration) -> Duration {
    whole.mul_f64((index as f64 * 0.618_033_988_749_894_9).fract())
}

fn kill_after(mut child: Child, wait: Duration) {
    std::thread::sleep(wait);
    // SIGKILL where there are signals: nothing can be tidied up.
    child.kill().expect("it runs or has ended");
    child.wait().expect("it has ended");
}

#[test]
fn killed_at_any_moment_a_bake_goes_on_to_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let undisturbed = folder.path().join("undisturbed");
    let started = Instant::now();
    let status = bake(&undisturbed, &[]).status().expect("it runs");
    let whole = started.elapsed();
    assert_eq!(status.code(), Some(0));
    assert!(!undisturbed.join("checkpoint.luxel").exists());
    let expected = files(&undisturbed);
    assert!(expected.contains_key("manifest.json"));

    let (mut resumed, mut complete) = (0, 0);
    for chain in 0..KILLS / CHAIN {
        let disturbed = folder.path().join(format!("disturbed {chain}"));
        for link in 0..CHAIN {
            let child = bake(&disturbed, &["--resume"]).spawn().expect("it runs");
            kill_after(child, moment(chain * CHAIN + link, whole));
            resumed += usize::from(holds(&disturbed, "checkpoint"));
            complete += usize::from(holds(&disturbed, "checkpoint_"));
            if disturbed.exists() {
                // What has its final name is whole.
                for (name, content) in files(&disturbed) {
                    assert!(expected.get(&name) == Some(&content), "{name}");
                }
            }
        }
        let output = bake(&disturbed, &["--resume", "-j", "1"])
            .output()
            .expect("it runs");
        assert_eq!(output.status.code(), Some(0));
        let all: Vec<_> = std::fs::read_dir(&disturbed).expect("a folder").collect();
        assert_eq!(all.len(), expected.len(), "nothing is left behind");
        assert!(files(&disturbed) == expected);
    }
    // Most moments lie between the first checkpoint and the end.
    assert!(resumed >= KILLS / 4, "{resumed} checkpoints");
    // The maps of light, which come first, take half of the time.
    assert!(complete > 0, "nothing was complete when it was killed");
}

#[test]
fn a_checkpoint_goes_on_with_its_own_scene_and_options_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let disturbed = folder.path().join("disturbed");
    let checkpoint = disturbed.join("checkpoint.luxel");
    let child = bake(&disturbed, &[]).spawn().expect("it runs");
    let waited = Instant::now();
    while !checkpoint.exists() && waited.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(1));
    }
    kill_after(child, Duration::ZERO);
    let kept = std::fs::read(&checkpoint).expect("it was kept");

    let refused = |arguments: &[&str]| -> String {
        let mut command = bake(&disturbed, &["--resume"]);
        let output = command.args(arguments).output().expect("it runs");
        assert_eq!(output.status.code(), Some(3));
        assert!(!disturbed.join("manifest.json").exists());
        String::from_utf8(output.stderr).expect("UTF-8")
    };
    let message = refused(&["--seed", "7"]);
    assert!(
        message.contains("checkpoint.luxel was made with --seed 0"),
        "{message}"
    );
    let message = refused(&["--denoise", "none"]);
    assert!(message.contains("made with --denoise builtin"), "{message}");
    let message = refused(&["--texels-per-metre", "10"]);
    assert!(
        message.contains("made with no --texels-per-metre"),
        "{message}"
    );

    // A byte that is wrong, and a file that ends too early.
    let mut broken = kept.clone();
    broken[kept.len() / 2] ^= 1;
    for content in [&broken[..], &kept[..kept.len() / 2], b""] {
        std::fs::write(&checkpoint, content).expect("writable");
        let message = refused(&[]);
        assert!(message.contains("not a complete checkpoint"), "{message}");
    }

    // Another scene under the same name of the same folder.
    std::fs::write(&checkpoint, &kept).expect("writable");
    let other = scene().with_file_name("../pavilion/pavilion.gltf");
    let mut command = Command::new(env!("CARGO_BIN_EXE_luxel"));
    command.arg("bake").arg(other).arg("-o").arg(&disturbed);
    let output = command
        .args(OPTIONS)
        .arg("--resume")
        .output()
        .expect("it runs");
    let message = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(3), "{message}");
    assert!(message.contains("another scene"), "{message}");
    assert!(std::fs::read(&checkpoint).expect("still there") == kept);
}

/// Ctrl-C keeps what there is, says how to go on, and ends with 130.
#[cfg(unix)]
#[test]
fn stopped_by_the_user_a_bake_can_go_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let (whole, stopped) = (folder.path().join("whole"), folder.path().join("stopped"));
    // No checkpoint but the one that the wish to stop makes.
    let rarely = ["--checkpoint-every", "1h"];
    let bake = |folder: &Path, further: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_luxel"));
        command.arg("bake").arg(scene()).arg("-o").arg(folder);
        command.args(["--size", "64", "--error", "0.5%"]);
        command.args(rarely).args(further).stderr(Stdio::piped());
        command
    };
    let mut child = bake(&stopped, &["--progress", "json"])
        .spawn()
        .expect("it runs");
    // Once receivers are gathered, which takes seconds at this error.
    let mut told = BufReader::new(child.stderr.take().expect("a pipe"));
    let mut message = String::new();
    while !message.contains("gathering") {
        assert!(
            told.read_line(&mut message).expect("UTF-8") > 0,
            "{message}"
        );
    }
    let signal = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status();
    assert!(signal.expect("kill runs").success());
    told.read_to_string(&mut message).expect("UTF-8");
    let status = child.wait().expect("it ends");
    assert_eq!(status.code(), Some(130), "{message}");
    assert!(message.contains("--resume goes on from it"), "{message}");
    assert!(stopped.join("checkpoint.luxel").exists());

    let resumed = bake(&stopped, &["--resume"]).output().expect("it runs");
    assert_eq!(resumed.status.code(), Some(0));
    let status = bake(&whole, &[]).status().expect("it runs");
    assert_eq!(status.code(), Some(0));
    assert!(files(&stopped) == files(&whole));
}
