//! Errors of values against a reference that is itself uncertain.
//!
//! Over all receivers and channels, with d = x − x* and v* the variance of the reference:
//!
//! - nRMSE = √mean(d² − v*) / mean(x*);
//! - relRMSE = √mean((d² − v*) / (x*² + (0.01 mean x*)²)), which the dark parts decide;
//! - bias = mean(d) / mean(x*); p95 = 95th percentile of |d| over mean(x*), by nearest rank.
//!
//! The mean of d² is the squared error plus v*, so that subtracting v* leaves an unbiased estimate of the
//! mean squared error. It is itself uncertain, because the receivers are few and the reference is noisy:
//! its standard error is taken from the scatter of d² − v* over receivers (channels of one receiver go
//! together). An error that is not two of these standard errors above zero is not resolved; what is
//! given then is the upper limit. The percentile has nothing subtracted and is an upper limit, too.
//!
//! Source: luxel's definition of error; the relative form is that of F. Rousselle, C. Knaus, M. Zwicker,
//! "Adaptive sampling and reconstruction using greedy error minimization", ACM TOG 30(6), 2011. Valid
//! when the reference's errors are independent of the values'. Cost: one sort.

use crate::points::Estimate;
use luxel_scenes::Rgb;
use serde::Serialize;

/// How far values are from a reference; all numbers are ratios.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Errors {
    /// Root mean squared error over the mean of the reference; the upper limit where it is not
    /// resolved.
    pub nrmse: f64,
    /// Root mean squared relative error; the upper limit where it is not resolved.
    pub rel_rmse: f64,
    /// Mean signed error over the mean of the reference.
    pub bias: f64,
    /// 95th percentile of the absolute error over the mean of the reference.
    pub p95: f64,
    /// True where the error stands out of the noise of the reference.
    pub is_resolved: bool,
}

/// A mean squared error with its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
struct MeanSquare {
    mean: f64,
    standard_error: f64,
}

impl MeanSquare {
    /// Of the values of single receivers.
    fn of(values: &[f64]) -> Self {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let scatter: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
        Self {
            mean,
            standard_error: (scatter / (count - 1.0).max(1.0) / count).sqrt(),
        }
    }

    fn is_resolved(self) -> bool {
        self.mean > 2.0 * self.standard_error
    }

    /// The root, or its upper limit when it is not resolved.
    fn root(self) -> f64 {
        if self.is_resolved() {
            self.mean.sqrt()
        } else {
            (self.mean.max(0.0) + 2.0 * self.standard_error).sqrt()
        }
    }
}

impl Errors {
    /// Compares `values` with `reference`, over the receivers where both are there; `None` when there
    /// is no such receiver or the reference is black.
    ///
    /// # Panics
    /// When the two differ in length.
    pub fn new(values: &[Option<Rgb>], reference: &[Estimate]) -> Option<Self> {
        assert_eq!(values.len(), reference.len(), "one reference per value");
        let pairs: Vec<(Rgb, &Estimate)> = values
            .iter()
            .zip(reference)
            .filter_map(|(value, reference)| Some(((*value)?, reference)))
            .collect();
        let count = pairs.len() as f64;
        let mean = mean_of_channels(pairs.iter().map(|(_, reference)| reference.value))?;
        if mean <= 0.0 {
            return None;
        }
        let floor = Rgb::splat((0.01 * mean).powi(2));
        let mut absolute = Vec::with_capacity(pairs.len());
        let mut relative = Vec::with_capacity(pairs.len());
        let mut distances = Vec::with_capacity(3 * pairs.len());
        let mut bias = 0.0;
        for (value, reference) in pairs {
            let d = value - reference.value;
            let square = d * d - reference.standard_error * reference.standard_error;
            let weight = reference.value * reference.value + floor;
            absolute.push(mean_channel(square));
            relative.push(mean_channel(square / weight));
            distances.extend(d.abs().to_array());
            bias += mean_channel(d);
        }
        distances.sort_unstable_by(f64::total_cmp);
        let rank = (0.95 * distances.len() as f64).ceil() as usize;
        let (absolute, relative) = (MeanSquare::of(&absolute), MeanSquare::of(&relative));
        Some(Self {
            nrmse: absolute.root() / mean,
            rel_rmse: relative.root(),
            bias: bias / count / mean,
            p95: distances[rank.max(1) - 1] / mean,
            is_resolved: absolute.is_resolved(),
        })
    }
}

