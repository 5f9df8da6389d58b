//! Classical radiosity for `solve`: every pair of patches has a form factor, every solver works.

use super::Context;
use super::exit::{ExitCode, Failure};
use crate::progress::Progress;
use clap::ValueEnum;
use luxel_scenes::{Irradiance, Rgb};
use luxel_solver::form_factors::{
    AnalyticConfig, Hemicube, HemicubeConfig, REPLICATES, RayCastConfig, Repair, Target,
    analytic_factors, hemicube_factors, ray_cast, repair,
};
use luxel_solver::patches::{PatchId, Patches};
use luxel_solver::solvers::{
    Ambient, Config, Ledger, Solution, System, SystemError, Tolerance, conjugate_gradient, direct,
    gauss_seidel, jacobi, no_progress, source, southwell,
};
use luxel_solver::transport::{Columns, Dense, Symmetrised, Transport};
use luxel_solver::world::World;

/// Patches up to which a dense matrix is made: 16 bytes for each pair, 1 GiB.
const MAX_PATCHES: usize = 8192;

/// How form factors between patches are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Factors {
    /// Exact; of pairs that something may occlude at this many points.
    Analytic(usize),
    /// Hemicubes of this resolution.
    Hemicube(usize),
    /// The fraction of this many rays of each patch that arrive.
    RayCast(usize),
}

/// Points on a polygon of a pair that something may occlude, by default: a relative error of 1e-3 and
/// below, in half a millisecond.
pub(super) const ANALYTIC_POINTS: usize = 400;

/// Pixels along an edge of a hemicube, by default: an error of 1e-3 to 1e-2.
pub(super) const HEMICUBE_RESOLUTION: usize = 128;

/// What solves the system.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Solver {
    /// Simultaneous sweeps
    Jacobi,
    /// Sweeps that use each new value at once
    GaussSeidel,
    /// Progressive shooting: the largest unshot flux first
    Southwell,
    /// Conjugate gradient, for bright rooms; it makes form factors of rays and hemicubes reciprocal
    #[value(name = "cg")]
    ConjugateGradient,
    /// LU factors, for up to a few thousand patches
    Direct,
}

/// A solved scene.
pub(super) struct DenseSolution {
    pub(super) solution: Solution,
    pub(super) ledger: Ledger,
    /// Bound on the root mean square of the error that the solver leaves, in W/m²; `None` when the
    /// form factors are not reciprocal.
    pub(super) mean_error_bound: Option<Rgb>,
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
    let (dense, errors) = compute(world, patches, factors, context)?;
    let frame = world.surfaces().geometry().frame();
    let areas: Vec<f64> = patches
        .areas()
        .iter()
        .map(|&area| frame.area_to_world(area))
        .collect();
    let is_analytic = matches!(factors, Factors::Analytic(_));
    let transport: Box<dyn Transport> = if solver == Solver::ConjugateGradient && !is_analytic {
        reciprocal(&dense, &areas)
    } else {
        Box::new(dense)
    };

    let no_lights = vec![Irradiance::ZERO; n];
    let sources = source(patches.emissions(), patches.reflectances(), &no_lights);
    let system = System::new(&*transport, &areas, patches.reflectances(), &sources)
        .map_err(|error| refused(world, patches, &error))?;
    let solution = match solver {
        Solver::Jacobi => jacobi(&system, config, no_progress),
        Solver::GaussSeidel => gauss_seidel(&system, config, no_progress),
        Solver::Southwell => southwell(&system, Ambient::None, config, no_progress),
        Solver::ConjugateGradient => conjugate_gradient(&system, config, no_progress)?,
        Solver::Direct => direct(&system)?,
    };
    let ledger = Ledger::new(&system, &solution, patches.emissions(), &no_lights);
    let standard_error = errors
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
    let mean_error_bound = system.mean_error_bound(&solution).ok();
    Ok(DenseSolution {
        solution,
        ledger,
        mean_error_bound,
        standard_error,
    })
}

