//! Scenes and sets of rays.

use glam::{DVec3, Vec3};
use luxel_scenes::{Material, MaterialId, ObjectId, Reflectance, Scene, load};
use luxel_solver::bvh::Ray;
use luxel_solver::geometry::{Geometry, TriangleId, ray_origin};
use luxel_solver::sampling::{Frame, Stage, cosine_hemisphere, hash};
use std::path::Path;

/// Rays of each set.
pub(crate) const RAYS: u64 = 1 << 15;
/// Rays that leave one point in the diffuse set, as in a row or a gather.
const PER_POINT: u64 = 64;

/// A bare room, a tessellated room of 100 000 triangles, a cluttered hall of a million, an office.
pub(crate) fn scenes() -> Vec<(&'static str, Scene)> {
    vec![
        ("12", room(1)),
        ("office", office()),
        ("100k", room(91)),
        ("1M", hall(83_300)),
    ]
}

fn office() -> Scene {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/data");
    load(data.join("office/office.toml"))
        .expect("an example scene")
        .scene
}

fn random(index: u64, dimension: u64) -> f64 {
    hash::uniform(11, Stage::BVH, index, dimension)
}

fn push_box(
    scene: &mut Scene,
    lower: DVec3,
    upper: DVec3,
    inwards: bool,
    tiles: u32,
    (object, material): (ObjectId, MaterialId),
) {
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for high in [false, true] {
            for i in 0..tiles {
                for j in 0..tiles {
                    let corner = |di: u32, dj: u32| {
                        let mut p = lower;
                        p[axis] = if high { upper[axis] } else { lower[axis] };
                        let share = |k: u32| f64::from(k) / f64::from(tiles);
                        p[u] += (upper[u] - lower[u]) * share(i + di);
                        p[v] += (upper[v] - lower[v]) * share(j + dj);
                        p
                    };
                    let mut quad = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                    if high == inwards {
                        quad.reverse();
                    }
                    scene.push_face(&[quad[0], quad[1], quad[2]], object, material);
                    scene.push_face(&[quad[0], quad[2], quad[3]], object, material);
                }
            }
        }
    }
}

fn empty() -> (Scene, (ObjectId, MaterialId)) {
    let mut scene = Scene::default();
    let object = scene.push_object("room");
    let material = scene.push_material(Material::diffuse("grey", Reflectance::splat(0.5)));
    (scene, (object, material))
}

/// A closed room of 12·`tiles`² triangles.
fn room(tiles: u32) -> Scene {
    let (mut scene, ids) = empty();
    push_box(
        &mut scene,
        DVec3::ZERO,
        DVec3::new(5.6, 2.8, 4.2),
        true,
        tiles,
        ids,
    );
    scene
}

/// A hall full of small boxes at all angles: 12 triangles each.
fn hall(boxes: u64) -> Scene {
    let (mut scene, ids) = empty();
    let size = DVec3::new(60.0, 12.0, 40.0);
    push_box(&mut scene, DVec3::ZERO, size, true, 8, ids);
    for index in 0..boxes {
        let at = |first: u64| {
            DVec3::new(
                random(index, first),
                random(index, first + 1),
                random(index, first + 2),
            )
        };
        let half = (at(0) * 0.9 + 0.1) * 0.12;
        let centre = at(3) * (size - 1.0) + 0.5;
        let first = scene.vertices.len();
        push_box(&mut scene, -half, half, false, 1, ids);
        let turn = glam::DQuat::from_euler(
            glam::EulerRot::XYZ,
            6.3 * random(index, 6),
            6.3 * random(index, 7),
            6.3 * random(index, 8),
        );
        for vertex in &mut scene.vertices[first..] {
            *vertex = centre + turn * *vertex;
        }
    }
    scene
}

/// A ray origin on the front of the triangle numbered `index` among those of the room's shell.
fn surface_point(geometry: &Geometry, index: u64) -> (Vec3, Frame) {
    let id = TriangleId((random(index, 20) * geometry.len() as f64) as u32);
    let (u, v) = (random(index, 21), random(index, 22));
    let (u, v) = if u + v > 1.0 {
        (1.0 - u, 1.0 - v)
    } else {
        (u, v)
    };
    let position = geometry.interpolate(id, u, v);
    let face = geometry.face(id);
    let normal = geometry.normal(face);
    let origin = ray_origin(position, normal, geometry.extent(face));
    (origin, Frame::around(normal.as_vec3()))
}

/// Rays of a pinhole camera, by rows.
pub(crate) fn camera() -> Vec<Ray> {
    let side = (RAYS as f64).sqrt() as u64;
    let eye = Vec3::new(-0.31, 0.02, -0.17);
    (0..side * side)
        .map(|i| {
            let at = |k: u64| ((k as f32 + 0.5) / side as f32 - 0.5) * 1.4;
            let direction = Vec3::new(1.0, -at(i / side), at(i % side));
            Ray::new(eye, direction.normalize())
        })
        .collect()
}

/// Cosine-distributed rays, 64 from each point.
pub(crate) fn diffuse(geometry: &Geometry) -> Vec<Ray> {
    cosine_rays(geometry, PER_POINT)
}

/// Cosine-distributed rays, each from a point of its own.
pub(crate) fn random_diffuse(geometry: &Geometry) -> Vec<Ray> {
    cosine_rays(geometry, 1)
}

fn cosine_rays(geometry: &Geometry, per_point: u64) -> Vec<Ray> {
    (0..RAYS)
        .map(|i| {
            let (origin, frame) = surface_point(geometry, i / per_point);
            let u = [random(i, 30) as f32, random(i, 31) as f32];
            Ray::new(origin, frame.to_world(cosine_hemisphere::sample(u)))
        })
        .collect()
}

/// Segments between points of surfaces that face each other, as shadow rays do.
pub(crate) fn shadow(geometry: &Geometry) -> Vec<Ray> {
    /// Least cosine at either end.
    const FACING: f32 = 0.02;
    (0..)
        .filter_map(|i| {
            let (origin, at_origin) = surface_point(geometry, 2 * i + 1);
            let (target, at_target) = surface_point(geometry, 2 * i + 2);
            let direction = (target - origin).normalize();
            let facing = at_origin.to_world(Vec3::Z).dot(direction) > FACING
                && at_target.to_world(Vec3::Z).dot(-direction) > FACING;
            facing.then(|| Ray::segment(origin, target))
        })
        .take(RAYS as usize)
        .collect()
}

/// Rays from the middle part of the scene at corners and edges.
pub(crate) fn stress(geometry: &Geometry) -> Vec<Ray> {
    (0..RAYS)
        .map(|i| {
            let id = TriangleId((random(i, 40) * geometry.len() as f64) as u32);
            let [a, b, _] = geometry.triangle(id);
            let target = if i % 2 == 0 {
                a
            } else {
                a.lerp(b, random(i, 41))
            };
            let at = |d: u64| random(i, d) as f32 - 0.5;
            let origin = Vec3::new(at(42) * 0.4, at(43) * 0.1, at(44) * 0.3);
            Ray::new(origin, (target.as_vec3() - origin).normalize())
        })
        .collect()
}
