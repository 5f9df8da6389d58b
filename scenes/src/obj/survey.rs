//! One pass over the text of an OBJ file before it is parsed: what the parser does not tell (names
//! of materials and empty objects with their lines) and what it must not see (lines, which it would
//! take for faces; continued lines, which it does not know).

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
        let mut used: HashSet<&str> = HashSet::new();
        for (index, raw) in text.lines().enumerate() {
            let line = index + 1;
            // The quick way out for the lines that make up nearly all of a file.
            if raw.starts_with("v ") {
                continue;
            }
            let (keyword, rest) = split_keyword(raw);
            let named = Named { name: rest, line };
            match keyword {
                "f" => survey.has_negative_indices |= rest.contains('-'),
                "vt" | "vn" => survey.has_attributes = true,
                "o" | "g" => survey.objects.push(named),
                "mtllib" => survey.libraries.push(named),
                "usemtl" => {
                    survey.needs_rewriting |= raw.contains('\t');
                    if used.insert(rest) {
                        survey.materials.push(named);
                    }
                }
                "l" | "p" => {
                    if survey.lines_and_points == 0 {
                        survey.first_line_or_point = line;
                    }
                    survey.lines_and_points += 1;
                    survey.needs_rewriting = true;
                }
                _ => {}
            }
        }
        survey
    }
}

/// The text with continued lines (`\` at the end) joined; every line keeps its number.
pub(super) fn join_continued(text: &str) -> Cow<'_, str> {
    if !text.contains("\\\n") && !text.contains("\\\r\n") {
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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Present {
    pub(super) uv: bool,
    pub(super) normal: bool,
}

/// For each corner of each face of three or more corners, in order: what it names. The parser makes
/// up attributes where a corner of a file that has them elsewhere names none.
pub(super) fn present_attributes(text: &str) -> Vec<Present> {
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
        present.extend(rest.split_whitespace().map(|corner| {
            let mut parts = corner.split('/').skip(1);
            let mut names = || parts.next().is_some_and(|part| !part.is_empty());
            Present {
                uv: names(),
                normal: names(),
            }
        }));
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
