//! Classical radiosity for `solve`: every pair of patches has a form factor, every solver works.

use super::Context;
use super::exit::{ExitCode, Failure};
use crate::progress::Progress;
use clap::ValueEnum;
use luxel_scenes::{Irradiance, Rgb};
use luxel_solver::form_factors::{
    RayCastConfig, RayCastFactors, analytic_between_patches, ray_cast,
};
use luxel_solver::patches::Patches;
use luxel_solver::solvers::{
    Config, Ledger, Solution, System, Tolerance, direct, gauss_seidel, jacobi, no_progress, source,
};
use luxel_solver::transport::Dense;
use luxel_solver::world::World;

/// Patches up to which a dense matrix is made: 16 bytes for each pair, 1 GiB.
const MAX_PATCHES: usize = 8192;

/// How form factors between patches are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Factors {
    /// Exact, times a visibility sampled by this many rays for each pair of polygons.
    Analytic(usize),
    /// The fraction of this many rays of each patch that arrive.
    RayCast(usize),
}

/// What solves the system.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Solver {
    /// Simultaneous sweeps
    Jacobi,
    /// Sweeps that use each new value at once
    GaussSeidel,
    /// LU factors, for up to a few thousand patches
    Direct,
}

/// A solved scene.
pub(super) struct DenseSolution {
    pub(super) solution: Solution,
    pub(super) ledger: Ledger,
    /// Standard error of each patch's irradiance in W/m², from that of its form factors.
    pub(super) standard_error: Vec<Irradiance>,
}

/// Computes form factors and solves.
pub(super) fn solve(
    world: &World<'_>,
    patches: &Patches,
    factors: Factors,
    solver: Solver,
    config: &Config,
    context: &Context<'_>,
) -> Result<DenseSolution, Failure> {
    let scene = world.scene();
    if !scene.lights.is_empty() {
        return Err(Failure::new(
            ExitCode::Usage,
            format!(
                "{}: --form-factors knows light from surfaces only, and the scene has [[light]] \
                 entries; leave the option out",
                scene.name
            ),
        ));
    }
    let n = patches.len();
    if n > MAX_PATCHES {
        return Err(Failure::new(
            ExitCode::Usage,
            format!(
                "{n} patches are too many for --form-factors, which stores every pair (at most \
                 {MAX_PATCHES}); give a larger --patch-size, or leave the option out"
            ),
        ));
    }
    context.reporter.start("form factors", 1);
    let computed = compute(world, patches, factors, context.common.seed);
    context.reporter.finish();
    let transport = Dense::new(n, computed.factors)?;

    let no_lights = vec![Irradiance::ZERO; n];
    let sources = source(patches.emissions(), patches.reflectances(), &no_lights);
    let system = System::new(&transport, patches.reflectances(), &sources)?;
    let solution = match solver {
        Solver::Jacobi => jacobi(&system, config, no_progress),
        Solver::GaussSeidel => gauss_seidel(&system, config, no_progress),
        Solver::Direct => direct(&system)?,
    };
    let frame = world.surfaces().geometry().frame();
    let areas: Vec<f64> = patches
        .areas()
        .iter()
        .map(|&area| frame.area_to_world(area))
        .collect();
    let ledger = Ledger::new(&system, &solution, &areas, patches.emissions(), &no_lights);
    let standard_error = computed
        .standard_error
        .chunks(n.max(1))
        .map(|row| {
            let squares: Rgb = row
                .iter()
                .zip(&solution.radiosity)
                .map(|(&error, b)| b.0 * b.0 * (error * error))
                .sum();
            Irradiance(squares.map(f64::sqrt))
        })
        .collect();
    Ok(DenseSolution {
        solution,
        ledger,
        standard_error,
    })
}

fn compute(world: &World<'_>, patches: &Patches, factors: Factors, seed: u64) -> RayCastFactors {
    match factors {
        Factors::Analytic(rays) => {
            analytic_between_patches(world, patches, &RayCastConfig { rays, seed })
        }
        Factors::RayCast(rays) => ray_cast(world, patches, &RayCastConfig { rays, seed }),
    }
}

/// The solver's configuration for a relative bound on the error.
pub(super) fn config(tolerance: f64) -> Config {
    /// Sweeps after which the iteration gives up: Jacobi at a reflectance of 0.9999.
    const MAX_ITERATIONS: usize = 200_000;
    Config {
        tolerance: Tolerance::Error(tolerance),
        max_iterations: MAX_ITERATIONS,
    }
}
