//! The radiosity solutions that are shown or reported themselves, with their defaults.

use super::Context;
use super::exit::Failure;
use crate::progress::Progress;
use luxel_solver::patches::{PatchSize, Patches};
use luxel_solver::radiosity::{RadiosityConfig, RadiositySolution, solve};
use luxel_solver::solvers::{Config, Tolerance};
use luxel_solver::world::World;

/// Shadow rays of each sample point of a patch; four measured no better.
const SHADOW_RAYS: usize = 1;

/// Patches of a solution that is shown itself: the picture has no finer detail.
const VIEW_PATCHES: usize = 10_000;

/// Rays of a row in a solution that is shown itself, where noise is seen as mottling.
const VIEW_ROW_RAYS: usize = 256;

/// Bound on the error that the iteration may leave, relative to the brightest patch: small beside
/// every other error, and cheap.
const TOLERANCE: f64 = 1e-7;

/// Sweeps after which the iteration gives up: enough for reflectances up to 0.999.
const MAX_ITERATIONS: usize = 20_000;

/// Patches with their solutions.
pub(super) struct Transport {
    pub(super) patches: Patches,
    pub(super) solutions: Vec<RadiositySolution>,
}

/// What solutions are for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Purpose {
    /// To be shown.
    View,
    /// To be reported.
    Solve {
        /// How finely to mesh.
        size: PatchSize,
        /// Rays of each row.
        rays: usize,
        /// Bound on the error that the iteration may leave, relative to the brightest patch.
        tolerance: f64,
        /// Independent solutions.
        replicates: u32,
    },
}

impl Transport {
    /// Meshes and solves.
    pub(super) fn solve(
        world: &World<'_>,
        purpose: Purpose,
        context: &Context<'_>,
    ) -> Result<Self, Failure> {
        let (size, rays, tolerance, replicates) = match purpose {
            Purpose::View => (PatchSize::Count(VIEW_PATCHES), VIEW_ROW_RAYS, TOLERANCE, 1),
            Purpose::Solve {
                size,
                rays,
                tolerance,
                replicates,
            } => (size, rays, tolerance, replicates),
        };
        let reporter = &context.reporter;
        let patches = world.mesh(size)?;
        reporter.start("solving radiosity", u64::from(replicates));
        let mut solutions = Vec::new();
        for replicate in 0..replicates {
            let config = RadiosityConfig {
                rays,
                shadow_rays: SHADOW_RAYS,
                solver: Config {
                    tolerance: Tolerance::Error(tolerance),
                    max_iterations: MAX_ITERATIONS,
                },
                seed: context.common.seed,
                replicate: u64::from(replicate),
            };
            solutions.push(solve(world, &patches, &config)?);
            reporter.advance(1);
        }
        reporter.finish();
        if let Some(solution) = solutions.first() {
            reporter.detail(format_args!(
                "{} patches, {} rays a row, {} sweeps, {replicates} solutions",
                patches.len(),
                rays,
                solution.iterations
            ));
        }
        Ok(Self { patches, solutions })
    }
}
