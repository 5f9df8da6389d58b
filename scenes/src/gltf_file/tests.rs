use super::*;
use crate::camera::{FieldOfView, Projection};
use crate::id::FaceId;
use crate::light::LightKind;
use crate::load::{FailureKind, Loaded, load};
use crate::material::{Sidedness, Specular};
use crate::radiometry::{Intensity, Irradiance, Radiance, Reflectance, Rgb};
use glam::{Vec2, Vec3};
use proptest::prelude::*;
use std::f64::consts::FRAC_PI_2;
use std::fs;

/// Three vertices of the triangle (0,0,0), (1,0,0), (0,1,0) with normals, two sets of texture
/// coordinates and indices.
fn triangle_bytes() -> Vec<u8> {
    let positions = [0.0_f32, 0., 0., 1., 0., 0., 0., 1., 0.];
    let normals = [0.0_f32, 0., 1., 0., 0., 1., 0., 0., 1.];
    let uv0 = [0.0_f32, 0.25, 1., 0., 0., 1.];
    let uv1 = [0.5_f32, 0.5, 1., 0., 0., 1.];
    let floats = positions.iter().chain(&normals).chain(&uv0).chain(&uv1);
    let mut bytes: Vec<u8> = floats.flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([0_u16, 1, 2, 0].iter().flat_map(|i| i.to_le_bytes()));
    bytes
}

const BUFFERS: &str = r#""bufferViews": [
    {"buffer": 0, "byteOffset": 0, "byteLength": 36},
    {"buffer": 0, "byteOffset": 36, "byteLength": 36},
    {"buffer": 0, "byteOffset": 72, "byteLength": 24},
    {"buffer": 0, "byteOffset": 96, "byteLength": 24},
    {"buffer": 0, "byteOffset": 120, "byteLength": 6}],
  "accessors": [
    {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
    {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3"},
    {"bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC2"},
    {"bufferView": 3, "componentType": 5126, "count": 3, "type": "VEC2"},
    {"bufferView": 4, "componentType": 5123, "count": 3, "type": "SCALAR"}]"#;

const MESHES: &str = r#""meshes": [{"name": "tri", "primitives": [{"attributes":
    {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "TEXCOORD_1": 3}, "indices": 4, "material": 0}]}]"#;

/// A document around these parts; the buffer is the binary chunk.
fn json(nodes: &str, materials: &str, rest: &str) -> String {
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}],
  "buffers": [{{"byteLength": 128}}], {BUFFERS}, {MESHES},
  "nodes": [{nodes}], "materials": [{materials}]{rest}}}"#
    )
}

fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut chunk = json.as_bytes().to_vec();
    chunk.resize(chunk.len().next_multiple_of(4), b' ');
    let length = 12 + 8 + chunk.len() + 8 + binary.len();
    let mut file = b"glTF".to_vec();
    let word = |x: usize| (x as u32).to_le_bytes();
    file.extend([word(2), word(length), word(chunk.len())].concat());
    file.extend_from_slice(b"JSON");
    file.extend(chunk);
    file.extend(word(binary.len()));
    file.extend_from_slice(b"BIN\0");
    file.extend_from_slice(binary);
    file
}

fn load_bytes(name: &str, bytes: &[u8]) -> Result<Loaded, LoadError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join(name);
    fs::write(&file, bytes).expect("the file is written");
    load(&file)
}

fn scene(nodes: &str, materials: &str, rest: &str) -> Loaded {
    load_bytes(
        "a.glb",
        &glb(&json(nodes, materials, rest), &triangle_bytes()),
    )
    .expect("the file is valid")
}

fn error(json: &str) -> String {
    load_bytes("a.glb", &glb(json, &triangle_bytes()))
        .expect_err("the file is wrong")
        .to_string()
}

const GREY: &str =
    r#"{"name": "grey", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1]}}"#;
const NODE: &str = r#"{"name": "n", "mesh": 0}"#;

