//! How often errors are as large as stated.
//!
//! With x the value, s its stated error, x* the truth with the standard error s*, and t what the scene
//! itself is known to be off by: a value is within when |x − x*| ≤ 2 √(s² + s*²) + t, and
//! z² = max(|x − x*| − t, 0)² / (s² + s*²). Values that are stated to be exact have no z; they are
//! counted apart, with the largest error among them.

use super::ROUNDING;

/// A value with its stated error and with what it should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stated {
    /// The value.
    pub value: f64,
    /// Its stated error, one standard deviation.
    pub error: f64,
    /// What it should be.
    pub expected: f64,
    /// Standard error of what it should be.
    pub uncertainty: f64,
    /// What the scene is known to be off by.
    pub tolerance: f64,
    /// The level that rounding is relative to: the brightest value of the case.
    pub level: f64,
}

/// Counts of values by how far they are off, in stated errors.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Calibration {
    /// Values that state an error.
    pub values: usize,
    /// Those within two of them.
    pub within: usize,
    /// Σ z² over the values that state an error.
    z_squares: f64,
    /// Values that are stated to be exact.
    pub exact: usize,
    /// The largest error of those beyond their tolerance, relative to their level.
    pub exact_off: f64,
}

impl Calibration {
    /// Counts one more value.
    pub fn add(&mut self, stated: &Stated) {
        let off = (stated.value - stated.expected).abs();
        let beyond = (off - stated.tolerance).max(0.0);
        if stated.error <= ROUNDING * stated.level {
            self.exact += 1;
            let relative = (beyond - 2.0 * stated.uncertainty).max(0.0) / stated.level;
            self.exact_off = self.exact_off.max(relative);
            return;
        }
        let sigma = stated.error.hypot(stated.uncertainty);
        self.values += 1;
        self.within += usize::from(beyond <= 2.0 * sigma);
        self.z_squares += (beyond / sigma).powi(2);
    }

    /// Both together.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            values: self.values + other.values,
            within: self.within + other.within,
            z_squares: self.z_squares + other.z_squares,
            exact: self.exact + other.exact,
            exact_off: self.exact_off.max(other.exact_off),
        }
    }

    /// Share of the values that state an error that are within two of them; NaN without any.
    pub fn share(&self) -> f64 {
        self.within as f64 / self.values as f64
    }

    /// Mean of z² over the values that state an error; NaN without any.
    pub fn mean_z_squared(&self) -> f64 {
        self.z_squares / self.values as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hand_made_values() {
        let stated = |value, error, tolerance| Stated {
            value,
            error,
            expected: 1.0,
            uncertainty: 0.0,
            tolerance,
            level: 1.0,
        };
        let mut calibration = Calibration::default();
        // z is 1, 3, and 3 again of which the scene excuses half.
        calibration.add(&stated(1.125, 0.125, 0.0));
        calibration.add(&stated(0.625, 0.125, 0.0));
        calibration.add(&stated(1.375, 0.125, 0.1875));
        assert_eq!((calibration.values, calibration.within), (3, 2));
        let mean = (1.0 + 9.0 + 2.25) / 3.0;
        assert!((calibration.mean_z_squared() - mean).abs() < 1e-12);
        // Stated to be exact, and not.
        calibration.add(&stated(1.25, 0.0, 0.125));
        let twice = calibration.and(calibration);
        assert_eq!((twice.values, twice.exact), (6, 2));
        assert!((twice.exact_off - 0.125).abs() < 1e-12);
        assert!((twice.share() - 2.0 / 3.0).abs() < 1e-12);
    }
}
