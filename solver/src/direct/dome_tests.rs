//! Irradiance from the sky against the closed form of polygonal openings.

use super::{Dome, DomeRays};
use crate::form_factors::point_to_polygon;
use crate::world::World;
use glam::DVec3;
use luxel_scenes::{Light, LightKind, Material, Radiance, Reflectance, Scene, Sky};
use std::f64::consts::PI;

/// A black ceiling of 8 × 8 at height 1 with a hole, below a sky of radiance one, and the hole as seen from
/// below.
fn ceiling(low: f64, high: f64) -> (Scene, [DVec3; 4]) {
    let mut scene = Scene::default();
    let object = scene.push_object("ceiling");
    let material = scene.push_material(Material::diffuse("black", Reflectance::ZERO));
    let cuts = [-4.0, low, high, 4.0];
    for i in 0..3 {
        for j in 0..3 {
            if (i, j) != (1, 1) {
                let at = |i: usize, j: usize| DVec3::new(cuts[i], cuts[j], 1.0);
                let face = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
                scene.push_face(&face, object, material);
            }
        }
    }
    let radiance = Radiance::splat(1.0);
    scene.lights.push(Light {
        name: "sky".into(),
        kind: LightKind::Sky {
            sky: Sky::Uniform { radiance },
            up: DVec3::Z,
            ground: Radiance::ZERO,
        },
    });
    let at = |x: f64, y: f64| DVec3::new(x, y, 1.0);
    let hole = [at(low, low), at(low, high), at(high, high), at(high, low)];
    (scene, hole)
}

/// The irradiance that each of `replicates` seeds finds at the origin, through the hole alone: what comes
/// from beside the ceiling is the same in `exact`.
fn found(scene: &Scene, normal: DVec3, count: usize, replicates: u64) -> Vec<f64> {
    let world = World::new(scene);
    let receiver = world.receivers(&[DVec3::ZERO], &[normal])[0];
    let mut dome = Dome::new(world.lights(), world.surfaces(), world.bvh());
    let replicate_seeds: Vec<u64> = (1..=4).collect();
    let mut values = Vec::new();
    for item in 0..replicates / 4 {
        let rays = DomeRays {
            count,
            seed: 0,
            replicate_seeds: &replicate_seeds,
            item,
        };
        dome.irradiance(&receiver, &rays, |_, value| values.push(value.x));
    }
    values
}

/// What reaches the origin through the hole and past the rim of the ceiling.
fn exact(hole: &[DVec3], normal: DVec3) -> f64 {
    let rim: Vec<DVec3> = [(-4.0, -4.0), (-4.0, 4.0), (4.0, 4.0), (4.0, -4.0)]
        .map(|(x, y)| DVec3::new(x, y, 1.0))
        .to_vec();
    let seen = |polygon: &[DVec3]| point_to_polygon(DVec3::ZERO, normal, polygon);
    // The sky above the horizon of the ground, as the receiver sees it.
    let dome = 0.5 * (1.0 + normal.z);
    PI * (dome - seen(&rim) + seen(hole))
}

fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (mean, (squares / (count * (count - 1.0))).sqrt())
}

/// Also where the pilot misses the hole more often than not.
#[test]
fn openings_of_every_size_are_unbiased() {
    let tilted = DVec3::new(0.6, 0.0, 0.8);
    for (low, high, normal, count) in [
        (-0.5, 0.7, DVec3::Z, 1024),
        (0.1, 0.3, DVec3::Z, 512),
        (0.2, 0.23, DVec3::Z, 256),
        (0.3, 0.9, tilted, 1024),
        (-2.0, 1.0, DVec3::X, 300),
        (-0.1, 0.1, DVec3::Z, 5),
    ] {
        let (scene, hole) = ceiling(low, high);
        let values = found(&scene, normal, count, 2000);
        let (mean, error) = mean_and_error(&values);
        let exact = exact(&hole, normal);
        // Replicates of an item share its cells, but given those they are independent and unbiased: no
        // correlation. 4.5 σ for six tests.
        assert!(
            (mean - exact).abs() < 4.5 * error + 1e-6 * exact,
            "{low} {high} {count}: {mean} ± {error}, exact {exact}"
        );
    }
}

/// Sixteen times the rays: the error falls to a 64th in the limit, to an eighth for evenly spread rays; here
/// to less than a 20th.
#[test]
fn outlines_are_resolved() {
    let (scene, hole) = ceiling(0.3, 0.9);
    let exact = exact(&hole, DVec3::Z);
    let error = |count| {
        let values = found(&scene, DVec3::Z, count, 120);
        let squares: f64 = values
            .iter()
            .map(|value| (value / exact - 1.0).powi(2))
            .sum();
        (squares / values.len() as f64).sqrt()
    };
    let (few, many) = (error(4096), error(65_536));
    assert!(many < few / 20.0, "{few} and {many}");
}

#[test]
fn nothing_is_found_below_the_horizon_or_a_lid() {
    let (scene, _) = ceiling(-0.5, 0.5);
    assert!(
        found(&scene, DVec3::NEG_Z, 512, 4)
            .iter()
            .all(|&value| value <= 0.0)
    );
}

/// An unblocked uniform sky is exact whatever the rays.
#[test]
fn an_open_sky_is_exact() {
    let (mut scene, _) = ceiling(-0.5, 0.5);
    for vertex in &mut scene.vertices {
        vertex.z = -1.0;
    }
    for value in found(&scene, DVec3::Z, 300, 40) {
        // Sums of some hundred terms.
        assert!((value / PI - 1.0).abs() < 1e-12, "{value}");
    }
}
