//! Agreement of independent methods: every integrator and operator in the furnace, the gather and
//! the path tracer on the Cornell box.

use luxel::image::exr::{self, Picture};
use luxel_scenes::Rgb;
use luxel_tests::command::{arg, luxel};
use luxel_tests::hypothesis::{SIGNIFICANCE, sidak};
use luxel_tests::special::normal_two_sided;
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

fn scene(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../scenes/data/{name}/{name}.toml"))
}

fn render(name: &str, options: &[&str]) -> Picture {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out.exr");
    let file = scene(name);
    let mut args = vec!["render", arg(&file), "-o", arg(&out), "-q"];
    args.extend(options);
    luxel(&args).assert_success();
    exr::read(&out).expect("a picture")
}

/// Value and standard error of each pixel.
fn pixels(picture: &Picture) -> Vec<(Rgb, Rgb)> {
    let errors = picture
        .layers
        .iter()
        .find(|(name, _)| name == "standard_error");
    let (_, errors) = errors.expect("pictures carry their standard error");
    let vector = |pixel: &[f32; 3]| Rgb::from_array(pixel.map(f64::from));
    let values = picture.image.pixels.iter().map(vector);
    values.zip(errors.pixels.iter().map(vector)).collect()
}

/// L = 2 in every pixel: to rounding where nothing is sampled, else within the noise.
#[test]
fn every_integrator_sees_the_furnace_evenly() {
    let exact = render("furnace", &["--integrator", "radiosity", "--size", "24x24"]);
    for pixel in exact.image.pixels {
        // The solver's tolerance is 1e-7 of the largest radiosity.
        assert!(pixel.iter().all(|&l| (l - 2.0).abs() < 1e-6), "{pixel:?}");
    }
    for integrator in ["gather", "whitted", "path"] {
        let options = ["--integrator", integrator, "--size", "16x16", "--spp", "16"];
        let values = pixels(&render("furnace", &options));
        let mean = values.iter().map(|(value, _)| value.x).sum::<f64>() / values.len() as f64;
        let variance: f64 = values.iter().map(|(_, error)| error.x * error.x).sum();
        let sigma = variance.sqrt() / values.len() as f64;
        // 1e-6 for the solver; the gather's near chain ends by Russian roulette.
        assert!(
            (mean - 2.0).abs() < 4.0 * sigma + 1e-6,
            "{integrator}: {mean} ± {sigma}"
        );
    }
}

/// B = 2π for every object, by every way of computing form factors and every solver: rows sum to
/// one exactly (ray-cast, hemicube) or within 1e-10 (analytic), amplified by ρ / (1 − ρ) = 1.
#[test]
fn every_operator_and_solver_gives_the_furnace() {
    let file = scene("furnace");
    // Every solver runs on every operator in the solver's own tests; here each appears once.
    let dense = [
        ["--form-factors", "analytic", "--solver", "jacobi"],
        ["--form-factors", "analytic", "--solver", "direct"],
        ["--form-factors", "raycast", "--solver", "gauss-seidel"],
        ["--form-factors", "hemicube", "--solver", "jacobi"],
    ];
    let mut variants = vec![Vec::new()];
    variants.extend(dense.map(|options| [&options[..], &["--patch-size", "whole"]].concat()));
    for options in variants {
        let mut args = vec!["solve", arg(&file), "--json", "-q"];
        args.extend(&options);
        let outcome = luxel(&args);
        outcome.assert_success();
        let json = outcome.json();
        let objects = json["objects"].as_object().expect("objects by name");
        assert!(!objects.is_empty());
        for (name, object) in objects {
            for channel in object["radiosity"].as_array().expect("three channels") {
                let b = channel.as_f64().expect("a number");
                assert!(
                    (b / (2.0 * PI) - 1.0).abs() < 1e-6,
                    "{options:?}: {name}: {b}"
                );
            }
        }
    }
}

/// Pixel by pixel the gather into a radiosity solution and the unbiased path tracer agree within
/// their noise and the patches' own error.
#[test]
fn the_gather_agrees_with_the_path_tracer_on_the_cornell_box() {
    let gather = render("cornell", &["--size", "48x48", "--spp", "64"]);
    let path = render(
        "cornell",
        &["--integrator", "path", "--size", "48x48", "--spp", "512"],
    );
    let pairs: Vec<_> = pixels(&gather).into_iter().zip(pixels(&path)).collect();
    // The error of 6000 patches is 0.2 % of the mean at 1000 points, and at most ten times the
    // typical one anywhere (next to creases): 2 % of a pixel.
    let patches = 0.02;
    let level = sidak(SIGNIFICANCE, pairs.len());
    let mut failing = 0;
    let (mut difference, mut total, mut variance) = (0.0, 0.0, 0.0);
    for ((a, a_error), (b, b_error)) in &pairs {
        let luminance = |c: &Rgb| c.element_sum() / 3.0;
        let d = luminance(a) - luminance(b);
        // Channels of a pixel go together: the mean error bounds that of the mean.
        let sigma = luminance(a_error).hypot(luminance(b_error));
        let beyond = (d.abs() - patches * luminance(b)).max(0.0);
        if beyond > 0.0 && normal_two_sided(beyond / sigma) < level {
            failing += 1;
        }
        // The lamp and the edges around it, a thousand times the rest, would drown the mean.
        if luminance(b) < 1.0 {
            difference += d;
            total += luminance(b);
            variance += sigma * sigma;
        }
    }
    // Mitsuba's rule for images: 99.75 % of the pixels.
    assert!(
        failing * 400 <= pairs.len(),
        "{failing} of {} pixels differ",
        pairs.len()
    );
    let sigma = variance.sqrt() / total;
    // The bias measured at points is below 0.1 %.
    assert!(
        (difference / total).abs() < 4.0 * sigma + 2e-3,
        "{} ± {sigma}",
        difference / total
    );
}

/// Without mirrors, glass and highlights Whitted's integrator is the gather.
#[test]
fn whitted_is_the_gather_on_diffuse_scenes() {
    let options = |integrator| ["--integrator", integrator, "--size", "24x24", "--spp", "16"];
    let [gather, whitted] = ["gather", "whitted"].map(|i| pixels(&render("cornell", &options(i))));
    let level = sidak(SIGNIFICANCE, gather.len());
    for ((a, a_error), (b, b_error)) in gather.iter().zip(&whitted) {
        let z = (a.y - b.y) / a_error.y.hypot(b_error.y).max(1e-12);
        // Four replicates tell little about a pixel's variance: their scatter is five times too
        // small once in a few hundred pixels, which the factor allows for.
        assert!(
            normal_two_sided(z / 5.0) > level,
            "{a} {a_error} against {b} {b_error}"
        );
    }
}
