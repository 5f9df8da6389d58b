//! Errors of values against references that are themselves uncertain.
//!
//! Equations, over all points and channels, d = x − x*, v* the variance of the reference:
//! nRMSE = √max(0, mean(d² − v*)) / mean(x*);
//! relRMSE = √max(0, mean((d² − v*)/(x*² + (0.01 mean x*)²))); bias = mean(d)/mean(x*).
//! The mean of d² is the squared error plus v*, so that subtracting v* leaves an unbiased estimate of
//! the mean squared error.
//!
//! Source: luxel's definition of error, that of the command's reports. Validity: reference errors
//! independent of the values'. The bias carries the reference's own error, about
//! √(mean v*/n) / mean(x*), times the square root of how far neighbouring errors go together.

use luxel_scenes::Rgb;

/// How far values are from a reference; all numbers are ratios.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// Root mean squared error over the mean of the reference.
    pub nrmse: f64,
    /// Root mean squared relative error, which the dark parts decide.
    pub rel_rmse: f64,
    /// Mean signed error over the mean of the reference.
    pub bias: f64,
}

impl Errors {
    /// Compares `values` with `reference`, whose standard errors are `standard_error`.
    ///
    /// # Panics
    /// When the three differ in length, are empty, or the reference is black.
    pub fn new(values: &[Rgb], reference: &[Rgb], standard_error: &[Rgb]) -> Self {
        assert_eq!(values.len(), reference.len(), "one reference per value");
        assert_eq!(
            values.len(),
            standard_error.len(),
            "one standard error per value"
        );
        assert!(!values.is_empty(), "no values");
        let channels = |list: &[Rgb]| list.iter().flat_map(Rgb::to_array).collect::<Vec<f64>>();
        let (x, x_star, sigma) = (
            channels(values),
            channels(reference),
            channels(standard_error),
        );
        let count = x.len() as f64;
        let mean = x_star.iter().sum::<f64>() / count;
        assert!(mean > 0.0, "the reference is black");
        let floor = (0.01 * mean).powi(2);
        let (mut bias, mut squares, mut relative) = (0.0, 0.0, 0.0);
        for ((x, x_star), sigma) in x.iter().zip(x_star).zip(sigma) {
            let d = x - x_star;
            let square = d * d - sigma * sigma;
            bias += d;
            squares += square;
            relative += square / (x_star * x_star + floor);
        }
        Self {
            nrmse: (squares / count).max(0.0).sqrt() / mean,
            rel_rmse: (relative / count).max(0.0).sqrt(),
            bias: bias / count / mean,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hand_made_values() {
        let grey = Rgb::splat;
        let errors = Errors::new(
            &[grey(1.0), grey(3.0)],
            &[grey(2.0), grey(2.0)],
            &[grey(0.6), grey(0.6)],
        );
        assert!((errors.nrmse - 0.4).abs() < 1e-15, "{errors:?}");
        let relative = (0.64_f64 / (4.0 + 0.0004)).sqrt();
        assert!((errors.rel_rmse - relative).abs() < 1e-15, "{errors:?}");
        assert!(errors.bias.abs() < 1e-15, "{errors:?}");
        // Noise of the reference alone is no error.
        let errors = Errors::new(&[grey(1.9)], &[grey(2.0)], &[grey(0.2)]);
        assert!(
            errors.nrmse < 1e-15 && (errors.bias + 0.05).abs() < 1e-15,
            "{errors:?}"
        );
    }
}
