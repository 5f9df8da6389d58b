//! Charts as SVG, by plotters.
//!
//! Charts are drawn at twice the size they are shown at, because plotters rounds to whole pixels. Lines are
//! labelled at their ends, in the right margin; labels that would overlap are moved apart, with a thin
//! line to their mark.

use super::palette::Mark;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
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

/// How an axis maps values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Spacing {
    Linear,
    Logarithmic,
}

/// An axis.
#[derive(Clone, Copy)]
pub(super) struct Axis {
    pub(super) label: &'static str,
    pub(super) spacing: Spacing,
    pub(super) format: fn(f64) -> String,
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

/// A range of values on an axis.
#[derive(Clone, Copy, Debug)]
struct Span {
    low: f64,
    high: f64,
    spacing: Spacing,
    format: fn(f64) -> String,
}

impl Span {
    /// Covers the values, with a margin.
    fn over(values: impl Iterator<Item = f64>, axis: &Axis) -> Option<Self> {
        let is_shown = |v: &f64| v.is_finite() && (axis.spacing == Spacing::Linear || *v > 0.0);
        let (low, high) = values
            .filter(is_shown)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
                (low.min(v), high.max(v))
            });
        if low > high {
            return None;
        }
        let (low, high) = match axis.spacing {
            Spacing::Linear => {
                let margin = 0.04 * (high - low).max(1e-9 * high.abs()).max(f64::MIN_POSITIVE);
                (low - margin, high + margin)
            }
            Spacing::Logarithmic => (low / 1.35, high * 1.35),
        };
        Some(Self {
            low,
            high,
            spacing: axis.spacing,
            format: axis.format,
        })
    }

    /// Values with a grid line and a number.
    fn ticks(&self, most: usize) -> Vec<f64> {
        match self.spacing {
            Spacing::Linear => {
                let rough = (self.high - self.low) / most.max(2) as f64;
                let decade = 10_f64.powf(rough.log10().floor());
                let step = [1.0, 2.0, 5.0, 10.0]
                    .into_iter()
                    .map(|s| s * decade)
                    .find(|&s| s >= rough)
                    .unwrap_or(10.0 * decade);
                let first = (self.low / step).ceil() as i64;
                let last = (self.high / step).floor() as i64;
                (first..=last).map(|k| k as f64 * step).collect()
            }
            Spacing::Logarithmic => {
                let decades = (self.high / self.low).log10();
                let steps: &[f64] = if decades < 1.0 {
                    &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0]
                } else if decades < 3.0 {
                    &[1.0, 2.0, 5.0]
                } else {
                    &[1.0]
                };
                let skip = ((decades / most.max(2) as f64).ceil() as i32).max(1);
                let [first, last] = [self.low, self.high].map(|v| v.log10().floor() as i32);
                (first..=last)
                    .filter(|k| k.rem_euclid(skip) == 0)
                    .flat_map(|k| steps.iter().map(move |s| s * 10_f64.powi(k)))
                    .filter(|v| (self.low..=self.high).contains(v))
                    .collect()
            }
        }
    }
}

impl Ranged for Span {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let share = match self.spacing {
            Spacing::Linear => (value - self.low) / (self.high - self.low),
            Spacing::Logarithmic => {
                (value.max(f64::MIN_POSITIVE) / self.low).ln() / (self.high / self.low).ln()
            }
        };
        // Far outside is as good as a little outside, and fits an i32.
        let share = share.clamp(-10.0, 10.0);
        limit.0 + (share * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        self.ticks(hint.max_num_points().min(8))
    }

    fn range(&self) -> Range<f64> {
        self.low..self.high
    }
}

impl ValueFormatter<f64> for Span {
    fn format(value: &f64) -> String {
        value.to_string()
    }

    fn format_ext(&self, value: &f64) -> String {
        (self.format)(*value)
    }
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

/// A number with as many digits as it needs: 0.05, 200, 10⁶.
pub(super) fn plain(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = value.abs().log10().floor() as i32;
    if (-3..=4).contains(&exponent) {
        let digits = usize::try_from(1 - exponent).unwrap_or(0);
        let text = format!("{value:.digits$}");
        return if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text
        };
    }
    // Two digits, so that 9.96 becomes the next power and not ten times this one.
    let mantissa = (value / 10_f64.powi(exponent) * 10.0).round() / 10.0;
    let (mantissa, exponent) = if mantissa.abs() >= 10.0 {
        (mantissa / 10.0, exponent + 1)
    } else {
        (mantissa, exponent)
    };
    let power: String = exponent.to_string().chars().map(superscript).collect();
    if (mantissa - 1.0).abs() < 1e-6 {
        format!("10{power}")
    } else {
        format!("{}·10{power}", plain(mantissa))
    }
}

/// A ratio in per cent.
pub(super) fn percent(value: f64) -> String {
    format!("{} %", plain(100.0 * value))
}

fn superscript(character: char) -> char {
    match character {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '4' => '⁴',
        '5' => '⁵',
        '6' => '⁶',
        '7' => '⁷',
        '8' => '⁸',
        '9' => '⁹',
        _ => '⁰',
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOG: Axis = Axis {
        label: "seconds",
        spacing: Spacing::Logarithmic,
        format: plain,
    };

    #[test]
    fn numbers_have_the_digits_they_need() {
        for (value, expected) in [
            (0.0, "0"),
            (0.05, "0.05"),
            (1.5, "1.5"),
            (200.0, "200"),
            (1e6, "10⁶"),
            (2e-5, "2·10⁻⁵"),
            (9.98e-6, "10⁻⁵"),
            (1.04e6, "10⁶"),
        ] {
            assert_eq!(plain(value), expected);
        }
        assert_eq!(percent(0.015), "1.5 %");
    }

    #[test]
    fn ticks_of_logarithmic_axes_are_round() {
        let span = |values: [f64; 2]| Span::over(values.into_iter(), &LOG).expect("values");
        assert_eq!(span([0.2, 3.0]).ticks(8), [0.2, 0.5, 1.0, 2.0]);
        assert_eq!(span([1.0, 1e5]).ticks(8), [1.0, 10.0, 100.0, 1e3, 1e4, 1e5]);
        assert!(span([1e-14, 1.0]).ticks(6).len() <= 6);
        assert!(Span::over([0.0, -1.0].into_iter(), &LOG).is_none());
    }

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
