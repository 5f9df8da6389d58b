//! What methods state of their error against what it is, and what it is made of.

use super::{Axis, Spacing, chart, figure, limited, line, or_dash, percent, series, spent};
use crate::report::html::{Column, concat, table};
use crate::report::palette;
use crate::report::plot::{self, Bar};
use crate::report::study::{Row, Study};

const STATED: Axis = Axis {
    label: "stated error",
    spacing: Spacing::Logarithmic,
    format: percent,
};
const TRUE: Axis = Axis {
    label: "true error (nRMSE)",
    spacing: Spacing::Logarithmic,
    format: percent,
};

pub(super) fn section(study: &Study) -> String {
    let stated = |row: &Row| row.stated_total().filter(|&stated| stated > 0.0);
    let lines = series(study, stated, |row| Some(row.error.nrmse));
    let mut chart = chart("True against stated error", STATED, TRUE, lines);
    chart.has_diagonal = true;
    let columns = [
        Column::Text("largest size of"),
        Column::Number("nRMSE"),
        Column::Number("relRMSE"),
        Column::Number("stated"),
        Column::Number("true / stated"),
        Column::Number("within 2 standard errors"),
    ];
    let largest = study.families.iter();
    let largest = largest.filter_map(|result| line(result).last().copied());
    let rows = largest.map(|row| {
        let ratio = row.stated_total().filter(|&total| total > 0.0);
        let ratio = ratio.map(|total| limited(row, format!("{:.2}", row.error.nrmse / total)));
        vec![
            row.family.title().to_owned(),
            limited(row, percent(row.error.nrmse)),
            limited(row, percent(row.error.rel_rmse)),
            or_dash(row.stated_total().map(percent)),
            or_dash(ratio),
            or_dash(
                row.within_two
                    .map(|share| format!("{:.1} %", 100.0 * share)),
            ),
        ]
    });
    format!(
        "<p>A method that knows its error lies on the dashed line; above it, it is worse than it says. The stated \
         error is made without the reference: the bound on the iteration, the standard error from independent \
         repetitions, and for meshes the difference between the last two.</p>\n<div class=\"pair\">\n{}\
         <div>{}<p class=\"soft\">Within 2 standard errors: of method and reference together; 95 % when they \
         are known exactly, and about 86 % when four repetitions estimate them.</p></div>\n</div>\n",
        figure(&chart, "Every size of every method that states an error."),
        table(&columns, rows),
    )
}

/// Shares of solver, sampling and discretisation in the squared true error. What is not stated as solver
/// or sampling is discretisation.
fn shares(row: &Row) -> [f64; 3] {
    let solver = row.stated.solver.powi(2);
    let sampling = row.stated.sampling.unwrap_or(0.0).powi(2);
    let rest = (row.error.nrmse.powi(2) - solver - sampling).max(0.0);
    let total = solver + sampling + rest;
    if total > 0.0 {
        [solver, sampling, rest].map(|part| part / total)
    } else {
        [0.0; 3]
    }
}

pub(super) fn parts(study: &Study) -> String {
    let ends = |result| {
        let rows = line(result);
        let first = rows.first().copied().filter(|_| rows.len() > 1);
        [first, rows.last().copied()]
    };
    let rows: Vec<&Row> = study.families.iter().flat_map(ends).flatten().collect();
    let bars: Vec<Bar> = rows
        .iter()
        .map(|row| Bar {
            label: format!("{}, {}", row.family.name(), spent(row)),
            parts: palette::PARTS.into_iter().zip(shares(row)).collect(),
            note: format!("nRMSE {}", limited(row, percent(row.error.nrmse))),
        })
        .collect();
    let names = [
        "solver (bound)",
        "sampling (standard error)",
        "discretisation (what remains)",
    ];
    let legend = names.into_iter().zip(palette::PARTS).map(|(name, colour)| {
        format!(
            "<span class=\"swatch\" style=\"background:rgb({},{},{})\"></span>{name}",
            colour.0, colour.1, colour.2
        )
    });
    let columns = [
        Column::Text("method"),
        Column::Number("solver"),
        Column::Number("sampling"),
        Column::Number("discretisation"),
        Column::Number("true nRMSE"),
    ];
    let cells = rows.iter().map(|row| {
        vec![
            format!("{}, {}", row.family.name(), spent(row)),
            percent(row.stated.solver),
            or_dash(row.stated.sampling.map(percent)),
            or_dash(row.stated.discretisation.map(percent)),
            limited(row, percent(row.error.nrmse)),
        ]
    });
    format!(
        "<p>Shares of the squared error of the smallest and the largest size of each method.</p>\n<p class=\"legend\">{}</p>\n\
         <figure class=\"bars\">{}<figcaption>Discretisation is what the true error holds beside the stated parts: the mesh, \
         and the bias of form factors.</figcaption></figure>\n<h3>The parts as the methods state them</h3>\n{}",
        concat(legend),
        plot::bars(&bars, "Shares of the squared error by method", [240, 140]),
        table(&columns, cells),
    )
}
