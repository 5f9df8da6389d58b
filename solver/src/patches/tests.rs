//! Laws of the mesh: areas add up, and a point drawn from a patch is found in that patch.

use super::{Density, MeshError, PatchSize, Patches, Side};
use crate::sampling::{Stage, hash};
use crate::world::World;
use glam::DVec3;
use luxel_scenes::{Material, Reflectance, Scene, Sidedness};

fn scene_of(polygons: &[Vec<DVec3>], sidedness: Sidedness) -> Scene {
    let mut scene = Scene::default();
    let object = scene.push_object("object");
    let mut material = Material::diffuse("grey", Reflectance::splat(0.5));
    material.sidedness = sidedness;
    let material = scene.push_material(material);
    for polygon in polygons {
        scene.push_face(polygon, object, material);
    }
    scene
}

fn disk(corners: u32) -> Vec<DVec3> {
    (0..corners)
        .map(|k| {
            let angle = f64::from(k) / f64::from(corners) * std::f64::consts::TAU;
            DVec3::new(3.0 + angle.cos(), 0.0, angle.sin())
        })
        .rev()
        .collect()
}

/// A trapezoid, a triangle, a pair of triangles that make a rectangle, a disk, a soup of small
/// triangles.
fn mixed() -> Vec<Vec<DVec3>> {
    let v = DVec3::new;
    let mut polygons = vec![
        vec![
            v(0.0, 0.0, 0.0),
            v(1.0, 0.0, 0.0),
            v(0.8, 1.0, 0.0),
            v(0.1, 0.7, 0.0),
        ],
        vec![v(0.0, 0.0, 1.0), v(1.0, 0.2, 1.0), v(0.4, 1.0, 1.5)],
        vec![v(0.0, 2.0, 0.0), v(1.0, 2.0, 0.0), v(1.0, 2.0, 0.5)],
        vec![v(0.0, 2.0, 0.0), v(1.0, 2.0, 0.5), v(0.0, 2.0, 0.5)],
        disk(40),
    ];
    let random = |i: u64, d: u64| hash::uniform(2, Stage::PATCHES, i, d);
    for i in 0..400 {
        let origin = v(random(i, 0), random(i, 1), 3.0 + random(i, 2));
        let corner = |d: u64| origin + 0.03 * v(random(i, d), random(i, d + 1), random(i, d + 2));
        polygons.push(vec![corner(3), corner(6), corner(9)]);
    }
    polygons
}

fn polygon_area(polygon: &[DVec3]) -> f64 {
    let twice: DVec3 = polygon[1..]
        .windows(2)
        .map(|p| (p[0] - polygon[0]).cross(p[1] - polygon[0]))
        .sum();
    0.5 * twice.length()
}

fn check_laws(world: &World, patches: &Patches, sides: f64) {
    let geometry = world.surfaces().geometry();
    let total: f64 = world
        .scene()
        .face_ids()
        .map(|face| world.surfaces().area(face))
        .sum();
    let sum: f64 = patches.areas().iter().sum();
    // Cells clipped away at the rim of a disk are below 5 % of a cell each.
    assert!(
        (sum - sides * total).abs() < 0.02 * sides * total,
        "{sum} of {total}"
    );
    let mut found = 0;
    let mut drawn = 0;
    for patch in patches.ids() {
        let polygons = patches.polygons(geometry, patch);
        let area: f64 = polygons.iter().map(|polygon| polygon_area(polygon)).sum();
        let expected = patches.areas()[patch.index()];
        assert!(
            (area - expected).abs() < 1e-12 + 1e-9 * expected,
            "{area} {expected}"
        );
        let (faces, side) = patches.faces(patch);
        for k in 0..16 {
            let sample =
                [0, 1].map(|d| hash::uniform(3, Stage::PATCHES, u64::from(patch.0), 2 * k + d));
            let point = patches.sample(geometry, patch, sample);
            let located = world.surfaces().locate(faces, point.position);
            let back = patches.at(geometry, located.triangle, located.u, located.v, side);
            drawn += 1;
            found += usize::from(back == Some(patch));
        }
    }
    // A point within rounding of the border may fall to the neighbour.
    assert!(
        drawn - found <= drawn / 1000,
        "{found} of {drawn} points were found in their patch"
    );
}

#[test]
fn no_faces_no_patches() {
    let scene = Scene::default();
    let world = World::new(&scene);
    for size in [
        PatchSize::Length(0.1),
        PatchSize::Count(10),
        PatchSize::Whole,
        PatchSize::Objects,
    ] {
        assert!(
            world
                .mesh(size)
                .expect("an empty mesh is a mesh")
                .is_empty()
        );
    }
}

