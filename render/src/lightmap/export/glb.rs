//! A scene as binary glTF with lightmap coordinates in `TEXCOORD_1`.
//!
//! Source: Khronos Group, "glTF 2.0 Specification", 2021 (ISO/IEC 12113:2022), chapter 4 for the container and 3.7 for meshes;
//! extensions `KHR_lights_punctual`, `KHR_materials_emissive_strength`, `KHR_materials_transmission`, `KHR_materials_ior`. The
//! format's v grows downwards from the first row of the image, as that of [`Atlas::uv`].
//!
//! A scene that came from one glTF file keeps its document (`original`): hierarchy, cameras, lights, materials, images in
//! their own encoding, animations, and extensions and extras that luxel knows nothing of. Each node with a mesh gets a mesh of
//! its own, since instances have light of their own. What a scene file changes is written too: factors of materials, materials
//! of objects, the scale (as a node above all), further lights and cameras; textures that it gives to materials of the document are
//! not. Other scenes are written anew (`made`). Skies, environments and Lambertian lights have no place in the format and are left out.
//!
//! # How a consumer finds the maps
//!
//! Each node with a lightmap says so in its `extras`, and all primitives of such a node are on one page:
//!
//! ```json
//! "luxel_lightmap": {"page": 0, "file": "lightmap_000.exr", "texCoord": 1, "rect": {"min": [0, 0], "max": [0.5, 0.25]}}
//! ```
//!
//! Extras that the node had stay beside it; one that was no object stands in the object's member `extras`. `rect` bounds the texels
//! of its faces, in texture coordinates. A node whose faces are on several pages becomes a parent of
//! one child a page, and one for what has no lightmap. Where that cannot be, because morph targets or GPU instances belong to
//! the node, the primitives of its mesh carry the extras instead. three.js (`GLTFLoader` of r187) gives extras of nodes to
//! `Object3D.userData`, those of a mesh to every `Mesh` of it, and those of a primitive to `geometry.userData`; Bevy has them as
//! the component `GltfExtras` at the entities of nodes and of primitives.
//!
//! Cost: linear in the corners, with tables of the vertices of one primitive at a time; all bytes are held twice.

mod attach;
mod compact;
mod document;
mod embed;
mod made;
mod original;
mod renamed;
mod surfaces;
mod texture_sets;
mod vertices;
mod views;

pub use renamed::renamed;

use super::pages::Pages;
use crate::lightmap::atlas::Atlas;
use crate::lightmap::cut::Weights;
use luxel_scenes::{GltfOrigin, LoadError, Scene, UnitSystem};
use std::borrow::Cow;
use std::path::PathBuf;

/// Why a scene cannot be written as binary glTF.
#[derive(Debug, thiserror::Error)]
pub enum GlbError {
    /// The scene's file can no longer be read, or an image that it names never could.
    #[error("the scene's file cannot be read again: {0}")]
    Load(#[from] Box<LoadError>),
    /// The scene's file is not the one that was baked.
    #[error("{}: {what}; the file was changed since it was read: bake again", file.display())]
    Changed {
        /// The file.
        file: PathBuf,
        /// What is not as it was.
        what: String,
    },
    /// An attribute that rendering does not need is not as the format says.
    #[error(
        "{}: {attribute} of the mesh of node {node} has not one readable value for each vertex; export the file again",
        file.display()
    )]
    Attribute {
        /// The file.
        file: PathBuf,
        /// The node's index in the document.
        node: usize,
        /// The attribute, such as COLOR_0.
        attribute: String,
    },
    /// An image could not be encoded.
    #[error("texture `{name}` cannot be written as PNG: {source}")]
    Texture {
        /// The texture's name.
        name: String,
        /// What the encoder said.
        source: image::ImageError,
    },
    /// Fewer file names than pages.
    #[error(
        "the lightmap has {pages} page(s), but {maps} file name(s) are given; name a file for each page"
    )]
    Maps {
        /// Pages of the lightmap.
        pages: usize,
        /// File names.
        maps: usize,
    },
    /// Bytes that are not those of a bake.
    #[error("not the scene of a bake: {0}; bake again: luxel bake SCENE -o DIR")]
    NotOurs(&'static str),
    /// The container counts its bytes in 32 bits.
    #[error(
        "the scene takes {0} bytes, and a GLB file holds less than 4 GiB; bake it in parts or write OBJ"
    )]
    TooLarge(usize),
    /// The document cannot be written as JSON.
    #[error("the document cannot be written: {0}")]
    Json(#[from] serde_json::Error),
}

/// What all parts of the writing ask: the scene, where its faces lie, and in which file.
#[derive(Clone, Copy)]
struct Baked<'b> {
    scene: &'b Scene,
    atlas: &'b Atlas,
    pages: &'b Pages,
    maps: &'b [String],
    /// What the corners of faces that were cut are made of.
    corners: Option<&'b [Weights]>,
}

impl Baked<'_> {
    /// The vertices of the scene's file that a corner is made of, with their weights.
    fn vertices(&self, corner: usize) -> Cow<'_, [(u32, f64)]> {
        match self.corners {
            Some(corners) => Cow::Borrowed(&corners[corner]),
            None => Cow::Owned(vec![(self.scene.corners.vertex[corner], 1.0)]),
        }
    }
}

/// The bytes of a GLB file. `origin` is the file that the scene came from ([`luxel_scenes::Loaded::origin`]), read again here;
/// `maps` are the file names of the pages; `corners` tells of a scene whose faces were cut what its corners are made of
/// ([`crate::lightmap::cut::CutScene::corners`]).
///
/// # Errors
/// When the scene's file can no longer be read, a page has no file name, or the bytes are too many for the format.
///
/// # Panics
/// When the atlas is not one of this scene.
pub fn glb(
    scene: &Scene,
    origin: Option<&GltfOrigin>,
    corners: Option<&[Weights]>,
    atlas: &Atlas,
    maps: &[String],
) -> Result<Vec<u8>, GlbError> {
    if maps.len() < atlas.pages {
        return Err(GlbError::Maps {
            pages: atlas.pages,
            maps: maps.len(),
        });
    }
    let pages = Pages::new(scene, atlas);
    let baked = Baked {
        scene,
        atlas,
        pages: &pages,
        maps,
        corners,
    };
    let document = match origin {
        Some(origin) => original::document(baked, origin)?,
        None => made::document(baked)?,
    };
    document.into_glb()
}

/// What the scene counts light in, for the extras of the document: glTF itself knows lumens only.
fn units(scene: &Scene) -> &'static str {
    match scene.units {
        UnitSystem::Radiometric => "radiometric",
        UnitSystem::Photometric => "photometric",
    }
}

#[cfg(test)]
mod tests;
