//! Where in a glTF file the vertices of a scene come from, and the file's bytes once more.
//!
//! The reader puts the vertices of each primitive into the scene as one run for every node that has it, in the order of the
//! accessor, and never joins any. So the number of a vertex tells its node, its primitive and its number in the accessors:
//! what writes a scene back into its document needs no more than one range a primitive and node. Cost: 24 bytes each.

use super::source::Source;
use crate::id::MaterialId;
use crate::load::{LoadError, read_file};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The vertices of one primitive at one node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VertexOrigin {
    /// Indices in [`crate::Scene::vertices`]; the first is vertex 0 of the primitive's accessors.
    pub vertices: Range<u32>,
    /// The node in the document.
    pub node: u32,
    /// The primitive in the mesh of the node.
    pub primitive: u32,
    /// Whether the node's transform mirrors: faces of the scene then turn the other way round than those of the file.
    pub is_mirrored: bool,
}

/// The one glTF file that all faces of a scene come from.
///
/// Objects, materials, textures, lights and cameras of the file stand in the scene in the order of the document's nodes and
/// arrays; what a scene file adds is told from them by [`Self::lights`] and [`Self::cameras`].
#[derive(Clone, Debug, PartialEq)]
pub struct GltfOrigin {
    /// The file as it was opened.
    pub file: PathBuf,
    /// Runs of vertices in ascending order, without gaps from vertex 0 to the last. Primitives that are not made of
    /// triangles have none.
    pub runs: Vec<VertexOrigin>,
    /// Metres per unit of the document, which is 1 unless a scene file says otherwise.
    pub scale: f64,
    /// Materials of the document that a scene file changes, in ascending order.
    pub changed: Vec<MaterialId>,
    /// Number of lights that come from the document: the first ones of the scene.
    pub lights: usize,
    /// Number of cameras that come from the document: the last ones of the scene.
    pub cameras: usize,
}

/// The bytes of a glTF file and of all that it refers to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GltfBytes {
    /// The document as JSON text, valid for the reader.
    pub json: Vec<u8>,
    /// Contents of each buffer, at least as long as the document says.
    pub buffers: Vec<Vec<u8>>,
    /// Encoded contents of each image that has a URI; `None` for images in buffer views.
    pub images: Vec<Option<Vec<u8>>>,
}

impl GltfOrigin {
    /// The run that a vertex of the scene belongs to and its number in the primitive; `None` for a vertex that does not
    /// come from the file.
    pub fn find(&self, vertex: u32) -> Option<(usize, u32)> {
        let behind = self.runs.partition_point(|run| run.vertices.end <= vertex);
        let run = self.runs.get(behind)?;
        Some((behind, vertex.checked_sub(run.vertices.start)?))
    }

    /// Reads the file again, with every buffer and image that it names.
    ///
    /// # Errors
    /// When one of the files is no longer there or no longer valid, or an image that rendering does not need (such as a normal
    /// map) never was there.
    pub fn read(&self) -> Result<GltfBytes, LoadError> {
        let bytes = read_file(&self.file, None)?;
        let source = Source::read(&self.file, None)?;
        let images = source.document.as_json().images.iter().enumerate();
        let images = images
            .map(|(index, image)| {
                let read = image.uri.as_ref().map(|_| source.image(index));
                Ok(read.transpose()?.map(|(bytes, _)| bytes))
            })
            .collect::<Result<_, LoadError>>()?;
        Ok(GltfBytes {
            json: json(&self.file, bytes)?,
            buffers: source.into_buffers(),
            images,
        })
    }
}

/// The JSON text of a file, which is all of it or a chunk.
fn json(file: &Path, bytes: Vec<u8>) -> Result<Vec<u8>, LoadError> {
    if !bytes.starts_with(b"glTF") {
        return Ok(bytes);
    }
    let container = gltf::Glb::from_slice(&bytes).map_err(|source| super::GltfError::Document {
        file: file.to_owned(),
        source: Box::new(source),
    })?;
    Ok(container.json.into_owned())
}
