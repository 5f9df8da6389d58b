//! Smooths what is noise in a map, guided by what is known of it.
//!
//! Each lit texel p becomes a mean of texels q of its own chart around it, weighted by how alike their neighbourhoods are:
//!
//!   w(p, q) = exp(−max(0, d²(p, q))),   d² = mean over shifts n and channels of
//!   ((u(p+n) − u(q+n))² − (V(p+n) + min(V(p+n), V(q+n)))) / (k² (V(p+n) + V(q+n))),
//!
//! with the variance V that the gather states. Differences that noise explains count nothing, so that flat light is averaged
//! widely, and an edge of a shadow that stands out of the noise is kept. Texels without noise stay as they are.
//! Biased: what is fainter than the noise is smoothed with it. The stated error of a texel is left as it was, an upper bound.
//!
//! Source: F. Rousselle, C. Knaus, M. Zwicker, "Adaptive Rendering with Non-Local Means Filtering", ACM TOG 31(6), 2012.
//! Cost: about a thousand differences a noisy texel.

use super::luxels::Luxel;
use super::map::{Lightmap, Texel};
use luxel_scenes::Rgb;
use luxel_solver::gather::Gathered;
use rayon::prelude::*;

/// Texels on each side in which others are looked for, and those by which two are compared.
const WINDOW: isize = 5;
const PATCH: isize = 1;

/// The k of the differences: the source's value for strong filtering.
const STRENGTH: f64 = 0.6;

/// Relative noise below which a texel is not worth the work.
const NEGLIGIBLE: f64 = 0.002;

/// What noise there is, by texel.
struct Noisy<'m> {
    map: &'m Lightmap,
    /// The chart of each lit texel.
    charts: Vec<u32>,
    variances: Vec<Rgb>,
}

const NO_CHART: u32 = u32::MAX;

/// Smooths the lit texels of a map.
///
/// # Panics
/// When there is not one of `gathered` for each luxel.
pub fn denoise(map: &mut Lightmap, luxels: &[Luxel], gathered: &[Gathered]) {
    assert_eq!(
        luxels.len(),
        gathered.len(),
        "something gathered at each luxel"
    );
    let mut noisy = Noisy {
        map,
        charts: vec![NO_CHART; map.texels.len()],
        variances: vec![Rgb::ZERO; map.texels.len()],
    };
    let mut rest = gathered;
    for own in luxels.chunk_by(|a, b| a.texel == b.texel) {
        let (gathered, after) = rest.split_at(own.len());
        rest = after;
        let texel = own[0].texel as usize;
        let square = |g: &Gathered| g.sampling().0 * g.sampling().0;
        let squares: Rgb = gathered.iter().map(square).sum();
        noisy.charts[texel] = own[0].chart.0;
        noisy.variances[texel] = squares / (own.len() as f64).powi(2);
    }
    let smoothed: Vec<Rgb> = (0..map.texels.len())
        .into_par_iter()
        .with_min_len(1024)
        .map(|texel| noisy.smoothed(texel))
        .collect();
    map.values = smoothed;
}

impl Noisy<'_> {
    /// The value of a texel without its noise.
    fn smoothed(&self, texel: usize) -> Rgb {
        let value = self.map.values[texel];
        let noise = self.variances[texel].element_sum().sqrt();
        if self.map.texels[texel] != Texel::Lit || noise <= NEGLIGIBLE * value.element_sum() {
            return value;
        }
        let (mut sum, mut weights) = (value, 1.0);
        for dy in -WINDOW..=WINDOW {
            for dx in -WINDOW..=WINDOW {
                let Some(other) = self.beside(texel, dx, dy).filter(|&other| other != texel) else {
                    continue;
                };
                let weight = (-self.difference(texel, other).max(0.0)).exp();
                sum += self.map.values[other] * weight;
                weights += weight;
            }
        }
        sum / weights
    }

    /// The texel beside one, of the same chart.
    fn beside(&self, texel: usize, dx: isize, dy: isize) -> Option<usize> {
        let [width, height] = self.map.size;
        let page = texel / (width * height);
        let (column, row) = (texel % width, texel / width % height);
        let column = column.checked_add_signed(dx).filter(|&x| x < width)?;
        let row = row.checked_add_signed(dy).filter(|&y| y < height)?;
        let other = (page * height + row) * width + column;
        (self.charts[other] == self.charts[texel]).then_some(other)
    }

    /// How far two texels differ beyond their noise, d².
    fn difference(&self, one: usize, other: usize) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for dy in -PATCH..=PATCH {
            for dx in -PATCH..=PATCH {
                let (Some(p), Some(q)) = (self.beside(one, dx, dy), self.beside(other, dx, dy))
                else {
                    continue;
                };
                let difference = self.map.values[p] - self.map.values[q];
                let square = difference * difference;
                let (of_p, of_q) = (self.variances[p], self.variances[q]);
                let beyond = square - (of_p + of_p.min(of_q));
                let scale = STRENGTH.powi(2) * (of_p + of_q);
                for channel in 0..3 {
                    // Two values without noise are alike only where they are the same.
                    sum += match (scale[channel] > 0.0, square[channel] > 0.0) {
                        (true, _) => beyond[channel] / scale[channel],
                        (false, true) => f64::INFINITY,
                        (false, false) => 0.0,
                    };
                    count += 1.0;
                }
            }
        }
        sum / count
    }
}
