//! The one way in: [`load`] reads a scene from any of its files.

mod duplicates;
mod error;
mod finish;
mod part;
mod place;
mod warning;

pub use error::{ExtentError, FailureKind, LoadError, MaterialError, MaterialProblem, UnknownName};
pub use place::Place;
pub use warning::{FacePlace, Warning};

pub(crate) use warning::count_ignored;

pub(crate) use error::read_file;
pub(crate) use finish::WHITE;
pub(crate) use part::{MaterialSource, Merged, Part, unique_name};

use crate::gltf_file::GltfOrigin;
use crate::scene::Scene;
use crate::{gltf_file, obj, scene_file};
use std::ffi::OsStr;
use std::path::Path;

/// A scene and what was put right or left out to make it.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene; its invariants hold.
    pub scene: Scene,
    /// Each names a file and what happened.
    pub warnings: Vec<Warning>,
    /// Where the vertices come from, when all are from one glTF file; what writes the file again needs it.
    pub origin: Option<GltfOrigin>,
}

/// Reads a scene file (`.toml`) or a geometry file (`.obj`, `.gltf`, `.glb`). With a geometry file,
/// the scene file of the same name beside it is read too when there is one.
///
/// # Errors
/// When a file is missing or unreadable, or what it says is not a scene; see [`LoadError::kind`].
pub fn load(path: impl AsRef<Path>) -> Result<Loaded, LoadError> {
    load_path(path.as_ref())
}

fn load_path(path: &Path) -> Result<Loaded, LoadError> {
    let stem = path
        .file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    if !is_scene_file(path) {
        let sidecar = path.with_extension("toml");
        if !sidecar.is_file() {
            let mut merged = Merged::default();
            merged.add(read_geometry(path, None)?);
            return finish::finish(merged, path, stem, None);
        }
        if !is_geometry(path) {
            let file = path.to_owned();
            return Err(LoadError::UnknownFormat { file });
        }
        return load_scene_file(&sidecar, Some(path), stem);
    }
    load_scene_file(path, None, stem)
}

fn load_scene_file(file: &Path, opened: Option<&Path>, stem: String) -> Result<Loaded, LoadError> {
    let bytes = read_file(file, None)?;
    let text = String::from_utf8_lossy(&bytes);
    let read = scene_file::read(file, &text, opened)?;
    finish::finish(read.merged, file, read.name.unwrap_or(stem), read.units)
}

/// Reads a geometry file by its extension.
pub(crate) fn read_geometry(file: &Path, named_at: Option<&Place>) -> Result<Part, LoadError> {
    match extension(file).as_str() {
        "obj" => obj::read(file, named_at),
        "gltf" | "glb" => gltf_file::read(file, named_at),
        _ => Err(LoadError::UnknownFormat {
            file: file.to_owned(),
        }),
    }
}

/// True for files that hold geometry, by their extension.
pub(crate) fn is_geometry(file: &Path) -> bool {
    matches!(extension(file).as_str(), "obj" | "gltf" | "glb")
}

fn is_scene_file(file: &Path) -> bool {
    extension(file) == "toml"
}

fn extension(file: &Path) -> String {
    file.extension()
        .map(OsStr::to_string_lossy)
        .unwrap_or_default()
        .to_lowercase()
}

#[cfg(test)]
mod tests;
