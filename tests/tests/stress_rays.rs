//! Rays at the edges and corners of closed rooms, and light that must not get through walls.

use glam::{DVec3, Vec3};
use luxel_scenes::{FaceId, Scene, load};
use luxel_solver::bvh::{Bvh, Hit, Ray};
use luxel_solver::geometry::{Geometry, ray_origin};
use luxel_solver::sampling::{Sequence, Stage, hash};
use luxel_tests::builder::{Part, Polygon, flipped, parallelogram, room, scene, sphere};
use luxel_tests::probe::Probe;
use std::path::Path;

/// A uniform number for everything that is drawn here.
fn random(item: u64, sample: u64) -> f64 {
    hash::uniform(1, Stage(u32::MAX), item, sample)
}

fn random_point(item: u64) -> DVec3 {
    DVec3::new(random(item, 0), random(item, 1), random(item, 2))
}

/// The box from −1 to 1 with `n`² squares a side, each cut into two triangles, mapped by `map`.
fn tessellated_room(n: usize, map: impl Fn(DVec3) -> DVec3) -> Scene {
    let mut faces = Vec::new();
    for side in room(DVec3::NEG_ONE, DVec3::ONE) {
        let [a, b, d] = [
            side[0],
            (side[1] - side[0]) / n as f64,
            (side[3] - side[0]) / n as f64,
        ];
        // Every corner from the same expression: neighbours share it to the bit.
        let corner = |i: usize, j: usize| map(round(a + b * i as f64 + d * j as f64));
        for i in 0..n {
            for j in 0..n {
                let square = [
                    corner(i, j),
                    corner(i + 1, j),
                    corner(i + 1, j + 1),
                    corner(i, j + 1),
                ];
                faces.push(vec![square[0], square[1], square[2]]);
                faces.push(vec![square[0], square[2], square[3]]);
            }
        }
    }
    scene("room", [Part::grey("walls", 0.5, faces)])
}

/// Coordinates on a grid of 2⁻⁴⁰, so that sums in different orders agree.
fn round(p: DVec3) -> DVec3 {
    let grid = 2_f64.powi(40);
    (p * grid).round() / grid
}

fn example(name: &str) -> Scene {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/data");
    load(data.join(name).join(format!("{name}.toml")))
        .expect("an example scene")
        .scene
}

/// Targets of a scene: every corner, and random points of every edge.
fn targets(scene: &Scene) -> Vec<DVec3> {
    let mut targets = Vec::new();
    for id in scene.face_ids() {
        let corners: Vec<DVec3> = scene.polygon(id).collect();
        for (i, &a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % corners.len()];
            let t = random(u64::from(id.0), i as u64);
            targets.extend([a, a.lerp(b, t), a.lerp(b, 0.5)]);
        }
    }
    targets
}

/// Casts rays from each of `origins` (metres, inside) at all targets and counts those that leave.
fn leaks(scene: &Scene, origins: &[DVec3]) -> (usize, usize) {
    let geometry = Geometry::new(scene);
    let bvh = Bvh::build(&geometry);
    let frame = *geometry.frame();
    let targets = targets(scene);
    let (mut cast, mut lost) = (0, 0);
    for &origin in origins {
        let origin = frame.to_unit(origin).as_vec3();
        let rays: Vec<Ray> = targets
            .iter()
            .map(|&target| (frame.to_unit(target) - origin.as_dvec3()).as_vec3())
            .filter(|direction| direction.length() > 0.0)
            .map(|direction| Ray::new(origin, direction.normalize()))
            .collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        bvh.closest_hits(&rays, &mut hits);
        let mut blocked = vec![false; rays.len()];
        bvh.occluded(&rays, &mut blocked);
        cast += rays.len();
        lost += hits
            .iter()
            .zip(&blocked)
            .filter(|(hit, blocked)| hit.triangle().is_none() || !**blocked)
            .count();
    }
    (cast, lost)
}

