//! Tables of points: where to probe, and what was found there.
//!
//! Input is CSV with a header that names the columns `x,y,z` (metres, world space) and `nx,ny,nz`
//! (a normal of any length but zero) in any order. Output repeats every column as it was, byte by
//! byte, and appends `e_r,e_g,e_b,se_r,se_g,se_b`; columns of these names in the input are
//! replaced, so that a result can be probed again.

mod results;

use csv::StringRecord;
use glam::DVec3;
use luxel_scenes::Rgb;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// A place and an orientation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Position in metres.
    pub position: DVec3,
    /// Unit normal: light from its side counts.
    pub normal: DVec3,
}

/// A value with its standard error, both in the value's unit.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Estimate {
    /// The value.
    pub value: Rgb,
    /// Its standard error.
    pub standard_error: Rgb,
}

/// Points as they were read, with the text that they came from.
#[derive(Clone, Debug, PartialEq)]
pub struct PointTable {
    header: StringRecord,
    records: Vec<StringRecord>,
    points: Vec<Point>,
}

/// Why a table of points cannot be read. Lines count from 1, the header among them.
#[derive(Debug, thiserror::Error)]
pub enum PointsError {
    /// The file cannot be opened.
    #[error("cannot read the points in {}; check the path", .0.display())]
    Unreadable(PathBuf, #[source] std::io::Error),
    /// Not CSV, or lines of different lengths.
    #[error("{}: not a CSV table", .0.display())]
    NotCsv(PathBuf, #[source] csv::Error),
    /// A column is missing.
    #[error("{}, line 1: no column {column:?}; the header must name x,y,z,nx,ny,nz", .path.display())]
    NoColumn {
        /// The file.
        path: PathBuf,
        /// The missing column.
        column: &'static str,
    },
    /// A column of results is missing.
    #[error(
        "{}, line 1: no column {column:?}; a reference has e_r,e_g,e_b, and se_r,se_g,se_b where its error is \
         known, as probe writes them",
        .path.display()
    )]
    NoResult {
        /// The file.
        path: PathBuf,
        /// The missing column.
        column: &'static str,
    },
    /// A field holds no finite number, or a standard error that is negative.
    #[error("{}, line {line}: {column} is {text:?}, not a finite number", .path.display())]
    NotANumber {
        /// The file.
        path: PathBuf,
        /// The line.
        line: u64,
        /// The column.
        column: &'static str,
        /// What is there.
        text: String,
    },
    /// A normal has no direction.
    #[error("{}, line {line}: the normal nx,ny,nz is zero; give the direction the point faces", .path.display())]
    ZeroNormal {
        /// The file.
        path: PathBuf,
        /// The line.
        line: u64,
    },
    /// There is no point.
    #[error("{}: no points; add lines below the header x,y,z,nx,ny,nz", .0.display())]
    Empty(PathBuf),
}

/// The columns that are read.
const INPUT: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];

/// The columns that are appended.
const OUTPUT: [&str; 6] = ["e_r", "e_g", "e_b", "se_r", "se_g", "se_b"];

impl PointTable {
    /// Memory of a table of so many points, in bytes, with the places that are made of it and the text of its results:
    /// numbers of about ten digits.
    pub fn bytes_for(points: usize) -> usize {
        const DIGITS: usize = 12;
        let columns = INPUT.len() + OUTPUT.len();
        let record = size_of::<StringRecord>() + INPUT.len() * (size_of::<usize>() + DIGITS) + 64;
        points * (record + 2 * size_of::<Point>() + size_of::<Estimate>() + columns * DIGITS)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// As [`PointsError`] says; every error names the file, and the line where there is one.
    pub fn read(path: &Path) -> Result<Self, PointsError> {
        let text = std::fs::read(path)
            .map_err(|error| PointsError::Unreadable(path.to_path_buf(), error))?;
        Self::parse(&text, path)
    }

    /// Reads CSV text; `path` is its name in errors.
    ///
    /// # Errors
    /// As [`PointsError`] says.
    pub fn parse(text: &[u8], path: &Path) -> Result<Self, PointsError> {
        let not_csv = |error| PointsError::NotCsv(path.to_path_buf(), error);
        // Spreadsheets put a byte order mark first.
        let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
        let mut reader = csv::Reader::from_reader(text);
        let header = reader.headers().map_err(not_csv)?.clone();
        if header.iter().all(|name| name.trim().is_empty()) {
            return Err(PointsError::Empty(path.to_path_buf()));
        }
        let mut columns = [0; 6];
        for (index, column) in columns.iter_mut().zip(INPUT) {
            *index = header
                .iter()
                .position(|name| name.trim() == column)
                .ok_or_else(|| PointsError::NoColumn {
                    path: path.to_path_buf(),
                    column,
                })?;
        }
        let mut table = Self {
            header,
            records: Vec::new(),
            points: Vec::new(),
        };
        for record in reader.into_records() {
            let record = record.map_err(not_csv)?;
            table.points.push(parse_point(&record, columns, path)?);
            table.records.push(record);
        }
        if table.points.is_empty() {
            return Err(PointsError::Empty(path.to_path_buf()));
        }
        Ok(table)
    }

    /// The points, in the order of the file.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// The table with the estimates appended, as CSV. Numbers read back to the same bits.
    ///
    /// # Errors
    /// Never in practice: the writer's target is memory.
    ///
    /// # Panics
    /// When there is not one estimate per point.
    pub fn to_csv(&self, estimates: &[Estimate]) -> Result<Vec<u8>, csv::Error> {
        assert_eq!(estimates.len(), self.points.len(), "one estimate per point");
        let kept: Vec<usize> = (0..self.header.len())
            .filter(|&column| !OUTPUT.contains(&self.header[column].trim()))
            .collect();
        let mut header = csv::Writer::from_writer(Vec::new());
        let names = kept.iter().map(|&column| &self.header[column]);
        header.write_record(names.chain(OUTPUT))?;
        let records = self.records.par_chunks(LINES_AT_ONCE);
        let lines = records
            .zip(estimates.par_chunks(LINES_AT_ONCE))
            .map(|(records, estimates)| lines(records, &kept, estimates))
            .collect::<Result<Vec<_>, _>>()?;
        let mut table = header
            .into_inner()
            .map_err(csv::IntoInnerError::into_error)?;
        for mut part in lines {
            table.append(&mut part);
        }
        Ok(table)
    }
}

/// Lines that one thread writes at a time.
const LINES_AT_ONCE: usize = 4096;

/// Some columns of records, and the estimates, as lines of a table.
fn lines(
    records: &[StringRecord],
    kept: &[usize],
    estimates: &[Estimate],
) -> Result<Vec<u8>, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for (record, estimate) in records.iter().zip(estimates) {
        for &column in kept {
            writer.write_field(&record[column])?;
        }
        let numbers = [estimate.value, estimate.standard_error];
        let numbers = numbers.iter().flat_map(Rgb::to_array);
        writer.write_record(numbers.map(|number| number.to_string()))?;
    }
    Ok(writer
        .into_inner()
        .map_err(csv::IntoInnerError::into_error)?)
}

