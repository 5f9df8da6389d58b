//! The noise of pixels: what their replicates say, their neighbours, and edges that samples miss.
//!
//! With s_i the scatter of pixel i of n_i samples and A_i = s_i n_i that of one sample, a pixel is
//! expected to scatter as its neighbours do, e_i = Σ_j A_j / (8 n_i); its variance is the scatter
//! moderated by that ([`moderate`]). Scatters know nothing of what no sample met: where replicates
//! agree because all of them miss the edge of a lamp, pixel and neighbours differ by the lamp. So
//!
//!   d_i = κ (r_i / n_i)²
//!
//! is added, with r_i the range of values in the 3 × 3 pixels about i. An edge of contrast r that cuts
//! off a part p of the pixel is missed by four strips of n/4 samples with the probability
//! (1 − p n/4)⁴, so that over all places of an edge the mean square of r p is 0.38 r²/n²; by samples
//! that are not strips to the edge, with that of e^(−p n), and it is r²/n². Most pixels beside a
//! lamp hide nothing, and what edges the scatters do know counts already: κ is smaller, and tuned. In
//! smooth surroundings r is that of the noise, and d_i is below n⁻² of the variance.
//!
//! A pixel whose few replicates agree by chance must not end its own sampling, or the picture is biased
//! (D. Kirk, J. Arvo, "Unbiased sampling techniques for image synthesis", SIGGRAPH 1991). That the
//! neighbours have a say in its variance keeps this bias below what 200 seeds can tell from noise: a thousandth
//! of the mean and less after three rounds.
//! Valid where nothing is smaller than a pixel that no sample of it or its neighbours meets.
//! Cost: O(n log n).

use luxel_solver::error::moderate;
use rayon::prelude::*;

/// κ, the mean square of what samples miss of an edge, over r²/n². Measured over 200 seeds of a small room
/// with the edge of its lamp in view (`tests/ACCURACY.md`): at 16 and 64 samples a pixel the mean of z² is
/// 0.95 and 0.98. At 0.05 films of few samples are stated too exact (1.10 of z² and
/// 1.7 of the variance at eight), at 0.1 pixels are stated too wrong (0.78).
const MISSED: f64 = 0.07;

/// Weight of a pixel's own scatter in the noise of the whole film. With one, pixels that were taken
/// for quiet by chance and got few samples would pull it down; with zero, noise that pixels have to
/// themselves would count where it is not.
const OWN: f64 = 0.5;

/// One channel of a film.
pub(super) struct Channel {
    /// Width and height in pixels.
    pub(super) size: [usize; 2],
    /// Samples of each pixel.
    pub(super) samples: Vec<u32>,
    /// Their mean.
    pub(super) values: Vec<f64>,
    /// Its variance, as the replicates scatter.
    pub(super) scatters: Vec<f64>,
    /// Degrees of freedom of a scatter.
    pub(super) degrees: u32,
}

impl Channel {
    /// The variance of each pixel: its mean over pixels of like noise is right, and that of z² is one.
    pub(super) fn variances(&self) -> Vec<f64> {
        let moderated = moderate(&self.scatters, &self.expected(), self.degrees);
        moderated
            .iter()
            .zip(self.missed())
            .map(|(variance, missed)| variance + missed)
            .collect()
    }

    /// The sum of all variances. Moderated ones do for single pixels, but are too large on average when
    /// their distribution has a long tail.
    pub(super) fn total(&self) -> f64 {
        let blended = self
            .scatters
            .iter()
            .zip(self.expected())
            .map(|(own, around)| OWN * own + (1.0 - OWN) * around);
        blended.sum::<f64>() + self.missed().iter().sum::<f64>()
    }

    /// How much each pixel should scatter, by the mean of its neighbours; as it does where it has none.
    fn expected(&self) -> Vec<f64> {
        let number = |pixel: usize| f64::from(self.samples[pixel].max(1));
        (0..self.scatters.len())
            .into_par_iter()
            .map(|pixel| {
                let (mut sum, mut count) = (0.0, 0.0);
                for other in neighbours(self.size, pixel) {
                    sum += self.scatters[other] * number(other);
                    count += 1.0;
                }
                if count > 0.0 {
                    sum / count / number(pixel)
                } else {
                    self.scatters[pixel]
                }
            })
            .collect()
    }

    /// Mean square of what the samples of each pixel may have missed of an edge.
    fn missed(&self) -> Vec<f64> {
        (0..self.values.len())
            .into_par_iter()
            .map(|pixel| {
                let own = self.values[pixel];
                let (low, high) = neighbours(self.size, pixel)
                    .map(|other| self.values[other])
                    .fold((own, own), |(low, high), x| (low.min(x), high.max(x)));
                let samples = f64::from(self.samples[pixel].max(1));
                MISSED * ((high - low) / samples).powi(2)
            })
            .collect()
    }
}

/// The up to eight pixels around one.
fn neighbours([width, height]: [usize; 2], pixel: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (pixel % width, pixel / width);
    let rows = y.saturating_sub(1)..(y + 2).min(height);
    let columns = x.saturating_sub(1)..(x + 2).min(width);
    rows.flat_map(move |row| columns.clone().map(move |column| row * width + column))
        .filter(move |&other| other != pixel)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_have_up_to_eight_neighbours() {
        let around = |size, pixel| neighbours(size, pixel).collect::<Vec<_>>();
        assert_eq!(around([3, 3], 4), [0, 1, 2, 3, 5, 6, 7, 8]);
        assert_eq!(around([3, 2], 0), [1, 3, 4]);
        assert_eq!(around([4, 1], 3), [2]);
        assert!(around([1, 1], 0).is_empty());
    }

    /// Two rows of 20 pixels that agree within, one of them bright: what they may hide is κ (contrast /
    /// samples)², and a pixel of four times the samples hides a sixteenth of it.
    #[test]
    fn where_neighbours_differ_agreement_is_not_certainty() {
        let values: Vec<f64> = (0..60).map(|i| if i < 20 { 8.0 } else { 0.0 }).collect();
        let mut samples = vec![16; 60];
        samples[30] = 64;
        let variances = Channel {
            size: [20, 3],
            samples,
            values,
            scatters: vec![0.0; 60],
            degrees: 3,
        }
        .variances();
        let hidden = MISSED * 0.25;
        assert!((variances[5] - hidden).abs() < 1e-15 && variances[5] == variances[25]);
        assert!((variances[30] - hidden / 16.0).abs() < 1e-15);
        assert_eq!(variances[45], 0.0);
    }

    /// Scatters of one sample are alike everywhere, numbers of samples are not.
    #[test]
    fn neighbours_are_compared_sample_by_sample() {
        let samples: Vec<u32> = (0..64).map(|i| 4 << (i % 4)).collect();
        let scatters: Vec<f64> = samples.iter().map(|&n| 3.0 / f64::from(n)).collect();
        let channel = Channel {
            size: [8, 8],
            samples,
            values: vec![1.0; 64],
            scatters: scatters.clone(),
            degrees: 3,
        };
        for (expected, scatter) in channel.expected().iter().zip(&scatters) {
            assert!((expected / scatter - 1.0).abs() < 1e-14);
        }
        assert!((channel.total() / scatters.iter().sum::<f64>() - 1.0).abs() < 1e-14);
    }
}
