//! What lightmaps can hold: the sky alone; and which options go together.

use glam::DVec3;
use luxel::cli::ExitCode;
use luxel::image::exr;
use luxel::lightmap::bake::Luxels;
use luxel::lightmap::manifest::Manifest;
use luxel_scenes::{Intensity, Irradiance, Light, LightKind, Radiance, Scene, Sky};
use luxel_solver::bounces::Bounces;
use luxel_solver::direct::Lights;
use luxel_solver::gather::{Components, Gathered};
use luxel_solver::world::World;
use luxel_tests::builder::{Part, Polygon, parallelogram, room, scene, solid_box};
use luxel_tests::command::{arg, luxel};
use luxel_tests::hypothesis::t_test;
use luxel_tests::lightmaps::{atlas, gathered};
use luxel_tests::picture::example;
use luxel_tests::scene_files;
use std::f64::consts::PI;
use std::path::Path;

pub(super) fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// Adds a uniform sky of radiance 1 above the horizon.
pub(super) fn push_sky(scene: &mut Scene) {
    let kind = LightKind::Sky {
        sky: Sky::Uniform {
            radiance: Radiance::splat(1.0),
        },
        up: DVec3::Y,
        ground: Radiance::ZERO,
    };
    push_light(scene, "sky", kind);
}

fn push_light(scene: &mut Scene, name: &str, kind: LightKind) {
    let name = name.into();
    scene.lights.push(Light { name, kind });
}

/// A floor of 4 × 4 m about the origin, facing up.
pub(super) fn floor() -> Polygon {
    parallelogram(v(-2.0, 0.0, -2.0), DVec3::Z * 4.0, DVec3::X * 4.0)
}

/// The luxels of one page of a scene, in metres, with what is asked of them.
pub(super) struct Places<'s> {
    pub(super) world: World<'s>,
    pub(super) luxels: Luxels,
}

impl<'s> Places<'s> {
    pub(super) fn new(scene: &'s Scene, side: usize) -> Self {
        let world = World::new(scene);
        let luxels = Luxels::new(&world, &atlas(scene, side), 0.5);
        Self { world, luxels }
    }

    /// Positions in metres and normals.
    pub(super) fn points(&self) -> Vec<(DVec3, DVec3)> {
        let frame = self.world.surfaces().geometry().frame();
        let receivers = self.luxels.lit.receivers.iter();
        receivers
            .map(|receiver| (frame.to_world(receiver.position), receiver.normal))
            .collect()
    }
}

/// Bands of luxels, by what is expected of them, each of which must have the right mean.
const BANDS: usize = 4;

/// Tests that values at luxels have no bias beyond `known_to`, from the dark to the bright, and returns their errors over those that
/// are stated, root mean square. How far single luxels are off is known by what all of them tell; their own few replicates say
/// little, so that the tests are of the scatter that there is and not of the stated one.
pub(super) fn agree(found: &[Gathered], expected: &[f64], known_to: f64) -> Result<f64, String> {
    let mut pairs: Vec<(f64, f64, f64)> = found
        .iter()
        .zip(expected)
        .map(|(g, &e)| (g.irradiance().0.x, g.standard_error().0.x, e))
        .filter(|(_, error, _)| *error > 0.0)
        .collect();
    assert!(pairs.len() > 200, "{} luxels are uncertain", pairs.len());
    pairs.sort_by(|a, b| a.2.total_cmp(&b.2));
    let rms =
        |of: &dyn Fn(&(f64, f64, f64)) -> f64| pairs.iter().map(|p| of(p).powi(2)).sum::<f64>();
    let ratio = (rms(&|p| p.0 - p.2) / rms(&|p| p.1)).sqrt();
    println!("{} luxels: errors over stated ones {ratio}", pairs.len());
    for band in pairs.chunks(pairs.len().div_ceil(BANDS)) {
        let differences: Vec<f64> = band.iter().map(|pair| pair.0 - pair.2).collect();
        let mean = differences.iter().sum::<f64>() / differences.len() as f64;
        t_test(&differences, mean.clamp(-known_to, known_to), BANDS)?;
    }
    Ok(ratio)
}

