//! Axes of charts: the range that they cover, and round values to mark.

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use std::ops::Range;

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

/// A range of values on an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) spacing: Spacing,
    pub(super) format: fn(f64) -> String,
}

impl Span {
    /// Covers the values, with a margin.
    pub(super) fn over(values: impl Iterator<Item = f64>, axis: &Axis) -> Option<Self> {
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

#[cfg(test)]
pub(super) mod tests {
    use super::super::numbers::plain;
    use super::*;

    pub(in super::super) const LOG: Axis = Axis {
        label: "seconds",
        spacing: Spacing::Logarithmic,
        format: plain,
    };

    #[test]
    fn ticks_of_logarithmic_axes_are_round() {
        let span = |values: [f64; 2]| Span::over(values.into_iter(), &LOG).expect("values");
        assert_eq!(span([0.2, 3.0]).ticks(8), [0.2, 0.5, 1.0, 2.0]);
        assert_eq!(span([1.0, 1e5]).ticks(8), [1.0, 10.0, 100.0, 1e3, 1e4, 1e5]);
        assert!(span([1e-14, 1.0]).ticks(6).len() <= 6);
        assert!(Span::over([0.0, -1.0].into_iter(), &LOG).is_none());
    }
}
