//! The hemicube on the patches and the objects of a scene.
//!
//! Patches may be made of several polygons and lie on either side of a face; every face occludes, from
//! both sides. Form factors are pure numbers, so that the unit frame of the patches needs no
//! conversion. Cost and bias: see `hemicube`.

use super::between_objects::ObjectFactors;
use super::hemicube::{Facet, FacetSide, HemicubeConfig, hemicube_of};
use super::polygon::Polygon;
use crate::patches::{PatchId, Patches, Side};
use crate::transport::Dense;
use crate::world::World;
use luxel_scenes::ObjectId;

/// F between all patches by hemicubes. Biased, see [`super::HemicubeConfig`] and the module of the
/// hemicube.
pub fn hemicube_between_patches(
    world: &World,
    patches: &Patches,
    config: &HemicubeConfig,
) -> Dense {
    let polygons = polygons(world, patches);
    let mut facets = Vec::new();
    for (index, parts) in polygons.iter().enumerate() {
        let (faces, side) = patches.faces(PatchId(index as u32));
        // The other side of a two-sided face is a patch of its own, which stands for itself.
        let is_two_sided = side == Side::Back
            || faces
                .iter()
                .all(|&face| world.surfaces().has_side(face, Side::Back));
        let back = if is_two_sided {
            FacetSide::Open
        } else {
            FacetSide::Black
        };
        facets.extend(parts.iter().map(|part| Facet {
            vertices: part.vertices(),
            normal: part.normal(),
            front: FacetSide::Counted(index as u32),
            back,
        }));
    }
    hemicube_of(&polygons, &facets, config)
}

/// F between the objects of a scene, front to front, by hemicubes on each of their faces. Biased, as above;
/// no standard errors are known.
pub fn hemicube_between_objects(world: &World, config: &HemicubeConfig) -> ObjectFactors {
    let scene = world.scene();
    let geometry = world.surfaces().geometry();
    let mut objects: Vec<ObjectId> = scene.faces.iter().map(|face| face.object).collect();
    objects.sort_unstable();
    objects.dedup();
    let place = |object| objects.partition_point(|&listed| listed < object);
    let mut polygons = vec![Vec::new(); objects.len()];
    for (face, id) in scene.faces.iter().zip(scene.face_ids()) {
        if let Ok(polygon) = Polygon::new(&geometry.polygon(id)) {
            polygons[place(face.object)].push(polygon);
        }
    }
    let facets: Vec<Facet> = polygons
        .iter()
        .enumerate()
        .flat_map(|(index, parts)| {
            parts.iter().map(move |part| Facet {
                vertices: part.vertices(),
                normal: part.normal(),
                front: FacetSide::Counted(index as u32),
                back: FacetSide::Black,
            })
        })
        .collect();
    let matrix = hemicube_of(&polygons, &facets, config);
    let n = objects.len();
    ObjectFactors {
        areas: polygons
            .iter()
            .map(|parts| {
                geometry
                    .frame()
                    .area_to_world(parts.iter().map(Polygon::area).sum())
            })
            .collect(),
        objects,
        factors: (0..n).flat_map(|row| matrix.row(row).to_vec()).collect(),
        standard_error: vec![0.0; n * n],
    }
}

