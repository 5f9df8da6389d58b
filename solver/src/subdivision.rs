//! Divides patches where direct light varies within them: shadow boundaries, and places near lights.
//!
//! A patch stands for one value of B. Replacing the light within it by the mean leaves a squared error
//! A ρ̄² σ², where σ² is the variance of its irradiance, and cutting it in four removes the variance
//! between the quarters' means. That is the indicator, η = A ρ̄² Var(E_1 … E_4), with each quarter's
//! direct irradiance from four stratified points and their shadow rays. The patches of the largest η are
//! divided, in rounds, until there are as many as wanted: each round looks at what the one before made, so
//! that a shadow boundary is followed to the size that the number of patches allows, and bodies that fall
//! between the points of a large patch are found by those of its parts.
//!
//! Source: the parent-against-children indicators of D. Lischinski, F. Tampieri, D. P. Greenberg,
//! "Discontinuity Meshing for Accurate Radiosity", IEEE CG&A 12(6), 1992, and A. T. Campbell,
//! D. S. Fussell, "Adaptive Mesh Generation for Global Diffuse Illumination", SIGGRAPH 1990. Validity:
//! light with a direct part; without, nothing is divided. Deterministic. Cost: sixteen points for each
//! patch and round.

use crate::direct::{DirectSampler, Sample, ShadowRays};
use crate::patches::{PatchId, Patches};
use crate::sampling::{Sequence, Stage};
use crate::world::World;
use luxel_scenes::{Irradiance, Rgb};
use rayon::prelude::*;

/// Points along each side of a patch: two in each quarter.
const POINTS: usize = 4;

/// Rounds in which the wanted number is reached. With fewer, the first and largest patches decide
/// alone; more measured no better.
const ROUNDS: usize = 4;

/// Patches per parallel task.
const CHUNK: usize = 64;

/// Divides patches until there are about `count`, where direct light varies most.
pub fn follow_direct_light(world: &World, patches: Patches, count: usize, seed: u64) -> Patches {
    let mut patches = patches;
    for round in 0..ROUNDS {
        // Each division adds three.
        let wanted = count.saturating_sub(patches.len()) / (3 * (ROUNDS - round));
        if wanted == 0 {
            break;
        }
        let indicators = indicators(world, &patches, seed);
        let mut order: Vec<usize> = (0..patches.len())
            .filter(|&index| indicators[index] > 0.0)
            .collect();
        order.sort_by(|&a, &b| indicators[b].total_cmp(&indicators[a]).then(a.cmp(&b)));
        let mut marked = vec![false; patches.len()];
        for &index in order.iter().take(wanted) {
            marked[index] = true;
        }
        if order.is_empty() {
            break;
        }
        patches = world.refine(&patches, &marked);
    }
    patches
}

/// η of each patch, in arbitrary units.
pub fn indicators(world: &World, patches: &Patches, seed: u64) -> Vec<f64> {
    let parts: Vec<Vec<f64>> = (0..patches.len().div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(patches.len());
            indicators_of(world, patches, range.map(PatchId::new), seed)
        })
        .collect();
    parts.concat()
}

fn indicators_of(
    world: &World,
    patches: &Patches,
    ids: impl Iterator<Item = PatchId> + Clone,
    seed: u64,
) -> Vec<f64> {
    let geometry = world.surfaces().geometry();
    let mut samples = Vec::new();
    for patch in ids.clone() {
        let sequence = Sequence::new(seed, Stage::SUBDIVISION, u64::from(patch.0));
        for index in 0..POINTS * POINTS {
            let centre = |k: usize| (k as f64 + 0.5) / POINTS as f64;
            let place = [centre(index % POINTS), centre(index / POINTS)];
            let surface = patches.sample(geometry, patch, place);
            samples.push(Sample {
                position: surface.position,
                normal: surface.normal,
                origin: surface.origin,
                sequence,
                index: index as u32,
            });
        }
    }
    let mut direct = vec![Irradiance::ZERO; samples.len()];
    DirectSampler::new(world.lights(), world.bvh()).irradiance(
        &samples,
        ShadowRays::About(1),
        &mut direct,
    );
    ids.zip(direct.chunks(POINTS * POINTS))
        .map(|(patch, points)| {
            let mut quarters = [Rgb::ZERO; 4];
            for (index, point) in points.iter().enumerate() {
                let half = |k: usize| usize::from(k >= POINTS / 2);
                let quarter = half(index % POINTS) + 2 * half(index / POINTS);
                quarters[quarter] += point.0 * (4.0 / points.len() as f64);
            }
            let mean = quarters.iter().sum::<Rgb>() / 4.0;
            let variance: Rgb = quarters.iter().map(|q| (*q - mean) * (*q - mean)).sum();
            let rho = patches.reflectances()[patch.index()].0;
            patches.areas()[patch.index()] * (variance * rho * rho).element_sum()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patches::PatchSize;
    use luxel_scenes::generate;

    #[test]
    fn patches_in_penumbrae_become_smaller_than_those_in_the_open() {
        let scene = generate::cornell_box();
        let world = World::new(&scene);
        let start = world.mesh(PatchSize::Count(500)).expect("meshes");
        let patches = follow_direct_light(&world, start, 2000, 1);
        let made = patches.len() as f64;
        // Balancing divides some more, shared marks some fewer.
        assert!((0.9..1.3).contains(&(made / 2000.0)), "{made} patches");
        let geometry = world.surfaces().geometry();
        let size_at = |x: f64, z: f64| {
            let position = geometry.frame().to_unit(glam::DVec3::new(x, 0.0, z));
            let near = patches.ids().filter(|&patch| {
                let (faces, _) = patches.faces(patch);
                let object = scene.faces[faces[0].index()].object;
                let sample = patches.sample(geometry, patch, [0.5, 0.5]);
                scene.objects[object.index()].name == "floor"
                    && sample.position.distance(position) < 2.0 * f64::from(patches.size(patch))
            });
            let sizes: Vec<f64> = near.map(|patch| f64::from(patches.size(patch))).collect();
            assert!(!sizes.is_empty());
            sizes.into_iter().fold(f64::INFINITY, f64::min)
        };
        // Beside the short block, where its shadow ends, against the open front of the floor.
        assert!(size_at(0.06, 0.16) < size_at(0.45, 0.03));
    }

    #[test]
    fn without_direct_light_nothing_is_divided() {
        let scene = luxel_scenes::Scene::default();
        let world = World::new(&scene);
        let start = world.mesh(PatchSize::Count(10)).expect("meshes");
        assert!(follow_direct_light(&world, start, 100, 1).is_empty());
    }
}
