//! Rooms with one gap each, and rooms without.

use super::super::{Finding, LeadsTo, report as audit};
use crate::world::World;
use glam::DVec3;
use luxel_scenes::check::Severity;
use luxel_scenes::generate::cornell_box;
use luxel_scenes::{Material, Radiance, Reflectance, Scene, Sidedness};
use std::path::Path;

/// Corners of a rectangle that faces side × other.
fn rectangle(corner: DVec3, side: DVec3, other: DVec3) -> [DVec3; 4] {
    [corner, corner + side, corner + side + other, corner + other]
}

fn push(scene: &mut Scene, name: &str, faces: &[[DVec3; 4]]) {
    let object = scene.push_object(name);
    let material = scene.push_material(
        Material::diffuse(name, Reflectance::splat(0.5)).with_emission(Radiance::splat(1.0)),
    );
    for face in faces {
        scene.push_face(face, object, material);
    }
}

const SIZE: DVec3 = DVec3::new(4.0, 5.0, 3.0);

/// The six walls of a room that faces inwards, one object each; `change` moves a wall.
fn room(change: impl Fn(&str, &mut [DVec3; 4])) -> Scene {
    let mut scene = Scene::default();
    let [x, y, z] = [DVec3::X * SIZE.x, DVec3::Y * SIZE.y, DVec3::Z * SIZE.z];
    for (name, mut face) in [
        ("west", rectangle(DVec3::ZERO, y, z)),
        ("east", rectangle(x, z, y)),
        ("south", rectangle(DVec3::ZERO, z, x)),
        ("north", rectangle(y, x, z)),
        ("floor", rectangle(DVec3::ZERO, x, y)),
        ("ceiling", rectangle(z, y, x)),
    ] {
        change(name, &mut face);
        push(&mut scene, name, &[face]);
    }
    scene
}

fn findings(scene: &Scene) -> Vec<Finding> {
    audit(&World::new(scene), &[])
}

/// Names of both objects, share and goal of every gap. Openings are none of these rooms.
fn gaps(scene: &Scene) -> Vec<([String; 2], f64, LeadsTo)> {
    let gap = |finding: Finding| match finding {
        Finding::Gap {
            between: [a, b],
            share,
            leads_to,
            ..
        } => Some(([a.object, b.object], share, leads_to)),
        Finding::Opening { .. } => panic!("{finding}"),
        _ => None,
    };
    findings(scene).into_iter().filter_map(gap).collect()
}

#[test]
fn a_closed_room_is_closed() {
    assert_eq!(gaps(&room(|_, _| {})), []);
}

/// The north wall moved outwards: a gap along each of its four edges, as wide as it was moved.
#[test]
fn a_wall_that_is_moved_leaves_four_gaps() {
    for relative in [1e-3, 1e-4, 1e-6] {
        for offset in [DVec3::ZERO, DVec3::new(300.0, -20.0, 7.0)] {
            let shift = relative * SIZE.y;
            let mut scene = room(|name, face| {
                if name == "north" {
                    for corner in face {
                        corner.y += shift;
                    }
                }
            });
            for vertex in &mut scene.vertices {
                *vertex += offset;
            }
            let found = gaps(&scene);
            let mut others: Vec<&str> = found
                .iter()
                .map(|([a, b], ..)| {
                    assert!([a, b].iter().any(|name| name.as_str() == "north"));
                    if a == "north" { b.as_str() } else { a.as_str() }
                })
                .collect();
            others.sort_unstable();
            assert_eq!(others, ["ceiling", "east", "floor", "west"], "{relative}");
            let total: f64 = found.iter().map(|(_, share, _)| share).sum();
            let lit = 2.0 * (4.0 * 5.0 + 5.0 * 3.0 + 3.0 * 4.0);
            let expected = 14.0 * shift / lit;
            // Widths come from coordinates that are exact to an ulp of 300.
            assert!(
                (total / expected - 1.0).abs() < 1e-6,
                "{total} of {expected}"
            );
            assert!(found.iter().all(|(_, _, to)| *to == LeadsTo::Outside));
            let is_warning = findings(&scene)[0].severity() == Severity::Warning;
            assert_eq!(is_warning, relative > 5e-5, "{relative}");
        }
    }
}

/// A north wall that leans outwards by a millimetre at the top: the wedges beside it and the gap above.
#[test]
fn a_leaning_wall_leaves_wedges() {
    let scene = room(|name, face| {
        if name == "north" {
            face[2].y += 1e-3;
            face[3].y += 1e-3;
        }
    });
    let names: Vec<_> = gaps(&scene).into_iter().map(|(names, ..)| names).collect();
    let is_between = |a: &str, b: &str| {
        names.iter().any(|[x, y]| {
            (x, y) == (&a.to_owned(), &b.to_owned()) || (y, x) == (&a.to_owned(), &b.to_owned())
        })
    };
    assert_eq!(names.len(), 3, "{names:?}");
    assert!(
        is_between("north", "ceiling")
            && is_between("north", "west")
            && is_between("north", "east")
    );
}