#[test]
fn no_ray_leaves_a_closed_room() {
    let turned = |p: DVec3| glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7) * p;
    let rooms = [
        tessellated_room(16, |p| p),
        tessellated_room(16, turned),
        // Far from the origin, and as thin as a sheet.
        tessellated_room(12, |p| p + DVec3::new(1e5, -3e4, 7e4)),
        tessellated_room(12, |p| p * DVec3::new(1.0, 1e-3, 1.0)),
        scene(
            "ball",
            [Part::grey(
                "ball",
                0.5,
                sphere(DVec3::ZERO, 1.0, 64)
                    .into_iter()
                    .map(flipped)
                    .collect(),
            )],
        ),
        example("furnace"),
    ];
    let mut total = 0;
    for scene in &rooms {
        let (lower, upper) = scene.bounds().expect("faces");
        // Inside the turned room, too, whose inner radius is a quarter of the box around it.
        let mut origins: Vec<DVec3> = (0..24)
            .map(|i| (lower + upper) / 2.0 + (random_point(i) - 0.5) * 0.25 * (upper - lower))
            .collect();
        origins.push((lower + upper) / 2.0);
        let (cast, lost) = leaks(scene, &origins);
        assert_eq!(
            lost, 0,
            "{}: {lost} of {cast} rays left the room",
            scene.name
        );
        total += cast;
    }
    assert!(total > 500_000, "{total} rays only");
}

#[test]
fn rays_that_start_on_a_wall_neither_leave_nor_hit_it() {
    // From points of the faces, by the offset that the solver uses, in all directions of the
    // hemisphere, down to grazing ones.
    for scene in [
        tessellated_room(8, |p| p * 3.0 + 100.0),
        example("furnace"),
        example("corridor"),
    ] {
        let geometry = Geometry::new(&scene);
        let bvh = Bvh::build(&geometry);
        let mut rays = Vec::new();
        let mut from = Vec::new();
        for face in scene.face_ids() {
            let polygon = geometry.polygon(face);
            let normal = geometry.normal(face);
            let sequence = Sequence::new(1, Stage(u32::MAX), u64::from(face.0));
            for i in 0..256 {
                let [s, t, u, w] = sequence.point4(i);
                let (a, b, c) = (polygon[0], polygon[1], polygon[2]);
                let (s, t) = if s + t > 1.0 {
                    (1.0 - s, 1.0 - t)
                } else {
                    (s, t)
                };
                let position = a + (b - a) * s + (c - a) * t;
                let origin = ray_origin(position, normal, geometry.extent(face));
                let tangent = (b - a).normalize();
                let azimuth = std::f64::consts::TAU * u;
                let side = tangent * azimuth.cos() + normal.cross(tangent) * azimuth.sin();
                // Cosines from 1 down to 1e-5, evenly in the logarithm.
                let cosine = 10_f64.powf(-5.0 * w);
                let direction = side * (1.0 - cosine * cosine).sqrt() + normal * cosine;
                rays.push(Ray::new(origin, direction.as_vec3()));
                from.push(face);
            }
        }
        let mut hits = vec![Hit::MISS; rays.len()];
        bvh.closest_hits(&rays, &mut hits);
        let hit_face = |hit: &Hit| hit.triangle().map(|triangle| geometry.face(triangle));
        let faces: Vec<Option<FaceId>> = hits.iter().map(hit_face).collect();
        let lost = faces.iter().filter(|face| face.is_none()).count();
        assert_eq!(
            lost,
            0,
            "{}: {lost} of {} rays left",
            scene.name,
            rays.len()
        );
        let itself = faces
            .iter()
            .zip(&from)
            .filter(|(hit, from)| **hit == Some(**from))
            .count();
        assert_eq!(
            itself, 0,
            "{}: {itself} rays hit the face that they left",
            scene.name
        );
    }
}

#[test]
fn segments_through_a_wall_are_blocked() {
    // From inside to outside, through corners, edges and everything else.
    let scene = tessellated_room(10, |p| p);
    let geometry = Geometry::new(&scene);
    let bvh = Bvh::build(&geometry);
    let unit = |p: DVec3| geometry.frame().to_unit(p).as_vec3();
    let inside = Vec3::splat(0.01);
    let segments: Vec<Ray> = targets(&scene)
        .into_iter()
        .chain((0..100_000).map(|i| (random_point(i) - 0.5).normalize()))
        .map(|target| Ray::segment(inside, unit(target * 4.0)))
        .collect();
    let mut blocked = vec![false; segments.len()];
    bvh.occluded(&segments, &mut blocked);
    let open = blocked.iter().filter(|blocked| !**blocked).count();
    assert_eq!(
        open,
        0,
        "{open} of {} segments pass the wall",
        segments.len()
    );
}

