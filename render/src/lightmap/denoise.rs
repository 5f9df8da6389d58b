//! Smooths what is noise in a map, guided by what is known of it.
//!
//! Each lit texel p becomes a mean of texels q of its own chart around it, weighted by how alike their neighbourhoods are:
//!
//!   w(p, q) = exp(−max(0, d²(p, q))),   d² = mean over n (3 × 3 texels) and channels of
//!   ((u(p+n) − u(q+n))² − (V(p+n) + min(V(p+n), V(q+n)))) / (k² (V(p+n) + V(q+n))),
//!
//! with the variance V that the gather states. Differences that noise explains count nothing, so that flat light is averaged
//! widely, and an edge of a shadow that stands out of the noise is kept. Texels without noise stay as they are.
//! Biased: what is fainter than the noise is smoothed with it. The stated error of a texel is left as it was, an upper bound.
//!
//! Source: F. Rousselle, C. Knaus, M. Zwicker, "Adaptive Rendering with Non-Local Means Filtering", ACM TOG 31(6), 2012.
//! Cost: some 120 differences a texel.

use super::luxels::Luxel;
use super::map::{Lightmap, Texel};
use luxel_scenes::Rgb;
use luxel_solver::gather::Gathered;
use rayon::prelude::*;
use std::ops::Range;

/// Texels on each side in which others are looked for.
const WINDOW: isize = 5;

/// The k of the differences: the source's value for strong filtering.
const STRENGTH: f64 = 0.6;

/// Relative noise below which a texel is not worth the work.
const NEGLIGIBLE: f64 = 0.002;

/// Distance d² from which a weight counts as zero.
const FAR: f64 = 16.0;

/// Rows of texels that are smoothed at a time.
const BAND: usize = 16;

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
    let [width, height] = map.size;
    let bands: Vec<(usize, Range<usize>)> = (0..map.pages)
        .flat_map(|page| {
            let starts = (0..height).step_by(BAND);
            starts.map(move |first| (page, first..(first + BAND).min(height)))
        })
        .collect();
    let smoothed: Vec<Vec<Rgb>> = bands
        .into_par_iter()
        .map(|(page, rows)| noisy.band(page * width * height, rows))
        .collect();
    map.values = smoothed.concat();
}

/// Weighted values of a band's texels so far.
struct Sums {
    values: Vec<Rgb>,
    weights: Vec<f64>,
}

