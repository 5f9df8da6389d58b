//! Gives a node the primitives that were made of its faces, so that what a node draws has one map.

use super::Baked;
use super::document::{Document, extras_mut, object_mut, set};
use crate::lightmap::export::pages::rectangle;
use luxel_scenes::FaceId;
use serde_json::{Value, json};

/// Primitives that are on one page, or without a lightmap.
pub(super) struct Part {
    pub(super) page: Option<u32>,
    /// The faces of the primitives.
    pub(super) faces: Vec<FaceId>,
    pub(super) primitives: Vec<Value>,
}

/// What a node's mesh is, besides its primitives.
pub(super) struct Mesh {
    /// The members of the mesh but for the primitives.
    pub(super) members: Value,
    /// A mesh of the document that nothing uses any more, to be replaced.
    pub(super) slot: Option<usize>,
    /// Whether the mesh may be given to several children of the node.
    pub(super) can_be_split: bool,
}

/// Gives a node its primitives: one mesh for one part, a child a part for several.
pub(super) fn attach(
    document: &mut Document,
    baked: Baked,
    node: usize,
    mesh: Mesh,
    mut parts: Vec<Part>,
) {
    let Mesh {
        members,
        mut slot,
        can_be_split,
    } = mesh;
    if parts.len() > 1 && !can_be_split {
        for part in &mut parts {
            let extras = extras(baked, part);
            for primitive in &mut part.primitives {
                mark(primitive, extras.as_ref());
            }
        }
        mark(&mut document.items_mut("nodes")[node], None);
        let primitives: Vec<Value> = parts.into_iter().flat_map(|p| p.primitives).collect();
        let mesh = add_mesh(document, &members, &mut slot, primitives);
        set(&mut document.items_mut("nodes")[node], "mesh", mesh);
        return;
    }
    let is_only = parts.len() == 1;
    let mut own = document.items("nodes")[node].clone();
    let moved = ["mesh", "skin", "weights"].map(|key| (key, object_mut(&mut own).remove(key)));
    if is_only {
        own = document.items("nodes")[node].clone();
    }
    mark(&mut own, None);
    for part in parts {
        let extras = extras(baked, &part);
        let mut members = members.clone();
        let suffix = part
            .page
            .map_or("unlit".to_owned(), |page| format!("page {page}"));
        if let Some(name) = members.get("name").and_then(Value::as_str)
            && !is_only
        {
            let name = format!("{name}, {suffix}");
            set(&mut members, "name", name);
        }
        let mesh = add_mesh(document, &members, &mut slot, part.primitives);
        if is_only {
            set(&mut own, "mesh", mesh);
            mark(&mut own, extras.as_ref());
            continue;
        }
        let name = own.get("name").and_then(Value::as_str).unwrap_or("node");
        let mut child = json!({"name": format!("{name}, {suffix}")});
        for (key, value) in &moved {
            if let Some(value) = value {
                set(&mut child, key, value.clone());
            }
        }
        set(&mut child, "mesh", mesh);
        mark(&mut child, extras.as_ref());
        let child = document.push("nodes", child);
        super::document::items_mut(object_mut(&mut own), "children").push(child.into());
    }
    document.items_mut("nodes")[node] = own;
}

fn add_mesh(
    document: &mut Document,
    members: &Value,
    slot: &mut Option<usize>,
    primitives: Vec<Value>,
) -> usize {
    let mut mesh = members.clone();
    set(&mut mesh, "primitives", primitives);
    if let Some(slot) = slot.take() {
        document.items_mut("meshes")[slot] = mesh;
        return slot;
    }
    document.push("meshes", mesh)
}

/// What a consumer is told of a part's map.
fn extras(baked: Baked, part: &Part) -> Option<Value> {
    let page = part.page?;
    let [min, max] = rectangle(baked.scene, baked.atlas, &part.faces);
    Some(json!({
        "page": page,
        "file": baked.maps[page as usize],
        "texCoord": 1,
        "rect": {"min": min, "max": max},
    }))
}

/// Adds to the extras of a node or primitive, or takes out what an earlier bake of the same file said.
fn mark(item: &mut Value, lightmap: Option<&Value>) {
    let Some(lightmap) = lightmap else {
        if let Some(extras) = item.get_mut("extras").filter(|extras| extras.is_object()) {
            object_mut(extras).remove("luxel_lightmap");
        }
        return;
    };
    set(extras_mut(item), "luxel_lightmap", lightmap.clone());
}
