//! A value of a scene file, read as what it must be.

use super::document::{Document, Table};
use super::error::SceneFileError;
use crate::load::{Place, UnknownName};
use crate::radiometry::Rgb;
use glam::DVec3;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::de::DeValue;

/// Largest coordinate or quantity of light that a file may hold. Products of such numbers stay
/// finite; real ones are far smaller.
const LARGEST: f64 = 1e30;

/// A value of a document.
#[derive(Clone, Debug)]
pub(super) struct Value<'d> {
    pub(super) document: &'d Document<'d>,
    pub(super) key: String,
    pub(super) span: Range<usize>,
    pub(super) inner: &'d DeValue<'d>,
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
        self.rgb_in("at least 0, and at most 1e30", |x| {
            (0.0..=LARGEST).contains(&x)
        })
    }

    /// Three finite numbers.
    pub(super) fn vector(&self) -> Result<DVec3, SceneFileError> {
        let items = self.items_of(3, "[x, y, z]")?;
        let mut vector = DVec3::ZERO;
        for (coordinate, item) in vector.as_mut().iter_mut().zip(&items) {
            *coordinate = item.number_in("at most 1e30", |x| x.abs() <= LARGEST)?;
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
