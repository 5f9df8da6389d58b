//! Moderated variances: what a few replicates say about the noise at one receiver, corrected by
//! what all receivers say together.
//!
//! Four replicates have three degrees of freedom, and two standard errors of such a scatter cover
//! 86 % of the errors, not 95 %. The variances of many receivers are, however, draws from one
//! distribution. With s²_i the scatter of receiver i (d degrees of freedom) and v_i its expected
//! relative size,
//!
//!   s²_i | σ²_i ~ σ²_i χ²_d / d,   σ²_i ~ d₀ c v_i / χ²_{d₀},
//!
//! and the posterior mean of σ²_i is (d₀ c v_i + d s²_i) / (d₀ + d − 2). d₀ and c follow from mean
//! and variance of ln(s²_i / v_i). The error over the root of this is a t-variable of d₀ + d degrees of
//! freedom scaled to unit variance: z² has mean one, and two standard errors cover about 95 %.
//!
//! Noise may come in steps: the replicates of a pixel that a lamp's edge grazes all miss the lamp, few
//! shadow rays all pass. A scatter of exactly zero where noise is expected says so, and nothing of the
//! noise's size. Such scatters count as the expected c v_i. They are left out of d₀; what is left is too
//! large then, and c is at most what makes the mean of all s²_i / v_i, those of zero included, as expected.
//!
//! Source: G. K. Smyth, "Linear models and empirical Bayes methods for assessing differential
//! expression in microarray experiments", Statistical Applications in Genetics and Molecular
//! Biology 3(1), 2004. Valid for errors near a normal distribution that are independent between
//! replicates; they may be correlated between receivers. Cost: O(n).

/// The prior's degrees of freedom beyond which receivers are all alike.
const MAX_PRIOR: f64 = 1e3;

/// Scatters below this fraction of the median are counted as this fraction: the logarithm of a
/// scatter that happens to be tiny would outweigh all others. Larger, and true differences are lost.
const FLOOR: f64 = 1e-4;

/// Posterior means of variances from their scatters (unit squared), each of `degrees` of freedom,
/// and their expected relative sizes (any unit). Where nothing is expected (zero), or too little is
/// known to pool, the scatter itself is multiplied by d for d ≤ 2 degrees of freedom and by
/// d / (d − 2) for more.
///
/// # Panics
/// When the slices differ in length or `degrees` is zero.
pub fn moderate(scatters: &[f64], expected: &[f64], degrees: u32) -> Vec<f64> {
    assert_eq!(
        scatters.len(),
        expected.len(),
        "one expectation per scatter"
    );
    assert!(degrees > 0, "a scatter has a degree of freedom");
    let d = f64::from(degrees);
    let Some(Prior {
        degrees: d0,
        scale: c,
    }) = Prior::fit(scatters, expected, d)
    else {
        let factor = if d > 2.0 { d / (d - 2.0) } else { d };
        return scatters.iter().map(|s| s * factor).collect();
    };
    // Below three degrees in all the mean does not exist; three are the fewest that are claimed.
    let total = (d0 + d).max(3.0);
    scatters
        .iter()
        .zip(expected)
        .map(|(&s, v)| {
            let usual = c * v;
            let own = if s > 0.0 { s } else { usual };
            (d0 * usual + d * own) / (total - 2.0)
        })
        .collect()
}

/// What is known of variances before they are looked at.
struct Prior {
    /// d₀
    degrees: f64,
    /// c
    scale: f64,
}

