//! Mirrors and glass: Whitted's recursion against the path tracer and against closed forms.
//!
//! Where nothing reflects diffusely, both see the same light exactly: Whitted by following every
//! branch, the path tracer by following one of them by chance.

use glam::DVec3;
use luxel_scenes::{Radiance, Reflectance, Rgb, Scene};
use luxel_tests::builder::{Part, polygon, room, scene, solid_box};
use luxel_tests::hypothesis::{Comparison, z_test};
use luxel_tests::picture::{pixels, render};
use luxel_tests::scene_files;

/// Radiances of the walls of [`dark_room`]: x−, x+, y−, y+, z−, z+, in W/(m² sr).
const WALLS: [f64; 6] = [1.0, 2.0, 0.5, 4.0, 1.5, 3.0];

/// A room whose walls emit, each its own radiance, and reflect nothing, with `bodies` in it.
fn dark_room(bodies: impl IntoIterator<Item = Part>) -> Scene {
    let walls = room(DVec3::new(-2.0, -1.0, -1.0), DVec3::new(3.0, 3.0, 2.0));
    let names = ["west", "east", "floor", "ceiling", "back", "front"];
    let wall = |((name, radiance), face)| Part::lamp(name, radiance, vec![face]);
    let walls = names.into_iter().zip(WALLS).zip(walls).map(wall);
    scene("dark_room", walls.chain(bodies))
}

/// Pixels of a picture of `scene` with the rest of its file, `toml`.
fn picture(scene: &Scene, toml: &str, options: &[&str]) -> Vec<(Rgb, Rgb)> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = scene_files::write(scene, folder.path(), toml);
    pixels(&render(&file, options))
}

/// Mean and standard error of some pixels together.
fn mean<'p>(pixels: impl IntoIterator<Item = &'p (Rgb, Rgb)>) -> (Rgb, Rgb) {
    let (mut sum, mut variance, mut count) = (Rgb::ZERO, Rgb::ZERO, 0.0);
    for (value, error) in pixels {
        sum += *value;
        variance += *error * *error;
        count += 1.0;
    }
    (sum / count, variance.map(f64::sqrt) / count)
}

/// A mirror box and a glass box in a room of bright walls. Blocks of 8 × 8 pixels are compared: the
/// standard error of a single pixel, from four replicates, is itself too uncertain for a z-test.
#[test]
fn whitted_agrees_with_the_path_tracer_on_mirrors_and_glass() {
    const SIDE: usize = 32;
    const BLOCK: usize = 8;
    let at = |x: f64| DVec3::new(x, 0.0, 0.0);
    let bodies = [
        Part::grey("mirror", 0.0, solid_box(at(-0.7), at(-0.7) + DVec3::ONE)),
        Part::grey("glass", 0.0, solid_box(at(0.8), at(0.8) + DVec3::ONE)),
    ];
    let scene = dark_room(bodies);
    let toml = "[material.mirror]\nmirror = 0.9\n[material.glass]\nglass = 1.5\n\
                [[camera]]\nname = \"main\"\nposition = [0.5, 2.2, 1.9]\nlook_at = [0.5, 0.3, 0.3]\n\
                up = [0, 1, 0]\nfov = 75\nfov_axis = \"x\"\nsize = [32, 32]\n";
    let whitted = picture(&scene, toml, &["--integrator", "whitted", "--spp", "64"]);
    let path = picture(&scene, toml, &["--integrator", "path", "--spp", "256"]);
    let block = |pixels: &[(Rgb, Rgb)], index: usize| {
        let (x, y) = (index % (SIDE / BLOCK), index / (SIDE / BLOCK));
        let inside = |&i: &usize| i % SIDE / BLOCK == x && i / SIDE / BLOCK == y;
        mean((0..SIDE * SIDE).filter(inside).map(|i| &pixels[i]))
    };
    let mut comparisons = Vec::new();
    for index in 0..(SIDE / BLOCK) * (SIDE / BLOCK) {
        let (a, a_error) = block(&whitted, index);
        let (b, b_error) = block(&path, index);
        // Eight reflections and refractions: glass is entered and left in two, each reflection
        // inside keeps 4 % or, if total, ends after one round of the box; less than 0.5 % is left.
        let nearest = a.clamp(b * 0.995, b * 1.005);
        comparisons.push(Comparison {
            value: (a - nearest).y,
            standard_error: a_error.y.hypot(b_error.y),
            expected: 0.0,
        });
    }
    z_test(&comparisons).unwrap();
}

