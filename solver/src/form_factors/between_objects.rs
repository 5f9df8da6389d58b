//! Form factors between the objects of a scene, front to front.
//!
//! F_AB = (1/A_A) Σ_{p∈A} A_p Σ_{q∈B} F_pq over the faces p, q, from the form factors between faces
//! ([`between_objects`]); or the fraction of the cosine-distributed rays from A that meet a front of B
//! first ([`ray_cast_between_objects`]), which is unbiased and costs N rays an object, whatever its
//! faces. Source: see [`super::ray_cast`].

use super::ray_cast::{RayCastConfig, ray_cast};
use crate::patches::{PatchId, PatchSize, Patches, Side};
use crate::transport::{Dense, Transport};
use crate::world::World;
use luxel_scenes::ObjectId;

/// Form factors between objects, row-major n×n.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectFactors {
    /// The objects that have faces, in the order of the scene.
    pub objects: Vec<ObjectId>,
    /// Their areas in m².
    pub areas: Vec<f64>,
    /// F from `objects[i]` to `objects[j]` at `i * n + j`.
    pub factors: Vec<f64>,
    /// Standard error of each factor; zero where it is exact or all samples agreed.
    pub standard_error: Vec<f64>,
}

/// The objects that have faces.
struct Objects {
    ids: Vec<ObjectId>,
    /// Areas of the fronts in square units.
    areas: Vec<f64>,
    /// Position in `ids` of each object of the scene; 0 for those without faces.
    place: Vec<usize>,
}

impl Objects {
    fn new(world: &World) -> Self {
        let scene = world.scene();
        let mut area_of = vec![None; scene.objects.len()];
        for (face, id) in scene.faces.iter().zip(scene.face_ids()) {
            *area_of[face.object.index()].get_or_insert(0.0) += world.surfaces().area(id);
        }
        let (mut ids, mut areas, mut place) = (Vec::new(), Vec::new(), vec![0; area_of.len()]);
        for (index, area) in area_of.into_iter().enumerate() {
            if let Some(area) = area {
                place[index] = ids.len();
                ids.push(ObjectId::new(index));
                areas.push(area);
            }
        }
        Self { ids, areas, place }
    }

    fn finish(self, world: &World, factors: Vec<f64>, standard_error: Vec<f64>) -> ObjectFactors {
        let frame = world.surfaces().geometry().frame();
        ObjectFactors {
            areas: self
                .areas
                .iter()
                .map(|&area| frame.area_to_world(area))
                .collect(),
            objects: self.ids,
            factors,
            standard_error,
        }
    }
}

/// Form factors between objects from those between patches, of which every one must belong to a single
/// object ([`crate::patches::PatchSize::Whole`] sees to that); `standard_error` of each is row-major,
/// pairs being independent. Backs of two-sided faces are left out.
///
/// # Panics
/// When the matrix or the errors do not fit the patches.
pub fn between_objects(
    world: &World,
    patches: &Patches,
    matrix: &Dense,
    standard_error: &[f64],
) -> ObjectFactors {
    let len = patches.len();
    assert_eq!(matrix.len(), len, "one row per patch");
    assert_eq!(standard_error.len(), len * len, "one error per factor");
    let all = Objects::new(world);
    let object = |patch: usize| {
        let (faces, side) = patches.faces(PatchId(patch as u32));
        let object = world.scene().faces[faces[0].index()].object;
        (side == Side::Front).then(|| all.place[object.index()])
    };
    let objects: Vec<Option<usize>> = (0..len).map(object).collect();
    let n = all.ids.len();
    let mut factors = vec![0.0; n * n];
    let mut variance = vec![0.0; n * n];
    for (i, a) in objects.iter().enumerate() {
        let Some(a) = *a else { continue };
        let weight = patches.areas()[i] / all.areas[a];
        for (j, b) in objects.iter().enumerate() {
            let Some(b) = *b else { continue };
            factors[a * n + b] += weight * matrix.get(i, j);
            let error = weight * standard_error[i * len + j];
            // Within one object a pair is met twice with the same error.
            variance[a * n + b] += error * error * if a == b { 2.0 } else { 1.0 };
        }
    }
    let standard_error = variance.into_iter().map(f64::sqrt).collect();
    all.finish(world, factors, standard_error)
}