/// Under a uniform sky of radiance 1 an open plane receives π, exactly: no ray is blocked and all see the same. It is part of direct
/// light, here all of it, and of all light.
#[test]
fn the_sky_over_an_open_plane_is_pi() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let plane = scene("plane", [Part::grey("plane", 0.5, vec![floor()])]);
    let sky = "[[light]]\nkind = \"sky\"\nmodel = \"uniform\"\nradiance = 1\n";
    let file = scene_files::write(&plane, folder.path(), sky);
    let out = folder.path().join("out");
    let include = ["--include", "all,sky,direct"];
    let options = ["bake", arg(&file), "-o", arg(&out), "--size", "32", "-q"];
    luxel(&[&options[..], &include[..]].concat()).assert_success();
    for name in ["lightmap", "sky", "direct"] {
        let map = exr::read(&out.join(format!("{name}_000.exr"))).expect("a map");
        for value in map.image.pixels.iter().flatten() {
            // Single precision in the file; sums of some hundred terms before.
            let relative = f64::from(*value) / PI - 1.0;
            assert!(relative.abs() <= f64::from(f32::EPSILON), "{name}: {value}");
        }
    }
    let manifest = manifest(&out);
    let named: Vec<&str> = manifest
        .others
        .iter()
        .map(|layer| layer.include.as_str())
        .collect();
    assert_eq!(named, ["sky", "direct"]);
    assert!(
        manifest.others[0].error.total <= 1e-7,
        "nothing is uncertain"
    );
}

pub(super) fn manifest(folder: &Path) -> Manifest {
    let text = std::fs::read_to_string(folder.join("manifest.json")).expect("a manifest");
    serde_json::from_str(&text).expect("a manifest")
}

/// A wall of height h at a distance d, of no end to both sides, leaves π L (1 + cos α)/2 of a uniform sky with tan α = h/d; the stated
/// errors of luxels are about those that there are. The lamp, which the wall hides, does not count.
#[test]
fn a_wall_hides_its_share_of_the_sky() {
    /// Half the length of the wall. What lies beyond would cover (x / FAR)² of the hemisphere at most.
    const FAR: f64 = 300.0;
    const HEIGHT: f64 = 1.5;
    let wall = parallelogram(
        v(-2.0, 0.0, -FAR),
        DVec3::Y * HEIGHT,
        DVec3::Z * (2.0 * FAR),
    );
    let lamp = parallelogram(v(-5.0, 0.5, 0.0), DVec3::X * 0.1, DVec3::Z * 0.1);
    let mut scene = scene(
        "wall",
        [
            Part::grey("floor", 0.5, vec![floor()]),
            Part::grey("wall", 0.0, vec![wall]),
            Part::lamp("lamp", 10.0, vec![lamp]),
        ],
    );
    scene.objects[1].lightmap_scale = 0.0;
    scene.objects[2].lightmap_scale = 0.0;
    push_sky(&mut scene);
    let places = Places::new(&scene, 32);
    let sky = places.world.lit_by(Lights::sky_of(&scene));
    let (found, stated) = gathered(
        &sky,
        &places.luxels,
        Components::Direct,
        Bounces::All,
        0.01,
        3,
    );
    let exact = |(position, _): &(DVec3, DVec3)| {
        let distance = position.x + 2.0;
        PI * (1.0 + distance / distance.hypot(HEIGHT)) / 2.0
    };
    let expected: Vec<f64> = places.points().iter().map(exact).collect();
    assert!(found.len() > 700, "{} luxels", found.len());
    let known_to = PI * (4.0 / FAR).powi(2);
    agree(&found, &expected, known_to).expect("the sky above a wall");
    let count = found.len() as f64;
    let differences = found
        .iter()
        .zip(&expected)
        .map(|(g, e)| g.irradiance().0.x - e);
    let rms = (differences.map(|d| d * d).sum::<f64>() / count).sqrt();
    let made = rms / (expected.iter().sum::<f64>() / count);
    println!("sky: {made} is made, {stated} stated");
    // The square of the error is known to a few percent from 900 luxels; their noise has long tails, where the wall cuts the corner of a
    // square of directions that one ray stands for.
    assert!((0.7..=1.4).contains(&(made / stated)), "{made} of {stated}");
}

