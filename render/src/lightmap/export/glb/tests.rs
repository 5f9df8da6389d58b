use super::*;
use crate::lightmap::cut::{Plane, cut};
use crate::lightmap::export::testing::{atlas, cornell, data, pages, pavilion, reloaded};
use glam::{DVec3, Vec2};
use luxel_scenes::{Material, ObjectId, Radiance, Reflectance, Sidedness, load};
use serde_json::Value;

mod documents;

fn maps(atlas: &Atlas) -> Vec<String> {
    let name = |page| format!("lightmap_{page:03}.exr");
    (0..atlas.pages).map(name).collect()
}

/// The document and buffer of a file.
fn parts(file: &[u8]) -> (Value, Vec<u8>) {
    assert_eq!(&file[..4], b"glTF");
    let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().expect("four")) as usize;
    assert_eq!(word(8), file.len());
    let length = word(12);
    let json = serde_json::from_slice(&file[20..20 + length]).expect("a document");
    (json, file[20 + length + 8..].to_vec())
}

fn items<'v>(document: &'v Value, key: &str) -> &'v [Value] {
    document[key].as_array().expect("an array")
}

fn area(scene: &Scene) -> f64 {
    scene.face_ids().map(|face| scene.area(face)).sum()
}

/// Faces stay in order where each object has one page and its materials in the order of its faces.
fn assert_same_faces(old: &Scene, new: &Scene, atlas: &Atlas) {
    assert_eq!(old.faces.len(), new.faces.len());
    for id in old.face_ids() {
        let (face, again) = (old.faces[id.index()], new.faces[id.index()]);
        assert_eq!(face.corner_count, again.corner_count);
        for (own, corner) in face.corners().zip(again.corners()) {
            let (a, b) = (old.corners.vertex[own], new.corners.vertex[corner]);
            assert_eq!(old.vertices[a as usize], new.vertices[b as usize]);
            let uv = atlas.uv(atlas.corners[own]).as_vec2();
            let expected = Vec2::new(uv.x, 1.0 - uv.y);
            assert_eq!(new.corners.uv1[corner], expected);
            assert_eq!(old.corners.uv0[own], new.corners.uv0[corner]);
            assert_eq!(old.corners.normal[own], new.corners.normal[corner]);
        }
    }
}

#[test]
fn a_document_survives_a_round_trip() {
    let loaded = pavilion();
    let scene = &loaded.scene;
    assert_eq!(loaded.warnings, []);
    let atlas = atlas(scene, 256);
    let file =
        glb(scene, loaded.origin.as_ref(), None, &atlas, &maps(&atlas)).expect("it is written");
    let again = reloaded("a.glb", &[("a.glb", &file)]);
    assert_eq!(again.warnings, []);
    assert_same_faces(scene, &again.scene, &atlas);
    assert_eq!(scene.objects, again.scene.objects);
    assert_eq!(scene.materials, again.scene.materials);
    assert_eq!(scene.lights, again.scene.lights);
    assert_eq!(scene.cameras, again.scene.cameras);
    for (texture, same) in scene.textures.iter().zip(&again.scene.textures) {
        assert_eq!(texture.texels, same.texels);
    }
    let second = glb(scene, loaded.origin.as_ref(), None, &atlas, &maps(&atlas));
    assert_eq!(
        second.expect("it is written"),
        file,
        "bytes are the same each time"
    );
}

/// Positions, normals and texture coordinates are means of those of the file, which is f32: to its rounding they are those of
/// the faces that were cut.
#[test]
fn faces_that_were_cut_are_cut_in_the_document() {
    const ROUNDING: f64 = 4.0 * f32::EPSILON as f64;
    let loaded = pavilion();
    let (lower, upper) = loaded.scene.bounds().expect("faces");
    let normal = DVec3::new(2.0, 0.3, -1.0).normalize();
    let plane = Plane {
        normal,
        offset: normal.dot(0.5 * (lower + upper)),
    };
    let planes = loaded.scene.face_ids().map(|face| (face, vec![plane]));
    let cut = cut(&loaded.scene, &planes.collect());
    let scene = &cut.scene;
    assert!(scene.faces.len() > loaded.scene.faces.len() + 10);
    let atlas = atlas(scene, 256);
    let corners = Some(cut.corners.as_slice());
    let file = glb(
        scene,
        loaded.origin.as_ref(),
        corners,
        &atlas,
        &maps(&atlas),
    );
    let again = reloaded("a.glb", &[("a.glb", &file.expect("it is written"))]);
    assert_eq!(again.warnings, []);
    let again = again.scene;
    let size = lower.abs().max(upper.abs()).max_element();
    let fans = scene.faces.iter().flat_map(|face| {
        let corners: Vec<usize> = face.corners().collect();
        let fan = (1..corners.len() - 1).map(move |i| [corners[0], corners[i], corners[i + 1]]);
        fan.collect::<Vec<_>>()
    });
    let mut triangles = 0;
    for (own, face) in fans.zip(&again.faces) {
        triangles += 1;
        for (own, corner) in own.into_iter().zip(face.corners()) {
            let [a, b] = [(scene, own), (&again, corner)]
                .map(|(scene, corner)| scene.vertices[scene.corners.vertex[corner] as usize]);
            assert!((a - b).length() <= ROUNDING * size, "{a} {b}");
            let [a, b] = [(scene, own), (&again, corner)].map(|(s, c)| s.corners.uv0[c].as_dvec2());
            assert!(
                (a - b).length() <= ROUNDING * a.length().max(1.0),
                "{a} {b}"
            );
            let [a, b] = [(scene, own), (&again, corner)].map(|(s, c)| s.corners.normal[c]);
            assert!((a - b).as_dvec3().length() <= 2.0 * ROUNDING, "{a} {b}");
        }
    }
    assert_eq!(triangles, again.faces.len());
}

