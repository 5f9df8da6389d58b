//! The solvers side by side on one system: residuals beside their theoretical rates.

use super::checks::areas;
use super::family::Family;
use super::operators::{Operator, operator};
use super::solver::{Rate, Solver};
use luxel_scenes::{Irradiance, Radiosity, Reflectance};
use luxel_solver::patches::{PatchSize, Patches};
use luxel_solver::solvers::{Config, Outcome, System, Tolerance, source};
use luxel_solver::world::World;
use serde::Serialize;
use std::time::Instant;

/// Patches up to which a system serves to compare solvers.
const MAX_PATCHES: usize = 600;

/// Patches of a system that is made for the purpose.
const PATCHES: usize = 500;

/// How the residual of a solver falls.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct History {
    /// The solver.
    pub solver: Solver,
    /// Largest residual over that of the start, after each iteration.
    pub residual: Vec<f64>,
    /// Iterations, as the solver counts them.
    pub iterations: usize,
    /// How it ended.
    pub converged: bool,
    /// What theory says.
    pub rate: Option<Rate>,
    /// Geometric mean of the factor over the middle half of the iterations.
    pub observed: Option<f64>,
    /// Time of the solver.
    pub seconds: f64,
}

/// The solvers side by side on one system.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SolverStudy {
    /// Whose operator it is.
    pub family: Family,
    /// Unknowns.
    pub patches: usize,
    /// The channel of the slowest rate: 0 red, 1 green, 2 blue.
    pub channel: usize,
    /// ‖ρF‖∞ of that channel, the rigorous bound on the rate.
    pub gain: f64,
    /// One for each solver.
    pub histories: Vec<History>,
}

/// A system that a method left.
pub(super) struct KeptSystem {
    family: Family,
    operator: Operator,
    areas: Vec<f64>,
    reflectance: Vec<Reflectance>,
    source: Vec<Radiosity>,
}

impl KeptSystem {
    /// True when a system of so many patches serves to compare solvers.
    pub(super) fn is_wanted(patches: usize) -> bool {
        patches <= MAX_PATCHES
    }

    pub(super) fn new(
        world: &World<'_>,
        family: Family,
        operator: Operator,
        patches: &Patches,
    ) -> Self {
        Self {
            family,
            operator,
            areas: areas(world, patches),
            reflectance: patches.reflectances().to_vec(),
            source: test_source(patches),
        }
    }
}

/// Reflectances and a source to try solvers with: the scene's own emission, or, where light comes from
/// elsewhere, an irradiance of 1 W/m² on everything.
fn test_source(patches: &Patches) -> Vec<Radiosity> {
    let n = patches.len();
    let emits = patches.emissions().iter().any(|m| m.0.max_element() > 0.0);
    let direct = if emits { 0.0 } else { 1.0 };
    let reflectance: &[Reflectance] = patches.reflectances();
    let direct = vec![Irradiance::splat(direct); n];
    source(patches.emissions(), reflectance, &direct)
}

/// Runs every solver on `system`, or on ray-cast rows when no method left one.
pub(super) fn compare(
    world: &World<'_>,
    system: Option<KeptSystem>,
    seed: u64,
) -> Option<SolverStudy> {
    /// Relative to the brightest patch: near what f64 can show.
    const TOLERANCE: f64 = 1e-12;
    const MAX_ITERATIONS: usize = 5000;
    let system = if let Some(system) = system {
        system
    } else {
        let patches = world.mesh(PatchSize::Count(PATCHES)).ok()?;
        let family = Family::RayCastRows;
        let (operator, _) = operator(world, &patches, family, seed, 0).ok()?;
        KeptSystem::new(world, family, operator, &patches)
    };
    let KeptSystem {
        family,
        operator,
        areas,
        reflectance,
        source,
    } = &system;
    let system = System::new(operator.transport(), areas, reflectance, source).ok()?;
    let jacobi = |channel| {
        Solver::Jacobi
            .rate(&system, channel)
            .map_or(0.0, |r| r.factor)
    };
    let channel = (0..3).max_by(|&a, &b| jacobi(a).total_cmp(&jacobi(b)))?;
    let config = Config {
        tolerance: Tolerance::Error(TOLERANCE),
        max_iterations: MAX_ITERATIONS,
    };
    let mut histories = Vec::new();
    for solver in Solver::ALL {
        let started = Instant::now();
        let Ok(solution) = solver.solve(&system, &config) else {
            continue;
        };
        let seconds = started.elapsed().as_secs_f64();
        let first = first_residual(&system, channel);
        let residual: Vec<f64> = solution
            .residual_history
            .iter()
            .map(|r| r[channel] / first)
            .collect();
        histories.push(History {
            solver,
            iterations: solution.iterations,
            observed: observed_rate(&residual),
            converged: solution.outcome == Outcome::Converged,
            rate: solver.rate(&system, channel),
            residual,
            seconds,
        });
    }
    Some(SolverStudy {
        family: *family,
        patches: system.len(),
        channel,
        gain: system.gain()[channel],
        histories,
    })
}

/// ‖ρFS‖∞: the residual of the start B = S.
fn first_residual(system: &System, channel: usize) -> f64 {
    let mut gathered = vec![Irradiance::ZERO; system.len()];
    system.transport().gather(system.source(), &mut gathered);
    let reflected = system.reflectance().iter().zip(&gathered);
    let largest = reflected
        .map(|(&rho, &e)| (rho * e).0[channel])
        .fold(0.0, f64::max);
    if largest > 0.0 { largest } else { 1.0 }
}

/// Geometric mean of the factor over the middle half of a history: after the start, and before the end, where
/// Gauss–Seidel's residuals change from upper bounds to exact values.
fn observed_rate(residual: &[f64]) -> Option<f64> {
    let last = residual.len().checked_sub(1)?;
    let (first, end) = (last / 4, last - last / 4);
    let (from, to) = (residual[first], residual[end]);
    (end > first && from > 0.0 && to > 0.0).then(|| (to / from).powf(1.0 / (end - first) as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_observed_rate_is_that_of_the_middle() {
        let mut residual: Vec<f64> = (0..41).map(|k| 0.5_f64.powi(k)).collect();
        residual[0] = 7.0;
        residual[40] = 1e-30;
        // Powers of two are exact; the root rounds.
        assert!(observed_rate(&residual).is_some_and(|rate| (rate - 0.5).abs() < 1e-12));
        assert_eq!(observed_rate(&[1.0]), None);
        assert_eq!(observed_rate(&[]), None);
    }
}
