//! Transport operators: E = F B, light gathered over all unknowns.
//!
//! An unknown is one side of a patch. F_ij is the fraction of the flux leaving i that arrives at j,
//! so that a row gathers: E_i = Σ_j F_ij B_j. Solvers see an operator through [`Transport`] only.

mod columns;
mod dense;
mod sparse_rows;
mod symmetrised;

pub use columns::Columns;
pub use dense::{Dense, DenseError};
pub use sparse_rows::{Row, SparseRows};
pub use symmetrised::Symmetrised;

use luxel_scenes::{Irradiance, Radiosity};
use nalgebra::DMatrix;

/// The linear operator E = F B on the unknowns 0..len.
///
/// All three channels share one F. Implementations are deterministic: the same input gives the same
/// bits at any thread count, which asks for disjoint outputs and sums in a fixed order, and
/// [`Transport::gather`] and [`Transport::gather_row`] agree to the bit.
pub trait Transport: Sync {
    /// Number of unknowns.
    fn len(&self) -> usize;

    /// True without unknowns.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// E = F B over all rows, in parallel; radiosity and irradiance in W/m².
    ///
    /// # Panics
    /// When the slices are not [`Transport::len`] long.
    fn gather(&self, radiosity: &[Radiosity], irradiance: &mut [Irradiance]);

    /// E_i = Σ_j F_ij B_j of one row in W/m²: what Gauss–Seidel needs.
    ///
    /// # Panics
    /// When `row` is out of range or the slice is not [`Transport::len`] long.
    fn gather_row(&self, row: usize, radiosity: &[Radiosity]) -> Irradiance;

    /// Calls `visit` with (j, F_ij) for every F_ij of a row that is not zero. A factor may come in
    /// several parts, one for each ray.
    ///
    /// # Panics
    /// When `row` is out of range.
    fn visit_row(&self, row: usize, visit: &mut dyn FnMut(usize, f64));

    /// F_ii, zero for planar patches.
    fn coupling(&self, row: usize) -> f64 {
        let mut own = 0.0;
        self.visit_row(row, &mut |column, factor| {
            if column == row {
                own += factor;
            }
        });
        own
    }

    /// Σ_j F_ij: one in a closed scene, less where light escapes.
    fn row_sum(&self, row: usize) -> f64;

    /// F as a matrix, for direct solvers and comparison; n² numbers.
    fn to_dense(&self) -> DMatrix<f64> {
        let n = self.len();
        let mut matrix = DMatrix::zeros(n, n);
        for row in 0..n {
            self.visit_row(row, &mut |column, factor| matrix[(row, column)] += factor);
        }
        matrix
    }
}