#[test]
fn a_document_keeps_what_luxel_does_not_know() {
    let loaded = pavilion();
    let atlas = atlas(&loaded.scene, 256);
    let file = glb(
        &loaded.scene,
        loaded.origin.as_ref(),
        None,
        &atlas,
        &maps(&atlas),
    );
    let (document, binary) = parts(&file.expect("it is written"));
    assert_eq!(document["asset"]["generator"], "luxel");
    assert_eq!(document["asset"]["copyright"], "The luxel authors");
    assert_eq!(document["asset"]["extras"]["made"], "by make.py");
    // Images have their own bytes.
    let tile = std::fs::read(data("pavilion", "tile.png")).expect("the image is there");
    let bytes = loaded
        .origin
        .expect("one file")
        .read()
        .expect("it is there");
    for (image, expected) in items(&document, "images").iter().zip(&bytes.images) {
        let view = &document["bufferViews"][image["bufferView"].as_u64().expect("a view") as usize];
        let start = view["byteOffset"].as_u64().expect("an offset") as usize;
        let end = start + view["byteLength"].as_u64().expect("a length") as usize;
        assert_eq!(Some(&binary[start..end]), expected.as_deref());
        assert_eq!(image["mimeType"], "image/png");
        assert!(image.get("uri").is_none());
    }
    assert_eq!(bytes.images[0].as_deref(), Some(tile.as_slice()));
    // Both materials whose textures use set 1 look for it where it has gone, the others not.
    let materials = items(&document, "materials");
    assert_eq!(materials.len(), 5);
    assert_eq!(materials[1]["occlusionTexture"]["texCoord"], 2);
    let wood = &materials[3]["pbrMetallicRoughness"]["baseColorTexture"];
    assert_eq!(wood["extensions"]["KHR_texture_transform"]["texCoord"], 2);
    assert_eq!(wood["texCoord"], 0);
    for mesh in items(&document, "meshes") {
        for primitive in items(mesh, "primitives") {
            let material = primitive["material"].as_u64().expect("a material");
            let has_third = primitive["attributes"].get("TEXCOORD_2").is_some();
            assert_eq!(has_third, [1, 3].contains(&material));
        }
    }
    // Each instance has a mesh, its extras, and a map.
    let columns: Vec<&Value> = items(&document, "nodes")
        .iter()
        .filter(|node| node["name"] == "column")
        .collect();
    assert_eq!(columns.len(), 4);
    assert_eq!(columns[0]["extras"]["kept"], true);
    let mut rectangles: Vec<String> = columns
        .iter()
        .map(|node| node["extras"]["luxel_lightmap"]["rect"].to_string())
        .collect();
    rectangles.sort();
    rectangles.dedup();
    assert_eq!(rectangles.len(), 4);
    assert_eq!(items(&document, "meshes").len(), 8);
    // Nothing of the old vertices is left behind.
    let used: usize = items(&document, "bufferViews")
        .iter()
        .map(|view| view["byteLength"].as_u64().expect("a length") as usize)
        .sum();
    assert!(binary.len() - used < 4 * items(&document, "bufferViews").len());
}

