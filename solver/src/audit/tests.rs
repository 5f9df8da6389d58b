//! Scenes with one fault each, and good ones.

use super::*;
use crate::world::World;
use luxel_scenes::generate::{Surface, furnace_box};
use luxel_scenes::{
    FaceId, Intensity, Material, Radiance, Reflectance, Rgb, Scene, Sidedness, Specular,
};

fn room() -> Scene {
    furnace_box(DVec3::new(4.0, 2.5, 3.0), Surface::grey(0.5, 1.0))
}

/// A room with a closed box of side 1 m that stands clear of the walls, as an object of its own
/// after all others; facing outwards.
fn room_with_box() -> Scene {
    let mut scene = room();
    let object = scene.push_object("box");
    let material = scene.push_material(Material::diffuse("box", Reflectance::splat(0.5)));
    let inside_out = furnace_box(DVec3::ONE, Surface::grey(0.5, 0.0));
    let (lower, upper) = scene.bounds().expect("a room");
    let (own, _) = inside_out.bounds().expect("a box");
    let to = (lower + upper) / 2.0 - (own + DVec3::splat(0.5));
    for face in inside_out.face_ids() {
        let mut corners: Vec<DVec3> = inside_out.polygon(face).map(|p| p + to).collect();
        corners.reverse();
        scene.push_face(&corners, object, material);
    }
    scene
}

fn turn_over(scene: &mut Scene, face: FaceId) {
    let corners = scene.faces[face.index()].corners();
    scene.corners.vertex[corners].reverse();
}

fn last_face(scene: &Scene) -> FaceId {
    FaceId::new(scene.faces.len() - 1)
}

fn point_light(position: DVec3) -> Light {
    Light {
        name: "bulb".into(),
        kind: LightKind::Point {
            position,
            intensity: Intensity::splat(1.0),
        },
    }
}

/// An eye that looks along −z, 90° wide, 16 × 16 rays.
fn view(world: &World, position: DVec3) -> View {
    let origin = world.surfaces().geometry().frame().to_unit(position);
    let step = |i: u8| (f32::from(i) + 0.5) / 8.0 - 1.0;
    let rays = (0..=255u8)
        .map(|i| Vec3::new(step(i % 16), step(i / 16), -1.0).normalize())
        .map(|direction| Ray::new(origin.as_vec3(), direction))
        .collect();
    View {
        camera: "main".into(),
        eye: Some(position),
        rays,
    }
}

fn check(scene: &Scene) -> Vec<Finding> {
    report(&World::new(scene), &[])
}

fn middle(scene: &Scene) -> DVec3 {
    let (lower, upper) = scene.bounds().expect("a room");
    (lower + upper) / 2.0
}

#[test]
fn good_scenes_have_no_findings() {
    for scene in [Scene::default(), room(), room_with_box()] {
        assert_eq!(check(&scene), []);
    }
    let mut lit = room_with_box();
    let beside = middle(&lit) + DVec3::new(1.0, 0.0, 0.0);
    lit.lights.push(point_light(beside));
    let world = World::new(&lit);
    assert_eq!(report(&world, &[view(&world, beside)]), []);
}

#[test]
fn a_face_that_is_turned_over_is_seen_from_behind() {
    let mut scene = room_with_box();
    let face = last_face(&scene);
    turn_over(&mut scene, face);
    let findings = check(&scene);
    let [
        Finding::BackSeen {
            fraction,
            is_frequent: true,
            place,
            camera: None,
        },
    ] = &findings[..]
    else {
        panic!("{findings:?}");
    };
    assert_eq!((place.face.face, place.face.object.as_str()), (face, "box"));
    // One of six faces, all of which are seen alike: a sixth, but for the room's shape.
    assert!((0.1..0.25).contains(fraction), "{fraction}");
    let text = findings[0].to_string();
    assert!(
        text.contains("object `box`") && text.contains("two_sided"),
        "{text}"
    );
}

#[test]
fn backs_that_reflect_or_transmit_are_no_fault() {
    let mut scene = room_with_box();
    let face = last_face(&scene);
    turn_over(&mut scene, face);
    let material = scene.faces[face.index()].material.index();
    scene.materials[material].sidedness = Sidedness::Both;
    assert_eq!(check(&scene), []);
    scene.materials[material].sidedness = Sidedness::Front;
    scene.materials[material].specular = Specular::Glass {
        index_of_refraction: 1.5,
        transmittance: Rgb::ONE,
    };
    assert_eq!(check(&scene), []);
}

#[test]
fn an_object_inside_a_solid_is_named() {
    let mut scene = room_with_box();
    let at = middle(&scene);
    let object = scene.push_object("lamp");
    let material = scene.push_material(
        Material::diffuse("lamp", Reflectance::ZERO).with_emission(Radiance::splat(1.0)),
    );
    let [x, z] = [DVec3::X * 0.2, DVec3::Z * 0.2];
    scene.push_face(
        &[at - x - z, at - x + z, at + x + z, at + x - z],
        object,
        material,
    );
    let findings = check(&scene);
    let [Finding::ObjectInside { object, around }] = &findings[..] else {
        panic!("{findings:?}");
    };
    assert_eq!((object.as_str(), around.object.as_str()), ("lamp", "box"));
}

#[test]
fn eyes_and_lights_inside_solids_are_named() {
    let mut scene = room_with_box();
    let at = middle(&scene);
    scene.lights.push(point_light(at));
    let world = World::new(&scene);
    let findings = report(&world, &[view(&world, at)]);
    let [
        Finding::CameraInside {
            camera,
            fraction: all,
            place,
        },
        Finding::LightInside {
            light, fraction, ..
        },
    ] = &findings[..]
    else {
        panic!("{findings:?}");
    };
    assert_eq!((camera.as_str(), light.as_str()), ("main", "bulb"));
    assert_eq!(place.face.object, "box");
    assert!((all - 1.0).abs() < 1e-12 && (fraction - 1.0).abs() < 1e-12);
}

#[test]
fn a_spot_is_judged_by_its_cone() {
    let mut scene = room_with_box();
    let at = middle(&scene);
    // Beside the box and outside; towards it, the box shows its fronts.
    let mut spot = |position: DVec3, direction: DVec3| {
        scene.lights = vec![Light {
            name: "spot".into(),
            kind: LightKind::Spot {
                position,
                direction,
                intensity: Intensity::splat(1.0),
                inner_angle: 0.1,
                outer_angle: 0.3,
            },
        }];
        check(&scene).len()
    };
    assert_eq!(spot(at + DVec3::X, DVec3::NEG_X), 0);
    assert_eq!(spot(at, DVec3::Y), 1);
    // Outside of the room and away from it nothing is met.
    assert_eq!(spot(at + DVec3::Y * 5.0, DVec3::Y), 0);
    assert_eq!(spot(at + DVec3::Y * 5.0, DVec3::NEG_Y), 1);
}

#[test]
fn an_eye_on_a_wall_is_named() {
    let scene = room();
    let (lower, _) = scene.bounds().expect("a room");
    let world = World::new(&scene);
    let mut at = middle(&scene);
    at.x = lower.x;
    let on_face = |position| {
        report(&world, &[view(&world, position)])
            .into_iter()
            .any(|finding| matches!(finding, Finding::CameraOnFace { .. }))
    };
    assert!(on_face(at));
    assert!(!on_face(at + DVec3::X * 1e-3));
}
