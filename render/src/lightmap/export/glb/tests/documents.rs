//! Small documents with what the example scene has not: strips, lines, morph targets, sparse and unindexed primitives.

use super::*;
use crate::lightmap::atlas::{Chart, ChartId};
use glam::DVec2;
use proptest::prelude::*;
use serde_json::json;

/// A quad of a strip, and a line, in one mesh at one node.
fn document() -> (Value, Vec<u8>) {
    let positions: [f32; 12] = [0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0.];
    let shifts: [f32; 12] = [0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 1.];
    let uvs: [f32; 8] = [0., 0., 1., 0., 0., 1., 1., 1.];
    let floats = positions.iter().chain(&shifts).chain(&uvs);
    let mut bytes: Vec<u8> = floats.flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([0_u8, 1, 2, 10, 11, 12, 20, 21, 22, 30, 31, 32]);
    bytes.extend([3_u8, 0, 0, 0]);
    bytes.extend([4.0_f32, 5.0].iter().flat_map(|x| x.to_le_bytes()));
    let document = json!({
        "asset": {"version": "2.0"},
        "extensionsUsed": ["VENDOR_unknown"],
        "extensions": {"VENDOR_unknown": {"deep": [1, {"a": null}]}},
        "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "n", "mesh": 0, "extras": {"n": "text"}}],
        "meshes": [{"name": "m", "extras": {"mesh": 1}, "primitives": [
            {"attributes": {"POSITION": 0, "TEXCOORD_0": 1, "TEXCOORD_1": 4, "COLOR_0": 2}, "mode": 5, "extras": {"p": 2}},
            {"attributes": {"POSITION": 0}, "mode": 3}]}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 48},
            {"buffer": 0, "byteOffset": 96, "byteLength": 32},
            {"buffer": 0, "byteOffset": 128, "byteLength": 12},
            {"buffer": 0, "byteOffset": 140, "byteLength": 1},
            {"buffer": 0, "byteOffset": 144, "byteLength": 8}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC2", "sparse": {"count": 1,
                "indices": {"bufferView": 4, "componentType": 5121}, "values": {"bufferView": 5}}},
            {"bufferView": 3, "componentType": 5121, "count": 4, "type": "VEC3", "normalized": true, "name": "colours"},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 1], "max": [0, 0, 1]},
            {"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC2"}],
        "buffers": [{"byteLength": bytes.len()}],
    });
    (document, bytes)
}

fn try_written(document: &Value, bytes: &[u8], pages: &[Option<u32>]) -> Result<Vec<u8>, GlbError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.glb");
    let made = document::Document {
        root: document.clone(),
        binary: bytes.to_vec(),
    };
    std::fs::write(&path, made.into_glb().expect("it is small")).expect("it is written");
    let loaded = load(&path).unwrap_or_else(|error| panic!("{error}"));
    let scene = &loaded.scene;
    assert_eq!(scene.faces.len(), pages.len());
    let chart = |&page: &Option<u32>| Chart {
        page: page.unwrap_or(0),
        object: ObjectId(0),
    };
    let face_chart = (0_u32..)
        .zip(pages)
        .map(|(i, page)| page.map(|_| ChartId(i)));
    let atlas = Atlas {
        size: [8, 16],
        pages: 2,
        corners: (0_u8..6).map(|i| DVec2::new(f64::from(i), 1.5)).collect(),
        face_chart: face_chart.collect(),
        charts: pages.iter().map(chart).collect(),
        padding: 1,
    };
    glb(scene, loaded.origin.as_ref(), None, &atlas, &maps(&atlas))
}

fn written(document: &Value, bytes: &[u8], pages: &[Option<u32>]) -> (Value, Vec<u8>, Scene) {
    let file = try_written(document, bytes, pages).expect("it is written");
    let again = reloaded("a.glb", &[("a.glb", &file)]).scene;
    let (document, binary) = parts(&file);
    (document, binary, again)
}

