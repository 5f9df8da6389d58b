//! The document that a scene came from, with lightmap coordinates.
//!
//! Each run of vertices in the scene is a primitive at a node ([`GltfOrigin`]), and a vertex's number in its run is the number
//! in the primitive's accessors. A node's mesh is made of the scene's faces: those without area or there twice are gone, strips and
//! fans are triangles, and vertices stand once for each place in the atlas. All attributes and morph targets are copied
//! as they are stored. Faces of mirrored nodes turn as in the file. Primitives of points and lines stay.

use super::attach::{Mesh, Part, attach};
use super::document::{Document, index, items_mut, object_mut, set};
use super::surfaces::Surfaces;
use super::texture_sets::{self, Uses};
use super::vertices::{Attribute, write_indices};
use super::{Baked, GlbError, compact, embed, views};
use luxel_scenes::gltf_file::VertexOrigin;
use luxel_scenes::{FaceId, GltfOrigin, MaterialId};
use serde_json::{Map, Value};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Faces of one run, page and material of the scene.
type Key = (usize, Option<u32>, MaterialId);

/// The document of a scene that came from one file.
pub(super) fn document(baked: Baked, origin: &GltfOrigin) -> Result<Document, GlbError> {
    let changed = |what: &str| GlbError::Changed {
        file: origin.file.clone(),
        what: what.to_owned(),
    };
    let bytes = origin.read().map_err(Box::new)?;
    let mut document = embed::document(&bytes, &changed)?;
    drop(bytes);
    let groups = groups(baked, origin).ok_or_else(|| changed("a face is not there"))?;
    let nodes = nodes(&document, origin).ok_or_else(|| changed("a primitive is not there"))?;
    let meshes = nodes
        .iter()
        .flat_map(|(node, _)| node.runs.clone().map(|_| node.mesh));
    let mut writer = Writer {
        baked,
        origin,
        mesh_of_run: meshes.collect(),
        meshes: document.items("meshes").to_vec(),
        materials: BTreeMap::new(),
        moved: BTreeMap::new(),
        document: &mut document,
    };
    writer.choose_materials(&groups)?;
    writer.make_room(&groups, &nodes);
    for (node, mesh) in nodes {
        writer
            .write_node(&groups, &node, mesh)
            .ok_or_else(|| changed("an accessor is not as it was"))?;
    }
    views::add_changes(&mut document, baked.scene, origin);
    compact::compact(&mut document);
    Ok(document)
}

/// The faces by what they are drawn with; `None` when a face does not come from the file.
fn groups(baked: Baked, origin: &GltfOrigin) -> Option<BTreeMap<Key, Vec<FaceId>>> {
    let scene = baked.scene;
    let mut groups: BTreeMap<Key, Vec<FaceId>> = BTreeMap::new();
    for id in scene.face_ids() {
        let face = scene.faces[id.index()];
        let vertex = scene.corners.vertex[face.first_corner as usize];
        let (run, _) = origin.find(vertex)?;
        let key = (run, baked.pages.of(id), face.material);
        groups.entry(key).or_default().push(id);
    }
    Some(groups)
}

/// A node with its runs of vertices.
struct Node {
    /// Its index in the document.
    index: usize,
    /// Numbers of its runs.
    runs: std::ops::Range<usize>,
    /// Its mesh.
    mesh: usize,
}

/// What is to be put in the place of a mesh, once: it has no other use.
type Slot = Option<usize>;

/// The nodes that the scene's faces come from; `None` when the document does not have them.
fn nodes(document: &Document, origin: &GltfOrigin) -> Option<Vec<(Node, Slot)>> {
    let mut nodes = Vec::new();
    let mut first = 0;
    for runs in origin.runs.chunk_by(|a, b| a.node == b.node) {
        let index_of_node = runs[0].node as usize;
        let mesh = index(document.items("nodes").get(index_of_node)?, "mesh")?;
        let primitives = primitives(document.items("meshes").get(mesh)?)?;
        if runs
            .iter()
            .any(|run| run.primitive as usize >= primitives.len())
        {
            return None;
        }
        nodes.push(Node {
            index: index_of_node,
            runs: first..first + runs.len(),
            mesh,
        });
        first += runs.len();
    }
    let written: BTreeSet<usize> = nodes.iter().map(|node| node.index).collect();
    let others = document.items("nodes").iter().enumerate();
    let others = others.filter(|(node, _)| !written.contains(node));
    let mut taken: BTreeSet<usize> = others.filter_map(|(_, node)| index(node, "mesh")).collect();
    let slot = |node: Node| {
        let slot = taken.insert(node.mesh).then_some(node.mesh);
        (node, slot)
    };
    Some(nodes.into_iter().map(slot).collect())
}

fn primitives(mesh: &Value) -> Option<&[Value]> {
    mesh.get("primitives")?.as_array().map(Vec::as_slice)
}

