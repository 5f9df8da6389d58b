//! Light that was reflected so many times, by the gather and by paths, in maps, at points and in pictures.

use super::lightmap_contents::{Places, agree, manifest, many_lights, push_sky, v};
use glam::DVec3;
use luxel::film::{Alike, Film};
use luxel::image::exr;
use luxel::integrators::path::PathTracer;
use luxel::progress::Silent;
use luxel_scenes::Irradiance;
use luxel_solver::bounces::Bounces;
use luxel_solver::gather::{Components, Gathered, MAX_REPLICATES};
use luxel_tests::command::{arg, luxel};
use luxel_tests::hypothesis::{Comparison, z_test};
use luxel_tests::lightmaps::gathered;
use luxel_tests::picture::{example, render};
use luxel_tests::probe::Probe;
use std::f64::consts::PI;

/// The furnace of emission π and reflectance 1/2: E after at most N bounces is π Σ 2^−k, in maps, at points by both methods, and in
/// pictures, where L = 1 + E / 2π.
#[test]
fn bounces_are_a_geometric_series() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = example("furnace");
    let points = folder.path().join("points.csv");
    std::fs::write(
        &points,
        "x,y,z,nx,ny,nz\n0.7,0,0.4,0,1,0\n1,1,1,0.6,0.8,0\n",
    )
    .expect("a table");
    for bounces in 0..=4 {
        let expected = PI * (0..=bounces).map(|k| 0.5_f64.powi(k)).sum::<f64>();
        let number = bounces.to_string();
        let out = folder.path().join(&number);
        let common = ["--bounces", &number, "-q"];
        let bake = ["bake", arg(&file), "-o", arg(&out), "--size", "64"];
        luxel(&[&bake[..], &common[..]].concat()).assert_success();
        let map = exr::read(&out.join("lightmap_000.exr")).expect("a map");
        for value in map.image.pixels.iter().flatten() {
            // What joining and fitting leave of a constant; see the furnace of all bounces.
            assert!(
                (f64::from(*value) / expected - 1.0).abs() < 1e-3,
                "{bounces}: {value}"
            );
        }
        let manifest = manifest(&out);
        assert_eq!(manifest.bounces, Some(bounces as u32));
        if bounces > 0 {
            let energy = manifest.lightmap.energy.expect("a ledger");
            // Of what 24 m² receive first the next reflection is left out.
            let left = 24.0 * PI * 0.5_f64.powi(bounces + 1);
            assert!(
                (energy.residual[0] / left - 1.0).abs() < 0.01,
                "{bounces}: {energy:?}"
            );
        }
        for method in ["gather", "path"] {
            let out = folder.path().join("out.csv");
            let probe = [
                "probe",
                arg(&file),
                "--points",
                arg(&points),
                "-o",
                arg(&out),
            ];
            let method = ["--integrator", method];
            let found = luxel(&[&probe[..], &method[..], &common[..]].concat());
            found.assert_success();
            for estimate in luxel_tests::probe::estimates(&out) {
                // Paths are noisy only where roulette ends them; 5 standard errors.
                let allowed = 5.0 * estimate.standard_error.x + 1e-6 * expected;
                let error = (estimate.value.x - expected).abs();
                assert!(error <= allowed, "{method:?} {bounces}: {estimate:?}");
            }
        }
        for method in ["gather", "whitted", "path"] {
            let options = ["--integrator", method, "--size", "16x16", "--spp", "64"];
            let picture = render(&file, &[&options[..], &["--bounces", &number]].concat());
            let sum: f64 = picture.image.pixels.iter().map(|p| f64::from(p[0])).sum();
            let mean = sum / 256.0;
            let shown = 1.0 + expected / (2.0 * PI);
            // 16 384 samples; a path's radiance scatters by less than itself.
            let allowed = if method == "path" {
                5.0 * shown / 128.0
            } else {
                1e-5
            };
            assert!(
                (mean - shown).abs() < allowed,
                "{method} {bounces}: {mean} for {shown}"
            );
        }
    }
}

