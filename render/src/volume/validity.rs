//! Which probes lie inside solids, and what they get instead of light.
//!
//! As luxels ([`crate::lightmap::receivers`]), probes that see the backs of one-sided faces are buried. A probe sees all round, and
//! of its rays only those count that meet anything: below the open sky one that stands behind a wall of no thickness sees little but its back.
//!
//! A buried probe becomes the mean of those of its six neighbours that are known, ring by ring from the open ones, so that what is interpolated beside a
//! wall does not darken. Cost: 64 rays a probe.

use super::grid::Grid;
use luxel_scenes::Rgb;
use luxel_solver::bvh::{Hit, Ray};
use luxel_solver::incident::estimate::Estimate;
use luxel_solver::sampling::{Sequence, Stage, sphere};
use luxel_solver::world::World;
use rayon::prelude::*;

/// Rays by which a probe is judged.
const RAYS: u32 = 64;

/// Probes that a thread judges at a time.
const BATCH: usize = 64;

/// Of each probe whether no more than the share `tolerance` of what its rays meet are backs.
pub fn valid(world: &World<'_>, grid: &Grid, tolerance: f64) -> Vec<bool> {
    let frame = *world.surfaces().geometry().frame();
    // The same directions everywhere: neighbours are judged alike.
    let sequence = Sequence::new(0, Stage::PROBES, 0);
    let directions: Vec<_> = (0..RAYS)
        .map(|index| sphere::sample_sphere(sequence.point2_f32(index)))
        .collect();
    let all: Vec<usize> = (0..grid.count()).collect();
    let of_batch = |indices: &[usize]| -> Vec<bool> {
        let rays: Vec<Ray> = indices
            .iter()
            .flat_map(|&index| {
                let origin = frame.to_unit(grid.position(index)).as_vec3();
                directions.iter().map(move |&d| Ray::new(origin, d))
            })
            .collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        world.bvh().closest_hits(&rays, &mut hits);
        let per_probe = RAYS as usize;
        let probes = rays.chunks(per_probe).zip(hits.chunks(per_probe));
        probes
            .map(|(rays, hits)| {
                let met = hits.iter().filter(|hit| hit.triangle().is_some()).count();
                let pairs = rays.iter().zip(hits);
                let backs = pairs
                    .filter(|(ray, hit)| world.meets_back(ray, hit))
                    .count();
                backs as f64 <= tolerance * met as f64
            })
            .collect()
    };
    all.par_chunks(BATCH).flat_map_iter(of_batch).collect()
}

/// Gives what is not valid the mean of its neighbours, from the valid ones inwards. Without any that is valid nothing changes.
///
/// # Panics
/// When there is not one of `estimates` for each probe.
pub fn fill<const N: usize>(grid: &Grid, is_valid: &[bool], estimates: &mut [Estimate<N>]) {
    assert_eq!(estimates.len(), grid.count(), "an estimate a probe");
    let mut is_known = is_valid.to_vec();
    let mut front: Vec<usize> = (0..grid.count()).filter(|&i| is_known[i]).collect();
    while !front.is_empty() {
        let mut next: Vec<usize> = front
            .iter()
            .flat_map(|&index| grid.neighbours(index))
            .filter(|&index| !is_known[index])
            .collect();
        next.sort_unstable();
        next.dedup();
        let filled: Vec<Estimate<N>> = next
            .iter()
            .map(|&index| {
                let known = grid.neighbours(index).filter(|&n| is_known[n]);
                mean(known.map(|neighbour| &estimates[neighbour]))
            })
            .collect();
        for (&index, filled) in next.iter().zip(filled) {
            estimates[index] = filled;
            is_known[index] = true;
        }
        front = next;
    }
}

/// The mean; neighbours err alike, so that their errors do not average out.
fn mean<'a, const N: usize>(of: impl Iterator<Item = &'a Estimate<N>>) -> Estimate<N> {
    let (mut sum, mut squares, mut count) = ([Rgb::ZERO; N], [Rgb::ZERO; N], 0.0);
    for estimate in of {
        count += 1.0;
        for k in 0..N {
            let error = estimate.standard_error[k];
            sum[k] += estimate.coefficients[k];
            squares[k] += error * error;
        }
    }
    Estimate {
        coefficients: sum.map(|value| value / count),
        standard_error: squares.map(|square| (square / count).map(f64::sqrt)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::grid::Resolution;
    use super::*;
    use glam::DVec3;
    use luxel_scenes::{Material, Reflectance, Scene};

    fn estimate(value: f64) -> Estimate<1> {
        Estimate {
            coefficients: [Rgb::splat(value)],
            standard_error: [Rgb::splat(0.1 * value)],
        }
    }

    #[test]
    fn buried_probes_become_the_mean_of_their_known_neighbours() {
        let probes = Resolution::Probes([5, 1, 1]);
        let grid = Grid::new(DVec3::ZERO, DVec3::ONE, probes).expect("a grid");
        let mut estimates = [1.0, 0.0, 3.0, 0.0, 0.0].map(estimate);
        let is_valid = [true, false, true, false, false];
        fill(&grid, &is_valid, &mut estimates);
        let values = estimates.map(|e| e.coefficients[0].x);
        assert_eq!(values, [1.0, 2.0, 3.0, 3.0, 3.0]);
        // √((0.1² + 0.3²)/2).
        let error = estimates[1].standard_error[0].x;
        assert!((error - 0.05_f64.sqrt()).abs() < 1e-15);
        // None is known: none changes, and there is an end.
        let mut dark = [0.0; 5].map(estimate);
        fill(&grid, &[false; 5], &mut dark);
        assert_eq!(dark, [0.0; 5].map(estimate));
    }

    /// A solid box in the open: probes in it are buried, those around it are not; a floor's own back is seen below it.
    #[test]
    fn backs_tell_what_is_inside() {
        let mut scene = Scene::default();
        let object = scene.push_object("part");
        let material = scene.push_material(Material::diffuse("grey", Reflectance::splat(0.5)));
        for axis in 0..3 {
            for high in [false, true] {
                let [mut u, mut v] = [DVec3::ZERO; 2];
                u[(axis + 1) % 3] = 1.0;
                v[(axis + 2) % 3] = 1.0;
                let mut corner = DVec3::splat(-0.5);
                corner[axis] = if high { 0.5 } else { -0.5 };
                let mut face = [corner, corner + u, corner + u + v, corner + v];
                if !high {
                    face.reverse();
                }
                scene.push_face(&face, object, material);
            }
        }
        let world = World::new(&scene);
        let [lower, upper] = [-1.5, 1.5].map(DVec3::splat);
        let grid = Grid::new(lower, upper, Resolution::Spacing(1.0)).expect("a grid");
        let is_valid = valid(&world, &grid, 0.5);
        let buried: Vec<usize> = (0..27).filter(|&i| !is_valid[i]).collect();
        assert_eq!(buried, [13]);
    }
}
