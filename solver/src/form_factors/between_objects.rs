//! Form factors between the objects of a scene, front to front.
//!
//! F_AB = (1/A_A) Σ_{p∈A} A_p Σ_{q∈B} F_pq over the faces p, q, from the form factors between faces
//! ([`between_objects`]); or the fraction of the cosine-distributed rays from A that meet a front of B
//! first ([`ray_cast_between_objects`]), which is unbiased and costs N rays an object, whatever its
//! faces. Source: see [`super::ray_cast`].

use super::polygon::Polygon;
use super::ray_cast::{REPLICATES, RayCastConfig};
use crate::bvh::{Hit, Ray};
use crate::geometry::{offset_bound, ray_origin};
use crate::patches::{PatchId, Patches, Side};
use crate::sampling::{self, Discrete, Frame, Sequence, Stage, cosine_hemisphere};
use crate::transport::{Dense, Transport};
use crate::world::World;
use glam::DVec3;
use luxel_scenes::{FaceId, ObjectId};
use rayon::prelude::*;

/// Largest relative margin along the edges of a facet that no points are drawn from. It is reached by
/// slivers a few thousandths of the scene wide; larger would bias them visibly.
const MAX_INSET: f64 = 1e-3;

/// Rays per batch.
const BATCH: u32 = 1024;

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

/// A face that rays leave.
struct Facet {
    /// Position of its object in [`ObjectFactors::objects`].
    object: usize,
    /// In the unit frame, like all below.
    exact: Polygon,
    points: sampling::Polygon,
    extent: f64,
    /// Mean of the corners.
    middle: DVec3,
    /// How far points are drawn towards the middle, relative to their distance from it.
    inset: f64,
}

impl Facet {
    /// A facet from its corners in the unit frame; `None` where it has no area and hence exchanges
    /// nothing.
    fn new(object: usize, corners: &[DVec3]) -> Option<Self> {
        let exact = Polygon::new(corners).ok()?;
        let points = sampling::Polygon::new(corners)?;
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let bounds = corners
            .iter()
            .fold((middle, middle), |(lo, hi), &c| (lo.min(c), hi.max(c)));
        let extent = (bounds.1 - bounds.0).max_element();
        let width = exact.area() / extent;
        Some(Self {
            object,
            inset: (8.0 * offset_bound(middle, extent) / width).min(MAX_INSET),
            exact,
            points,
            extent,
            middle,
        })
    }

    /// A point for `u` in the unit square, even over the facet but for a margin along its edges of
    /// a few times the rounding of ray origins: a point on an edge could be rounded to behind the
    /// face that adjoins there, which would then seem to block it.
    fn point(&self, u: [f64; 2]) -> DVec3 {
        self.points.sample(u).lerp(self.middle, self.inset)
    }
}

/// The facets of a scene and what the result says about objects.
struct Facets {
    all: Vec<Facet>,
    objects: Vec<ObjectId>,
    /// Areas in square units.
    areas: Vec<f64>,
}

impl Facets {
    fn new(world: &World) -> Self {
        let scene = world.scene();
        let geometry = world.surfaces().geometry();
        let mut place = vec![usize::MAX; scene.objects.len()];
        let mut objects = Vec::new();
        for (index, place) in place.iter_mut().enumerate() {
            if scene.faces.iter().any(|face| face.object.index() == index) {
                *place = objects.len();
                objects.push(ObjectId::new(index));
            }
        }
        let facet = |face: FaceId| {
            let object = place[scene.faces[face.index()].object.index()];
            Facet::new(object, &geometry.polygon(face))
        };
        let all: Vec<Facet> = scene.face_ids().filter_map(facet).collect();
        let mut areas = vec![0.0; objects.len()];
        for facet in &all {
            areas[facet.object] += facet.exact.area();
        }
        Self {
            all,
            objects,
            areas,
        }
    }

    /// Position of each object of the scene among those with faces; 0 for the others.
    fn places(&self, world: &World) -> Vec<usize> {
        let mut place = vec![0; world.scene().objects.len()];
        for (index, object) in self.objects.iter().enumerate() {
            place[object.index()] = index;
        }
        place
    }

