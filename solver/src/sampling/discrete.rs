//! One of n, with given probabilities, by inversion of the distribution function.
//!
//! Equation: i = the first with u < P_{i+1}, P_i = Σ_{j<i} w_j / Σ_j w_j; the rest of u,
//! (u − P_i)/(P_{i+1} − P_i), is uniform again and can be spent on a warp, which keeps the
//! stratification of u.
//!
//! Source: L. Devroye, "Non-Uniform Random Variate Generation", Springer, 1986, §III.2.
//!
//! Validity: any weights that are finite and not negative, with a positive sum; entries of weight
//! 0 are never chosen. Cost: O(log n) a draw, 8 bytes an entry.

/// A distribution over the indices `0..n`.
#[derive(Clone, Debug, PartialEq)]
pub struct Discrete {
    /// P_0 = 0, …, P_n = 1.
    cumulative: Vec<f64>,
    total: f64,
}

/// Why weights are not a distribution.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DiscreteError {
    /// A weight is negative, infinite or not a number.
    #[error("weight {index} is {weight}; weights must be finite and not negative")]
    Weight {
        /// Which.
        index: usize,
        /// Its value.
        weight: f64,
    },
    /// There is nothing to choose.
    #[error("all weights are zero, or there are none")]
    NothingToChoose,
    /// The sum of the weights is infinite.
    #[error("the sum of the weights exceeds the range of f64; scale them down")]
    Overflow,
}

/// An index that was drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// The index.
    pub index: usize,
    /// Its probability.
    pub probability: f64,
    /// What is left of u, uniform in [0, 1).
    pub remainder: f64,
}

impl Discrete {
    /// Probabilities proportional to `weights`.
    ///
    /// # Errors
    /// When a weight is negative or not finite, when the sum overflows, or when none is positive.
    pub fn new(weights: impl IntoIterator<Item = f64>) -> Result<Self, DiscreteError> {
        let mut total = 0.0;
        let mut cumulative = vec![0.0];
        for (index, weight) in weights.into_iter().enumerate() {
            if !(weight.is_finite() && weight >= 0.0) {
                return Err(DiscreteError::Weight { index, weight });
            }
            total += weight;
            cumulative.push(total);
        }
        if total == 0.0 {
            return Err(DiscreteError::NothingToChoose);
        }
        if !total.is_finite() {
            return Err(DiscreteError::Overflow);
        }
        for p in &mut cumulative {
            *p /= total;
        }
        Ok(Self { cumulative, total })
    }

    /// Number of indices.
    pub fn len(&self) -> usize {
        self.cumulative.len() - 1
    }

    /// Never: an empty distribution cannot be made.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Sum of the weights, in their unit.
    pub fn total(&self) -> f64 {
        self.total
    }

    /// The index for `u` in [0, 1).
    #[inline]
    pub fn sample(&self, u: f64) -> Choice {
        // The last bound at or below u that has a positive step after it.
        let above = self.cumulative.partition_point(|&p| p <= u);
        let index = if above > self.len() {
            // u ≥ 1: the last index of positive weight.
            self.cumulative.partition_point(|&p| p < 1.0) - 1
        } else {
            above - 1
        };
        let probability = self.probability(index);
        let remainder = ((u - self.cumulative[index]) / probability).clamp(0.0, ONE_BELOW);
        Choice {
            index,
            probability,
            remainder,
        }
    }

    /// Probability of `index`.
    ///
    /// # Panics
    /// When `index` is out of range.
    #[inline]
    pub fn probability(&self, index: usize) -> f64 {
        self.cumulative[index + 1] - self.cumulative[index]
    }

    /// The u that gives `index` and leaves `remainder`.
    ///
    /// # Panics
    /// When `index` is out of range.
    pub fn invert(&self, index: usize, remainder: f64) -> f64 {
        self.cumulative[index] + remainder * self.probability(index)
    }
}

/// The largest f64 below 1.
const ONE_BELOW: f64 = 1.0 - f64::EPSILON / 2.0;

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "these values are exact by construction")]
mod tests {
    use super::*;

    #[test]
    fn weightless_entries_are_never_drawn() {
        let d = Discrete::new([0.0, 1.0, 0.0, 3.0, 0.0]).expect("valid weights");
        assert_eq!(d.sample(0.0).index, 1);
        assert_eq!(d.sample(0.25).index, 3);
        assert_eq!(d.sample(ONE_BELOW).index, 3);
        assert_eq!(d.sample(1.0).index, 3);
        assert_eq!(d.probability(3), 0.75);
        assert_eq!(d.len(), 5);
        assert_eq!(d.total(), 4.0);
    }

    #[test]
    fn remainder_inverts() {
        let d = Discrete::new([0.3, 1.7, 0.05, 2.0]).expect("valid weights");
        for i in 0..1000 {
            let u = (f64::from(i) + 0.5) / 1000.0;
            let c = d.sample(u);
            assert!((0.0..1.0).contains(&c.remainder), "{c:?}");
            assert!(
                (d.invert(c.index, c.remainder) - u).abs() < 1e-15,
                "{u}: {c:?}"
            );
        }
    }

    #[test]
    fn bad_weights_are_refused() {
        assert_eq!(Discrete::new([]), Err(DiscreteError::NothingToChoose));
        assert_eq!(
            Discrete::new([0.0, 0.0]),
            Err(DiscreteError::NothingToChoose)
        );
        assert_eq!(
            Discrete::new([1.0, -1.0]),
            Err(DiscreteError::Weight {
                index: 1,
                weight: -1.0
            })
        );
        assert!(matches!(
            Discrete::new([f64::NAN]),
            Err(DiscreteError::Weight { index: 0, .. })
        ));
        assert_eq!(
            Discrete::new([f64::MAX, f64::MAX]),
            Err(DiscreteError::Overflow)
        );
    }
}