impl Prior {
    /// `None` with fewer than eight scatters above zero: nothing to pool.
    fn fit(scatters: &[f64], expected: &[f64], d: f64) -> Option<Self> {
        const FEWEST: usize = 8;
        let mut ratios: Vec<f64> = scatters
            .iter()
            .zip(expected)
            .filter(|&(_, &v)| v > 0.0)
            .map(|(s, v)| s / v)
            .collect();
        let mean_of_all = ratios.iter().sum::<f64>() / ratios.len() as f64;
        let of_all = ratios.len();
        ratios.retain(|&ratio| ratio > 0.0);
        if ratios.len() < FEWEST {
            return None;
        }
        let middle = ratios.len() / 2;
        let (_, &mut median, _) = ratios.select_nth_unstable_by(middle, f64::total_cmp);
        let logarithms: Vec<f64> = ratios
            .iter()
            .map(|ratio| ratio.max(FLOOR * median).ln())
            .collect();
        let count = logarithms.len() as f64;
        let mean = logarithms.iter().sum::<f64>() / count;
        let spread = logarithms.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / (count - 1.0);
        let centre = mean - digamma(d / 2.0) + (d / 2.0).ln();
        let degrees = 2.0 * inverse_trigamma(spread - trigamma(d / 2.0), MAX_PRIOR / 2.0);
        let mut scale = (centre + digamma(degrees / 2.0) - (degrees / 2.0).ln()).exp();
        if ratios.len() < of_all && degrees > 2.0 {
            scale = scale.min(mean_of_all * (degrees - 2.0) / degrees);
        }
        Some(Self { degrees, scale })
    }
}

/// From here on the asymptotic series below are exact to 1e-10.
const SERIES_FROM: f64 = 8.0;

/// ψ(x) = d/dx ln Γ(x) for x > 0: recurrence, then the asymptotic series (M. Abramowitz, I. A.
/// Stegun, "Handbook of Mathematical Functions", 1964, 6.3.5 and 6.3.18).
fn digamma(mut x: f64) -> f64 {
    let mut sum = 0.0;
    while x < SERIES_FROM {
        sum -= 1.0 / x;
        x += 1.0;
    }
    let y = 1.0 / (x * x);
    sum + x.ln() - 0.5 / x - y * (1.0 / 12.0 - y * (1.0 / 120.0 - y * (1.0 / 252.0 - y / 240.0)))
}

/// ψ'(x) for x > 0 (as [`digamma`]; 6.4.6 and 6.4.12).
fn trigamma(mut x: f64) -> f64 {
    let mut sum = 0.0;
    while x < SERIES_FROM {
        sum += 1.0 / (x * x);
        x += 1.0;
    }
    let y = 1.0 / (x * x);
    let tail = 1.0 / 6.0 - y * (1.0 / 30.0 - y * (1.0 / 42.0 - y / 30.0));
    sum + 1.0 / x + y / 2.0 + y / x * tail
}