#[test]
fn a_triangle_keeps_its_attributes() {
    let loaded = scene(NODE, GREY, "");
    let scene = &loaded.scene;
    assert_eq!(loaded.warnings, []);
    assert_eq!(scene.units, UnitSystem::Photometric);
    assert_eq!(scene.objects[0].name, "n");
    assert_eq!(scene.vector_area(FaceId(0)), DVec3::Z * 0.5);
    assert_eq!(scene.corners.normal, [Vec3::Z; 3]);
    // v is turned once.
    assert_eq!(
        scene.corners.uv0,
        [Vec2::new(0.0, 0.75), Vec2::new(1.0, 1.0), Vec2::ZERO]
    );
    assert_eq!(
        scene.corners.uv1,
        [Vec2::new(0.5, 0.5), Vec2::new(1.0, 1.0), Vec2::ZERO]
    );
}

#[test]
fn a_text_file_with_a_buffer_beside_it_gives_the_same() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let text = json(NODE, GREY, "").replace(
        r#"{"byteLength": 128}"#,
        r#"{"byteLength": 128, "uri": "the%20buffer.bin"}"#,
    );
    let file = folder.path().join("a.gltf");
    fs::write(&file, text).expect("the file is written");
    let error = load(&file).expect_err("the buffer is missing");
    assert_eq!(error.kind(), FailureKind::InvalidScene);
    assert!(error.to_string().contains("no such file"), "{error}");
    fs::write(folder.path().join("the buffer.bin"), triangle_bytes())
        .expect("the buffer is written");
    let loaded = load(&file).expect("the file is valid");
    assert_eq!(loaded.scene, scene(NODE, GREY, "").scene);
}

#[test]
fn nodes_are_instances_with_composed_transforms() {
    let nodes = r#"{"name": "n", "mesh": 0, "translation": [0.1, 0, 0], "children": [1, 2]},
        {"name": "n", "mesh": 0, "scale": [2, 2, 2], "rotation": [0, 0, 0.70710678, 0.70710678]},
        {"mesh": 0, "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,5,1]}"#;
    let scene = scene(nodes, GREY, "").scene;
    let names: Vec<&str> = scene.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["n", "n.2", "tri"]);
    // A turn by 90° about z and a doubling, then the parent's shift. The file holds f32.
    let shift = DVec3::X * f64::from(0.1_f32);
    let expected = [DVec3::ZERO, DVec3::Y * 2.0, -DVec3::X * 2.0];
    for (corner, expected) in scene.polygon(FaceId(1)).zip(expected) {
        assert!((corner - expected - shift).length() < 1e-15, "{corner}");
    }
    assert_eq!(
        scene.polygon(FaceId(2)).next(),
        Some(shift + DVec3::Z * 5.0)
    );
}

