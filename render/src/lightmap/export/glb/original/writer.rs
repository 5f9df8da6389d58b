//! Meshes of the scene's faces, with the attributes of the file.
//!
//! A node's mesh is made of the faces that the scene has: those without area or there twice are gone, strips and fans are triangles,
//! and vertices stand once for each place in the atlas. All attributes and morph targets are copied as they are stored, and mixed where a
//! face was cut.
//! Faces of mirrored nodes turn as in the file. Primitives of points and lines stay.

use super::{Groups, Materials, Node, Source};
use crate::lightmap::cut::Weights;
use crate::lightmap::export::glb::attach::{Mesh, Part, attach};
use crate::lightmap::export::glb::document::{Document, items_mut, object_mut, set};
use crate::lightmap::export::glb::vertices::{Attribute, Mixing, write_indices};
use crate::lightmap::export::glb::{Baked, GlbError, texture_sets};
use luxel_scenes::{FaceId, MaterialId};
use serde_json::{Map, Value};
use std::collections::{BTreeMap, HashMap};

/// Values of the vertices of a primitive, and of its morph targets.
struct Vertices {
    attributes: Vec<(String, Attribute)>,
    targets: Vec<Vec<(String, Attribute)>>,
}

/// Gives a node a mesh of its own.
pub(super) fn write_node(
    document: &mut Document,
    baked: Baked,
    source: &Source,
    materials: &Materials,
    groups: &Groups,
    node: &Node,
) -> Result<(), GlbError> {
    let mut parts: BTreeMap<Option<u32>, Part> = BTreeMap::new();
    let empty = |page| Part {
        page,
        faces: Vec::new(),
        primitives: Vec::new(),
    };
    let mut has_targets = false;
    for run in node.runs.clone() {
        let primitive = source.primitive(run);
        let vertices = read(document, source, run).map_err(|attribute| GlbError::Attribute {
            file: source.origin.file.clone(),
            node: node.index,
            attribute,
        })?;
        has_targets |= !vertices.targets.is_empty();
        let least = (run, None, MaterialId(0));
        let behind = (run + 1, None, MaterialId(0));
        for (&(_, page, material), faces) in groups.range(least..behind) {
            let split = Split::new(baked, source, run, page, faces);
            let sets = texture_sets::count(primitive);
            let chosen = materials.of(run, material, page.is_some(), sets);
            let written = write_primitive(document, primitive, &vertices, &split, chosen);
            let part = parts.entry(page).or_insert_with(|| empty(page));
            part.primitives.push(written);
            part.faces.extend(faces);
        }
    }
    let mut untouched = source.untouched(node).cloned().peekable();
    if untouched.peek().is_some() {
        let part = parts.entry(None).or_insert_with(|| empty(None));
        part.primitives.extend(untouched);
    }
    let own = &document.items("nodes")[node.index];
    let has_instances = own.pointer("/extensions/EXT_mesh_gpu_instancing").is_some();
    let mut members = source.meshes[node.mesh].clone();
    object_mut(&mut members).remove("primitives");
    let mesh = Mesh {
        members,
        slot: node.takes_place.then_some(node.mesh),
        can_be_split: !has_targets && !has_instances,
    };
    let parts = parts.into_values().collect();
    attach(document, baked, node.index, mesh, parts);
    Ok(())
}

/// Reads all attributes of a primitive; the name of one that does not have a value for each vertex is an error.
fn read(document: &Document, source: &Source, run: usize) -> Result<Vertices, String> {
    let primitive = source.primitive(run);
    let count = source.run(run).vertices.len();
    let read = |attributes: &Value| -> Result<Vec<(String, Attribute)>, String> {
        let attributes = attributes.as_object().into_iter().flatten();
        attributes
            .map(|(name, accessor)| {
                let accessor = accessor.as_u64().and_then(|a| usize::try_from(a).ok());
                let read = accessor.and_then(|a| Attribute::read(document, a, count));
                Ok((name.clone(), read.ok_or_else(|| name.clone())?))
            })
            .collect()
    };
    let targets = primitive.get("targets").and_then(Value::as_array);
    Ok(Vertices {
        attributes: read(&primitive["attributes"])?,
        targets: targets
            .into_iter()
            .flatten()
            .map(read)
            .collect::<Result<_, _>>()?,
    })
}

