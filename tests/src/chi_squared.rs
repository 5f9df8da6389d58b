//! Pearson's χ² test of a sampling routine against its density.
//!
//! The domain, a rectangle, is cut into cells. From the density the number of samples that each
//! cell should hold is computed by numerical integration, E_c = n ∫ p, from the routine the number
//! O_c that it does hold; χ² = Σ (O_c − E_c)²/E_c then follows the χ² distribution if the routine
//! is right. Cells that should hold few samples are pooled, because the distribution is that of
//! a sum of squared normal variables, which small counts are not.
//!
//! Sources: K. Pearson, "On the criterion …", Philosophical Magazine 50, 1900; the procedure
//! follows W. Jakob's tests of Nori and Mitsuba in outline.
//!
//! Validity: independent samples (not low-discrepancy points, which fit too well). Cost: the
//! samples and `cells`² · `subcells`² evaluations of the density.

use crate::hypothesis::{SIGNIFICANCE, sidak};
use crate::special::chi_squared_tail;
use luxel_solver::sampling::{Stage, hash};

/// Fewest samples that a cell should hold by itself; the rule of thumb of textbooks (W. G. Cochran,
/// 1954). Smaller makes right routines fail, larger hides errors in rare regions.
const MIN_EXPECTED: f64 = 5.0;

/// Largest error of ∫ p that integration may leave: the pooled cell would be off by n times this.
const NORM_TOLERANCE: f64 = 2e-3;

/// What is tested, and how finely.
#[derive(Clone, Copy, Debug)]
pub struct ChiSquared {
    /// Lower corner of the domain. Directions are parametrised as (z, φ), in which equal areas
    /// are equal solid angles.
    pub lower: [f64; 2],
    /// Upper corner of the domain.
    pub upper: [f64; 2],
    /// Cells along each side. More cells find finer errors, with less power against coarse ones.
    pub cells: usize,
    /// Points along each side of a cell at which the density is evaluated (midpoint rule). Odd,
    /// so that a discontinuity through the middle of a cell does not lie between points
    /// systematically. Where the density jumps along a border the expected number of a cell on it
    /// is off by about n p · (cell area) · `subcells`^-1.5, which must stay below its square root.
    pub subcells: usize,
    /// Number of samples. The smallest relative error of a density that is found reliably is
    /// about (8 `cells`²)^¼ / √`samples`.
    pub samples: u64,
    /// Number of tests that share the level of significance.
    pub tests: usize,
    /// Seed of the uniform numbers.
    pub seed: u64,
}

impl ChiSquared {
    /// Runs `sample` on independent points of the unit square and compares where its results lie
    /// with `pdf`, the density per area of the domain. Returns the p-value.
    ///
    /// # Errors
    /// When ∫ p is not 1, a sample lies outside the domain, or the deviation is less probable than
    /// the level of significance.
    pub fn run(
        &self,
        mut sample: impl FnMut([f64; 2]) -> [f64; 2],
        pdf: impl Fn([f64; 2]) -> f64,
    ) -> Result<f64, String> {
        let expected = self.expected(pdf);
        let norm: f64 = expected.iter().sum::<f64>() / self.samples as f64;
        if norm.is_nan() || (norm - 1.0).abs() > NORM_TOLERANCE {
            return Err(format!("the density integrates to {norm}, not to 1"));
        }
        let mut observed = vec![0_u64; self.cells * self.cells];
        for i in 0..self.samples {
            let u = [0, 1].map(|d| hash::uniform(self.seed, Stage(u32::MAX), i, d));
            let point = sample(u);
            let cell = self.cell(point);
            let cell = cell.ok_or_else(|| format!("{u:?} gives {point:?}, outside the domain"))?;
            observed[cell] += 1;
        }
        self.compare(&expected, &observed)
    }