#[test]
fn mirrored_nodes_face_as_before() {
    let scene = scene(r#"{"mesh": 0, "scale": [-1, 1, 1]}"#, GREY, "").scene;
    assert_eq!(scene.vector_area(FaceId(0)), DVec3::Z * 0.5);
    assert_eq!(scene.corners.normal, [Vec3::Z; 3]);
    assert!(
        scene.polygon(FaceId(0)).any(|p| p == -DVec3::X),
        "it is mirrored"
    );
}

#[test]
fn normals_follow_uneven_scales() {
    let scene = scene(
        r#"{"mesh": 0, "rotation": [0, 0.38268343, 0, 0.92387953], "scale": [1, 1, 3]}"#,
        GREY,
        "",
    )
    .scene;
    let face = scene.vector_area(FaceId(0)).normalize().as_vec3();
    assert!(
        scene.corners.normal[0].dot(face) > 0.999_999,
        "{:?}",
        scene.corners.normal[0]
    );
}

#[test]
fn white_is_lowered_with_a_warning() {
    let materials =
        r#"{"name": "white"}, {"pbrMetallicRoughness": {"baseColorFactor": [1, 0.2, 0, 1]}}"#;
    let loaded = scene(NODE, materials, "");
    assert_eq!(
        loaded.scene.materials[0].reflectance,
        Reflectance::splat(0.98)
    );
    let first = f64::from(0.2_f32);
    assert_eq!(
        loaded.scene.materials[1].reflectance,
        Reflectance::new(0.98, first, 0.0)
    );
    assert!(matches!(
        &loaded.warnings[..],
        [Warning::ReflectanceClamped { count: 2, first, .. }] if first == "white"
    ));
    let text = json(
        NODE,
        r#"{"pbrMetallicRoughness": {"baseColorFactor": [1.5, 0, 0, 1]}}"#,
        "",
    );
    assert!(
        error(&text).contains("baseColorFactor = [1.5, 0.0, 0.0]"),
        "above one is an error"
    );
}

#[test]
fn materials_are_converted() {
    let materials = r#"{"emissiveFactor": [1, 0.5, 0], "doubleSided": true,
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 200}}},
        {"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1], "roughnessFactor": 0}},
        {"extensions": {"KHR_materials_transmission": {"transmissionFactor": 1},
            "KHR_materials_ior": {"ior": 1.25}}},
        {"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1]}, "alphaMode": "BLEND"}"#;
    let used = r#", "extensionsUsed": ["KHR_materials_transmission", "KHR_materials_ior"]"#;
    let loaded = scene(NODE, materials, used);
    let m = &loaded.scene.materials;
    assert_eq!(m[0].emission, Radiance::new(200.0, 100.0, 0.0));
    assert_eq!(m[0].sidedness, Sidedness::Both);
    assert_eq!(
        m[1].specular,
        Specular::Mirror {
            reflectance: Rgb::splat(0.5)
        }
    );
    assert_eq!(m[1].reflectance, Reflectance::ZERO);
    let glass = Specular::Glass {
        index_of_refraction: 1.25,
        transmittance: Rgb::ONE,
    };
    assert_eq!(
        (m[2].specular, m[2].reflectance),
        (glass, Reflectance::ZERO)
    );
    assert_eq!(
        m[3].reflectance,
        Reflectance::splat(0.5),
        "a rough metal is diffuse"
    );
    assert!(
        loaded
            .warnings
            .iter()
            .any(|w| matches!(w, Warning::Ignored { what, .. } if what == "alphaMode"))
    );
}

#[test]
fn textures_are_decoded_from_the_buffer() {
    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbImage::from_pixel(2, 2, image::Rgb([128, 0, 255]))
        .write_to(&mut png, image::ImageFormat::Png)
        .expect("the image is encoded");
    let png = png.into_inner();
    let mut binary = triangle_bytes();
    binary.extend_from_slice(&png);
    let material = r#"{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions":
        {"KHR_texture_transform": {"offset": [0.5, 0], "scale": [2, 1]}}}}, "emissiveTexture": {"index": 0}}"#;
    let rest = r#", "textures": [{"source": 0}], "images": [{"bufferView": 5}]"#;
    let text = json(NODE, material, rest)
        .replace(
            r#""byteLength": 6}]"#,
            &format!(
                r#""byteLength": 6}}, {{"buffer": 0, "byteOffset": 128, "byteLength": {}}}]"#,
                png.len()
            ),
        )
        .replace(
            r#"{"byteLength": 128}"#,
            &format!(r#"{{"byteLength": {}}}"#, binary.len()),
        );
    let loaded = load_bytes("a.glb", &glb(&text, &binary)).expect("the file is valid");
    let scene = &loaded.scene;
    assert_eq!(scene.textures.len(), 1, "the image is decoded once");
    assert!(
        (scene.textures[0].texels[0][0] - 0.215_86).abs() < 1e-5,
        "sRGB is decoded"
    );
    assert_eq!(
        scene.materials[0].reflectance_texture,
        scene.materials[0].emission_texture
    );
    assert_eq!(
        scene.corners.uv0[0],
        Vec2::new(0.5, 0.75),
        "the transform is applied"
    );
    assert!(
        loaded
            .warnings
            .iter()
            .any(|w| matches!(w, Warning::Ignored { .. })),
        "two mappings"
    );
}