/// In a furnished room and below an open sky gather and paths agree on light of at most one and two bounces, which is less than all.
#[test]
fn gather_and_paths_agree_on_every_bounce() {
    let mut open = many_lights();
    open.lights.clear();
    let sky =
        "[[light]]\nkind = \"sky\"\nmodel = \"uniform\"\nradiance = 1\nground_reflectance = 0.3\n";
    let points: Vec<(DVec3, DVec3)> = (0..12)
        .map(|i| (v(0.2 + 0.23 * f64::from(i), 0.0, 0.7), DVec3::Y))
        .chain((0..6).map(|i| (v(1.35, 0.05 + 0.12 * f64::from(i), 1.6), DVec3::Z)))
        .collect();
    for lights in ["", sky] {
        let mut before: Option<Vec<f64>> = None;
        let mut comparisons = Vec::new();
        for bounces in ["1", "2"] {
            let probe = |method: &str, rays: &str| {
                let arguments = ["--integrator", method, "--bounces", bounces, "--rays", rays];
                let probe = Probe {
                    scene: &open,
                    toml: lights,
                    points: points.clone(),
                    arguments: arguments
                        .iter()
                        .chain(&["--components", "indirect"])
                        .map(|s| (*s).to_owned())
                        .collect(),
                };
                probe.run(7)
            };
            let by_gather = probe("gather", "16384");
            let by_path = probe("path", "65536");
            for (a, b) in by_gather.iter().zip(&by_path) {
                comparisons.push(Comparison {
                    value: a.value.x,
                    standard_error: a.standard_error.x.hypot(b.standard_error.x),
                    expected: b.value.x,
                });
            }
            let sum: Vec<f64> = by_path.iter().map(|e| e.value.x).collect();
            if let Some(before) = &before {
                let rises = sum.iter().zip(before).filter(|(a, b)| a > b).count();
                assert_eq!(rises, sum.len(), "a second bounce adds light everywhere");
            }
            before = Some(sum);
        }
        z_test(&comparisons).unwrap_or_else(|error| panic!("{lights:?}: {error}"));
    }
}

/// Paths and the gather bake the same light: means of groups of luxels differ by no more than their noise, and a bias below half
/// a percent, which the size of patches leaves; and the errors that paths state are those that they have.
#[test]
fn paths_bake_what_the_gather_bakes() {
    let mut scene = many_lights();
    push_sky(&mut scene);
    let places = Places::new(&scene, 32);
    let receivers = &places.luxels.lit.receivers;
    let (by_gather, _) = gathered(
        &places.world,
        &places.luxels,
        Components::All,
        Bounces::All,
        0.005,
        2,
    );
    let tracer = PathTracer::new(&places.world, 4);
    let mut film = Film::new([receivers.len(), 1], MAX_REPLICATES as u32);
    let paths = film.evenly(1024);
    tracer.irradiance(&mut film, receivers, Components::All, &paths, &Silent);
    let errors = film.errors(Alike::Values).expect("four replicates");
    let level = film.values().map(|value| value.x).sum::<f64>() / receivers.len() as f64;
    let by_path: Vec<Gathered> = film
        .values()
        .zip(&errors)
        .zip(&by_gather)
        .map(|((value, error), gathered)| {
            let noise = gathered.standard_error().0;
            let own = error.total();
            Gathered {
                direct: Irradiance(value),
                direct_noise: Irradiance((own * own + noise * noise).map(f64::sqrt)),
                ..Gathered::default()
            }
        })
        .collect();
    let expected: Vec<f64> = by_gather.iter().map(|g| g.irradiance().0.x).collect();
    let ratio = agree(&by_path, &expected, 0.005 * level).expect("the same light");
    assert!((0.5..=1.5).contains(&ratio), "{ratio}");
}

/// `bake --integrator path` steers to the error that is asked for and says what it reached, the same at any number of threads.
#[test]
fn paths_bake_to_the_error_that_is_asked_for() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = example("cornell");
    let bake = |threads: &str, extra: &[&str]| {
        let out = folder.path().join(threads);
        let options = [
            "bake",
            arg(&file),
            "-o",
            arg(&out),
            "--size",
            "32",
            "-j",
            threads,
        ];
        let more = ["--integrator", "path", "--error", "10%", "--json"];
        let outcome = luxel(&[&options[..], &more[..], extra].concat());
        outcome.assert_success();
        (out, outcome.json())
    };
    let (one, json) = bake("1", &[]);
    let (two, _) = bake("2", &[]);
    let stated = json["stated"]["all"]["total"].as_f64().expect("a number");
    assert!(stated <= 0.1 && stated > 0.02, "{stated}");
    assert!(json["lightmap"]["energy"].is_null());
    for name in [
        "lightmap_000.exr",
        "lightmap_000_error.exr",
        "lightmap_000_luxels.exr",
    ] {
        let [one, two] = [&one, &two].map(|folder| std::fs::read(folder.join(name)));
        assert!(one.expect("a file") == two.expect("a file"), "{name}");
    }
}