#[test]
fn walls_that_overlap_leak_nothing() {
    for reach in [1e-4, 0.003, 0.02] {
        let scene = room(|_, face| {
            let middle = face.iter().sum::<DVec3>() / 4.0;
            for corner in face {
                let out = (*corner - middle).signum() * reach;
                *corner += out;
            }
        });
        assert_eq!(gaps(&scene), [], "{reach}");
    }
}

#[test]
fn a_wall_that_is_turned_over_is_no_gap() {
    let scene = room(|name, face| {
        if name == "north" {
            face.reverse();
        }
    });
    let found = findings(&scene);
    assert!(
        matches!(&found[..], [Finding::BackSeen { place, .. }] if place.face.object == "north"),
        "{found:?}"
    );
}

/// Partitions that end a millimetre above the floor of both rooms: a sheet, and a wall of 20 cm.
#[test]
fn a_slit_to_a_dark_room_is_found() {
    for (thickness, slit) in [(0.0, 0.0), (0.0, 1e-3), (0.2, 0.0), (0.2, 1e-3)] {
        let mut scene = room(|_, _| {});
        let corner = DVec3::new(0.0, 2.0, slit);
        let (x, y, z) = (
            DVec3::X * 4.0,
            DVec3::Y * thickness,
            DVec3::Z * (3.0 - slit),
        );
        let front = rectangle(corner, x, z);
        if thickness > 0.0 {
            let back = rectangle(corner + y, z, x);
            let ends = [rectangle(corner, z, y), rectangle(corner + x, y, z)];
            let lids = [rectangle(corner, y, x), rectangle(corner + z, x, y)];
            push(
                &mut scene,
                "partition",
                &[front, back, ends[0], ends[1], lids[0], lids[1]],
            );
        } else {
            push(&mut scene, "partition", &[front]);
            scene.materials.last_mut().expect("a material").sidedness = Sidedness::Both;
        }
        let found = gaps(&scene);
        if slit > 0.0 {
            let [([a, b], share, LeadsTo::AnotherRoom)] = &found[..] else {
                panic!("{thickness}: {found:?}");
            };
            assert_eq!((a.as_str(), b.as_str()), ("partition", "floor"));
            // 4 mm · m over 94 m² of the room and 24 or more of the partition.
            let lit = 118.0 + 14.0 * thickness;
            assert!((share / (4e-3 / lit) - 1.0).abs() < 1e-3, "{share}");
        } else {
            assert_eq!(found, [], "{thickness}");
        }
    }
}

/// A sheet on a desk, a picture before a wall, a screen above the floor: edges near surfaces, but
/// nothing behind them.
#[test]
fn things_that_stand_in_a_room_are_no_gaps() {
    let mut scene = room(|_, _| {});
    let sheet = rectangle(DVec3::new(1.0, 1.0, 2e-3), DVec3::X * 0.3, DVec3::Y * 0.2);
    push(&mut scene, "sheet", &[sheet]);
    let picture = rectangle(DVec3::new(1.0, 3e-3, 1.0), DVec3::Z, DVec3::X);
    push(&mut scene, "picture", &[picture]);
    let corner = DVec3::new(1.0, 3.0, 5e-3);
    let screen = [
        rectangle(corner, DVec3::X, DVec3::Z),
        rectangle(corner, DVec3::Z, DVec3::X),
    ];
    push(&mut scene, "screen", &screen);
    // A slab of 1 mm that floats as far above the floor.
    let (low, [x, y, z]) = (
        DVec3::new(3.0, 1.0, 1e-3),
        [DVec3::X * 0.5, DVec3::Y, DVec3::Z * 1e-3],
    );
    let slab = [
        rectangle(low, y, x),
        rectangle(low + z, x, y),
        rectangle(low, x, z),
        rectangle(low + y, z, x),
        rectangle(low, z, y),
        rectangle(low + x, y, z),
    ];
    push(&mut scene, "slab", &slab);
    assert_eq!(gaps(&scene), []);
}

#[test]
fn the_front_of_the_cornell_box_is_an_opening() {
    let found = findings(&cornell_box());
    let [Finding::Opening { fraction, rim, at }] = &found[..] else {
        panic!("{found:?}");
    };
    // A fifth of what the walls see, and nothing from behind the blocks.
    assert!((0.1..0.25).contains(fraction), "{fraction}");
    assert!(
        rim.len() >= 3 && rim.iter().any(|name| name == "floor"),
        "{rim:?}"
    );
    assert!(at.x.abs() < 1.0 && at.y > 0.1, "{at}");
    assert_eq!(found[0].severity(), Severity::Note);
}

#[test]
fn the_example_rooms_have_no_gaps() {
    for name in ["furnace", "corridor", "office"] {
        let file = format!("../scenes/data/{name}/{name}.toml");
        let loaded = luxel_scenes::load(Path::new(env!("CARGO_MANIFEST_DIR")).join(file));
        let scene = loaded.expect("an example").scene;
        let found: Vec<Finding> = findings(&scene)
            .into_iter()
            .filter(|finding| matches!(finding, Finding::Gap { .. } | Finding::Opening { .. }))
            .collect();
        assert!(
            found.is_empty(),
            "{name}: {} findings, {}",
            found.len(),
            found[0]
        );
    }
}