/// The polygons of each patch, without those that have no area.
fn polygons(world: &World, patches: &Patches) -> Vec<Vec<Polygon>> {
    let geometry = world.surfaces().geometry();
    patches
        .ids()
        .map(|patch| {
            patches
                .polygons(geometry, patch)
                .iter()
                .filter_map(|vertices| Polygon::new(vertices).ok())
                .collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::{
        RayCastConfig, analytic_between_objects, analytic_between_patches, ray_cast,
    };
    use crate::patches::PatchSize;
    use crate::transport::Transport;
    use glam::DVec3;
    use luxel_scenes::{Material, Reflectance, Scene, Sidedness};

    /// A room 2×2×2 with a two-sided screen in the middle.
    fn room_with_screen() -> Scene {
        let mut scene = Scene::default();
        let object = scene.push_object("room");
        let wall = scene.push_material(Material::diffuse("wall", Reflectance::splat(0.5)));
        let mut both = Material::diffuse("screen", Reflectance::splat(0.5));
        both.sidedness = Sidedness::Both;
        let screen = scene.push_material(both);
        let (o, x, y, z) = (DVec3::ZERO, DVec3::X * 2.0, DVec3::Y * 2.0, DVec3::Z * 2.0);
        for face in [
            [o, y, y + z, z],
            [x, x + z, x + y + z, x + y],
            [o, z, x + z, x],
            [y, x + y, x + y + z, y + z],
            [o, x, x + y, y],
            [z, y + z, x + y + z, x + z],
        ] {
            scene.push_face(&face, object, wall);
        }
        let middle = [[0.4, 0.3], [1.7, 0.3], [1.7, 1.5], [0.4, 1.5]];
        scene.push_face(&middle.map(|[u, v]| DVec3::new(u, v, 1.0)), object, screen);
        scene
    }

    #[test]
    fn three_estimators_agree() {
        let scene = room_with_screen();
        let world = World::new(&scene);
        let patches = world.mesh(PatchSize::Whole).expect("a mesh");
        let n = patches.len();
        let points = RayCastConfig {
            rays: 2000,
            seed: 1,
        };
        let exact = analytic_between_patches(&world, &patches, &points);
        let cubes = hemicube_between_patches(&world, &patches, &HemicubeConfig::balanced(128));
        let rays = RayCastConfig {
            rays: 1 << 16,
            seed: 1,
        };
        let cast = ray_cast(&world, &patches, &rays);
        for i in 0..n {
            // Closed: what a row misses is the error of its occluded entries.
            let sum: f64 = exact.factors[i * n..(i + 1) * n].iter().sum();
            assert!((sum - 1.0).abs() < 1e-4, "row {i}: {sum}");
            assert!((cubes.row_sum(i) - 1.0).abs() < 1e-12, "row {i}");
            for j in 0..n {
                let f = exact.factors[i * n + j];
                let (ray, error) = (cast.factors[i * n + j], cast.standard_error[i * n + j]);
                // Sixty-four pairs, 31 degrees of freedom: five standard errors.
                assert!(
                    (ray - f).abs() <= 5.0 * error + 1e-4,
                    "rays F[{i}][{j}]: {ray} with {error} against {f}"
                );
                // The hemicube's order one with a constant of 1/2, and shadows.
                let cube = cubes.get(i, j);
                assert!(
                    (cube - f).abs() <= 1.0 / 128.0,
                    "hemicube F[{i}][{j}]: {cube} against {f}"
                );
            }
        }
    }

    #[test]
    fn objects_agree_and_offsets_do_not_matter() {
        let mut scene = Scene::default();
        let grey = scene.push_material(Material::diffuse("grey", Reflectance::splat(0.5)));
        // Two objects of two faces each, turned so that no coordinate is round, and a plate between.
        let turn = glam::DMat3::from_euler(glam::EulerRot::XYZ, 0.3, 0.7, 1.1);
        let quad = |low: [f64; 2], high: [f64; 2], z: f64, up: bool| {
            let mut corners = [
                DVec3::new(low[0], low[1], z),
                DVec3::new(high[0], low[1], z),
                DVec3::new(high[0], high[1], z),
                DVec3::new(low[0], high[1], z),
            ];
            if !up {
                corners.reverse();
            }
            corners.map(|v| turn * v)
        };
        let below = scene.push_object("below");
        scene.push_face(&quad([0.0, 0.0], [0.5, 1.0], 0.0, true), below, grey);
        scene.push_face(&quad([0.5, 0.0], [1.0, 1.0], 0.0, true), below, grey);
        let above = scene.push_object("above");
        scene.push_face(&quad([0.0, 0.0], [1.0, 0.4], 1.0, false), above, grey);
        scene.push_face(&quad([0.0, 0.4], [1.0, 1.0], 1.0, false), above, grey);
        let config = RayCastConfig {
            rays: 2048,
            seed: 5,
        };
        let open = |scene: &Scene| analytic_between_objects(&World::new(scene), &config);
        let factors = open(&scene);
        // Howell C-11 of the unit cube, from four exact pairs.
        assert!(
            (factors.factors[1] - 0.199_824_895_698_387_4).abs() < 1e-12,
            "exact"
        );
        assert!(factors.standard_error[1] == 0.0, "nothing stands between");
        let mut moved = scene.clone();
        for vertex in &mut moved.vertices {
            *vertex += DVec3::new(1e5, -1e5, 1e5);
        }
        let far = open(&moved);
        // Coordinates are rounded to 1e-11, and nothing but that changes.
        assert!((far.factors[1] - factors.factors[1]).abs() < 1e-9, "moved");
        assert!(far.standard_error[1] == 0.0, "still nothing stands between");

        let plate = scene.push_object("plate");
        scene.push_face(&quad([0.25, 0.25], [0.75, 0.75], 0.5, true), plate, grey);
        let world = World::new(&scene);
        let exact = analytic_between_objects(&world, &config);
        let cubes = hemicube_between_objects(&world, &HemicubeConfig::balanced(128));
        assert_eq!(exact.objects, cubes.objects, "the same objects");
        for (at, (e, c)) in exact.factors.iter().zip(&cubes.factors).enumerate() {
            assert!((e - c).abs() < 1.0 / 128.0, "entry {at}: {c} against {e}");
        }
        // The exact case of a half-size blocker half way between unit squares.
        assert!(
            (exact.factors[1] - 0.099_506_294_598_984_8).abs() < 1e-5,
            "hidden"
        );
    }
}
