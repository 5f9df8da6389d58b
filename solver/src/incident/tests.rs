//! Projections with a known answer: furnaces, even skies, single lights, half-hidden lamps.

use super::estimate::{Estimate, finish};
use super::harmonics::{
    BAND_0, BAND_1, MOST, basis, fluence_rate, irradiance, mean_irradiance, vector_irradiance,
};
use super::*;
use crate::adaptive::{Control, Stage as Work};
use crate::bounces::Bounces;
use crate::gather::ErrorParts;
use luxel_scenes::generate::{Surface, furnace_box};
use luxel_scenes::{
    Intensity, Irradiance, Light, LightKind, Material, Radiance, Reflectance, Scene, Sky,
};
use std::f64::consts::PI;

const CONFIG: IncidentConfig = IncidentConfig {
    rays: 256,
    rays_before: 0,
    shadow_rays: 64,
    components: Components::All,
    seed: 5,
};

const DIRECT: IncidentConfig = IncidentConfig {
    components: Components::Direct,
    ..CONFIG
};

/// Suits at the first result.
struct AtOnce;

impl Control for AtOnce {
    fn begin(&mut self, _: Work, _: f64, _: usize) -> f64 {
        1.0
    }
    fn advance(&mut self) -> bool {
        true
    }
    fn suits(&mut self, _: &ErrorParts) -> bool {
        true
    }
}

fn push(scene: &mut Scene, polygon: &[DVec3], radiance: f64) {
    let object = scene.push_object("part");
    let material = Material::diffuse("grey", Reflectance::ZERO);
    let material = scene.push_material(material.with_emission(Radiance::splat(radiance)));
    scene.push_face(polygon, object, material);
}

/// A parallelogram that looks along x × y.
fn parallelogram(corner: DVec3, x: DVec3, y: DVec3) -> [DVec3; 4] {
    [corner, corner + x, corner + x + y, corner + y]
}

fn light(scene: &mut Scene, kind: LightKind) {
    scene.lights.push(Light {
        name: "light".into(),
        kind,
    });
}

/// A black plate with corners one metre apart, so that a scene has an extent, well below what is asked about.
fn plate() -> Scene {
    let mut scene = Scene::default();
    let corner = DVec3::new(-0.5, -3.0, -0.5);
    push(&mut scene, &parallelogram(corner, DVec3::Z, DVec3::X), 0.0);
    scene
}

/// What arrives in the air at world positions, from sources alone.
fn direct(scene: &Scene, positions: &[DVec3], config: &IncidentConfig) -> Vec<Estimate<MOST>> {
    let world = World::new(scene);
    let frame = *world.surfaces().geometry().frame();
    let places: Vec<Place> = positions
        .iter()
        .map(|&p| Place::in_air(frame.to_unit(p)))
        .collect();
    let items: Vec<u64> = (0..places.len() as u64).collect();
    finish(&incident::<MOST>(&world, None, &places, &items, config))
}

#[track_caller]
fn assert_coefficients(found: &Estimate<MOST>, expected: [f64; MOST], tolerance: f64) {
    for (k, (found, expected)) in found.coefficients.iter().zip(expected).enumerate() {
        let error = (*found - Rgb::splat(expected)).abs().max_element();
        assert!(error <= tolerance, "{k}: {found} is not {expected}");
    }
}

/// Of an even sky L₀₀ = 2√π L to rounding whatever the rays are, and nothing else within what even points leave.
#[test]
fn an_even_sky_has_one_coefficient() {
    let mut scene = plate();
    let radiance = Radiance::splat(3.0);
    light(
        &mut scene,
        LightKind::Sky {
            sky: Sky::Uniform { radiance },
            up: DVec3::Y,
            ground: radiance,
        },
    );
    // So far above the plate that it covers 1e-12 of the sphere.
    let [found] = direct(&scene, &[DVec3::Y * 3e5], &DIRECT)[..] else {
        panic!("one place");
    };
    let expected = 3.0 / BAND_0;
    let error = (found.coefficients[0] - Rgb::splat(expected)).abs();
    assert!(error.max_element() < 1e-6 * expected, "{error}");
    for (k, coefficient) in found.coefficients.iter().enumerate().skip(1) {
        // Even points are no worse than independent ones, whose Σ Y/p/n has the variance 4π/n: 3σ of a thousand.
        let allowed = 3.0 * 3.0 * (4.0 * PI / 1024.0).sqrt();
        assert!(coefficient.abs().max_element() < allowed, "{k}");
    }
}

