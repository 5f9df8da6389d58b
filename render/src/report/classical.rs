//! Classical radiosity on a mesh: form factors, then every solver.
//!
//! Emission is part of the solution (S = M), so that direct light comes from the form factors, too. Where
//! form factors are sampled the whole chain is repeated with independent rays; the mean is the
//! result and the scatter its standard error.

use super::checks::{self, Check};
use super::family::Family;
use super::operators::{Operator, OperatorError, check_work, operator, propagated, row_rays};
use super::solver::{SolveError, Solver};
use super::target::Target;
use crate::film::Moments;
use crate::points::Estimate;
use luxel_scenes::{Irradiance, Rgb};
use luxel_solver::patches::{MeshError, PatchSize, Patches};
use luxel_solver::solvers::{Config, Ledger, Solution, System, SystemError, Tolerance, source};
use luxel_solver::world::World;
use std::time::Instant;

/// Independent repetitions where form factors are sampled.
const REPLICATES: u32 = 4;

/// Bound on the error that the iteration may leave, relative to the brightest patch.
const TOLERANCE: f64 = 1e-7;

/// Sweeps after which an iteration gives up.
const MAX_ITERATIONS: usize = 20_000;

/// One size of a family.
pub(super) struct Rung {
    pub(super) patches: Patches,
    /// One run for each solver.
    pub(super) runs: Vec<Run>,
    pub(super) rays: Option<u64>,
    pub(super) factor_seconds: f64,
    pub(super) check: Check,
    /// Of the first repetition.
    pub(super) operator: Operator,
    /// Mean over repetitions, as the last solver left it.
    pub(super) irradiance: Vec<Irradiance>,
}

/// What a solver made of a size.
pub(super) struct Run {
    pub(super) solver: Solver,
    pub(super) estimates: Vec<Estimate>,
    /// Whether the standard errors of the estimates mean anything.
    pub(super) states_sampling: bool,
    /// Bound on the error of an irradiance that the iteration leaves, W/m².
    pub(super) error_bound: f64,
    pub(super) iterations: usize,
    pub(super) seconds: f64,
}

/// Why a size was not solved.
#[derive(Debug, thiserror::Error)]
pub(super) enum RungError {
    #[error(transparent)]
    Mesh(#[from] MeshError),
    #[error(transparent)]
    Operator(#[from] OperatorError),
    #[error(transparent)]
    System(#[from] SystemError),
    #[error(transparent)]
    Solve(#[from] SolveError),
}

/// Computes one size of a classical family.
pub(super) fn rung(
    world: &World<'_>,
    target: &Target,
    family: Family,
    count: usize,
    seed: u64,
) -> Result<Rung, RungError> {
    let started = Instant::now();
    let patches = world.mesh(PatchSize::Count(count))?;
    check_work(world, &patches, family)?;
    let mut factor_seconds = started.elapsed().as_secs_f64();
    let n = patches.len();
    let areas = checks::areas(world, &patches);
    let no_lights = vec![Irradiance::ZERO; n];
    let sources = source(patches.emissions(), patches.reflectances(), &no_lights);
    let solvers: Vec<Solver> = Solver::ALL
        .into_iter()
        .filter(|solver| n <= solver.max_patches())
        .collect();
    let config = Config {
        tolerance: Tolerance::Error(TOLERANCE),
        max_iterations: MAX_ITERATIONS,
    };
    let replicates = match family {
        Family::RayCast | Family::RayCastRows => REPLICATES,
        _ => 1,
    };
    let mut tallies: Vec<Tally> = solvers.iter().map(|_| Tally::new(target.len())).collect();
    let mut irradiance = vec![Irradiance::ZERO; n];
    let mut ledgers = Vec::new();
    let mut first = None;
    for replicate in 0..replicates {
        let started = Instant::now();
        let (operator, errors) = operator(world, &patches, family, seed, replicate)?;
        factor_seconds += started.elapsed().as_secs_f64();
        let system = System::new(
            operator.transport(),
            &areas,
            patches.reflectances(),
            &sources,
        )?;
        for (index, (&solver, tally)) in solvers.iter().zip(&mut tallies).enumerate() {
            let started = Instant::now();
            let solution = solver.solve(&system, &config)?;
            tally.seconds += started.elapsed().as_secs_f64();
            tally.add(
                &solution,
                &target.values(world, &patches, &solution.irradiance),
            );
            if let Some(errors) = &errors {
                let errors = propagated(errors, &solution.radiosity);
                tally.stated = Some(target.standard_errors(world, &patches, &errors));
            }
            if index + 1 == solvers.len() {
                for (sum, &e) in irradiance.iter_mut().zip(&solution.irradiance) {
                    *sum += e * (1.0 / f64::from(replicates));
                }
                ledgers.push(Ledger::new(
                    &system,
                    &solution,
                    patches.emissions(),
                    &no_lights,
                ));
            }
        }
        first.get_or_insert(operator);
    }
    let operator = first.expect("at least one repetition");
    let check = checks::check(world, &patches, &operator, &ledgers);
    let rays = row_rays(family, n) as u64 * n as u64 * u64::from(replicates);
    let runs = solvers
        .into_iter()
        .zip(tallies)
        .map(|(solver, tally)| tally.finish(solver))
        .collect();
    Ok(Rung {
        patches,
        runs,
        rays: (rays > 0).then_some(rays),
        factor_seconds,
        check,
        operator,
        irradiance,
    })
}

/// What the repetitions of a solver add up to.
struct Tally {
    moments: Vec<Moments>,
    stated: Option<Vec<Rgb>>,
    bound: f64,
    iterations: usize,
    seconds: f64,
}

impl Tally {
    fn new(len: usize) -> Self {
        Self {
            moments: vec![Moments::default(); len],
            stated: None,
            bound: 0.0,
            iterations: 0,
            seconds: 0.0,
        }
    }

    fn add(&mut self, solution: &Solution, values: &[Rgb]) {
        for (moments, &value) in self.moments.iter_mut().zip(values) {
            moments.add(value);
        }
        self.bound = self.bound.max(solution.error_bound.max_element());
        self.iterations = self.iterations.max(solution.iterations);
    }

    fn finish(self, solver: Solver) -> Run {
        let repeated = self.moments.first().is_some_and(|m| m.count() > 1);
        let states_sampling = repeated || self.stated.is_some();
        let estimates = self
            .moments
            .iter()
            .enumerate()
            .map(|(slot, moments)| Estimate {
                value: moments.mean(),
                standard_error: moments.standard_error().unwrap_or_else(|| {
                    self.stated
                        .as_ref()
                        .map_or(Rgb::ZERO, |stated| stated[slot])
                }),
            })
            .collect();
        Run {
            solver,
            estimates,
            states_sampling,
            error_bound: self.bound,
            iterations: self.iterations,
            seconds: self.seconds,
        }
    }
}
