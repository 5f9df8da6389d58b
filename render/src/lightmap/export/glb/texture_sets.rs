//! Makes room for the lightmap's coordinates: materials whose textures use set 1 are pointed to where that set has gone.
//!
//! Source: glTF 2.0, chapters 3.7.2.1 (sets are numbered without gaps) and 3.9.1; `KHR_texture_transform`, whose `texCoord` has
//! precedence. Texture infos are the members of materials and of their extensions whose names end in `Texture`, as all
//! ratified ones do. Set 1 moves behind the last set of its primitive, so a material of primitives with different numbers of sets
//! is needed once for each.

use super::document::{Document, index, object_mut, set};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// Where set 1 has gone in the primitives that have a material: a set, or nowhere.
pub(super) type Uses = BTreeMap<usize, BTreeSet<Option<usize>>>;

/// Number of sets of texture coordinates of a primitive.
pub(super) fn count(primitive: &Value) -> usize {
    let attributes = primitive.get("attributes").and_then(Value::as_object);
    let numbers = attributes.into_iter().flatten().filter_map(|(name, _)| {
        let number: usize = name.strip_prefix("TEXCOORD_")?.parse().ok()?;
        number.checked_add(1)
    });
    numbers.max().unwrap_or(0)
}

/// Whether any texture of a material uses set 1.
pub(super) fn uses_second(material: &Value) -> bool {
    let mut found = false;
    visit(&mut material.clone(), &mut |info| found |= is_second(info));
    found
}

/// Points materials to where set 1 has gone, and returns which material stands for one with the set in a place. A material that
/// is needed in one way is changed, others are copied.
pub(super) fn repoint(document: &mut Document, uses: &Uses) -> BTreeMap<(usize, usize), usize> {
    let mut moved = BTreeMap::new();
    for (&material, sets) in uses {
        let Some(original) = document.items("materials").get(material).cloned() else {
            continue;
        };
        for &to in sets.iter().flatten() {
            let mut copy = original.clone();
            visit(&mut copy, &mut |info| {
                if is_second(info) {
                    point(info, to);
                }
            });
            let place = if sets.len() == 1 {
                document.items_mut("materials")[material] = copy;
                material
            } else {
                document.push("materials", copy)
            };
            moved.insert((material, to), place);
        }
    }
    moved
}

fn is_second(info: &Value) -> bool {
    let transform = info.pointer("/extensions/KHR_texture_transform");
    let set = transform.and_then(|transform| index(transform, "texCoord"));
    set.or_else(|| index(info, "texCoord")) == Some(1)
}

fn point(info: &mut Value, to: usize) {
    let transform = info.pointer_mut("/extensions/KHR_texture_transform");
    if let Some(transform) = transform.filter(|t| t.get("texCoord").is_some()) {
        set(transform, "texCoord", to);
    }
    // Also where the transform has precedence: for programs that do not know it.
    if index(info, "texCoord") == Some(1) {
        set(info, "texCoord", to);
    }
}

/// Calls for each texture info of a material. Materials do not nest deeper than the parser lets them.
fn visit(value: &mut Value, found: &mut dyn FnMut(&mut Value)) {
    if !value.is_object() {
        return;
    }
    for (key, member) in object_mut(value) {
        if key.ends_with("Texture") && member.get("index").is_some() {
            found(member);
        } else if key != "extras" {
            visit(member, found);
        }
    }
}
