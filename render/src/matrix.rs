//! Tables of form factors as files: CSV to read, NPY to compute with.

use std::io;

/// A square matrix with a name for every row and column.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedMatrix {
    /// Names of rows and columns.
    pub names: Vec<String>,
    /// Row-major values, `names.len()` rows of as many values.
    pub rows: Vec<Vec<f64>>,
}

impl NamedMatrix {
    /// A CSV table: the first line is `from` and the names, every other line a name and its row.
    /// Numbers are written so that they read back to the same bits.
    ///
    /// # Errors
    /// Never in practice: the writer's target is memory.
    pub fn to_csv(&self) -> Result<Vec<u8>, csv::Error> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let names = self.names.iter().map(String::as_str);
        writer.write_record(std::iter::once("from").chain(names))?;
        for (name, row) in self.names.iter().zip(&self.rows) {
            let values = row.iter().map(f64::to_string);
            writer.write_record(std::iter::once(name.clone()).chain(values))?;
        }
        Ok(writer
            .into_inner()
            .map_err(csv::IntoInnerError::into_error)?)
    }

    /// An NPY array: `<f8`, C order, shape (n, n), without the names.
    ///
    /// # Errors
    /// Never in practice: the writer's target is memory.
    pub fn to_npy(&self) -> io::Result<Vec<u8>> {
        use npyz::WriterBuilder;
        let n = self.names.len() as u64;
        let mut bytes = Vec::new();
        let mut writer = npyz::WriteOptions::<f64>::new()
            .default_dtype()
            .shape(&[n, n])
            .writer(&mut bytes)
            .begin_nd()?;
        writer.extend(self.rows.iter().flatten().copied())?;
        writer.finish()?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix() -> NamedMatrix {
        NamedMatrix {
            names: vec!["floor, north".into(), "lamp".into()],
            rows: vec![vec![0.0, 1.0 / 3.0], vec![1e-17, 0.25]],
        }
    }

    #[test]
    fn csv_quotes_names_and_keeps_every_bit() {
        let text = String::from_utf8(matrix().to_csv().expect("encodable")).expect("text");
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "from,\"floor, north\",lamp");
        assert_eq!(lines[1], "\"floor, north\",0,0.3333333333333333");
        let value = lines[2].split(',').nth(1).map(str::parse::<f64>);
        assert_eq!(value, Some(Ok(1e-17)));
    }

    #[test]
    fn npy_holds_shape_and_values() {
        let bytes = matrix().to_npy().expect("encodable");
        let file = npyz::NpyFile::new(&bytes[..]).expect("an NPY file");
        assert_eq!(file.shape(), [2, 2]);
        let values: Vec<f64> = file.into_vec().expect("f64 values");
        assert_eq!(values, [0.0, 1.0 / 3.0, 1e-17, 0.25]);
    }
}
