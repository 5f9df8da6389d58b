//! What lightmaps can hold: the sky alone, shadow masks; and which options go together.

use glam::DVec3;
use luxel::cli::ExitCode;
use luxel::image::exr;
use luxel::lightmap::bake::Luxels;
use luxel::lightmap::manifest::Manifest;
use luxel::lightmap::masks::{unoccluded, visible};
use luxel_scenes::{
    Intensity, Irradiance, Light, LightKind, Material, Radiance, Reflectance, Rgb, Scene, Sky,
};
use luxel_solver::bounces::Bounces;
use luxel_solver::direct::Lights;
use luxel_solver::form_factors::point_to_polygon;
use luxel_solver::gather::{Components, Gathered};
use luxel_solver::world::World;
use luxel_tests::builder::{Part, Polygon, flipped, parallelogram, room, scene, solid_box};
use luxel_tests::command::{arg, luxel};
use luxel_tests::hypothesis::{Comparison, t_test, z_test};
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
fn floor() -> Polygon {
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

/// A rectangular lamp half hidden by a straight edge: a point sees the part of the lamp beyond the plane through itself and the edge, and
/// V is Lambert's irradiance from that part over that from the whole. Below the horizon of the lamp's own face, and behind it, V is 0.
#[test]
fn masks_have_the_penumbra_of_a_straight_edge() {
    const LAMP: f64 = 2.0;
    const EDGE: f64 = 1.0;
    let lamp_from = |x: f64| parallelogram(v(x, LAMP, -0.5), DVec3::X * (0.5 - x), DVec3::Z);
    // The blade reaches far enough to both sides that no ray to the lamp goes around it.
    let blade = parallelogram(v(-9.0, EDGE, -9.0), DVec3::Z * 18.0, DVec3::X * 9.0);
    let mut scene = scene(
        "edge",
        [
            Part::grey("floor", 0.5, vec![floor()]),
            Part::grey("blade", 0.0, vec![blade.clone(), flipped(blade)]),
            Part::lamp("lamp", 10.0, vec![lamp_from(-0.5)]),
        ],
    );
    scene.objects[1].lightmap_scale = 0.0;
    let places = Places::new(&scene, 64);
    let named = places.world.lights().named(&scene);
    assert_eq!(named.len(), 1);
    let lit = places
        .world
        .lit_by(places.world.lights().only(&named[0].sources));
    let (light, _) = gathered(
        &lit,
        &places.luxels,
        Components::Direct,
        Bounces::AtMost(0),
        0.002,
        5,
    );
    let whole = unoccluded(&lit, &places.luxels.lit.receivers);
    let found = visible(&light, &whole);
    let exact = |&(position, normal): &(DVec3, DVec3)| {
        if normal.y < 0.5 || position.y > 0.5 {
            return 0.0;
        }
        // Where the line from the point over the edge, which runs along z at x = 0, meets the plane of the lamp.
        let from = position.x - position.x * LAMP / EDGE;
        let share = |from: f64| {
            if from < 0.5 {
                point_to_polygon(position, normal, &lamp_from(from.max(-0.5)))
            } else {
                0.0
            }
        };
        share(from) / share(-0.5)
    };
    let expected: Vec<f64> = places.points().iter().map(exact).collect();
    let partial = expected.iter().filter(|e| **e > 0.0 && **e < 1.0).count();
    assert!(partial > 300, "{partial} luxels in the penumbra");
    // The sampler's means are ratios, whose bias is a tenth of the noise of these hundreds of rays at most.
    let ratio = agree(&found, &expected, 2e-4).expect("the penumbra of an edge");
    assert!((0.5..=1.5).contains(&ratio), "{ratio}");
    // Outside of the penumbra nothing is uncertain.
    for (found, expected) in found.iter().zip(&expected) {
        if *expected == 0.0 {
            assert!(found.direct.0.x == 0.0, "{found:?}");
        } else if *expected >= 1.0 {
            assert!((found.direct.0.x - 1.0).abs() < 1e-12, "{found:?}");
        }
    }
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

/// Σ V E⁰ over all lights is the direct light: by luxels without noise exactly, by groups of the others within what is stated.
#[test]
fn masks_add_up_to_direct_light() {
    let scene = many_lights();
    let places = Places::new(&scene, 64);
    let receivers = &places.luxels.lit.receivers;
    let (direct, _) = gathered(
        &places.world,
        &places.luxels,
        Components::Direct,
        Bounces::All,
        0.01,
        1,
    );
    let named = places.world.lights().named(&scene);
    assert_eq!(named.len(), 5);
    let mut sum = vec![Gathered::default(); receivers.len()];
    for (seed, light) in (10..).zip(&named) {
        let lit = places
            .world
            .lit_by(places.world.lights().only(&light.sources));
        let whole = unoccluded(&lit, receivers);
        let (of_light, _) = gathered(
            &lit,
            &places.luxels,
            Components::Direct,
            Bounces::AtMost(0),
            0.01,
            seed,
        );
        let shares = visible(&of_light, &whole);
        for (((sum, share), whole), receiver) in
            sum.iter_mut().zip(&shares).zip(&whole).zip(receivers)
        {
            // What an engine does: the irradiance that it computes itself, by channel, times the share.
            let own: Rgb = lit
                .lights()
                .sources()
                .iter()
                .map(|source| source.irradiance(receiver.position, receiver.normal))
                .sum();
            assert!((own.element_sum() - whole).abs() <= 1e-12 * whole);
            sum.direct.0 += own * share.direct.0;
            let noise = own * share.direct_noise.0;
            let before = sum.direct_noise.0;
            sum.direct_noise.0 = (before * before + noise * noise).map(f64::sqrt);
            if light.name == "bulb" || light.name == "sun" || light.name == "spot" {
                assert!([0.0, 1.0].contains(&share.direct.0.x.round()));
                assert!((share.direct.0.x - share.direct.0.x.round()).abs() < 1e-12);
                assert_eq!(share.direct_noise.0, Rgb::ZERO);
            }
        }
    }
    let mut comparisons = Vec::new();
    for (sum, direct) in sum.chunks(32).zip(direct.chunks(32)) {
        let mean =
            |of: &dyn Fn(usize) -> f64| (0..sum.len()).map(of).sum::<f64>() / sum.len() as f64;
        let square =
            |i: usize| sum[i].direct_noise.0.x.powi(2) + direct[i].direct_noise.0.x.powi(2);
        // Means of groups; sums of five and of some thirty terms are rounded.
        let expected = mean(&|i| direct[i].direct.0.x);
        let value = mean(&|i| sum[i].direct.0.x);
        comparisons.push(Comparison {
            value: if (value - expected).abs() <= 1e-9 {
                expected
            } else {
                value
            },
            standard_error: (mean(&square) / sum.len() as f64).sqrt(),
            expected,
        });
    }
    z_test(&comparisons).expect("sums of shares are direct light");
}

/// Masks as files: five lights in two pictures, named, between 0 and 1; channels without a light hold 1.
#[test]
fn masks_are_delivered_four_lights_a_picture() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let lights = "[[light]]\nkind = \"point\"\nname = \"bulb\"\nposition = [0.4, 1.2, 0.4]\nwatts_per_steradian = 1\n\
                  [[light]]\nkind = \"directional\"\nname = \"sun\"\ndirection = [0.3, -1, -1.2]\nwatts_per_square_metre = 2\n";
    let mut scene = many_lights();
    for x in [0.2, 1.4] {
        let name = if x < 1.0 { "third" } else { "fourth" };
        let object = scene.push_object(name);
        let lamp = Material::diffuse(name, Reflectance::ZERO).with_emission(Radiance::splat(1.0));
        let material = scene.push_material(lamp);
        let face = parallelogram(v(x, 1.97, 2.0), DVec3::X * 0.3, DVec3::Z * 0.3);
        scene.push_face(&face, object, material);
    }
    let file = scene_files::write(&scene, folder.path(), lights);
    let bake = |out: &Path, threads: &str| {
        let options = ["bake", arg(&file), "-o", arg(out), "--size", "64", "-q"];
        let more = ["--include", "direct,masks", "--error", "2%", "-j", threads];
        luxel(&[&options[..], &more[..]].concat()).assert_success();
    };
    let [one, two] = ["one", "two"].map(|name| folder.path().join(name));
    bake(&one, "1");
    bake(&two, "2");
    let manifest = manifest(&one);
    let names: Vec<Vec<String>> = manifest
        .masks
        .iter()
        .map(|set| {
            let lights = set.lights.iter();
            lights
                .map(|light| format!("{} {} {}", light.channel, light.kind, light.name))
                .collect()
        })
        .collect();
    assert_eq!(
        names,
        [
            vec![
                "R point bulb",
                "G directional sun",
                "B surface lamp",
                "A surface other"
            ],
            vec!["R surface third", "G surface fourth"],
        ]
    );
    for set in &manifest.masks {
        for (channel, light) in ["R", "G", "B", "A"]
            .iter()
            .zip(set.lights.iter().map(Some).chain([None; 4]))
        {
            let page = &set.pages[0];
            let values = exr::read_channel(&one.join(&page.file), channel).expect("a channel");
            assert!(values.iter().all(|v| (0.0..=1.0).contains(v)));
            let Some(light) = light else {
                assert!(values.iter().all(|v| *v >= 1.0), "nothing is hidden");
                continue;
            };
            let errors = exr::read_channel(&one.join(&page.luxels), &format!("error.{channel}"));
            let errors = errors.expect("errors");
            let lit = manifest.atlas.lit as f64;
            let square: f64 = errors.iter().map(|e| f64::from(*e).powi(2)).sum();
            let rms = (square / lit).sqrt();
            // Single precision in the file.
            assert!(
                (rms - light.error.luxels).abs() <= 1e-6 * rms,
                "{rms} {light:?}"
            );
            assert!(rms <= 0.02, "as asked: {rms}");
            assert_eq!(rms == 0.0, light.kind != "surface", "{light:?}");
            let seen = values.iter().filter(|v| **v > 0.5).count();
            assert!(seen > 100, "{light:?} is seen by {seen} texels");
        }
        for page in &set.pages {
            for name in [&page.file, &page.error, &page.luxels] {
                let [one, two] = [&one, &two].map(|folder| std::fs::read(folder.join(name)));
                assert!(one.expect("a file") == two.expect("a file"), "{name}");
            }
        }
    }
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
