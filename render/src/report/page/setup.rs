//! What was compared with what, and by whom.

use super::{percent, plain};
use crate::report::html::{Column, concat, escape, table};
use crate::report::palette::of_family;
use crate::report::plot;
use crate::report::reference::Source;
use crate::report::study::{FamilyResult, Quantity, Study};

pub(super) fn section(study: &Study) -> String {
    let facts = facts(study)
        .map(|(name, value)| format!("<tr><th scope=\"row\">{name}</th><td>{value}</td></tr>\n"));
    format!(
        "<table class=\"facts\">\n{}</table>\n<h3>Methods</h3>\n<p>Classical radiosity (the first four) is \
         solved by every solver at every size (conjugate gradient on the mean of an operator and its \
         transpose, where it is not reciprocal). Where a mesh is compared it is looked up as it is, one value a \
         patch, without interpolation. Times hold everything but reading the scene and building its ray \
         tree.</p>\n{}<p>Errors are taken over all receivers and channels: nRMSE = rms(x − x*)/mean(x*), and \
         relRMSE = √mean((x − x*)²/(x*² + (0.01 mean x*)²)), which the dark parts decide. A hollow mark is \
         an upper limit: an error that does not stand out of the noise of the reference.</p>\n",
        concat(facts),
        methods(study),
    )
}

fn facts(study: &Study) -> [(&'static str, String); 7] {
    let unit = match study.quantity {
        Quantity::Irradiance => "W/m²",
        Quantity::Radiance { .. } => "W/(m² sr)",
    };
    let machine = &study.machine;
    [
        ("Quantity", receivers(study)),
        ("Reference", source(study)),
        ("Its uncertainty", uncertainty(study)),
        (
            "Its mean",
            format!("{} {unit}", plain(study.reference.mean)),
        ),
        (
            "Scene",
            format!("{}, {} faces", escape(&study.scene), study.faces),
        ),
        (
            "Machine",
            format!(
                "{}, {} cores, {} threads used; {}",
                escape(&machine.processor),
                machine.cores,
                machine.threads,
                escape(&machine.system)
            ),
        ),
        (
            "Program",
            format!(
                "luxel {}, seed {}, {} s for everything",
                env!("CARGO_PKG_VERSION"),
                study.seed,
                plain(study.seconds.ceil())
            ),
        ),
    ]
}

fn receivers(study: &Study) -> String {
    match (study.quantity, study.receivers) {
        (Quantity::Irradiance, [all, on_surface]) if on_surface < all => format!(
            "Irradiance at {all} points; methods on a mesh are compared at the {on_surface} of them that lie \
             on a surface."
        ),
        (Quantity::Irradiance, [all, _]) => format!("Irradiance at {all} points."),
        (Quantity::Radiance { size: [w, h] }, _) => format!("Radiance of {w} × {h} pixels."),
    }
}

fn source(study: &Study) -> String {
    match &study.reference.source {
        Source::File { path } => format!("The file <code>{}</code>.", escape(path)),
        Source::Exact { radiance } => {
            let [r, g, b] = radiance.map(plain);
            format!(
                "The exact answer. The scene is a furnace: its surface is closed, and emits and reflects alike \
                 everywhere, so that L = L<sub>e</sub>/(1 − ρ) = ({r}, {g}, {b}) W/(m² sr) in every direction."
            )
        }
        Source::OwnBest { paths, seconds } => format!(
            "luxel’s own best: {paths} paths of the unbiased path tracer at each receiver, in {} s, with a \
             seed that no method shares.",
            plain(*seconds)
        ),
    }
}

fn uncertainty(study: &Study) -> String {
    let reference = &study.reference;
    match (reference.noise, &reference.source) {
        (_, Source::Exact { .. }) => "None.".to_owned(),
        (Some(noise), _) => format!(
            "Standard error {} of the mean at a receiver (root mean square), {} in the mean over all. \
             Its variance is subtracted from all squared errors.",
            percent(noise),
            percent(reference.mean_standard_error().unwrap_or(0.0) / reference.mean),
        ),
        (None, _) => "Unknown: the file states no standard errors, so that nothing can be subtracted. No error \
                      below the reference’s own can be seen."
            .to_owned(),
    }
}

fn methods(study: &Study) -> String {
    let columns = [
        Column::Text("method"),
        Column::Prose("what it does"),
        Column::Number("sizes"),
        Column::Prose("why it stopped"),
    ];
    let rows = study.families.iter().map(|result| {
        let (colour, mark) = of_family(result.family);
        let title = result.family.title();
        let key = plot::key(mark, colour, title);
        vec![
            format!("<span class=\"key\">{key}</span> {title}"),
            result.family.description().to_owned(),
            sizes(result).to_string(),
            escape(&result.stopped),
        ]
    });
    table(&columns, rows)
}

fn sizes(result: &FamilyResult) -> usize {
    let mut steps: Vec<u32> = result.rows.iter().map(|row| row.step).collect();
    steps.dedup();
    steps.len()
}
