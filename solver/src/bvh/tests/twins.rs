//! The kernel of the processor against its portable twin: the same bits for every ray.
//!
//! On a processor without the kernel both sides are the twin, and the tests say nothing.

use super::super::collapse::FEW;
use super::super::{Bvh, Hit, Ray};
use super::{random, random_direction, random_point, room, scene_of, soup};
use crate::geometry::{Geometry, TriangleId};
use glam::{DVec3, Vec3};
use luxel_scenes::Scene;

/// Triangles a million times as long as wide, at all angles.
fn slivers(count: u64) -> Scene {
    let triangles: Vec<_> = (0..count)
        .map(|i| {
            let along = random_direction(i).as_dvec3();
            let across = along.any_orthonormal_vector() * 1e-6;
            let origin = random_point(i, 0);
            [origin, origin + along, origin + along * 0.5 + across]
        })
        .collect();
    scene_of(&triangles)
}

/// The same triangle many times, and a fan of triangles that lie in one plane and overlap.
fn coincident(count: u8) -> Scene {
    let mut triangles = vec![[DVec3::ZERO, DVec3::X, DVec3::Y]; usize::from(count)];
    for i in 0..count {
        let angle = 0.1 * f64::from(i);
        let tip = DVec3::new(angle.cos(), angle.sin(), 0.0);
        triangles.push([DVec3::ZERO, tip, DVec3::new(-tip.y, tip.x, 0.0)]);
    }
    scene_of(&triangles)
}

/// Triangles whose sizes and distances fall by powers of two: a deep tree.
fn cascade() -> Scene {
    let triangles: Vec<_> = (0..60)
        .map(|i| {
            let size = 0.5_f64.powi(i / 2);
            let origin = DVec3::new(size, size * 0.5, -size);
            [
                origin,
                origin + DVec3::X * size * 0.3,
                origin + DVec3::Y * size * 0.2,
            ]
        })
        .collect();
    scene_of(&triangles)
}

fn scenes() -> Vec<(&'static str, Scene)> {
    vec![
        ("one triangle", soup(1)),
        ("five triangles", soup(5)),
        ("soup", soup(if cfg!(miri) { 40 } else { 3000 })),
        ("bare room", room(1, 0.0)),
        (
            "tessellated room",
            room(if cfg!(miri) { 2 } else { 16 }, 0.0),
        ),
        ("turned room", room(if cfg!(miri) { 2 } else { 16 }, 0.7)),
        ("slivers", slivers(if cfg!(miri) { 20 } else { 500 })),
        ("coincident", coincident(40)),
        // On either side of the number from which there is a tree.
        ("few", soup(FEW as u64)),
        ("not few", soup(FEW as u64 + 1)),
        ("few slivers", slivers(20)),
        ("few coincident", coincident(20)),
        ("cascade", cascade()),
    ]
}

/// A ray of one of sixteen kinds, among them all that have been trouble to somebody.
fn ray(geometry: &Geometry, i: u64) -> Ray {
    let id = TriangleId((random(i, 40) * geometry.len() as f64) as u32);
    let [a, b, c] = geometry.triangle(id).map(|p: DVec3| p.as_vec3());
    let (u, v) = (random(i, 41) as f32, random(i, 42) as f32);
    let on_surface = a + (b - a) * u * 0.5 + (c - a) * v * 0.5;
    let near = (random_point(i, 43) - 0.5).as_vec3();
    let direction = random_direction(i);
    let axis = Vec3::AXES[(i / 16 % 3) as usize] * if i.is_multiple_of(2) { 1.0 } else { -1.0 };
    match i % 16 {
        0 => Ray::new(near, direction),
        1 => Ray::new(near, axis),
        // Zeros of either sign.
        2 => Ray::new(near, axis * Vec3::new(1.0, -1.0, 1.0)),
        3 => Ray::new(near, (direction * (Vec3::ONE - axis.abs())).normalize()),
        4 => Ray::new(near, (a - near).normalize()),
        5 => Ray::new(near, (a.lerp(b, u) - near).normalize()),
        6 => Ray::segment(near, on_surface),
        7 => Ray::segment(near, c),
        8 => Ray::new(on_surface, direction),
        9 => Ray::new(a, direction),
        // Within the plane of a triangle, along its edge.
        10 => Ray::new(a - (b - a), (b - a).normalize_or(Vec3::X)),
        11 => Ray::new(on_surface, (c - on_surface).normalize_or(Vec3::Y)),
        12 => Ray::new(near * 4.0, (on_surface - near * 4.0).normalize()),
        // On a grid of the box's planes, along axes.
        13 => Ray::new((near * 8.0).round() / 8.0, axis),
        14 => Ray {
            origin: near,
            tmin: 0.3 * u,
            direction: direction * 10f32.powf(8.0 * v - 4.0),
            tmax: if i % 32 == 14 { v } else { 1e4 * v },
        },
        _ => Ray {
            tmin: -0.0,
            tmax: u,
            ..Ray::new(a + (near - a) * 1e-6, (a - near).normalize())
        },
    }
}

