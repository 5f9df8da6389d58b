//! Reads MTL files in the form that the parser takes, and finds the line when it refuses one.

use super::error::MtlError;
use super::survey::split_keyword;
use crate::load::{LoadError, Place, Warning, count_ignored, read_file};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The libraries of one OBJ file.
#[derive(Debug, Default)]
pub(super) struct Libraries {
    /// The files, in order.
    pub(super) files: Vec<PathBuf>,
    /// Their text in the form that the parser reads, one after the other.
    pub(super) text: String,
    /// The `newmtl` line of each material.
    pub(super) places: HashMap<String, Place>,
    /// Lines that have no effect.
    pub(super) warnings: Vec<Warning>,
}

impl Libraries {
    /// Reads and checks a library that `named_at` names.
    pub(super) fn add(&mut self, file: &Path, named_at: &Place) -> Result<(), LoadError> {
        if self.files.iter().any(|known| known == file) {
            return Ok(());
        }
        let bytes = read_file(file, Some(named_at)).map_err(|error| match error {
            LoadError::Missing { file, .. } => {
                let place = named_at.clone();
                LoadError::Mtl(MtlError::Missing { file, place })
            }
            other => other,
        })?;
        self.files.push(file.to_owned());
        self.add_text(file, &String::from_utf8_lossy(&bytes))?;
        Ok(())
    }

    /// Checks a library's lines and adds them. The parser is shown one line at a time first,
    /// because it does not say in which line it failed.
    pub(super) fn add_text(&mut self, file: &Path, text: &str) -> Result<(), MtlError> {
        let mut material: Option<&str> = None;
        for (index, raw) in text.lines().enumerate() {
            let place = Place::line(file, index + 1);
            let line = raw.trim().trim_start_matches('\u{feff}');
            let (keyword, rest) = split_keyword(line);
            if keyword.is_empty() || keyword.starts_with('#') {
                continue;
            }
            let syntax = |material: Option<&str>, expected: &str| MtlError::Syntax {
                place: place.clone(),
                material: material.unwrap_or_default().to_owned(),
                line: line.to_owned(),
                expected: expected.to_owned(),
            };
            if keyword == "newmtl" {
                if rest.is_empty() {
                    return Err(syntax(material, "newmtl name"));
                }
                material = Some(rest);
                if let Some(first) = self.places.insert(rest.to_owned(), place.clone()) {
                    let material = rest.to_owned();
                    return Err(MtlError::Twice {
                        place,
                        first,
                        material,
                    });
                }
            } else if material.is_none() {
                let line = line.to_owned();
                return Err(MtlError::NoMaterial { place, line });
            }
            let normal = normal_form(keyword, rest);
            let is_good = normal.as_deref().is_some_and(|normal| {
                tobj::load_mtl_buf(&mut format!("newmtl x\n{normal}").as_bytes()).is_ok()
            });
            let Some(normal) = normal.filter(|_| is_good) else {
                return Err(syntax(material, expected(keyword)));
            };
            self.note_ignored(keyword, &place);
            self.text.push_str(&normal);
            self.text.push('\n');
        }
        Ok(())
    }

    /// Counts a line that has no effect on light here.
    fn note_ignored(&mut self, keyword: &str, place: &Place) {
        let why = match keyword {
            "map_d" => "partly transparent surfaces are not supported; the surface is opaque",
            "bump" | "map_bump" | "map_Bump" | "norm" | "disp" => {
                "diffuse light is computed on the geometry itself"
            }
            "map_Ks" | "map_Ns" => "highlights are the same all over a surface",
            _ => return,
        };
        count_ignored(&mut self.warnings, keyword, place, why);
    }
}

/// A line as the parser wants it: colours need three numbers (it panics otherwise), where the format
/// allows one for grey. `None` when the line is no colour.
fn normal_form(keyword: &str, rest: &str) -> Option<String> {
    if !matches!(keyword, "Ka" | "Kd" | "Ks" | "Ke" | "Tf") {
        return Some(format!("{keyword} {rest}"));
    }
    let words: Vec<&str> = rest.split_whitespace().collect();
    if !words.iter().all(|word| word.parse::<f64>().is_ok()) {
        return None;
    }
    match words[..] {
        [grey] => Some(format!("{keyword} {grey} {grey} {grey}")),
        // Some exporters append alpha.
        [r, g, b] | [r, g, b, _] => Some(format!("{keyword} {r} {g} {b}")),
        _ => None,
    }
}

fn expected(keyword: &str) -> &'static str {
    match keyword {
        "Ka" | "Kd" | "Ks" | "Ke" | "Tf" => "keyword red green blue, linear numbers",
        "illum" => "illum number",
        "Ns" | "Ni" | "d" => "keyword number",
        _ => "keyword file",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn library(text: &str) -> Result<Libraries, MtlError> {
        let mut libraries = Libraries::default();
        libraries.add_text(Path::new("a.mtl"), text)?;
        Ok(libraries)
    }

    #[test]
    fn bad_lines_are_named() {
        for (text, start) in [
            (
                "newmtl a\nKd 0.1 0.2\n",
                "a.mtl:2: `Kd 0.1 0.2` (material `a`)",
            ),
            ("newmtl a\nKd red\n", "a.mtl:2: "),
            ("newmtl a\nKd spectral file.rfl\n", "a.mtl:2: "),
            ("newmtl a\n\nillum bright\n", "a.mtl:3: "),
            ("newmtl a\nNs\n", "a.mtl:2: "),
            ("newmtl\n", "a.mtl:1: "),
            ("Kd 1 1 1\n", "a.mtl:1: `Kd 1 1 1` stands before"),
            (
                "newmtl a\nnewmtl a\n",
                "a.mtl:2: material `a` is already defined at a.mtl:1",
            ),
        ] {
            let error = library(text).expect_err(text).to_string();
            assert!(error.starts_with(start), "{error}");
        }
    }

    #[test]
    fn what_has_no_effect_is_counted() {
        let libraries = library("newmtl a\nmap_bump a.png\nnewmtl b\nmap_bump b.png\n")
            .expect("bump maps are no error");
        assert!(matches!(
            libraries.warnings[..],
            [Warning::Ignored { count: 2, .. }]
        ));
    }
}
