//! Scenes whose radiance is known, against every integrator.

use super::ao::{self, AmbientOcclusion, Falloff};
use super::gather::{self, Gatherer};
use super::path::PathTracer;
use super::radiosity::RadiosityView;
use super::whitted::{self, Highlight, Whitted};
use super::*;
use crate::camera::CameraFrame;
use crate::film::{Alike, Moments};
use crate::progress::Silent;
use glam::DVec3;
use luxel_scenes::{
    Camera, FieldOfView, Intensity, Irradiance, Light, LightKind, Material, Projection, Radiance,
    Reflectance, Scene, Specular,
};
use luxel_solver::gather::{Components, Lookup};
use luxel_solver::patches::{PatchSize, Patches};
use luxel_solver::radiosity::{RadiosityConfig, RadiositySolution, solve};
use luxel_solver::solvers::{Config, Tolerance};

/// A scene from the data folder.
fn example(name: &str) -> Scene {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/data");
    let loaded = luxel_scenes::load(format!("{folder}/{name}/{name}.toml"));
    loaded.expect("a readable example scene").scene
}

/// A camera at `position` that looks at `look_at`, 60° wide.
fn camera(position: DVec3, look_at: DVec3, size: [usize; 2]) -> CameraFrame {
    let camera = Camera {
        name: "test".into(),
        position,
        look_at,
        up: DVec3::new(0.1, 1.0, 0.2),
        projection: Projection::Perspective {
            fov: FieldOfView::Horizontal(1.0),
        },
        size,
    };
    CameraFrame::new(&camera, size).expect("a valid camera")
}

/// Adds a rectangle centred at `centre` with half sides `u` and `v`; its front looks along u × v.
fn rectangle(scene: &mut Scene, centre: DVec3, u: DVec3, v: DVec3, material: Material) {
    let object = scene.push_object(format!("object {}", scene.objects.len()));
    let material = scene.push_material(material);
    let corners = [
        centre - u - v,
        centre + u - v,
        centre + u + v,
        centre - u + v,
    ];
    scene.push_face(&corners, object, material);
}

fn lamp(radiance: f64) -> Material {
    Material::diffuse("lamp", Reflectance::ZERO).with_emission(Radiance::splat(radiance))
}

fn with_specular(specular: Specular) -> Material {
    Material {
        specular,
        ..Material::diffuse("specular", Reflectance::ZERO)
    }
}

fn solution(world: &World<'_>, patches: &Patches, replicate: u64) -> RadiositySolution {
    let config = RadiosityConfig {
        rays: 64,
        shadow_rays: 4,
        solver: Config {
            tolerance: Tolerance::Error(1e-9),
            max_iterations: 1000,
        },
        seed: 1,
        replicate,
    };
    solve(world, patches, &config).expect("valid reflectances")
}

const GATHER: gather::Config = gather::Config {
    rays: 16,
    shadow_rays: 16,
    seed: 1,
};

const WHITTED: whitted::Config = whitted::Config {
    depth: 8,
    highlight: Highlight::Phong,
    ambient: Irradiance::ZERO,
    shadow_rays: 4,
    seed: 1,
};

/// The value along one ray, from the middle of the picture.
fn look(integrator: &dyn Integrator, camera: &CameraFrame) -> f64 {
    let [width, height] = camera.size();
    let ray = camera.ray(DVec2::new(width as f64 / 2.0, height as f64 / 2.0));
    let key = SampleKey {
        item: 0,
        replicate: 0,
        index: 0,
    };
    let mut seen = [Seen::default()];
    integrator.estimate(&[ray], &[key], &mut seen);
    seen[0].value.x
}

/// Mean and standard error of independent estimates along the middle ray.
fn look_often(integrator: &dyn Integrator, camera: &CameraFrame, count: u64) -> (f64, f64) {
    let [width, height] = camera.size();
    let ray = camera.ray(DVec2::new(width as f64 / 2.0, height as f64 / 2.0));
    let keys: Vec<SampleKey> = (0..count)
        .map(|item| SampleKey {
            item,
            replicate: 0,
            index: 0,
        })
        .collect();
    let mut seen = vec![Seen::default(); keys.len()];
    integrator.estimate(&vec![ray; keys.len()], &keys, &mut seen);
    let mut moments = Moments::default();
    for seen in seen {
        moments.add(seen.value);
    }
    let error = moments.standard_error().expect("many estimates");
    (moments.mean().x, error.x)
}

