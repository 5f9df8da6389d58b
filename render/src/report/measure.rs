//! One family after another: sizes, rows, and what is kept of them.

use super::budget::{Clock, Stop, gather_rays, path_rays};
use super::classical::{self, Rung};
use super::family::Family;
use super::methods::{self, Outcome};
use super::metrics::{Errors, mean_of_channels, root_mean_square, within_two};
use super::solver_study::KeptSystem;
use super::study::{FamilyResult, Parts, Row, Setup};
use super::target::Kind;
use crate::points::Estimate;
use crate::progress::Progress;
use luxel_scenes::{Irradiance, Radiance, Rgb};
use luxel_solver::patches::Patches;
use std::time::Instant;

/// A mesh with its irradiance.
pub(super) struct Field {
    pub(super) family: Family,
    pub(super) patches: Patches,
    pub(super) irradiance: Vec<Irradiance>,
}

/// What is kept of a family beside its rows.
#[derive(Default)]
pub(super) struct Kept {
    /// The largest mesh.
    pub(super) field: Option<Field>,
    /// Values of the largest size.
    pub(super) estimates: Option<Vec<Estimate>>,
    /// The largest operator that the solvers are compared on.
    pub(super) system: Option<KeptSystem>,
}

/// Runs a family, size by size.
pub(super) fn measure(
    setup: &Setup<'_, '_>,
    family: Family,
    clock: &Clock,
    progress: &dyn Progress,
) -> (FamilyResult, Kept) {
    let mut result = FamilyResult {
        family,
        rows: Vec::new(),
        stopped: "All sizes are done.".to_owned(),
        check: None,
    };
    let mut kept = Kept::default();
    if Family::CLASSICAL.contains(&family) && !setup.world.scene().lights.is_empty() {
        "Not run: classical radiosity knows light from surfaces only, and the scene has others."
            .clone_into(&mut result.stopped);
        return (result, kept);
    }
    let mut next = 0.0;
    for step in 0..family.max_steps() {
        // The first size is always tried, so that every method is in the report.
        if step > 0
            && let Err(stop) = clock.allows(step, next)
        {
            result.stopped = match stop {
                Stop::Steps => format!("{step} sizes were asked for."),
                Stop::Time { next, share } => format!(
                    "The next size would take about {next:.1} s more, beyond this method’s {share:.1} s."
                ),
            };
            break;
        }
        let bytes = family.bytes(step, setup.target.len(), setup.world.scene());
        if setup.memory.is_some_and(|memory| bytes > memory) {
            result.stopped = format!(
                "The next size would take about {} MiB of memory, more than there may be.",
                bytes.div_ceil(1 << 20)
            );
            break;
        }
        let started = Instant::now();
        if let Err(reason) = one_step(setup, family, step, &mut result, &mut kept) {
            result.stopped = if step == 0 {
                format!("Not run: {reason}.")
            } else {
                format!("The next size was not run: {reason}.")
            };
            break;
        }
        next = started.elapsed().as_secs_f64() * family.growth();
        progress.advance(1);
    }
    (result, kept)
}

/// Runs one size of a family.
fn one_step(
    setup: &Setup<'_, '_>,
    family: Family,
    step: u32,
    result: &mut FamilyResult,
    kept: &mut Kept,
) -> Result<(), String> {
    let (world, target, seed) = (setup.world, &setup.target, setup.seed);
    let count = family.patches(step).unwrap_or(0);
    let started = Instant::now();
    if Family::CLASSICAL.contains(&family) {
        let rung = classical::rung(world, target, family, count, seed)
            .map_err(|error| error.to_string())?;
        if is_known(result, Some(rung.patches.len())) {
            return Ok(());
        }
        take_classical(setup, family, step, rung, result, kept);
        return Ok(());
    }
    let outcome = match family {
        Family::Radiosity => methods::radiosity(world, target, count, seed),
        Family::Gather => methods::final_gather(world, target, count, gather_rays(step), seed),
        _ => Ok(methods::path(world, target, path_rays(step), seed)),
    }
    .map_err(|error| error.to_string())?;
    let seconds = started.elapsed().as_secs_f64();
    if family == Family::Radiosity && is_known(result, outcome.patches) {
        return Ok(());
    }
    take(setup, family, step, outcome, seconds, result, kept)
}

/// True when the mesh of the last row has as many patches, within a tenth: small faces put a floor under the
/// number of patches, so that the first sizes of a scene of many may all be one.
fn is_known(result: &FamilyResult, patches: Option<usize>) -> bool {
    let last = result.rows.last().and_then(|row| row.patches);
    match (last, patches) {
        (Some(last), Some(patches)) => (patches as f64) < 1.1 * last as f64,
        _ => false,
    }
}