/// Values of the vertices of a primitive, and of its morph targets.
struct Vertices {
    attributes: Vec<(String, Attribute)>,
    targets: Vec<Vec<(String, Attribute)>>,
}

struct Writer<'w> {
    baked: Baked<'w>,
    origin: &'w GltfOrigin,
    document: &'w mut Document,
    /// The meshes as they were: those of the document are replaced one by one.
    meshes: Vec<Value>,
    /// The mesh of each run.
    mesh_of_run: Vec<usize>,
    /// The document's material of each run and material of the scene.
    materials: BTreeMap<(usize, MaterialId), Option<usize>>,
    /// Which material stands for one whose set 1 has moved.
    moved: BTreeMap<(usize, usize), usize>,
}

impl Writer<'_> {
    fn run(&self, run: usize) -> &VertexOrigin {
        &self.origin.runs[run]
    }

    /// The primitive of a run as the file has it.
    fn primitive(&self, run: usize) -> Option<&Value> {
        let mesh = &self.meshes[self.mesh_of_run[run]];
        primitives(mesh)?.get(self.run(run).primitive as usize)
    }

    /// Finds the document's material of each group of faces, and adds those that a scene file made.
    fn choose_materials(&mut self, groups: &BTreeMap<Key, Vec<FaceId>>) -> Result<(), GlbError> {
        let scene = self.baked.scene;
        let count = self.document.items("materials").len();
        let mut surfaces = Surfaces::new(scene);
        for &(run, _, id) in groups.keys() {
            let own = self.primitive(run).and_then(|p| index(p, "material"));
            // The reader adds the format's default behind the materials of the document.
            let is_default = own.is_none() && id.index() == count;
            let material = if id.index() < count {
                Some(id.index())
            } else if is_default && !self.origin.changed.contains(&id) {
                None
            } else {
                Some(surfaces.material(self.document, id)?)
            };
            self.materials.insert((run, id), material);
        }
        for &id in &self.origin.changed {
            if id.index() < count {
                let material = &scene.materials[id.index()];
                surfaces.change(self.document, id.index(), material);
            }
        }
        Ok(())
    }

    /// Points materials of textures in set 1 to where that set goes.
    fn make_room(&mut self, groups: &BTreeMap<Key, Vec<FaceId>>, nodes: &[(Node, Slot)]) {
        let materials = self.document.items("materials");
        let second: Vec<bool> = materials.iter().map(texture_sets::uses_second).collect();
        let mut uses = Uses::new();
        let mut add = |material: Option<usize>, set| {
            let used = material.filter(|&m| second.get(m) == Some(&true));
            if let Some(material) = used {
                uses.entry(material).or_default().insert(set);
            }
        };
        for &(run, page, id) in groups.keys() {
            let sets = self.primitive(run).map_or(0, texture_sets::count);
            let set = (sets > 1 && page.is_some()).then_some(sets);
            add(self.materials[&(run, id)], set);
        }
        // Meshes that stay as they are use their materials as they are.
        let written: BTreeSet<usize> = nodes.iter().filter_map(|(_, slot)| *slot).collect();
        let meshes = self.meshes.iter().enumerate();
        for (_, mesh) in meshes.filter(|(number, _)| !written.contains(number)) {
            for primitive in primitives(mesh).unwrap_or_default() {
                add(index(primitive, "material"), None);
            }
        }
        for (node, _) in nodes {
            for primitive in self.untouched(node) {
                add(index(&primitive, "material"), None);
            }
        }
        self.moved = texture_sets::repoint(self.document, &uses);
    }

    /// Primitives of a node that the scene has nothing of: points and lines.
    fn untouched(&self, node: &Node) -> Vec<Value> {
        let runs = &self.origin.runs[node.runs.clone()];
        let is_read = |number: usize| runs.iter().any(|run| run.primitive as usize == number);
        let all = primitives(&self.meshes[node.mesh]).unwrap_or_default();
        let all = all.iter().enumerate();
        all.filter(|(number, _)| !is_read(*number))
            .map(|(_, primitive)| primitive.clone())
            .collect()
    }

    /// Gives a node a mesh of its own; `None` when an accessor is not as it was.
    fn write_node(
        &mut self,
        groups: &BTreeMap<Key, Vec<FaceId>>,
        node: &Node,
        slot: Slot,
    ) -> Option<()> {
        let mut parts: BTreeMap<Option<u32>, Part> = BTreeMap::new();
        let empty = |page| Part {
            page,
            faces: Vec::new(),
            primitives: Vec::new(),
        };
        let mut has_targets = false;
        for run in node.runs.clone() {
            let least = (run, None, MaterialId(0));
            let behind = (run + 1, None, MaterialId(0));
            let vertices = self.read(self.primitive(run)?)?;
            has_targets |= !vertices.targets.is_empty();
            for (&(_, page, material), faces) in groups.range(least..behind) {
                let primitive = self.write_primitive(run, page, material, &vertices, faces)?;
                let part = parts.entry(page).or_insert_with(|| empty(page));
                part.primitives.push(primitive);
                part.faces.extend(faces);
            }
        }
        let untouched = self.untouched(node);
        if !untouched.is_empty() {
            let part = parts.entry(None).or_insert_with(|| empty(None));
            part.primitives.extend(untouched);
        }
        let own = &self.document.items("nodes")[node.index];
        let has_instances = own.pointer("/extensions/EXT_mesh_gpu_instancing").is_some();
        let mut members = self.meshes[node.mesh].clone();
        object_mut(&mut members).remove("primitives");
        let mesh = Mesh {
            members,
            slot,
            can_be_split: !has_targets && !has_instances,
        };
        let parts = parts.into_values().collect();
        attach(self.document, self.baked, node.index, mesh, parts);
        Some(())
    }

    fn read(&self, primitive: &Value) -> Option<Vertices> {
        let read = |attributes: &Map<String, Value>| -> Option<Vec<(String, Attribute)>> {
            let attributes = attributes.iter();
            attributes
                .map(|(name, accessor)| {
                    let accessor = usize::try_from(accessor.as_u64()?).ok()?;
                    Some((name.clone(), Attribute::read(self.document, accessor)?))
                })
                .collect()
        };
        let targets = primitive.get("targets").and_then(Value::as_array);
        Some(Vertices {
            attributes: read(primitive.get("attributes")?.as_object()?)?,
            targets: targets
                .into_iter()
                .flatten()
                .map(|target| read(target.as_object()?))
                .collect::<Option<_>>()?,
        })
    }

    /// Makes a primitive of faces of a run that are on one page.
    fn write_primitive(
        &mut self,
        run: usize,
        page: Option<u32>,
        material: MaterialId,
        vertices: &Vertices,
        faces: &[FaceId],
    ) -> Option<Value> {
        let Split {
            indices,
            numbers,
            places,
        } = self.split(run, page, faces)?;
        let mut primitive = self.primitive(run)?.clone();
        let sets = texture_sets::count(&primitive);
        let mut material = self.materials[&(run, material)];
        let moved = material.and_then(|m| self.moved.get(&(m, sets)).copied());
        let moved = moved.filter(|_| page.is_some());
        material = moved.or(material);

        let mut attributes = Map::new();
        for (name, attribute) in &vertices.attributes {
            let name = match (name.as_str(), page, moved) {
                ("TEXCOORD_1", Some(_), None) => continue,
                ("TEXCOORD_1", Some(_), Some(_)) => format!("TEXCOORD_{sets}"),
                _ => name.clone(),
            };
            let is_position = name == "POSITION";
            let accessor = attribute.pick(&numbers)?.write(self.document, is_position);
            attributes.insert(name, accessor.into());
        }
        if page.is_some() {
            let accessor = Attribute::floats(places).write(self.document, false);
            attributes.insert("TEXCOORD_1".to_owned(), accessor.into());
            // Sets are numbered without gaps: where there was none, the first is the lightmap's too.
            attributes.entry("TEXCOORD_0").or_insert(accessor.into());
        }
        let mut targets = Vec::new();
        for target in &vertices.targets {
            let mut written = Map::new();
            for (name, attribute) in target {
                let picked = attribute.pick(&numbers)?;
                let accessor = picked.write(self.document, name == "POSITION");
                written.insert(name.clone(), accessor.into());
            }
            targets.push(Value::Object(written));
        }
        let indices = write_indices(self.document, &indices);

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
        Some(primitive)
    }

    /// The vertices that faces need: one for each vertex of the file and place in the atlas, in the order of the faces.
    fn split(&self, run: usize, page: Option<u32>, faces: &[FaceId]) -> Option<Split> {
        let Baked { scene, atlas, .. } = self.baked;
        let mut split = Split::default();
        let mut known: HashMap<(u32, [u32; 2]), u32> = HashMap::new();
        for face in faces {
            let mut corners: Vec<usize> = scene.faces[face.index()].corners().collect();
            if self.run(run).is_mirrored {
                // As the reader turned them, the first corner stays.
                corners[1..].reverse();
            }
            for corner in corners {
                let (of_run, number) = self.origin.find(scene.corners.vertex[corner])?;
                if of_run != run {
                    return None;
                }
                let place = match page {
                    Some(_) => atlas.uv(atlas.corners[corner]).as_vec2().to_array(),
                    None => [0.0; 2],
                };
                let key = (number, place.map(f32::to_bits));
                let vertex = *known.entry(key).or_insert_with(|| {
                    split.numbers.push(number);
                    split.places.push(place);
                    split.numbers.len() as u32 - 1
                });
                split.indices.push(vertex);
            }
        }
        Some(split)
    }
}

/// Vertices that are one for each vertex of the file and place in the atlas.
#[derive(Default)]
struct Split {
    indices: Vec<u32>,
    /// Their numbers in the file's accessors.
    numbers: Vec<u32>,
    /// Their lightmap coordinates.
    places: Vec<[f32; 2]>,
}
