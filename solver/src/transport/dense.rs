//! The dense transport operator: every F_ij stored.
//!
//! E_i = Σ_j F_ij B_j with F row-major in f64. Cost: 8 n² bytes and n² multiply-adds per channel and
//! gather, bound by memory bandwidth once F leaves the cache; meant for n up to about 20 000.

use super::Transport;
use luxel_scenes::{Irradiance, Radiosity, Rgb};
use rayon::prelude::*;
use thiserror::Error;

/// Why entries do not form a dense operator.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum DenseError {
    /// The number of entries is not the square of the number of unknowns.
    #[error("{entries} entries do not fill a {len} x {len} form-factor matrix")]
    Shape {
        /// Number of unknowns.
        len: usize,
        /// Number of entries given.
        entries: usize,
    },
    /// A form factor is negative or not finite.
    #[error("form factor F[{row}][{column}] = {value} is not a finite number >= 0")]
    Entry {
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        column: usize,
        /// The entry.
        value: f64,
    },
}

/// A form-factor matrix with every entry stored.
#[derive(Clone, Debug, PartialEq)]
pub struct Dense {
    len: usize,
    entries: Vec<f64>,
    row_sums: Vec<f64>,
}

impl Dense {
    /// A matrix from its entries in row-major order.
    ///
    /// # Errors
    /// When the number of entries is not `len`², or an entry is negative or not finite.
    pub fn new(len: usize, entries: Vec<f64>) -> Result<Self, DenseError> {
        if len.checked_mul(len) != Some(entries.len()) {
            return Err(DenseError::Shape {
                len,
                entries: entries.len(),
            });
        }
        if let Some(at) = entries
            .iter()
            .position(|&value| !(value.is_finite() && value >= 0.0))
        {
            return Err(DenseError::Entry {
                row: at / len,
                column: at % len,
                value: entries[at],
            });
        }
        let row_sums = if len == 0 {
            Vec::new()
        } else {
            entries.chunks_exact(len).map(sum).collect()
        };
        Ok(Self {
            len,
            entries,
            row_sums,
        })
    }

    /// Memory of the matrix of so many unknowns, in bytes.
    pub fn bytes_for(len: usize) -> usize {
        len * (len + 1) * size_of::<f64>()
    }

    /// One row of F.
    ///
    /// # Panics
    /// When `row` is out of range.
    pub fn row(&self, row: usize) -> &[f64] {
        &self.entries[row * self.len..(row + 1) * self.len]
    }

    /// F_ij.
    ///
    /// # Panics
    /// When an index is out of range.
    pub fn get(&self, row: usize, column: usize) -> f64 {
        self.row(row)[column]
    }
}

impl Transport for Dense {
    fn len(&self) -> usize {
        self.len
    }

    fn gather(&self, radiosity: &[Radiosity], irradiance: &mut [Irradiance]) {
        assert_eq!(radiosity.len(), self.len, "one radiosity per unknown");
        assert_eq!(irradiance.len(), self.len, "one irradiance per unknown");
        irradiance
            .par_iter_mut()
            .enumerate()
            .for_each(|(row, e)| *e = self.gather_row(row, radiosity));
    }

    fn gather_row(&self, row: usize, radiosity: &[Radiosity]) -> Irradiance {
        assert_eq!(radiosity.len(), self.len, "one radiosity per unknown");
        Irradiance(dot(self.row(row), radiosity))
    }

    fn visit_row(&self, row: usize, visit: &mut dyn FnMut(usize, f64)) {
        for (column, &factor) in self.row(row).iter().enumerate() {
            if factor > 0.0 {
                visit(column, factor);
            }
        }
    }

    fn coupling(&self, row: usize) -> f64 {
        self.get(row, row)
    }

    fn row_sum(&self, row: usize) -> f64 {
        self.row_sums[row]
    }
}

/// Partial sums that run side by side: a single one would wait for the latency of each addition.
const LANES: usize = 4;

/// Σ_j f_j b_j in a fixed order.
fn dot(factors: &[f64], radiosity: &[Radiosity]) -> Rgb {
    let mut lanes = [Rgb::ZERO; LANES];
    let factor_chunks = factors.chunks_exact(LANES);
    let radiosity_chunks = radiosity.chunks_exact(LANES);
    let rest: Rgb = factor_chunks
        .remainder()
        .iter()
        .zip(radiosity_chunks.remainder())
        .map(|(&f, b)| b.0 * f)
        .sum();
    for (fs, bs) in factor_chunks.zip(radiosity_chunks) {
        for lane in 0..LANES {
            lanes[lane] += bs[lane].0 * fs[lane];
        }
    }
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + rest
}

/// Σ_j f_j, Neumaier's compensated sum: row sums are what closure is judged by.
///
/// Source: A. Neumaier, "Rundungsfehleranalyse einiger Verfahren zur Summation endlicher Summen",
/// ZAMM 54, 1974.
fn sum(values: &[f64]) -> f64 {
    let mut total = 0.0_f64;
    let mut lost = 0.0;
    for &value in values {
        let next = total + value;
        lost += if total.abs() >= value.abs() {
            (total - next) + value
        } else {
            (value - next) + total
        };
        total = next;
    }
    total + lost
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix() -> Dense {
        let entries = (0..49).map(|k| f64::from(k * k % 17) / 170.0).collect();
        Dense::new(7, entries).expect("a valid matrix")
    }

    #[test]
    fn gather_is_the_matrix_product_and_agrees_with_rows_to_the_bit() {
        let dense = matrix();
        let radiosity: Vec<_> = (0..7)
            .map(|k| Radiosity::new(f64::from(k), 1.0, f64::from(k * k)))
            .collect();
        let mut irradiance = vec![Irradiance::ZERO; 7];
        dense.gather(&radiosity, &mut irradiance);
        let full = dense.to_dense();
        for row in 0..7 {
            assert_eq!(
                irradiance[row],
                dense.gather_row(row, &radiosity),
                "row {row}"
            );
            let expected: f64 = (0..7).map(|j| full[(row, j)] * radiosity[j].0.x).sum();
            // Seven products and sums round by at most 7 units each.
            assert!(
                (irradiance[row].0.x - expected).abs() <= 14.0 * f64::EPSILON * expected,
                "row {row}"
            );
            assert!(
                (dense.row_sum(row) - irradiance[row].0.y).abs() <= 14.0 * f64::EPSILON,
                "row {row}"
            );
        }
    }

    #[test]
    fn bad_entries_are_named() {
        assert_eq!(
            Dense::new(2, vec![0.0; 3]),
            Err(DenseError::Shape { len: 2, entries: 3 })
        );
        assert_eq!(
            Dense::new(2, vec![0.0, 0.1, -0.5, 0.0]),
            Err(DenseError::Entry {
                row: 1,
                column: 0,
                value: -0.5
            })
        );
        assert!(Dense::new(1, vec![f64::NAN]).is_err(), "NaN is refused");
    }

    #[test]
    fn an_empty_operator_gathers_nothing() {
        let dense = Dense::new(0, Vec::new()).expect("an empty matrix");
        dense.gather(&[], &mut []);
        assert!(dense.is_empty(), "no unknowns");
    }
}
