//! What can be wrong with a scene file.

use crate::load::{Place, UnknownName};
use thiserror::Error;

/// Why a scene file could not be used.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SceneFileError {
    /// The file is not TOML.
    #[error("{place}: not valid TOML: {message}")]
    Syntax {
        /// The line.
        place: Place,
        /// What the parser said.
        message: String,
    },
    /// A key that has no meaning there.
    #[error("{place}: unknown key {key} in {section}; the keys there are {}", known.join(", "))]
    UnknownKey {
        /// The line.
        place: Place,
        /// The key as written.
        key: UnknownName,
        /// The section that it stands in.
        section: String,
        /// The keys that are known there.
        known: &'static [&'static str],
    },
    /// A key that must be there is not.
    #[error("{place}: {section} has no `{key}`; add {example}")]
    MissingKey {
        /// The section's line.
        place: Place,
        /// The section.
        section: String,
        /// The key.
        key: &'static str,
        /// What a line with it looks like.
        example: &'static str,
    },
    /// A value of the wrong type.
    #[error("{place}: `{key}` is {found}; it must be {expected}")]
    WrongType {
        /// The line.
        place: Place,
        /// The key.
        key: String,
        /// What it must be.
        expected: &'static str,
        /// What it is.
        found: String,
    },
    /// A number that is infinite, undefined or outside its range.
    #[error("{place}: `{key}` = {value} is out of range; it must be {range}")]
    OutOfRange {
        /// The line.
        place: Place,
        /// The key.
        key: String,
        /// The number.
        value: f64,
        /// The values that are allowed.
        range: &'static str,
    },
    /// A word that is not among the choices.
    #[error("{place}: `{key}` is {value}; it must be one of {}", choices.join(", "))]
    UnknownChoice {
        /// The line.
        place: Place,
        /// The key.
        key: String,
        /// The word as written.
        value: UnknownName,
        /// The choices.
        choices: &'static [&'static str],
    },
    /// Keys of which exactly one must be there.
    #[error(
        "{place}: {section} must have exactly one of {}, but has {}",
        keys.join(", "),
        if found.is_empty() { "none".to_owned() } else { found.join(" and ") }
    )]
    OneOf {
        /// The section's line.
        place: Place,
        /// The section.
        section: String,
        /// The keys.
        keys: &'static [&'static str],
        /// Those that are there.
        found: Vec<&'static str>,
    },
    /// A key that needs another one.
    #[error("{place}: `{key}` needs `{needed}` beside it; add it or remove `{key}`")]
    Needs {
        /// The line of the key.
        place: Place,
        /// The key.
        key: &'static str,
        /// The key that is missing.
        needed: &'static str,
    },
    /// A key that cannot stand beside another one.
    #[error("{place}: `{key}` cannot stand beside `{other}`; remove one of them")]
    Excludes {
        /// The line of the key.
        place: Place,
        /// The key.
        key: &'static str,
        /// The other key.
        other: &'static str,
    },
    /// A direction of no length.
    #[error("{place}: {key} has no direction; {remedy}")]
    NoDirection {
        /// The line.
        place: Place,
        /// The key or keys.
        key: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// A camera or object name that is taken.
    #[error("{place}: there is already a {kind} named `{name}`; choose another name")]
    NameTaken {
        /// The line.
        place: Place,
        /// Camera or light.
        kind: &'static str,
        /// The name.
        name: String,
    },
    /// A material that does not exist.
    #[error("{place}: no material {name}; define it by `[material.NAME]` or in the geometry file")]
    UnknownMaterial {
        /// The line.
        place: Place,
        /// The name as written.
        name: UnknownName,
    },
    /// A polygon that cannot be a face.
    #[error("{place}: the polygon {problem}")]
    Polygon {
        /// The line.
        place: Place,
        /// What is wrong with it and what to do.
        problem: &'static str,
    },
    /// A pattern of object names that is not one.
    #[error("{place}: `{pattern}` is not a pattern: {message}")]
    Pattern {
        /// The line.
        place: Place,
        /// The pattern.
        pattern: String,
        /// What is wrong with it.
        message: &'static str,
    },
    /// A file listed as geometry that is not.
    #[error("{place}: {file} is not geometry by its extension; list .obj, .gltf and .glb files")]
    NotGeometry {
        /// The line.
        place: Place,
        /// The file as written.
        file: String,
    },
}
