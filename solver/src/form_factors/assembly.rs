//! The matrix of form factors between polygons that see each other entirely.
//!
//! Each exchange area S_ij = A_i F_ij is computed once, so that A_i F_ij = A_j F_ji holds to the rounding
//! of two divisions. Valid for scenes in which nothing stands between two polygons, such as the inside
//! of a convex room; else see `occluded`. Cost: n²/2 pairs, in parallel, and 8n² bytes.

use super::occluded::{AnalyticFactors, Exchange};
use super::polygon::Polygon;
use super::polygon_to_polygon::exchange_area;
use crate::transport::Dense;
use rayon::prelude::*;

/// F between all polygons with nothing between them, to a relative `accuracy` of each entry.
pub fn unoccluded_matrix(polygons: &[Polygon], accuracy: f64) -> Dense {
    let areas: Vec<f64> = polygons.iter().map(Polygon::area).collect();
    let exchange = |i: usize, j: usize| {
        if i == j {
            return Exchange::default();
        }
        Exchange {
            area: exchange_area(&polygons[i], &polygons[j], accuracy),
            standard_error: 0.0,
        }
    };
    exchange_matrix(&areas, exchange).matrix
}

/// F and its standard errors from the areas A_i (m²) and the exchange areas of pairs i ≤ j.
pub(super) fn exchange_matrix(
    areas: &[f64],
    exchange: impl Fn(usize, usize) -> Exchange + Sync,
) -> AnalyticFactors {
    let n = areas.len();
    // Rows get shorter: single ones are handed out, so that no thread is left with the long ones.
    let rows: Vec<Vec<Exchange>> = (0..n)
        .into_par_iter()
        .with_max_len(1)
        .map(|i| (i..n).map(|j| exchange(i, j)).collect())
        .collect();
    let mut factors = vec![0.0; n * n];
    let mut errors = vec![0.0; n * n];
    for (i, row) in rows.iter().enumerate() {
        for (j, s) in (i..n).zip(row) {
            for (from, to) in [(i, j), (j, i)] {
                // A group without area exchanges nothing.
                let scale = 1.0 / areas[from].max(f64::MIN_POSITIVE);
                factors[from * n + to] = s.area * scale;
                errors[from * n + to] = s.standard_error * scale;
            }
        }
    }
    AnalyticFactors {
        matrix: Dense::new(n, factors).expect("exchange areas are finite and not negative"),
        standard_error: errors,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::report::reciprocity_defect;
    use crate::transport::Transport;
    use glam::DVec3;

    #[test]
    fn a_tetrahedron_is_one_third_everywhere() {
        let v = [
            DVec3::new(1.0, 1.0, 1.0),
            DVec3::new(-1.0, 1.0, -1.0),
            DVec3::new(1.0, -1.0, -1.0),
            DVec3::new(-1.0, -1.0, 1.0),
        ];
        let polygons: Vec<_> = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]
            .iter()
            .map(|f| Polygon::new(&f.map(|k| v[k])).expect("a triangle"))
            .collect();
        let matrix = unoccluded_matrix(&polygons, 1e-11);
        for i in 0..4 {
            for j in 0..4 {
                let exact = if i == j { 0.0 } else { 1.0 / 3.0 };
                // Closed forms only: some tens of roundings.
                assert!((matrix.get(i, j) - exact).abs() < 1e-14, "F[{i}][{j}]");
            }
            assert!((matrix.row_sum(i) - 1.0).abs() < 1e-14, "row {i}");
        }
        let areas = [polygons[0].area(); 4];
        assert!(reciprocity_defect(&matrix, &areas) < 1e-15, "reciprocity");
    }

    #[test]
    fn no_polygons_make_an_empty_matrix() {
        assert!(unoccluded_matrix(&[], 1e-6).is_empty(), "nothing");
    }
}