/// Of a distant light L_lm = E Y_lm, of a point I/d² Y_lm; both are single directions without noise. Behind the plate there is none.
#[test]
fn single_directions_are_exact() {
    let towards = DVec3::new(0.6, 0.64, -0.48);
    let mut scene = plate();
    light(
        &mut scene,
        LightKind::Directional {
            direction: -towards,
            irradiance: Irradiance::splat(2.0),
        },
    );
    let points = [DVec3::ZERO, DVec3::new(0.0, -3.1, 0.0)];
    let [above, below] = direct(&scene, &points, &DIRECT)[..] else {
        panic!("two places");
    };
    // Replicates are held in single precision.
    let rounding = 2.0 * f64::from(f32::EPSILON);
    assert_coefficients(&above, basis(towards).map(|y| 2.0 * y), rounding);
    assert_coefficients(&below, [0.0; MOST], 0.0);
    assert_eq!(above.standard_error, [Rgb::ZERO; MOST]);

    let mut scene = plate();
    light(
        &mut scene,
        LightKind::Point {
            position: towards * 2.0,
            intensity: Intensity::splat(8.0),
        },
    );
    let found = direct(&scene, &points[..1], &DIRECT)[0];
    // Positions in the unit frame are exact to 1e-16, the rest is rounded to single precision.
    assert_coefficients(&found, basis(towards).map(|y| 2.0 * y), rounding);
}

/// A lamp that is wholly visible has exact coefficients, one that is half hidden those of the half that is seen, within noise.
#[test]
fn half_of_a_lamp_is_projected_as_the_half_that_it_is() {
    let lamp = |x: f64, width: f64| {
        let corner = DVec3::new(x, 2.0, -0.5);
        parallelogram(corner, DVec3::X * width, DVec3::Z)
    };
    let mut scene = plate();
    push(&mut scene, &lamp(-0.5, 1.0), 4.0);
    let seen = direct(&scene, &[DVec3::ZERO], &DIRECT)[0];
    let exact = |polygon: &[DVec3]| {
        let mut slices = Vec::new();
        let solid_angle = polygon::fan(DVec3::ZERO, polygon, &mut slices);
        polygon::coefficients::<MOST>(DVec3::ZERO, polygon, solid_angle).map(|c| 4.0 * c)
    };
    let whole = exact(&lamp(-0.5, 1.0));
    assert_coefficients(&seen, whole, 4.0 * f64::from(f32::EPSILON));
    assert!(seen.standard_error[0].max_element() < 1e-6);
    // A screen hides where x < 0, half way up.
    let corner = DVec3::new(-2.0, 1.0, -2.0);
    push(
        &mut scene,
        &parallelogram(corner, DVec3::Z * 4.0, DVec3::X * 2.0),
        0.0,
    );
    let half = exact(&lamp(0.0, 0.5));
    let positions = [DVec3::ZERO; 64];
    let found = direct(&scene, &positions, &DIRECT);
    for (k, half) in half.into_iter().enumerate() {
        let mean = found.iter().map(|f| f.coefficients[k].x).sum::<f64>() / 64.0;
        let variance = found
            .iter()
            .map(|f| f.standard_error[k].x.powi(2))
            .sum::<f64>();
        let error = variance.sqrt() / 64.0;
        // Five standard errors, and a bias of the covariance of visibility and basis over the rays: at most ½ · 0.2 · Ω / 64.
        let bias = 0.1 * (whole[0] / BAND_0) / 64.0;
        assert!(
            (mean - half).abs() < 5.0 * error + bias,
            "{k}: {mean} is not {half}"
        );
    }
}

