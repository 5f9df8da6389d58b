//! The analytic and the hemicube estimator on the patches of a scene.
//!
//! Patches may be made of several polygons and lie on either side of a face; every face occludes, from
//! both sides. Form factors are pure numbers, so that the unit frame of the patches needs no
//! conversion. Cost and errors: see `occluded` and `hemicube`.

use super::hemicube::{Facet, FacetSide, HemicubeConfig, hemicube_of};
use super::occluded::{AnalyticConfig, AnalyticFactors, Exchange, analytic_by, exchange_past};
use super::polygon::Polygon;
use super::polygon_to_polygon::exchange_area;
use super::segments::visible_share;
use super::shaft::candidates;
use crate::patches::{PatchId, Patches, Side};
use crate::transport::Dense;
use crate::world::World;
use luxel_scenes::FaceId;

/// Faces in the shaft of a pair up to which they are subtracted exactly. Each costs about 1 µs a point,
/// so that beyond some dozens segments are cheaper, though less exact.
const MAX_EXACT: usize = 48;

/// F between all patches, each side of a two-sided face a patch of its own: exact where nothing reaches
/// into the shaft of a pair, else with a standard error (see `occluded`); past more than 48 faces
/// visibility is sampled by segments (see `segments`), with a small bias. Reciprocal to rounding.
pub fn analytic_factors(
    world: &World,
    patches: &Patches,
    config: &AnalyticConfig,
) -> AnalyticFactors {
    let geometry = world.surfaces().geometry();
    let (faces, occluders): (Vec<FaceId>, Vec<Polygon>) = (0..geometry.face_count())
        .map(FaceId::new)
        .filter_map(|face| Some((face, Polygon::new(&geometry.polygon(face)).ok()?)))
        .unzip();
    let margin = rounding(world);
    let polygons = polygons(world, patches);
    // The faces that a patch lies on are planar and hide nothing of it. Those of a cluster do hide each
    // other.
    let own: Vec<&[FaceId]> = patches
        .ids()
        .map(|patch| patches.faces(patch).0)
        .map(|faces| if faces.len() <= 2 { faces } else { &[] })
        .collect();
    analytic_by(&polygons, |[i, k], [j, l], item| {
        let (p, q) = (&polygons[i][k], &polygons[j][l]);
        let whole = exchange_area(p, q, config.accuracy);
        if whole == 0.0 {
            return Exchange::default();
        }
        let between: Vec<&Polygon> = candidates(p, q, &occluders, margin)
            .into_iter()
            .filter(|&k| !own[i].contains(&faces[k]) && !own[j].contains(&faces[k]))
            .map(|k| &occluders[k])
            .collect();
        match between.len() {
            0 => Exchange {
                area: whole,
                standard_error: 0.0,
            },
            1..=MAX_EXACT => exchange_past(p, q, &between, config, item),
            _ => {
                let own = |face| own[i].contains(&face) || own[j].contains(&face);
                let (visible, error) = visible_share(world, [p, q], own, item, config);
                Exchange {
                    area: whole * visible,
                    standard_error: whole * error,
                }
            }
        }
    })
}

