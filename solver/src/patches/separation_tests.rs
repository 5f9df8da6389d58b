//! Rooms side by side that share their floor, ceiling and side walls: no patch lies in both.

use super::{PatchSize, Patches, Side};
use crate::radiosity::{self, RadiosityConfig};
use crate::sampling::{Stage, hash};
use crate::solvers::{Config, Tolerance};
use crate::world::World;
use glam::{DQuat, DVec3, EulerRot};
use luxel_scenes::{FaceId, Material, Radiance, Reflectance, Scene, Sidedness};

/// The faces of a box, seen from outside.
fn solid(low: DVec3, high: DVec3) -> Vec<Vec<DVec3>> {
    let corner = |k: usize| {
        let pick = |bit: usize, axis: usize| if k & bit == 0 { low[axis] } else { high[axis] };
        DVec3::new(pick(1, 0), pick(2, 1), pick(4, 2))
    };
    [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ]
    .map(|face| face.map(corner).to_vec())
    .to_vec()
}

/// The same, seen from inside.
fn hollow(low: DVec3, high: DVec3) -> Vec<Vec<DVec3>> {
    let mut faces = solid(low, high);
    for face in &mut faces {
        face.reverse();
    }
    faces
}

/// A sheet across x at `x`, from `low` to `high` in y and z.
fn sheet(x: f64, low: f64, high: f64) -> Vec<DVec3> {
    [[low, low], [high, low], [high, high], [low, high]]
        .map(|[y, z]| DVec3::new(x, y, z))
        .to_vec()
}

struct Faces {
    /// One-sided, of reflectance 0.7.
    room: Vec<Vec<DVec3>>,
    /// In the middle.
    wall: Vec<Vec<DVec3>>,
    sidedness: Sidedness,
}

fn scene_of(faces: &Faces, turn: DQuat) -> Scene {
    let mut scene = Scene::default();
    let object = scene.push_object("object");
    let grey = |sidedness| Material {
        sidedness,
        ..Material::diffuse("grey", Reflectance::splat(0.7))
    };
    let room = scene.push_material(grey(Sidedness::Front));
    let wall = scene.push_material(grey(faces.sidedness));
    let lamp = Material::diffuse("lamp", Reflectance::ZERO);
    let lamp = scene.push_material(lamp.with_emission(Radiance::splat(100.0)));
    let below = vec![
        DVec3::new(0.4, 0.4, 0.98),
        DVec3::new(0.4, 0.6, 0.98),
        DVec3::new(0.6, 0.6, 0.98),
        DVec3::new(0.6, 0.4, 0.98),
    ];
    let all = [
        (&faces.room, room),
        (&faces.wall, wall),
        (&vec![below], lamp),
    ];
    for (polygons, material) in all {
        for polygon in polygons {
            let turned: Vec<DVec3> = polygon.iter().map(|&p| turn * p).collect();
            scene.push_face(&turned, object, material);
        }
    }
    scene
}

fn two_rooms() -> Vec<Vec<DVec3>> {
    hollow(DVec3::ZERO, DVec3::new(2.0, 1.0, 1.0))
}

/// Walls between x = 0.97 and 1.2.
fn walls() -> Vec<(&'static str, Faces)> {
    let v = DVec3::new;
    let of = |wall: Vec<Vec<DVec3>>, sidedness| Faces {
        room: two_rooms(),
        wall,
        sidedness,
    };
    let panels = |x: f64| {
        (0..4)
            .map(|k| {
                let [low, high] = [k, k + 1].map(|k| f64::from(k) / 4.0);
                vec![
                    v(x, low, 0.0),
                    v(x, high, 0.0),
                    v(x, high, 1.0),
                    v(x, low, 1.0),
                ]
            })
            .collect()
    };
    let tilted = vec![
        v(1.0, 0.0, 0.0),
        v(1.0, 1.0, 0.0),
        v(1.2, 1.0, 1.0),
        v(1.2, 0.0, 1.0),
    ];
    vec![
        ("sheet", of(vec![sheet(1.0, 0.0, 1.0)], Sidedness::Both)),
        (
            "sheet off the grid",
            of(vec![sheet(0.97, 0.0, 1.0)], Sidedness::Both),
        ),
        (
            "sheet through the floor",
            of(vec![sheet(1.03, -0.1, 1.1)], Sidedness::Both),
        ),
        ("panels", of(panels(1.03), Sidedness::Both)),
        ("tilted", of(vec![tilted], Sidedness::Both)),
        (
            "thin slab",
            of(
                solid(v(1.0, 0.0, 0.0), v(1.0 + 1e-5, 1.0, 1.0)),
                Sidedness::Front,
            ),
        ),
        (
            "slab",
            of(solid(v(1.0, 0.0, 0.0), v(1.1, 1.0, 1.0)), Sidedness::Front),
        ),
        (
            "slab through the floor",
            of(
                solid(v(1.02, -0.1, -0.1), v(1.12, 1.1, 1.1)),
                Sidedness::Front,
            ),
        ),
    ]
}