#[test]
fn the_furnace_glows_evenly_in_every_integrator() {
    // Closed, emission 1 and reflectance 1/2 everywhere: L = 1 + L/2 = 2.
    let scene = example("furnace");
    let world = World::new(&scene);
    let (lower, upper) = scene.bounds().expect("faces");
    let middle = (lower + upper) / 2.0;
    let frame = camera(
        middle + DVec3::new(0.1, -0.2, 0.3),
        upper - DVec3::splat(0.1),
        [12, 8],
    );
    let patches = world.mesh(PatchSize::Count(300)).expect("a mesh");
    let solutions: Vec<_> = (0..2).map(|r| solution(&world, &patches, r)).collect();
    let samples = Samples::new(4, 1);

    let view = RadiosityView::new(&world, &patches, &solutions);
    for value in expose(&view, &frame, samples, &Silent).values() {
        // What the iteration leaves.
        let worst = (value - 2.0).abs().max_element();
        assert!(worst < 1e-6, "radiosity: off by {worst}");
    }

    // What the solution shows is what chains would find: ending them by chance makes no noise. Looked up
    // in f32, a solution that the iteration left at 1e-9.
    let lookup = Lookup::new(patches, &solutions);
    let gatherer = || Gatherer::new(&world, &lookup, GATHER);
    let exact: [(&str, Box<dyn Integrator>); 2] = [
        ("gather", Box::new(gatherer())),
        (
            "whitted",
            Box::new(Whitted::new(&world, Some(gatherer()), WHITTED)),
        ),
    ];
    for (name, integrator) in &exact {
        for value in expose(integrator.as_ref(), &frame, samples, &Silent).values() {
            let worst = (value - 2.0).abs().max_element();
            assert!(worst < 1e-6, "{name}: off by {worst}");
        }
    }

    // Paths end by chance: right on average.
    let tracer = PathTracer::new(&world, 1);
    let film = expose(&tracer, &frame, Samples::new(64, 1), &Silent);
    let (mean, error) = pooled(&film);
    assert!(
        (mean - 2.0).abs() < 4.0 * error && error < 0.01,
        "path: {mean} +- {error}"
    );
}

/// Mean of the red channel over a film, with its standard error.
fn pooled(film: &Film) -> (f64, f64) {
    let errors = film.errors(Alike::Neighbours).expect("replicates");
    let count = errors.len() as f64;
    let mean = film.values().map(|value| value.x).sum::<f64>() / count;
    let variance: f64 = errors.iter().map(|error| error.sampling.x.powi(2)).sum();
    (mean, variance.sqrt() / count)
}

/// What a film of one point holds, with its standard error: four replicates.
fn at_a_point(add: impl Fn(&mut Film)) -> (f64, f64) {
    let mut film = Film::new([1, 1], 4);
    add(&mut film);
    let errors = film.errors(Alike::Values).expect("replicates");
    let value = film.values().next().expect("a value");
    (value.x, errors[0].total().x)
}

#[test]
fn a_mirror_shows_what_stands_behind_the_camera() {
    let mut scene = Scene::default();
    let mirror = with_specular(Specular::Mirror {
        reflectance: Rgb::splat(0.8),
    });
    rectangle(&mut scene, DVec3::ZERO, DVec3::X, DVec3::Y, mirror);
    rectangle(
        &mut scene,
        DVec3::Z * 3.0,
        DVec3::Y * 2.0,
        DVec3::X * 2.0,
        lamp(5.0),
    );
    let world = World::new(&scene);
    let frame = camera(DVec3::new(0.0, 0.0, 2.0), DVec3::ZERO, [9, 9]);
    let whitted = look(&Whitted::new(&world, None, WHITTED), &frame);
    assert!((whitted - 4.0).abs() < 1e-12, "{whitted}");
    // A mirror without diffuse part is followed by every path: no variance.
    let path = look(&PathTracer::new(&world, 1), &frame);
    assert!((path - 4.0).abs() < 1e-12, "{path}");
}

