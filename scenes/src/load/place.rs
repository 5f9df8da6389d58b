//! Where in a file something was said.

use std::fmt;
use std::path::{Path, PathBuf};

/// A file and, where it is known, a line in it.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Place {
    /// The file as it was opened.
    pub file: PathBuf,
    /// The line, counted from one.
    pub line: Option<u32>,
}

impl Place {
    /// A whole file.
    pub fn file(file: &Path) -> Self {
        Self {
            file: file.to_owned(),
            line: None,
        }
    }

    /// A line of a file, counted from one.
    pub fn line(file: &Path, line: usize) -> Self {
        Self {
            file: file.to_owned(),
            line: Some(u32::try_from(line).unwrap_or(u32::MAX)),
        }
    }
}

impl fmt::Display for Place {
    /// `file:line`, as compilers and editors write it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "{}:{line}", self.file.display()),
            None => write!(f, "{}", self.file.display()),
        }
    }
}

/// The candidate most like `name`, when it is like enough to be what was meant.
pub(crate) fn nearest<'a>(
    name: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    // Jaro–Winkler of 0.7: lower proposes unrelated words, higher misses two swapped letters in
    // a short key.
    const ALIKE: f64 = 0.7;
    candidates
        .into_iter()
        .map(|candidate| (strsim::jaro_winkler(name, candidate), candidate))
        .filter(|&(score, _)| score > ALIKE)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

/// " (did you mean `x`?)" or nothing.
pub(crate) fn suggestion(nearest: Option<&str>) -> String {
    nearest.map_or_else(String::new, |name| format!("; did you mean `{name}`?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_reads_like_a_compiler_message() {
        assert_eq!(Place::line(Path::new("a.obj"), 7).to_string(), "a.obj:7");
        assert_eq!(Place::file(Path::new("a.obj")).to_string(), "a.obj");
    }

    #[test]
    fn the_nearest_name_is_found_and_strangers_are_not() {
        let known = ["position", "look_at", "up", "fov"];
        assert_eq!(nearest("postion", known), Some("position"));
        assert_eq!(nearest("lookat", known), Some("look_at"));
        assert_eq!(nearest("zzz", known), None);
    }
}