/// Form factors that obey A_i F_ij = A_j F_ji next to those of rays or hemicubes: with the same row sums
/// where there are such, as in rooms, else with those that come out.
fn reciprocal(factors: &Dense, areas: &[f64]) -> Box<dyn Transport> {
    /// What row sums may differ by: rounding of a thousand entries is not far below.
    const ROW_SUMS: f64 = 1e-12;
    let sums: Vec<f64> = (0..areas.len()).map(|row| factors.row_sum(row)).collect();
    let how = Repair {
        target: Target::RowSums(&sums),
        max_defect: 0.0,
        tolerance: ROW_SUMS,
    };
    match repair(factors, areas, &how) {
        Ok(repaired) => Box::new(repaired),
        Err(_) => Box::new(Symmetrised::new(factors, areas)),
    }
}

/// Names the object whose patch makes a system unsolvable.
fn refused(world: &World<'_>, patches: &Patches, error: &SystemError) -> Failure {
    let scene = world.scene();
    let text = match *error {
        SystemError::NotContracting {
            channel,
            unknown,
            gain,
        } => {
            let (faces, _) = patches.faces(PatchId::new(unknown));
            let object = scene.faces[faces[0].index()].object;
            format!(
                "{}: object {:?} reflects {gain} times the {} light that it sends: its reflectance \
                 is too near to 1 for the accuracy of the form factors; give more --rays or a lower \
                 reflectance",
                scene.name,
                scene.objects[object.index()].name,
                ["red", "green", "blue"][channel],
            )
        }
        _ => format!("{}: {error}", scene.name),
    };
    Failure::new(ExitCode::InvalidInput, text)
}

/// Memory while the form factors of so many patches are computed and, with a solver, solved, in bytes.
pub(super) fn bytes_for(patches: usize, factors: Factors, solver: Option<Solver>) -> usize {
    let matrix = Dense::bytes_for(patches);
    let threads = rayon::current_num_threads();
    let (errors, computing) = match factors {
        // Of pairs i ≤ j exchange areas with their errors, freed as they are put together: as much as one matrix.
        Factors::Analytic(_) => (matrix, matrix),
        // Rows are made where they stay.
        Factors::RayCast(_) => (matrix, 0),
        // Errors that are never written take no memory.
        Factors::Hemicube(resolution) => (0, threads * Hemicube::bytes_for(resolution)),
    };
    let solving = match solver {
        None | Some(Solver::Jacobi | Solver::GaussSeidel) => 0,
        Some(Solver::Southwell) => {
            // A row has no more entries above zero than rays.
            let rays = match factors {
                Factors::RayCast(rays) => rays.next_multiple_of(REPLICATES as usize),
                Factors::Analytic(_) | Factors::Hemicube(_) => patches,
            };
            Columns::bytes_for(patches, patches * patches.min(rays))
        }
        // Exchange areas and the matrix that is made of them.
        Some(Solver::ConjugateGradient) => 2 * matrix,
        // The matrix as nalgebra has it, the system and its factors.
        Some(Solver::Direct) => 3 * matrix,
    };
    matrix + errors + computing.max(solving)
}

/// Form factors between patches with their standard errors, row-major.
pub(super) fn compute(
    world: &World<'_>,
    patches: &Patches,
    factors: Factors,
    context: &Context<'_>,
) -> Result<(Dense, Vec<f64>), Failure> {
    /// Relative accuracy of pairs that nothing occludes: rounding is not far below.
    const ACCURACY: f64 = 1e-12;
    let n = patches.len();
    if n > MAX_PATCHES {
        return Err(Failure::new(
            ExitCode::Usage,
            format!(
                "{n} patches are too many for form factors of every pair (at most {MAX_PATCHES}); \
                 give a larger --patch-size, or let rays answer (form-factors --method raycast, \
                 solve without --form-factors)"
            ),
        ));
    }
    let seed = context.common.seed;
    context.reporter.start("form factors", 1);
    let computed = match factors {
        Factors::Analytic(points) => {
            let config = AnalyticConfig {
                accuracy: ACCURACY,
                points,
                seed,
            };
            let result = analytic_factors(world, patches, &config);
            (result.matrix, result.standard_error)
        }
        Factors::Hemicube(resolution) => {
            let config = HemicubeConfig::balanced(resolution);
            let errors = vec![0.0; n * n];
            (hemicube_factors(world, patches, &config), errors)
        }
        Factors::RayCast(rays) => {
            let result = ray_cast(world, patches, &RayCastConfig { rays, seed });
            (Dense::new(n, result.factors)?, result.standard_error)
        }
    };
    context.reporter.finish();
    Ok(computed)
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
