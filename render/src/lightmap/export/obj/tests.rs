use super::*;
use crate::lightmap::export::testing::{atlas, cornell, reloaded};
use glam::Vec2;

/// The scene that the files give.
fn read(obj: &[u8], mtl: &[u8]) -> Scene {
    reloaded("a.obj", &[("a.obj", obj), ("a.mtl", mtl)]).scene
}

#[test]
fn a_scene_survives_a_round_trip() {
    let scene = cornell();
    let atlas = atlas(&scene, 128);
    let (text, library) = obj(&scene, &atlas, "a.mtl");
    let again = read(&text, &library);
    assert_eq!(scene.objects, again.objects);
    let area = |scene: &Scene| scene.face_ids().map(|f| scene.area(f)).sum::<f64>();
    assert!((area(&scene) / area(&again) - 1.0).abs() < 1e-12);
    // One page and one material an object: faces stay in order.
    let mut corner = 0;
    for id in scene.face_ids() {
        assert!(scene.polygon(id).eq(again.polygon(id)));
        let (old, new) = (scene.material(id), again.material(id));
        assert_eq!(old.name, new.name);
        assert_eq!(old.reflectance, new.reflectance);
        assert_eq!(old.emission, new.emission);
        for own in scene.faces[id.index()].corners() {
            let uv = atlas.uv(atlas.corners[own]);
            let expected = Vec2::new(uv.x as f32, (1.0 - uv.y) as f32);
            assert_eq!(again.corners.uv0[corner], expected);
            corner += 1;
        }
    }
}

#[test]
fn pages_are_told_by_names_and_comments() {
    let scene = cornell();
    let mut atlas = atlas(&scene, 128);
    atlas.pages = 2;
    let chart = atlas.face_chart[0].expect("the first face has a chart");
    atlas.charts[chart.index()].page = 1;
    // The second face of the object stays on page 0.
    let (text, library) = obj(&scene, &atlas, "a.mtl");
    let again = read(&text, &library);
    let name = &scene.objects[scene.faces[0].object.index()].name;
    let is_there = again
        .objects
        .iter()
        .any(|o| o.name == format!("{name}.page_001"));
    assert!(is_there, "{:?}", again.objects);
    let text = String::from_utf8(text).expect("names are text");
    assert!(text.contains(&format!("# page 1\no {name}.page_001\n")));
    assert_eq!(again.faces.len(), scene.faces.len());
}

#[test]
fn names_are_single_and_stay_in_their_line() {
    let names = unique(["a", "a\nb", "", "a", " # "].into_iter(), "none");
    assert_eq!(names, ["a", "a_b", "none", "a.2", "_"]);
}

#[test]
fn faces_without_a_lightmap_have_no_coordinates() {
    let scene = cornell();
    let mut atlas = atlas(&scene, 128);
    atlas.face_chart.fill(None);
    let (text, library) = obj(&scene, &atlas, "a.mtl");
    let again = read(&text, &library);
    assert_eq!(again.faces.len(), scene.faces.len());
    assert!(again.corners.uv0.is_empty());
}