/// Every node with a lightmap has one page, and areas by page are those of the atlas.
fn assert_pages(scene: &Scene, atlas: &Atlas, file: &[u8]) {
    let (document, _) = parts(file);
    let again = reloaded("a.glb", &[("a.glb", file)]).scene;
    let mut by_page = vec![0.0; atlas.pages];
    let nodes = items(&document, "nodes");
    for face in again.face_ids() {
        let object = &again.objects[again.faces[face.index()].object.index()];
        // Names that several nodes have got a number; here it tells nothing of the page.
        let name = object.name.split('.').next().expect("a name");
        let node = nodes
            .iter()
            .find(|node| node["name"] == name && node.get("mesh").is_some());
        let lightmap = &node.expect("the node is there")["extras"]["luxel_lightmap"];
        let page = lightmap["page"].as_u64().expect("a page") as usize;
        assert_eq!(lightmap["file"], format!("lightmap_{page:03}.exr"));
        by_page[page] += again.area(face);
    }
    for (page, found) in by_page.iter().enumerate() {
        let own = scene.face_ids().filter(|&face| {
            let chart = atlas.chart(face).expect("all faces have charts");
            chart.1.page as usize == page
        });
        let expected: f64 = own.map(|face| scene.area(face)).sum();
        assert!(
            (found / expected - 1.0).abs() < 1e-5,
            "{page}: {found} {expected}"
        );
    }
}

#[test]
fn nodes_on_several_pages_have_a_child_for_each() {
    let scene = cornell();
    let atlas = pages(&scene, 200.0, 160);
    assert!(atlas.pages > 2);
    let file = glb(&scene, None, None, &atlas, &maps(&atlas)).expect("it is written");
    assert_pages(&scene, &atlas, &file);
    let again = reloaded("a.glb", &[("a.glb", &file)]).scene;
    assert!((area(&scene) / area(&again) - 1.0).abs() < 1e-5);

    let loaded = pavilion();
    let scene = loaded.scene;
    let atlas = pages(&scene, 16.0, 128);
    assert!(atlas.pages > 1);
    let file =
        glb(&scene, loaded.origin.as_ref(), None, &atlas, &maps(&atlas)).expect("it is written");
    let again = reloaded("a.glb", &[("a.glb", &file)]).scene;
    assert!((area(&scene) / area(&again) - 1.0).abs() < 1e-12);
    let (document, _) = parts(&file);
    let hall = items(&document, "nodes")
        .iter()
        .find(|n| n["name"] == "hall");
    let hall = hall.expect("the node is there");
    assert!(hall.get("mesh").is_none() && hall["extras"].get("luxel_lightmap").is_none());
    let children = items(hall, "children");
    assert!(children.len() > 1);
    for child in children {
        let child = &document["nodes"][child.as_u64().expect("a number") as usize];
        assert_eq!(child["extras"]["luxel_lightmap"]["texCoord"], 1);
    }
}

#[test]
fn what_a_scene_file_changes_is_written() {
    let file = data("pavilion", "pavilion.gltf");
    let text = format!(
        r#"geometry = [{file:?}]
[scene]
scale = 0.5
[[camera]]
name = "side"
position = [2, 1, 3]
look_at = [0, 1, 0]
fov = 50
size = [300, 200]
[[light]]
kind = "point"
position = [1, 1, 1]
candela = 10
[material.stone]
reflectance = [0.1, 0.2, 0.3]
[material.gold]
reflectance = 0.6
[object.bench]
material = "gold"
"#
    );
    let loaded = reloaded("a.toml", &[("a.toml", text.as_bytes())]);
    let scene = &loaded.scene;
    let atlas = atlas(scene, 256);
    let file =
        glb(scene, loaded.origin.as_ref(), None, &atlas, &maps(&atlas)).expect("it is written");
    let again = reloaded("a.glb", &[("a.glb", &file)]).scene;
    assert!((area(scene) / area(&again) - 1.0).abs() < 1e-6);
    let material = |scene: &Scene, object: &str| {
        let number = scene.objects.iter().position(|o| o.name == object);
        let id = ObjectId::new(number.expect("the object is there"));
        let face = scene.faces.iter().find(|face| face.object == id);
        scene.materials[face.expect("it has faces").material.index()].clone()
    };
    assert_eq!(material(&again, "bench").name, "gold");
    let stone = material(&again, "column").reflectance.0;
    assert!((stone - DVec3::new(0.1, 0.2, 0.3)).abs().max_element() < 1e-7);
    assert_eq!(again.lights.len(), scene.lights.len());
    let camera = again
        .cameras
        .iter()
        .find(|c| c.name == "side")
        .expect("it is there");
    let expected = &scene.cameras[0];
    assert!(camera.position.distance(expected.position) < 1e-6);
    let view = |c: &luxel_scenes::Camera| (c.look_at - c.position).normalize();
    assert!(view(camera).distance(view(expected)) < 1e-6);
}