#[test]
fn strips_become_triangles_and_lines_stay() {
    let (document, bytes) = document();
    let (written, binary, again) = written(&document, &bytes, &[Some(0), Some(0)]);
    assert_eq!(again.faces.len(), 2);
    assert_eq!(written["extensions"], document["extensions"]);
    let nodes = items(&written, "nodes");
    assert_eq!(nodes.len(), 3, "a child with the map and one with the line");
    let lit = nodes
        .iter()
        .find(|node| node["extras"].get("luxel_lightmap").is_some());
    let lit = lit.expect("there is one");
    // (0, 1.5) to (5, 1.5) of 8 × 16 texels.
    let rect = &lit["extras"]["luxel_lightmap"]["rect"];
    assert_eq!(*rect, json!({"min": [0.0, 0.0625], "max": [0.625, 0.125]}));
    assert_eq!(nodes[0]["extras"], json!({"n": "text"}));
    let mesh = &written["meshes"][lit["mesh"].as_u64().expect("a mesh") as usize];
    assert_eq!(mesh["extras"]["mesh"], 1);
    let primitive = &mesh["primitives"][0];
    assert_eq!(primitive["extras"]["p"], 2);
    assert!(primitive.get("mode").is_none());
    // Colours keep their type; items of three bytes lie at four.
    let number = primitive["attributes"]["COLOR_0"]
        .as_u64()
        .expect("an accessor") as usize;
    let accessor = &written["accessors"][number];
    assert_eq!(accessor["componentType"], 5121);
    assert_eq!(accessor["normalized"], true);
    assert_eq!(accessor["name"], "colours");
    assert_eq!(accessor["count"], 6, "each corner has a place of its own");
    let view = &written["bufferViews"][accessor["bufferView"].as_u64().expect("a view") as usize];
    assert_eq!(view["byteStride"], 4);
    let start = view["byteOffset"].as_u64().expect("an offset") as usize;
    assert_eq!(binary[start..start + 8], [0, 1, 2, 0, 10, 11, 12, 0]);
    // The sparse value of vertex 3 came along.
    let sparse = Vec2::new(4.0, 1.0 - 5.0);
    assert_eq!(
        again.corners.uv0.iter().filter(|uv| **uv == sparse).count(),
        1
    );
    // Set 1, which no texture uses, made room.
    assert!(primitive["attributes"].get("TEXCOORD_2").is_none());
}

/// The format advises that extras are objects, and allows everything: readers for numbers and lists are there, too.
#[test]
fn extras_of_all_kinds_are_kept() {
    for extras in [
        json!(5),
        json!("text"),
        json!([1, {"a": 2.5}]),
        json!(true),
        json!({"own": 1}),
    ] {
        let (mut document, bytes) = document();
        document["meshes"][0]["primitives"]
            .as_array_mut()
            .expect("primitives")
            .pop();
        for place in ["/asset", "/nodes/0", "/meshes/0", "/meshes/0/primitives/0"] {
            let item = document.pointer_mut(place).expect("it is there");
            item["extras"] = extras.clone();
        }
        let (written, _, _) = written(&document, &bytes, &[Some(0), Some(0)]);
        for place in ["/meshes/0/extras", "/meshes/0/primitives/0/extras"] {
            assert_eq!(written.pointer(place), Some(&extras), "{place}");
        }
        let [asset, node] = [&written["asset"], &written["nodes"][0]].map(|own| &own["extras"]);
        assert_eq!(node["luxel_lightmap"]["page"], 0);
        // What was no object is a member beside luxel's own.
        let expected = extras.get("own").unwrap_or(&extras);
        for marked in [asset, node] {
            let kept = if extras.is_object() { "own" } else { "extras" };
            assert_eq!(marked[kept], *expected);
        }
    }
}

#[test]
fn morph_targets_keep_a_node_whole() {
    let (mut document, bytes) = document();
    document["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": 3}]);
    document["meshes"][0]["weights"] = json!([0.0]);
    document["meshes"][0]["primitives"]
        .as_array_mut()
        .expect("primitives")
        .pop();
    let (written, _, again) = written(&document, &bytes, &[Some(0), Some(1)]);
    assert_eq!(again.faces.len(), 2);
    assert_eq!(items(&written, "nodes").len(), 1);
    let primitives = items(&written["meshes"][0], "primitives");
    for (page, primitive) in primitives.iter().enumerate() {
        assert_eq!(primitive["extras"]["luxel_lightmap"]["page"], page);
        assert_eq!(primitive["extras"]["p"], 2);
        let target = primitive["targets"][0]["POSITION"]
            .as_u64()
            .expect("an accessor");
        let accessor = &written["accessors"][target as usize];
        assert_eq!(accessor["min"], json!([0.0, 0.0, 1.0]));
        assert_eq!(accessor["count"], 3);
    }
}