/// A prism of 45° turns light by 90° without loss but for the 4 % at its entry and at its exit. With
/// F = ((n − 1)/(n + 1))² and the walls before (x) and above (y) the prism,
/// L = F L_x + (1 − F)² (L_y + F L_x)/(1 − F²).
#[test]
fn a_prism_reflects_totally() {
    let [a, b, c] = [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let at = |[x, y]: [f64; 2], z: f64| [x, y, z];
    let side = |p, q| polygon(&[at(p, 0.0), at(q, 0.0), at(q, 1.0), at(p, 1.0)]);
    let faces = vec![
        // The section runs counter-clockwise seen from +z.
        side(a, b),
        side(b, c),
        side(c, a),
        polygon(&[at(a, 1.0), at(b, 1.0), at(c, 1.0)]),
        polygon(&[at(c, 0.0), at(b, 0.0), at(a, 0.0)]),
    ];
    let scene = dark_room([Part::grey("prism", 0.0, faces)]);
    let toml = "[material.prism]\nglass = 1.5\n[[camera]]\nname = \"main\"\n\
                position = [-1, 0.5, 0.5]\nlook_at = [0, 0.5, 0.5]\nup = [0, 1, 0]\nheight = 0.5\n\
                size = [8, 8]\n";
    let fresnel = 0.04;
    let [x, _, _, y, ..] = WALLS;
    let once = (1.0 - fresnel) * (1.0 - fresnel) / (1.0 - fresnel * fresnel);
    let exact = fresnel * x + once * (y + fresnel * x);

    for (value, _) in picture(&scene, toml, &["--integrator", "whitted", "--spp", "4"]) {
        // Whitted stops at the eighth event: F³ is left. f32 pixels hold 6e-8.
        assert!(
            (value.y / exact - 1.0).abs() < fresnel.powi(3),
            "{value} {exact}"
        );
    }
    let path = picture(&scene, toml, &["--integrator", "path", "--spp", "4096"]);
    let (value, error) = mean(&path);
    z_test(&[Comparison {
        value: value.y,
        standard_error: error.y,
        expected: exact,
    }])
    .unwrap();
    // One sample is L_x or L_y, the former with a probability of about 2F: the error of 2^18 of them
    // in all is (L_y − L_x) √(2F/2^18) at most, for points that fill their cube evenly.
    let most = (y - x) * (2.0 * fresnel / 262_144.0_f64).sqrt();
    assert!(error.y < 1.2 * most, "{error}, {most}");
}

/// In a closed room of M = π and ρ = ½ every ray sees L = 2, whatever perfect mirrors and clear
/// glass stand in it: they neither make nor take light.
#[test]
fn mirrors_and_glass_leave_the_furnace_alone() {
    let walls = Part {
        name: "walls",
        reflectance: Reflectance::splat(0.5),
        emission: Radiance::splat(1.0),
        faces: room(DVec3::ZERO, DVec3::new(3.0, 2.5, 2.0)),
    };
    let boxes = [DVec3::new(0.4, 0.4, 0.4), DVec3::new(1.8, 0.4, 0.4)];
    let [mirror, glass] = boxes.map(|lower| solid_box(lower, lower + 0.8));
    let parts = [
        walls,
        Part::grey("mirror", 0.0, mirror),
        Part::grey("glass", 0.0, glass),
    ];
    let scene = scene("furnace", parts);
    let toml = "[material.mirror]\nmirror = 1\n[material.glass]\nglass = 1.5\n\
                [[camera]]\nname = \"main\"\nposition = [1.5, 2.2, 1.9]\nlook_at = [1.5, 0.4, 0.4]\n\
                up = [0, 1, 0]\nfov = 80\nfov_axis = \"x\"\nsize = [24, 24]\n";
    let path = picture(&scene, toml, &["--integrator", "path", "--spp", "64"]);
    let (value, error) = mean(&path);
    z_test(&[Comparison {
        value: value.y,
        standard_error: error.y,
        expected: 2.0,
    }])
    .unwrap();
    // Whitted follows mirrors and glass from the eye only: diffuse light sees them black, so that
    // pictures are darker, never brighter, and nothing is below what the walls emit themselves
    // but what its recursion leaves at the eighth event, inside the glass.
    let whitted = picture(&scene, toml, &["--integrator", "whitted", "--spp", "16"]);
    let (value, error) = mean(&whitted);
    assert!(
        value.y < 2.0 + 4.0 * error.y && value.y > 1.0,
        "{value} {error}"
    );
}
