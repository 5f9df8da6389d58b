//! How far form factors are from what physics asks: closure and reciprocity.
//!
//! In a closed scene every row sums to 1 (what leaves arrives), and everywhere A_i F_ij = A_j F_ji. Both
//! are reported as they are; nothing here repairs them. Cost: one pass over the matrix.

use crate::transport::{Dense, Transport};

/// Row sums and how far they are from a closed scene's.
#[derive(Clone, Debug, PartialEq)]
pub struct Closure {
    /// Σ_j F_ij of each row.
    pub row_sums: Vec<f64>,
    /// max_i |Σ_j F_ij − 1|; in an open scene this includes what escapes.
    pub largest_defect: f64,
    /// max_i (Σ_j F_ij − 1): above rounding it is an error in an open scene, too.
    pub largest_excess: f64,
}

/// The closure of an operator.
pub fn closure(transport: &dyn Transport) -> Closure {
    let row_sums: Vec<f64> = (0..transport.len()).map(|i| transport.row_sum(i)).collect();
    let fold = |of: fn(f64) -> f64| row_sums.iter().map(|&s| of(s - 1.0)).fold(0.0, f64::max);
    Closure {
        largest_defect: fold(f64::abs),
        largest_excess: fold(|defect| defect),
        row_sums,
    }
}

/// max |A_i F_ij − A_j F_ji| / max(A_i F_ij, A_j F_ji) over all pairs, in [0, 1]; `areas` in m².
///
/// Sampled form factors of pairs that hardly see each other make it large; analytic ones keep it at
/// rounding.
///
/// # Panics
/// When there is not one area per row.
pub fn reciprocity_defect(matrix: &Dense, areas: &[f64]) -> f64 {
    let mut worst = 0.0_f64;
    for_each_pair(matrix, areas, |there, back| {
        let larger = there.max(back);
        if larger > 0.0 {
            worst = worst.max((there - back).abs() / larger);
        }
    });
    worst
}

/// max |A_i F_ij − A_j F_ji| / max A_i F_ij over all pairs: the same against the largest exchange of the
/// scene, the measure for sampled form factors; `areas` in m².
///
/// # Panics
/// When there is not one area per row.
pub fn reciprocity_defect_of_largest(matrix: &Dense, areas: &[f64]) -> f64 {
    let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
    for_each_pair(matrix, areas, |there, back| {
        worst = worst.max((there - back).abs());
        largest = largest.max(there).max(back);
    });
    if largest > 0.0 { worst / largest } else { 0.0 }
}

/// Calls `visit` with A_i F_ij and A_j F_ji of all pairs i < j.
fn for_each_pair(matrix: &Dense, areas: &[f64], mut visit: impl FnMut(f64, f64)) {
    assert_eq!(areas.len(), matrix.len(), "one area per row");
    for i in 0..areas.len() {
        for j in i + 1..areas.len() {
            visit(areas[i] * matrix.get(i, j), areas[j] * matrix.get(j, i));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defects_are_measured_as_they_are() {
        let matrix = Dense::new(2, vec![0.0, 0.5, 0.2, 0.9]).expect("a valid matrix");
        let report = closure(&matrix);
        assert!(
            (report.largest_defect - 0.5).abs() < 1e-15,
            "row 0 misses half"
        );
        assert!(
            (report.largest_excess - 0.1).abs() < 1e-15,
            "row 1 has too much"
        );
        // Exchange areas 0.5 there and 0.4 back; the largest, of row 1 with itself, is no pair.
        let areas = [1.0, 2.0];
        assert!(
            (reciprocity_defect(&matrix, &areas) - 0.2).abs() < 1e-15,
            "pair"
        );
        assert!(
            (reciprocity_defect_of_largest(&matrix, &areas) - 0.2).abs() < 1e-15,
            "scene"
        );
    }
}
