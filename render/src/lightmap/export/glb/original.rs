//! The document that a scene came from, with lightmap coordinates.
//!
//! Each run of vertices in the scene is a primitive at a node ([`GltfOrigin`]), and a vertex's number in its run is the number
//! in the primitive's accessors. So the faces of the scene tell what each node is to draw (here), of which material (`materials`) and
//! with which vertices (`writer`). Cost: linear in the corners.

mod materials;
mod writer;

use super::document::{Document, child_mut, extras_mut, index, set};
use super::{Baked, GlbError, compact, embed, units, views};
use luxel_scenes::gltf_file::VertexOrigin;
use luxel_scenes::{FaceId, GltfOrigin, MaterialId};
use materials::Materials;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// Faces of one run, page and material of the scene.
type Key = (usize, Option<u32>, MaterialId);

/// All faces by what they are drawn with.
type Groups = BTreeMap<Key, Vec<FaceId>>;

/// The document of a scene that came from one file.
pub(super) fn document(baked: Baked, origin: &GltfOrigin) -> Result<Document, GlbError> {
    let changed = |what: &str| GlbError::Changed {
        file: origin.file.clone(),
        what: what.to_owned(),
    };
    let bytes = origin.read().map_err(Box::new)?;
    let mut document = embed::document(&bytes, &changed)?;
    drop(bytes);
    let extras = extras_mut(child_mut(&mut document.root, "asset"));
    set(extras, "luxel_units", units(baked.scene));
    let groups = groups(baked, origin).ok_or_else(|| changed("a face is not there"))?;
    let source = Source::new(&document, origin);
    let source = source.ok_or_else(|| changed("a primitive is not there"))?;
    let materials = Materials::choose(&mut document, baked.scene, &source, &groups)?;
    for node in &source.nodes {
        writer::write_node(&mut document, baked, &source, &materials, &groups, node)?;
    }
    views::add_changes(&mut document, baked.scene, origin);
    compact::compact(&mut document);
    Ok(document)
}

/// The faces by what they are drawn with; `None` when a face does not come from the file.
fn groups(baked: Baked, origin: &GltfOrigin) -> Option<Groups> {
    let scene = baked.scene;
    let mut groups = Groups::new();
    for id in scene.face_ids() {
        let face = scene.faces[id.index()];
        let (vertex, _) = baked.vertices(face.first_corner as usize)[0];
        let (run, _) = origin.find(vertex)?;
        let key = (run, baked.pages.of(id), face.material);
        groups.entry(key).or_default().push(id);
    }
    Some(groups)
}

/// A node that faces of the scene come from.
struct Node {
    /// Its index in the document.
    index: usize,
    /// Numbers of its runs.
    runs: std::ops::Range<usize>,
    /// Its mesh.
    mesh: usize,
    /// Whether its new mesh takes the place of the old, which nothing else uses.
    takes_place: bool,
}

/// The document as it was, as far as the scene's faces come from it.
struct Source<'o> {
    origin: &'o GltfOrigin,
    nodes: Vec<Node>,
    /// All meshes: those of the document are replaced one by one.
    meshes: Vec<Value>,
    /// The mesh of each run.
    mesh_of_run: Vec<usize>,
}

impl<'o> Source<'o> {
    /// Finds what runs come from; `None` when the document does not have it.
    fn new(document: &Document, origin: &'o GltfOrigin) -> Option<Self> {
        let meshes = document.items("meshes").to_vec();
        let all = document.items("nodes");
        let read: BTreeSet<u32> = origin.runs.iter().map(|run| run.node).collect();
        let others = (0_u32..).zip(all).filter(|(node, _)| !read.contains(node));
        let mut taken: BTreeSet<usize> =
            others.filter_map(|(_, node)| index(node, "mesh")).collect();
        let mut nodes = Vec::new();
        let mut mesh_of_run = Vec::new();
        for runs in origin.runs.chunk_by(|a, b| a.node == b.node) {
            let node = runs[0].node as usize;
            let mesh = index(all.get(node)?, "mesh")?;
            let count = primitives(meshes.get(mesh)?).len();
            if runs.iter().any(|run| run.primitive as usize >= count) {
                return None;
            }
            let first = mesh_of_run.len();
            mesh_of_run.resize(first + runs.len(), mesh);
            nodes.push(Node {
                index: node,
                runs: first..mesh_of_run.len(),
                mesh,
                takes_place: taken.insert(mesh),
            });
        }
        Some(Self {
            origin,
            nodes,
            meshes,
            mesh_of_run,
        })
    }

    fn run(&self, run: usize) -> &VertexOrigin {
        &self.origin.runs[run]
    }

    /// The primitive of a run, as the file has it.
    fn primitive(&self, run: usize) -> &Value {
        let mesh = &self.meshes[self.mesh_of_run[run]];
        &primitives(mesh)[self.run(run).primitive as usize]
    }

    /// Primitives of a node that the scene has nothing of: points and lines.
    fn untouched(&self, node: &Node) -> impl Iterator<Item = &Value> {
        let runs = &self.origin.runs[node.runs.clone()];
        let is_read = |number: usize| runs.iter().any(|run| run.primitive as usize == number);
        let all = primitives(&self.meshes[node.mesh]).iter().enumerate();
        all.filter(move |(number, _)| !is_read(*number))
            .map(|(_, primitive)| primitive)
    }
}

fn primitives(mesh: &Value) -> &[Value] {
    let primitives = mesh.get("primitives").and_then(Value::as_array);
    primitives.map_or(&[], Vec::as_slice)
}