/// A lit and a dark room side by side; the second stands `gap` metres from the first (negative:
/// they interpenetrate).
fn two_rooms(gap: f64) -> Scene {
    let lit = room(DVec3::ZERO, DVec3::ONE);
    let corner = DVec3::X * (1.0 + gap);
    let dark = room(corner, corner + DVec3::ONE);
    let lamp: Polygon = flipped(parallelogram(
        DVec3::new(0.4, 0.4, 0.99),
        DVec3::X * 0.2,
        DVec3::Y * 0.2,
    ));
    scene(
        "two",
        [
            Part::grey("lit", 0.7, lit),
            Part::grey("dark", 0.7, dark),
            Part::lamp("lamp", 100.0, vec![lamp]),
        ],
    )
}

#[test]
fn a_dark_room_beside_a_lit_one_stays_dark() {
    // Walls that share a plane, and walls that touch along edges only.
    for gap in [0.0, 1e-6] {
        let scene = two_rooms(gap);
        let x = 1.0 + gap;
        let middle = |x: f64| {
            vec![
                (DVec3::new(x + 0.5, 0.5, 0.0), DVec3::Z),
                (DVec3::new(x, 0.5, 0.5), DVec3::X),
                (DVec3::new(x + 0.001, 0.001, 0.0), DVec3::Z),
                (DVec3::new(x + 0.5, 0.0, 0.001), DVec3::Y),
            ]
        };
        let mut points = middle(x);
        points.push((DVec3::new(0.5, 0.5, 0.0), DVec3::Z));
        let probe = Probe {
            scene: &scene,
            toml: "",
            points,
            arguments: Vec::new(),
        };
        let estimates = probe.run(1);
        let lit = estimates[4].value.x;
        assert!(lit > 1.0, "the lit room is dark: {lit}");
        for (i, estimate) in estimates[..4].iter().enumerate() {
            let e = estimate.value.x;
            assert!(
                e <= 1e-9 * lit,
                "gap {gap}, point {i}: {e} W/m² beside {lit}"
            );
        }
    }
}

/// Strips down to 1 : 20 000. A point and a direction on either side of a strip: nothing is in
/// between, whichever way the ray runs.
#[test]
fn slivers_hit_neither_themselves_nor_hide_themselves() {
    for width in [1e-1, 1e-2, 1e-3, 1e-4] {
        let strip = parallelogram(DVec3::new(0.3, -1.0, 0.2), DVec3::Y * 2.0, DVec3::X * width);
        let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7);
        let strip: Polygon = strip.into_iter().map(|p| turn * p).collect();
        let scene = scene("strip", [Part::grey("strip", 0.5, vec![strip])]);
        let geometry = Geometry::new(&scene);
        let bvh = Bvh::build(&geometry);
        let normal = geometry.normal(FaceId(0));
        let polygon = geometry.polygon(FaceId(0));
        let (mut away, mut towards) = (Vec::new(), Vec::new());
        for i in 0..100_000 {
            let position = polygon[0]
                + (polygon[1] - polygon[0]) * random(i, 0)
                + (polygon[3] - polygon[0]) * random(i, 1);
            let origin = ray_origin(position, normal, geometry.extent(FaceId(0)));
            let to = (random_point(i + 7) - 0.5).normalize();
            let to = to * to.dot(normal).signum();
            away.push(Ray::new(origin, to.as_vec3()));
            towards.push(Ray::segment((position + to * 0.7).as_vec3(), origin));
        }
        let mut hits = vec![Hit::MISS; away.len()];
        bvh.closest_hits(&away, &mut hits);
        let mut blocked = vec![false; towards.len()];
        bvh.occluded(&towards, &mut blocked);
        let itself = hits.iter().filter(|hit| hit.triangle().is_some()).count();
        let hidden = blocked.iter().filter(|blocked| **blocked).count();
        assert_eq!(
            (itself, hidden),
            (0, 0),
            "a strip of width {width}: hit, hidden"
        );
    }
}
