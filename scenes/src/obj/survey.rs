//! One pass over the text of an OBJ file before it is parsed, in parallel: what the parser does not tell
//! (names of materials and empty objects with their lines, what each face names) and what it must not
//! see (lines, which it would take for faces; continued lines, which it does not know).

use super::corners;
use super::pieces::Piece;
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::HashSet;

/// A name and the line that it stands in, counted from one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Named<'t> {
    pub(super) name: &'t str,
    pub(super) line: usize,
}

/// What a file contains besides numbers.
#[derive(Debug, Default)]
pub(super) struct Survey<'t> {
    /// `mtllib` lines.
    pub(super) libraries: Vec<Named<'t>>,
    /// Each material's first `usemtl` line.
    pub(super) materials: Vec<Named<'t>>,
    /// `o` and `g` lines.
    pub(super) objects: Vec<Named<'t>>,
    /// Number of `l` and `p` lines, and the first.
    pub(super) lines_and_points: usize,
    pub(super) first_line_or_point: usize,
    /// There are `vt` or `vn` lines.
    pub(super) has_attributes: bool,
    /// Some face counts backwards from the last vertex.
    pub(super) has_negative_indices: bool,
    /// Some line must be rewritten before the parser sees it.
    pub(super) needs_rewriting: bool,
    /// What the corners of faces name.
    pub(super) attributes: Attributes,
    /// The text in pieces.
    pub(super) pieces: Vec<Piece<'t>>,
}

/// The keyword of a line and what follows it, both trimmed.
pub(super) fn split_keyword(line: &str) -> (&str, &str) {
    let line = line.trim();
    line.split_once(char::is_whitespace)
        .map_or((line, ""), |(keyword, rest)| (keyword, rest.trim()))
}

impl<'t> Survey<'t> {
    /// Goes through the text once.
    pub(super) fn new(text: &'t str) -> Self {
        let mut survey = Self::default();
        survey.pieces = super::pieces::cut(text)
            .into_par_iter()
            .map(|range| Piece::survey(text, range))
            .collect();
        let mut used: HashSet<&str> = HashSet::new();
        let mut before = 0;
        for piece in &mut survey.pieces {
            let moved = |named: &Named<'t>| Named {
                name: named.name,
                line: named.line + before,
            };
            survey.libraries.extend(piece.libraries.iter().map(moved));
            survey.objects.extend(piece.objects.iter().map(moved));
            let first_uses = piece
                .materials
                .iter()
                .filter(|named| used.insert(named.name));
            survey.materials.extend(first_uses.map(moved));
            if let Some(line) = piece.first_line_or_point
                && survey.lines_and_points == 0
            {
                survey.first_line_or_point = line + before;
            }
            survey.lines_and_points += piece.lines_and_points;
            survey.has_attributes |= !piece.values[1].is_empty() || !piece.values[2].is_empty();
            survey.has_negative_indices |= piece.has_negative_indices;
            survey.needs_rewriting |= piece.needs_rewriting;
            survey.attributes = survey.attributes.and(piece.attributes);
            before += piece.lines;
        }
        survey
    }
}

/// The text with continued lines (`\` at the end) joined; every line keeps its number.
pub(super) fn join_continued(text: &str) -> Cow<'_, str> {
    // A search for one byte is quick; most files have none.
    if !text.contains('\\') || !(text.contains("\\\n") || text.contains("\\\r\n")) {
        return Cow::Borrowed(text);
    }
    let mut joined = String::with_capacity(text.len());
    let mut owed = 0;
    for line in text.lines() {
        if let Some(begun) = line.strip_suffix('\\') {
            joined.push_str(begun);
            joined.push(' ');
            owed += 1;
        } else {
            joined.push_str(line);
            joined.extend(std::iter::repeat_n('\n', owed + 1));
            owed = 0;
        }
    }
    Cow::Owned(joined)
}