/// The mean irradiance of each patch.
fn solve(world: &World, patches: &Patches) -> Vec<f64> {
    let config = RadiosityConfig {
        rays: 64,
        shadow_rays: 1,
        solver: Config {
            tolerance: Tolerance::Error(1e-6),
            max_iterations: 1000,
        },
        seed: 1,
        replicate: 0,
    };
    let solution = radiosity::solve(world, patches, &config).expect("reflectances below one");
    let irradiance = patches
        .ids()
        .map(|patch| solution.mean_irradiance(patch).0.x);
    irradiance.collect()
}

/// The light of the darkest lit and of the lightest dark part: floors, ceilings, side and end walls of the
/// room and sides of the wall.
fn check_dark(name: &str, world: &World, patches: &Patches, turn: DQuat) {
    let geometry = world.surfaces().geometry();
    let irradiance = solve(world, patches);
    let (mut lit, mut dark, mut darks) = (0.0_f64, 0.0_f64, 0);
    for patch in patches.ids() {
        for k in 0..8_u64 {
            let at = |d: u64| hash::uniform(9, Stage::PATCHES, u64::from(patch.0), 2 * k + d);
            let sample = patches.sample(geometry, patch, [at(0), at(1)]);
            let position = geometry
                .frame()
                .to_world(sample.position + 1e-4 * sample.normal);
            let place = turn.inverse() * position;
            let inside = place.cmpgt(DVec3::ZERO).all() && place.y < 1.0 && place.z < 1.0;
            let e = irradiance[patch.index()];
            if inside && place.x < 0.96 {
                lit = lit.max(e);
            } else if inside && place.x > 1.21 && place.x < 2.0 {
                dark = dark.max(e);
                darks += 1;
            }
        }
    }
    assert!(lit > 1.0 && darks > 0, "{name}: {lit} and {darks}");
    assert!(
        dark <= 1e-9 * lit,
        "{name}: {dark} beside {lit}, {} patches",
        patches.len()
    );
}

#[test]
fn light_does_not_leak_through_patches_below_a_wall() {
    let turned = DQuat::from_euler(EulerRot::XYZ, 0.3, 1.1, -0.7);
    for (name, faces) in walls() {
        for turn in [DQuat::IDENTITY, turned] {
            let scene = scene_of(&faces, turn);
            let world = World::new(&scene);
            for size in [
                PatchSize::Length(0.1),
                PatchSize::Length(0.37),
                PatchSize::Length(1.0),
                PatchSize::Length(5.0),
                PatchSize::Whole,
            ] {
                let patches = world.mesh(size).expect("meshes");
                check_dark(&format!("{name}, {size:?}"), &world, &patches, turn);
            }
        }
    }
}

#[test]
fn refined_and_graded_meshes_keep_rooms_apart() {
    for (name, faces) in walls() {
        let scene = scene_of(&faces, DQuat::IDENTITY);
        let world = World::new(&scene);
        let density = crate::pilot::density(&world, &[], 1).expect("solves");
        let graded = world.mesh_with_density(300, &density).expect("meshes");
        check_dark(&format!("{name}, graded"), &world, &graded, DQuat::IDENTITY);
        let mut patches = world.mesh(PatchSize::Length(1.0)).expect("meshes");
        for round in 0..2 {
            let marked: Vec<bool> = patches
                .ids()
                .map(|patch| hash::uniform(5, Stage::PATCHES, u64::from(patch.0), round) < 0.3)
                .collect();
            patches = world.refine(&patches, &marked);
            check_dark(
                &format!("{name}, refined"),
                &world,
                &patches,
                DQuat::IDENTITY,
            );
        }
    }
}