/// A room with a lamp, a point light, a spot and a sun through a window, and a box that casts shadows.
pub(super) fn many_lights() -> Scene {
    let mut faces = room(DVec3::ZERO, v(3.0, 2.0, 3.0));
    // Without the wall at z+, through which the sun shines.
    faces.pop();
    let lamp = parallelogram(v(0.5, 1.99, 0.5), DVec3::X * 0.6, DVec3::Z * 0.6);
    let other = parallelogram(v(2.2, 1.98, 0.5), DVec3::X * 0.4, DVec3::Z * 0.4);
    let mut scene = scene(
        "lights",
        [
            Part::grey("room", 0.5, faces),
            Part::grey("box", 0.5, solid_box(v(1.0, 0.0, 1.0), v(1.7, 0.8, 1.6))),
            Part::lamp("lamp", 5.0, vec![lamp]),
            Part::lamp("other", 5.0, vec![other]),
        ],
    );
    push_light(
        &mut scene,
        "bulb",
        LightKind::Point {
            position: v(0.4, 1.2, 0.4),
            intensity: Intensity::new(1.0, 0.8, 0.5),
        },
    );
    push_light(
        &mut scene,
        "spot",
        LightKind::Spot {
            position: v(2.5, 1.8, 2.5),
            direction: v(-1.0, -1.5, -1.0).normalize(),
            intensity: Intensity::splat(3.0),
            inner_angle: 0.3,
            outer_angle: 0.5,
        },
    );
    push_light(
        &mut scene,
        "sun",
        LightKind::Directional {
            direction: v(0.3, -1.0, -1.2).normalize(),
            irradiance: Irradiance::splat(2.0),
        },
    );
    scene
}

#[test]
fn what_makes_no_sense_together_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    let cornell = example("cornell");
    for (options, exit, words) in [
        ("--include sky", ExitCode::NothingToDo, "no sky"),
        ("--include masks", ExitCode::Usage, "direct,masks"),
        (
            "--include ao --bounces 2",
            ExitCode::Usage,
            "--include all or indirect",
        ),
        (
            "--include indirect --bounces 0",
            ExitCode::Usage,
            "1 or more",
        ),
        ("--bounces -1", ExitCode::Usage, "--bounces"),
        (
            "--include ao --integrator path",
            ExitCode::Usage,
            "--include all, direct",
        ),
        (
            "--include direct,masks --max-distance 1",
            ExitCode::Usage,
            "--include ao",
        ),
    ] {
        let mut args = vec!["bake", arg(&cornell), "-o", arg(&out), "-q"];
        args.extend(options.split(' '));
        let outcome = luxel(&args);
        assert_eq!(outcome.exit, exit, "{options}: {}", outcome.stderr);
        assert!(
            outcome.stderr.contains(words),
            "{options}: {}",
            outcome.stderr
        );
        assert!(!out.join("manifest.json").exists());
    }
    // A sky alone has no mask.
    let mut open = scene("open", [Part::grey("floor", 0.5, vec![floor()])]);
    open.name = "open".into();
    let sky = "[[light]]\nkind = \"sky\"\nmodel = \"uniform\"\nradiance = 1\n";
    let file = scene_files::write(&open, folder.path(), sky);
    let args = [
        "bake",
        arg(&file),
        "-o",
        arg(&out),
        "-q",
        "--include",
        "all,masks",
    ];
    let outcome = luxel(&args);
    assert_eq!(outcome.exit, ExitCode::NothingToDo);
    assert!(
        outcome.stderr.contains("leave masks out"),
        "{}",
        outcome.stderr
    );
    for (verb, options, words) in [
        (
            "render",
            "-o a.exr --integrator ao --bounces 1",
            "gather, whitted or path",
        ),
        ("render", "-o a.exr --max-distance 1", "--integrator ao"),
        (
            "probe",
            "--points p.csv --components direct --bounces 1",
            "--components all or indirect",
        ),
        (
            "probe",
            "--points p.csv --components indirect --bounces 0",
            "1 or more",
        ),
        ("probe", "--points p.csv --max-distance 1", "--quantity ao"),
    ] {
        let mut args = vec![verb, arg(&cornell)];
        args.extend(options.split(' '));
        let outcome = luxel(&args);
        assert_eq!(
            outcome.exit,
            ExitCode::Usage,
            "{options}: {}",
            outcome.stderr
        );
        assert!(
            outcome.stderr.contains(words),
            "{options}: {}",
            outcome.stderr
        );
    }
}