/// The x ≤ `largest` with ψ'(x) = `value`; `largest` when there is none.
fn inverse_trigamma(value: f64, largest: f64) -> f64 {
    if value <= trigamma(largest) {
        return largest;
    }
    // ψ' falls from infinity; 0.05 stands for variances of which nothing is known beforehand.
    let (mut low, mut high) = (0.05_f64, largest);
    for _ in 0..60 {
        let middle = (low * high).sqrt();
        if trigamma(middle) > value {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Stage;
    use crate::sampling::hash::uniform;
    use std::f64::consts::PI;

    #[test]
    fn known_values() {
        // Abramowitz & Stegun, tables 6.1 and 6.2: ψ(1) = −γ, ψ'(1) = π²/6, ψ'(1/2) = π²/2.
        assert!((digamma(1.0) + 0.577_215_664_901_532_9).abs() < 1e-10);
        assert!((trigamma(1.0) - PI * PI / 6.0).abs() < 1e-10);
        assert!((trigamma(0.5) - PI * PI / 2.0).abs() < 1e-10);
        for x in [0.1, 1.0, 7.3, 200.0] {
            assert!((inverse_trigamma(trigamma(x), 500.0) / x - 1.0).abs() < 1e-9);
        }
    }

    /// A normal deviate (G. E. P. Box, M. E. Muller, 1958).
    fn normal(item: u64, sample: u64) -> f64 {
        let u = |k| uniform(5, Stage::ROWS, item, 2 * sample + k);
        (-2.0 * (1.0 - u(0)).ln()).sqrt() * (2.0 * PI * u(1)).cos()
    }

    /// Receivers whose variances differ e-fold from what is expected, with four replicates each.
    fn z_squares(expected: impl Fn(u64) -> f64, sigma: impl Fn(u64) -> f64) -> Vec<f64> {
        const COUNT: u64 = 20_000;
        let draws: Vec<[f64; 4]> = (0..COUNT)
            .map(|i| [0, 1, 2, 3].map(|k| sigma(i) * normal(i, k)))
            .collect();
        let mean = |x: &[f64; 4]| x.iter().sum::<f64>() / 4.0;
        let scatters: Vec<f64> = draws
            .iter()
            .map(|x| x.iter().map(|v| (v - mean(x)).powi(2)).sum::<f64>() / 12.0)
            .collect();
        let expected: Vec<f64> = (0..COUNT).map(expected).collect();
        let moderated = moderate(&scatters, &expected, 3);
        let z = |(x, variance): (&[f64; 4], f64)| mean(x).powi(2) / variance;
        draws.iter().zip(moderated).map(z).collect()
    }

    #[test]
    fn errors_are_stated_honestly_although_three_degrees_say_little() {
        let alike = z_squares(|_| 2.0, |_| 0.1);
        let spread = z_squares(
            |i| 1.0 + (i % 7) as f64,
            |i| (0.5 * normal(i, 9)).exp() * (1.0 + (i % 7) as f64).sqrt(),
        );
        for z in [alike, spread] {
            let count = z.len() as f64;
            let mean = z.iter().sum::<f64>() / count;
            let covered = z.iter().filter(|&&z| z <= 4.0).count() as f64 / count;
            // Over 20 000 draws the mean of z² of unit mean and a variance below 6 is known to
            // 0.017, the share to 0.0016: five of these, and 1 % for a log-normal spread that is
            // not the one assumed.
            assert!((mean - 1.0).abs() < 0.1, "mean z² is {mean}");
            assert!((covered - 0.9545).abs() < 0.018, "{covered} are covered");
        }
    }

    /// Receivers that a rare event changes: σ² = p (1 − p) / n of the fraction p of n rays, which is
    /// what is expected; with p n = 1/2 most replicates see none.
    #[test]
    fn agreement_by_chance_is_no_accuracy() {
        const RAYS: u64 = 16;
        const COUNT: u64 = 20_000;
        let p = 0.5 / RAYS as f64;
        let fraction = |i: u64, replicate: u64| {
            let is_hit = |ray| uniform(7, Stage::ROWS, i, replicate * RAYS + ray) < p;
            (0..RAYS).filter(|&ray| is_hit(ray)).count() as f64 / RAYS as f64
        };
        let draws: Vec<[f64; 2]> = (0..COUNT).map(|i| [0, 1].map(|k| fraction(i, k))).collect();
        let scatters: Vec<f64> = draws.iter().map(|[a, b]| (a - b).powi(2) / 4.0).collect();
        let moderated = moderate(&scatters, &vec![1.0; COUNT as usize], 1);
        let z_squares: f64 = draws
            .iter()
            .zip(moderated)
            .map(|([a, b], variance)| (0.5 * (a + b) - p).powi(2) / variance)
            .sum();
        // All receivers are alike, so that the mean of z² is one, known to 0.015: five of these, and 2 % for
        // the few scatters above the smallest. Counted as they are, zeros would make it infinite; as 1e-4
        // of the median, some thousands.
        let mean = z_squares / COUNT as f64;
        assert!((mean - 1.0).abs() < 0.1, "mean z² is {mean}");
    }

    #[test]
    fn nothing_is_made_of_nothing() {
        assert!(moderate(&[], &[], 3).is_empty());
        // Three degrees, nothing to pool: the mean of the posterior under a flat prior.
        let alone = moderate(&[2.0], &[1.0], 3);
        assert!((alone[0] - 6.0).abs() < 1e-12);
        // Noiseless receivers among noisy ones stay noiseless when that is expected.
        let mut scatters = vec![1.0; 20];
        let mut expected = vec![1.0; 20];
        scatters.push(0.0);
        expected.push(0.0);
        let last = moderate(&scatters, &expected, 3).pop();
        assert_eq!(last, Some(0.0));
    }
}
