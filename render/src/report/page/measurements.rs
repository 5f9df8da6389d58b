//! The table of everything.

use super::{limited, or_dash, percent, plain, signed};
use crate::report::html::{Column, table};
use crate::report::solver::Solver;
use crate::report::study::Study;
use crate::report::table::rows;

const COLUMNS: [Column; 10] = [
    Column::Text("method"),
    Column::Text("solver"),
    Column::Number("patches"),
    Column::Number("rays"),
    Column::Number("seconds"),
    Column::Number("nRMSE"),
    Column::Number("relRMSE"),
    Column::Number("bias"),
    Column::Number("95th percentile"),
    Column::Number("stated"),
];

pub(super) fn section(study: &Study) -> String {
    let cells = rows(study).map(|row| {
        vec![
            row.family.name().to_owned(),
            row.solver.map_or("", Solver::name).to_owned(),
            or_dash(row.patches.map(|n| n.to_string())),
            or_dash(row.rays.map(|n| n.to_string())),
            plain(row.seconds),
            limited(row, percent(row.error.nrmse)),
            limited(row, percent(row.error.rel_rmse)),
            signed(row.error.bias),
            percent(row.error.p95),
            or_dash(row.stated_total().map(percent)),
        ]
    });
    format!(
        "<section class=\"long\">\n<h2 id=\"rows\" class=\"new-page\">All measurements</h2>\n{}\
         <p class=\"soft\">Bias and percentile over the mean of the reference. ≤: not resolved above the noise \
         of the reference.</p>\n</section>\n",
        table(&COLUMNS, cells)
    )
}
