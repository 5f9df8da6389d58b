//! Results in a table of points: what a probe wrote there, read back.

use super::Estimate;
use super::{OUTPUT, PointTable, PointsError, number};
use luxel_scenes::Rgb;
use std::path::Path;

impl PointTable {
    /// The results in the columns `e_r,e_g,e_b` with the standard errors in `se_r,se_g,se_b`, and whether
    /// the table has standard errors (zero where it has not); `path` is its name in errors.
    ///
    /// # Errors
    /// When a column is missing while others of its kind are there or needed, when a field holds no
    /// finite number, or when a standard error is negative.
    pub fn estimates(&self, path: &Path) -> Result<(Vec<Estimate>, bool), PointsError> {
        let column = |name: &str| self.header.iter().position(|own| own.trim() == name);
        let columns = OUTPUT.map(|name| (name, column(name)));
        let states_error = columns[3..].iter().any(|(_, index)| index.is_some());
        let needed = if states_error {
            &columns[..]
        } else {
            &columns[..3]
        };
        let mut indices = Vec::with_capacity(needed.len());
        for &(column, index) in needed {
            let missing = || PointsError::NoResult {
                path: path.to_path_buf(),
                column,
            };
            indices.push((column, index.ok_or_else(missing)?));
        }
        let mut estimates = Vec::with_capacity(self.records.len());
        for record in &self.records {
            let mut values = [0.0; 6];
            for (value, &(column, index)) in values.iter_mut().zip(&indices) {
                *value = number(record, index, column, path)?;
                if *value < 0.0 && column.starts_with("se_") {
                    return Err(PointsError::NotANumber {
                        path: path.to_path_buf(),
                        line: record.position().map_or(0, csv::Position::line),
                        column,
                        text: record[index].to_owned(),
                    });
                }
            }
            let [r, g, b, se_r, se_g, se_b] = values;
            estimates.push(Estimate {
                value: Rgb::new(r, g, b),
                standard_error: Rgb::new(se_r, se_g, se_b),
            });
        }
        Ok((estimates, states_error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<(Vec<Estimate>, bool), PointsError> {
        let path = Path::new("r.csv");
        PointTable::parse(text.as_bytes(), path)?.estimates(path)
    }

    #[test]
    fn results_are_read_back() {
        let text = "e_b,x,y,z,nx,ny,nz,e_r,e_g\n3,0,0,0,0,0,1,1,2\n";
        let (estimates, states_error) = read(text).expect("results");
        assert_eq!(estimates[0].value, Rgb::new(1.0, 2.0, 3.0));
        assert!(!states_error && estimates[0].standard_error == Rgb::ZERO);
        let text = "x,y,z,nx,ny,nz,e_r,e_g,e_b,se_r,se_g,se_b\n0,0,0,0,0,1,1,2,3,0.1,0.2,0.3\n";
        let (estimates, states_error) = read(text).expect("results");
        assert!(states_error);
        assert_eq!(estimates[0].standard_error, Rgb::new(0.1, 0.2, 0.3));
    }

    #[test]
    fn what_is_missing_or_no_number_is_named() {
        let message = |text: &str| read(text).expect_err("no results").to_string();
        let none = message("x,y,z,nx,ny,nz\n0,0,0,0,0,1\n");
        assert!(none.contains("r.csv") && none.contains("\"e_r\""), "{none}");
        let half = message("x,y,z,nx,ny,nz,e_r,e_g,e_b,se_r\n0,0,0,0,0,1,1,1,1,0\n");
        assert!(half.contains("\"se_g\""), "{half}");
        let header = "x,y,z,nx,ny,nz,e_r,e_g,e_b,se_r,se_g,se_b\n";
        let nan = message(&format!("{header}0,0,0,0,0,1,1,NaN,1,0,0,0\n"));
        assert!(nan.contains("line 2: e_g is \"NaN\""), "{nan}");
        let negative = message(&format!("{header}0,0,0,0,0,1,1,1,1,0,-1,0\n"));
        assert!(negative.contains("line 2: se_g is \"-1\""), "{negative}");
    }
}