#[test]
fn triangles_and_tiles_below_a_wall_are_divided_too() {
    let v = DVec3::new;
    let mut cut = two_rooms();
    // The floor as two triangles of different planes' grids, and as one of five corners.
    let floor = cut.iter().position(|face| face.iter().all(|p| p.z == 0.0));
    let floor = cut.remove(floor.expect("a floor"));
    let mut triangles = cut.clone();
    let apex = v(0.6, 0.5, 0.0);
    for k in 0..4 {
        triangles.push(vec![floor[k], floor[(k + 1) % 4], apex]);
    }
    let mut pentagon = cut.clone();
    pentagon.push(vec![
        v(0.0, 0.0, 0.0),
        v(1.5, 0.0, 0.0),
        v(2.0, 0.0, 0.0) + v(0.0, 0.3, 0.0),
        v(2.0, 1.0, 0.0),
        v(0.0, 1.0, 0.0),
    ]);
    pentagon.push(vec![v(1.5, 0.0, 0.0), v(2.0, 0.0, 0.0), v(2.0, 0.3, 0.0)]);
    let mut tiles = cut;
    for k in 0..200 {
        let (i, j) = (k % 20, k / 20);
        let corner = |i: i32, j: i32| v(f64::from(i) / 10.0, f64::from(j) / 10.0, 0.0);
        tiles.push(vec![
            corner(i, j),
            corner(i + 1, j),
            corner(i + 1, j + 1),
            corner(i, j + 1),
        ]);
    }
    for (name, room) in [
        ("triangles", triangles),
        ("pentagon", pentagon),
        ("tiles", tiles),
    ] {
        for x in [1.0, 1.03] {
            let faces = Faces {
                room: room.clone(),
                wall: vec![sheet(x, 0.0, 1.0)],
                sidedness: Sidedness::Both,
            };
            let scene = scene_of(&faces, DQuat::IDENTITY);
            let world = World::new(&scene);
            for size in [0.07, 0.3, 0.5, 5.0] {
                let patches = world.mesh(PatchSize::Length(size)).expect("meshes");
                check_dark(
                    &format!("{name}, {x}, {size}"),
                    &world,
                    &patches,
                    DQuat::IDENTITY,
                );
            }
        }
    }
}

/// Patches of a mesh of one floor of a room with something in it, and of the room alone.
fn counts(things: Vec<Vec<DVec3>>, sidedness: Sidedness, size: f64) -> [usize; 2] {
    [things, Vec::new()].map(|wall| {
        let faces = Faces {
            room: two_rooms(),
            wall,
            sidedness,
        };
        let scene = scene_of(&faces, DQuat::IDENTITY);
        let world = World::new(&scene);
        let patches = world.mesh(PatchSize::Length(size)).expect("meshes");
        let of_room = patches.ids().filter(|&patch| {
            let (faces, _) = patches.faces(patch);
            faces.iter().all(|face| face.index() < 6)
        });

        of_room.count()
    })
}

#[test]
fn what_light_goes_around_divides_no_patch() {
    let v = DVec3::new;
    let half = |y: f64| {
        vec![
            v(1.03, 0.0, 0.0),
            v(1.03, y, 0.0),
            v(1.03, y, 1.0),
            v(1.03, 0.0, 1.0),
        ]
    };
    for size in [0.1, 0.3, 1.0] {
        let stool = solid(v(1.1, 0.3, 0.0), v(1.6, 0.8, 0.4));
        let [with, without] = counts(stool, Sidedness::Front, size);
        assert_eq!(with, without, "a box, {size}");
        let sill = solid(v(1.03, 0.05, 0.0), v(1.13, 0.95, 0.03 * size));
        let [with, without] = counts(sill, Sidedness::Front, size);
        assert_eq!(with, without, "a sill, {size}");
    }
    // A wall across a part of the only element of the floor; ceiling and one side wall besides.
    let [with, without] = counts(vec![half(0.6)], Sidedness::Both, 1.4);
    assert_eq!(
        with - without,
        1,
        "half a wall divides the side wall that it ends at"
    );
}

#[test]
fn the_foot_of_a_wall_belongs_to_the_side_that_looks() {
    let faces = Faces {
        room: two_rooms(),
        wall: vec![sheet(1.0, 0.0, 1.0)],
        sidedness: Sidedness::Both,
    };
    let scene = scene_of(&faces, DQuat::IDENTITY);
    let world = World::new(&scene);
    let geometry = world.surfaces().geometry();
    let floor = (0..6)
        .map(FaceId)
        .find(|&face| geometry.normal(face).z > 0.5)
        .expect("a floor");
    // The wall along a border of the grid, and across its only element.
    for size in [0.1, 5.0] {
        let patches = world.mesh(PatchSize::Length(size)).expect("meshes");
        for k in 0..1000 {
            let random = |d| hash::uniform(6, Stage::PATCHES, k, d);
            // Where f32 and the weights of corners put a point of the foot.
            let off = (random(0) - 0.5) * 2e-7;
            let unit = |p: DVec3| geometry.frame().to_unit(p);
            let point = unit(DVec3::new(1.0 + off, random(1), 0.0));
            let located = world.surfaces().locate(&[floor], point);
            let seen = |from: DVec3| {
                let position = || geometry.interpolate(located.triangle, located.u, located.v);
                patches
                    .seen_from(unit(from), located.triangle, position, Side::Front)
                    .expect("a front")
            };
            for (x, is_lit) in [(random(2), true), (1.0 + random(2), false)] {
                let from = DVec3::new(x, random(3), random(4).max(1e-3));
                let patch = seen(from);
                let middle = patches.sample(geometry, patch, [0.5, 0.5]).position;
                let middle = geometry.frame().to_world(middle).x;
                assert_eq!(middle < 1.0, is_lit, "{off} from {from}: {middle}");
            }
        }
    }
}
