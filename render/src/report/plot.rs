//! Charts as SVG, by plotters.
//!
//! Charts are drawn at twice the size they are shown at, because plotters rounds to whole pixels. Lines are
//! labelled at their ends, in the right margin; labels that would overlap are moved apart, with a thin
//! line to their mark.

use super::axis::{Axis, Spacing, Span};
use super::palette::Mark;
use plotters::element::{Circle, PathElement, Polygon, Rectangle, Text};
use plotters::prelude::{
    ChartBuilder, DashedLineSeries, DrawingArea, DrawingAreaErrorKind, IntoDrawingArea, LineSeries,
    SVGBackend,
};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, IntoFont, RGBColor, ShapeStyle, TextStyle, WHITE};
use std::ops::Range;

/// Pixels drawn for each pixel shown.
const SCALE: i32 = 2;

/// plotters divides font sizes by this when it writes SVG.
const FONT_FACTOR: f64 = 1.24;

const GRID: RGBColor = RGBColor(225, 225, 225);
const AXIS: RGBColor = RGBColor(90, 90, 90);
const INK: RGBColor = RGBColor(30, 30, 30);
const GUIDE: RGBColor = RGBColor(130, 130, 130);

type Root<'s> = DrawingArea<SVGBackend<'s>, plotters::coord::Shift>;
type DrawResult = Result<(), DrawingAreaErrorKind<std::io::Error>>;

/// A point of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Dot {
    pub(super) x: f64,
    pub(super) y: f64,
    /// Drawn hollow: an upper limit.
    pub(super) is_limit: bool,
}

/// A line with marks and a label.
#[derive(Clone, Debug)]
pub(super) struct Series {
    pub(super) label: String,
    pub(super) colour: RGBColor,
    pub(super) mark: Option<Mark>,
    pub(super) dots: Vec<Dot>,
    pub(super) is_dashed: bool,
}

/// A chart of lines.
pub(super) struct Chart {
    /// Read by those who cannot see it.
    pub(super) description: String,
    pub(super) size: [u32; 2],
    pub(super) x: Axis,
    pub(super) y: Axis,
    pub(super) series: Vec<Series>,
    /// Draws the line y = x.
    pub(super) has_diagonal: bool,
}

/// Text of `size` shown pixels.
fn text(size: f64, colour: RGBColor, anchor: Pos) -> TextStyle<'static> {
    ("sans-serif", size * FONT_FACTOR * f64::from(SCALE))
        .into_font()
        .color(&colour)
        .pos(anchor)
}

/// An SVG element that shows `chart`, or a sentence when there is nothing to show.
pub(super) fn draw(chart: &Chart) -> String {
    let dots = || chart.series.iter().flat_map(|series| &series.dots);
    let xs = dots().map(|dot| dot.x);
    let ys = dots().map(|dot| dot.y);
    let (Some(mut x), Some(mut y)) = (Span::over(xs, &chart.x), Span::over(ys, &chart.y)) else {
        return "<p class=\"absent\">Nothing to show.</p>".to_owned();
    };
    if chart.has_diagonal {
        x.low = x.low.min(y.low);
        x.high = x.high.max(y.high);
        y = Span {
            format: y.format,
            ..x
        };
    }
    svg(chart.size, &chart.description, |root| {
        draw_lines(root, chart, x, y)
    })
}

