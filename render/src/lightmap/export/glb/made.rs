//! A document of a scene that has none, or several.
//!
//! Each object is a node at the middle of its faces, from which positions are counted in f32, so that a scene far from the origin
//! keeps its shape. Its mesh has a primitive for each material; an object on several pages has a child for each. Polygons
//! are fans of their first corner, as the unwrapper cuts them. Cost: linear in the corners.

use super::attach::{Mesh, Part, attach};
use super::document::{Document, set};
use super::surfaces::Surfaces;
use super::vertices::{Attribute, write_indices};
use super::{Baked, GlbError, units, views};
use glam::{DVec3, Vec2};
use luxel_scenes::{FaceId, MaterialId, ObjectId};
use serde_json::{Value, json};
use std::collections::{BTreeMap, HashMap};

/// The parts of an object by page, and their faces by material.
type Groups = BTreeMap<Option<u32>, BTreeMap<MaterialId, Vec<FaceId>>>;

/// The document of a scene.
pub(super) fn document(baked: Baked) -> Result<Document, GlbError> {
    let scene = baked.scene;
    let mut document = Document {
        root: json!({
            "asset": {"version": "2.0", "generator": "luxel", "extras": {"luxel_units": units(scene)}},
            "scene": 0,
        }),
        binary: Vec::new(),
    };
    let mut objects: Vec<Groups> = vec![Groups::new(); scene.objects.len()];
    for id in scene.face_ids() {
        let face = scene.faces[id.index()];
        let parts = objects[face.object.index()].entry(baked.pages.of(id));
        let faces = parts.or_default().entry(face.material).or_default();
        faces.push(id);
    }
    let mut surfaces = Surfaces::new(scene);
    let mut roots = Vec::new();
    for (number, groups) in objects.into_iter().enumerate() {
        let object = ObjectId::new(number);
        roots.push(add_object(
            &mut document,
            &mut surfaces,
            baked,
            object,
            groups,
        )?);
    }
    for light in &scene.lights {
        roots.extend(views::light(&mut document, light));
    }
    for camera in &scene.cameras {
        roots.push(views::camera(&mut document, scene, camera));
    }
    let mut root = json!({"name": scene.name});
    if !roots.is_empty() {
        set(&mut root, "nodes", roots);
    }
    document.push("scenes", root);
    Ok(document)
}

/// Adds an object and returns its node.
fn add_object(
    document: &mut Document,
    surfaces: &mut Surfaces,
    baked: Baked,
    object: ObjectId,
    groups: Groups,
) -> Result<usize, GlbError> {
    let name = &baked.scene.objects[object.index()].name;
    let middle = middle(baked, groups.values().flat_map(BTreeMap::values).flatten());
    let node = json!({"name": name, "translation": middle.to_array()});
    let node = document.push("nodes", node);
    let mut parts = Vec::new();
    for (page, by_material) in groups {
        let mut part = Part {
            page,
            faces: Vec::new(),
            primitives: Vec::new(),
        };
        for (material, faces) in by_material {
            let material = surfaces.material(document, material)?;
            let mut primitive = add_primitive(document, baked, page, &faces, middle);
            set(&mut primitive, "material", material);
            part.primitives.push(primitive);
            part.faces.extend(faces);
        }
        parts.push(part);
    }
    let mesh = Mesh {
        members: json!({"name": name}),
        slot: None,
        can_be_split: true,
    };
    attach(document, baked, node, mesh, parts);
    Ok(node)
}

/// The middle of the box around faces, rounded to f32, which readers keep.
fn middle<'f>(baked: Baked, faces: impl Iterator<Item = &'f FaceId>) -> DVec3 {
    let points = faces.flat_map(|&face| baked.scene.polygon(face));
    let bounds = points
        .map(|p| (p, p))
        .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    let (lower, upper) = bounds.unwrap_or_default();
    ((lower + upper) / 2.0).as_vec3().as_dvec3()
}

/// A vertex of a primitive.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Vertex {
    position: u32,
    normal: [u32; 3],
    texture: [u32; 2],
    place: [u32; 2],
}

/// Writes faces of one object, page and material.
fn add_primitive(
    document: &mut Document,
    baked: Baked,
    page: Option<u32>,
    faces: &[FaceId],
    middle: DVec3,
) -> Value {
    let Baked { scene, atlas, .. } = baked;
    let corners = &scene.corners;
    let all = || {
        let faces = faces.iter().map(|face| scene.faces[face.index()]);
        faces.flat_map(luxel_scenes::Face::corners)
    };
    // Zero stands for a corner without; a primitive has normals at all of its vertices or at none.
    let normal = |corner: usize| corners.normal.get(corner).copied().unwrap_or_default();
    let has_normals = all().all(|corner| normal(corner).length_squared() > 0.0);
    let texture = |corner: usize| corners.uv0.get(corner).copied().unwrap_or_default();
    let has_texture = all().any(|corner| texture(corner) != Vec2::ZERO);

    let mut vertices = Vec::new();
    let mut known: HashMap<Vertex, u32> = HashMap::new();
    let mut vertex = |corner: usize| {
        let mut key = Vertex {
            position: corners.vertex[corner],
            normal: [0; 3],
            texture: [0; 2],
            place: [0; 2],
        };
        if has_normals {
            key.normal = normal(corner).to_array().map(f32::to_bits);
        }
        if has_texture {
            let uv = texture(corner);
            key.texture = [uv.x, 1.0 - uv.y].map(f32::to_bits);
        }
        if page.is_some() {
            let place = atlas.uv(atlas.corners[corner]).as_vec2();
            key.place = place.to_array().map(f32::to_bits);
        }
        *known.entry(key).or_insert_with(|| {
            vertices.push(key);
            vertices.len() as u32 - 1
        })
    };
    let mut indices = Vec::new();
    for face in faces {
        let corners = scene.faces[face.index()].corners();
        let first = vertex(corners.start);
        let mut last = vertex(corners.start + 1);
        for corner in corners.skip(2) {
            let next = vertex(corner);
            indices.extend([first, last, next]);
            last = next;
        }
    }

    let mut attributes = json!({});
    let mut add = |name: &str, attribute: Attribute| {
        let accessor = attribute.write(document, name == "POSITION");
        set(&mut attributes, name, accessor);
        accessor
    };
    let positions = vertices.iter().map(|v| {
        let position = scene.vertices[v.position as usize] - middle;
        position.as_vec3().to_array()
    });
    add("POSITION", Attribute::floats(positions));
    if has_normals {
        let normals = vertices.iter().map(|v| v.normal.map(f32::from_bits));
        add("NORMAL", Attribute::floats(normals));
    }
    if has_texture {
        let textures = vertices.iter().map(|v| v.texture.map(f32::from_bits));
        add("TEXCOORD_0", Attribute::floats(textures));
    }
    if page.is_some() {
        let places = vertices.iter().map(|v| v.place.map(f32::from_bits));
        let accessor = add("TEXCOORD_1", Attribute::floats(places));
        if !has_texture {
            // Sets are numbered without gaps: where there is none, the first is the lightmap's too.
            set(&mut attributes, "TEXCOORD_0", accessor);
        }
    }
    let indices = write_indices(document, &indices);
    json!({"attributes": attributes, "indices": indices})
}
