//! The text of an OBJ file in pieces that are gone through in parallel.
//!
//! Each piece says what [`super::survey`] wants to know and, for [`super::sections`], where its vertices
//! stand and what its faces name. Cost: one pass at the speed of a search for line ends, with the numbers of faces.

use super::corners;
use super::survey::{Attributes, Named, Present, split_keyword};
use std::ops::Range;

/// Bytes of a piece: a fraction of a millisecond of work.
const PIECE: usize = 1 << 18;

/// The keywords of values that faces name, in the order of [`corners::Corner`].
const VALUES: [&str; 3] = ["v", "vt", "vn"];

/// A stretch of text without the start of an object within it.
#[derive(Debug)]
pub(super) struct Span<'t> {
    /// Where it begins in the text.
    pub(super) start: usize,
    /// It begins with the line of an object.
    pub(super) begins_object: bool,
    /// The last `usemtl` of the piece before it.
    pub(super) material: Option<&'t str>,
    /// The least and the largest number of each kind of value that its faces name.
    pub(super) used: [(u32, u32); 3],
}

/// What a piece of the text contains; lines count from its beginning, the first is 1.
#[derive(Debug, Default)]
pub(super) struct Piece<'t> {
    pub(super) lines: usize,
    pub(super) libraries: Vec<Named<'t>>,
    /// The first use of each material that follows another.
    pub(super) materials: Vec<Named<'t>>,
    pub(super) objects: Vec<Named<'t>>,
    pub(super) lines_and_points: usize,
    pub(super) first_line_or_point: Option<usize>,
    pub(super) has_negative_indices: bool,
    pub(super) needs_rewriting: bool,
    pub(super) attributes: Attributes,
    /// The `v`, `vt` and `vn` lines.
    pub(super) values: [Vec<&'t str>; 3],
    pub(super) spans: Vec<Span<'t>>,
    /// The last `usemtl` in it.
    pub(super) last_material: Option<&'t str>,
    /// Some line is written so that only the parser knows what it means.
    pub(super) is_unusual: bool,
    /// How many values must stand before the piece for its faces to name only values before them.
    pub(super) reach: [usize; 3],
}

/// Cuts the text at ends of lines. The pieces depend on the text only.
pub(super) fn cut(text: &str) -> Vec<Range<usize>> {
    let mut pieces = Vec::with_capacity(text.len() / PIECE + 1);
    let mut start = 0;
    while start < text.len() {
        let least = (start + PIECE).min(text.len());
        let rest = &text.as_bytes()[least..];
        let end = memchr::memchr(b'\n', rest).map_or(text.len(), |at| least + at + 1);
        pieces.push(start..end);
        start = end;
    }
    pieces
}

/// The line at the front of `rest` without its end, which is taken off.
pub(super) fn next_line<'t>(rest: &mut &'t str) -> Option<&'t str> {
    if rest.is_empty() {
        return None;
    }
    let end = memchr::memchr(b'\n', rest.as_bytes()).unwrap_or(rest.len());
    let (line, behind) = rest.split_at(end);
    *rest = behind.get(1..).unwrap_or_default();
    Some(line.strip_suffix('\r').unwrap_or(line))
}

impl<'t> Piece<'t> {
    /// Goes through the lines of `text` in `range`.
    pub(super) fn survey(text: &'t str, range: Range<usize>) -> Self {
        let mut piece = Self::default();
        piece.begin_span(range.start, false);
        let mut rest = &text[range.clone()];
        let mut start = range.start;
        while let Some(raw) = next_line(&mut rest) {
            piece.lines += 1;
            piece.add_line(raw, start);
            start = range.end - rest.len();
        }
        piece
    }

    fn begin_span(&mut self, start: usize, begins_object: bool) {
        self.spans.push(Span {
            start,
            begins_object,
            material: self.last_material,
            used: [(u32::MAX, 0); 3],
        });
    }

    fn add_line(&mut self, raw: &'t str, start: usize) {
        // The quick way out for the lines that make up nearly all of a file.
        if raw.starts_with("v ") {
            return self.values[0].push(raw);
        }
        if let Some(rest) = raw.strip_prefix("f ") {
            return self.add_face(rest);
        }
        let (keyword, rest) = split_keyword(raw);
        let named = Named {
            name: rest,
            line: self.lines,
        };
        match keyword {
            "f" => self.add_face(rest),
            "o" | "g" => {
                // The parser takes the first letter for the keyword.
                self.is_unusual |= !raw.starts_with(keyword);
                self.begin_span(start, true);
                self.objects.push(named);
            }
            "mtllib" => self.libraries.push(named),
            "usemtl" => {
                self.needs_rewriting |= raw.contains('\t');
                self.is_unusual |= !raw.starts_with("usemtl ") || raw.contains('\t');
                if self.last_material.replace(rest) != Some(rest) {
                    self.materials.push(named);
                }
            }
            "l" | "p" => {
                self.first_line_or_point.get_or_insert(self.lines);
                self.lines_and_points += 1;
                self.needs_rewriting = true;
            }
            _ => {
                if let Some(kind) = VALUES.iter().position(|value| *value == keyword) {
                    self.values[kind].push(raw);
                }
            }
        }
    }

    fn add_face(&mut self, rest: &str) {
        let Some(span) = self.spans.last_mut() else {
            return;
        };
        let here = [0, 1, 2].map(|kind| self.values[kind].len());
        let is_plain = corners::visit(rest.as_bytes(), |corner| {
            for (kind, &index) in corner.iter().enumerate().filter(|(_, index)| **index > 0) {
                let (least, largest) = &mut span.used[kind];
                *least = index.min(*least);
                *largest = index.max(*largest);
                let beyond = (index as usize).saturating_sub(here[kind]);
                self.reach[kind] = self.reach[kind].max(beyond);
            }
            let [_, uv, normal] = corner.map(|index| index > 0);
            let present = Attributes::Alike(Present { uv, normal });
            self.attributes = self.attributes.and(present);
        });
        if !is_plain {
            self.is_unusual = true;
            self.attributes = Attributes::Mixed;
            self.has_negative_indices |= rest.contains('-');
        }
    }
}
