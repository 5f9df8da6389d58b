//! Observed orders of convergence and extrapolates.

use super::{or_dash, percent, signed};
use crate::report::html::{Column, table};
use crate::report::order::NotAsymptotic;
use crate::report::study::Study;
use crate::report::table::{Convergence, Variable, convergence};

const COLUMNS: [Column; 7] = [
    Column::Text("method"),
    Column::Number("order of nRMSE"),
    Column::Text("in"),
    Column::Number("mean at the largest size, from reference"),
    Column::Number("order of the mean"),
    Column::Number("extrapolated mean, from reference"),
    Column::Number("its uncertainty"),
];

pub(super) fn section(study: &Study) -> String {
    let reference = &study.reference;
    let rows = study.families.iter().filter_map(convergence);
    let rows = rows.map(|found| row(&found, reference.mean));
    let own = match reference.mean_standard_error() {
        Some(error) if error > 0.0 => format!(
            " The mean of the reference itself is uncertain by {} (one standard error).",
            percent(error / reference.mean)
        ),
        _ => String::new(),
    };
    format!(
        "<p>The observed order p of nRMSE ∝ h<sup>p</sup>, h = n<sup>−1/2</sup>, or of nRMSE ∝ \
         rays<sup>−p</sup>, fitted to all sizes above the noise of the reference. One value a patch gives \
         p = 1 where light is smooth and less at shadow boundaries; independent samples give ½, evenly \
         spread ones more.</p>\n<p>Richardson’s extrapolate is of the mean over all receivers, from the last \
         three meshes; its uncertainty is the grid convergence index. It is given only where the three are in \
         the asymptotic range.{own}</p>\n{}",
        table(&COLUMNS, rows)
    )
}

fn row(found: &Convergence, reference: f64) -> Vec<String> {
    let order = found.order.map(|fit| {
        let error = fit.standard_error;
        let error = error.map_or(String::new(), |error| format!(" ± {error:.2}"));
        format!("{:.2}{error}", fit.order)
    });
    let variable = match found.variable {
        Variable::MeshSize => "mesh size h",
        Variable::Samples => "1 / rays",
    };
    let from_reference = |mean: f64| signed(mean / reference - 1.0);
    let [order_of_mean, extrapolated, uncertainty] = match &found.richardson {
        Ok(r) => [
            format!("{:.2}", r.order),
            from_reference(r.extrapolated),
            percent(r.uncertainty / reference),
        ],
        Err(reason) => [or_dash(None), or_dash(None), why_not(*reason).to_owned()],
    };
    vec![
        found.family.title().to_owned(),
        or_dash(order),
        variable.to_owned(),
        from_reference(found.finest_mean),
        order_of_mean,
        extrapolated,
        uncertainty,
    ]
}

fn why_not(reason: NotAsymptotic) -> &'static str {
    match reason {
        NotAsymptotic::NoMesh => "no mesh to refine",
        NotAsymptotic::TooFew => "fewer than three sizes",
        NotAsymptotic::Oscillating => "the last three oscillate",
        NotAsymptotic::Diverging => "the differences grow",
        NotAsymptotic::Order => "no credible order",
    }
}