/// A slab of glass of index 1.5 between the camera and a lamp of radiance 1.
fn slab() -> Scene {
    let mut scene = Scene::default();
    let glass = || {
        with_specular(Specular::Glass {
            index_of_refraction: 1.5,
            transmittance: Rgb::ONE,
        })
    };
    let (x, y, z) = (DVec3::X * 4.0, DVec3::Y * 4.0, DVec3::Z);
    rectangle(&mut scene, z * 0.2, x, y, glass());
    rectangle(&mut scene, z * -0.2, y, x, glass());
    rectangle(&mut scene, z * -2.0, x * 4.0, y * 4.0, lamp(1.0));
    scene
}

#[test]
fn a_glass_slab_passes_what_fresnel_says() {
    // Head on F = 4 %; with all inner reflections T = (1 − F)/(1 + F).
    let expected = 0.96 / 1.04;
    let scene = slab();
    let world = World::new(&scene);
    let frame = camera(DVec3::Z * 2.0, DVec3::ZERO, [9, 9]);
    let whitted = look(&Whitted::new(&world, None, WHITTED), &frame);
    // Rays of weight below 5e-5 are not followed: F⁴(1 − F) and smaller are missing.
    assert!((whitted - expected).abs() < 5e-5, "{whitted}");
    let (mean, error) = look_often(&PathTracer::new(&world, 1), &frame, 20_000);
    assert!((mean - expected).abs() < 4.0 * error, "{mean} +- {error}");
}

#[test]
fn rays_in_glass_are_shifted_as_snell_says() {
    // A lamp behind the slab covers x > 0 only. A ray that enters at 45° is shifted sideways by
    // d sin(θi − θt)/cos θt, so that the edge appears shifted by that much.
    let mut scene = slab();
    scene.faces.pop();
    let (x, y, z) = (DVec3::X, DVec3::Y * 4.0, DVec3::Z);
    rectangle(&mut scene, x * 4.0 - z * 2.0, x * 4.0, y, lamp(1.0));
    let world = World::new(&scene);
    let whitted = Whitted::new(&world, None, WHITTED);
    let incident = std::f64::consts::FRAC_PI_4;
    let refracted = (incident.sin() / 1.5).asin();
    // Across the slab the ray advances d tan θt instead of d tan θi along x.
    let shift = 0.4 * (incident.tan() - refracted.tan());
    for (offset, bright) in [(-1e-3, false), (1e-3, true)] {
        // Without the slab the ray from here would meet the plane z = −2 at x = shift + offset.
        let target = DVec3::new(shift + offset, 0.0, -2.0);
        let position = target + DVec3::new(-3.0, 0.0, 3.0);
        let value = look(&whitted, &camera(position, target, [9, 9]));
        assert_eq!(value > 0.5, bright, "offset {offset}: {value}");
    }
}

#[test]
fn highlights_follow_the_formula_and_the_inverse_square() {
    let mut scene = Scene::default();
    let glossy = with_specular(Specular::Glossy {
        reflectance: Rgb::splat(0.5),
        exponent: 20.0,
    });
    rectangle(
        &mut scene,
        DVec3::ZERO,
        DVec3::X * 5.0,
        DVec3::Y * 5.0,
        glossy,
    );
    scene.lights.push(Light {
        name: "point".into(),
        kind: LightKind::Point {
            position: DVec3::new(0.0, 0.0, 3.0),
            intensity: Intensity::splat(7.0),
        },
    });
    let world = World::new(&scene);
    // The viewer stands 30° from the normal, the light in the normal: α = 30° for Phong, 15° for
    // the half vector.
    let angle = std::f64::consts::FRAC_PI_6;
    let frame = camera(
        DVec3::new(angle.sin(), 0.0, angle.cos()) * 4.0,
        DVec3::ZERO,
        [9, 9],
    );
    let facing = 7.0 / 9.0;
    for (highlight, alpha) in [
        (Highlight::Phong, angle),
        (Highlight::BlinnPhong, angle / 2.0),
    ] {
        let config = whitted::Config {
            highlight,
            ..WHITTED
        };
        let value = look(&Whitted::new(&world, None, config), &frame);
        let expected = 0.5 * facing * alpha.cos().powi(20) / std::f64::consts::PI;
        // The hit point is known to f32.
        assert!((value / expected - 1.0).abs() < 1e-5, "{highlight:?}");
    }
}

