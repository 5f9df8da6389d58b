//! One ray for many lights.

use super::*;
use crate::sampling::Stage;
use crate::world::World;
use luxel_scenes::{Material, Radiance, Reflectance, Scene};

/// A ceiling of lamps of different sizes and strengths, some of which a beam hides.
fn hall() -> Scene {
    let mut scene = Scene::default();
    let object = scene.push_object("lamps");
    for k in 0..20 {
        let material = scene.push_material(Material {
            emission: Radiance::splat(f64::from(1 + k % 5)),
            ..Material::diffuse(format!("lamp {k}"), Reflectance::ZERO)
        });
        let (x, y) = (f64::from(k % 5), f64::from(k / 5));
        let size = 0.1 + 0.04 * f64::from(k);
        let corner = |i: f64, j: f64| DVec3::new(x + i * size, y + j * size, 2.0);
        let lamp = [
            corner(0.0, 0.0),
            corner(0.0, 1.0),
            corner(1.0, 1.0),
            corner(1.0, 0.0),
        ];
        scene.push_face(&lamp, object, material);
    }
    let black = scene.push_material(Material::diffuse("black", Reflectance::ZERO));
    let beam = [
        DVec3::new(2.2, -1.0, 1.5),
        DVec3::new(2.6, -1.0, 1.5),
        DVec3::new(2.6, 5.0, 1.5),
        DVec3::new(2.2, 5.0, 1.5),
    ];
    scene.push_face(&beam, object, black);
    scene
}

#[test]
fn one_ray_for_many_lights_is_right_on_average() {
    let scene = hall();
    let world = World::new(&scene);
    let (positions, normals) = (
        [DVec3::new(1.0, 1.5, 0.0), DVec3::new(2.4, 3.0, 1.2)],
        [DVec3::Z, DVec3::new(0.6, 0.0, 0.8)],
    );
    let mut sampler = DirectSampler::new(world.lights(), world.bvh());
    for receiver in world.receivers(&positions, &normals) {
        let mean_of = |sampler: &mut DirectSampler<'_>, rays: usize, count: u32| {
            let samples: Vec<Sample> = (0..count)
                .map(|k| Sample {
                    position: receiver.position,
                    normal: receiver.normal,
                    origin: receiver.origin,
                    // Independent, so that the scatter is known.
                    sequence: Sequence::new(1, Stage::DIRECT, u64::from(k)),
                    index: 0,
                })
                .collect();
            let mut found = vec![Irradiance::ZERO; samples.len()];
            sampler.irradiance(&samples, ShadowRays::About(rays), &mut found);
            let n = f64::from(count);
            let mean = found.iter().map(|e| e.0.x).sum::<f64>() / n;
            let square = found.iter().map(|e| e.0.x * e.0.x).sum::<f64>() / n;
            (mean, (square - mean * mean) / n)
        };
        let (one, variance_of_one) = mean_of(&mut sampler, 1, 20_000);
        let (many, variance_of_many) = mean_of(&mut sampler, 2000, 20);
        let sigma = (variance_of_one + variance_of_many).sqrt();
        assert!(
            (one - many).abs() < 4.0 * sigma,
            "{one} with one ray, {many} with many, {sigma}"
        );
        // One ray that finds all of the light or none, each half of the time, has the variance E²: visibility
        // may make that much, and rough weights should not add to it.
        assert!(variance_of_one * 20_000.0 < one * one, "{variance_of_one}");
    }
}