#[test]
fn lights_and_cameras_stand_at_their_nodes() {
    let nodes = r#"{"children": [1, 2, 3, 4, 5], "translation": [0, 1, 0]},
        {"name": "lamp", "extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"extensions": {"KHR_lights_punctual": {"light": 1}}, "rotation": [-0.70710678, 0, 0, 0.70710678]},
        {"extensions": {"KHR_lights_punctual": {"light": 2}}},
        {"name": "view", "camera": 0}, {"camera": 1}"#;
    let rest = r#", "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [
            {"type": "point", "intensity": 800, "color": [1, 0.5, 0]},
            {"type": "directional", "intensity": 10000},
            {"type": "spot", "intensity": 5, "spot": {"outerConeAngle": 1.5707963267948966}}]}},
        "cameras": [
            {"type": "perspective", "perspective": {"yfov": 1, "aspectRatio": 2, "znear": 0.1}},
            {"type": "orthographic", "orthographic": {"xmag": 3, "ymag": 3, "znear": 0.1, "zfar": 9}}]"#;
    let scene = scene(nodes, GREY, rest).scene;
    let (position, intensity) = (DVec3::Y, Intensity::new(800.0, 400.0, 0.0));
    assert_eq!(scene.lights[0].name, "lamp");
    assert_eq!(
        scene.lights[0].kind,
        LightKind::Point {
            position,
            intensity
        }
    );
    let LightKind::Directional {
        direction,
        irradiance,
    } = scene.lights[1].kind
    else {
        panic!("a directional light, not {:?}", scene.lights[1]);
    };
    assert!(
        (direction + DVec3::Y).length() < 1e-7,
        "−z turned down: {direction}"
    );
    assert_eq!(irradiance, Irradiance::splat(10_000.0));
    assert!(matches!(
        scene.lights[2].kind,
        LightKind::Spot {
            outer_angle: FRAC_PI_2,
            inner_angle: 0.0,
            direction: DVec3::NEG_Z,
            ..
        }
    ));
    let view = &scene.cameras[0];
    assert_eq!((view.name.as_str(), view.size), ("view", [1024, 512]));
    assert_eq!(
        (view.position, view.look_at),
        (DVec3::Y, DVec3::Y - DVec3::Z)
    );
    let fov = FieldOfView::Vertical(1.0);
    assert_eq!(view.projection, Projection::Perspective { fov });
    assert_eq!(
        scene.cameras[1].projection,
        Projection::Orthographic { height: 6.0 }
    );
    assert_eq!(scene.units, UnitSystem::Photometric);
}

