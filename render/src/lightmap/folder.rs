//! A finished bake, read again.
//!
//! A manifest names files, and only such as lie beside it are read: a folder from elsewhere cannot make luxel open others.

use super::manifest::{Manifest, SCHEMA};
use crate::image::Image;
use crate::image::exr::{self, ReadExrError};
use image::{ImageError, ImageFormat};
use std::path::{Path, PathBuf};

/// Why a folder cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// Not a baked folder.
    #[error("{}: there is no manifest.json, so this is no finished bake; make one: luxel bake SCENE -o {}", .0.display(), .0.display())]
    NoManifest(PathBuf),
    /// The system refused, or a file is missing.
    #[error("cannot read {}; bake again if it is missing: luxel bake SCENE -o DIR", .0.display())]
    Unreadable(PathBuf, #[source] std::io::Error),
    /// Not a manifest.
    #[error("{}: not a manifest that this luxel writes; bake again: luxel bake SCENE -o DIR", .0.display())]
    Manifest(PathBuf, #[source] serde_json::Error),
    /// A manifest of another version.
    #[error("{}: schema {found}, and this luxel reads schema {SCHEMA}; bake again: luxel bake SCENE -o DIR", path.display())]
    Schema {
        /// The manifest.
        path: PathBuf,
        /// Its version.
        found: u64,
    },
    /// A name that leads out of the folder.
    #[error("{}: names the file `{name}`, which does not lie beside it; correct the name or bake again", path.display())]
    Name {
        /// The manifest.
        path: PathBuf,
        /// The name.
        name: String,
    },
    /// A damaged map.
    #[error("a map of the bake is missing or damaged; bake again: luxel bake SCENE -o DIR")]
    Map(#[from] ReadExrError),
    /// A damaged picture.
    #[error("{}: not a readable PNG image; bake again: luxel bake SCENE -o DIR", .0.display())]
    Picture(PathBuf, #[source] ImageError),
    /// A map that is not as large as the manifest says.
    #[error(
        "{}: {} × {} texels where manifest.json says {} × {}; bake again: luxel bake SCENE -o DIR",
        path.display(), found[0], found[1], expected[0], expected[1]
    )]
    Size {
        /// The map.
        path: PathBuf,
        /// Its width and height.
        found: [usize; 2],
        /// Those of the manifest.
        expected: [usize; 2],
    },
}

/// What every version of a manifest has.
#[derive(serde::Deserialize)]
struct Version {
    schema: u64,
}

/// A folder that `luxel bake` or `luxel export` wrote.
#[derive(Clone, Debug)]
pub struct BakedFolder {
    path: PathBuf,
    manifest: Manifest,
}

impl BakedFolder {
    /// Opens a folder.
    ///
    /// # Errors
    /// When it has no manifest or one of another schema.
    pub fn open(folder: &Path) -> Result<Self, FolderError> {
        let path = folder.join("manifest.json");
        let text = match std::fs::read(&path) {
            Err(error) if is_absent(&error) => {
                return Err(FolderError::NoManifest(folder.to_path_buf()));
            }
            other => other.map_err(|error| FolderError::Unreadable(path.clone(), error))?,
        };
        let bad = |error| FolderError::Manifest(path.clone(), error);
        let Version { schema } = serde_json::from_slice(&text).map_err(bad)?;
        if schema != u64::from(SCHEMA) {
            return Err(FolderError::Schema {
                path,
                found: schema,
            });
        }
        Ok(Self {
            path: folder.to_path_buf(),
            manifest: serde_json::from_slice(&text).map_err(bad)?,
        })
    }

    /// What it says of itself.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Looks whether a file that the manifest names is there.
    ///
    /// # Errors
    /// When it is missing or does not lie in the folder.
    pub fn require(&self, name: &str) -> Result<(), FolderError> {
        let path = self.place(name)?;
        match std::fs::metadata(&path) {
            Err(error) => Err(FolderError::Unreadable(path, error)),
            Ok(_) => Ok(()),
        }
    }

    /// The bytes of a file that the manifest names.
    ///
    /// # Errors
    /// When it is missing, cannot be read, or does not lie in the folder.
    pub fn bytes(&self, name: &str) -> Result<Vec<u8>, FolderError> {
        let path = self.place(name)?;
        std::fs::read(&path).map_err(|error| FolderError::Unreadable(path, error))
    }

    /// An EXR file that the manifest names, of a size (width, height) that it states.
    ///
    /// # Errors
    /// When it is missing, damaged, of another size, or does not lie in the folder.
    pub fn map(&self, name: &str, size: [usize; 2]) -> Result<Image, FolderError> {
        let path = self.place(name)?;
        let image = exr::read(&path)?.image;
        require_size(&path, [image.width, image.height], size)?;
        Ok(image)
    }

    /// The samples of a grey PNG file that the manifest names, of a size (width, height) that it states.
    ///
    /// # Errors
    /// As [`Self::map`].
    pub fn grey(&self, name: &str, size: [usize; 2]) -> Result<Vec<u8>, FolderError> {
        let file = self.bytes(name)?;
        let path = self.place(name)?;
        let image = image::load_from_memory_with_format(&file, ImageFormat::Png)
            .map_err(|error| FolderError::Picture(path.clone(), error))?
            .to_luma8();
        let found = [image.width() as usize, image.height() as usize];
        require_size(&path, found, size)?;
        Ok(image.into_raw())
    }

    fn place(&self, name: &str) -> Result<PathBuf, FolderError> {
        let is_plain = Path::new(name).file_name().is_some_and(|own| own == name);
        if is_plain {
            Ok(self.path.join(name))
        } else {
            Err(FolderError::Name {
                path: self.path.join("manifest.json"),
                name: name.to_owned(),
            })
        }
    }
}

/// Whether there is no such file: also when what should be its folder is a file.
fn is_absent(error: &std::io::Error) -> bool {
    use std::io::ErrorKind::{NotADirectory, NotFound};
    matches!(error.kind(), NotFound | NotADirectory)
}

fn require_size(path: &Path, found: [usize; 2], expected: [usize; 2]) -> Result<(), FolderError> {
    if found == expected {
        return Ok(());
    }
    Err(FolderError::Size {
        path: path.to_path_buf(),
        found,
        expected,
    })
}