#[test]
fn without_a_gatherer_surfaces_are_lit_directly_and_by_ambient_light() {
    let mut scene = Scene::default();
    let grey = Material::diffuse("grey", Reflectance::splat(0.5));
    rectangle(&mut scene, DVec3::ZERO, DVec3::X, DVec3::Y, grey);
    scene.lights.push(Light {
        name: "sun".into(),
        kind: LightKind::Directional {
            direction: DVec3::new(0.0, 0.6, -0.8),
            irradiance: Irradiance::splat(10.0),
        },
    });
    let world = World::new(&scene);
    let frame = camera(DVec3::Z * 2.0, DVec3::ZERO, [9, 9]);
    let config = whitted::Config {
        ambient: Irradiance::splat(2.0),
        ..WHITTED
    };
    let value = look(&Whitted::new(&world, None, config), &frame);
    let expected = 0.5 * (8.0 + 2.0) / std::f64::consts::PI;
    assert!((value / expected - 1.0).abs() < 1e-12, "{value}");
    let path = look(&PathTracer::new(&world, 1), &frame);
    let expected = 0.5 * 8.0 / std::f64::consts::PI;
    assert!((path / expected - 1.0).abs() < 1e-12, "{path}");
}

#[test]
fn backs_of_one_sided_faces_are_black_and_others_shine_on_both() {
    let mut scene = Scene::default();
    rectangle(&mut scene, DVec3::ZERO, DVec3::X, DVec3::Y, lamp(3.0));
    let both = Material {
        sidedness: luxel_scenes::Sidedness::Both,
        ..lamp(4.0)
    };
    rectangle(&mut scene, DVec3::Z, DVec3::X, DVec3::Y, both);
    let world = World::new(&scene);
    let path = PathTracer::new(&world, 1);
    let see = |from: f64, to: f64| {
        let frame = camera(DVec3::Z * from, DVec3::Z * to, [9, 9]);
        look(&path, &frame)
    };
    let values = [see(-2.0, 0.0), see(0.5, 0.0), see(0.5, 1.0), see(3.0, 1.0)];
    assert_eq!(values, [0.0, 3.0, 4.0, 4.0]);
}

#[test]
fn irradiance_by_paths_agrees_with_closed_forms() {
    // A square lamp of side 2 at height 1 above a point: the differential configuration factor of
    // a rectangle seen from below its corner (Howell C-15), four times.
    let mut scene = Scene::default();
    rectangle(&mut scene, DVec3::Z, DVec3::Y, DVec3::X, lamp(1.0));
    let white = Material::diffuse("floor", Reflectance::splat(0.5));
    rectangle(
        &mut scene,
        DVec3::ZERO,
        DVec3::X * 0.1,
        DVec3::Y * 0.1,
        white,
    );
    let world = World::new(&scene);
    let receivers = world.receivers(&[DVec3::ZERO], &[DVec3::Z]);
    let s = 1.0 / 2f64.sqrt();
    let factor = 4.0 / std::f64::consts::TAU * (2.0 * s * s.atan());
    let tracer = PathTracer::new(&world, 1);
    let irradiance = |components| {
        at_a_point(|film| tracer.irradiance(film, &receivers, components, &[1024], &Silent))
    };
    let expected = std::f64::consts::PI * factor;
    let (direct, error) = irradiance(Components::Direct);
    assert!(
        (direct - expected).abs() < 4.0 * error.max(1e-12),
        "{direct} +- {error}, not {expected}"
    );
    // The lamp reflects nothing, and everything else escapes.
    assert_eq!(irradiance(Components::Indirect), (0.0, 0.0));
    assert_eq!(irradiance(Components::All).0, direct);
}

