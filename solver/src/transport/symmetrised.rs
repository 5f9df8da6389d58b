//! A reciprocal operator from one that is not.
//!
//! Form factors of rays and hemicubes obey A_i F_ij = A_j F_ji only within their errors. Both sides
//! estimate the same exchange area, and
//!
//! S_ij = A_i A_j (F_ij + F_ji) / (A_i + A_j), F'_ij = S_ij / A_i = A_j (F_ij + F_ji) / (A_i + A_j)
//!
//! weighs them by the inverse of the areas: with the same number of rays a row, the variance of A_i F_ij
//! is A_i S_ij / N, so that these are the weights of least variance, and the few rays of a large patch
//! that meet a small one do not disturb the row of the small one. Reciprocal factors stay as they are.
//! F' is as unbiased as F. What it does not keep are row sums: those of a closed scene, exactly 1
//! for rays and hemicubes, come to scatter about 1 by the errors of the factors; nothing here
//! rescales them. Cost: one pass over rows and columns; 12 bytes an entry that is not zero.

use super::{Columns, Transport};
use luxel_scenes::{Irradiance, Radiosity};
use rayon::prelude::*;

/// An operator whose factors are reciprocal to rounding.
#[derive(Clone, Debug, PartialEq)]
pub struct Symmetrised {
    /// First entry of each row, and the number of entries at the end.
    starts: Vec<usize>,
    columns: Vec<u32>,
    factors: Vec<f64>,
    row_sums: Vec<f64>,
}

impl Symmetrised {
    /// The reciprocal operator next to `transport`, for unknowns of the given areas in any unit.
    ///
    /// # Panics
    /// When there is not one area for each unknown.
    pub fn new(transport: &dyn Transport, areas: &[f64]) -> Self {
        let n = transport.len();
        assert_eq!(areas.len(), n, "one area per unknown");
        let columns = Columns::new(transport);
        let rows: Vec<Vec<(u32, f64)>> = (0..n)
            .into_par_iter()
            .map_init(
                || vec![0.0_f64; n],
                |sums, i| {
                    let mut seen = Vec::new();
                    let mut add = |j: usize, factor: f64| {
                        if factor > 0.0 {
                            if sums[j] == 0.0 {
                                seen.push(j as u32);
                            }
                            sums[j] += factor;
                        }
                    };
                    transport.visit_row(i, &mut add);
                    columns.column(i).for_each(|(j, factor)| add(j, factor));
                    seen.sort_unstable();
                    seen.into_iter()
                        .map(|j| {
                            let both = std::mem::take(&mut sums[j as usize]);
                            let (own, other) = (areas[i], areas[j as usize]);
                            // Unknowns without area exchange nothing.
                            let share = other / (own + other).max(f64::MIN_POSITIVE);
                            (j, share * both)
                        })
                        .collect()
                },
            )
            .collect();
        let mut starts = vec![0; n + 1];
        for (row, entries) in rows.iter().enumerate() {
            starts[row + 1] = starts[row] + entries.len();
        }
        let row_sums = rows
            .iter()
            .map(|row| row.iter().map(|&(_, factor)| factor).sum())
            .collect();
        let (columns, factors) = rows.into_iter().flatten().unzip();
        Self {
            starts,
            columns,
            factors,
            row_sums,
        }
    }

    /// The columns of a row, each with its factor.
    fn entries(&self, row: usize) -> impl Iterator<Item = (usize, f64)> {
        let entries = self.starts[row]..self.starts[row + 1];
        let columns = self.columns[entries.clone()].iter().map(|&c| c as usize);
        columns.zip(self.factors[entries].iter().copied())
    }
}

impl Transport for Symmetrised {
    fn len(&self) -> usize {
        self.row_sums.len()
    }

    fn gather(&self, radiosity: &[Radiosity], irradiance: &mut [Irradiance]) {
        assert_eq!(irradiance.len(), self.len(), "one irradiance per unknown");
        irradiance
            .par_iter_mut()
            .enumerate()
            .for_each(|(row, e)| *e = self.gather_row(row, radiosity));
    }

    fn gather_row(&self, row: usize, radiosity: &[Radiosity]) -> Irradiance {
        assert_eq!(radiosity.len(), self.len(), "one radiosity per unknown");
        let terms = self.entries(row).map(|(j, factor)| radiosity[j].0 * factor);
        Irradiance(terms.sum())
    }

    fn visit_row(&self, row: usize, visit: &mut dyn FnMut(usize, f64)) {
        self.entries(row).for_each(|(j, factor)| visit(j, factor));
    }

    fn row_sum(&self, row: usize) -> f64 {
        self.row_sums[row]
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Dense, Row, SparseRows};
    use super::*;

    #[test]
    fn factors_become_reciprocal_and_keep_what_is() {
        let areas = [1.0, 3.0, 0.5];
        // The pair 0, 1 is reciprocal, the others are not, and 2 sees itself.
        let entries = vec![0.0, 0.3, 0.1, 0.1, 0.0, 0.2, 0.4, 0.0, 0.05];
        let dense = Dense::new(3, entries).expect("a valid matrix");
        let reciprocal = Symmetrised::new(&dense, &areas).to_dense();
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            let (there, back) = (areas[i] * reciprocal[(i, j)], areas[j] * reciprocal[(j, i)]);
            // Two products and a quotient round.
            assert!((there / back - 1.0).abs() < 1e-15, "pair {i}, {j}");
        }
        for (i, j, exact) in [
            (0, 1, 0.3),
            (1, 0, 0.1),
            (2, 2, 0.05),
            // 0.5 / 1.5 of the sum 0.1 + 0.4.
            (0, 2, 0.5 / 3.0),
            // Seen from one side only: 0.5 / 3.5 of 0.2.
            (1, 2, 0.1 / 3.5),
        ] {
            assert!(
                (reciprocal[(i, j)] - exact).abs() < 1e-15,
                "F[{i}][{j}] = {}",
                reciprocal[(i, j)]
            );
        }
    }

    #[test]
    fn gathers_and_rows_agree_to_the_bit_on_rays() {
        let row = |first, end, rays| Row { first, end, rays };
        let rows = SparseRows::new(
            vec![0, 1, 2, 0, 0, 1],
            vec![row(0, 3, 4), row(3, 5, 2), row(5, 6, 3)],
        );
        let reciprocal = Symmetrised::new(&rows, &[1.0, 2.0, 4.0]);
        let radiosity = [1.0, 0.3, 7.0].map(Radiosity::splat);
        let mut irradiance = [Irradiance::ZERO; 3];
        reciprocal.gather(&radiosity, &mut irradiance);
        let ones = [Radiosity::splat(1.0); 3];
        for (i, &e) in irradiance.iter().enumerate() {
            assert_eq!(e, reciprocal.gather_row(i, &radiosity), "row {i}");
            let sum = reciprocal.gather_row(i, &ones).0.x;
            assert_eq!(sum.to_bits(), reciprocal.row_sum(i).to_bits(), "row {i}");
        }
    }

    #[test]
    fn unknowns_without_area_exchange_nothing() {
        let dense = Dense::new(2, vec![0.0, 0.5, 0.5, 0.0]).expect("a valid matrix");
        let reciprocal = Symmetrised::new(&dense, &[0.0, 0.0]);
        assert!(reciprocal.row_sum(0) == 0.0, "no area, no exchange");
        let empty = Dense::new(0, Vec::new()).expect("an empty matrix");
        assert!(Symmetrised::new(&empty, &[]).is_empty(), "nothing");
    }
}
