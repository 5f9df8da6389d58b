//! A TOML document whose values know their line, read one typed key at a time.
//!
//! A table refuses unknown keys when it is opened, before anything else is said about it, so that a
//! misspelt key is reported as such and not as a missing one.

use super::error::SceneFileError;
use crate::load::{Place, UnknownName};
use crate::radiometry::Rgb;
use glam::DVec3;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A parsed file.
#[derive(Debug)]
pub(super) struct Document<'t> {
    file: &'t Path,
    /// Byte at which each line begins.
    line_starts: Vec<usize>,
    root: Spanned<DeTable<'t>>,
}

impl<'t> Document<'t> {
    pub(super) fn parse(file: &'t Path, text: &'t str) -> Result<Self, SceneFileError> {
        let newlines = text.bytes().enumerate().filter(|&(_, byte)| byte == b'\n');
        let line_starts = std::iter::once(0)
            .chain(newlines.map(|(at, _)| at + 1))
            .collect();
        match DeTable::parse(text) {
            Ok(root) => Ok(Self {
                file,
                line_starts,
                root,
            }),
            Err(error) => Err(SceneFileError::Syntax {
                place: place_of(
                    file,
                    &line_starts,
                    error.span().map_or(0, |span| span.start),
                ),
                message: error.message().to_owned(),
            }),
        }
    }

    /// The top of the file.
    pub(super) fn root(&self, known: &'static [&'static str]) -> Result<Table<'_>, SceneFileError> {
        let table = Table {
            document: self,
            section: "the scene file".to_owned(),
            start: 0,
            entries: self.root.get_ref(),
        };
        table.refuse_unknown(known)?;
        Ok(table)
    }

    fn place(&self, byte: usize) -> Place {
        place_of(self.file, &self.line_starts, byte)
    }
}

fn place_of(file: &Path, line_starts: &[usize], byte: usize) -> Place {
    Place::line(file, line_starts.partition_point(|&start| start <= byte))
}

/// A table of a document.
#[derive(Clone, Debug)]
pub(super) struct Table<'d> {
    document: &'d Document<'d>,
    section: String,
    start: usize,
    entries: &'d DeTable<'d>,
}

impl<'d> Table<'d> {
    fn refuse_unknown(&self, known: &'static [&'static str]) -> Result<(), SceneFileError> {
        // The table is sorted by key; the first in the file is what one corrects first.
        let unknown = self
            .entries
            .keys()
            .filter(|key| !known.contains(&key.get_ref().as_ref()));
        match unknown.min_by_key(|key| key.span().start) {
            Some(key) => Err(SceneFileError::UnknownKey {
                place: self.document.place(key.span().start),
                key: UnknownName::new(key.get_ref(), known.iter().copied()),
                section: self.section.clone(),
                known,
            }),
            None => Ok(()),
        }
    }

    /// Where the table begins.
    pub(super) fn place(&self) -> Place {
        self.document.place(self.start)
    }

    /// The value of a key, or nothing.
    pub(super) fn get(&self, key: &str) -> Option<Value<'d>> {
        let (key, value) = self.entries.get_key_value(key)?;
        Some(Value {
            document: self.document,
            key: key.get_ref().as_ref().to_owned(),
            span: value.span(),
            inner: value.get_ref(),
        })
    }

    /// The value of a key that must be there.
    pub(super) fn require(
        &self,
        key: &'static str,
        example: &'static str,
    ) -> Result<Value<'d>, SceneFileError> {
        self.get(key).ok_or_else(|| SceneFileError::MissingKey {
            place: self.place(),
            section: self.section.clone(),
            key,
            example,
        })
    }

    /// The one key of several that is there.
    pub(super) fn one_of(
        &self,
        keys: &'static [&'static str],
    ) -> Result<(&'static str, Value<'d>), SceneFileError> {
        let found: Vec<(&str, Value)> = keys
            .iter()
            .filter_map(|&key| Some((key, self.get(key)?)))
            .collect();
        match <[_; 1]>::try_from(found) {
            Ok([found]) => Ok(found),
            Err(found) => Err(SceneFileError::OneOf {
                place: self.place(),
                section: self.section.clone(),
                keys,
                found: found.into_iter().map(|(key, _)| key).collect(),
            }),
        }
    }

    /// All keys with their values, in the order of the file.
    pub(super) fn entries(&self) -> Vec<Value<'d>> {
        let mut values: Vec<Value> = self
            .entries
            .keys()
            .filter_map(|key| self.get(key.get_ref()))
            .collect();
        values.sort_by_key(|value| value.span.start);
        values
    }
}

