//! What can be wrong with OBJ and MTL files.

use crate::load::{Place, UnknownName};
use std::path::PathBuf;
use thiserror::Error;

/// Why an OBJ file could not be used.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ObjError {
    /// A line whose numbers cannot be read.
    #[error(
        "{place}: `{line}` (object `{object}`) does not read as `{expected}`; correct the line"
    )]
    Syntax {
        /// The line.
        place: Place,
        /// The object that it is in.
        object: String,
        /// The line's text.
        line: String,
        /// What it should look like.
        expected: &'static str,
    },
    /// A vertex, normal or texture coordinate that is infinite or not a number.
    #[error(
        "{place}: `{line}` (object `{object}`) is not finite; export the geometry again or remove \
         the faces that use it"
    )]
    NotFinite {
        /// The line.
        place: Place,
        /// The object that it is in.
        object: String,
        /// The line's text.
        line: String,
    },
    /// A face names a vertex, normal or texture coordinate that is not there.
    #[error(
        "{place}: a face of object `{object}` names {kind} {index}, but there are {count} up to \
         there; indices count from 1, or from -1 backwards"
    )]
    IndexOutOfRange {
        /// The face.
        place: Place,
        /// Its object.
        object: String,
        /// `vertex`, `normal` or `texture coordinate`.
        kind: &'static str,
        /// The index as written.
        index: i64,
        /// How many there are.
        count: usize,
    },
    /// A material is used that no library defines.
    #[error(
        "{place}: no material {name}; it is not in {}; define it there with `newmtl` or correct \
         the name",
        libraries_text(libraries)
    )]
    UnknownMaterial {
        /// The `usemtl` line.
        place: Place,
        /// The name used.
        name: UnknownName,
        /// The libraries that were read.
        libraries: Vec<PathBuf>,
    },
    /// `mtllib` or `usemtl` without a name.
    #[error("{place}: `{keyword}` without a name; write the name behind it")]
    NoName {
        /// The line.
        place: Place,
        /// The keyword.
        keyword: &'static str,
    },
    /// The file has more vertices or corners than 32-bit indices can name.
    #[error("{}: too large: more than 2^32 corners or vertices; split the file", file.display())]
    TooLarge {
        /// The file.
        file: PathBuf,
    },
    /// The parser refused the file for a reason that no line explains.
    #[error("{}: cannot be read as OBJ: {source}; export the geometry again", file.display())]
    Parser {
        /// The file.
        file: PathBuf,
        /// What the parser said.
        source: tobj::LoadError,
    },
}

/// Why an MTL file could not be used.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MtlError {
    /// The library that an OBJ file names does not exist.
    #[error(
        "{place}: no such material library: {}; put it there, or correct the `mtllib` line",
        file.display()
    )]
    Missing {
        /// The library.
        file: PathBuf,
        /// The `mtllib` line.
        place: Place,
    },
    /// A line that cannot be read.
    #[error(
        "{place}: `{line}` (material `{material}`) does not read as `{expected}`; correct the line"
    )]
    Syntax {
        /// The line.
        place: Place,
        /// The material that it is in.
        material: String,
        /// The line's text.
        line: String,
        /// What it should look like.
        expected: String,
    },
    /// A property before the first `newmtl`.
    #[error("{place}: `{line}` stands before the first `newmtl`; begin a material above it")]
    NoMaterial {
        /// The line.
        place: Place,
        /// The line's text.
        line: String,
    },
    /// A material is defined twice.
    #[error("{place}: material `{material}` is already defined at {first}; rename one of them")]
    Twice {
        /// The second `newmtl`.
        place: Place,
        /// The first `newmtl`.
        first: Place,
        /// The name.
        material: String,
    },
}

fn libraries_text(libraries: &[PathBuf]) -> String {
    if libraries.is_empty() {
        return "any library, because the file has no `mtllib` line".to_owned();
    }
    let names: Vec<String> = libraries.iter().map(|l| l.display().to_string()).collect();
    names.join(", ")
}