/// An SVG element that `draw` fills.
fn svg(size: [u32; 2], description: &str, draw: impl FnOnce(&Root<'_>) -> DrawResult) -> String {
    let mut buffer = String::new();
    let [width, height] = size.map(|side| side * SCALE as u32);
    let drawn = {
        let root = SVGBackend::with_string(&mut buffer, (width, height)).into_drawing_area();
        draw(&root).and_then(|()| root.present())
    };
    if drawn.is_err() {
        return "<p class=\"absent\">The chart could not be drawn.</p>".to_owned();
    }
    let label = super::html::escape(description);
    let opening = format!("<svg role=\"img\" aria-label=\"{label}\" width=\"{width}\"");
    let sized = format!("<svg width=\"{width}\"");
    // Shown at its own size; the page scales it down where there is less room.
    buffer.replacen(&sized, &opening, 1).replacen(
        &format!("width=\"{width}\" height=\"{height}\""),
        &{
            let [width, height] = size;
            format!("width=\"{width}\" height=\"{height}\"")
        },
        1,
    )
}

fn draw_lines(root: &Root<'_>, chart: &Chart, x: Span, y: Span) -> DrawResult {
    let label_width = chart
        .series
        .iter()
        .map(|series| i32::try_from(series.label.chars().count()).unwrap_or(0))
        .max()
        .unwrap_or(0)
        * 7;
    root.fill(&WHITE)?;
    let mut context = ChartBuilder::on(root)
        .margin_top(10 * SCALE)
        .margin_bottom(2 * SCALE)
        .margin_left(2 * SCALE)
        .margin_right((label_width + 24) * SCALE)
        .x_label_area_size(38 * SCALE)
        .y_label_area_size(58 * SCALE)
        .build_cartesian_2d(x, y)?;
    context
        .configure_mesh()
        .bold_line_style(GRID.stroke_width(SCALE as u32))
        .light_line_style(WHITE.mix(0.0))
        .axis_style(AXIS.stroke_width(SCALE as u32))
        .label_style(text(11.5, INK, Pos::new(HPos::Left, VPos::Top)))
        .axis_desc_style(text(12.5, INK, Pos::new(HPos::Left, VPos::Top)))
        .x_desc(chart.x.label)
        .y_desc(chart.y.label)
        .draw()?;
    if chart.has_diagonal {
        let ends = [(x.low, x.low), (x.high, x.high)];
        context.draw_series(DashedLineSeries::new(
            ends,
            6 * SCALE as u32,
            5 * SCALE as u32,
            GUIDE.stroke_width(SCALE as u32),
        ))?;
    }
    let mut labels = Vec::new();
    for series in &chart.series {
        let line: Vec<(f64, f64)> = series
            .dots
            .iter()
            .filter(|dot| dot.x.is_finite() && dot.y.is_finite())
            .filter(|dot| y.spacing == Spacing::Linear || dot.y > 0.0)
            .filter(|dot| x.spacing == Spacing::Linear || dot.x > 0.0)
            .map(|dot| (dot.x, dot.y))
            .collect();
        let style = series.colour.stroke_width(2 * SCALE as u32 - 1);
        if series.is_dashed {
            context.draw_series(DashedLineSeries::new(
                line.iter().copied(),
                5 * SCALE as u32,
                4 * SCALE as u32,
                style,
            ))?;
        } else if !chart.has_diagonal {
            context.draw_series(LineSeries::new(line.iter().copied(), style))?;
        }
        let area = context.plotting_area();
        if let Some(mark) = series.mark {
            for dot in &series.dots {
                if dot.y.is_finite() && dot.y > 0.0 {
                    let at = area.map_coordinate(&(dot.x, dot.y));
                    draw_mark(root, mark, at, series.colour, dot.is_limit)?;
                }
            }
        }
        if let Some(end) = line.last().filter(|_| !series.label.is_empty()) {
            labels.push((area.map_coordinate(end), series));
        }
    }
    let right = context.plotting_area().get_x_axis_pixel_range().end;
    let vertical = context.plotting_area().get_y_axis_pixel_range();
    draw_labels(root, labels, right, vertical)
}

/// Writes the labels in the right margin, apart from each other.
fn draw_labels(
    root: &Root<'_>,
    mut labels: Vec<((i32, i32), &Series)>,
    right: i32,
    vertical: Range<i32>,
) -> DrawResult {
    const LINE: i32 = 15 * SCALE;
    labels.sort_by_key(|((_, y), _)| *y);
    let mut places: Vec<i32> = labels.iter().map(|((_, y), _)| *y).collect();
    for i in 1..places.len() {
        places[i] = places[i].max(places[i - 1] + LINE);
    }
    // Pushed up again from the bottom, as far as needed.
    let mut lowest = vertical.end.max(vertical.start);
    for place in places.iter_mut().rev() {
        *place = (*place).min(lowest);
        lowest = *place - LINE;
    }
    for (((x, y), series), place) in labels.into_iter().zip(places) {
        let start = right + 16 * SCALE;
        let leader = vec![
            (x + 5 * SCALE, y),
            (right + 4 * SCALE, place),
            (start - 2 * SCALE, place),
        ];
        let thin = series.colour.mix(0.45).stroke_width(SCALE as u32 / 2);
        root.draw(&PathElement::new(leader, thin))?;
        let style = text(12.0, series.colour, Pos::new(HPos::Left, VPos::Center));
        root.draw(&Text::new(series.label.clone(), (start, place), style))?;
    }
    Ok(())
}

fn draw_mark(
    root: &Root<'_>,
    mark: Mark,
    (x, y): (i32, i32),
    colour: RGBColor,
    is_hollow: bool,
) -> DrawResult {
    const R: i32 = 4 * SCALE;
    let outline = colour.stroke_width(2 * SCALE as u32 - 1);
    let line = |points: Vec<(i32, i32)>| PathElement::new(points, outline);
    let corners = match mark {
        Mark::Circle => {
            let inner = ShapeStyle::from(&if is_hollow { WHITE } else { colour }).filled();
            root.draw(&Circle::new((x, y), R, inner))?;
            return root.draw(&Circle::new((x, y), R, outline));
        }
        Mark::Cross => {
            root.draw(&line(vec![(x - R, y - R), (x + R, y + R)]))?;
            return root.draw(&line(vec![(x - R, y + R), (x + R, y - R)]));
        }
        Mark::Plus => {
            root.draw(&line(vec![(x - R - 1, y), (x + R + 1, y)]))?;
            return root.draw(&line(vec![(x, y - R - 1), (x, y + R + 1)]));
        }
        Mark::Square => vec![
            (x - R, y - R),
            (x + R, y - R),
            (x + R, y + R),
            (x - R, y + R),
        ],
        Mark::Diamond => {
            let r = R + SCALE;
            vec![(x - r, y), (x, y - r), (x + r, y), (x, y + r)]
        }
        Mark::TriangleUp => vec![(x - R, y + R), (x, y - R - 1), (x + R, y + R)],
        Mark::TriangleDown => vec![(x - R, y - R), (x, y + R + 1), (x + R, y - R)],
    };
    let inner = if is_hollow { WHITE } else { colour };
    root.draw(&Polygon::new(corners.clone(), inner.filled()))?;
    let closed: Vec<_> = corners
        .iter()
        .copied()
        .chain(corners.first().copied())
        .collect();
    root.draw(&line(closed))
}

/// A mark with a bit of line, for a legend.
pub(super) fn key(mark: Mark, colour: RGBColor, description: &str) -> String {
    svg([34, 14], description, |root| {
        let middle = 7 * SCALE;
        let style = colour.stroke_width(2 * SCALE as u32 - 1);
        root.draw(&PathElement::new(
            vec![(0, middle), (34 * SCALE, middle)],
            style,
        ))?;
        draw_mark(root, mark, (17 * SCALE, middle), colour, false)
    })
}

/// A bar of parts that add up to 1, with a label each side.
pub(super) struct Bar {
    pub(super) label: String,
    pub(super) parts: Vec<(RGBColor, f64)>,
    pub(super) note: String,
}

/// Stacked horizontal bars, with room for labels on the left and notes on the right.
pub(super) fn bars(bars: &[Bar], description: &str, margins: [u32; 2]) -> String {
    const WIDTH: u32 = 460;
    const LINE: u32 = 24;
    let [label_width, note_width] = margins;
    let size = [
        label_width + WIDTH + note_width,
        LINE * bars.len() as u32 + 4,
    ];
    svg(size, description, |root| {
        for (index, bar) in bars.iter().enumerate() {
            let top = (index as u32 * LINE + 4).cast_signed() * SCALE;
            let middle = top + 9 * SCALE;
            let style = text(12.5, INK, Pos::new(HPos::Right, VPos::Center));
            let left = label_width.cast_signed() * SCALE;
            root.draw(&Text::new(
                bar.label.clone(),
                (left - 8 * SCALE, middle),
                style,
            ))?;
            let mut start = 0.0;
            for &(colour, share) in &bar.parts {
                let at = |share: f64| {
                    left + (share * f64::from(WIDTH.cast_signed() * SCALE)).round() as i32
                };
                let ends = [(at(start), top), (at(start + share), top + 18 * SCALE)];
                root.draw(&Rectangle::new(ends, colour.filled()))?;
                start += share;
            }
            let note = left + (WIDTH.cast_signed() + 8) * SCALE;
            let style = text(12.0, INK, Pos::new(HPos::Left, VPos::Center));
            root.draw(&Text::new(bar.note.clone(), (note, middle), style))?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::super::axis::tests::LOG;
    use super::*;

    #[test]
    fn a_chart_is_svg_with_escaped_text() {
        let dot = |x, y| Dot {
            x,
            y,
            is_limit: false,
        };
        let chart = Chart {
            description: "a \"chart\"".into(),
            size: [400, 300],
            x: LOG,
            y: LOG,
            series: vec![Series {
                label: "<b>".into(),
                colour: INK,
                mark: Some(Mark::Diamond),
                dots: vec![dot(1.0, 2.0), dot(10.0, 0.5)],
                is_dashed: false,
            }],
            has_diagonal: false,
        };
        let svg = draw(&chart);
        assert!(
            svg.starts_with("<svg role=\"img\" aria-label=\"a &quot;chart&quot;\" width=\"400\"")
        );
        assert!(svg.contains("&lt;b&gt;") && !svg.contains("<b>"));
        let empty = Chart {
            series: Vec::new(),
            ..chart
        };
        assert!(draw(&empty).contains("Nothing to show"));
    }
}
