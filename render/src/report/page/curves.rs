//! Error against cost.

use super::{NRMSE, REL_RMSE, SECONDS, chart, figure, line, or_dash, plain, series};
use crate::report::axis::{Axis, Spacing};
use crate::report::html::{Column, table};
use crate::report::study::{FamilyResult, Row, Study};

/// Errors whose price is listed.
const TARGETS: [(f64, &str); 5] = [
    (0.2, "20 %"),
    (0.1, "10 %"),
    (0.05, "5 %"),
    (0.02, "2 %"),
    (0.01, "1 %"),
];

const PATCHES: Axis = Axis {
    label: "patches",
    spacing: Spacing::Logarithmic,
    format: plain,
};
const RAYS: Axis = Axis {
    label: "rays (path tracer: paths)",
    spacing: Spacing::Logarithmic,
    format: plain,
};

/// Against seconds.
pub(super) fn time(study: &Study) -> String {
    let seconds = |row: &Row| Some(row.seconds);
    let nrmse = chart(
        "nRMSE against seconds",
        SECONDS,
        NRMSE,
        series(study, seconds, |row| Some(row.error.nrmse)),
    );
    let rel_rmse = chart(
        "relRMSE against seconds",
        SECONDS,
        REL_RMSE,
        series(study, seconds, |row| Some(row.error.rel_rmse)),
    );
    format!(
        "<p>Lower left is better. Classical methods are drawn with the fastest solver of each size; all \
         solvers are in the <a href=\"#rows\">table</a>.</p>\n<div class=\"pair\">\n{}{}</div>\n{}",
        figure(
            &nrmse,
            "Root mean squared error over the mean of the reference."
        ),
        figure(
            &rel_rmse,
            "Relative at every receiver: dark places count as much as bright ones."
        ),
        targets(study),
    )
}

/// Seconds in which each method came below some errors.
fn targets(study: &Study) -> String {
    let cell = |result: &FamilyResult, target: f64| {
        let seconds = line(result)
            .into_iter()
            .filter(|row| row.error.nrmse <= target)
            .map(|row| row.seconds)
            .min_by(f64::total_cmp);
        or_dash(seconds.map(plain))
    };
    let mut columns = vec![Column::Text("method")];
    columns.extend(TARGETS.map(|(_, title)| Column::Number(title)));
    let measured = study
        .families
        .iter()
        .filter(|result| !result.rows.is_empty());
    let rows = measured.map(|result| {
        let mut cells = vec![result.family.title().to_owned()];
        cells.extend(TARGETS.map(|(target, _)| cell(result, target)));
        cells
    });
    format!(
        "<h3>Seconds to an nRMSE of</h3>\n{}<p class=\"soft\">The first measured size at or below the target; \
         – where none came so far.</p>\n",
        table(&columns, rows)
    )
}

/// Against patches and rays.
pub(super) fn size(study: &Study) -> String {
    let error = |row: &Row| Some(row.error.nrmse);
    let patches = |row: &Row| row.patches.map(|n| n as f64);
    let rays = |row: &Row| row.rays.map(|n| n as f64);
    let by_patches = chart(
        "nRMSE against patches",
        PATCHES,
        NRMSE,
        series(study, patches, error),
    );
    let by_rays = chart(
        "nRMSE against rays",
        RAYS,
        NRMSE,
        series(study, rays, error),
    );
    format!(
        "<div class=\"pair\">\n{}{}</div>\n",
        figure(
            &by_patches,
            "Methods on a mesh. Where rays are cast, their number grows along with it."
        ),
        figure(
            &by_rays,
            "Methods that cast rays: those that leave patches and receivers, with those to lights, all \
             repetitions together. A path of the path tracer is several rays.",
        )
    )
}
