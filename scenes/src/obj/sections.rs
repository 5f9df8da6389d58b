//! Parses the sections of a large OBJ file in parallel.
//!
//! The parser reads a file from the beginning to the end, but what it makes of an object depends only
//! on the values that its faces name. So objects are shown to it section by section: the lines of
//! the values that a section names, then its faces, counted from the first of these lines on. What comes out is
//! what it makes of the whole file, value by value. The sections depend on the text alone.
//!
//! Valid where each line is plainly written and names only values before it; otherwise, and when the
//! parser refuses a section, the whole file is shown to it at once, and what it says then counts. Cost:
//! a copy of the text, section by section. An object is never cut: one that is most of a file takes as long as the file.

use super::corners::{self, Corner};
use super::pieces::{Piece, Span, next_line};
use super::survey::split_keyword;
use rayon::prelude::*;
use std::ops::Range;

/// Bytes of a section, at least. Smaller copies shared values more often, larger leaves threads idle.
const SECTION: usize = 1 << 20;

/// Lines of values that all sections together may be shown, over those of the file. Where objects name
/// values from all over the file, more would take longer than to parse it at once.
const SHARING: usize = 2;

/// Objects that are parsed together.
#[derive(Debug)]
struct Section<'t> {
    text: Range<usize>,
    /// The material at its beginning.
    material: Option<&'t str>,
    /// The least and the largest number of each kind of value that its faces name.
    used: [(u32, u32); 3],
}

/// Parses `text` section by section with `load`. `None` where the file must be shown to the parser at once.
pub(super) fn parse<T: Send, E: Send>(
    text: &str,
    pieces: &[Piece],
    load: impl Fn(&[u8]) -> Result<Vec<T>, E> + Sync,
) -> Option<Vec<T>> {
    let sections = sections(text, pieces)?;
    let parsed: Result<Vec<Vec<T>>, E> = sections
        .par_iter()
        .map(|section| load(&shown(text, pieces, section)))
        .collect();
    // A line that cannot be read is an error also where no face names it.
    load(&unused(pieces, &sections)).ok()?;
    Some(parsed.ok()?.into_iter().flatten().collect())
}

/// Cuts the file between objects; `None` where that cannot be done or is not worth it.
fn sections<'t>(text: &str, pieces: &[Piece<'t>]) -> Option<Vec<Section<'t>>> {
    let mut sections: Vec<Section> = Vec::new();
    let mut material = None;
    let mut before = [0_usize; 3];
    for piece in pieces {
        let is_backward = (0..3).all(|kind| piece.reach[kind] <= before[kind]);
        if piece.is_unusual || !is_backward {
            return None;
        }
        for (count, values) in before.iter_mut().zip(&piece.values) {
            *count += values.len();
        }
        for span in &piece.spans {
            add_span(&mut sections, span, span.material.or(material));
        }
        material = piece.last_material.or(material);
    }
    sections.last_mut()?.text.end = text.len();
    let shown: usize = sections
        .iter()
        .flat_map(|section| section.used)
        .map(|(least, largest)| numbers(least, largest).len())
        .sum();
    let values: usize = before.iter().sum();
    (sections.len() > 1 && shown <= SHARING * values).then_some(sections)
}

fn add_span<'t>(sections: &mut Vec<Section<'t>>, span: &Span, material: Option<&'t str>) {
    if let Some(last) = sections.last_mut() {
        last.text.end = span.start;
        if !span.begins_object || last.text.len() < SECTION {
            for (last, span) in last.used.iter_mut().zip(span.used) {
                *last = (last.0.min(span.0), last.1.max(span.1));
            }
            return;
        }
    }
    sections.push(Section {
        text: span.start..span.start,
        material,
        used: span.used,
    });
}

/// A section as the parser is shown it.
fn shown(text: &str, pieces: &[Piece], section: &Section) -> Vec<u8> {
    let mut shown = Vec::with_capacity(section.text.len() + section.text.len() / 4);
    for (kind, &(least, largest)) in section.used.iter().enumerate() {
        push_values(&mut shown, pieces, kind, numbers(least, largest));
    }
    if let Some(material) = section.material {
        shown.extend_from_slice(b"usemtl ");
        shown.extend_from_slice(material.as_bytes());
        shown.push(b'\n');
    }
    let base: Corner = section.used.map(|(least, _)| least.saturating_sub(1));
    let mut rest = &text[section.text.clone()];
    while let Some(raw) = next_line(&mut rest) {
        if raw.starts_with("v ") {
            continue;
        }
        let (keyword, names) = if let Some(names) = raw.strip_prefix("f ") {
            ("f", names)
        } else {
            split_keyword(raw)
        };
        match keyword {
            "f" => {
                shown.push(b'f');
                // The survey has found all faces to be plain.
                corners::visit(names.as_bytes(), |corner| {
                    corners::write(&mut shown, corner, base);
                });
                shown.push(b'\n');
            }
            "o" | "g" | "usemtl" => {
                shown.extend_from_slice(raw.as_bytes());
                shown.push(b'\n');
            }
            _ => {}
        }
    }
    shown
}