    fn finish(self, world: &World, factors: Vec<f64>, standard_error: Vec<f64>) -> ObjectFactors {
        let frame = world.surfaces().geometry().frame();
        ObjectFactors {
            areas: self
                .areas
                .iter()
                .map(|&area| frame.area_to_world(area))
                .collect(),
            objects: self.objects,
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
    let facets = Facets::new(world);
    let place = facets.places(world);
    let object = |patch: usize| {
        let (faces, side) = patches.faces(PatchId(patch as u32));
        let object = world.scene().faces[faces[0].index()].object;
        (side == Side::Front).then(|| place[object.index()])
    };
    let objects: Vec<Option<usize>> = (0..len).map(object).collect();
    let n = facets.objects.len();
    let mut factors = vec![0.0; n * n];
    let mut variance = vec![0.0; n * n];
    for (i, a) in objects.iter().enumerate() {
        let Some(a) = *a else { continue };
        let weight = patches.areas()[i] / facets.areas[a];
        for (j, b) in objects.iter().enumerate() {
            let Some(b) = *b else { continue };
            factors[a * n + b] += weight * matrix.get(i, j);
            let error = weight * standard_error[i * len + j];
            // Within one object a pair is met twice with the same error.
            variance[a * n + b] += error * error * if a == b { 2.0 } else { 1.0 };
        }
    }
    let standard_error = variance.into_iter().map(f64::sqrt).collect();
    facets.finish(world, factors, standard_error)
}

/// Rays from points spread evenly over each object; `config.rays` for each, rounded up to a
/// multiple of [`REPLICATES`].
pub fn ray_cast_between_objects(world: &World, config: &RayCastConfig) -> ObjectFactors {
    let facets = Facets::new(world);
    let n = facets.objects.len();
    let place = facets.places(world);
    let per_replicate = (config.rays as u64).div_ceil(REPLICATES).max(1) as u32;
    let tasks: Vec<(usize, u64)> = (0..n)
        .flat_map(|object| (0..REPLICATES).map(move |replicate| (object, replicate)))
        .collect();
    let own: Vec<Vec<&Facet>> = (0..n)
        .map(|object| {
            let facets = facets.all.iter();
            facets.filter(|facet| facet.object == object).collect()
        })
        .collect();
    let fractions: Vec<Vec<f64>> = tasks
        .par_iter()
        .map(|&(object, replicate)| {
            let item = replicate << 32 | object as u64;
            let sequence = Sequence::new(config.seed, Stage::FORM_FACTORS, item);
            let mut counts = vec![0u32; n];
            shoot(world, &own[object], &sequence, per_replicate, |object| {
                counts[place[object.index()]] += 1;
            });
            let share = |count: u32| f64::from(count) / f64::from(per_replicate);
            counts.into_iter().map(share).collect()
        })
        .collect();

    let r = REPLICATES as f64;
    let mut factors = Vec::with_capacity(n * n);
    let mut standard_error = Vec::with_capacity(n * n);
    for rows in fractions.chunks(REPLICATES as usize) {
        for b in 0..n {
            let mean = rows.iter().map(|row| row[b]).sum::<f64>() / r;
            let squares: f64 = rows.iter().map(|row| (row[b] - mean).powi(2)).sum();
            factors.push(mean);
            standard_error.push((squares / (r * (r - 1.0))).sqrt());
        }
    }
    facets.finish(world, factors, standard_error)
}

/// Casts cosine-distributed rays from points spread evenly over the fronts of `facets`; `met` is
/// called with the object of every front that one meets.
fn shoot(
    world: &World,
    facets: &[&Facet],
    sequence: &Sequence,
    count: u32,
    mut met: impl FnMut(ObjectId),
) {
    // Objects whose faces have no area send nothing.
    let Ok(choice) = Discrete::new(facets.iter().map(|facet| facet.exact.area())) else {
        return;
    };
    let mut rays = Vec::with_capacity(BATCH as usize);
    let mut hits = Vec::new();
    for first in (0..count).step_by(BATCH as usize) {
        rays.clear();
        for index in first..count.min(first + BATCH) {
            let [x, y, u, v] = sequence.point4(index);
            let chosen = choice.sample(x);
            let facet = facets[chosen.index];
            let normal = facet.exact.normal();
            let point = facet.point([chosen.remainder, y]);
            let local = cosine_hemisphere::sample([u as f32, v as f32]);
            let direction = Frame::around(normal.as_vec3()).to_world(local);
            rays.push(Ray::new(ray_origin(point, normal, facet.extent), direction));
        }
        hits.clear();
        hits.resize(rays.len(), Hit::MISS);
        world.bvh().closest_hits(&rays, &mut hits);
        for (ray, hit) in rays.iter().zip(&hits) {
            let front = world
                .interaction(ray, hit)
                .filter(|hit| hit.side == Side::Front);
            if let Some(hit) = front {
                met(world.scene().faces[hit.face.index()].object);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::{AnalyticConfig, analytic_factors};
    use crate::patches::PatchSize;
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
