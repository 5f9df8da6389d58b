//! A cheap first solution, and the mesh density that follows its light, or what of it reaches some receivers.
//!
//! A few hundred patches with a few rays each tell where the light is, and where it is needed, well enough for a mesh
//! ([`Density`]); they cost a hundredth of a solution that is good to 1 %.
//! Deterministic: a function of the scene, the receivers and the seed.

use crate::patches::{Density, MeshError, PatchSize};
use crate::radiosity::{self, Flow, RadiosityConfig};
use crate::solvers::{Config, SystemError, Tolerance};
use crate::world::{Receiver, World};
use thiserror::Error;

/// Patches of the pilot. With fewer, the light on a wall beside a lamp and far from it is one.
const PATCHES: usize = 500;

/// Rays of each of its rows. More make no better mesh.
const RAYS: usize = 32;

/// What iterations may leave: far below the noise.
const TOLERANCE: f64 = 1e-3;

/// Sweeps after which the iteration gives up: what is missing then is spread evenly.
const MAX_ITERATIONS: usize = 1000;

/// Receivers that stand for all.
const RECEIVERS: usize = 128;

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

/// Solves a pilot and returns the density of patches that follows its light, or for `receivers`, where there are any, what
/// light and noise reach them.
///
/// # Errors
/// As [`radiosity::solve`]; a scene that was read without errors excludes them.
pub fn density(world: &World, receivers: &[Receiver], seed: u64) -> Result<Density, PilotError> {
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
    let stride = receivers.len().div_ceil(RECEIVERS).max(1);
    let sample: Vec<Receiver> = receivers.iter().copied().step_by(stride).collect();
    let flows = radiosity::flow(world, &patches, &sample, &config)?;
    let by = |value: &dyn Fn(&Flow) -> f64| -> Vec<f64> { flows.iter().map(value).collect() };
    let surfaces = world.surfaces();
    Ok(if receivers.is_empty() {
        Density::following(surfaces, patches, &by(&|flow| flow.irradiance))
    } else {
        // Direct light has a noise of its own and a shape, roughly in proportion to it.
        let noise = |flow: &Flow| flow.importance * flow.irradiance.hypot(flow.scatter);
        Density::lessening(surfaces, patches, &by(&noise))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use luxel_scenes::generate;

    /// Mean density of the faces of some objects.
    fn mean_density(scene: &luxel_scenes::Scene, density: &Density, name: &str) -> f64 {
        let faces = scene.face_ids().filter(|face| {
            let object = scene.faces[face.index()].object;
            scene.objects[object.index()].name == name
        });
        let values: Vec<f64> = faces.map(|face| density.face(face)).collect();
        values.iter().sum::<f64>() / values.len() as f64
    }

    #[test]
    fn the_ceiling_beside_a_lamp_is_meshed_more_coarsely_than_the_floor_that_it_lights() {
        let scene = generate::cornell_box();
        let world = World::new(&scene);
        let density = density(&world, &[], 3).expect("a pilot");
        let of = |name: &str| mean_density(&scene, &density, name);
        assert!(of("floor") > of("ceiling"));
    }

    #[test]
    fn receivers_on_the_floor_need_the_ceiling_more_than_the_floor() {
        let scene = generate::cornell_box();
        let world = World::new(&scene);
        let positions: Vec<DVec3> = (1..10)
            .map(|i| DVec3::new(0.055 * f64::from(i), 0.0, 0.1))
            .collect();
        let receivers = world.receivers(&positions, &vec![DVec3::Y; positions.len()]);
        let ratio = |receivers: &[Receiver]| {
            let density = density(&world, receivers, 3).expect("a pilot");
            mean_density(&scene, &density, "ceiling") / mean_density(&scene, &density, "floor")
        };
        let (alone, for_floor) = (ratio(&[]), ratio(&receivers));
        assert!(for_floor > alone, "{for_floor} against {alone}");
    }
}
