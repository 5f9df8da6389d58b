//! Tests of whether a random result has the mean that it should have.
//!
//! A Monte Carlo estimate never equals its expectation, so a test asks: if the program were right,
//! how probable is a deviation as large as this one? Below the significance level the test fails.
//! A right program fails such a test with just that probability; seeds are fixed, so a test that
//! passes once passes always.
//!
//! Equations: z = (x − μ)/σ for known σ; t = (x̄ − μ)/(s/√n) with n − 1 degrees of freedom.
//! Several tests at once share the level: α₁ = 1 − (1 − α)^(1/n).
//!
//! Sources: Student, "The probable error of a mean", Biometrika 6(1), 1908; Z. Šidák, "Rectangular
//! confidence regions for the means of multivariate normal distributions", JASA 62, 1967.
//!
//! Validity: z needs an estimate that is nearly normal with a known standard error; t needs
//! independent, nearly normal values.

use crate::special::{normal_two_sided, student_two_sided};

/// Probability with which a family of tests may fail although the program is right.
pub const SIGNIFICANCE: f64 = 0.01;

/// The level of each of `tests` independent tests that together fail with probability
/// `significance`.
pub fn sidak(significance: f64, tests: usize) -> f64 {
    // 1 − (1 − α)^(1/n) without cancellation.
    -(-significance)
        .ln_1p()
        .mul_add(1.0 / tests as f64, 0.0)
        .exp_m1()
}

/// One comparison of an estimate with its expectation.
#[derive(Clone, Copy, Debug)]
pub struct Comparison {
    /// The estimate.
    pub value: f64,
    /// Its standard error, that of the expectation included.
    pub standard_error: f64,
    /// What it should be.
    pub expected: f64,
}

impl Comparison {
    /// (x − μ)/σ; where σ is zero, 0 for equality and infinity else.
    pub fn z(&self) -> f64 {
        let difference = self.value - self.expected;
        if difference == 0.0 {
            0.0
        } else {
            difference / self.standard_error
        }
    }
}

/// Tests all comparisons at once and names the worst in the error.
///
/// # Errors
/// When the most extreme deviation is less probable than the Šidák level, or a value is not a
/// number.
pub fn z_test(comparisons: &[Comparison]) -> Result<(), String> {
    let level = sidak(SIGNIFICANCE, comparisons.len().max(1));
    for (index, comparison) in comparisons.iter().enumerate() {
        let p = normal_two_sided(comparison.z());
        if p.is_nan() || p < level {
            return Err(format!(
                "comparison {index} of {}: {comparison:?} has z = {}, p = {p:e} below {level:e}",
                comparisons.len(),
                comparison.z(),
            ));
        }
    }
    Ok(())
}

/// Tests whether the mean of independent `values` is `expected`; `tests` is the number of tests
/// that share the level.
///
/// # Errors
/// When the deviation is less probable than the level.
///
/// # Panics
/// With fewer than two values.
pub fn t_test(values: &[f64], expected: f64, tests: usize) -> Result<(), String> {
    assert!(values.len() > 1, "a t-test needs two values");
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let comparison = Comparison {
        value: mean,
        standard_error: (variance / n).sqrt(),
        expected,
    };
    let t = comparison.z();
    let p = if t.is_infinite() {
        0.0
    } else {
        student_two_sided(t, n - 1.0)
    };
    let level = sidak(SIGNIFICANCE, tests);
    if p >= level {
        Ok(())
    } else {
        Err(format!(
            "{comparison:?} of {n} values: t = {t}, p = {p:e} below {level:e}"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_multiply_to_the_family() {
        let level = sidak(0.01, 50);
        assert!(((1.0 - level).powi(50) - 0.99).abs() < 1e-14, "{level}");
        assert!((sidak(0.01, 1) - 0.01).abs() < 1e-16);
    }

    #[test]
    fn right_passes_and_wrong_fails() {
        let comparison = |value, standard_error| Comparison {
            value,
            standard_error,
            expected: 1.0,
        };
        assert!(z_test(&[comparison(1.02, 0.01), comparison(1.0, 0.0)]).is_ok());
        assert!(z_test(&[comparison(1.04, 0.01), comparison(1.0, 0.0)]).is_err());
        assert!(z_test(&[comparison(1.1, 0.0)]).is_err(), "no error allowed");
        assert!(z_test(&[comparison(f64::NAN, 0.1)]).is_err());
        assert!(z_test(&[comparison(1.1, f64::NAN)]).is_err());

        let values = [0.9, 1.1, 1.05, 0.97, 1.0, 0.98];
        assert!(t_test(&values, 1.0, 1).is_ok());
        assert!(t_test(&values, 1.3, 1).is_err());
        assert!(t_test(&[1.0, 1.0], 1.0, 1).is_ok(), "exact");
        assert!(t_test(&[1.0, 1.0], 1.1, 1).is_err());
    }
}