/// Light of which surfaces receive nothing from below the horizon: of a lamp that the horizon cuts, E at the normal is what the exact formula for
/// irradiance says.
#[test]
fn the_horizon_cuts_lamps() {
    let mut scene = plate();
    let corner = DVec3::new(1.0, -1.0, -1.0);
    let lamp = parallelogram(corner, DVec3::Z * 2.0, DVec3::Y * 2.5);
    push(&mut scene, &lamp, 4.0);
    let world = World::new(&scene);
    let receivers = world.receivers(&[DVec3::ZERO], &[DVec3::Y]);
    let places: Vec<Place> = receivers.iter().map(Place::from).collect();
    let found = incident::<4>(&world, None, &places, &[0], &DIRECT)[0];
    let flux = vector_irradiance(&found.coefficients())[1].x;
    let source = &world.lights().sources()[0];
    let expected = source
        .irradiance(receivers[0].position, receivers[0].normal)
        .x;
    assert!(expected > 0.1);
    assert!(
        (flux / expected - 1.0).abs() < 1e-6,
        "{flux} is not {expected}"
    );
}

/// Many lamps of which each ray chooses one are projected as if each were looked at.
#[test]
fn lamps_are_chosen_without_bias() {
    const COUNT: usize = 256;
    let mut scene = plate();
    let mut expected = [0.0; MOST];
    for i in 0..40 {
        for j in 0..40 {
            let [x, z] = [i, j].map(|k| 0.2 * f64::from(k) - 4.0);
            // In one plane: none hides another.
            let corner = DVec3::new(x, 1.0, z);
            let lamp = parallelogram(corner, DVec3::X * 0.1, DVec3::Z * 0.1);
            let radiance = 1.0 + f64::from((i + j) % 3);
            push(&mut scene, &lamp, radiance);
            let mut slices = Vec::new();
            let solid_angle = polygon::fan(DVec3::ZERO, &lamp, &mut slices);
            let own = polygon::coefficients::<MOST>(DVec3::ZERO, &lamp, solid_angle);
            for (sum, own) in expected.iter_mut().zip(own) {
                *sum += radiance * own;
            }
        }
    }
    let found = direct(&scene, &[DVec3::ZERO; COUNT], &DIRECT);
    for (k, expected) in expected.into_iter().enumerate() {
        let values = found.iter().map(|f| f.coefficients[k].x);
        let mean = values.clone().sum::<f64>() / COUNT as f64;
        let squares: f64 = values.map(|v| (v - mean).powi(2)).sum();
        let error = squares.sqrt() / COUNT as f64;
        // The level of 5σ for nine means.
        assert!(
            (mean - expected).abs() < 5.0 * error,
            "{k}: {mean} ± {error} is not {expected}"
        );
        // And each states its noise: the mean of 256 variances of 3 degrees of freedom is known to a tenth.
        let stated: f64 = found.iter().map(|f| f.standard_error[k].x.powi(2)).sum();
        let ratio = squares / stated;
        assert!((0.5..1.5).contains(&ratio), "{k}: {ratio}");
    }
}

