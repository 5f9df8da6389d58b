use super::*;
use crate::id::FaceId;
use std::path::PathBuf;

fn data(scene: &str, file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("data")
        .join(scene)
        .join(file)
}

fn area(scene: &Scene) -> f64 {
    scene.face_ids().map(|face| scene.area(face)).sum()
}

/// Area per scene as computed when the scenes were made; coordinates have six decimals.
#[test]
fn the_example_scenes_load_without_warnings() {
    for (name, faces, objects, expected) in [
        ("cornell", 38, 8, 1.920_695_708_099_727_6),
        ("furnace", 192, 3, 24.0),
        ("corridor", 448, 5, 226.0),
        ("office", 29_712, 844, 291.289_668_869_398_27),
        ("pavilion", 122, 8, 104.742_187_5),
    ] {
        let loaded = load(data(name, &format!("{name}.toml"))).expect(name);
        assert_eq!(loaded.warnings, [], "{name}");
        let scene = &loaded.scene;
        assert_eq!(
            (scene.faces.len(), scene.objects.len()),
            (faces, objects),
            "{name}"
        );
        assert_eq!(scene.name, name);
        assert_eq!(scene.cameras.len(), 1);
        assert!(
            (area(scene) / expected - 1.0).abs() < 1e-6,
            "{name}: {}",
            area(scene)
        );
    }
}

#[test]
fn a_geometry_file_takes_the_scene_file_beside_it() {
    let loaded = load(data("cornell", "cornell.obj")).expect("the scene is valid");
    assert_eq!(loaded.scene.faces.len(), 38, "the geometry is read once");
    assert_eq!(loaded.scene.cameras[0].name, "main");
}

#[test]
fn materials_of_the_cornell_box_are_those_of_its_library() {
    let scene = load(data("cornell", "cornell.toml"))
        .expect("the scene is valid")
        .scene;
    let floor = scene.material(FaceId(0));
    assert_eq!(floor.reflectance.0.to_array(), [0.725, 0.71, 0.68]);
    let light = scene
        .materials
        .iter()
        .find(|m| m.name == "light")
        .expect("there is a lamp");
    assert_eq!(light.emission.0.to_array(), [17.0, 12.0, 4.0]);
    // Coordinates keep f64: 0.5528 has no f32.
    assert_eq!(scene.polygon(FaceId(0)).next().map(|p| p.x), Some(0.5528));
}

#[test]
fn missing_files_and_unknown_formats_are_invalid_scenes() {
    for file in ["none.toml", "none.obj", "none.txt", "none"] {
        let error = load(data("cornell", file)).expect_err("there is no such scene");
        assert_eq!(error.kind(), FailureKind::InvalidScene, "{file}");
        assert!(error.to_string().contains("none"), "{error}");
    }
}

#[test]
fn a_folder_in_place_of_a_file_is_an_io_failure() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("scene.toml");
    std::fs::create_dir(&file).expect("the folder is made");
    let error = load(&file).expect_err("a folder is not a file");
    assert_eq!(error.kind(), FailureKind::Io);
}
