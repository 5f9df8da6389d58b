//! The report as one HTML page that needs nothing else: styles, charts and pictures are in it.
//!
//! Every name that comes from a file is escaped. The order is that of questions: what was compared with
//! what; which method is best in a given time; how methods converge; whether they know their own error;
//! what it is made of; solvers; physics; where in the picture; all numbers.

mod curves;
mod honesty;
mod measurements;
mod orders;
mod physics;
mod pictures;
mod setup;
mod solvers;

use super::axis::{Axis, Spacing};
use super::html::{concat, escape};
use super::numbers::{percent, plain};
use super::palette::of_family;
use super::plot::{self, Chart, Dot, Series};
use super::study::{FamilyResult, Row, Study};
use super::table;
use std::fmt::Write as _;

/// Style sheet of the page.
const STYLE: &str = include_str!("page.css");

/// Sections: anchor and title.
const SECTIONS: [(&str, &str); 9] = [
    ("setup", "What was compared"),
    ("time", "Error against time"),
    ("size", "Error against patches and rays"),
    ("order", "Orders of convergence"),
    ("honesty", "Stated against true error"),
    ("parts", "What the error is made of"),
    ("solvers", "Solvers"),
    ("physics", "Closure, reciprocity, energy"),
    ("pictures", "Where the error is"),
];

/// Size of a chart that shares a line with another, in pixels.
const HALF: [u32; 2] = [540, 380];

/// Axes that several charts share.
const SECONDS: Axis = Axis {
    label: "seconds",
    spacing: Spacing::Logarithmic,
    format: plain,
};
const NRMSE: Axis = Axis {
    label: "nRMSE",
    spacing: Spacing::Logarithmic,
    format: percent,
};
const REL_RMSE: Axis = Axis {
    label: "relRMSE",
    spacing: Spacing::Logarithmic,
    format: percent,
};

/// The page of a study.
pub fn render(study: &Study) -> String {
    let title = format!("Convergence: {}", study.scene);
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\">\n<meta name=\"generator\" content=\"luxel {}\">\n\
         <title>{}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n",
        env!("CARGO_PKG_VERSION"),
        escape(&title),
    );
    page.push_str(&header(study));
    let bodies = [
        setup::section(study),
        curves::time(study),
        curves::size(study),
        orders::section(study),
        honesty::section(study),
        honesty::parts(study),
        solvers::section(study),
        physics::section(study),
        pictures::section(study),
    ];
    for ((anchor, title), body) in SECTIONS.iter().zip(bodies) {
        let _ = write!(
            page,
            "<section>\n<h2 id=\"{anchor}\">{title}</h2>\n{body}</section>\n"
        );
    }
    page.push_str(&measurements::section(study));
    page.push_str("</body>\n</html>\n");
    page
}

/// Title, result in a sentence, contents.
fn header(study: &Study) -> String {
    let links = SECTIONS
        .iter()
        .chain(&[("rows", "All measurements")])
        .map(|(anchor, title)| format!("<a href=\"#{anchor}\">{title}</a>\n"));
    let links = concat(links);
    let best = table::rows(study)
        .filter(|row| row.error.nrmse.is_finite())
        .min_by(|a, b| a.error.nrmse.total_cmp(&b.error.nrmse));
    let lead = best.map_or(String::new(), |row| {
        let limit = if row.error.is_resolved { "" } else { "at most " };
        format!(
            "<p class=\"lead\">Nearest to the reference: {}, nRMSE {limit}{}, relRMSE {}, in {} s.</p>\n",
            row.family.title(),
            percent(row.error.nrmse),
            percent(row.error.rel_rmse),
            plain(row.seconds),
        )
    });
    format!(
        "<header>\n<h1>Convergence of luxel on <em>{}</em></h1>\n{lead}<nav>{links}</nav>\n</header>\n",
        escape(&study.scene)
    )
}

/// The rows of a family that a line is drawn through: at each size the fastest solver.
fn line(result: &FamilyResult) -> Vec<&Row> {
    let mut rows: Vec<&Row> = Vec::new();
    for row in &result.rows {
        match rows.last_mut() {
            Some(last) if last.step == row.step => {
                if row.seconds < last.seconds {
                    *last = row;
                }
            }
            _ => rows.push(row),
        }
    }
    rows
}

/// One line for each family that has what is asked for.
fn series(
    study: &Study,
    x: impl Fn(&Row) -> Option<f64>,
    y: impl Fn(&Row) -> Option<f64>,
) -> Vec<Series> {
    study
        .families
        .iter()
        .filter_map(|result| {
            let (colour, mark) = of_family(result.family);
            let dots: Vec<Dot> = line(result)
                .into_iter()
                .filter_map(|row| {
                    Some(Dot {
                        x: x(row)?,
                        y: y(row)?,
                        is_limit: !row.error.is_resolved,
                    })
                })
                .collect();
            (!dots.is_empty()).then(|| Series {
                label: result.family.name().to_owned(),
                colour,
                mark: Some(mark),
                dots,
                is_dashed: false,
            })
        })
        .collect()
}

fn chart(description: &str, x: Axis, y: Axis, series: Vec<Series>) -> Chart {
    Chart {
        description: description.to_owned(),
        size: HALF,
        x,
        y,
        series,
        has_diagonal: false,
    }
}

fn figure(chart: &Chart, caption: &str) -> String {
    format!(
        "<figure>{}<figcaption>{caption}</figcaption></figure>\n",
        plot::draw(chart)
    )
}

/// A number that is an upper limit where the error is not resolved.
fn limited(row: &Row, text: String) -> String {
    if row.error.is_resolved {
        text
    } else {
        format!("≤ {text}")
    }
}

/// What a row spent, in a word.
fn spent(row: &Row) -> String {
    match (row.patches, row.rays) {
        (Some(patches), _) => format!("{patches} patches"),
        (None, Some(paths)) => format!("{} paths", plain(paths as f64)),
        (None, None) => String::new(),
    }
}

/// A signed ratio in per cent, with two digits after the point.
fn signed(ratio: f64) -> String {
    let text = format!("{:.2}", 100.0 * ratio.abs());
    let sign = match (ratio < 0.0, text.as_str()) {
        (_, "0.00") => "",
        (true, _) => "−",
        (false, _) => "+",
    };
    format!("{sign}{text} %")
}

/// A number, or a dash where there is none.
fn or_dash(text: Option<String>) -> String {
    text.unwrap_or_else(|| "–".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_are_typographic_and_zero_has_none() {
        assert_eq!(signed(-0.0125), "−1.25 %");
        assert_eq!(signed(0.5), "+50.00 %");
        assert_eq!(signed(-0.000_01), "0.00 %");
    }
}
