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

#[cfg(test)]
mod tests {
    use crate::load::{Loaded, load};
    use std::path::PathBuf;

    fn data(scene: &str, file: &str) -> PathBuf {
        let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("data");
        folder.join(scene).join(file)
    }

    /// What a scene file beside nothing else gives.
    fn scene(text: &str) -> Loaded {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let file = folder.path().join("a.toml");
        std::fs::write(&file, text).expect("the file is written");
        load(&file).unwrap_or_else(|error| panic!("{error}"))
    }

    #[test]
    fn each_vertex_has_a_place_in_the_file() {
        let loaded = load(data("pavilion", "pavilion.gltf")).expect("the scene is valid");
        let origin = loaded.origin.expect("one file");
        assert_eq!(origin.runs.len(), 9, "eight nodes, one with two primitives");
        assert_eq!((origin.lights, origin.cameras), (3, 1));
        let mut next = 0;
        for run in &origin.runs {
            assert_eq!(run.vertices.start, next);
            next = run.vertices.end;
        }
        assert_eq!(next as usize, loaded.scene.vertices.len());
        for corner in loaded.scene.corners.vertex {
            let (run, number) = origin.find(corner).expect("all are from the file");
            assert_eq!(origin.runs[run].vertices.start + number, corner);
        }
        assert_eq!(origin.find(next), None);
        let mirrored = origin.runs.iter().filter(|run| run.is_mirrored);
        assert_eq!(mirrored.count(), 1);
    }

    #[test]
    fn the_file_can_be_read_again() {
        let loaded = load(data("pavilion", "pavilion.gltf")).expect("the scene is valid");
        let bytes = loaded
            .origin
            .expect("one file")
            .read()
            .expect("it is still there");
        let file = |name| std::fs::read(data("pavilion", name)).expect("it is there");
        assert_eq!(bytes.json, file("pavilion.gltf"));
        assert_eq!(bytes.buffers, [file("pavilion.bin")]);
        assert_eq!(bytes.images[0], Some(file("tile.png")));
        let data = bytes.images[1].as_ref().expect("a data URI");
        assert!(data.starts_with(b"\x89PNG"));
    }

    #[test]
    fn several_sources_have_no_origin() {
        let pavilion = data("pavilion", "pavilion.gltf");
        let cornell = data("cornell", "cornell.obj");
        let one = scene(&format!(
            "geometry = [{pavilion:?}]\n[scene]\nscale = 2\n[material.wood]\nreflectance = 0.5"
        ));
        let origin = one.origin.expect("one file");
        assert_eq!(origin.scale, 2.0);
        let changed: Vec<&str> = origin
            .changed
            .iter()
            .map(|id| one.scene.materials[id.index()].name.as_str())
            .collect();
        assert_eq!(changed, ["wood"]);
        for text in [
            format!("geometry = [{pavilion:?}, {pavilion:?}]"),
            format!("geometry = [{pavilion:?}, {cornell:?}]"),
            format!("geometry = [{cornell:?}, {pavilion:?}]"),
            format!("geometry = [{cornell:?}]"),
            format!(
                "geometry = [{pavilion:?}]\n[[polygon]]\nmaterial = \"wood\"\nvertices = [[0,0,9],[1,0,9],[0,1,9]]"
            ),
        ] {
            assert_eq!(scene(&text).origin, None, "{text}");
        }
    }
}
