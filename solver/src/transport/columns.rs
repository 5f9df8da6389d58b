//! The columns of an operator: where the light of one unknown goes.
//!
//! Column j holds F_ij for all i: shooting B from j adds F_ij B to the irradiance of every i, and a sum
//! over a column is a row of Fᵀ. Operators store rows, so that columns are an index made once for those
//! solvers that shoot: the transpose in compressed form, without zeros. Memory: 12 bytes an entry that
//! is not zero; two passes over the rows.

use super::Transport;

/// F by columns, each in the order of rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns {
    /// First entry of each column, and the number of entries at the end.
    starts: Vec<usize>,
    rows: Vec<u32>,
    factors: Vec<f64>,
}

impl Columns {
    /// Memory of the columns of so many unknowns and entries, in bytes.
    pub fn bytes_for(len: usize, entries: usize) -> usize {
        len * size_of::<usize>() + entries * size_of::<u32>() + entries * size_of::<f64>()
    }

    /// The columns of an operator.
    pub fn new(transport: &dyn Transport) -> Self {
        let n = transport.len();
        // The last row that each column has an entry of: parts of one entry come in a row.
        let none = n;
        let mut last = vec![none; n];
        let mut starts = vec![0_usize; n + 1];
        for row in 0..n {
            transport.visit_row(row, &mut |column, _| {
                if last[column] != row {
                    last[column] = row;
                    starts[column + 1] += 1;
                }
            });
        }
        for column in 0..n {
            starts[column + 1] += starts[column];
        }
        let mut next = starts.clone();
        let mut rows = vec![0_u32; starts[n]];
        let mut factors = vec![0.0; starts[n]];
        last.fill(none);
        for row in 0..n {
            transport.visit_row(row, &mut |column, factor| {
                if last[column] != row {
                    last[column] = row;
                    rows[next[column]] = row as u32;
                    next[column] += 1;
                }
                factors[next[column] - 1] += factor;
            });
        }
        Self {
            starts,
            rows,
            factors,
        }
    }

    /// The rows i of a column j in order, each with F_ij, those left out that are zero.
    ///
    /// # Panics
    /// When `column` is out of range.
    pub fn column(&self, column: usize) -> impl Iterator<Item = (usize, f64)> {
        let entries = self.starts[column]..self.starts[column + 1];
        let rows = self.rows[entries.clone()].iter().map(|&row| row as usize);
        rows.zip(self.factors[entries].iter().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Dense, Row, SparseRows};
    use super::*;

    #[test]
    fn an_empty_operator_has_no_columns() {
        let dense = Dense::new(0, Vec::new()).expect("an empty matrix");
        assert_eq!(Columns::new(&dense).starts, [0], "nothing");
    }

    #[test]
    fn columns_hold_the_matrix() {
        let entries = vec![0.0, 0.25, 0.0, 0.5, 0.125, 0.0, 0.0, 0.75, 0.0];
        let dense = Dense::new(3, entries).expect("a valid matrix");
        let columns = Columns::new(&dense);
        let all: Vec<Vec<_>> = (0..3).map(|c| columns.column(c).collect()).collect();
        assert_eq!(
            all,
            [
                vec![(1, 0.5)],
                vec![(0, 0.25), (1, 0.125), (2, 0.75)],
                vec![]
            ]
        );
    }

    #[test]
    fn rays_of_a_row_that_meet_the_same_unknown_are_one_entry() {
        let row = |first, end, rays| Row { first, end, rays };
        let rows = SparseRows::new(vec![0, 1, 0, 0], vec![row(0, 3, 4), row(3, 4, 2)]);
        let columns = Columns::new(&rows);
        let first: Vec<_> = columns.column(0).collect();
        assert_eq!(first, [(0, 0.5), (1, 0.5)]);
        assert_eq!(columns.column(1).collect::<Vec<_>>(), [(0, 0.25)]);
    }
}