fn bits(hit: &Hit) -> ([u32; 3], Option<TriangleId>) {
    ([hit.t, hit.u, hit.v].map(f32::to_bits), hit.triangle())
}

fn assert_twins(name: &str, bvh: &Bvh, rays: &[Ray]) {
    let mut hits = vec![Hit::MISS; rays.len()];
    let mut twins = hits.clone();
    // What stands there before is no answer.
    let mut blocked = vec![true; rays.len()];
    let mut twins_blocked = vec![false; rays.len()];
    bvh.closest_hits_portable(rays, &mut twins);
    bvh.occluded(rays, &mut blocked);
    bvh.occluded_portable(rays, &mut twins_blocked);
    bvh.closest_hits(rays, &mut hits);
    for (index, (hit, twin)) in hits.iter().zip(&twins).enumerate() {
        assert_eq!(
            bits(hit),
            bits(twin),
            "{name}: ray {index} of {}, {:?}",
            rays.len(),
            rays[index]
        );
    }
    for (index, (hit, twin)) in blocked.iter().zip(&twins_blocked).enumerate() {
        assert_eq!(
            hit, twin,
            "{name}: occlusion of ray {index}, {:?}",
            rays[index]
        );
        let found = twins[index].triangle().is_some();
        assert_eq!(
            *twin, found,
            "{name}: blocked but not hit, {:?}",
            rays[index]
        );
    }
}

#[test]
fn every_ray_gives_the_same_bits() {
    let count = if cfg!(miri) { 64 } else { 40_000 };
    for (name, scene) in scenes() {
        let geometry = Geometry::new(&scene);
        let bvh = Bvh::build(&geometry);
        let rays: Vec<Ray> = (0..count).map(|i| ray(&geometry, i)).collect();
        assert_twins(name, &bvh, &rays);
    }
}

#[test]
fn batches_of_any_size_give_the_same_bits() {
    for (name, scene) in scenes() {
        let geometry = Geometry::new(&scene);
        let bvh = Bvh::build(&geometry);
        let sizes = if cfg!(miri) { 15..18 } else { 0..71 };
        for size in sizes {
            let rays: Vec<Ray> = (0..size).map(|i| ray(&geometry, 1000 * size + i)).collect();
            assert_twins(name, &bvh, &rays);
        }
    }
}

/// Rays of a camera, through the whole of a view, so that the signs of directions and the longest
/// axes change within it.
#[test]
fn camera_rays_give_the_same_bits() {
    let side = if cfg!(miri) { 4 } else { 97 };
    for (name, scene) in scenes() {
        let geometry = Geometry::new(&scene);
        let bvh = Bvh::build(&geometry);
        for (eye, forward, up) in [
            (Vec3::new(0.02, -0.03, 0.01), Vec3::X, Vec3::Y),
            (
                Vec3::new(-1.3, 0.4, 0.9),
                Vec3::new(1.2, -0.4, -1.0),
                Vec3::Z,
            ),
            (Vec3::ZERO, Vec3::NEG_Z, Vec3::X),
        ] {
            let right = forward.cross(up);
            let rays: Vec<Ray> = (0..side * side)
                .map(|i| {
                    let at = |k: u32| 2.0 * k as f32 / (side - 1) as f32 - 1.0;
                    let direction = forward + right * at(i % side) + up * at(i / side);
                    Ray::new(eye, direction.normalize())
                })
                .collect();
            assert_twins(name, &bvh, &rays);
        }
    }
}

/// What is not a direction has no answer, but it harms neither memory nor the other rays.
#[test]
fn rays_that_are_none_do_no_harm() {
    let geometry = Geometry::new(&soup(if cfg!(miri) { 20 } else { 500 }));
    let bvh = Bvh::build(&geometry);
    let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, f32::MAX];
    let rays: Vec<Ray> = (0..if cfg!(miri) { 30 } else { 1000 })
        .map(|i| {
            let mut ray = ray(&geometry, i);
            if i % 3 != 0 {
                let value = bad[(i / 3 % 5) as usize];
                match i % 7 {
                    0 => ray.direction = Vec3::splat(value),
                    1 => ray.origin = Vec3::splat(value),
                    2 => ray.tmin = value,
                    3 => ray.tmax = value,
                    4 => ray.direction.y = value,
                    5 => ray.origin.z = value,
                    _ => ray.direction = -Vec3::ZERO,
                }
            }
            ray
        })
        .collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    let mut twins = hits.clone();
    let mut blocked = vec![false; rays.len()];
    bvh.closest_hits_portable(&rays, &mut twins);
    bvh.occluded(&rays, &mut blocked);
    bvh.closest_hits(&rays, &mut hits);
    for i in (0..rays.len()).step_by(3) {
        assert_eq!(bits(&hits[i]), bits(&twins[i]));
    }
}
