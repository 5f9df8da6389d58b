//! Small pictures held in place; see [`luxel_tests::golden`] for how to look at and bless them.
//!
//! They guard what no number above them does: that the right thing is at the right place of the
//! picture. The same seed gives the same bytes on one machine; sines and roots of other machines
//! may move samples by an ulp, and a sample that thereby crosses an edge moves its pixel by some
//! percent. Fewer than one pixel in a thousand does so: an nRMSE below 1 %.

use glam::DVec3;
use luxel_scenes::{Rgb, Scene};
use luxel_tests::builder::{Part, parallelogram, room, scene, solid_box, sphere};
use luxel_tests::golden::assert_golden;
use luxel_tests::picture::{example, render};
use luxel_tests::scene_files;

const LIMIT: f64 = 0.01;

/// A room with a red and a green wall, a lamp, a box and a ball.
fn still_life() -> Scene {
    let size = DVec3::new(2.0, 2.0, 2.0);
    let coloured = |name, red, green, blue, face| Part {
        reflectance: luxel_scenes::Reflectance(Rgb::new(red, green, blue)),
        ..Part::grey(name, 0.0, vec![face])
    };
    let mut walls = room(DVec3::ZERO, size);
    let right = walls.remove(1);
    let left = walls.remove(0);
    let lamp = parallelogram(DVec3::new(0.7, 1.99, 0.7), DVec3::X * 0.6, DVec3::Z * 0.6);
    let stand = solid_box(DVec3::new(1.1, 0.0, 0.4), DVec3::new(1.6, 0.5, 0.9));
    scene(
        "still_life",
        [
            Part::grey("walls", 0.7, walls),
            coloured("left", 0.6, 0.1, 0.1, left),
            coloured("right", 0.1, 0.5, 0.1, right),
            Part::lamp("lamp", 8.0, vec![lamp]),
            Part::grey("block", 0.5, stand),
            Part::grey("ball", 0.5, sphere(DVec3::new(0.6, 0.35, 0.9), 0.35, 24)),
        ],
    )
}

const CAMERA: &str = "[[camera]]\nname = \"main\"\nposition = [1, 1, 1.9]\nlook_at = [1, 0.8, 0]\n\
                      up = [0, 1, 0]\nfov = 80\nfov_axis = \"x\"\nsize = [32, 32]\n";

#[track_caller]
fn check(name: &str, toml: &str, options: &[&str]) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = scene_files::write(&still_life(), folder.path(), toml);
    let options = [options, &["--spp", "16"]].concat();
    assert_golden(name, &render(&file, &options).image, LIMIT);
}

/// The block shows the floor and the walls mirrored; the ball, whose facets show as rings, shows the
/// lamp near its foot, upside down.
#[test]
fn mirror_and_glass() {
    let toml = "[material.block]\nreflectance = 0\nmirror = 0.8\n[material.ball]\nreflectance = 0\n\
         glass = 1.5\n[[camera]]\nname = \"main\"\nposition = [0.5, 1.1, 1.9]\n\
         look_at = [1.05, 0.3, 0.7]\nup = [0, 1, 0]\nfov = 60\nfov_axis = \"x\"\nsize = [48, 48]\n";
    check("mirror_and_glass", toml, &["--integrator", "whitted"]);
}

/// Right of the picture is x, down is z: the ball on the left, the block in the upper right, their
/// shadows away from the lamp above the middle.
#[test]
fn orthographic_plan() {
    let toml = "[[camera]]\nname = \"plan\"\nposition = [1, 1.9, 1]\nlook_at = [1, 0, 1]\n\
                up = [0, 0, -1]\nheight = 2\nsize = [32, 32]\n";
    check("orthographic_plan", toml, &[]);
}

/// Dark where the box and the ball touch the floor, bright in the middle of the walls.
#[test]
fn ambient_occlusion() {
    let options = ["--integrator", "ao", "--max-distance", "0.6"];
    check("ambient_occlusion", CAMERA, &options);
}

/// Smooth on walls, creased at edges, shadows as soft as the patches are large.
#[test]
fn radiosity_view() {
    let options = [
        "--integrator",
        "radiosity",
        "--size",
        "32x32",
        "--spp",
        "16",
    ];
    assert_golden(
        "radiosity_view",
        &render(&example("cornell"), &options).image,
        LIMIT,
    );
}