    /// Numbers of samples that the cells should hold, row by row.
    fn expected(&self, pdf: impl Fn([f64; 2]) -> f64) -> Vec<f64> {
        let fine = self.cells * self.subcells;
        let step = [0, 1].map(|d| (self.upper[d] - self.lower[d]) / fine as f64);
        let mut expected = vec![0.0; self.cells * self.cells];
        for i in 0..fine {
            for j in 0..fine {
                let x = self.lower[0] + (i as f64 + 0.5) * step[0];
                let y = self.lower[1] + (j as f64 + 0.5) * step[1];
                expected[(j / self.subcells) * self.cells + i / self.subcells] +=
                    pdf([x, y]) * step[0] * step[1] * self.samples as f64;
            }
        }
        expected
    }

    fn cell(&self, point: [f64; 2]) -> Option<usize> {
        let [column, row] = [0, 1].map(|d| {
            let t = (point[d] - self.lower[d]) / (self.upper[d] - self.lower[d]);
            // The upper border, reached by rounding, belongs to the last cell.
            ((-1e-6..=1.0 + 1e-6).contains(&t))
                .then(|| ((t * self.cells as f64).max(0.0) as usize).min(self.cells - 1))
        });
        Some(row? * self.cells + column?)
    }

    fn compare(&self, expected: &[f64], observed: &[u64]) -> Result<f64, String> {
        let mut cells: Vec<(f64, f64)> = expected
            .iter()
            .zip(observed)
            .map(|(&e, &o)| (e, o as f64))
            .collect();
        cells.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let (mut statistic, mut terms) = (0.0, 0_usize);
        let mut pool = (0.0, 0.0);
        for (e, o) in cells {
            pool = (pool.0 + e, pool.1 + o);
            if pool.0 >= MIN_EXPECTED {
                statistic += (pool.1 - pool.0).powi(2) / pool.0;
                terms += 1;
                pool = (0.0, 0.0);
            }
        }
        if terms < 2 {
            return Err(format!("{terms} cells hold enough samples: take more"));
        }
        let p = chi_squared_tail(statistic, terms - 1);
        let level = sidak(SIGNIFICANCE, self.tests);
        if p >= level {
            Ok(p)
        } else {
            let degrees = terms - 1;
            Err(format!(
                "χ² = {statistic} at {degrees} degrees of freedom: p = {p:e} below {level:e}"
            ))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: ChiSquared = ChiSquared {
        lower: [0.0, 0.0],
        upper: [1.0, 1.0],
        cells: 16,
        subcells: 5,
        samples: 100_000,
        tests: 1,
        seed: 1,
    };

    #[test]
    fn a_right_density_passes() {
        SQUARE.run(|u| u, |_| 1.0).expect("uniform");
        SQUARE
            .run(|[x, y]| [x.sqrt(), y], |[x, _]| 2.0 * x)
            .expect("linear");
    }

    #[test]
    fn wrong_densities_fail() {
        let slightly = SQUARE.run(|[x, y]| [x.powf(0.95), y], |_| 1.0);
        assert!(
            slightly
                .expect_err("5 % off")
                .contains("degrees of freedom")
        );
        let norm = SQUARE.run(|u| u, |_| 1.01);
        assert!(norm.expect_err("norm").contains("integrates"));
        let outside = SQUARE.run(|[x, y]| [2.0 * x, y], |_| 1.0);
        assert!(outside.expect_err("outside").contains("outside"));
        let hole = SQUARE.run(|u| u, |[x, _]| if x < 0.5 { 2.0 } else { 0.0 });
        assert!(hole.expect_err("hole").contains("degrees of freedom"));
        let nan = SQUARE.run(|u| u, |_| f64::NAN);
        assert!(nan.is_err());
    }

    #[test]
    fn p_values_of_a_right_routine_are_uniform() {
        // The mean of 64 uniform p-values has σ = 1/√(12·64) = 0.036; 4σ.
        let mean = (0..64)
            .map(|seed| {
                let config = ChiSquared {
                    seed,
                    samples: 5_000,
                    cells: 8,
                    tests: 64,
                    ..SQUARE
                };
                config.run(|u| u, |_| 1.0).expect("uniform") / 64.0
            })
            .sum::<f64>();
        assert!((mean - 0.5).abs() < 0.144, "mean p {mean}");
    }
}
