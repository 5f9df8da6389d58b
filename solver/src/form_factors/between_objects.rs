//! Form factors between the objects of a scene, or between patches, front to front.
//!
//! F_AB = (1/A_A) Σ_{p∈A} Σ_{q∈B} A_p F_pq over the polygons p, q. Two estimators:
//!
//! - [`analytic_between_objects`], [`analytic_between_patches`]: A_p F_pq is the exact exchange area S_pq of the unoccluded pair times
//!   a visibility V = Σ w v / Σ w over segments between points spread evenly over p and q, with
//!   the kernel w = cos θ_p cos θ_q / r². Where nothing stands between, every v is 1 and the
//!   result is exact; otherwise its error is that of V, which is a ratio and hence biased by
//!   O(1/N). Reciprocal to rounding. Cost: n²/2 pairs of faces with N segments each.
//! - [`ray_cast_between_objects`]: the fraction of the cosine-distributed rays from A that meet a front
//!   of B first. Unbiased for any geometry. Cost: N rays an object, whatever its faces.
//!
//! Standard errors come from [`REPLICATES`] independent randomisations. Sources: see
//! [`super::polygon_to_polygon`] and [`super::ray_cast`].

use super::polygon::Polygon;
use super::polygon_to_polygon::exchange_area;
use super::ray_cast::{REPLICATES, RayCastConfig, RayCastFactors};
use crate::bvh::{Hit, Ray};
use crate::geometry::{offset_bound, ray_origin};
use crate::patches::{Patches, Side};
use crate::sampling::{self, Discrete, Frame, Sequence, Stage, cosine_hemisphere};
use crate::world::World;
use glam::DVec3;
use luxel_scenes::{FaceId, ObjectId};
use rayon::prelude::*;

/// Relative accuracy of the unoccluded exchange areas.
const ACCURACY: f64 = 1e-12;

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
    /// Standard error of each factor; zero where all samples agreed.
    pub standard_error: Vec<f64>,
}

