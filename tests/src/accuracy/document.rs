//! The tables as one Markdown document.

use super::exact::{irradiance_field, openness};
use super::noise::Spread;
use super::scenes::{SCENES, Summary, reference};
use super::solving::{RESIDUAL, rates};
use super::{Calibration, largest, noise};
use crate::cases::{ambient_occlusion, irradiance_fields};
use crate::cie171;
use crate::ledgers::{Entry, ledgers};
use std::fmt::Write;
use std::num::NonZeroUsize;
use std::time::Instant;

/// Errors that are asked for, percent.
const TARGETS: [f64; 4] = [5.0, 2.0, 1.0, 0.5];

/// Seeds over which the sampling part is compared with the scatter: the mean of z² is then known to a
/// few percent.
const NOISE_SEEDS: u64 = 200;

/// Most seeds of the closed forms: few of their values are sampled at all, and writing their scenes
/// takes longer than probing them.
const EXACT_SEEDS: u64 = 10;

/// Reflectances of the closed room.
const REFLECTANCES: [f64; 5] = [0.5, 0.9, 0.99, 0.999, 0.9999];

/// Measures everything, over `seeds` seeds of the scenes, and writes it down. `progress` hears what has
/// been done and how long it took.
///
/// # Panics
/// When the command fails, or `seeds` is zero.
pub fn document(seeds: u64, progress: &mut dyn FnMut(&str)) -> String {
    assert!(seeds > 0, "at least one seed");
    let mut text = head();
    text.push_str(&scenes(seeds, progress));
    let rest: [(&str, &dyn Fn() -> String); 5] = [
        ("closed forms", &|| exact(seeds.min(EXACT_SEEDS))),
        ("sampling", &sampling),
        ("CIE 171", &cie),
        ("solvers", &solvers),
        ("energy", &ledger),
    ];
    for (name, section) in rest {
        let started = Instant::now();
        text.push_str(&section());
        let seconds = started.elapsed().as_secs_f64();
        progress(&format!("{name}: {seconds:.1} s"));
    }
    text
}

fn head() -> String {
    let cores = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let version = env!("CARGO_PKG_VERSION");
    format!(
        "\
# Accuracy of luxel

Measured with luxel {version} on {cores} cores by

    cargo run --release -p luxel-tests --bin accuracy > tests/ACCURACY.md

which takes the number of seeds as an argument (40 without). All but the times is the same on any machine.

**nRMSE** is the root mean squared error over the mean of the reference, over all points and channels, with the reference's own variance
subtracted. **relRMSE** is the root mean square of the error relative to each value (floor: 1 % of the mean), which the dark parts
decide. What `--error` promises is the nRMSE.

A stated error s is one standard deviation. A value x is *within* when |x − x*| ≤ 2 √(s² + s*²), with x* the reference and s* its
standard error; z² = (x − x*)² / (s² + s*²). Honest errors have about 95 % within and a mean z² near 1. Far fewer within is a
boast, all of them is rays wasted.
"
    )
}

/// A row of a table.
fn row(text: &mut String, cells: std::fmt::Arguments) {
    writeln!(text, "| {cells} |").expect("writing to a string does not fail");
}

/// A number with its digits, a dash where there is none.
fn cell(value: f64, digits: usize) -> String {
    if value.is_finite() {
        format!("{value:.digits$}")
    } else {
        "–".to_owned()
    }
}

fn scenes(seeds: u64, progress: &mut dyn FnMut(&str)) -> String {
    let mut text = format!(
        "
## Scenes

`luxel probe --error P%` at the 1000 points of each reference (`tests/references/`), {seeds} seeds. The furnace is held against its exact
value, 2π; the other references are sampled, and most of the corridor's points state a bound of 0.5 to 2 % instead of a standard error,
which widens its share within. *stated* is the median of the errors that the runs stated; *met* is the share of the runs whose true nRMSE is
what was asked for, *overspent* of those below a quarter of it. A run's seconds include reading the scene and meshing it.

| scene | asked % | within % | mean z² | stated % | nRMSE %: median | max | relRMSE %: median | max | met % | overspent % | seconds |
|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|
"
    );
    for scene in SCENES {
        let reference = reference(scene);
        for percent in TARGETS {
            let started = Instant::now();
            let summary = Summary::new(&reference, percent, seeds);
            let calibration = summary.calibration();
            row(
                &mut text,
                format_args!(
                    "{scene} | {percent} | {} | {} | {:.3} | {:.3} | {:.3} | {:.2} | {:.2} | {:.1} | {:.1} | {:.2}",
                    cell(100.0 * calibration.share(), 1),
                    cell(calibration.mean_z_squared(), 2),
                    100.0 * summary.median(|run| run.stated),
                    100.0 * summary.median(|run| run.errors.nrmse),
                    100.0 * summary.largest(|run| run.errors.nrmse),
                    100.0 * summary.median(|run| run.errors.rel_rmse),
                    100.0 * summary.largest(|run| run.errors.rel_rmse),
                    100.0 * summary.share_below(1.0),
                    100.0 * summary.share_below(0.25),
                    summary.median(|run| run.seconds),
                ),
            );
            let seconds = started.elapsed().as_secs_f64();
            progress(&format!("{scene} {percent} %: {seconds:.1} s"));
        }
    }
    text
}

