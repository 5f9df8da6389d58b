//! A crowded lattice on a polygon: points for integrands with steps and kinks.
//!
//! Places (k/M, k F/M), k = 0…M−1, with M and F neighbouring Fibonacci numbers, shifted and mapped in each
//! coordinate by t − sin(2πt)/2π. The map makes the integrand periodic and crowds points towards the
//! edges as their distance cubed, where light varies quickly next to touching or nearly touching
//! surfaces. The lattice has M different values in each coordinate, so that a step of the integrand
//! (a plane that cuts the polygon) costs O(1/M), a kink (the shadow of an edge) O(1/M²), and what is smooth
//! less.
//!
//! Sources: I. H. Sloan, S. Joe, "Lattice Methods for Multiple Integration", 1994, chapters 2 and 5;
//! A. Sidi, "A new variable transformation for numerical integration", 1993. A uniformly random shift
//! makes the rule unbiased (R. Cranley, T. N. L. Patterson, "Randomization of number theoretic methods for
//! multiple integration", SIAM Journal on Numerical Analysis 13, 1976), up to the shares of triangles and
//! trapezia, which are normalised.

use super::area::{points_of, quads};
use super::polygon::Polygon;
use glam::DVec3;
use std::f64::consts::TAU;

/// Points on a polygon, `count` or more on each quadrilateral piece, and their shares, which sum to 1.
/// `shift` in [0, 1)² moves the lattice.
pub(super) fn lattice(polygon: &Polygon, count: usize, shift: [f64; 2]) -> Vec<(DVec3, f64)> {
    // Below 5 the lattice degenerates to a diagonal.
    let (mut step, mut size) = (3, 5);
    while size < count {
        (step, size) = (size, step + size);
    }
    let mut points = Vec::with_capacity(size);
    for quad in quads(polygon) {
        for k in 0..size {
            let place = |multiple: usize, shift: f64| {
                crowd(((k * multiple) as f64 / size as f64 + shift).fract())
            };
            let (u, v) = (place(1, shift[0]), place(step, shift[1]));
            points_of(&quad, polygon.normal(), &[u], &[v], |x, w| {
                points.push((x, w));
            });
        }
    }
    let sum: f64 = points.iter().map(|(_, w)| w).sum();
    for (_, share) in &mut points {
        *share /= sum;
    }
    points
}

/// x = t − sin(2πt)/2π and dx/dt.
fn crowd(t: f64) -> (f64, f64) {
    let (sin, cos) = (TAU * t).sin_cos();
    (t - sin / TAU, 1.0 - cos)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_covers_the_polygon() {
        let triangle = [DVec3::ZERO, DVec3::X * 3.0, DVec3::Y];
        let polygon = Polygon::new(&triangle).expect("a triangle");
        for count in [1, 8, 100, 1000] {
            let points = lattice(&polygon, count, [0.1, 0.7]);
            let shares: f64 = points.iter().map(|(_, w)| w).sum();
            assert!((shares - 1.0).abs() < 1e-13, "{count}: {shares}");
            let centre: DVec3 = points.iter().map(|&(x, w)| x * w).sum();
            // Linear functions on a triangle, smooth after the map: far below 1/M.
            let tolerance = 0.3 / count as f64;
            assert!(centre.distance(polygon.centre()) <= tolerance, "{count}");
        }
    }
}