/// A value of a document.
#[derive(Clone, Debug)]
pub(super) struct Value<'d> {
    document: &'d Document<'d>,
    key: String,
    span: Range<usize>,
    inner: &'d DeValue<'d>,
}

impl<'d> Value<'d> {
    pub(super) fn key(&self) -> &str {
        &self.key
    }

    pub(super) fn place(&self) -> Place {
        self.document.place(self.span.start)
    }

    fn wrong_type(&self, expected: &'static str) -> SceneFileError {
        let found = match self.inner {
            DeValue::Array(items) => format!("an array of {}", items.len()),
            other => format!("a {}", other.type_str()),
        };
        SceneFileError::WrongType {
            place: self.place(),
            key: self.key.clone(),
            expected,
            found,
        }
    }

    fn out_of_range(&self, value: f64, range: &'static str) -> SceneFileError {
        SceneFileError::OutOfRange {
            place: self.place(),
            key: self.key.clone(),
            value,
            range,
        }
    }

    /// A finite number, integer or not.
    pub(super) fn number(&self) -> Result<f64, SceneFileError> {
        let value = match self.inner {
            DeValue::Float(float) => float.as_str().parse().ok(),
            DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix())
                .ok()
                .map(|integer| integer as f64),
            _ => None,
        };
        let value: f64 = value.ok_or_else(|| self.wrong_type("a number"))?;
        if value.is_finite() {
            Ok(value)
        } else {
            Err(self.out_of_range(value, "finite"))
        }
    }

    /// A number that `is_allowed`, or an error that says the `range`.
    pub(super) fn number_in(
        &self,
        range: &'static str,
        is_allowed: impl Fn(f64) -> bool,
    ) -> Result<f64, SceneFileError> {
        let value = self.number()?;
        if is_allowed(value) {
            Ok(value)
        } else {
            Err(self.out_of_range(value, range))
        }
    }

    /// Red, green and blue, or one number for the three.
    pub(super) fn rgb_in(
        &self,
        range: &'static str,
        is_allowed: impl Fn(f64) -> bool + Copy,
    ) -> Result<Rgb, SceneFileError> {
        if !matches!(self.inner, DeValue::Array(_)) {
            let expected = "a number or [red, green, blue]";
            let grey = self
                .number_in(range, is_allowed)
                .map_err(|error| match error {
                    SceneFileError::WrongType { .. } => self.wrong_type(expected),
                    other => other,
                })?;
            return Ok(Rgb::splat(grey));
        }
        let items = self.items_of(3, "a number or [red, green, blue]")?;
        let mut rgb = Rgb::ZERO;
        for (channel, item) in rgb.as_mut().iter_mut().zip(&items) {
            *channel = item.number_in(range, is_allowed)?;
        }
        Ok(rgb)
    }

    /// A light quantity per channel: finite and not negative.
    pub(super) fn light(&self) -> Result<Rgb, SceneFileError> {
        self.rgb_in("at least 0", |x| x >= 0.0)
    }

    /// Three finite numbers.
    pub(super) fn vector(&self) -> Result<DVec3, SceneFileError> {
        let items = self.items_of(3, "[x, y, z]")?;
        let mut vector = DVec3::ZERO;
        for (coordinate, item) in vector.as_mut().iter_mut().zip(&items) {
            *coordinate = item.number()?;
        }
        Ok(vector)
    }

    pub(super) fn string(&self) -> Result<&'d str, SceneFileError> {
        match self.inner {
            DeValue::String(string) => Ok(string),
            _ => Err(self.wrong_type("a string")),
        }
    }

    /// A file, relative to the scene file.
    pub(super) fn file(&self) -> Result<PathBuf, SceneFileError> {
        let folder = self.document.file.parent().unwrap_or(Path::new(""));
        Ok(folder.join(self.string()?))
    }

    /// One of several words.
    pub(super) fn choice(
        &self,
        choices: &'static [&'static str],
    ) -> Result<&'static str, SceneFileError> {
        let word = self.string()?;
        let found = choices.iter().find(|&&choice| choice == word);
        found.copied().ok_or_else(|| SceneFileError::UnknownChoice {
            place: self.place(),
            key: self.key.clone(),
            value: UnknownName::new(word, choices.iter().copied()),
            choices,
        })
    }

    pub(super) fn boolean(&self) -> Result<bool, SceneFileError> {
        match self.inner {
            DeValue::Boolean(boolean) => Ok(*boolean),
            _ => Err(self.wrong_type("true or false")),
        }
    }

    /// The items of an array.
    pub(super) fn items(&self, expected: &'static str) -> Result<Vec<Value<'d>>, SceneFileError> {
        let DeValue::Array(items) = self.inner else {
            return Err(self.wrong_type(expected));
        };
        Ok(items
            .iter()
            .map(|item| Value {
                document: self.document,
                key: self.key.clone(),
                span: item.span(),
                inner: item.get_ref(),
            })
            .collect())
    }

    /// An array of a known length.
    pub(super) fn items_of(
        &self,
        count: usize,
        expected: &'static str,
    ) -> Result<Vec<Value<'d>>, SceneFileError> {
        let items = self.items(expected)?;
        if items.len() == count {
            Ok(items)
        } else {
            Err(self.wrong_type(expected))
        }
    }

    /// A table that holds no keys but the known ones.
    pub(super) fn table(
        &self,
        section: String,
        known: &'static [&'static str],
    ) -> Result<Table<'d>, SceneFileError> {
        let table = self.any_table(section)?;
        table.refuse_unknown(known)?;
        Ok(table)
    }

    /// A table whose keys are names.
    pub(super) fn any_table(&self, section: String) -> Result<Table<'d>, SceneFileError> {
        let DeValue::Table(entries) = self.inner else {
            return Err(self.wrong_type("a table"));
        };
        Ok(Table {
            document: self.document,
            section,
            start: self.span.start,
            entries,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn first_error(text: &str) -> String {
        let file = Path::new("a.toml");
        let document = match Document::parse(file, text) {
            Ok(document) => document,
            Err(error) => return error.to_string(),
        };
        let result = document.root(&["alpha", "beta"]).and_then(|root| {
            root.require("alpha", "alpha = 1")?.number()?;
            root.require("beta", "beta = [0, 0, 0]")?.vector()
        });
        result.expect_err("the text is wrong").to_string()
    }

    #[test]
    fn errors_name_the_line_and_the_key() {
        assert!(first_error("alpha = \n").starts_with("a.toml:1: not valid TOML"));
        assert!(
            first_error("\nalhpa = 1\n").starts_with(
                "a.toml:2: unknown key `alhpa`; did you mean `alpha`? in the scene file"
            )
        );
        assert!(first_error("alpha = 'x'").contains("`alpha` is a string; it must be a number"));
        assert!(first_error("alpha = nan").contains("out of range; it must be finite"));
        assert!(first_error("alpha = 1e999").contains("out of range"));
        assert!(first_error("alpha = 1").contains("has no `beta`; add beta = [0, 0, 0]"));
        let text = first_error("alpha = 1\nbeta = [0,\n0]\n");
        assert!(
            text.starts_with("a.toml:2: `beta` is an array of 2"),
            "{text}"
        );
        let text = first_error("alpha = 1\nbeta = [0,\n0, -inf]\n");
        assert!(text.starts_with("a.toml:3: `beta` = -inf"), "{text}");
    }
}
