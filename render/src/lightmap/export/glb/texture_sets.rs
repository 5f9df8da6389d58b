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

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn material() -> Value {
        json!({
            "normalTexture": {"index": 0, "texCoord": 1},
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
            "extensions": {"KHR_materials_clearcoat": {"clearcoatTexture": {"index": 0, "texCoord": 0,
                "extensions": {"KHR_texture_transform": {"texCoord": 1}}}}},
            "extras": {"someTexture": {"index": 0, "texCoord": 1}},
        })
    }

    #[test]
    fn a_material_is_copied_for_each_place_but_one() {
        let document = |uses: &[Option<usize>]| {
            let mut document = Document {
                root: json!({"materials": [{}, material()]}),
                binary: Vec::new(),
            };
            let uses = Uses::from([(1, uses.iter().copied().collect())]);
            let moved = repoint(&mut document, &uses);
            (document, moved)
        };
        let (alone, moved) = document(&[Some(2)]);
        assert_eq!(moved, BTreeMap::from([((1, 2), 1)]));
        let changed = &alone.items("materials")[1];
        assert_eq!(changed["normalTexture"]["texCoord"], 2);
        let clear = &changed["extensions"]["KHR_materials_clearcoat"]["clearcoatTexture"];
        assert_eq!(clear["extensions"]["KHR_texture_transform"]["texCoord"], 2);
        assert_eq!(clear["texCoord"], 0);
        assert_eq!(changed["extras"], material()["extras"]);
        assert!(!uses_second(changed) && uses_second(&material()));

        let (several, moved) = document(&[None, Some(2), Some(3)]);
        assert_eq!(moved, BTreeMap::from([((1, 2), 2), ((1, 3), 3)]));
        let materials = several.items("materials");
        assert_eq!(materials[1], material());
        assert_eq!(materials[3]["normalTexture"]["texCoord"], 3);
    }

    #[test]
    fn sets_are_counted_by_the_last() {
        assert_eq!(count(&json!({"attributes": {"POSITION": 0}})), 0);
        let two = json!({"attributes": {"TEXCOORD_1": 0, "TEXCOORD_0": 0, "TEXCOORD_x": 0}});
        assert_eq!(count(&two), 2);
    }
}