#[test]
fn faces_without_a_lightmap_stand_apart() {
    let (mut document, bytes) = document();
    document["meshes"][0]["primitives"]
        .as_array_mut()
        .expect("primitives")
        .pop();
    let (written, _, _) = written(&document, &bytes, &[None, None]);
    let nodes = items(&written, "nodes");
    assert_eq!(nodes.len(), 1);
    assert_eq!(nodes[0]["extras"], json!({"n": "text"}));
    let primitive = &written["meshes"][0]["primitives"][0];
    assert!(
        primitive["attributes"].get("TEXCOORD_1").is_some(),
        "its own set stays"
    );
}

#[test]
fn an_attribute_that_cannot_be_copied_is_named() {
    let (mut document, bytes) = document();
    document["accessors"][2]["count"] = 3.into();
    let error = try_written(&document, &bytes, &[Some(0), Some(0)]);
    let error = error.expect_err("a colour is missing").to_string();
    assert!(error.contains("COLOR_0 of the mesh of node 0"), "{error}");
}

#[test]
fn a_second_bake_replaces_the_first() {
    let loaded = pavilion();
    let first_atlas = pages(&loaded.scene, 16.0, 128);
    let first = glb(
        &loaded.scene,
        loaded.origin.as_ref(),
        None,
        &first_atlas,
        &maps(&first_atlas),
    );
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.glb");
    std::fs::write(&path, first.expect("it is written")).expect("it is written");
    let loaded = load(&path).expect("it loads");
    let atlas = atlas(&loaded.scene, 256);
    let second = glb(
        &loaded.scene,
        loaded.origin.as_ref(),
        None,
        &atlas,
        &maps(&atlas),
    );
    let second = second.expect("it is written");
    let again = reloaded("b.glb", &[("b.glb", &second)]).scene;
    assert_same_faces(&loaded.scene, &again, &atlas);
    let (document, _) = parts(&second);
    for node in items(&document, "nodes") {
        let page = &node["extras"]["luxel_lightmap"]["page"];
        assert!(page.is_null() || *page == 0);
    }
}

/// Places for any scene: one page and row a face, in turn.
fn any_atlas(scene: &Scene) -> Atlas {
    let faces = 0..scene.faces.len() as u32;
    let chart = |face: u32| Chart {
        page: face % 2,
        object: scene.faces[face as usize].object,
    };
    let corners = 0..scene.corners.vertex.len();
    Atlas {
        size: [8, 8],
        pages: 2,
        corners: corners
            .map(|i| DVec2::new((i % 7) as f64, (i % 5) as f64))
            .collect(),
        face_chart: faces.clone().map(|face| Some(ChartId(face))).collect(),
        charts: faces.map(chart).collect(),
        padding: 1,
    }
}

proptest! {
    /// What the reader takes is written, or refused with a message.
    #[test]
    fn no_document_makes_it_panic(at in 0.0..1.0_f64, character in "[0-9a-zA-Z_\\[\\]{},:\"-]{0,2}", targets: bool) {
        let (mut document, bytes) = document();
        if targets {
            document["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": 3}]);
        }
        document["buffers"][0]["uri"] = "a.bin".into();
        let mut text = document.to_string();
        let at = (at * text.len() as f64) as usize;
        text.replace_range(at..=at, &character);
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("a.gltf");
        std::fs::write(folder.path().join("a.bin"), &bytes).expect("it is written");
        std::fs::write(&path, text).expect("it is written");
        if let Ok(loaded) = load(&path) {
            let atlas = any_atlas(&loaded.scene);
            let _ = glb(&loaded.scene, loaded.origin.as_ref(), None, &atlas, &maps(&atlas));
        }
    }
}
