//! The radiosity solution that is shown itself, with its defaults.

use super::Context;
use super::exit::Failure;
use crate::integrators::radiosity::RadiosityView;
use crate::progress::Progress;
use luxel_scenes::Scene;
use luxel_solver::gather::MAX_REPLICATES;
use luxel_solver::patches::{PatchSize, Patches};
use luxel_solver::radiosity::{RadiosityConfig, RadiositySolution, bytes_to_solve, solve};
use luxel_solver::solvers::{Config, Tolerance};
use luxel_solver::world::World;

/// Shadow rays of each sample point of a patch; four measured no better.
const SHADOW_RAYS: usize = 1;

/// Patches of a solution that is shown itself: the picture has no finer detail.
pub(super) const VIEW_PATCHES: usize = 10_000;

/// Independent solutions, whose scatter is the noise of the picture.
const SOLUTIONS: u64 = MAX_REPLICATES as u64;

/// Rays of a row in each of them: noise is seen as mottling.
const VIEW_ROW_RAYS: usize = 64;

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
    /// Meshes into about `patches` patches and solves for a picture of the solution.
    pub(super) fn view(
        world: &World<'_>,
        patches: usize,
        context: &Context<'_>,
    ) -> Result<Self, Failure> {
        let reporter = &context.reporter;
        let patches = world.mesh(PatchSize::Count(patches))?;
        reporter.start("solving radiosity", SOLUTIONS);
        let mut solutions = Vec::new();
        for replicate in 0..SOLUTIONS {
            let config = RadiosityConfig {
                rays: VIEW_ROW_RAYS,
                shadow_rays: SHADOW_RAYS,
                solver: Config {
                    tolerance: Tolerance::Error(TOLERANCE),
                    max_iterations: MAX_ITERATIONS,
                },
                seed: context.common.seed,
                replicate,
            };
            solutions.push(solve(world, &patches, &config)?);
            reporter.advance(1);
        }
        reporter.finish();
        reporter.detail(format_args!(
            "{} patches, {SOLUTIONS} solutions of {VIEW_ROW_RAYS} rays a row, {} sweeps",
            patches.len(),
            solutions[0].iterations
        ));
        Ok(Self { patches, solutions })
    }

    /// Memory while about so many patches and a quarter of them are solved and made continuous, in bytes.
    pub(super) fn bytes_to_view(patches: usize, scene: &Scene) -> usize {
        let solved = |patches: usize| {
            Patches::bytes_for(patches, scene)
                + SOLUTIONS as usize * RadiositySolution::bytes_for(patches, false)
        };
        let shown = |patches: usize| RadiosityView::bytes_for(patches, SOLUTIONS as usize);
        let fine = Patches::at_most(patches);
        let coarse = fine / 4;
        let work = bytes_to_solve(fine, VIEW_ROW_RAYS, false).max(shown(fine) + shown(coarse));
        solved(fine) + solved(coarse) + work
    }

    /// Bound on what the iteration leaves of any irradiance, in W/m².
    pub(super) fn solver_bound(&self) -> f64 {
        let bounds = self.solutions.iter().map(|s| s.error_bound.max_element());
        bounds.fold(0.0, f64::max)
    }
}
