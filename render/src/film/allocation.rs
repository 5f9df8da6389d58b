//! Where further samples of a film go: to each pixel as many as lessen the error most for their cost.
//!
//! With v_i the variance of pixel i's mean of n_i samples, and A_i = v_i n_i that of one sample, the
//! numbers n_i' that make Σ A_i/n_i' a given sum T with the fewest samples are n_i' = λ √A_i
//! (J. Neyman, "On the two different aspects of the representative method", 1934), where they are not
//! below the n_i that are taken already. λ is found by bisection: T falls monotonically in it. All
//! samples count as equally dear: a camera ray that meets nothing is cheaper, but is not noisy either.
//!
//! The variance of even samples falls faster than 1/n, at edges as n^−3/2. Each round aims at a
//! quarter of the variance at most, so that what a few samples say of many is not believed for long.
//! Cost: O(n) for each of some fifty steps.

/// Most that a round multiplies the samples of a pixel by, and divides the variance of the film by.
/// More, and rounds rest on less knowledge; less, and there are more rounds.
const MAX_GROWTH: f64 = 4.0;

/// The least that a round divides the variance of the film by: less, and rounds count more than samples.
const MIN_REDUCTION: f64 = 1.1;

/// Less growth of a pixel than this can wait for another round. Below the least reduction, so that no
/// round is empty.
const MIN_GROWTH: f64 = 1.05;

/// Steps of the bisection: λ is then known as well as f64 allows over the twenty powers of two that the
/// bracket may span.
const STEPS: usize = 72;

/// Samples to add to those of each pixel, so that the sum of the variances falls by `reduction`, as far
/// as a round may: none where there is no variance.
///
/// # Panics
/// When the slices differ in length.
pub(super) fn further(variances: &[f64], samples: &[u32], reduction: f64) -> Vec<u32> {
    assert_eq!(variances.len(), samples.len(), "a variance a pixel");
    let roots: Vec<f64> = variances
        .iter()
        .zip(samples)
        .map(|(variance, &n)| (variance * f64::from(n)).sqrt())
        .collect();
    let now: f64 = variances.iter().sum();
    if now <= 0.0 {
        return vec![0; samples.len()];
    }
    let aim = now / reduction.clamp(MIN_REDUCTION, MAX_GROWTH);
    let wanted = |lambda: f64, root: f64, n: u32| (lambda * root).max(f64::from(n));
    let left = |lambda: f64| -> f64 {
        let pixels = roots.iter().zip(samples).filter(|(root, _)| **root > 0.0);
        pixels
            .map(|(&root, &n)| root * root / wanted(lambda, root, n))
            .sum()
    };
    // With every n_i' = λ √A_i the sum is Σ √A_i / λ: never less than that is left.
    let (mut low, mut high) = (0.0, roots.iter().sum::<f64>() / aim);
    for _ in 0..STEPS {
        let middle = 0.5 * (low + high);
        if left(middle) > aim {
            low = middle;
        } else {
            high = middle;
        }
    }
    let more = |(&root, &n): (&f64, &u32)| {
        let growth = high * root / f64::from(n);
        if growth > MIN_GROWTH {
            let grown = f64::from(n) * growth.min(MAX_GROWTH);
            (grown.round() as u32).max(n + 1) - n
        } else {
            0
        }
    };
    roots.iter().zip(samples).map(more).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Variance that is left when the variance of a sample stays what it is.
    fn left(variances: &[f64], samples: &[u32], further: &[u32]) -> f64 {
        let pixels = variances.iter().zip(samples).zip(further);
        pixels
            .map(|((v, &n), &more)| v * f64::from(n) / f64::from(n + more))
            .sum()
    }

    #[test]
    fn samples_follow_the_standard_deviation() {
        // One sample's deviations are 1, 2 and 8, and no variance at all.
        let samples = [100; 4];
        let variances = [0.01, 0.04, 0.64, 0.0];
        let more = further(&variances, &samples, 2.0);
        // The first two hold more than they should already.
        assert_eq!((more[0], more[1], more[3]), (0, 0, 0));
        let exact = 64.0 / (0.69 / 2.0 - 0.05) - 100.0;
        assert!((f64::from(more[2]) - exact).abs() <= 0.5, "{more:?}");
        // Half a sample of rounding in 217.
        let ratio = left(&variances, &samples, &more) / (0.69 / 2.0);
        assert!((ratio - 1.0).abs() < 5e-3, "{ratio}");
    }

    #[test]
    fn no_round_goes_too_far() {
        assert_eq!(further(&[1.0, 1e-9], &[2, 2], 1e6), [6, 0]);
        assert_eq!(further(&[1.0, 1.0], &[10, 10], 4.0), [30, 30]);
        assert_eq!(further(&[1.0, 1.0], &[4, 4], 1.0), [1, 1]);
    }

    #[test]
    fn what_is_exact_needs_nothing() {
        assert_eq!(further(&[0.0, 0.0], &[2, 2], 4.0), [0, 0]);
        assert!(further(&[], &[], 4.0).is_empty());
    }
}
