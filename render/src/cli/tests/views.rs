//! Cameras that see what they should not.

use super::{Folder, luxel};
use crate::cli::ExitCode;

/// A bright square of side 1 m in the plane z = 0 that faces +z, and a camera 2 m behind it that is
/// `fov` degrees wide.
fn seen_from_behind(folder: &Folder, fov: f64) -> String {
    folder.write("pane.mtl", "newmtl glow\nKd 0.5 0.5 0.5\nKe 1 1 1\n");
    folder.write(
        "pane.obj",
        "mtllib pane.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\no pane\nusemtl glow\nf 1 2 3 4\n",
    );
    folder.write(
        "pane.toml",
        format!(
            "geometry = [\"pane.obj\"]\n[[camera]]\nname = \"behind\"\nposition = [0.5, 0.5, -2]\n\
             look_at = [0.5, 0.5, 0]\nup = [0, 1, 0]\nfov = {fov}\nfov_axis = \"x\"\nsize = [8, 8]\n"
        ),
    )
}

#[test]
fn a_camera_inside_a_wall_is_refused_by_name_with_a_remedy() {
    let folder = Folder::new();
    // The picture is 2 · 2 m · tan 10° = 0.7 m wide: nothing but the pane's back.
    let scene = seen_from_behind(&folder, 20.0);
    let picture = folder.path("a.exr");
    let (exit, stdout, stderr) = luxel(&["render", &scene, "-o", &picture]);
    assert_eq!((exit, stdout.as_str()), (ExitCode::InvalidInput, ""));
    for part in [
        "camera `behind`",
        "object `pane`",
        "move the camera",
        "100 %",
    ] {
        assert!(stderr.contains(part), "{part} in {stderr}");
    }
    assert!(!folder.names().contains(&"a.exr".to_owned()));

    // Backs occlude as fronts do, so that a picture of occlusion is still one.
    let (exit, _, stderr) = luxel(&["render", &scene, "-o", &picture, "--integrator", "ao"]);
    assert_eq!(exit, ExitCode::Ok);
    assert!(stderr.contains("warning: camera `behind`"), "{stderr}");

    let (exit, stdout, _) = luxel(&["check", &scene, "--strict"]);
    assert_eq!(exit, ExitCode::LimitExceeded);
    assert!(stdout.contains("warning: camera `behind`"), "{stdout}");
}

#[test]
fn a_camera_that_sees_mostly_backs_is_warned_of() {
    let folder = Folder::new();
    // 1.15 m wide: the pane fills three quarters.
    let scene = seen_from_behind(&folder, 32.0);
    let picture = folder.path("a.exr");
    let (exit, _, stderr) = luxel(&["render", &scene, "-o", &picture]);
    assert_eq!(exit, ExitCode::Ok);
    assert!(stderr.contains("warning: camera `behind`"), "{stderr}");

    // 2.3 m wide: a fifth. The picture may be meant; the check still tells.
    let scene = seen_from_behind(&folder, 60.0);
    let (exit, _, stderr) = luxel(&["render", &scene, "-o", &picture]);
    assert_eq!(exit, ExitCode::Ok);
    assert!(!stderr.contains("warning"), "{stderr}");
    let (_, stdout, _) = luxel(&["check", &scene]);
    assert!(
        stdout.contains("`pane` is seen from behind by camera `behind`"),
        "{stdout}"
    );
}
