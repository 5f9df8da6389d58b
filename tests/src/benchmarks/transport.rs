//! Form factors between all patches, and sparse rows of them.

use super::measured;
use crate::builder::{Part, room, scene, solid_box};
use glam::DVec3;
use luxel_scenes::Scene;
use luxel_solver::form_factors::{
    AnalyticConfig, RayCastConfig, RayCastRowsConfig, analytic_factors, closure, ray_cast,
    ray_cast_rows,
};
use luxel_solver::patches::PatchSize;
use luxel_solver::transport::Dense;
use luxel_solver::world::World;

/// A closed cube of 1 m with a box in it that hides its sides from each other.
fn cube() -> Scene {
    let walls = room(DVec3::ZERO, DVec3::ONE);
    let block = solid_box(DVec3::splat(0.35), DVec3::splat(0.65));
    let parts = [
        Part::grey("walls", 0.5, walls),
        Part::grey("block", 0.5, block),
    ];
    scene("a block in a cube", parts)
}

/// Form factors by one estimator.
#[derive(Clone, Copy, Debug)]
pub struct Factors {
    /// Number of patches n.
    pub patches: usize,
    /// Seconds for all pairs.
    pub seconds: f64,
    /// Largest |1 − Σ_j F_ij|.
    pub closure: f64,
    /// Root mean square of the stated errors of all F over their mean.
    pub error: f64,
}

/// All pairs of about a thousand patches: by rays, and by exact integrals past occluders.
///
/// # Panics
/// When the scene cannot be meshed.
pub fn factors() -> [(&'static str, Factors); 2] {
    let scene = cube();
    let world = World::new(&scene);
    let patches = world.mesh(PatchSize::Count(1000)).expect("a mesh");
    let n = patches.len();
    let row = |seconds, matrix: &Dense, errors: &[f64]| {
        let square: f64 = errors.iter().map(|e| e * e).sum();
        Factors {
            patches: n,
            seconds,
            closure: closure(matrix).largest_defect,
            // Rows of a closed room sum to 1: the mean factor is 1/n.
            error: (square / errors.len() as f64).sqrt() * n as f64,
        }
    };
    let config = RayCastConfig {
        rays: 1024,
        seed: 0,
    };
    let (seconds, _, cast) = measured(3, |_| ray_cast(&world, &patches, &config));
    let matrix = Dense::new(n, cast.factors).expect("form factors");
    let by_rays = row(seconds, &matrix, &cast.standard_error);
    let config = AnalyticConfig {
        accuracy: 1e-4,
        points: 40,
        seed: 0,
    };
    let (seconds, _, exact) = measured(1, |_| analytic_factors(&world, &patches, &config));
    let by_integrals = row(seconds, &exact.matrix, &exact.standard_error);
    [
        ("ray-cast, 1024 rays a row", by_rays),
        ("analytic", by_integrals),
    ]
}

/// Patches, seconds and peak bytes of sparse rows of 512 rays from about 17 000 patches of a scene.
///
/// # Panics
/// When the scene cannot be meshed.
pub fn rows(scene: &Scene) -> (usize, f64, Option<u64>) {
    let world = World::new(scene);
    let patches = world.mesh(PatchSize::Count(17_000)).expect("a mesh");
    let config = RayCastRowsConfig {
        rays: 512,
        seed: 0,
        replicate: 0,
    };
    let (seconds, peak, _) = measured(3, |_| ray_cast_rows(&world, &patches, &config));
    (patches.len(), seconds, peak)
}