/// Turns a size of a classical family into rows.
fn take_classical(
    setup: &Setup<'_, '_>,
    family: Family,
    step: u32,
    rung: Rung,
    result: &mut FamilyResult,
    kept: &mut Kept,
) {
    let patches = rung.patches.len();
    for run in &rung.runs {
        let values = masked(setup, &run.estimates);
        let Some(error) = Errors::new(&values, &setup.reference.estimates) else {
            continue;
        };
        result.rows.push(Row {
            family,
            solver: Some(run.solver),
            step,
            patches: Some(patches),
            rays: rung.rays,
            iterations: Some(run.iterations),
            seconds: rung.factor_seconds + run.seconds,
            solver_seconds: Some(run.seconds),
            error,
            stated: Parts {
                solver: run.error_bound / solver_scale(setup),
                sampling: run.states_sampling.then(|| noise(setup, &run.estimates)),
                discretisation: between_meshes(setup, kept, &run.estimates, patches),
            },
            within_two: None,
            mean: mean_of(&values),
        });
    }
    result.check = Some(rung.check);
    if KeptSystem::is_wanted(patches) {
        kept.system = Some(KeptSystem::new(
            setup.world,
            family,
            rung.operator,
            &rung.patches,
        ));
    }
    kept.estimates = rung.runs.into_iter().next().map(|run| run.estimates);
    kept.field = Some(Field {
        family,
        patches: rung.patches,
        irradiance: rung.irradiance,
    });
}

/// Turns a size of one of luxel's own methods into a row.
fn take(
    setup: &Setup<'_, '_>,
    family: Family,
    step: u32,
    outcome: Outcome,
    seconds: f64,
    result: &mut FamilyResult,
    kept: &mut Kept,
) -> Result<(), String> {
    let estimates = outcome.estimates;
    let values = match family {
        Family::Radiosity => masked(setup, &estimates),
        _ => estimates.iter().map(|e| Some(e.value)).collect(),
    };
    let reference = &setup.reference;
    let error = Errors::new(&values, &reference.estimates)
        .ok_or("the points where it can be compared are black")?;
    let stated_mesh = outcome
        .discretisation
        .as_ref()
        .map(|parts| root_mean_square(parts.iter().copied()) / reference.mean);
    let is_mesh = family == Family::Radiosity;
    let patches = outcome.patches;
    result.rows.push(Row {
        family,
        solver: None,
        step,
        patches,
        rays: Some(outcome.rays),
        iterations: outcome.iterations,
        seconds,
        solver_seconds: None,
        error,
        stated: Parts {
            solver: outcome.error_bound / solver_scale(setup),
            sampling: Some(noise(setup, &estimates)),
            discretisation: match patches {
                Some(patches) if is_mesh => between_meshes(setup, kept, &estimates, patches),
                _ => stated_mesh,
            },
        },
        within_two: (!is_mesh)
            .then(|| {
                let allowance = outcome.discretisation.as_deref();
                within_two(&estimates, allowance, &reference.estimates)
            })
            .flatten(),
        mean: mean_of(&values),
    });
    result.check = outcome.check;
    kept.field = outcome.field.map(|(patches, irradiance)| Field {
        family,
        patches,
        irradiance,
    });
    kept.estimates = Some(estimates);
    Ok(())
}

/// Values where a mesh can be looked up.
fn masked(setup: &Setup<'_, '_>, estimates: &[Estimate]) -> Vec<Option<Rgb>> {
    let on_surface = setup.target.on_surface();
    estimates
        .iter()
        .zip(on_surface)
        .map(|(estimate, &on)| on.then_some(estimate.value))
        .collect()
}

fn mean_of(values: &[Option<Rgb>]) -> f64 {
    mean_of_channels(values.iter().flatten().copied()).unwrap_or(0.0)
}

/// What an irradiance is divided by to be a ratio to the mean of the reference: a pixel of reflectance 1
/// shows E/π.
fn solver_scale(setup: &Setup<'_, '_>) -> f64 {
    match setup.target.kind() {
        Kind::Points(_) => setup.reference.mean,
        Kind::Pixels(_) => {
            let mean = Radiance::splat(setup.reference.mean);
            mean.to_irradiance().0.x
        }
    }
}

/// Stated standard error, root mean square over the mean of the reference.
fn noise(setup: &Setup<'_, '_>, estimates: &[Estimate]) -> f64 {
    let errors = estimates.iter().map(|estimate| estimate.standard_error);
    root_mean_square(errors) / setup.reference.mean
}

/// The error of a mesh from the difference to the mesh before: with errors e ∝ h of independent signs on two
/// meshes, rms(x − x₋)² = e² + e₋² = e² (1 + n/n₋), noise of sampling taken off. `None` for the first
/// mesh.
fn between_meshes(
    setup: &Setup<'_, '_>,
    kept: &Kept,
    estimates: &[Estimate],
    patches: usize,
) -> Option<f64> {
    let before = kept.estimates.as_ref()?;
    let coarse = kept.field.as_ref()?.patches.len();
    let on_surface = setup.target.on_surface();
    let squares = estimates
        .iter()
        .zip(before)
        .zip(on_surface)
        .filter(|&(_, &on)| on)
        .map(|((fine, coarse), _)| {
            let d = fine.value - coarse.value;
            d * d
                - fine.standard_error * fine.standard_error
                - coarse.standard_error * coarse.standard_error
        });
    let mean = mean_of_channels(squares)?.max(0.0);
    let ratio = patches as f64 / coarse as f64;
    Some((mean / (1.0 + ratio)).sqrt() / setup.reference.mean)
}
