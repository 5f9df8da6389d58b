//! Form factors between patches by hemicubes at several origins on each.
//!
//! F_ij = (1/A_i) ∫ F(x → j) dA over M origins x in a Fibonacci lattice, places (k/M, k F/M) with M and F
//! neighbouring Fibonacci numbers, each coordinate mapped by t − sin(2πt)/2π. The map makes the integrand
//! periodic and crowds origins towards the edges as their distance cubed, where F varies quickly next to
//! touching or nearly touching patches; the lattice shows M different values in each coordinate, so
//! that steps of F (the shadow of an edge) cost O(1/M), kinks O(1/M²), and smooth functions less.
//!
//! Sources: I. H. Sloan, S. Joe, "Lattice Methods for Multiple Integration", 1994, chapters 2 and 5;
//! A. Sidi, "A new variable transformation for numerical integration", 1993. Cost: M hemicubes a patch.

use super::super::area::{points_of, quads};
use super::super::polygon::Polygon;
use super::raster::{Facet, Hemicube};
use crate::transport::Dense;
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, TAU};

/// How fine hemicubes are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HemicubeConfig {
    /// Pixels along an edge of the cube, an even number.
    pub resolution: usize,
    /// Hemicubes on each quadrilateral piece of a patch, rounded up to a Fibonacci number.
    pub origins: usize,
}

impl HemicubeConfig {
    /// A resolution with a quarter as many origins, as lets the two errors fall together: aliasing
    /// as N⁻¹ or faster, the rule over the patch as M⁻¹ or faster.
    pub fn balanced(resolution: usize) -> Self {
        Self {
            resolution,
            origins: (resolution / 4).max(1),
        }
    }
}

/// Where the lattice of origins starts: anywhere, but not where symmetric scenes put their planes.
const SHIFT: [f64; 2] = [0.414_213_562_373_095, 0.236_067_977_499_79];

/// The golden ratio less one: angles k·φ mod 1 of successive origins are spread evenly.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// F between patches. `facets` are the polygons that are seen and occlude, naming patches by index;
/// those of the patches themselves are among them.
///
/// Biased as the module says. Deterministic.
///
/// # Panics
/// When a facet names a patch that does not exist.
pub fn hemicube(patches: &[Polygon], facets: &[Facet], config: &HemicubeConfig) -> Dense {
    let n = patches.len();
    let prototype = Hemicube::new(config.resolution);
    let rows: Vec<Vec<f64>> = patches
        .par_iter()
        .map_init(
            || prototype.clone(),
            |cube, patch| {
                let mut row = vec![0.0; n];
                let mut turn = 0.0;
                for (origin, weight) in origins(patch, config.origins) {
                    turn = (turn + GOLDEN) % 1.0;
                    let angle = turn * FRAC_PI_2;
                    cube.add(origin, patch.normal(), angle, facets, weight, &mut row);
                }
                row
            },
        )
        .collect();
    Dense::new(n, rows.concat()).expect("pixel form factors are finite and not negative")
}

/// Origins on a patch, `count` or more on each quadrilateral piece, and their shares, which sum to 1;
/// a single one is the centre.
fn origins(patch: &Polygon, count: usize) -> Vec<(DVec3, f64)> {
    if count <= 1 {
        return vec![(patch.centre(), 1.0)];
    }
    // Neighbouring Fibonacci numbers; below 5 the lattice degenerates to a diagonal.
    let (mut step, mut points) = (3, 5);
    while points < count {
        (step, points) = (points, step + points);
    }
    let mut origins = Vec::with_capacity(points);
    for quad in quads(patch) {
        for k in 0..points {
            let place = |multiple: usize, shift: f64| {
                crowd(((k * multiple) as f64 / points as f64 + shift).fract())
            };
            let (u, v) = (place(1, SHIFT[0]), place(step, SHIFT[1]));
            points_of(&quad, patch.normal(), &[u], &[v], |x, w| {
                origins.push((x, w));
            });
        }
    }
    let sum: f64 = origins.iter().map(|(_, w)| w).sum();
    for (_, weight) in &mut origins {
        *weight /= sum;
    }
    origins
}

/// x = t − sin(2πt)/2π and dx/dt: crowds towards both ends as their distance cubed.
fn crowd(t: f64) -> (f64, f64) {
    let (sin, cos) = (TAU * t).sin_cos();
    (t - sin / TAU, 1.0 - cos)
}

#[cfg(test)]
mod tests {
    use super::super::super::{polygon_to_polygon, reciprocity_defect_of_largest};
    use super::*;
    use crate::transport::Transport;

    #[test]
    fn origins_cover_the_patch() {
        let triangle = [DVec3::ZERO, DVec3::X * 3.0, DVec3::Y];
        let patch = Polygon::new(&triangle).expect("a triangle");
        for count in [1, 8, 100] {
            let origins = origins(&patch, count);
            let shares: f64 = origins.iter().map(|(_, w)| w).sum();
            assert!((shares - 1.0).abs() < 1e-14, "{count}: {shares}");
            let centre: DVec3 = origins.iter().map(|&(x, w)| x * w).sum();
            // Linear functions on a triangle, smooth after the map: far below 1/M.
            let tolerance = 0.3 / count as f64;
            assert!(centre.distance(patch.centre()) <= tolerance, "{count}");
        }
    }

    #[test]
    fn a_closed_cube_is_closed_exactly_and_right_at_first_order() {
        let o = DVec3::ZERO;
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        let faces: Vec<_> = [
            [o, y, y + z, z],
            [x, x + z, x + y + z, x + y],
            [o, z, x + z, x],
            [y, x + y, x + y + z, y + z],
            [o, x, x + y, y],
            [z, y + z, x + y + z, x + z],
        ]
        .iter()
        .map(|f| Polygon::new(f).expect("a face"))
        .collect();
        let facets: Vec<_> = faces
            .iter()
            .enumerate()
            .map(|(k, f)| Facet {
                vertices: f.vertices(),
                normal: f.normal(),
                front: Some(k as u32),
                back: None,
            })
            .collect();
        for resolution in [32, 64, 128] {
            let matrix = hemicube(&faces, &facets, &HemicubeConfig::balanced(resolution));
            let areas = [1.0; 6];
            for i in 0..6 {
                // Pixels sum to 1, weights of the origins to the area.
                assert!((matrix.row_sum(i) - 1.0).abs() < 1e-12, "{resolution}");
                for j in 0..6 {
                    let exact = polygon_to_polygon(&faces[i], &faces[j], 1e-10);
                    let e = (matrix.get(i, j) - exact).abs();
                    // Order one, with a constant of 1/2 where 1/4 was measured.
                    assert!(e <= 0.5 / resolution as f64, "{resolution} {i} {j}: {e}");
                }
            }
            let defect = reciprocity_defect_of_largest(&matrix, &areas);
            // Two entries, each wrong by 0.5/N, against the largest, 0.2.
            assert!(defect <= 5.0 / resolution as f64, "{resolution}: {defect}");
        }
    }
}
