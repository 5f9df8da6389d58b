//! Sparse rows: each row is the list of unknowns that its rays met.
//!
//! E_i = (1/N_i) Σ_k B_{hit(i,k)}: a ray-cast row is stored as raw hit ids, four bytes a ray, not
//! sorted and not merged, because a gather is bound by the memory that it reads and merging costs
//! more than it saves. Rays that met nothing count in N_i and add nothing. Memory: 4 bytes a ray;
//! a gather costs about 2 ns a ray.

use super::Transport;
use luxel_scenes::{Irradiance, Radiosity, Rgb};
use rayon::prelude::*;
use std::ops::Range;

/// Rows per parallel task.
const CHUNK: usize = 256;

/// The range of entries that makes up a row, and the number of rays that it stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// First entry.
    pub first: usize,
    /// One past the last entry.
    pub end: usize,
    /// Rays cast, at least the number of entries.
    pub rays: u32,
}

impl Row {
    fn entries(self) -> Range<usize> {
        self.first..self.end
    }
}

/// Ray-cast rows.
#[derive(Clone, Debug, Default)]
pub struct SparseRows {
    entries: Vec<u32>,
    rows: Vec<Row>,
}

impl SparseRows {
    /// An operator from its entries (unknowns) and rows. Rows may share entries.
    ///
    /// # Panics
    /// When a row reaches outside the entries, has fewer rays than entries, or an entry is not an
    /// unknown.
    pub fn new(entries: Vec<u32>, rows: Vec<Row>) -> Self {
        assert!(
            rows.iter().all(|row| row.first <= row.end
                && row.end <= entries.len()
                && row.entries().len() <= row.rays as usize),
            "rows lie within the entries and count their rays"
        );
        assert!(
            entries.iter().all(|&entry| (entry as usize) < rows.len()),
            "entries are unknowns"
        );
        Self { entries, rows }
    }

    /// Memory of so many rows and entries, in bytes.
    pub fn bytes_for(rows: usize, entries: usize) -> usize {
        rows * size_of::<Row>() + entries * size_of::<u32>()
    }

    /// Rays of a row; zero for a row that was not cast.
    pub fn rays(&self, row: usize) -> u32 {
        self.rows[row].rays
    }
}

impl Transport for SparseRows {
    fn len(&self) -> usize {
        self.rows.len()
    }

    fn gather(&self, radiosity: &[Radiosity], irradiance: &mut [Irradiance]) {
        assert_eq!(radiosity.len(), self.len(), "one radiosity per unknown");
        assert_eq!(irradiance.len(), self.len(), "one irradiance per unknown");
        irradiance
            .par_chunks_mut(CHUNK)
            .enumerate()
            .for_each(|(chunk, out)| {
                for (offset, e) in out.iter_mut().enumerate() {
                    *e = self.gather_row(chunk * CHUNK + offset, radiosity);
                }
            });
    }

    fn gather_row(&self, row: usize, radiosity: &[Radiosity]) -> Irradiance {
        assert_eq!(radiosity.len(), self.len(), "one radiosity per unknown");
        let row = self.rows[row];
        if row.rays == 0 {
            return Irradiance::ZERO;
        }
        let sum: Rgb = self.entries[row.entries()]
            .iter()
            .map(|&entry| radiosity[entry as usize].0)
            .sum();
        Irradiance(sum / f64::from(row.rays))
    }

    fn visit_row(&self, row: usize, visit: &mut dyn FnMut(usize, f64)) {
        let row = self.rows[row];
        let share = 1.0 / f64::from(row.rays.max(1));
        for &entry in &self.entries[row.entries()] {
            visit(entry as usize, share);
        }
    }

    fn coupling(&self, row: usize) -> f64 {
        let range = self.rows[row];
        let own = self.entries[range.entries()]
            .iter()
            .filter(|&&entry| entry as usize == row);
        own.count() as f64 / f64::from(range.rays.max(1))
    }

    fn row_sum(&self, row: usize) -> f64 {
        let row = self.rows[row];
        row.entries().len() as f64 / f64::from(row.rays.max(1))
    }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "small rationals are exact in these rows")]
mod tests {
    use super::*;

    /// Two unknowns: the first sends three rays (itself, the second, out of the scene), the second
    /// two rays to the first.
    fn rows() -> SparseRows {
        SparseRows::new(
            vec![0, 1, 0, 0],
            vec![
                Row {
                    first: 0,
                    end: 2,
                    rays: 3,
                },
                Row {
                    first: 2,
                    end: 4,
                    rays: 2,
                },
            ],
        )
    }

    #[test]
    fn no_rows_gather_nothing() {
        let rows = SparseRows::new(Vec::new(), Vec::new());
        rows.gather(&[], &mut []);
        assert!(rows.is_empty());
    }

    #[test]
    fn a_row_is_the_mean_over_its_rays() {
        let rows = rows();
        let radiosity = [Radiosity::splat(6.0), Radiosity::splat(3.0)];
        let mut irradiance = [Irradiance::ZERO; 2];
        rows.gather(&radiosity, &mut irradiance);
        assert_eq!(irradiance, [Irradiance::splat(3.0), Irradiance::splat(6.0)]);
        assert_eq!(rows.row_sum(0), 2.0 / 3.0);
        assert_eq!(rows.coupling(0), 1.0 / 3.0);
        assert_eq!(rows.coupling(1), 0.0);
    }

    #[test]
    fn the_matrix_gathers_the_same() {
        let rows = rows();
        let matrix = rows.to_dense();
        let radiosity = [Radiosity::splat(0.25), Radiosity::splat(8.0)];
        for row in 0..2 {
            let expected = matrix[(row, 0)] * 0.25 + matrix[(row, 1)] * 8.0;
            let gathered = rows.gather_row(row, &radiosity).0.x;
            // Three roundings of numbers below 8.
            assert!((gathered - expected).abs() < 4.0 * f64::EPSILON * 8.0);
        }
    }

    #[test]
    fn a_row_without_rays_is_dark() {
        let rows = SparseRows::new(
            Vec::new(),
            vec![Row {
                first: 0,
                end: 0,
                rays: 0,
            }],
        );
        assert_eq!(
            rows.gather_row(0, &[Radiosity::splat(1.0)]),
            Irradiance::ZERO
        );
        assert_eq!(rows.row_sum(0), 0.0);
    }
}