/// The text without `l` lines, of which the parser makes faces, and without tabs behind `usemtl`,
/// which it does not know.
pub(super) fn for_parser<'t>(text: &'t str, survey: &Survey) -> Cow<'t, str> {
    if !survey.needs_rewriting {
        return Cow::Borrowed(text);
    }
    let mut kept = String::with_capacity(text.len());
    for line in text.lines() {
        match split_keyword(line) {
            ("l", _) => {}
            ("usemtl", name) => kept.extend(["usemtl ", name]),
            _ => kept.push_str(line),
        }
        kept.push('\n');
    }
    Cow::Owned(kept)
}

/// Which attributes a face's corner names.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Present {
    pub(super) uv: bool,
    pub(super) normal: bool,
}

/// Which attributes the corners of many faces name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Attributes {
    /// There are no faces.
    #[default]
    Nothing,
    /// All corners name the same.
    Alike(Present),
    /// Some corners differ, or are not plainly written.
    Mixed,
}

impl Attributes {
    /// What the corners of both name.
    pub(super) fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::Nothing, one) | (one, Self::Nothing) => one,
            (Self::Alike(a), Self::Alike(b)) if a == b => self,
            _ => Self::Mixed,
        }
    }
}

/// What each corner of a file names. The parser makes up attributes where a corner of a file that has
/// them elsewhere names none.
pub(super) enum Presence {
    /// All corners the same.
    Alike(Present),
    /// For each corner of each face of three or more corners, in order.
    Each(Vec<Present>),
}

impl Presence {
    /// Goes through the faces again only where they differ.
    pub(super) fn new(text: &str, survey: &Survey) -> Self {
        match survey.attributes {
            _ if !survey.has_attributes => Self::Alike(Present::default()),
            Attributes::Nothing => Self::Alike(Present::default()),
            Attributes::Alike(present) => Self::Alike(present),
            Attributes::Mixed => Self::Each(present_attributes(text)),
        }
    }

    /// What a corner names, by its number in the file.
    pub(super) fn of(&self, corner: usize) -> Present {
        match self {
            Self::Alike(present) => *present,
            Self::Each(present) => present.get(corner).copied().unwrap_or_default(),
        }
    }
}

fn present_attributes(text: &str) -> Vec<Present> {
    let mut present = Vec::new();
    for raw in text.lines() {
        if raw.starts_with("v ") {
            continue;
        }
        let (keyword, rest) = split_keyword(raw);
        if keyword != "f" {
            continue;
        }
        let first = present.len();
        present.extend(rest.split_whitespace().map(corners::present));
        if present.len() - first < 3 {
            present.truncate(first);
        }
    }
    present
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_lines_are_found() {
        let survey = Survey::new(
            "# c\nmtllib a b.mtl\no x\nusemtl red paint\nf 1 2 3\nusemtl red paint\nl 1 2\n",
        );
        assert_eq!(
            survey.libraries,
            [Named {
                name: "a b.mtl",
                line: 2
            }]
        );
        assert_eq!(
            survey.materials,
            [Named {
                name: "red paint",
                line: 4
            }]
        );
        assert_eq!(survey.objects, [Named { name: "x", line: 3 }]);
        assert_eq!(
            (survey.lines_and_points, survey.first_line_or_point),
            (1, 7)
        );
        assert!(!survey.has_negative_indices);
    }

    #[test]
    fn continued_lines_are_joined_and_keep_the_numbering() {
        let text = "v 0 0 0\nf 1 2 \\\n 3\no x\n";
        let joined = join_continued(text);
        let lines: Vec<&str> = joined.lines().collect();
        assert_eq!(lines, ["v 0 0 0", "f 1 2   3", "", "o x"]);
    }

    #[test]
    fn attributes_are_seen_corner_by_corner() {
        let present = present_attributes("f 1/1 2//2 3/3/3\nf 1 2\nf 1 2 3");
        let pairs: Vec<(bool, bool)> = present.iter().map(|p| (p.uv, p.normal)).collect();
        let none = (false, false);
        assert_eq!(
            pairs,
            [(true, false), (false, true), (true, true), none, none, none]
        );
    }
}
