//! Shadow masks: penumbrae, their sum, their files.

use super::lightmap_contents::{Places, agree, floor, manifest, many_lights, v};
use glam::DVec3;
use luxel::image::exr;
use luxel::lightmap::masks::{unoccluded, visible};
use luxel_scenes::{Material, Radiance, Reflectance, Rgb};
use luxel_solver::bounces::Bounces;
use luxel_solver::form_factors::point_to_polygon;
use luxel_solver::gather::{Components, Gathered};
use luxel_tests::builder::{Part, flipped, parallelogram, scene};
use luxel_tests::command::{arg, luxel};
use luxel_tests::hypothesis::{Comparison, z_test};
use luxel_tests::lightmaps::gathered;
use luxel_tests::scene_files;
use std::path::Path;

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