/// The positions of values of which the least and the largest number are given.
fn numbers(least: u32, largest: u32) -> Range<usize> {
    (least as usize).saturating_sub(1)..largest as usize
}

/// Appends the lines of values, by their positions in the file.
fn push_values(shown: &mut Vec<u8>, pieces: &[Piece], kind: usize, numbers: Range<usize>) {
    let mut before = 0;
    for piece in pieces {
        let values = &piece.values[kind];
        let here = |number: usize| number.saturating_sub(before).min(values.len());
        for line in &values[here(numbers.start)..here(numbers.end.max(numbers.start))] {
            shown.extend_from_slice(line.as_bytes());
            shown.push(b'\n');
        }
        before += values.len();
    }
}

/// The lines of values that no section is shown.
fn unused(pieces: &[Piece], sections: &[Section]) -> Vec<u8> {
    let mut unused = Vec::new();
    for kind in 0..3 {
        let ranges = sections.iter().map(|section| section.used[kind]);
        let mut ranges: Vec<Range<usize>> = ranges.map(|(a, b)| numbers(a, b)).collect();
        ranges.sort_unstable_by_key(|range| range.start);
        let mut end = 0;
        for range in ranges.into_iter().filter(|range| !range.is_empty()) {
            push_values(&mut unused, pieces, kind, end..range.start);
            end = end.max(range.end);
        }
        push_values(&mut unused, pieces, kind, end..usize::MAX);
    }
    unused
}

#[cfg(test)]
mod tests {
    use super::super::survey::Survey;
    use super::*;

    /// Two objects, of which the first is large enough for a section of its own; the second names values
    /// of both.
    fn text(vertices_first: bool, last: &str) -> String {
        let vertex = |k: u32| format!("v {k} {} 0.5\nvn 0 0 {k}\nvt {k} 1\n", k % 7);
        let face = |k: u32| format!("f {0}/{0}/{0} {1}//{1} {2}/{2}\n", k, k + 1, k + 2);
        let (few, many) = (0..40_000, 40_000..60_000);
        let values = |range: Range<u32>| range.map(vertex).collect::<String>();
        let faces = |range: Range<u32>| {
            (range.start + 1..range.end - 2)
                .map(face)
                .collect::<String>()
        };
        let [first, second] = [few.clone(), many.clone()].map(values);
        let (first, second) = if vertices_first {
            (first + &second, String::new())
        } else {
            (first, second)
        };
        format!(
            "{first}usemtl a\no few\n{}usemtl b\n{}g many\n{second}{}{last}",
            faces(0..20_000),
            faces(20_000..40_000),
            faces(39_990..60_000)
        )
    }

    fn load(text: &[u8]) -> tobj::LoadResult {
        let numbers = [("a".to_owned(), 0), ("b".to_owned(), 1)];
        let options = super::super::OPTIONS;
        tobj::load_obj_buf(
            &mut [b"mtllib all\n", text].concat().as_slice(),
            &options,
            |_| Ok((Vec::new(), numbers.clone().into_iter().collect())),
        )
    }

    #[test]
    fn sections_give_what_the_whole_file_gives() {
        for vertices_first in [false, true] {
            let text = text(vertices_first, "v 9 9 9\n");
            let survey = Survey::new(&text);
            let by_sections = parse(&text, &survey.pieces, |text| {
                load(text).map(|(models, _)| models)
            });
            let by_sections = by_sections.expect("the file has sections");
            let whole = load(text.as_bytes()).expect("the parser reads it").0;
            let filled = |models: Vec<tobj::Model>| -> Vec<String> {
                let filled = models.iter().filter(|model| !model.mesh.indices.is_empty());
                filled.map(|model| format!("{model:?}")).collect()
            };
            assert!(
                filled(by_sections) == filled(whole),
                "vertices first: {vertices_first}"
            );
        }
    }

    #[test]
    fn what_only_the_parser_understands_is_left_to_it() {
        for last in [
            "f 1 2 70000\n",
            "f -1 -2 -3\n",
            "v 1 2\n",
            " g indented\n",
            "f 1 2 3.0\n",
        ] {
            let text = text(false, last);
            let survey = Survey::new(&text);
            let by_sections = parse(&text, &survey.pieces, |text| {
                load(text).map(|(models, _)| models)
            });
            assert!(by_sections.is_none(), "{last}");
        }
        let survey = Survey::new("");
        assert!(sections("", &survey.pieces).is_none());
    }
}