#[test]
fn strips_fans_and_lines() {
    let with_mode = |mode: &str| {
        json(NODE, GREY, "").replace(
            r#""material": 0"#,
            &format!(r#""material": 0, "mode": {mode}"#),
        )
    };
    for (mode, faces) in [("4", 1), ("5", 1), ("6", 1), ("1", 0), ("0", 0)] {
        let loaded = load_bytes("a.glb", &glb(&with_mode(mode), &triangle_bytes())).expect("valid");
        assert_eq!(loaded.scene.faces.len(), faces, "mode {mode}");
        assert_eq!(loaded.scene.objects.len(), faces, "mode {mode}");
        assert_eq!(
            loaded.warnings.is_empty(),
            faces > 0,
            "mode {mode}: {:?}",
            loaded.warnings
        );
    }
}

#[test]
fn faces_flattened_by_a_transform_are_dropped() {
    let loaded = scene(
        r#"{"name": "flat", "mesh": 0, "scale": [1, 0, 1]}"#,
        GREY,
        "",
    );
    assert!(loaded.scene.faces.is_empty());
    let text = loaded.warnings[0].to_string();
    assert!(
        text.contains("1 face(s) without area") && text.contains("object `flat`"),
        "{text}"
    );
}

#[test]
fn errors_name_the_element() {
    let good = json(NODE, GREY, "");
    let node = |nodes: &str| json(nodes, GREY, "");
    for (text, part) in [
        ("{".to_owned(), "not glTF that can be read"),
        (
            good.replace(
                r#""2.0""#,
                r#""2.0"}, "extensionsRequired": ["KHR_draco_mesh_compression"], "x": {"y": 1"#,
            ),
            "without compression",
        ),
        (
            good.replace(r#""byteLength": 128"#, r#""byteLength": 1280"#),
            "buffer 0 has 128 of 1280 bytes",
        ),
        (
            good.replace(r#""byteLength": 36}"#, r#""byteLength": 20}"#),
            "POSITION of primitive 0 of mesh `tri` reaches beyond the 20 bytes",
        ),
        (
            good.replace(
                r#""count": 3, "type": "SCALAR""#,
                r#""count": 9, "type": "SCALAR""#,
            ),
            "indices of primitive 0",
        ),
        (
            good.replace(r#""type": "SCALAR""#, r#""type": "VEC2""#),
            "holds Vec2 of U16",
        ),
        (good.replace(r#""POSITION": 0, "#, ""), "POSITION"),
        (
            good.replace(r#""POSITION": 0, "#, r#""POSITION": 99, "#),
            "names accessor 99",
        ),
        (
            node(r#"{"mesh": 0, "children": [0]}"#),
            "the nodes must form a tree",
        ),
        (
            node(r#"{"children": [1, 2]}, {"children": [3]}, {"children": [3]}, {"mesh": 0}"#),
            "node 3 has more than one parent",
        ),
        (
            node(r#"{"name": "n", "mesh": 0, "scale": [1e25, 1e25, 1e25]}"#),
            "beyond the 1e18 m",
        ),
        (
            node(r#"{"extensions": {"KHR_lights_punctual": {"light": 3}}}"#),
            "light",
        ),
        (
            json(
                r#"{"camera": 0}"#,
                GREY,
                r#", "cameras": [{"type": "perspective", "orthographic": {"xmag": 3, "ymag": 3, "znear": 0.1, "zfar": 9}}]"#,
            ),
            "camera 0: has no projection",
        ),
        (
            json(
                r#"{"camera": 0}"#,
                GREY,
                r#", "cameras": [{"type": "perspective", "perspective": {"yfov": 4, "znear": 0.1}}]"#,
            ),
            "yfov must lie between",
        ),
        (
            json(NODE, r#"{"emissiveFactor": [-1, 0, 0]}"#, ""),
            "finite radiance of at least 0",
        ),
    ] {
        let message = error(&text);
        assert!(message.contains(part), "{part}: {message}");
        assert!(message.contains("a.glb"), "{message}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Whatever bytes stand in the file, reading ends in a scene or an error.
    #[test]
    fn no_bytes_make_the_reader_panic(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), any::<bool>()), 1..8),
    ) {
        const WORDS: [&str; 12] = [
            "0", "9", "-1", "1e38", "4294967295", "18446744073709551615", "null", "[]", "{}", "\"\"", ",", "7",
        ];
        let nodes = r#"{"children": [1, 2], "mesh": 0}, {"mesh": 0, "camera": 0},
            {"extensions": {"KHR_lights_punctual": {"light": 0}}}"#;
        let rest = r#", "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}],
            "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {}}]}},
            "textures": [{"source": 0}], "images": [{"bufferView": 1, "mimeType": "image/png"}]"#;
        let mut text = json(nodes, GREY, rest).into_bytes();
        for (at, byte, replaces_number) in edits {
            let at = at.index(text.len());
            // Numbers are where a document that still parses goes wrong.
            let digit = text[at..].iter().position(u8::is_ascii_digit).map(|i| at + i);
            match digit {
                Some(digit) if replaces_number => {
                    let word = WORDS[usize::from(byte) % WORDS.len()];
                    text.splice(digit..=digit, word.bytes());
                }
                _ => text[at] = byte,
            }
        }
        let file = glb(&String::from_utf8_lossy(&text), &triangle_bytes());
        let _ = load_bytes("a.glb", &file);
    }

    /// The same for the container of a binary file.
    #[test]
    fn no_header_makes_the_reader_panic(at in 0..28_usize, byte: u8, length in 0..900_usize) {
        let mut file = glb(&json(NODE, GREY, ""), &triangle_bytes());
        file[at] = byte;
        file.truncate(file.len().min(length));
        let _ = load_bytes("a.glb", &file);
    }
}