#[test]
fn points_are_found_in_the_patch_that_they_were_drawn_from() {
    for (sidedness, sides) in [(Sidedness::Front, 1.0), (Sidedness::Both, 2.0)] {
        let scene = scene_of(&mixed(), sidedness);
        let world = World::new(&scene);
        for size in [
            PatchSize::Length(0.11),
            PatchSize::Length(5.0),
            PatchSize::Whole,
        ] {
            check_laws(&world, &world.mesh(size).expect("meshes"), sides);
        }
    }
}

#[test]
fn the_number_of_patches_is_about_what_was_asked_for() {
    let scene = scene_of(&mixed(), Sidedness::Front);
    let world = World::new(&scene);
    for count in [100, 1000, 10_000] {
        let made = world.mesh(PatchSize::Count(count)).expect("meshes").len() as f64;
        let ratio = made / count as f64;
        // Small faces cannot be divided below their number, nor far above it.
        assert!((0.6..1.6).contains(&ratio), "{made} patches for {count}");
    }
}

#[test]
fn pairs_of_triangles_become_grids_of_squares() {
    let v = DVec3::new;
    let scene = scene_of(
        &[
            vec![v(0.0, 0.0, 0.0), v(2.0, 0.0, 0.0), v(2.0, 1.0, 0.0)],
            vec![v(0.0, 0.0, 0.0), v(2.0, 1.0, 0.0), v(0.0, 1.0, 0.0)],
        ],
        Sidedness::Front,
    );
    let world = World::new(&scene);
    let patches = world.mesh(PatchSize::Length(0.25)).expect("meshes");
    assert_eq!(patches.len(), 8 * 4);
    let cell = 0.25 * 0.25 / world.surfaces().geometry().frame().area_to_world(1.0);
    assert!(
        patches
            .areas()
            .iter()
            .all(|area| (area - cell).abs() < 1e-12)
    );
}

#[test]
fn sides_have_patches_of_their_own() {
    let scene = scene_of(&mixed()[..1], Sidedness::Both);
    let world = World::new(&scene);
    let geometry = world.surfaces().geometry();
    let patches = world.mesh(PatchSize::Whole).expect("meshes");
    assert_eq!(patches.len(), 2);
    let triangle = geometry
        .triangles_of(luxel_scenes::FaceId(0))
        .next()
        .expect("one");
    let at = |side| patches.at(geometry, triangle, 0.2, 0.2, side);
    assert_ne!(at(Side::Front), at(Side::Back));
    let one_sided = scene_of(&mixed()[..1], Sidedness::Front);
    let world = World::new(&one_sided);
    let patches = world.mesh(PatchSize::Whole).expect("meshes");
    assert_eq!(
        patches.at(world.surfaces().geometry(), triangle, 0.2, 0.2, Side::Back),
        None
    );
}

#[test]
fn impossible_sizes_are_errors() {
    let scene = scene_of(&mixed(), Sidedness::Front);
    let world = World::new(&scene);
    for size in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = world.mesh(PatchSize::Length(size)).err();
        assert!(matches!(error, Some(MeshError::Size(_))), "{size}");
    }
    assert!(matches!(
        world.mesh(PatchSize::Length(1e-7)).err(),
        Some(MeshError::TooMany { .. })
    ));
}

/// A density that grows along x, on a pilot of `count` patches.
fn sloped(world: &World, count: usize) -> Density {
    let geometry = world.surfaces().geometry();
    let pilot = world.mesh(PatchSize::Count(count)).expect("meshes");
    let values: Vec<f64> = pilot
        .ids()
        .map(|patch| {
            let x = pilot.sample(geometry, patch, [0.5, 0.5]).position.x;
            (2.0 * geometry.frame().to_world(DVec3::X * x).x).exp()
        })
        .collect();
    Density::new(world.surfaces(), pilot, values)
}

#[test]
fn points_are_found_in_graded_meshes_too() {
    for (sidedness, sides) in [(Sidedness::Front, 1.0), (Sidedness::Both, 2.0)] {
        let scene = scene_of(&mixed(), sidedness);
        let world = World::new(&scene);
        let density = sloped(&world, 300);
        for count in [30, 3000] {
            let patches = world.mesh_with_density(count, &density).expect("meshes");
            check_laws(&world, &patches, sides);
        }
    }
}

