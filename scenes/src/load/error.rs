//! What can be wrong with a scene, said so that it can be put right.

use super::place::{Place, suggestion};
use crate::gltf_file::GltfError;
use crate::obj::{MtlError, ObjError};
use crate::scene_file::SceneFileError;
use crate::texture_file::TextureError;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why a scene could not be loaded. Every message names the file, the line where there is one, and
/// what to do.
#[derive(Debug, Error)]
pub enum LoadError {
    /// A file exists but cannot be read.
    #[error("{}: cannot be read: {source}; check its permissions", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file does not exist.
    #[error(
        "{}no such file: {}; check the name, which is relative to {}",
        named_at.as_ref().map_or_else(String::new, |place| format!("{place}: ")),
        file.display(),
        if named_at.is_some() { "the file that names it" } else { "the current directory" }
    )]
    Missing {
        /// The file.
        file: PathBuf,
        /// Where it was named, unless it was opened directly.
        named_at: Option<Place>,
    },
    /// The extension of a file is not one of a scene.
    #[error(
        "{}: not a scene file by its extension; a scene is a .toml, .obj, .gltf or .glb file",
        file.display()
    )]
    UnknownFormat {
        /// The file.
        file: PathBuf,
    },
    /// Something in an OBJ file.
    #[error(transparent)]
    Obj(#[from] ObjError),
    /// Something in an MTL file.
    #[error(transparent)]
    Mtl(#[from] MtlError),
    /// Something in a glTF file.
    #[error(transparent)]
    Gltf(#[from] GltfError),
    /// An image.
    #[error(transparent)]
    Texture(#[from] TextureError),
    /// Something in a scene file.
    #[error(transparent)]
    SceneFile(#[from] SceneFileError),
    /// A material outside physics.
    #[error(transparent)]
    Material(#[from] MaterialError),
    /// A vertex that is too far away.
    #[error(transparent)]
    Extent(#[from] ExtentError),
}

/// Who can put an error right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FailureKind {
    /// The system refused to read a file that is there.
    Io,
    /// The scene is wrong, or names a file that does not exist.
    InvalidScene,
}

impl LoadError {
    /// Whether the system failed or the scene is wrong.
    pub fn kind(&self) -> FailureKind {
        match self {
            Self::Unreadable { .. } | Self::Texture(TextureError::Unreadable { .. }) => {
                FailureKind::Io
            }
            _ => FailureKind::InvalidScene,
        }
    }
}

/// A vertex so far away that its square overflows.
#[derive(Clone, Debug, PartialEq, Error)]
#[error(
    "{}: a vertex of object `{object}` lies {coordinate:e} m from the origin along an axis, \
     beyond the {:e} m that can be computed with; set `scale` in `[scene]`",
    file.display(),
    crate::assemble::MAX_COORDINATE
)]
pub struct ExtentError {
    /// The scene that was opened.
    pub file: PathBuf,
    /// The object of the face.
    pub object: String,
    /// The coordinate in metres.
    pub coordinate: f64,
}

/// A material property outside its physical range.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{place}: material `{material}`: {field} = {value:?} {problem}")]
pub struct MaterialError {
    /// Where the material is.
    pub place: Place,
    /// Its name.
    pub material: String,
    /// The property, as the file calls it.
    pub field: &'static str,
    /// Its value.
    pub value: [f64; 3],
    /// What is wrong and what to do.
    pub problem: MaterialProblem,
}

/// What is wrong with a material property.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum MaterialProblem {
    /// A diffuse reflectance outside [0, 1).
    #[error(
        "is not a reflectance in [0, 1): a surface that absorbs nothing has no solution in a \
         closed room; write at most 0.98, or set `reflectance` in `[material.NAME]` of the scene file"
    )]
    Reflectance,
    /// A fraction outside [0, 1].
    #[error("is not a fraction in [0, 1]; write a value in that range")]
    Fraction,
    /// A negative, infinite or undefined emission.
    #[error("is not a finite radiance of at least 0; write a value in that range")]
    Emission,
    /// An index of refraction that is not finite and positive.
    #[error("is not an index of refraction, a finite positive number (glass has 1.5)")]
    IndexOfRefraction,
    /// A Phong exponent that is not finite and non-negative.
    #[error("is not a finite exponent of at least 0")]
    Exponent,
}

/// Reads a file, telling a missing one from an unreadable one.
pub(crate) fn read_file(file: &Path, named_at: Option<&Place>) -> Result<Vec<u8>, LoadError> {
    std::fs::read(file).map_err(|source| {
        if source.kind() == std::io::ErrorKind::NotFound {
            LoadError::Missing {
                file: file.to_owned(),
                named_at: named_at.cloned(),
            }
        } else {
            LoadError::Unreadable {
                file: file.to_owned(),
                source,
            }
        }
    })
}

/// A name that is not known, with the nearest one that is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownName {
    /// The name as written.
    pub name: Box<str>,
    /// A known name like it.
    pub nearest: Option<Box<str>>,
}

impl UnknownName {
    pub(crate) fn new<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Self {
        Self {
            name: name.into(),
            nearest: super::place::nearest(name, known).map(Into::into),
        }
    }
}

impl std::fmt::Display for UnknownName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "`{}`{}", self.name, suggestion(self.nearest.as_deref()))
    }
}