#[test]
fn a_scene_without_a_document_gets_one() {
    let mut scene = cornell();
    scene.materials[0].sidedness = Sidedness::Both;
    let atlas = atlas(&scene, 128);
    let file = glb(&scene, None, None, &atlas, &maps(&atlas)).expect("it is written");
    let again = reloaded("a.glb", &[("a.glb", &file)]);
    assert_eq!(again.warnings, []);
    let again = again.scene;
    assert_eq!(scene.objects, again.objects);
    assert_eq!(scene.faces.len(), again.faces.len());
    let mut corner = 0;
    for id in scene.face_ids() {
        let (old, new) = (scene.material(id), again.material(id));
        assert_eq!(old.name, new.name);
        assert_eq!(old.sidedness, new.sidedness);
        let off = |a: DVec3, b: DVec3| (a - b).abs().max_element() / a.max_element().max(1.0);
        // Factors are rounded to f32 twice.
        assert!(off(old.reflectance.0, new.reflectance.0) < 1e-7);
        assert!(off(old.emission.0, new.emission.0) < 1e-6);
        for (a, b) in scene.polygon(id).zip(again.polygon(id)) {
            // f32 from a middle within the box's half metre, and the middle's own.
            assert!(a.distance(b) < 1e-7);
        }
        for own in scene.faces[id.index()].corners() {
            let uv = atlas.uv(atlas.corners[own]).as_vec2();
            assert_eq!(again.corners.uv1[corner], Vec2::new(uv.x, 1.0 - uv.y));
            corner += 1;
        }
    }
    let (old, new) = (&scene.cameras[0], &again.cameras[0]);
    assert!(old.position.distance(new.position) < 1e-6);
    let (document, _) = parts(&file);
    for material in items(&document, "materials") {
        let gloss = &material["extensions"]["KHR_materials_specular"];
        assert_eq!(gloss["specularFactor"], 0.0, "matt: {material}");
    }
    assert!(document.get("extensionsRequired").is_none());
}

#[test]
fn polygons_and_distant_objects_keep_their_shape() {
    let mut scene = Scene::default();
    let object = scene.push_object("plate");
    let glow = Material::diffuse("glow", Reflectance::splat(0.25));
    let material = scene.push_material(glow.with_emission(Radiance::new(0.5, 0.25, 3.0)));
    let far = DVec3::new(1e6, -2e6, 3e6);
    let corners = [
        DVec3::ZERO,
        DVec3::X,
        DVec3::new(1.5, 0.5, 0.0),
        DVec3::new(1.0, 1.0, 0.0),
        DVec3::Y,
    ];
    scene.push_face(&corners.map(|corner| far + corner), object, material);
    let atlas = atlas(&scene, 64);
    let file = glb(&scene, None, None, &atlas, &maps(&atlas)).expect("it is written");
    let again = reloaded("a.glb", &[("a.glb", &file)]).scene;
    assert_eq!(again.faces.len(), 3);
    assert!((area(&again) - 1.25).abs() < 1e-6);
    // Factor and strength are rounded to f32.
    let off = again.materials[0].emission.0 - DVec3::new(0.5, 0.25, 3.0);
    assert!(off.abs().max_element() < 3.0 * f64::from(f32::EPSILON));
}

#[test]
fn pages_without_files_are_refused() {
    let scene = cornell();
    let atlas = atlas(&scene, 64);
    let error = glb(&scene, None, None, &atlas, &[]).expect_err("there is no file");
    assert!(matches!(error, GlbError::Maps { pages: 1, maps: 0 }));
}

#[test]
fn a_file_that_was_changed_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.gltf");
    let text = std::fs::read_to_string(data("pavilion", "pavilion.gltf")).expect("it is there");
    for name in ["pavilion.bin", "tile.png"] {
        std::fs::copy(data("pavilion", name), folder.path().join(name)).expect("it is copied");
    }
    std::fs::write(&path, &text).expect("it is written");
    let loaded = load(&path).expect("it loads");
    let atlas = atlas(&loaded.scene, 128);
    let write = || {
        glb(
            &loaded.scene,
            loaded.origin.as_ref(),
            None,
            &atlas,
            &maps(&atlas),
        )
    };
    assert!(write().is_ok());
    let mut document: Value = serde_json::from_str(&text).expect("a document");
    for node in document["nodes"].as_array_mut().expect("nodes") {
        node.as_object_mut().expect("a node").remove("mesh");
    }
    std::fs::write(&path, document.to_string()).expect("it is written");
    assert!(matches!(write(), Err(GlbError::Changed { .. })));
    std::fs::remove_file(&path).expect("it is there");
    assert!(matches!(write(), Err(GlbError::Load(_))));
}