impl Noisy<'_> {
    /// The texels of some rows of a page, which begins at the texel `page`, without their noise.
    fn band(&self, page: usize, rows: Range<usize>) -> Vec<Rgb> {
        let width = self.map.size[0];
        let first = page + rows.start * width;
        let own = first..page + rows.end * width;
        let worthwhile: Vec<bool> = own.clone().map(|texel| self.is_worthwhile(texel)).collect();
        let mut sums = Sums {
            values: self.map.values[own.clone()].to_vec(),
            weights: vec![1.0; own.len()],
        };
        if worthwhile.contains(&true) {
            for dy in -WINDOW..=WINDOW {
                for dx in -WINDOW..=WINDOW {
                    if (dx, dy) != (0, 0) {
                        self.add_shifted(page, &rows, [dx, dy], &worthwhile, &mut sums);
                    }
                }
            }
        }
        let means = sums.values.iter().zip(sums.weights);
        means.map(|(value, weight)| *value / weight).collect()
    }

    fn is_worthwhile(&self, texel: usize) -> bool {
        let value = self.map.values[texel].element_sum();
        let noise = self.variances[texel].element_sum().sqrt();
        self.map.texels[texel] == Texel::Lit && noise > NEGLIGIBLE * value
    }

    /// Adds what lies beside the texels of some rows by one shift.
    fn add_shifted(
        &self,
        page: usize,
        rows: &Range<usize>,
        shift: [isize; 2],
        worthwhile: &[bool],
        sums: &mut Sums,
    ) {
        let [width, height] = self.map.size;
        // Differences of these rows and of those around them, each with its number of channels: none where there is no partner.
        let around = rows.start.saturating_sub(1)..(rows.end + 1).min(height);
        let mut differences = Vec::with_capacity(around.len() * width);
        for row in around.clone() {
            differences.extend((0..width).map(|column| {
                let other = self.beside(page, [column, row], shift);
                other.map_or([0.0; 2], |other| {
                    [self.difference(page + row * width + column, other), 3.0]
                })
            }));
        }
        for row in rows.clone() {
            for column in 0..width {
                let in_band = (row - rows.start) * width + column;
                if !worthwhile[in_band] {
                    continue;
                }
                let Some(other) = self.beside(page, [column, row], shift) else {
                    continue;
                };
                let (mut sum, mut count) = (0.0, 0.0);
                for row in row.saturating_sub(1).max(around.start)..(row + 2).min(around.end) {
                    let line = &differences[(row - around.start) * width..][..width];
                    for [difference, channels] in
                        &line[column.saturating_sub(1)..(column + 2).min(width)]
                    {
                        sum += difference;
                        count += channels;
                    }
                }
                let distance = sum / count;
                if distance < FAR {
                    let weight = (-distance.max(0.0)).exp();
                    sums.values[in_band] += self.map.values[other] * weight;
                    sums.weights[in_band] += weight;
                }
            }
        }
    }

    /// The texel beside one, of the same chart.
    fn beside(
        &self,
        page: usize,
        [column, row]: [usize; 2],
        [dx, dy]: [isize; 2],
    ) -> Option<usize> {
        let [width, height] = self.map.size;
        let own = self.charts[page + row * width + column];
        let column = column.checked_add_signed(dx).filter(|&x| x < width)?;
        let row = row.checked_add_signed(dy).filter(|&y| y < height)?;
        let other = page + row * width + column;
        (own != NO_CHART && self.charts[other] == own).then_some(other)
    }

    /// How far two texels differ beyond their noise, the sum over the channels.
    fn difference(&self, p: usize, q: usize) -> f64 {
        let difference = self.map.values[p] - self.map.values[q];
        let square = difference * difference;
        let (of_p, of_q) = (self.variances[p], self.variances[q]);
        let beyond = square - (of_p + of_p.min(of_q));
        let scale = STRENGTH.powi(2) * (of_p + of_q);
        let of_channel = |channel: usize| {
            // Two values without noise are alike only where they are the same.
            match (scale[channel] > 0.0, square[channel] > 0.0) {
                (true, _) => beyond[channel] / scale[channel],
                (false, true) => f64::INFINITY,
                (false, false) => 0.0,
            }
        };
        of_channel(0) + of_channel(1) + of_channel(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lightmap::atlas::{Atlas, ChartId};
    use glam::DVec2;
    use luxel_scenes::Irradiance;
    use luxel_solver::geometry::TriangleId;
    use luxel_solver::sampling::{Stage, hash};
    use luxel_solver::surface::SurfacePoint;

    const SIDE: usize = 48;

    /// A page of two charts, left and right, with noise of a known standard deviation on a truth.
    fn noisy(
        sigma: f64,
        truth: impl Fn(usize, usize) -> f64,
    ) -> (Lightmap, Vec<Luxel>, Vec<Gathered>) {
        let atlas = Atlas {
            size: [SIDE; 2],
            pages: 1,
            corners: Vec::new(),
            face_chart: Vec::new(),
            charts: Vec::new(),
            padding: 1,
        };
        let luxel = |texel: usize| Luxel {
            texel: texel as u32,
            chart: ChartId(u32::from(texel % SIDE >= SIDE / 2)),
            point: SurfacePoint {
                triangle: TriangleId(0),
                u: 0.0,
                v: 0.0,
            },
            offset: DVec2::ZERO,
        };
        let gathered = |texel: usize| {
            // The sum of twelve uniform numbers has a variance of one.
            let uniform = |k| hash::uniform(1, Stage::LIGHTMAP, texel as u64, k);
            let deviate = (0..12).map(uniform).sum::<f64>() - 6.0;
            Gathered {
                direct: Irradiance(Rgb::splat(
                    truth(texel % SIDE, texel / SIDE) + sigma * deviate,
                )),
                direct_noise: Irradiance(Rgb::splat(sigma)),
                ..Gathered::default()
            }
        };
        let luxels: Vec<Luxel> = (0..SIDE * SIDE).map(luxel).collect();
        let gathered: Vec<Gathered> = (0..SIDE * SIDE).map(gathered).collect();
        let map = Lightmap::new(&atlas, &luxels, &[], &gathered);
        (map, luxels, gathered)
    }

    fn rms(map: &Lightmap, truth: impl Fn(usize, usize) -> f64) -> f64 {
        let squares = map.values.iter().enumerate();
        let squares = squares.map(|(t, v)| (v.x - truth(t % SIDE, t / SIDE)).powi(2));
        (squares.sum::<f64>() / map.values.len() as f64).sqrt()
    }

    /// Of flat light a third of the noise is left at most; an edge of ten standard deviations costs less than that gains; charts do not
    /// mix: the step between them has no noise to hide in.
    #[test]
    fn noise_goes_and_edges_stay() {
        let flat = |_: usize, _: usize| 1.0;
        let edge = |_: usize, row: usize| if row < SIDE / 3 { 1.0 } else { 2.0 };
        let charts = |column: usize, _: usize| if column < SIDE / 2 { 1.0 } else { 1.01 };
        let smoothed = |truth: &dyn Fn(usize, usize) -> f64, sigma: f64| {
            let (mut map, luxels, gathered) = noisy(sigma, truth);
            denoise(&mut map, &luxels, &gathered);
            rms(&map, truth) / sigma
        };
        assert!(smoothed(&flat, 0.1) < 0.33, "{}", smoothed(&flat, 0.1));
        assert!(smoothed(&edge, 0.1) < 0.5, "{}", smoothed(&edge, 0.1));
        assert!(smoothed(&charts, 0.1) < 0.33, "{}", smoothed(&charts, 0.1));
    }

    #[test]
    fn light_without_noise_is_not_touched() {
        let (mut map, luxels, gathered) = noisy(0.0, |column, row| (column * row) as f64);
        let before = map.clone();
        denoise(&mut map, &luxels, &gathered);
        assert!(map == before);
    }
}
