//! What physics asks: closure, reciprocity, energy.

use super::{percent, plain};
use crate::report::checks::{Check, Energy};
use crate::report::family::Family;
use crate::report::html::{Column, table};
use crate::report::study::Study;

pub(super) fn section(study: &Study) -> String {
    let checks: Vec<(Family, &Check)> = study
        .families
        .iter()
        .filter_map(|result| Some((result.family, result.check.as_ref()?)))
        .collect();
    if checks.is_empty() {
        return "<p class=\"absent\">No method with a mesh was run.</p>\n".to_owned();
    }
    format!(
        "<h3>Form factors of the largest size</h3>\n{}<p class=\"soft\">Rows of a closed scene sum to 1; what is \
         missing in an open one has escaped. Reciprocity: max |A<sub>i</sub>F<sub>ij</sub> − \
         A<sub>j</sub>F<sub>ji</sub>| over the largest exchange.</p>\n<h3>Energy ledger</h3>\n{}\
         <p class=\"soft\">Sums of the three channels; shares of what is emitted or delivered directly. Emitted + \
         direct = absorbed + escaped + defect + residual: the defect is what form factors that are not \
         reciprocal make or lose, the residual what the iteration leaves, the imbalance rounding.</p>\n",
        factors(&checks),
        energy(&checks),
    )
}

fn factors(checks: &[(Family, &Check)]) -> String {
    let columns = [
        Column::Text("form factors × operator"),
        Column::Number("patches"),
        Column::Number("mean of row sums"),
        Column::Number("largest |row sum − 1|"),
        Column::Number("largest row sum above 1"),
        Column::Number("reciprocity defect"),
    ];
    let rows = checks.iter().filter_map(|(family, check)| {
        let factors = check.factors.as_ref()?;
        let reciprocity = factors.reciprocity_defect;
        Some(vec![
            family.title().to_owned(),
            check.patches.to_string(),
            format!("{:.6}", factors.mean_row_sum),
            plain(factors.closure_defect),
            plain(factors.closure_excess),
            reciprocity.map_or("pairs not stored".to_owned(), plain),
        ])
    });
    table(&columns, rows)
}

fn energy(checks: &[(Family, &Check)]) -> String {
    let columns = [
        Column::Text("method"),
        Column::Number("emitted, W"),
        Column::Number("direct, W"),
        Column::Number("absorbed"),
        Column::Number("escaped"),
        Column::Number("defect"),
        Column::Number("residual"),
        Column::Number("imbalance"),
    ];
    let rows = checks.iter().map(|(family, check)| {
        let energy: &Energy = &check.energy;
        let sum = |flux: [f64; 3]| flux.iter().sum::<f64>();
        let given = sum(energy.emitted) + sum(energy.direct);
        let share = |flux: [f64; 3]| signed_share(sum(flux) / given);
        vec![
            family.title().to_owned(),
            plain(sum(energy.emitted)),
            plain(sum(energy.direct)),
            share(energy.absorbed),
            share(energy.escaped),
            share(energy.defect),
            share(energy.residual),
            plain(energy.imbalance),
        ]
    });
    table(&columns, rows)
}

/// A share in per cent, with its sign where it is negative; a dash without light.
fn signed_share(share: f64) -> String {
    if !share.is_finite() {
        return "–".to_owned();
    }
    let sign = if share < 0.0 { "−" } else { "" };
    format!("{sign}{}", percent(share.abs()))
}
