//! The form factors of the pixels of a hemicube, in closed form.
//!
//! With corners measured on a face at distance 1, the form factor of a rectangle is the difference over
//! its four corners of
//!
//! top:  T(x, y) = [x/√(1+x²) atan(y/√(1+x²)) + y/√(1+y²) atan(x/√(1+y²))]/2π,
//! side: S(y, z) = [atan y − atan(y/√(1+z²))/√(1+z²)]/2π.
//!
//! Source: J. R. Howell, "A Catalog of Radiation Heat Transfer Configuration Factors", factors B-3 and
//! B-4. The pixel's value is not that of its centre times its area, the usual shortcut, whose sum differs
//! from 1 by O(N⁻²). Rounding of the sums is divided out.

use std::f64::consts::TAU;

/// The pixel form factors of the top and of one side, row by row.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pixels {
    /// N×N values.
    pub(super) top: Vec<f64>,
    /// N/2 rows of N values, from the horizon up.
    pub(super) side: Vec<f64>,
}

impl Pixels {
    /// The pixels of a hemicube with `resolution` pixels along an edge, an even number.
    pub(super) fn new(resolution: usize) -> Self {
        let n = resolution;
        // Places of the pixel borders: −1 to 1 across, 0 to 1 up a side.
        let across = |k: usize| (2 * k) as f64 / n as f64 - 1.0;
        let up = |k: usize| (2 * k) as f64 / n as f64;
        let mut top = differences(n, n, |i, j| top_corner(across(i), across(j)));
        let mut side = differences(n, n / 2, |i, j| side_corner(across(i), up(j)));
        let sum = top.iter().sum::<f64>() + 4.0 * side.iter().sum::<f64>();
        for value in top.iter_mut().chain(&mut side) {
            *value /= sum;
        }
        Self { top, side }
    }
}

/// Differences of a corner function over all cells of a grid, row by row.
fn differences(columns: usize, rows: usize, corner: impl Fn(usize, usize) -> f64) -> Vec<f64> {
    let line = |j: usize| -> Vec<f64> { (0..=columns).map(|i| corner(i, j)).collect() };
    let mut cells = Vec::with_capacity(columns * rows);
    let mut below = line(0);
    for j in 0..rows {
        let above = line(j + 1);
        for i in 0..columns {
            cells.push((above[i + 1] - above[i]) - (below[i + 1] - below[i]));
        }
        below = above;
    }
    cells
}

fn top_corner(x: f64, y: f64) -> f64 {
    let (a, b) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    (x / a * (y / a).atan() + y / b * (x / b).atan()) / TAU
}

fn side_corner(y: f64, z: f64) -> f64 {
    let c = (1.0 + z * z).sqrt();
    (y.atan() - (y / c).atan() / c) / TAU
}

#[cfg(test)]
mod tests {
    use super::super::super::point_to_polygon;
    use super::*;
    use glam::DVec3;

    #[test]
    fn they_sum_to_one_and_are_those_of_lambert() {
        for resolution in [2, 8, 64] {
            let pixels = Pixels::new(resolution);
            let sum = pixels.top.iter().sum::<f64>() + 4.0 * pixels.side.iter().sum::<f64>();
            // Rounding of the sum itself.
            assert!((sum - 1.0).abs() < 1e-13, "{resolution}: {sum}");
            let h = 2.0 / resolution as f64;
            for (i, j) in [
                (0, 0),
                (resolution / 2, 0),
                (resolution - 1, resolution / 2 - 1),
            ] {
                let (x, y, z) = (i as f64 * h - 1.0, j as f64 * h - 1.0, j as f64 * h);
                let top = [(x, y), (x, y + h), (x + h, y + h), (x + h, y)];
                let top = top.map(|(x, y)| DVec3::new(x, y, 1.0));
                let side = [(x, z), (x, z + h), (x + h, z + h), (x + h, z)];
                let side = side.map(|(y, z)| DVec3::new(1.0, y, z));
                let at = j * resolution + i;
                for (value, polygon) in [(pixels.top[at], top), (pixels.side[at], side)] {
                    let exact = point_to_polygon(DVec3::ZERO, DVec3::Z, &polygon);
                    // Differences of corner values of order 0.1.
                    assert!((value - exact).abs() < 1e-15, "{resolution} {i} {j}");
                }
            }
        }
    }
}
