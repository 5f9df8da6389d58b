//! A TOML document whose values know their line, read one typed key at a time.
//!
//! A table refuses unknown keys when it is opened, before anything else is said about it, so that a
//! misspelt key is reported as such and not as a missing one.

use super::error::SceneFileError;
use super::value::Value;
use crate::load::{Place, UnknownName};
use std::path::Path;
use toml::Spanned;
use toml::de::DeTable;

/// A parsed file.
#[derive(Debug)]
pub(super) struct Document<'t> {
    pub(super) file: &'t Path,
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

    pub(super) fn place(&self, byte: usize) -> Place {
        place_of(self.file, &self.line_starts, byte)
    }
}

fn place_of(file: &Path, line_starts: &[usize], byte: usize) -> Place {
    Place::line(file, line_starts.partition_point(|&start| start <= byte))
}

/// A table of a document.
#[derive(Clone, Debug)]
pub(super) struct Table<'d> {
    pub(super) document: &'d Document<'d>,
    pub(super) section: String,
    pub(super) start: usize,
    pub(super) entries: &'d DeTable<'d>,
}

impl<'d> Table<'d> {
    pub(super) fn refuse_unknown(
        &self,
        known: &'static [&'static str],
    ) -> Result<(), SceneFileError> {
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
