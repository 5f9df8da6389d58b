//! The radiosity solution that is shown itself, with its defaults.

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

impl Transport {
    /// Meshes and solves for a picture of the solution.
    pub(super) fn view(world: &World<'_>, context: &Context<'_>) -> Result<Self, Failure> {
        let reporter = &context.reporter;
        let patches = world.mesh(PatchSize::Count(VIEW_PATCHES))?;
        reporter.start("solving radiosity", 1);
        let config = RadiosityConfig {
            rays: VIEW_ROW_RAYS,
            shadow_rays: SHADOW_RAYS,
            solver: Config {
                tolerance: Tolerance::Error(TOLERANCE),
                max_iterations: MAX_ITERATIONS,
            },
            seed: context.common.seed,
            replicate: 0,
        };
        let solution = solve(world, &patches, &config)?;
        reporter.finish();
        reporter.detail(format_args!(
            "{} patches, {VIEW_ROW_RAYS} rays a row, {} sweeps",
            patches.len(),
            solution.iterations
        ));
        Ok(Self {
            patches,
            solutions: vec![solution],
        })
    }
}
