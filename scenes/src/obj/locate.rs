//! Finds the line of an OBJ file that an error is about. The parser reports what went wrong but not
//! where, so the text is gone through again, and only then.

use super::error::ObjError;
use super::survey::split_keyword;
use crate::load::Place;
use std::path::Path;

/// A line of the file and what surrounds it.
struct Line<'t> {
    number: usize,
    keyword: &'t str,
    rest: &'t str,
    text: &'t str,
    object: &'t str,
    /// Vertices, texture coordinates and normals read before it.
    counts: [usize; 3],
}

/// Calls `visit` on each line until it gives something.
fn find<'t, T>(text: &'t str, mut visit: impl FnMut(&Line<'t>) -> Option<T>) -> Option<T> {
    let mut object = super::UNNAMED;
    let mut counts = [0; 3];
    for (index, raw) in text.lines().enumerate() {
        let (keyword, rest) = split_keyword(raw);
        let line = Line {
            number: index + 1,
            keyword,
            rest,
            text: raw.trim(),
            object,
            counts,
        };
        let found = visit(&line);
        if found.is_some() {
            return found;
        }
        match keyword {
            "v" => counts[0] += 1,
            "vt" => counts[1] += 1,
            "vn" => counts[2] += 1,
            "o" | "g" => object = rest,
            _ => {}
        }
    }
    None
}

/// The line of the `n`-th face (from zero) of three or more corners.
pub(super) fn face_line(text: &str, n: usize) -> Option<usize> {
    let mut faces = 0;
    find(text, |line| {
        let is_face = line.keyword == "f" && line.rest.split_whitespace().nth(2).is_some();
        faces += usize::from(is_face);
        (is_face && faces == n + 1).then_some(line.number)
    })
}

/// The first `v`, `vt` or `vn` line with an infinity or what is not a number.
pub(super) fn not_finite(text: &str, file: &Path) -> Option<ObjError> {
    find(text, |line| {
        let is_vector = matches!(line.keyword, "v" | "vt" | "vn");
        let is_bad = |word: &str| word.parse().is_ok_and(|x: f64| !x.is_finite());
        (is_vector && line.rest.split_whitespace().any(is_bad)).then(|| ObjError::NotFinite {
            place: Place::line(file, line.number),
            object: line.object.to_owned(),
            line: line.text.to_owned(),
        })
    })
}

/// The line that made the parser fail.
pub(super) fn explain(text: &str, file: &Path, source: tobj::LoadError) -> ObjError {
    find(text, |line| bad_line(line, file))
        .or_else(|| bad_index(text, file))
        .unwrap_or_else(|| ObjError::Parser {
            file: file.to_owned(),
            source,
        })
}

/// An error when the parser refuses this line by itself.
fn bad_line(line: &Line, file: &Path) -> Option<ObjError> {
    let place = Place::line(file, line.number);
    let expected = match line.keyword {
        "v" => "v x y z",
        "vt" => "vt u v",
        "vn" => "vn x y z",
        "f" => "f a b c … with corners v, v/vt, v//vn or v/vt/vn",
        "usemtl" if line.rest.is_empty() => {
            let keyword = "usemtl";
            return Some(ObjError::NoName { place, keyword });
        }
        _ => return None,
    };
    let is_bad = if line.keyword == "f" {
        line.rest
            .split_whitespace()
            .any(|corner| parse_corner(corner).is_none())
    } else {
        let options = tobj::LoadOptions::default();
        let nothing = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
        tobj::load_obj_buf(&mut line.text.as_bytes(), &options, nothing).is_err()
    };
    is_bad.then(|| ObjError::Syntax {
        place,
        object: line.object.to_owned(),
        line: line.text.to_owned(),
        expected,
    })
}

/// The first face that names what is not there. Positive indices may point forwards.
pub(super) fn bad_index(text: &str, file: &Path) -> Option<ObjError> {
    let mut totals = [0; 3];
    find(text, |line| -> Option<()> {
        totals = line.counts;
        None
    });
    // The counts of a line exclude the line itself.
    let last = text.lines().last().map_or("", |line| split_keyword(line).0);
    if let Some(kind) = ["v", "vt", "vn"].iter().position(|k| *k == last) {
        totals[kind] += 1;
    }
    let beyond_file = find(text, |line| bad_corner(line, file, totals));
    // The parser looks faces up when their object ends: what comes later is not there for it.
    beyond_file.or_else(|| find(text, |line| bad_corner(line, file, line.counts)))
}

fn bad_corner(line: &Line, file: &Path, available: [usize; 3]) -> Option<ObjError> {
    if line.keyword != "f" {
        return None;
    }
    let mut kinds = line
        .rest
        .split_whitespace()
        .filter_map(parse_corner)
        .flat_map(|corner| corner.into_iter().enumerate());
    kinds.find_map(|(kind, index)| {
        let index = index?;
        let count = if index < 0 {
            line.counts[kind]
        } else {
            available[kind]
        };
        let is_bad = index == 0 || index.unsigned_abs() > count as u64;
        is_bad.then(|| ObjError::IndexOutOfRange {
            place: Place::line(file, line.number),
            object: line.object.to_owned(),
            kind: ["vertex", "texture coordinate", "normal"][kind],
            index,
            count,
        })
    })
}

/// The indices of `v/vt/vn`; the first must be there.
fn parse_corner(corner: &str) -> Option<[Option<i64>; 3]> {
    let mut indices = [None; 3];
    for (kind, part) in corner.split('/').enumerate() {
        let slot = indices.get_mut(kind)?;
        if !part.is_empty() {
            *slot = Some(part.parse().ok()?);
        }
    }
    indices[0]?;
    Some(indices)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "a.obj";

    fn message(text: &str) -> String {
        explain(text, Path::new(FILE), tobj::LoadError::GenericFailure).to_string()
    }

    #[test]
    fn faces_are_counted_without_points_and_lines() {
        let text = "f 1 2\nf 1 2 3\n# f 1 2 3\nf 3 2 1 4\n";
        assert_eq!(face_line(text, 0), Some(2));
        assert_eq!(face_line(text, 1), Some(4));
        assert_eq!(face_line(text, 2), None);
    }

    #[test]
    fn a_number_that_does_not_parse_is_found() {
        let text = message("o box\nv 0 0 0\nv 0 zero 0\n");
        assert!(
            text.starts_with("a.obj:3: `v 0 zero 0` (object `box`)"),
            "{text}"
        );
    }

    #[test]
    fn an_index_beyond_the_file_is_found() {
        let text = message("v 0 0 0\nv 1 0 0\nv 0 1 0\no t\nf 1 2 4\n");
        assert!(text.starts_with("a.obj:5: a face of object `t` names vertex 4, but there are 3"));
        assert!(message("v 0 0 0\nf 1 1 0\n").contains("names vertex 0"));
        assert!(message("v 0 0 0\nf -1 -2 -1\n").contains("names vertex -2"));
        assert!(message("f 1 1 1\no later\nv 0 0 0\n").contains("names vertex 1, but there are 0"));
    }
}
