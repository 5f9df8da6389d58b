//! Solvers side by side: residuals, rates, seconds.

use super::{Axis, Dot, Series, Spacing, chart, figure, or_dash, percent, plain};
use crate::report::html::{Column, table};
use crate::report::palette::of_solver;
use crate::report::solver_study::{History, SolverStudy};
use crate::report::study::{Row, Study};

const ITERATIONS: Axis = Axis {
    label: "iterations",
    spacing: Spacing::Linear,
    format: plain,
};
const RESIDUAL: Axis = Axis {
    label: "largest residual / that of the start",
    spacing: Spacing::Logarithmic,
    format: plain,
};

pub(super) fn section(study: &Study) -> String {
    let Some(found) = &study.solvers else {
        return "<p class=\"absent\">There is no system to compare solvers on.</p>\n".to_owned();
    };
    let lines = found.histories.iter().flat_map(lines).collect();
    let histories = chart("Residual against iterations", ITERATIONS, RESIDUAL, lines);
    format!(
        "<p>Every solver on one system, {}, {} patches, channel {}, to a bound on the error of 10⁻¹² of \
         the brightest patch. Dashed: the theoretical rate, laid through the middle of the history.</p>\n{}{}\
         <p class=\"soft\">Factor: by which the residual falls each iteration, observed over the middle half \
         of the history. ‖ρF‖<sub>∞</sub> = {:.4} bounds Jacobi’s.</p>\n{}",
        found.family.title(),
        found.patches,
        ["red", "green", "blue"][found.channel],
        figure(&histories, "Residual of the slowest channel."),
        rates(found),
        found.gain,
        solver_seconds(study),
    )
}

/// The history of a solver, and its theoretical rate dashed beside it.
fn lines(history: &History) -> Vec<Series> {
    let (colour, _) = of_solver(history.solver);
    let dot = |x: usize, y: f64| Dot {
        x: x as f64,
        y,
        is_limit: false,
    };
    let Some(last) = history
        .residual
        .len()
        .checked_sub(1)
        .filter(|&last| last > 0)
    else {
        // A single value, as of a direct solver, makes no line.
        return Vec::new();
    };
    let residual = history.residual.iter().enumerate();
    let mut lines = vec![Series {
        label: history.solver.title().to_owned(),
        colour,
        mark: None,
        dots: residual.map(|(k, &y)| dot(k, y)).collect(),
        is_dashed: false,
    }];
    if let Some(rate) = history.rate.filter(|rate| rate.factor > 0.0) {
        let middle = last / 2;
        let at = |k: usize| {
            let steps = k as f64 - middle as f64;
            dot(k, history.residual[middle] * rate.factor.powf(steps))
        };
        lines.push(Series {
            label: String::new(),
            colour,
            mark: None,
            dots: vec![at(0), at(last)],
            is_dashed: true,
        });
    }
    lines
}

fn rates(found: &SolverStudy) -> String {
    let columns = [
        Column::Text("solver"),
        Column::Number("iterations"),
        Column::Number("observed factor"),
        Column::Number("theoretical factor"),
        Column::Text("which is the"),
        Column::Number("residual left"),
        Column::Number("seconds"),
    ];
    let rows = found.histories.iter().map(|history| {
        let factor = |value: f64| format!("{value:.4}");
        let limit = if history.converged { "" } else { " (limit)" };
        vec![
            history.solver.title().to_owned(),
            format!("{}{limit}", history.iterations),
            or_dash(history.observed.map(factor)),
            or_dash(history.rate.map(|rate| factor(rate.factor))),
            history.rate.map_or("", |rate| rate.meaning).to_owned(),
            or_dash(history.residual.last().copied().map(plain)),
            plain(history.seconds),
        ]
    });
    table(&columns, rows)
}

/// Every solver on the largest system of each classical family.
fn solver_seconds(study: &Study) -> String {
    let columns = [
        Column::Text("form factors × operator"),
        Column::Number("patches"),
        Column::Text("solver"),
        Column::Number("iterations"),
        Column::Number("seconds"),
        Column::Number("bound on the error left"),
    ];
    let mut cells = Vec::new();
    for result in &study.families {
        let solved = || result.rows.iter().filter(|row| row.solver.is_some());
        let largest = solved().map(|row| row.step).max();
        for row in solved().filter(|row| Some(row.step) == largest) {
            cells.push(cells_of(row));
        }
    }
    if cells.is_empty() {
        return String::new();
    }
    format!(
        "<h3>On the largest system of each method, to the tolerance of the commands</h3>\n{}",
        table(&columns, cells)
    )
}

fn cells_of(row: &Row) -> Vec<String> {
    vec![
        row.family.title().to_owned(),
        row.patches.unwrap_or(0).to_string(),
        row.solver.map_or("", |solver| solver.title()).to_owned(),
        row.iterations.unwrap_or(0).to_string(),
        or_dash(row.solver_seconds.map(plain)),
        percent(row.stated.solver),
    ]
}
