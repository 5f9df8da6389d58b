//! The analytic and the hemicube estimator on the patches of a scene.
//!
//! Patches may be made of several polygons and lie on either side of a face; every face occludes, from
//! both sides. The ray-cast estimator has the same form. Form factors are pure numbers, so that the
//! unit frame of the patches needs no conversion.

use super::hemicube::{Facet, FacetSide, HemicubeConfig, hemicube_of};
use super::occluded::{AnalyticConfig, AnalyticFactors, analytic};
use super::polygon::Polygon;
use crate::patches::{PatchId, Patches, Side};
use crate::transport::Dense;
use crate::world::World;
use luxel_scenes::FaceId;

/// F between all patches by exact integrals: pairs that nothing occludes to the accuracy asked for, others
/// with a standard error.
pub fn analytic_factors(
    world: &World,
    patches: &Patches,
    config: &AnalyticConfig,
) -> AnalyticFactors {
    let geometry = world.surfaces().geometry();
    let occluders: Vec<Polygon> = (0..geometry.face_count())
        .filter_map(|index| Polygon::new(&geometry.polygon(FaceId::new(index))).ok())
        .collect();
    analytic(&polygons(world, patches), &occluders, config)
}

/// F between all patches by hemicubes. Biased, see [`super::HemicubeConfig`] and the module of the
/// hemicube.
pub fn hemicube_factors(world: &World, patches: &Patches, config: &HemicubeConfig) -> Dense {
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
    use crate::form_factors::{RayCastConfig, ray_cast};
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
        let config = AnalyticConfig {
            accuracy: 1e-9,
            points: 2000,
            seed: 1,
        };
        let exact = analytic_factors(&world, &patches, &config);
        let cubes = hemicube_factors(&world, &patches, &HemicubeConfig::balanced(128));
        let rays = RayCastConfig {
            rays: 1 << 16,
            seed: 1,
        };
        let cast = ray_cast(&world, &patches, &rays);
        for i in 0..n {
            // Closed: what a row misses is the error of its occluded entries.
            assert!((exact.matrix.row_sum(i) - 1.0).abs() < 1e-4, "row {i}");
            assert!((cubes.row_sum(i) - 1.0).abs() < 1e-12, "row {i}");
            for j in 0..n {
                let f = exact.matrix.get(i, j);
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
}
