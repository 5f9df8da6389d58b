//! Running mean and variance by Welford's recurrences: mean μ and m₂ = Σ (x − μ)².
//!
//! Source: B. P. Welford, "Note on a method for calculating corrected sums of squares and products",
//! Technometrics 4(3), 1962. Exact but for rounding, which does not grow with the mean.

use luxel_scenes::Rgb;

/// Running mean and variance of independent values, per channel.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Moments {
    count: u32,
    mean: Rgb,
    squares: Rgb,
}

impl Moments {
    /// Takes in one more value.
    pub fn add(&mut self, value: Rgb) {
        self.count += 1;
        let delta = value - self.mean;
        self.mean += delta / f64::from(self.count);
        self.squares += delta * (value - self.mean);
    }

    /// How many values there are.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Their mean, in the unit of the values; zero without any.
    pub fn mean(&self) -> Rgb {
        self.mean
    }

    /// Their unbiased sample variance, in the unit of the values squared; `None` for fewer than
    /// two values.
    pub fn variance(&self) -> Option<Rgb> {
        (self.count > 1).then(|| self.squares / f64::from(self.count - 1))
    }

    /// The standard error of the mean, in the unit of the values; `None` for fewer than two.
    pub fn standard_error(&self) -> Option<Rgb> {
        let variance = self.variance()? / f64::from(self.count);
        Some(Rgb::new(
            variance.x.sqrt(),
            variance.y.sqrt(),
            variance.z.sqrt(),
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A uniform integer in 0..n from Weyl's sequence: equidistributed, so that the moments of
    /// many of them approach those of the uniform distribution.
    fn weyl(i: u32) -> f64 {
        (f64::from(i) * 0.618_033_988_749_894_9).fract()
    }

    #[test]
    fn moments_of_the_uniform_distribution() {
        let n = 100_000;
        let mut moments = Moments::default();
        for i in 0..n {
            // A large offset: the naive sum of squares would lose six of its digits here.
            moments.add(Rgb::splat(1e5 + weyl(i)));
        }
        let variance = moments.variance().expect("many values").x;
        // Weyl's discrepancy is O(log n / n), about 1e-4 here; variance of [0, 1) is 1/12.
        assert!((moments.mean().x - 1e5 - 0.5).abs() < 2e-4, "mean");
        assert!((variance - 1.0 / 12.0).abs() < 2e-4, "variance");
        let error = moments.standard_error().expect("many values").x;
        assert!((error - (variance / f64::from(n)).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn few_values_have_no_variance() {
        let mut moments = Moments::default();
        assert_eq!((moments.mean(), moments.variance()), (Rgb::ZERO, None));
        moments.add(Rgb::ONE);
        assert_eq!((moments.mean(), moments.variance()), (Rgb::ONE, None));
        moments.add(Rgb::splat(3.0));
        assert_eq!(moments.variance(), Some(Rgb::splat(2.0)));
        assert_eq!(moments.standard_error(), Some(Rgb::ONE));
    }
}