fn exact(seeds: u64) -> String {
    let mut text = format!(
        "
## Closed forms

`luxel probe --error 1%` at the points of `tests/cases/`: direct light and ambient occlusion, {seeds} seeds. What a case's geometry is off by
(a disk of 48 sides, walls of finite length) is taken from the error first. Values that are stated to be exact, without an error, are
counted apart, with the largest error among them relative to the brightest value of the case.

| case | what | values | within % | mean z² | exact | off by |
|---|---|--:|--:|--:|--:|--:|
"
    );
    let mut all = Calibration::default();
    let mut add = |id: &str, title: &str, calibration: Calibration| {
        all = all.and(calibration);
        calibration_row(&mut text, id, title, &calibration);
    };
    for case in irradiance_fields() {
        add(&case.id, &case.title, irradiance_field(&case, seeds));
    }
    for case in ambient_occlusion() {
        add(&case.id, &case.title, openness(&case, seeds));
    }
    calibration_row(&mut text, "**all**", "", &all);
    text
}

fn calibration_row(text: &mut String, id: &str, title: &str, calibration: &Calibration) {
    let title = title.replace('|', "\\|");
    let off = if calibration.exact > 0 {
        format!("{:.1e}", calibration.exact_off)
    } else {
        "–".to_owned()
    };
    row(
        text,
        format_args!(
            "{id} | {title} | {} | {} | {} | {} | {off}",
            calibration.values,
            cell(100.0 * calibration.share(), 1),
            cell(calibration.mean_z_squared(), 2),
            calibration.exact,
        ),
    );
}

fn sampling() -> String {
    let few = noise::points(NOISE_SEEDS, 4);
    let many = noise::points(NOISE_SEEDS, 2);
    let pixels = |spread| noise::pixels(NOISE_SEEDS, spread).z_squared;
    let [coarse, fine] = [16, 64].map(|samples| pixels(Spread::Even(samples)));
    let spread = pixels(Spread::WhereNoisy { rounds: 3 });
    format!(
        "
## Sampling

The stated noise against the scatter over {NOISE_SEEDS} seeds of a small room with one mesh: the mean of z² = (x − x̄)²/s² · n/(n − 1), with x̄
the mean over seeds. It should lie between 0.8 and 1.25.

| what | mean z² |
|---|--:|
| 100 points, two gathers, as for 64 points and more | {many:.3} |
| 100 points, four gathers, as for fewer | {few:.3} |
| 400 pixels of a film, 16 samples each | {coarse:.3} |
| 400 pixels of a film, 64 samples each | {fine:.3} |
| 400 pixels of a film, samples where the noise is, three rounds | {spread:.3} |
"
    )
}

fn cie() -> String {
    let table = cie171::markdown(&cie171::table());
    format!(
        "
## CIE 171:2006

The tests of CIE 171:2006 through the command. A value is in tolerance within 0.1 % of its reference or four of its standard errors.

{table}
Case 5.5x is missed: between the two faces of a pane light is polarised, so that the second face reflects another share of it than of
unpolarised light. Its reference counts that; luxel does not follow polarisation.
"
    )
}

fn solvers() -> String {
    let mut text = format!(
        "
## Solvers

A closed room of 384 patches with exact form factors and one reflectance ρ everywhere. Iterations of conjugate gradient to a residual of
{RESIDUAL:e}; the factor by which Jacobi's residual shrinks in a sweep over ρ (in theory 1), and the power of ρ by which Gauss–Seidel's
does (in theory 2 as ρ approaches 1).

| ρ | conjugate gradient: iterations | Jacobi: factor / ρ | Gauss–Seidel: power of ρ |
|--:|--:|--:|--:|
"
    );
    for rates in rates(&REFLECTANCES) {
        row(
            &mut text,
            format_args!(
                "{} | {} | {:.6} | {:.3}",
                rates.rho, rates.iterations, rates.jacobi, rates.gauss_seidel
            ),
        );
    }
    text
}

fn ledger() -> String {
    let mut text = String::from(
        "
## Energy

|emitted − absorbed − escaped| over emitted, in the worst channel: after LU, and after the worst of Jacobi, Gauss–Seidel, Southwell and
conjugate gradient when asked for an error of 1e-4 and 1e-9.

| scene | LU | iteration to 1e-4 | iteration to 1e-9 |
|---|--:|--:|--:|
",
    );
    for scene in SCENES {
        let entries = ledgers(scene);
        let worst = |tolerance: Option<f64>| {
            let own = entries
                .iter()
                .filter(|entry: &&Entry| entry.tolerance == tolerance);
            largest(own.map(|entry| entry.unaccounted))
        };
        row(
            &mut text,
            format_args!(
                "{scene} | {:.1e} | {:.1e} | {:.1e}",
                worst(None),
                worst(Some(1e-4)),
                worst(Some(1e-9))
            ),
        );
    }
    text
}
