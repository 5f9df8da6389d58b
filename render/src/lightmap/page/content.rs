//! The content of a baked folder that a page shows.
//!
//! A manifest names files, and only such as lie beside it are read: a folder from elsewhere cannot make a page hold others.

use crate::image::Image;
use crate::image::exr::{self, ReadExrError};
use crate::lightmap::manifest::{Manifest, SCHEMA};
use image::{ImageError, ImageFormat};
use std::path::{Path, PathBuf};

/// What a page shows.
#[derive(Clone, Debug)]
pub struct Content {
    /// What the folder says of itself.
    pub manifest: Manifest,
    /// The scene as binary glTF.
    pub glb: Vec<u8>,
    /// One for each page of the manifest.
    pub pages: Vec<Maps>,
}

/// The maps of a page, all of one size.
#[derive(Clone, Debug)]
pub struct Maps {
    /// What the engine loads.
    pub light: Image,
    /// Its standard error, in the same unit.
    pub error: Image,
    /// What each texel is, as samples of a grey picture.
    pub validity: Vec<u8>,
    /// The charts, as a PNG file.
    pub charts: Vec<u8>,
}

/// Why a folder cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum ContentError {
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

impl Content {
    /// Reads a folder that `luxel bake` wrote.
    ///
    /// # Errors
    /// When it has no manifest or one of another schema, or when a file that the manifest names is missing, damaged, of another
    /// size, or not beside it.
    pub fn read(folder: &Path) -> Result<Self, ContentError> {
        let path = folder.join("manifest.json");
        let text = match std::fs::read(&path) {
            Err(error) if is_absent(&error) => {
                return Err(ContentError::NoManifest(folder.to_path_buf()));
            }
            other => other.map_err(|error| ContentError::Unreadable(path.clone(), error))?,
        };
        let bad = |error| ContentError::Manifest(path.clone(), error);
        let Version { schema } = serde_json::from_slice(&text).map_err(bad)?;
        if schema != u64::from(SCHEMA) {
            return Err(ContentError::Schema {
                path,
                found: schema,
            });
        }
        let manifest: Manifest = serde_json::from_slice(&text).map_err(bad)?;
        let place = |name: &str| -> Result<PathBuf, ContentError> {
            let is_plain = Path::new(name).file_name().is_some_and(|own| own == name);
            if is_plain {
                Ok(folder.join(name))
            } else {
                Err(ContentError::Name {
                    path: path.clone(),
                    name: name.to_owned(),
                })
            }
        };
        let glb = bytes(&place(&manifest.files.glb)?)?;
        let mut pages = Vec::new();
        for page in &manifest.lightmap.pages {
            let size = [page.width, page.height];
            pages.push(Maps {
                light: map(&place(&page.file)?, size)?,
                error: map(&place(&page.error)?, size)?,
                validity: grey(&place(&page.validity)?, size)?,
                charts: bytes(&place(&page.charts)?)?,
            });
        }
        Ok(Self {
            manifest,
            glb,
            pages,
        })
    }
}

/// Whether there is no such file: also when what should be its folder is a file.
fn is_absent(error: &std::io::Error) -> bool {
    use std::io::ErrorKind::{NotADirectory, NotFound};
    matches!(error.kind(), NotFound | NotADirectory)
}

fn bytes(path: &Path) -> Result<Vec<u8>, ContentError> {
    std::fs::read(path).map_err(|error| ContentError::Unreadable(path.to_path_buf(), error))
}

fn map(path: &Path, size: [usize; 2]) -> Result<Image, ContentError> {
    let image = exr::read(path)?.image;
    require_size(path, [image.width, image.height], size)?;
    Ok(image)
}

fn grey(path: &Path, size: [usize; 2]) -> Result<Vec<u8>, ContentError> {
    let file = bytes(path)?;
    let image = image::load_from_memory_with_format(&file, ImageFormat::Png)
        .map_err(|error| ContentError::Picture(path.to_path_buf(), error))?
        .to_luma8();
    let found = [image.width() as usize, image.height() as usize];
    require_size(path, found, size)?;
    Ok(image.into_raw())
}

fn require_size(path: &Path, found: [usize; 2], expected: [usize; 2]) -> Result<(), ContentError> {
    if found == expected {
        return Ok(());
    }
    Err(ContentError::Size {
        path: path.to_path_buf(),
        found,
        expected,
    })
}
