//! Form factors between patches by hemicubes at several origins on each.
//!
//! F_ij = (1/A_i) ∫ F(x → j) dA over M origins x in a crowded lattice (see `lattice`). Cost: M hemicubes a
//! patch.

use super::super::lattice::lattice;
use super::super::polygon::Polygon;
use super::raster::{Facet, Hemicube};
use crate::transport::Dense;
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::FRAC_PI_2;

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

/// F between polygons. `facets` are what is seen and occludes, naming polygons by index; those of the
/// polygons themselves are among them.
///
/// Biased as the module says. Deterministic.
///
/// # Panics
/// When a facet names a polygon that does not exist.
pub fn hemicube(polygons: &[Polygon], facets: &[Facet], config: &HemicubeConfig) -> Dense {
    hemicube_rows(polygons.len(), facets, config, |i| &polygons[i..=i])
}

/// The same between patches of any number of polygons.
pub(in super::super) fn hemicube_of(
    patches: &[Vec<Polygon>],
    facets: &[Facet],
    config: &HemicubeConfig,
) -> Dense {
    hemicube_rows(patches.len(), facets, config, |i| &patches[i])
}

fn hemicube_rows<'a>(
    n: usize,
    facets: &[Facet],
    config: &HemicubeConfig,
    patch: impl Fn(usize) -> &'a [Polygon] + Sync,
) -> Dense {
    let prototype = Hemicube::new(config.resolution);
    let mut entries = vec![0.0; n * n];
    let rows = entries.par_chunks_mut(n.max(1)).enumerate();
    rows.for_each_init(
        || prototype.clone(),
        |cube, (i, row)| {
            let mut turn = 0.0;
            let area: f64 = patch(i).iter().map(Polygon::area).sum();
            for polygon in patch(i) {
                // An origin lies on its own polygon up to rounding: seen from 1e-17 behind, that
                // would hide everything.
                let others: Vec<Facet> = facets
                    .iter()
                    .filter(|facet| facet.vertices != polygon.vertices())
                    .copied()
                    .collect();
                for (origin, share) in origins(polygon, config.origins) {
                    turn = (turn + GOLDEN) % 1.0;
                    let angle = turn * FRAC_PI_2;
                    let weight = share * polygon.area() / area;
                    cube.add(origin, polygon.normal(), angle, &others, weight, row);
                }
            }
        },
    );
    Dense::new(n, entries).expect("pixel form factors are finite and not negative")
}

/// Origins on a patch and their shares; a single one is the centre.
fn origins(patch: &Polygon, count: usize) -> Vec<(DVec3, f64)> {
    if count <= 1 {
        vec![(patch.centre(), 1.0)]
    } else {
        lattice(patch, count, SHIFT)
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::{polygon_to_polygon, reciprocity_defect_of_largest};
    use super::super::raster::FacetSide;
    use super::*;
    use crate::transport::Transport;

    /// A closed box in a position where no coordinate is round: the points of a wall lie on its plane only
    /// up to rounding, and neither the wall nor its neighbours may hide the box from them.
    #[test]
    fn a_turned_box_is_closed_exactly() {
        let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 0.7, 1.1);
        let at = |x: f64, y: f64, z: f64| turn * DVec3::new(x, 0.7 * y, 1.3 * z) + 0.1;
        let walls = [
            [
                at(0., 0., 0.),
                at(0., 1., 0.),
                at(0., 1., 1.),
                at(0., 0., 1.),
            ],
            [
                at(1., 0., 0.),
                at(1., 0., 1.),
                at(1., 1., 1.),
                at(1., 1., 0.),
            ],
            [
                at(0., 0., 0.),
                at(0., 0., 1.),
                at(1., 0., 1.),
                at(1., 0., 0.),
            ],
            [
                at(0., 1., 0.),
                at(1., 1., 0.),
                at(1., 1., 1.),
                at(0., 1., 1.),
            ],
            [
                at(0., 0., 0.),
                at(1., 0., 0.),
                at(1., 1., 0.),
                at(0., 1., 0.),
            ],
            [
                at(0., 0., 1.),
                at(0., 1., 1.),
                at(1., 1., 1.),
                at(1., 0., 1.),
            ],
        ];
        let polygons = walls.map(|corners| Polygon::new(&corners).expect("a rectangle"));
        let facets: Vec<Facet> = polygons
            .iter()
            .enumerate()
            .map(|(index, polygon)| Facet {
                vertices: polygon.vertices(),
                normal: polygon.normal(),
                front: FacetSide::Counted(index as u32),
                back: FacetSide::Black,
            })
            .collect();
        let matrix = hemicube(&polygons, &facets, &HemicubeConfig::balanced(64));
        for wall in 0..6 {
            // A sum of 64 pixels squared, each exact to rounding.
            assert!(
                (matrix.row_sum(wall) - 1.0).abs() < 1e-12,
                "{}",
                matrix.row_sum(wall)
            );
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
                front: FacetSide::Counted(k as u32),
                back: FacetSide::Black,
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