/// Where radiance is even, L₀₀ and E(n) = πL are known whatever the normal; in air and above a wall, to a stated error.
#[test]
fn the_furnace_is_even() {
    let scene = furnace_box(DVec3::new(1.0, 2.0, 3.0), Surface::grey(0.5, 1.0));
    let radiance = 2.0;
    let world = World::new(&scene);
    let frame = *world.surfaces().geometry().frame();
    let aim = Aim {
        error: 0.02,
        components: Components::All,
        bounces: Bounces::All,
        first_rays: 64,
        patches: [256, usize::MAX],
        seed: 1,
    };
    let air: Vec<Place> = [DVec3::new(0.5, 1.0, 1.5), DVec3::new(0.1, 0.3, 2.8)]
        .map(|p| Place::in_air(frame.to_unit(p)))
        .to_vec();
    let found = until::<MOST>(&world, &air, &aim, &|same| same, &mut AtOnce)
        .expect("a scene that meshes")
        .expect("a result");
    for estimate in finish(&found.incidents) {
        // The solver's tolerance of 1e-7, single precision; Russian roulette of near chains within 5 standard errors.
        let error = estimate.standard_error[0].max_element();
        let allowed = 5.0 * error + 1e-5 * radiance;
        let level = radiance / BAND_0;
        let wrong = (estimate.coefficients[0] - Rgb::splat(level)).abs();
        assert!(wrong.max_element() < allowed, "{wrong} {allowed}");
        for normal in [DVec3::X, -DVec3::Y, DVec3::splat(3f64.sqrt().recip())] {
            let found = irradiance(&estimate.coefficients, normal).0.x;
            // Noise of the other coefficients.
            let noise: f64 = estimate.standard_error.iter().map(|e| e.x * e.x).sum();
            let allowed = 5.0 * noise.sqrt() + 1e-5;
            assert!((found - PI * radiance).abs() < allowed, "{found} {allowed}");
        }
    }
    // Luxels in a row, joined: E at the normal is φ/2 = πL.
    let positions: Vec<DVec3> = (0..64)
        .map(|i| DVec3::new(0.1 + 0.01 * f64::from(i), 0.0, 1.5))
        .collect();
    let receivers = world.receivers(&positions, &[DVec3::Y; 64]);
    let places: Vec<Place> = receivers.iter().map(Place::from).collect();
    let join = |incidents: Vec<Incident<4>>| joined(&world, &receivers, &incidents);
    let found = until::<4>(&world, &places, &aim, &join, &mut AtOnce)
        .expect("a scene that meshes")
        .expect("a result");
    for (incident, estimate) in found.incidents.iter().zip(finish(&found.incidents)) {
        let coefficients = estimate.coefficients;
        let [fluence, flux] = [
            fluence_rate(&coefficients),
            vector_irradiance(&coefficients)[1],
        ];
        // Five standard errors, which are small: half of the light is direct and exact.
        let errors = estimate.standard_error;
        let known = [(0, BAND_0), (1, BAND_1)].map(|(k, band)| errors[k].x / band);
        let expected = [2.0 * PI * radiance, PI * radiance];
        for ((found, expected), error) in [fluence, flux].into_iter().zip(expected).zip(known) {
            let wrong = (found - Rgb::splat(expected)).abs().max_element();
            assert!(
                wrong < 5.0 * error + 1e-5,
                "{found} ± {error} is not {expected}"
            );
            assert!(error < 0.01 * expected, "{error}");
        }
        let mean = mean_irradiance(&coefficients).0.x;
        assert!((4.0 * mean / fluence.x - 1.0).abs() < 1e-12);
        // In proportion to the irradiance there is no noise along the normal.
        let given = incident.given_irradiance(DVec3::Y);
        let flux = given.gathered.map(|row| row[1].x + given.direct[0][1].x);
        for value in flux {
            assert!((value / flux[0] - 1.0).abs() < 1e-5, "{flux:?}");
        }
    }
}

/// The same bytes at any number of threads, and whatever else is gathered; two rounds are one.
#[test]
fn results_depend_on_items_alone() {
    let mut scene = furnace_box(DVec3::splat(4.0), Surface::grey(0.5, 0.0));
    let corner = DVec3::new(1.5, 3.0, 1.5);
    push(&mut scene, &parallelogram(corner, DVec3::X, DVec3::Z), 5.0);
    let world = World::new(&scene);
    let adapted = crate::adaptive::Adapted::new(&world, &[], Bounces::All, 1).expect("a density");
    let lookup = adapted.solve(200, &mut AtOnce).expect("a solution");
    let lookup = lookup.expect("a solution");
    let places: Vec<Place> = (0..40)
        .map(|i| Place::in_air(DVec3::new(0.02 * f64::from(i) - 0.4, -0.1, 0.2)))
        .collect();
    let items: Vec<u64> = (0..40).collect();
    let run = |threads: usize, places: &[Place], config: &IncidentConfig| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool of threads")
            .install(|| {
                incident::<4>(
                    &world,
                    Some(&lookup),
                    places,
                    &items[..places.len()],
                    config,
                )
            })
    };
    let one = run(1, &places, &CONFIG);
    assert_eq!(one, run(3, &places, &CONFIG));
    assert_eq!(one[..7], run(2, &places[..7], &CONFIG));
    let round = |rays, rays_before, shadow_rays| IncidentConfig {
        rays,
        rays_before,
        shadow_rays,
        ..CONFIG
    };
    let mut rounds = run(2, &places, &round(100, 0, 64));
    for (first, second) in rounds.iter_mut().zip(run(2, &places, &round(156, 100, 0))) {
        first.join(&second);
    }
    for (rounds, one) in rounds.iter().zip(&one) {
        assert_eq!(rounds.direct, one.direct);
        for (a, b) in rounds.gathered.iter().zip(&one.gathered) {
            for (a, b) in a.iter().zip(b) {
                // Means of single precision.
                let scale = one.gathered[0][0].max_element();
                assert!((*a - *b).abs().max_element() < 1e-5 * scale, "{a} {b}");
            }
        }
    }
}