/// The ray-cast factors of a mesh of one patch for each object; `config.rays` rays for each.
///
/// # Panics
/// Never: any scene can be meshed by its objects.
pub fn ray_cast_between_objects(world: &World, config: &RayCastConfig) -> ObjectFactors {
    let patches = world
        .mesh(PatchSize::Objects)
        .expect("a mesh of whole objects has no size to be wrong");
    let cast = ray_cast(world, &patches, config);
    Objects::new(world).finish(world, cast.factors, cast.standard_error)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::{AnalyticConfig, analytic_factors};
    use crate::patches::PatchSize;
    use glam::DVec3;
    use luxel_scenes::{Material, Reflectance, Scene};

    /// The analytic factors between the objects of a scene.
    fn analytic(world: &World) -> ObjectFactors {
        let patches = world.mesh(PatchSize::Whole).expect("a mesh");
        let config = AnalyticConfig {
            accuracy: 1e-12,
            points: 400,
            seed: 1,
        };
        let factors = analytic_factors(world, &patches, &config);
        between_objects(world, &patches, &factors.matrix, &factors.standard_error)
    }

    /// Adds a unit square at height z, facing up or down, scaled about its middle.
    fn square(scene: &mut Scene, name: &str, z: f64, up: bool, side: f64) {
        let object = scene.push_object(name);
        let material = scene.push_material(Material::diffuse("grey", Reflectance::splat(0.5)));
        let corner = |x: f64, y: f64| DVec3::new(x * side / 2.0, y * side / 2.0, z);
        let mut corners = [
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ];
        if !up {
            corners.reverse();
        }
        scene.push_face(&corners, object, material);
    }

    /// F between opposite faces of a cube (Howell C-11).
    const CUBE: f64 = 0.199_824_895_698_387_1;

    #[test]
    fn facing_squares_are_exact_and_reciprocal() {
        let mut scene = Scene::default();
        square(&mut scene, "floor", 0.0, true, 1.0);
        square(&mut scene, "ceiling", 1.0, false, 1.0);
        let result = analytic(&World::new(&scene));
        assert!(
            result.areas.iter().all(|area| (area - 1.0).abs() < 1e-15),
            "areas"
        );
        for at in [1, 2] {
            assert!(
                (result.factors[at] - CUBE).abs() < 1e-12,
                "F = {}",
                result.factors[at]
            );
            assert!(result.standard_error[at] == 0.0, "nothing stands between");
        }
        assert!(
            result.factors[0] == 0.0 && result.factors[3] == 0.0,
            "itself"
        );
    }

    #[test]
    fn estimators_agree_behind_a_screen() {
        // Two squares with a smaller one half way, which looks at the ceiling.
        let mut scene = Scene::default();
        square(&mut scene, "floor", 0.0, true, 1.0);
        square(&mut scene, "ceiling", 1.0, false, 1.0);
        square(&mut scene, "screen", 0.5, true, 0.5);
        let world = World::new(&scene);
        let exact = analytic(&world);
        let cast = ray_cast_between_objects(
            &world,
            &RayCastConfig {
                rays: 1 << 18,
                seed: 1,
            },
        );
        assert!(exact.factors[1] < 0.9 * CUBE, "the screen hides a part");
        for at in 0..9 {
            let difference = (exact.factors[at] - cast.factors[at]).abs();
            let error = exact.standard_error[at].hypot(cast.standard_error[at]);
            // Nine entries: 4 standard errors of 31 degrees of freedom happen once in 3000.
            assert!(
                difference <= 4.0 * error + 1e-12,
                "entry {at}: {difference} against {error}"
            );
        }
        // The back of the screen is no receiver.
        assert!(cast.factors[2] == 0.0, "floor to screen");
    }
}