/// How far coordinates in the unit frame may be rounded, in units: those of the scene, a few times.
fn rounding(world: &World) -> f64 {
    let frame = world.surfaces().geometry().frame();
    let largest = world
        .scene()
        .bounds()
        .map_or(0.0, |(low, high)| low.abs().max(high.abs()).max_element());
    8.0 * f64::EPSILON * (largest / frame.metres_per_unit).max(1.0)
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

    const CONFIG: AnalyticConfig = AnalyticConfig {
        accuracy: 1e-11,
        points: 2000,
        seed: 1,
    };

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
        let exact = analytic_factors(&world, &patches, &CONFIG);
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

    /// The corners of a rectangle at height z, turned so that no coordinate is round.
    fn turned(low: [f64; 2], high: [f64; 2], z: f64, is_up: bool) -> [DVec3; 4] {
        let turn = glam::DMat3::from_euler(glam::EulerRot::XYZ, 0.3, 0.7, 1.1);
        let mut corners = [
            DVec3::new(low[0], low[1], z),
            DVec3::new(high[0], low[1], z),
            DVec3::new(high[0], high[1], z),
            DVec3::new(low[0], high[1], z),
        ];
        if !is_up {
            corners.reverse();
        }
        corners.map(|v| turn * v)
    }

    #[test]
    fn an_empty_shaft_stays_empty_far_from_the_origin() {
        let mut scene = Scene::default();
        let grey = scene.push_material(Material::diffuse("grey", Reflectance::splat(0.5)));
        let object = scene.push_object("cube");
        // Opposite faces of a cube, one in two parts with a T-junction to a third.
        scene.push_face(&turned([0.0, 0.0], [0.5, 1.0], 0.0, true), object, grey);
        scene.push_face(&turned([0.5, 0.0], [1.0, 1.0], 0.0, true), object, grey);
        scene.push_face(&turned([0.0, 0.0], [1.0, 1.0], 1.0, false), object, grey);
        scene.push_face(&turned([1.0, 0.0], [2.0, 1.0], 0.0, true), object, grey);
        for offset in [0.0, 1e5] {
            let mut moved = scene.clone();
            for vertex in &mut moved.vertices {
                *vertex += DVec3::new(1.0, -1.0, 1.0) * offset;
            }
            let world = World::new(&moved);
            let patches = world.mesh(PatchSize::Whole).expect("a mesh");
            let factors = analytic_factors(&world, &patches, &CONFIG);
            assert!(
                factors.standard_error.iter().all(|&e| e == 0.0),
                "nothing stands between, at {offset}"
            );
            // Howell C-11 of the unit cube; coordinates are rounded to offset times eps.
            let f = factors.matrix.get(2, 0) + factors.matrix.get(2, 1);
            assert!(
                (f - 0.199_824_895_698_387_4).abs() <= 1e-12 + 10.0 * f64::EPSILON * offset,
                "{f} at {offset}"
            );
        }
    }

    #[test]
    fn many_occluders_are_sampled_and_agree() {
        // A plate cut into 8x8 pieces hides as much as a whole one.
        let scene = |k: usize| {
            let mut scene = Scene::default();
            let grey = scene.push_material(Material::diffuse("grey", Reflectance::splat(0.5)));
            let object = scene.push_object("plates");
            scene.push_face(&turned([0.0, 0.0], [1.0, 1.0], 0.0, true), object, grey);
            scene.push_face(&turned([0.0, 0.0], [1.0, 1.0], 1.0, false), object, grey);
            for cell in 0..k * k {
                let at = |c: usize| 0.25 + 0.5 * c as f64 / k as f64;
                let (i, j) = (cell / k, cell % k);
                let piece = turned([at(i), at(j)], [at(i + 1), at(j + 1)], 0.5, true);
                scene.push_face(&piece, object, grey);
            }
            scene
        };
        // The exact case of a half-size blocker half way between unit squares.
        let exact = 0.099_506_294_598_984_8;
        for k in [1, 3, 8] {
            let scene = scene(k);
            let world = World::new(&scene);
            let patches = world.mesh(PatchSize::Whole).expect("a mesh");
            let factors = analytic_factors(&world, &patches, &CONFIG);
            let n = patches.len();
            // The patches of the two squares: the largest.
            let big: Vec<usize> = (0..n)
                .filter(|&k| {
                    patches.areas()[k] > 0.9 * patches.areas()[0].max(patches.areas()[n - 1])
                })
                .collect();
            let [a, b] = big[..] else {
                panic!("two squares among {n} patches");
            };
            let (f, error) = (factors.matrix.get(a, b), factors.standard_error[a * n + b]);
            let e = (f - exact).abs();
            let limit = if k * k > MAX_EXACT { 5e-3 } else { 2e-5 };
            assert!(e <= 6.0 * error && e <= limit, "{k}x{k}: {f} with {error}");
        }
    }
}