/// Share of receivers and channels whose value lies within two standard errors of the reference, the
/// standard errors of both taken together, with a further allowance at each receiver (zero for none).
/// `None` without receivers that state a standard error.
pub fn within_two(
    values: &[Estimate],
    allowance: Option<&[Rgb]>,
    reference: &[Estimate],
) -> Option<f64> {
    let (mut inside, mut count) = (0_usize, 0_usize);
    for (index, (value, reference)) in values.iter().zip(reference).enumerate() {
        let d = (value.value - reference.value).abs();
        let variance = value.standard_error * value.standard_error
            + reference.standard_error * reference.standard_error;
        let allowance = allowance.map_or(Rgb::ZERO, |allowance| allowance[index]);
        for channel in 0..3 {
            if value.standard_error[channel] > 0.0 {
                count += 1;
                let limit = 2.0 * variance[channel].sqrt() + allowance[channel];
                inside += usize::from(d[channel] <= limit);
            }
        }
    }
    (count > 0).then(|| inside as f64 / count as f64)
}

/// Root mean square over receivers and channels; zero without any.
pub fn root_mean_square(values: impl IntoIterator<Item = Rgb>) -> f64 {
    mean_of_channels(values.into_iter().map(|value| value * value)).map_or(0.0, f64::sqrt)
}

/// Mean over receivers and channels; `None` without any.
pub fn mean_of_channels(values: impl IntoIterator<Item = Rgb>) -> Option<f64> {
    let (sum, count) = values
        .into_iter()
        .fold((0.0, 0_usize), |(sum, count), value| {
            (sum + mean_channel(value), count + 1)
        });
    (count > 0).then(|| sum / count as f64)
}

fn mean_channel(value: Rgb) -> f64 {
    value.element_sum() / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reference(values: &[f64], standard_error: f64) -> Vec<Estimate> {
        let estimate = |&value: &f64| Estimate {
            value: Rgb::splat(value),
            standard_error: Rgb::splat(standard_error),
        };
        values.iter().map(estimate).collect()
    }

    fn values(values: &[f64]) -> Vec<Option<Rgb>> {
        values.iter().map(|&v| Some(Rgb::splat(v))).collect()
    }

    #[test]
    fn hand_made_values() {
        let errors = Errors::new(&values(&[1.0, 3.0]), &reference(&[2.0, 2.0], 0.6));
        let errors = errors.expect("two receivers");
        // A few roundings each.
        assert!((errors.nrmse - 0.4).abs() < 1e-14, "{errors:?}");
        let relative = (0.64_f64 / (4.0 + 0.0004)).sqrt();
        assert!((errors.rel_rmse - relative).abs() < 1e-14, "{errors:?}");
        assert!(errors.bias.abs() < 1e-14 && errors.is_resolved);
        assert!((errors.p95 - 0.5).abs() < 1e-14, "{errors:?}");
    }

    #[test]
    fn an_error_within_the_noise_of_the_reference_is_a_limit() {
        // d² is 0.01 or 0.0, v* 0.01: the mean square is negative.
        let errors = Errors::new(&values(&[1.1, 1.0]), &reference(&[1.0, 1.0], 0.1));
        let errors = errors.expect("two receivers");
        assert!(!errors.is_resolved && errors.nrmse > 0.0, "{errors:?}");
    }

    #[test]
    fn missing_values_are_left_out_and_darkness_has_no_ratio() {
        let some = [Some(Rgb::ONE), None];
        let errors = Errors::new(&some, &reference(&[1.0, 9.0], 0.0)).expect("one receiver");
        assert_eq!((errors.bias, errors.p95), (0.0, 0.0));
        assert!(Errors::new(&[None, None], &reference(&[1.0, 9.0], 0.0)).is_none());
        assert!(Errors::new(&some, &reference(&[0.0, 0.0], 0.0)).is_none());
    }

    #[test]
    fn intervals_are_counted_by_channel() {
        let stated = reference(&[1.0, 1.3, 1.0], 0.1);
        let truth = reference(&[1.0, 1.0, 2.0], 0.0);
        let share = within_two(&stated, None, &truth).expect("stated errors");
        assert!((share - 1.0 / 3.0).abs() < 1e-14);
        let allowance = [Rgb::splat(0.2); 3];
        let share = within_two(&stated, Some(&allowance), &truth).expect("stated errors");
        assert!((share - 2.0 / 3.0).abs() < 1e-14);
        assert!(
            within_two(&truth, None, &stated).is_none(),
            "nothing stated"
        );
    }
}
