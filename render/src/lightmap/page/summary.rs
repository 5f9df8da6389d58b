//! What a bake says of itself, as folded tables beside the picture.

use crate::lightmap::manifest::{Layer, Manifest, Placed};
use crate::lightmap::target::Quantity;
use crate::report::html::{concat, escape};
use clap::ValueEnum;

/// Objects that are listed: more make the page heavy, and nobody reads them.
const MOST_OBJECTS: usize = 500;

/// A line below the name of the scene.
pub(super) fn subtitle(manifest: &Manifest) -> String {
    let pages = manifest.lightmap.pages.len();
    format!(
        "{}, {} lit texels on {pages} page{}, ±\u{a0}{}",
        escape(light(&manifest.lightmap.include)),
        manifest.atlas.lit,
        if pages == 1 { "" } else { "s" },
        percent(manifest.lightmap.error.total)
    )
}

/// All tables.
pub(super) fn summary(manifest: &Manifest) -> String {
    let parts = [
        section("Error", true, &errors(manifest)),
        section("Texels", true, &texels(manifest)),
        section("Light", false, &units(manifest)),
        section("Energy", false, &energy(manifest)),
        section("Objects", false, &objects(&manifest.objects)),
    ];
    concat(parts)
}

fn section(title: &str, is_open: bool, body: &str) -> String {
    let open = if is_open { " open" } else { "" };
    format!("<details{open}>\n<summary>{title}</summary>\n{body}</details>\n")
}

/// Names with what they are; both are HTML already.
fn facts<const N: usize>(rows: [(&str, String); N]) -> String {
    let rows = rows
        .map(|(name, value)| format!("<tr><th scope=\"row\">{name}</th><td>{value}</td></tr>\n"));
    format!(
        "<div class=\"wide\"><table>\n{}</table></div>\n",
        concat(rows)
    )
}

fn errors(manifest: &Manifest) -> String {
    let error = manifest.lightmap.error;
    let rows = [
        ("at the points of texels", percent(error.luxels)),
        ("left by filtering between them", percent(error.filtering)),
        ("both", percent(error.total)),
    ];
    format!(
        "{}<p>One standard deviation, root mean square over all lit texels, relative to their mean.</p>\n",
        facts(rows)
    )
}

fn texels(manifest: &Manifest) -> String {
    let atlas = manifest.atlas;
    let of_surfaces = (atlas.lit + atlas.buried).max(1) as f64;
    let size = manifest.lightmap.pages.first().map_or_else(
        || "none".to_owned(),
        |page| {
            format!(
                "{} of {} × {}",
                manifest.lightmap.pages.len(),
                page.width,
                page.height
            )
        },
    );
    facts([
        ("pages", size),
        ("texels a metre", figure(atlas.texels_per_metre)),
        ("covered by surfaces", percent(atlas.utilisation)),
        ("charts", atlas.charts.to_string()),
        ("texels of padding", atlas.padding.to_string()),
        ("lit", atlas.lit.to_string()),
        (
            "buried",
            format!(
                "{} ({})",
                atlas.buried,
                percent(atlas.buried as f64 / of_surfaces)
            ),
        ),
    ])
}

fn units(manifest: &Manifest) -> String {
    let units = &manifest.units;
    let unit = escape(units.unit.replace("m2", "m²"));
    let texel = match units.quantity {
        Quantity::Irradiance => format!("irradiance E, {unit}"),
        Quantity::WhiteRadiance => format!("E / π, E in {unit}"),
    };
    facts([
        ("included", escape(light(&manifest.lightmap.include))),
        ("a texel holds", texel),
        ("colours", escape(&units.colour_space)),
        ("files", files(&manifest.lightmap)),
        ("made for", name(&units.target)),
        ("exposure", figure(manifest.exposure)),
        ("patches", manifest.lightmap.patches.to_string()),
        ("seed", manifest.seed.to_string()),
        ("program", escape(&manifest.software)),
    ])
}

/// The kind of the maps' files, and the most that it loses of a page.
fn files(lightmap: &Layer) -> String {
    let encodings = lightmap.pages.iter().map(|page| &page.encoding);
    let loss = encodings.clone().map(|own| own.loss).fold(0.0, f64::max);
    let format = encodings.map(|own| name(&own.format)).next();
    format!(
        "{}, which changes {}",
        format.unwrap_or_default(),
        percent(loss)
    )
}

fn energy(manifest: &Manifest) -> String {
    let Some(energy) = manifest.lightmap.energy else {
        return "<p>Direct light alone has no account.</p>\n".into();
    };
    let unit = if manifest.units.unit == "lx" {
        "lm"
    } else {
        "W"
    };
    let row = |name: &str, flux: [f64; 3]| {
        let cells = flux.map(|channel| format!("<td>{}</td>", figure(channel)));
        format!("<tr><th scope=\"row\">{name}</th>{}</tr>\n", concat(cells))
    };
    let rows = [
        row("emitted", energy.emitted),
        row("absorbed", energy.absorbed),
        row("escaped", energy.escaped),
        row("residual", energy.residual),
    ];
    format!(
        "<div class=\"wide\"><table>\n<tr><th scope=\"col\">{unit}</th><th scope=\"col\">red</th><th scope=\"col\">green</th><th scope=\"col\">blue</th></tr>\n{}</table></div>\n",
        concat(rows)
    )
}

fn objects(objects: &[Placed]) -> String {
    let rows = objects.iter().take(MOST_OBJECTS).map(|object| {
        format!(
            "<tr><td>{}</td><td>{}</td><td>{}</td></tr>\n",
            escape(&object.name),
            figure(object.area),
            figure(object.texels_per_metre)
        )
    });
    let rest = objects.len().saturating_sub(MOST_OBJECTS);
    let more = if rest > 0 {
        format!("<p>and {rest} more, in manifest.json</p>\n")
    } else {
        String::new()
    };
    format!(
        "<div class=\"wide\"><table class=\"objects\">\n<tr><th scope=\"col\">name</th><th scope=\"col\">m²</th><th scope=\"col\">texels a metre</th></tr>\n{}</table></div>\n{more}",
        concat(rows)
    )
}

/// Which light, in words.
fn light(include: &str) -> &str {
    match include {
        "all" => "all light",
        "direct" => "direct light",
        "indirect" => "indirect light",
        other => other,
    }
}

/// A value as the command line calls it.
fn name(value: &impl ValueEnum) -> String {
    value
        .to_possible_value()
        .map(|value| value.get_name().to_owned())
        .unwrap_or_default()
}

fn percent(share: f64) -> String {
    format!("{}\u{a0}%", figure(100.0 * share))
}

/// Three significant digits.
fn figure(value: f64) -> String {
    let size = value.abs();
    if !value.is_finite() {
        "unknown".to_owned()
    } else if value == 0.0 {
        "0".to_owned()
    } else if !(1e-3..1e6).contains(&size) {
        format!("{value:.2e}")
    } else {
        let decimals = (2 - size.log10().floor() as i32).max(0) as usize;
        format!("{value:.decimals$}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_three_digits() {
        let written = [0.0, 0.012_345, 1.0, 167.57, 53_433.0, 2.5e-7, f64::NAN].map(figure);
        assert_eq!(
            written,
            ["0", "0.0123", "1.00", "168", "53433", "2.50e-7", "unknown"]
        );
    }
}
