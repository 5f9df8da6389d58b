//! Agreement of independent methods: every integrator and operator in the furnace, the gather, the
//! path tracer and the radiosity view on the Cornell box, pictures and probes of occlusion.

use glam::DVec3;
use luxel::camera::CameraFrame;
use luxel::integrators::radiosity::RadiosityView;
use luxel::integrators::{Samples, expose};
use luxel::progress::Silent;
use luxel_scenes::Rgb;
use luxel_solver::patches::PatchSize;
use luxel_solver::radiosity::{RadiosityConfig, solve};
use luxel_solver::sampling::{Stage, hash};
use luxel_solver::solvers::{Config, Tolerance};
use luxel_solver::world::World;
use luxel_tests::builder::{Part, room, scene, solid_box};
use luxel_tests::command::{arg, luxel};
use luxel_tests::hypothesis::{Comparison, SIGNIFICANCE, sidak, z_test};
use luxel_tests::picture::{example, pixels, render};
use luxel_tests::probe::Probe;
use luxel_tests::scene_files;
use luxel_tests::special::normal_two_sided;
use std::f64::consts::PI;

/// L = 2 in every pixel: to rounding where nothing is sampled, else within the noise.
#[test]
fn every_integrator_sees_the_furnace_evenly() {
    let exact = render(
        &example("furnace"),
        &["--integrator", "radiosity", "--size", "24x24"],
    );
    for pixel in exact.image.pixels {
        // The solver's tolerance is 1e-7 of the largest radiosity.
        assert!(pixel.iter().all(|&l| (l - 2.0).abs() < 1e-6), "{pixel:?}");
    }
    for integrator in ["gather", "whitted", "path"] {
        let options = ["--integrator", integrator, "--size", "16x16", "--spp", "16"];
        let values = pixels(&render(&example("furnace"), &options));
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
    let file = example("furnace");
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
    let gather = render(&example("cornell"), &["--size", "48x48", "--spp", "64"]);
    let path = render(
        &example("cornell"),
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
    let [gather, whitted] =
        ["gather", "whitted"].map(|i| pixels(&render(&example("cornell"), &options(i))));
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

/// The radiosity solution shown as it is comes as near to the gather as its patches are small. With
/// views of n and 4n patches, e ∝ n^(−p/2): the error of the finer one is the difference of both over
/// 2^p − 1, at most 1.6 differences for the order p ≥ 0.7 that shadow edges leave of p = 1.
#[test]
fn the_radiosity_view_comes_near_the_gather_as_patches_shrink() {
    let scene = luxel_scenes::load(example("cornell"))
        .expect("a scene")
        .scene;
    let world = World::new(&scene);
    let camera = CameraFrame::new(&scene.cameras[0], [32, 32]).expect("a camera");
    let view = |count| {
        let patches = world.mesh(PatchSize::Count(count)).expect("a mesh");
        let config = RadiosityConfig {
            rays: 512,
            shadow_rays: 1,
            solver: Config {
                tolerance: Tolerance::Error(1e-6),
                max_iterations: 1000,
            },
            seed: 0,
            replicate: 0,
        };
        let solutions = [solve(&world, &patches, &config).expect("a solution")];
        let view = RadiosityView::new(&world, &patches, &solutions);
        let film = expose(&view, &camera, Samples::new(16, 0), &Silent);
        film.mean().pixels
    };
    let (coarse, fine) = (view(1500), view(6000));
    let gather = render(&example("cornell"), &["--size", "32x32", "--spp", "16"]);
    let gather = gather.image.pixels;
    // Without the lamp, which all show alike.
    let lit: Vec<usize> = (0..gather.len()).filter(|&i| gather[i][1] < 1.0).collect();
    let green = |image: &[[f32; 3]], i: usize| f64::from(image[i][1]);
    let level = lit.iter().map(|&i| green(&gather, i)).sum::<f64>() / lit.len() as f64;
    let rms = |a: &[[f32; 3]], b: &[[f32; 3]]| {
        let squares: f64 = lit
            .iter()
            .map(|&i| (green(a, i) - green(b, i)).powi(2))
            .sum();
        (squares / lit.len() as f64).sqrt() / level
    };
    let (step, error) = (rms(&coarse, &fine), rms(&fine, &gather));
    // The gather's own noise, about 1 % a pixel at 16 samples.
    assert!(
        error < (1.6 * step).hypot(0.01),
        "{error} after a step of {step}"
    );
    let bias = lit
        .iter()
        .map(|&i| green(&fine, i) - green(&gather, i))
        .sum::<f64>();
    let bias = bias / lit.len() as f64 / level;
    assert!(bias.abs() < 1.6 * step / 4.0, "bias {bias}, step {step}");
}

/// Ambient occlusion of pixels is that of points under them.
#[test]
fn pictures_and_probes_of_ambient_occlusion_agree() {
    const SIDE: usize = 6;
    const POINTS: usize = 16;
    let parts = [
        Part::grey("room", 0.5, room(DVec3::ZERO, DVec3::new(2.0, 2.0, 2.0))),
        Part::grey(
            "box",
            0.5,
            solid_box(DVec3::new(0.8, 0.0, 0.8), DVec3::splat(1.2)),
        ),
    ];
    let scene = scene("corner", parts);
    let folder = tempfile::tempdir().expect("a temporary folder");
    // Straight down on the floor between the walls and the box: 0.6 m at the corner of x and z.
    let toml = "[[camera]]\nname = \"main\"\nposition = [0.35, 1.9, 0.35]\nlook_at = [0.35, 0, 0.35]\n\
                up = [0, 0, -1]\nheight = 0.6\nsize = [6, 6]\n";
    let file = scene_files::write(&scene, folder.path(), toml);
    let options = ["--integrator", "ao", "--max-distance", "0.5", "--spp", "64"];
    let picture = pixels(&render(&file, &options));

    // 4 × 4 points in each pixel, each in its own cell at a place that looks random.
    let mut points = Vec::new();
    for pixel in 0..SIDE * SIDE {
        for point in 0..POINTS {
            let jitter = |d| hash::uniform(1, Stage(u32::MAX), (pixel * POINTS + point) as u64, d);
            let along = |cell: usize, sub: usize, d| {
                0.05 + 0.1 * (cell as f64 + (sub as f64 + jitter(d)) / 4.0)
            };
            let x = along(pixel % SIDE, point % 4, 0);
            let z = along(pixel / SIDE, point / 4, 1);
            points.push((DVec3::new(x, 0.0, z), DVec3::Y));
        }
    }
    let arguments = [
        "--quantity",
        "ao",
        "--max-distance",
        "0.5",
        "--rays",
        "1024",
    ];
    let probe = Probe {
        scene: &scene,
        toml: "",
        points,
        arguments: arguments.map(str::to_owned).into(),
    };
    let probed = probe.run(7);
    let mut comparisons = Vec::new();
    for ((value, error), points) in picture.iter().zip(probed.chunks(POINTS)) {
        let n = POINTS as f64;
        let mean = points.iter().map(|e| e.value.y).sum::<f64>() / n;
        // The scatter of points over the pixel bounds the error of their mean from above; it
        // holds the noise of each as well.
        let scatter = points
            .iter()
            .map(|e| (e.value.y - mean).powi(2))
            .sum::<f64>();
        comparisons.push(Comparison {
            value: value.y,
            standard_error: error.y.hypot((scatter / (n * (n - 1.0))).sqrt()),
            expected: mean,
        });
    }
    z_test(&comparisons).unwrap();
    // Openness differs over the picture: the test sees something.
    let range = picture.iter().map(|(v, _)| v.y).fold(0.0, f64::max)
        - picture.iter().map(|(v, _)| v.y).fold(1.0, f64::min);
    assert!(range > 0.2, "{range}");
}