fn parse_point(
    record: &StringRecord,
    columns: [usize; 6],
    path: &Path,
) -> Result<Point, PointsError> {
    let line = record.position().map_or(0, csv::Position::line);
    let mut numbers = [0.0; 6];
    for ((field, index), column) in numbers.iter_mut().zip(columns).zip(INPUT) {
        *field = number(record, index, column, path)?;
    }
    let normal = DVec3::new(numbers[3], numbers[4], numbers[5]);
    // Scaled first, so that tiny and huge normals neither vanish nor overflow when squared.
    let largest = normal.abs().max_element();
    if largest == 0.0 {
        return Err(PointsError::ZeroNormal {
            path: path.to_path_buf(),
            line,
        });
    }
    Ok(Point {
        position: DVec3::new(numbers[0], numbers[1], numbers[2]),
        normal: (normal / largest).normalize(),
    })
}

/// The finite number in a field.
fn number(
    record: &StringRecord,
    index: usize,
    column: &'static str,
    path: &Path,
) -> Result<f64, PointsError> {
    let text = &record[index];
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(PointsError::NotANumber {
            path: path.to_path_buf(),
            line: record.position().map_or(0, csv::Position::line),
            column,
            text: text.to_owned(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<PointTable, PointsError> {
        PointTable::parse(text.as_bytes(), Path::new("p.csv"))
    }

    fn message(text: &str) -> String {
        parse(text).expect_err("not a table of points").to_string()
    }

    #[test]
    fn columns_come_in_any_order_and_others_are_kept() {
        let table = parse("name, nz,ny,nx,z,y,x,e_r\nA,0,0,1e-200,3,2.50,1,7\nB,2,0,0,6,5,4,8\n")
            .expect("a table");
        let first = table.points()[0];
        assert_eq!(first.position, DVec3::new(1.0, 2.5, 3.0));
        assert_eq!(first.normal, DVec3::X);
        assert_eq!(table.points()[1].normal, DVec3::Z);

        let estimate = Estimate {
            value: Rgb::new(0.1, 1.0 / 3.0, 2.0),
            standard_error: Rgb::ZERO,
        };
        let csv = table.to_csv(&[estimate; 2]).expect("encodable");
        let csv = String::from_utf8(csv).expect("text");
        let lines: Vec<&str> = csv.lines().collect();
        assert_eq!(lines[0], "name, nz,ny,nx,z,y,x,e_r,e_g,e_b,se_r,se_g,se_b");
        assert_eq!(
            lines[1],
            "A,0,0,1e-200,3,2.50,1,0.1,0.3333333333333333,2,0,0,0"
        );
        assert!(parse(&csv).is_ok(), "a result can be probed again");
    }

    #[test]
    fn errors_name_file_line_and_column() {
        let header = "x,y,z,nx,ny,nz\n";
        assert_eq!(
            message("x,y,z,nx,ny\n1,2,3,4,5\n"),
            "p.csv, line 1: no column \"nz\"; the header must name x,y,z,nx,ny,nz"
        );
        assert_eq!(
            message(&format!("{header}0,0,0,0,0,1\n0,NaN,0,0,0,1\n")),
            "p.csv, line 3: y is \"NaN\", not a finite number"
        );
        assert!(message(&format!("{header}0,0,0,0,0,0\n")).contains("line 2: the normal"));
        assert!(message(&format!("{header}0,0,0,0,inf,0\n")).contains("line 2: ny"));
        let error = parse(&format!("{header}1,2\n")).expect_err("a short line");
        assert!(matches!(error, PointsError::NotCsv(..)));
    }

    #[test]
    fn tables_without_points_are_told_apart() {
        for text in ["", "x,y,z,nx,ny,nz\n", "\u{feff}x,y,z,nx,ny,nz\n\n"] {
            assert!(
                matches!(parse(text), Err(PointsError::Empty(_))),
                "{text:?}"
            );
        }
    }
}