#[test]
fn densities_have_a_mean_of_one() {
    let scene = scene_of(&mixed(), Sidedness::Both);
    let world = World::new(&scene);
    let density = sloped(&world, 300);
    let (mut sum, mut total) = (0.0, 0.0);
    for face in world.scene().face_ids() {
        let area = world.surfaces().area(face);
        sum += area * density.face(face);
        total += area;
    }
    // Faces get the mean of their region, so that the sum over regions is that over faces, up to
    // the cells clipped away at the rim of the disk.
    assert!((sum / total - 1.0).abs() < 0.01, "{}", sum / total);
}

#[test]
fn patches_are_as_dense_as_was_asked_for() {
    let scene = scene_of(
        &[
            vec![
                DVec3::ZERO,
                DVec3::new(4.0, 0.0, 0.0),
                DVec3::new(4.0, 1.0, 0.0),
                DVec3::new(0.0, 1.0, 0.0),
            ],
            vec![
                DVec3::new(0.0, 0.0, 1.0),
                DVec3::new(4.0, 0.0, 1.0),
                DVec3::new(0.0, 4.0, 1.0),
            ],
        ],
        Sidedness::Front,
    );
    let world = World::new(&scene);
    let geometry = world.surfaces().geometry();
    // The far half is worth nine times as many patches per area as the near one.
    let pilot = world.mesh(PatchSize::Length(0.25)).expect("meshes");
    let is_far = |patches: &Patches, patch| {
        let centre = patches.sample(geometry, patch, [0.5, 0.5]).position;
        geometry.frame().to_world(centre).x > 2.0
    };
    let values = pilot
        .ids()
        .map(|patch| if is_far(&pilot, patch) { 9.0 } else { 1.0 })
        .collect();
    let density = Density::new(world.surfaces(), pilot, values);
    let patches = world.mesh_with_density(4000, &density).expect("meshes");
    let made = patches.len() as f64;
    assert!((made / 4000.0 - 1.0).abs() < 0.15, "{made} patches");
    let mut halves = [[0.0, 0.0]; 2];
    for patch in patches.ids() {
        let half = &mut halves[usize::from(is_far(&patches, patch))];
        half[0] += 1.0;
        half[1] += patches.areas()[patch.index()];
    }
    let [near, far] = halves.map(|[count, area]| count / area);
    // Levels of quadtrees are four apart: within a factor of two of nine, and the grid is chosen
    // between them.
    assert!((4.5..18.0).contains(&(far / near)), "{}", far / near);
}

#[test]
fn refined_meshes_keep_the_laws_and_are_balanced() {
    let scene = scene_of(&mixed(), Sidedness::Both);
    let world = World::new(&scene);
    let geometry = world.surfaces().geometry();
    let mut patches = world.mesh(PatchSize::Length(0.3)).expect("meshes");
    let target = geometry.frame().to_unit(DVec3::new(0.5, 0.45, 0.0));
    for round in 0..4 {
        let marked: Vec<bool> = patches
            .ids()
            .map(|patch| {
                let centre = patches.sample(geometry, patch, [0.5, 0.5]).position;
                let chance = hash::uniform(5, Stage::PATCHES, u64::from(patch.0), round);
                centre.distance(target) < f64::from(patches.size(patch)) || chance < 0.05
            })
            .collect();
        let refined = world.refine(&patches, &marked);
        assert!(refined.len() > patches.len());
        patches = refined;
        check_laws(&world, &patches, 2.0);
    }
    // Across an edge of an element lie at most two of its neighbours' edges: no corner of another
    // element of the region lies at a quarter of it.
    for polygon in &mixed()[..2] {
        let on_face: Vec<Vec<DVec3>> = patches
            .ids()
            .filter(|&patch| {
                let (faces, side) = patches.faces(patch);
                let corner = geometry.frame().to_unit(polygon[0]);
                side == Side::Front && geometry.polygon(faces[0])[0].distance(corner) < 1e-12
            })
            .flat_map(|patch| patches.polygons(geometry, patch))
            .collect();
        assert!(on_face.len() > 10);
        for element in &on_face {
            for k in 0..element.len() {
                let (a, b) = (element[k], element[(k + 1) % element.len()]);
                for share in [0.25, 0.75] {
                    let quarter = a.lerp(b, share);
                    let touches = on_face
                        .iter()
                        .flatten()
                        .any(|corner| corner.distance(quarter) < 1e-9 * a.distance(b));
                    assert!(!touches, "{quarter}");
                }
            }
        }
    }
}
