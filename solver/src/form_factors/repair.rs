//! Repair of closure and reciprocity together, by symmetric scaling.
//!
//! Exchange areas S_ij = A_i F_ij are made symmetric by S ← (S + Sᵀ)/2, then a diagonal D is found such that
//! D S D has the row sums t_i A_i asked for. D S D is symmetric, non-negative, zero where S is, and of all
//! such matrices the one nearest to S in relative entropy.
//!
//! Source: R. Sinkhorn, P. Knopp, "Concerning nonnegative matrices and doubly stochastic matrices",
//! Pacific Journal of Mathematics 21(2), 1967; the damped symmetric iteration
//! d_i ← √(d_i t_i A_i / (S d)_i) is that of P. A. Knight, D. Ruiz, B. Uçar, "A symmetry preserving
//! algorithm for matrix scaling", SIAM Journal on Matrix Analysis 35(3), 2014. Valid where a solution
//! exists: in a closed scene it does unless the defects are gross. Cost: n² per iteration, some tens of
//! iterations.
//!
//! It makes the matrix consistent, not right: an error in one entry is spread over a row and a column.
//! So it is done only on request, and refused where rows miss their target by more than is said to be
//! an error: an open scene's rows sum to less than 1 because light escapes.

use crate::transport::{Dense, Transport};
use rayon::prelude::*;
use thiserror::Error;

/// What rows must sum to after a repair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target<'a> {
    /// 1: nothing escapes.
    Closed,
    /// A value in (0, 1] for each row, known from elsewhere.
    RowSums(&'a [f64]),
}

/// How a repair runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repair<'a> {
    /// What rows must sum to.
    pub target: Target<'a>,
    /// The largest |Σ_j F_ij − target| that counts as an error to be repaired.
    pub max_defect: f64,
    /// The largest |Σ_j F_ij − target| that may be left.
    pub tolerance: f64,
}

/// Why form factors were not repaired.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum RepairError {
    /// A row misses its target by too much to be an error.
    #[error(
        "row {row} sums to {sum} instead of {target}: the scene is open there, or its form factors \
         are wrong; neither is repaired"
    )]
    Defect {
        /// The row.
        row: usize,
        /// Σ_j F_ij.
        sum: f64,
        /// What it should be.
        target: f64,
    },
    /// No scaling gives these row sums.
    #[error("no symmetric scaling reaches the row sums asked for: {defect:e} is left")]
    NoScaling {
        /// The largest defect that is left.
        defect: f64,
    },
}

/// Iterations after which a scaling is held not to exist.
const MAX_ITERATIONS: usize = 10_000;

/// A closed and reciprocal matrix near the one given; `areas` in m².
///
/// # Errors
/// When a row misses its target by more than `max_defect`, or no scaling exists.
///
/// # Panics
/// When there is not one area, or one target, per row.
pub fn repair(matrix: &Dense, areas: &[f64], how: &Repair) -> Result<Dense, RepairError> {
    let n = matrix.len();
    assert_eq!(areas.len(), n, "one area per row");
    let target = |row: usize| match how.target {
        Target::Closed => 1.0,
        Target::RowSums(sums) => sums[row],
    };
    for row in 0..n {
        let (sum, target) = (matrix.row_sum(row), target(row));
        if (sum - target).abs() > how.max_defect {
            return Err(RepairError::Defect { row, sum, target });
        }
    }
    let symmetric =
        |i: usize, j: usize| 0.5 * (areas[i] * matrix.get(i, j) + areas[j] * matrix.get(j, i));
    let exchange: Vec<f64> = (0..n * n)
        .into_par_iter()
        .map(|k| symmetric(k / n, k % n))
        .collect();

    let mut scale = vec![1.0_f64; n];
    let mut sums = vec![0.0; n];
    let mut defect = f64::INFINITY;
    for _ in 0..MAX_ITERATIONS {
        sums.par_iter_mut().enumerate().for_each(|(i, sum)| {
            let row = &exchange[i * n..(i + 1) * n];
            *sum = row.iter().zip(&scale).map(|(s, d)| s * d).sum();
        });
        let now = (0..n)
            .map(|i| (scale[i] * sums[i] / areas[i] - target(i)).abs())
            .fold(
                0.0,
                |worst, d| if d > worst || d.is_nan() { d } else { worst },
            );
        if now.is_nan() {
            // Scales ran off to zero and infinity: there is no solution.
            return Err(RepairError::NoScaling { defect });
        }
        defect = now;
        if defect <= how.tolerance {
            break;
        }
        for i in 0..n {
            scale[i] = (scale[i] * target(i) * areas[i] / sums[i]).sqrt();
        }
    }
    if defect > how.tolerance {
        return Err(RepairError::NoScaling { defect });
    }
    let entries = (0..n * n)
        .into_par_iter()
        .map(|k| {
            let (i, j) = (k / n, k % n);
            // The larger index last, so that both halves round alike.
            scale[i.min(j)] * exchange[k] * scale[i.max(j)] / areas[i]
        })
        .collect();
    Ok(Dense::new(n, entries).expect("scaled factors are finite and not negative"))
}

#[cfg(test)]
mod tests {
    use super::super::report::{closure, reciprocity_defect};
    use super::*;

    const HOW: Repair = Repair {
        target: Target::Closed,
        max_defect: 0.2,
        tolerance: 1e-13,
    };

    #[test]
    fn a_disturbed_closed_matrix_becomes_closed_and_reciprocal() {
        let n = 12;
        let areas: Vec<f64> = (0..n).map(|i| 1.0 + 0.1 * (i % 3) as f64).collect();
        let total: f64 = areas.iter().sum();
        // F_ij = A_j / sum of A as inside a sphere, disturbed by up to 5 %.
        let entries = (0..n * n)
            .map(|k| areas[k % n] / total * (1.0 + 0.05 * ((k * 37 % 19) as f64 / 9.0 - 1.0)))
            .collect();
        let matrix = Dense::new(n, entries).expect("a valid matrix");
        let repaired = repair(&matrix, &areas, &HOW).expect("a scaling exists");
        assert!(closure(&repaired).largest_defect < 1e-12, "closed");
        assert!(reciprocity_defect(&repaired, &areas) < 1e-14, "reciprocal");
        for i in 0..n {
            for j in 0..n {
                let ratio = repaired.get(i, j) / matrix.get(i, j);
                assert!((ratio - 1.0).abs() < 0.2, "near what it was: {ratio}");
            }
        }
    }

    #[test]
    fn an_open_scene_is_not_closed_by_force() {
        let matrix = Dense::new(2, vec![0.0, 0.3, 0.3, 0.0]).expect("a valid matrix");
        assert_eq!(
            repair(&matrix, &[1.0, 1.0], &HOW),
            Err(RepairError::Defect {
                row: 0,
                sum: 0.3,
                target: 1.0
            })
        );
        let how = Repair {
            target: Target::RowSums(&[0.31, 0.31]),
            ..HOW
        };
        let repaired = repair(&matrix, &[1.0, 1.0], &how).expect("a scaling exists");
        assert!((repaired.get(0, 1) - 0.31).abs() < 1e-12, "as asked for");
    }

    #[test]
    fn what_has_no_scaling_is_said_so() {
        // A patch of area 2 cannot be closed by one of area 1.
        let matrix = Dense::new(2, vec![0.0, 0.9, 0.9, 0.0]).expect("a valid matrix");
        assert!(
            matches!(
                repair(&matrix, &[2.0, 1.0], &HOW),
                Err(RepairError::NoScaling { .. })
            ),
            "no scaling"
        );
    }
}