/// Makes a primitive like another, of the vertices that some of its faces need. `chosen` is its material and whether that looks
/// for set 1 behind all others.
fn write_primitive(
    document: &mut Document,
    like: &Value,
    vertices: &Vertices,
    split: &Split,
    (material, is_moved): (Option<usize>, bool),
) -> Value {
    let sets = texture_sets::count(like);
    let mut attributes = Map::new();
    for (name, attribute) in &vertices.attributes {
        let is_second = name == "TEXCOORD_1" && split.places.is_some();
        if is_second && !is_moved {
            continue;
        }
        let name = if is_second {
            format!("TEXCOORD_{sets}")
        } else {
            name.clone()
        };
        let is_position = name == "POSITION";
        let picked = attribute.pick(&split.numbers, Mixing::of(&name));
        let accessor = picked.write(document, is_position);
        attributes.insert(name, accessor.into());
    }
    if let Some(places) = &split.places {
        let accessor = Attribute::floats(places.iter().copied()).write(document, false);
        attributes.insert("TEXCOORD_1".to_owned(), accessor.into());
        // Sets are numbered without gaps: where there was none, the first is the lightmap's too.
        attributes.entry("TEXCOORD_0").or_insert(accessor.into());
    }
    let mut targets = Vec::new();
    for target in &vertices.targets {
        let mut written = Map::new();
        for (name, attribute) in target {
            let picked = attribute.pick(&split.numbers, Mixing::Components);
            let accessor = picked.write(document, name == "POSITION");
            written.insert(name.clone(), accessor.into());
        }
        targets.push(Value::Object(written));
    }
    let indices = write_indices(document, &split.indices);

    let mut primitive = like.clone();
    let members = object_mut(&mut primitive);
    members.remove("mode");
    members.remove("material");
    set(&mut primitive, "attributes", attributes);
    set(&mut primitive, "indices", indices);
    if let Some(material) = material {
        set(&mut primitive, "material", material);
    }
    if !targets.is_empty() {
        *items_mut(object_mut(&mut primitive), "targets") = targets;
    }
    primitive
}

/// What a vertex is made of and its place in the atlas, bit by bit.
type Identity = (Vec<(u32, u64)>, [u32; 2]);

/// The vertices that faces need: one for each vertex of the file and place in the atlas, in the order of the faces.
struct Split {
    indices: Vec<u32>,
    /// Their numbers in the file's accessors, with the weights of those that they are made of.
    numbers: Vec<Weights>,
    /// Their lightmap coordinates, where the faces have a lightmap.
    places: Option<Vec<[f32; 2]>>,
}

impl Split {
    fn new(baked: Baked, source: &Source, run: usize, page: Option<u32>, faces: &[FaceId]) -> Self {
        let Baked { scene, atlas, .. } = baked;
        let origin = source.run(run);
        let (mut indices, mut numbers, mut places) = (Vec::new(), Vec::new(), Vec::new());
        let mut known: HashMap<Identity, u32> = HashMap::new();
        for face in faces {
            let mut corners: Vec<usize> = scene.faces[face.index()].corners().collect();
            if origin.is_mirrored {
                // As the reader turned them: the first corner stays.
                corners[1..].reverse();
            }
            // Faces that were cut have more than three corners.
            let fan = (1..corners.len() - 1).flat_map(|next| [0, next, next + 1]);
            for corner in fan.map(|number| corners[number]) {
                let vertices = baked.vertices(corner);
                let own = vertices.iter();
                let number: Weights = own
                    .map(|&(vertex, weight)| (vertex - origin.vertices.start, weight))
                    .collect();
                let place = match page {
                    Some(_) => atlas.uv(atlas.corners[corner]).as_vec2().to_array(),
                    None => [0.0; 2],
                };
                let bits = number.iter().map(|&(n, weight)| (n, weight.to_bits()));
                let key = (bits.collect(), place.map(f32::to_bits));
                let vertex = *known.entry(key).or_insert_with(|| {
                    numbers.push(number);
                    places.push(place);
                    numbers.len() as u32 - 1
                });
                indices.push(vertex);
            }
        }
        Self {
            indices,
            numbers,
            places: page.map(|_| places),
        }
    }
}