/// A polygon as an emitter and receiver.
struct Facet {
    /// The object or patch that it belongs to.
    group: usize,
    /// The faces that it is a part of, which hide nothing of it.
    faces: Vec<FaceId>,
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
    fn new(group: usize, faces: Vec<FaceId>, corners: &[DVec3]) -> Option<Self> {
        let exact = Polygon::new(corners).ok()?;
        let points = sampling::Polygon::new(corners)?;
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let bounds = corners
            .iter()
            .fold((middle, middle), |(lo, hi), &c| (lo.min(c), hi.max(c)));
        let extent = (bounds.1 - bounds.0).max_element();
        let width = exact.area() / extent;
        Some(Self {
            group,
            faces,
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
            let group = place[scene.faces[face.index()].object.index()];
            Facet::new(group, vec![face], &geometry.polygon(face))
        };
        let all: Vec<Facet> = scene.face_ids().filter_map(facet).collect();
        let mut areas = vec![0.0; objects.len()];
        for facet in &all {
            areas[facet.group] += facet.exact.area();
        }
        Self {
            all,
            objects,
            areas,
        }
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

/// Exact exchange times sampled visibility; `config.rays` segments for each pair of faces, rounded
/// up to a multiple of [`REPLICATES`].
pub fn analytic_between_objects(world: &World, config: &RayCastConfig) -> ObjectFactors {
    let facets = Facets::new(world);
    let (factors, standard_error) = exchange(world, &facets.all, &facets.areas, config);
    facets.finish(world, factors, standard_error)
}

/// Exact exchange times sampled visibility between all patches, each side of a two-sided face a
/// patch of its own; `config.rays` segments for each pair of polygons, rounded up to a multiple of
/// [`REPLICATES`].
pub fn analytic_between_patches(
    world: &World,
    patches: &Patches,
    config: &RayCastConfig,
) -> RayCastFactors {
    let geometry = world.surfaces().geometry();
    let mut all = Vec::with_capacity(patches.len());
    let mut areas = vec![0.0; patches.len()];
    for patch in patches.ids() {
        let (faces, _) = patches.faces(patch);
        for corners in patches.polygons(geometry, patch) {
            // The faces of a cluster do hide each other; which of them this is, is not known.
            let own = if faces.len() <= 2 {
                faces.to_vec()
            } else {
                Vec::new()
            };
            if let Some(facet) = Facet::new(patch.index(), own, &corners) {
                areas[patch.index()] += facet.exact.area();
                all.push(facet);
            }
        }
    }
    let (factors, standard_error) = exchange(world, &all, &areas, config);
    RayCastFactors {
        len: patches.len(),
        factors,
        standard_error,
    }
}

/// Factors and their standard errors between the groups of `facets`; `areas` of the groups in
/// square units.
fn exchange(
    world: &World,
    facets: &[Facet],
    areas: &[f64],
    config: &RayCastConfig,
) -> (Vec<f64>, Vec<f64>) {
    // Exchange areas of each pair, by the group of the second one.
    let rows: Vec<Vec<(usize, f64, f64)>> = (0..facets.len())
        .into_par_iter()
        .with_max_len(1)
        .map(|p| {
            let pairs = (p + 1..facets.len()).filter_map(|q| {
                let area = exchange_area(&facets[p].exact, &facets[q].exact, ACCURACY);
                (area > 0.0).then(|| {
                    let item = (p as u64) << 32 | q as u64;
                    let (visible, error) =
                        visibility(world, [&facets[p], &facets[q]], item, config);
                    (facets[q].group, area * visible, area * error)
                })
            });
            pairs.collect()
        })
        .collect();

    let n = areas.len();
    let mut factors = vec![0.0; n * n];
    let mut variance = vec![0.0; n * n];
    for (facet, row) in facets.iter().zip(rows) {
        let a = facet.group;
        for (b, area, error) in row {
            // Both ways; a pair within one group adds the same number to one entry twice.
            for at in [a * n + b, b * n + a] {
                factors[at] += area;
                variance[at] += error * error * if a == b { 2.0 } else { 1.0 };
            }
        }
    }
    for (at, (factor, variance)) in factors.iter_mut().zip(&mut variance).enumerate() {
        // A group without area has no factors.
        let scale = 1.0 / areas[at / n].max(f64::MIN_POSITIVE);
        *factor *= scale;
        *variance = variance.sqrt() * scale;
    }
    (factors, variance)
}

/// The visible share of the exchange between two facets, and its standard error.
fn visibility(world: &World, [p, q]: [&Facet; 2], item: u64, config: &RayCastConfig) -> (f64, f64) {
    let per_replicate = (config.rays as u64).div_ceil(REPLICATES).max(1) as u32;
    let mut rays = Vec::new();
    let mut weights = Vec::new();
    for replicate in 0..REPLICATES {
        // Replicates of a pair of 32-bit ids need more bits than an item has: the seed carries them.
        let seed = sampling::hash::mix64(config.seed ^ sampling::hash::mix64(replicate));
        let sequence = Sequence::new(seed, Stage::FORM_FACTORS, item);
        for index in 0..per_replicate {
            let [x, y, u, v] = sequence.point4(index);
            let (from, to) = (p.point([x, y]), q.point([u, v]));
            let (weight, origin) = (
                kernel(from, p.exact.normal(), to, q.exact.normal()),
                ray_origin(from, p.exact.normal(), p.extent),
            );
            rays.push(Ray::segment(
                origin,
                ray_origin(to, q.exact.normal(), q.extent),
            ));
            weights.push(weight);
        }
    }
    let mut hits = vec![Hit::MISS; rays.len()];
    world.bvh().closest_hits(&rays, &mut hits);
    let geometry = world.surfaces().geometry();
    // The two faces themselves are planar and face each other: they hide nothing.
    let is_open = |hit: &Hit| {
        hit.triangle()
            .map(|triangle| geometry.face(triangle))
            .is_none_or(|face| p.faces.contains(&face) || q.faces.contains(&face))
    };
    if hits.iter().all(is_open) {
        return (1.0, 0.0);
    }
    let total: f64 = weights.iter().sum();
    if total <= 0.0 {
        return (0.0, 0.0);
    }
    let open = hits.iter().map(|hit| f64::from(u8::from(is_open(hit))));
    let seen: Vec<f64> = open.zip(&weights).map(|(v, w)| v * w).collect();
    let visible = seen.iter().sum::<f64>() / total;
    // The scatter of a ratio of sums: Σ (s_r − V t_r)² over the replicates' sums.
    let each = per_replicate as usize;
    let squares: f64 = seen
        .chunks(each)
        .zip(weights.chunks(each))
        .map(|(s, t)| (s.iter().sum::<f64>() - visible * t.iter().sum::<f64>()).powi(2))
        .sum();
    let r = REPLICATES as f64;
    (visible, (squares * r / (r - 1.0)).sqrt() / total)
}

/// cos θ_p cos θ_q / r², zero where the fronts do not see each other.
fn kernel(from: DVec3, from_normal: DVec3, to: DVec3, to_normal: DVec3) -> f64 {
    let way = to - from;
    let squared = way.length_squared();
    let cosines = way.dot(from_normal).max(0.0) * (-way.dot(to_normal)).max(0.0);
    if squared > 0.0 {
        cosines / (squared * squared)
    } else {
        0.0
    }
}

/// Rays from points spread evenly over each object; `config.rays` for each, rounded up to a
/// multiple of [`REPLICATES`].
pub fn ray_cast_between_objects(world: &World, config: &RayCastConfig) -> ObjectFactors {
    let facets = Facets::new(world);
    let n = facets.objects.len();
    let mut place = vec![0; world.scene().objects.len()];
    for (index, object) in facets.objects.iter().enumerate() {
        place[object.index()] = index;
    }
    let per_replicate = (config.rays as u64).div_ceil(REPLICATES).max(1) as u32;
    let tasks: Vec<(usize, u64)> = (0..n)
        .flat_map(|object| (0..REPLICATES).map(move |replicate| (object, replicate)))
        .collect();
    let own: Vec<Vec<&Facet>> = (0..n)
        .map(|object| {
            let facets = facets.all.iter();
            facets.filter(|facet| facet.group == object).collect()
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
    use luxel_scenes::{Material, Reflectance, Scene};

    const CONFIG: RayCastConfig = RayCastConfig {
        rays: 4096,
        seed: 1,
    };

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
        let result = analytic_between_objects(&World::new(&scene), &CONFIG);
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
        let analytic = analytic_between_objects(&world, &CONFIG);
        let cast = ray_cast_between_objects(
            &world,
            &RayCastConfig {
                rays: 1 << 18,
                ..CONFIG
            },
        );
        assert!(analytic.factors[1] < 0.9 * CUBE, "the screen hides a part");
        for at in 0..9 {
            let difference = (analytic.factors[at] - cast.factors[at]).abs();
            let error = analytic.standard_error[at].hypot(cast.standard_error[at]);
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
