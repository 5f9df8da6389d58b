//! Leaves out accessors, buffer views and bytes that nothing uses any more.
//!
//! References can stand in extensions, so this is done only when all that a document uses are known: those below name no accessor
//! and no view, but for `EXT_mesh_gpu_instancing`, which is followed. Otherwise the original vertices stay in the file, which is
//! larger and no less right. Cost: one copy of the bytes.

use super::document::{Document, index, set};
use serde_json::Value;

/// Extensions of which is known where they name accessors and views; a star stands for all that begin so.
const KNOWN: [&str; 10] = [
    "KHR_materials_*",
    "KHR_texture_*",
    "EXT_texture_*",
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_xmp_json_ld",
    "EXT_lights_image_based",
    INSTANCING,
    "MSFT_texture_dds",
];
const INSTANCING: &str = "EXT_mesh_gpu_instancing";

/// Leaves out what nothing uses.
pub(super) fn compact(document: &mut Document) {
    let is_known = |name: &Value| {
        let name = name.as_str().unwrap_or("");
        KNOWN.iter().any(|known| match known.strip_suffix('*') {
            Some(start) => name.starts_with(start),
            None => name == *known,
        })
    };
    if !document.items("extensionsUsed").iter().all(is_known) {
        return;
    }
    keep_used(document, "accessors", accessors);
    keep_used(document, "bufferViews", views);
    pack(document);
}

/// Calls for every reference of a kind.
type Visit = fn(&mut Value, &mut dyn FnMut(&mut Value));

/// Keeps the items of an array that are referred to, and numbers references anew.
fn keep_used(document: &mut Document, array: &str, visit: Visit) {
    let mut numbers: Vec<Option<usize>> = vec![None; document.items(array).len()];
    visit(&mut document.root, &mut |reference| {
        if let Some(number) = number(reference).and_then(|n| numbers.get_mut(n)) {
            *number = Some(0);
        }
    });
    let used = numbers.iter_mut().filter_map(Option::as_mut);
    used.enumerate().for_each(|(new, number)| *number = new);
    visit(&mut document.root, &mut |reference| {
        if let Some(Some(new)) = number(reference).and_then(|n| numbers.get(n)) {
            *reference = (*new).into();
        }
    });
    let mut kept = numbers.iter().map(Option::is_some);
    document
        .items_mut(array)
        .retain(|_| kept.next().unwrap_or(true));
}

fn number(reference: &Value) -> Option<usize> {
    usize::try_from(reference.as_u64()?).ok()
}

fn items<'v>(value: &'v mut Value, key: &str) -> impl Iterator<Item = &'v mut Value> {
    let items = value.get_mut(key).and_then(Value::as_array_mut);
    items.into_iter().flatten()
}

fn members(value: &mut Value) -> impl Iterator<Item = &mut Value> {
    let members = value.as_object_mut();
    members.into_iter().flatten().map(|(_, member)| member)
}

fn accessors(root: &mut Value, found: &mut dyn FnMut(&mut Value)) {
    for mesh in items(root, "meshes") {
        for primitive in items(mesh, "primitives") {
            if let Some(attributes) = primitive.get_mut("attributes") {
                members(attributes).for_each(&mut *found);
            }
            for target in items(primitive, "targets") {
                members(target).for_each(&mut *found);
            }
            primitive
                .get_mut("indices")
                .into_iter()
                .for_each(&mut *found);
        }
    }
    for animation in items(root, "animations") {
        for sampler in items(animation, "samplers") {
            for key in ["input", "output"] {
                sampler.get_mut(key).into_iter().for_each(&mut *found);
            }
        }
    }
    for skin in items(root, "skins") {
        let matrices = skin.get_mut("inverseBindMatrices");
        matrices.into_iter().for_each(&mut *found);
    }
    for node in items(root, "nodes") {
        let path = format!("/extensions/{INSTANCING}/attributes");
        if let Some(attributes) = node.pointer_mut(&path) {
            members(attributes).for_each(&mut *found);
        }
    }
}

fn views(root: &mut Value, found: &mut dyn FnMut(&mut Value)) {
    for accessor in items(root, "accessors") {
        for path in ["", "/sparse/indices", "/sparse/values"] {
            let place = accessor.pointer_mut(path);
            let view = place.and_then(|place| place.get_mut("bufferView"));
            view.into_iter().for_each(&mut *found);
        }
    }
    for image in items(root, "images") {
        image
            .get_mut("bufferView")
            .into_iter()
            .for_each(&mut *found);
    }
}

/// Puts the bytes of the views that are left one behind another.
fn pack(document: &mut Document) {
    let range = |view: &Value| {
        let start = index(view, "byteOffset").unwrap_or(0);
        let end = start.checked_add(index(view, "byteLength")?)?;
        Some(start..end)
    };
    let ranges: Option<Vec<_>> = document.items("bufferViews").iter().map(range).collect();
    let Some(ranges) = ranges else { return };
    let total: usize = ranges.iter().map(|r| r.len().next_multiple_of(4)).sum();
    // Views that lie over each other would be copied apart.
    if total >= document.binary.len() || ranges.iter().any(|r| r.end > document.binary.len()) {
        return;
    }
    let old = std::mem::take(&mut document.binary);
    for (number, range) in ranges.into_iter().enumerate() {
        let offset = document.append(&old[range]);
        set(
            &mut document.items_mut("bufferViews")[number],
            "byteOffset",
            offset,
        );
    }
}