#[test]
fn a_uniform_sky_gives_an_open_point_pi_times_its_radiance() {
    let mut scene = Scene::default();
    let grey = Material::diffuse("floor", Reflectance::splat(0.5));
    rectangle(&mut scene, DVec3::ZERO, DVec3::X, DVec3::Y, grey);
    scene.lights.push(Light {
        name: "sky".into(),
        kind: LightKind::Sky {
            sky: luxel_scenes::Sky::Uniform {
                radiance: Radiance::splat(2.0),
            },
            up: DVec3::Z,
            ground: Radiance::ZERO,
        },
    });
    let world = World::new(&scene);
    let receivers = world.receivers(&[DVec3::ZERO], &[DVec3::Z]);
    let tracer = PathTracer::new(&world, 1);
    let (value, _) =
        at_a_point(|film| tracer.irradiance(film, &receivers, Components::All, &[8], &Silent));
    let expected = std::f64::consts::TAU;
    assert!((value - expected).abs() < 1e-12);
}

const OCCLUSION: ao::Config = ao::Config {
    rays: 4096,
    max_distance: None,
    falloff: Falloff::Sharp,
    seed: 1,
};

/// Ambient occlusion and its standard error at one point of a floor before a wall of height 1 at
/// x = 0.
fn occlusion_by_a_wall(distance: f64, config: ao::Config) -> (f64, f64) {
    let mut scene = Scene::default();
    let grey = || Material::diffuse("grey", Reflectance::splat(0.5));
    let long = DVec3::Y * 1e3;
    rectangle(&mut scene, DVec3::ZERO, DVec3::X * 100.0, long, grey());
    rectangle(&mut scene, DVec3::Z * 0.5, long, DVec3::Z * 0.5, grey());
    let world = World::new(&scene);
    let receivers = world.receivers(&[DVec3::X * distance], &[DVec3::Z]);
    let occlusion = AmbientOcclusion::new(&world, config);
    at_a_point(|film| occlusion.at_receivers(film, &receivers, &[1], &Silent))
}

#[test]
fn a_wall_occludes_as_the_closed_form_says() {
    // An infinitely long wall of height h at distance d: A = (1 + d/√(d² + h²))/2.
    for distance in [0.1, 1.0, 10.0] {
        let (open, error) = occlusion_by_a_wall(distance, OCCLUSION);
        let expected = 0.5 * (1.0 + distance / distance.hypot(1.0));
        // Four replicates know their error to 40 %; the floor is one ray in 16384.
        let allowed = 6.0 * error.max(1e-4);
        assert!((open - expected).abs() < allowed, "{open} not {expected}");
    }
}

#[test]
fn distance_limits_what_occludes() {
    let near = ao::Config {
        max_distance: Some(0.5),
        ..OCCLUSION
    };
    assert_eq!(occlusion_by_a_wall(0.6, near).0, 1.0);
    let sharp = occlusion_by_a_wall(0.2, near).0;
    let smooth = ao::Config {
        falloff: Falloff::Smooth,
        ..near
    };
    let smooth = occlusion_by_a_wall(0.2, smooth).0;
    assert!(sharp < smooth && smooth < 1.0, "{sharp} {smooth}");
}

#[test]
fn a_value_does_not_depend_on_its_batch() {
    let scene = example("cornell");
    let world = World::new(&scene);
    let patches = world.mesh(PatchSize::Count(300)).expect("a mesh");
    let solutions = [solution(&world, &patches, 0)];
    let frame = CameraFrame::new(&scene.cameras[0], [16, 16]).expect("a valid camera");
    let lookup = Lookup::new(patches, &solutions);
    let gatherer = Gatherer::new(&world, &lookup, GATHER);
    let path = PathTracer::new(&world, 1);
    let rays: Vec<CameraRay> = (0..256)
        .map(|i| frame.ray(DVec2::new(f64::from(i % 16), f64::from(i / 16))))
        .collect();
    let keys: Vec<SampleKey> = (0..256)
        .map(|item| SampleKey {
            item,
            replicate: 0,
            index: 3,
        })
        .collect();
    for integrator in [&gatherer as &dyn Integrator, &path] {
        let mut all = vec![Seen::default(); 256];
        integrator.estimate(&rays, &keys, &mut all);
        let mut part = vec![Seen::default(); 5];
        integrator.estimate(&rays[100..105], &keys[100..105], &mut part);
        assert_eq!(part, all[100..105]);
    }
}
