//! The content of a baked folder that a page shows.

use crate::image::Image;
use crate::lightmap::folder::{BakedFolder, FolderError};
use crate::lightmap::manifest::Manifest;
use std::path::Path;

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
    /// What the engine loads, as it was found: irradiance.
    pub light: Image,
    /// Its standard error, in the same unit.
    pub error: Image,
    /// What each texel is, as samples of a grey picture.
    pub validity: Vec<u8>,
    /// The charts, as a PNG file.
    pub charts: Vec<u8>,
}

impl Content {
    /// Reads a folder that `luxel bake` wrote.
    ///
    /// # Errors
    /// When it has no manifest or one of another schema, or when a file that the manifest names is missing, damaged, of another
    /// size, or not beside it.
    pub fn read(folder: &Path) -> Result<Self, FolderError> {
        let folder = BakedFolder::open(folder)?;
        let manifest = folder.manifest().clone();
        let glb = folder.bytes(&manifest.files.glb)?;
        let mut pages = Vec::new();
        for page in &manifest.lightmap.pages {
            let size = [page.width, page.height];
            pages.push(Maps {
                light: folder.map(&page.master, size)?,
                error: folder.map(&page.error, size)?,
                validity: folder.grey(&page.validity, size)?,
                charts: folder.bytes(&page.charts)?,
            });
        }
        Ok(Self {
            manifest,
            glb,
            pages,
        })
    }
}
