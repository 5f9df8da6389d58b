//! The tables as Markdown.

use super::{fields, preparing, probing, rendering, scaling, transport};
use crate::accuracy::{largest, median};
use crate::picture::example;
use luxel::diff::Difference;
use luxel::report::machine::Machine;
use std::fmt::Write as _;

/// The document, every median of `runs` runs; `done` hears of finished parts.
///
/// # Panics
/// When a command fails.
pub fn document(runs: u64, done: &mut dyn FnMut(&str)) -> String {
    let machine = Machine::this();
    let mut text = format!(
        "# Benchmarks

Measured by `cargo run --release -p luxel-tests --bin benchmarks > BENCHMARKS.md` with luxel {} on {} ({} threads, {}). Medians of {runs}
runs with seeds of their own; reading the scene, the ray tree and the estimate of the error are included. Errors are true ones against
`tests/references/`, the noise of the reference subtracted unless said otherwise: nRMSE is the root mean square over the mean, relRMSE relative
at every point.

## `probe --error`, 1000 points

| scene | asked for | seconds | nRMSE, median and largest % | relRMSE % | stated % | peak MB |
|---|--:|--:|--:|--:|--:|--:|
",
        env!("CARGO_PKG_VERSION"),
        machine.processor,
        machine.threads,
        machine.system,
    );
    for (scene, percent) in probing::TARGETS {
        let probe = probing::probe(scene, percent, runs);
        let errors = || probe.runs.iter().map(|run| 100.0 * run.errors.nrmse);
        let last = probe.runs.last().expect("at least one run");
        row(
            &mut text,
            format_args!(
                "{scene} | {percent} % | {:.2} | {:.2} {:.2} | {:.1} | {:.2} | {}",
                probe.seconds,
                median(errors()),
                largest(errors()),
                100.0 * last.errors.rel_rmse,
                100.0 * last.stated,
                megabytes(probe.peak),
            ),
        );
        done(&format!("probe {scene} {percent}"));
    }
    text += "
## `probe --error 1%`, many points

Points lie on the faces at random, evenly by area; the first thousand are those of the table above, at which the true error is measured.

| scene | points | seconds | nRMSE % | stated there % | peak MB |
|---|--:|--:|--:|--:|--:|
";
    for (scene, points) in fields::FIELDS {
        let most = if points > 100_000 { 1 } else { 3 };
        let field = fields::field(scene, points, 1.0, runs.min(most));
        row(
            &mut text,
            format_args!(
                "{scene} | {points} | {:.2} | {:.2} | {:.2} | {}",
                field.seconds,
                100.0 * field.errors.nrmse,
                100.0 * field.stated,
                megabytes(field.peak)
            ),
        );
        done(&format!("field {scene} {points}"));
    }
    text += "
## `render --integrator gather --size 256x256 --error 2%`

Errors against path-traced pictures whose own noise, 1.0 % (cornell) and 1.3 % (office) of relRMSE, is included. Of the
corridor's dark end there is no such picture: what little light it gets has come around two corners, and solutions of many patches are needed to know it.

| scene | seconds | nRMSE % | relRMSE % | stated % | peak MB |
|---|--:|--:|--:|--:|--:|
";
    for (scene, reference) in rendering::SCENES {
        let picture = rendering::picture(scene, reference, 2.0, runs.min(3));
        let errors = picture.difference.map(|difference| {
            let Difference {
                nrmse, rel_rmse, ..
            } = difference;
            format!("{:.2} | {:.2}", 100.0 * nrmse, 100.0 * rel_rmse)
        });
        row(
            &mut text,
            format_args!(
                "{scene} | {:.2} | {} | {:.2} | {}",
                picture.seconds,
                errors.as_deref().unwrap_or("– | –"),
                100.0 * picture.stated,
                megabytes(picture.peak)
            ),
        );
        done(&format!("render {scene}"));
    }
    text += &large_scenes(runs, done);
    text += &transports(done);
    text += "
## One thread against two

| work in the office | seconds | ratio |
|---|--:|--:|
";
    for (what, [one, two]) in scaling::office(runs.min(3)) {
        row(
            &mut text,
            format_args!("{what} | {one:.2} {two:.2} | {:.2}", one / two),
        );
    }
    done("scaling");
    text
}

fn large_scenes(runs: u64, done: &mut dyn FnMut(&str)) -> String {
    let mut text = String::from(
        "
## Large scenes

Halls of boxes in OBJ files, read whole; then the ray tree is built.

| triangles | file MB | seconds of reading | MB/s | seconds of building | peak MB |
|--:|--:|--:|--:|--:|--:|
",
    );
    for boxes in [8_000, 83_000] {
        let prepared = preparing::prepared(boxes, runs);
        let size = prepared.bytes as f64 / 1e6;
        row(
            &mut text,
            format_args!(
                "{} | {size:.0} | {:.2} | {:.0} | {:.2} | {}",
                prepared.triangles,
                prepared.reading,
                size / prepared.reading,
                prepared.building,
                megabytes(prepared.peak)
            ),
        );
    }
    done("large scenes");
    text
}

fn transports(done: &mut dyn FnMut(&str)) -> String {
    let mut text = String::from(
        "
## Form factors

All pairs of the patches of a closed cube with a box in it; the scene is in memory. The error is the stated one of a factor, root mean square over
mean.

| estimator | patches | seconds | largest defect of a row sum | error % |
|---|--:|--:|--:|--:|
",
    );
    for (name, factors) in transport::factors() {
        row(
            &mut text,
            format_args!(
                "{name} | {} | {:.2} | {:.1e} | {:.1}",
                factors.patches,
                factors.seconds,
                factors.closure,
                100.0 * factors.error
            ),
        );
    }
    done("form factors");
    text += "
Sparse rows of 512 rays each:

| scene | patches | seconds | peak MB |
|---|--:|--:|--:|
";
    for name in ["cornell", "office"] {
        let loaded = luxel_scenes::load(example(name)).expect("an example scene");
        let (patches, seconds, peak) = transport::rows(&loaded.scene);
        row(
            &mut text,
            format_args!("{name} | {patches} | {seconds:.2} | {}", megabytes(peak)),
        );
    }
    done("sparse rows");
    text
}

fn megabytes(bytes: Option<u64>) -> String {
    bytes.map_or("–".to_owned(), |bytes| {
        format!("{:.0}", bytes as f64 / 1e6)
    })
}

fn row(text: &mut String, cells: std::fmt::Arguments<'_>) {
    writeln!(text, "| {cells} |").expect("a string takes all");
}
