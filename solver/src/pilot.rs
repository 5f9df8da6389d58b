//! A cheap first solution, and the mesh density that follows its light.
//!
//! A few hundred patches with a few rays each tell where the light is well enough for a mesh
//! ([`Density::following`]); they cost a hundredth of a solution that is good to 1 %.
//! Deterministic: a function of the scene and the seed.

use crate::patches::{Density, MeshError, PatchSize};
use crate::radiosity::{self, RadiosityConfig};
use crate::solvers::{Config, SystemError, Tolerance};
use crate::world::World;
use thiserror::Error;

/// Patches of the pilot. With fewer, the light on a wall beside a lamp and far from it is one.
const PATCHES: usize = 500;

/// Rays of each of its rows. More make no better mesh.
const RAYS: usize = 32;

/// What iterations may leave: far below the noise.
const TOLERANCE: f64 = 1e-3;

/// Sweeps after which the iteration gives up: what is missing then is spread evenly.
const MAX_ITERATIONS: usize = 1000;

/// Replicates count from zero; this one is nobody else's.
const REPLICATE: u64 = (1 << 32) - 1;

/// Why there is no pilot.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum PilotError {
    /// The mesh cannot be made.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The system cannot be solved.
    #[error(transparent)]
    System(#[from] SystemError),
}

/// Solves a pilot and returns the density of patches that follows its light.
///
/// # Errors
/// As [`radiosity::solve`]; a scene that was read without errors excludes them.
pub fn density(world: &World, seed: u64) -> Result<Density, PilotError> {
    let patches = world.mesh(PatchSize::Count(PATCHES))?;
    let config = RadiosityConfig {
        rays: RAYS,
        shadow_rays: 1,
        solver: Config {
            tolerance: Tolerance::Error(TOLERANCE),
            max_iterations: MAX_ITERATIONS,
        },
        seed,
        replicate: REPLICATE,
    };
    let solution = radiosity::solve(world, &patches, &config)?;
    let irradiance: Vec<f64> = patches
        .ids()
        .map(|patch| solution.mean_irradiance(patch).0.element_sum())
        .collect();
    Ok(Density::following(world.surfaces(), patches, &irradiance))
}

#[cfg(test)]
mod tests {
    use super::*;
    use luxel_scenes::generate;

    #[test]
    fn the_ceiling_beside_a_lamp_is_meshed_more_coarsely_than_the_floor_that_it_lights() {
        let scene = generate::cornell_box();
        let world = World::new(&scene);
        let density = density(&world, 3).expect("a pilot");
        let of = |name: &str| -> f64 {
            let faces = scene.face_ids().filter(|face| {
                let object = scene.faces[face.index()].object;
                scene.objects[object.index()].name == name
            });
            let values: Vec<f64> = faces.map(|face| density.face(face)).collect();
            values.iter().sum::<f64>() / values.len() as f64
        };
        assert!(of("floor") > of("ceiling"));
    }
}
