//! Pages of folders with what folders should not have.

use super::*;
use crate::image::exr::{Picture, encode};
use crate::image::{Image, png};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A name that would be markup, leave a script, or be taken for a place in the frame.
const HOSTILE: &str = "</script><img src=x onerror=alert(1)>{{three}}\"'&<!--";

fn manifest() -> Value {
    json!({
        "schema": 2, "software": "luxel test", "scene": HOSTILE, "exposure": 0.5, "seed": 0,
        "units": {"quantity": "irradiance", "unit": "W/m2", "factor": 1.0, "colour_space": "linear Rec. 709", "target": "three"},
        "lightmap": {
            "include": "all", "patches": 7, "energy": null,
            "error": {"luxels": 0.01, "filtering": 0.002, "total": 0.0102},
            "pages": [{"file": "light.ktx2", "master": "light.exr", "error": "error.exr",
                       "encoding": {"format": "ktx2", "formula": "texel = rgb", "scale": 1.0, "factor": 1.0, "loss": 0.0, "clamped": 0},
                       "luxels": "luxels.exr", "validity": "validity.png",
                       "charts": "charts.png", "width": 2, "height": 1}],
        },
        "others": [],
        "atlas": {"width": 2, "height": 1, "texels_per_metre": 4.0, "utilisation": 0.5, "charts": 1, "padding": 1, "lit": 1,
                  "buried": 1},
        "objects": [{"name": HOSTILE, "area": 1.0, "texels_per_metre": 4.0,
                     "rectangles": [{"page": 0, "min": [0, 0], "max": [2, 1]}]}],
        "files": {"glb": "scene.glb", "obj": "scene.obj", "preview": "preview.png"},
        "bevy": null,
    })
}

fn map(value: f32) -> Vec<u8> {
    let image = Image {
        width: 2,
        height: 1,
        pixels: vec![[value; 3]; 2],
    };
    let picture = Picture {
        image,
        layers: Vec::new(),
        origin: None,
    };
    encode(&picture).expect("a picture")
}

/// A folder as a bake leaves it.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).expect(name);
    write("manifest.json", manifest().to_string().as_bytes());
    write("light.exr", &map(2.0));
    write("error.exr", &map(0.02));
    write(
        "validity.png",
        &png::encode_grey8(&[255, 128], [2, 1]).expect("a picture"),
    );
    write(
        "charts.png",
        &png::encode_rgb8(&[9; 6], [2, 1]).expect("a picture"),
    );
    write("scene.glb", b"glTF");
    folder
}

fn failure(folder: &Path) -> String {
    Content::read(folder)
        .expect_err("nothing to show")
        .to_string()
}

#[test]
fn names_are_text_wherever_they_stand() {
    let folder = folder();
    let content = Content::read(folder.path()).expect("a bake");
    let text = page(&content).expect("a page");
    assert!(!text.contains("<img"), "markup of a name");
    assert!(text.contains("&lt;/script&gt;&lt;img src=x"));
    assert!(text.contains("\\u003c/script>\\u003cimg"));
    // The frame has three scripts, and no part ends one or hides its end.
    assert_eq!(text.matches("</script").count(), 3);
    assert_eq!(text.matches("<!--").count(), 0);
    assert_eq!(
        text.matches("three.js authors").count(),
        1,
        "{{three}} in a name"
    );
}

#[test]
fn nothing_is_fetched() {
    let folder = folder();
    let text = page(&Content::read(folder.path()).expect("a bake")).expect("a page");
    assert!(text.contains("default-src 'none'"), "a policy");
    for address in [
        "src=\"http",
        "href=\"http",
        "src=\"//",
        "url(",
        "@import",
        "import(",
    ] {
        let own = [FRAME, STYLE, SURFACE, VIEW];
        assert!(own.iter().all(|part| !part.contains(address)), "{address}");
    }
    // Whatever is written as an address in three.js is the name of a format.
    let addresses: Vec<&str> = text.split("http://").skip(1).collect();
    assert!(
        addresses
            .iter()
            .all(|rest| rest.starts_with("www.w3.org/1999/xhtml\""))
    );
    assert_eq!(text.matches("https://").count(), 0);
}

#[test]
fn the_same_folder_gives_the_same_page() {
    let (one, other) = (folder(), folder());
    let pages = [&one, &other]
        .map(|folder| page(&Content::read(folder.path()).expect("a bake")).expect("a page"));
    assert_eq!(pages[0], pages[1]);
}

#[test]
fn parts_are_not_looked_at_again() {
    let text = filled("<{{a}}|{{b}}>", |name| format!("{name}{{{{b}}}}").into());
    assert_eq!(text, "<a{{b}}|b{{b}}>");
}

#[test]
fn what_is_no_bake_is_told_what_is_missing() {
    let empty = tempfile::tempdir().expect("a temporary folder");
    assert!(failure(empty.path()).contains("luxel bake SCENE -o"));
    assert!(failure(&empty.path().join("nowhere")).contains("no manifest.json"));
    for missing in [
        "light.exr",
        "error.exr",
        "validity.png",
        "charts.png",
        "scene.glb",
    ] {
        let folder = folder();
        fs::remove_file(folder.path().join(missing)).expect(missing);
        let error = Content::read(folder.path()).expect_err(missing);
        let cause = std::error::Error::source(&error).map(ToString::to_string);
        let told = format!("{error} {cause:?}");
        assert!(
            told.contains(missing) && told.contains("bake again"),
            "{told}"
        );
    }
}

#[test]
fn other_manifests_are_refused() {
    let folder = folder();
    let path = folder.path().join("manifest.json");
    let told = |change: &dyn Fn(&mut Value)| {
        let mut manifest = manifest();
        change(&mut manifest);
        fs::write(&path, manifest.to_string()).expect("a manifest");
        failure(folder.path())
    };
    assert!(told(&|m| m["schema"] = json!(1)).contains("schema 1"));
    assert!(told(&|m| m["schema"] = json!("new")).contains("not a manifest"));
    assert!(told(&|m| m["lightmap"]["pages"] = json!([{}])).contains("not a manifest"));
    assert!(
        told(&|m| m["lightmap"]["pages"][0]["width"] = json!(3))
            .contains("2 × 1 texels where manifest.json says 3 × 1")
    );
    for name in ["../light.exr", "/etc/passwd", "a/light.exr", "..", "."] {
        assert!(
            told(&|m| m["files"]["glb"] = json!(name)).contains("beside it"),
            "{name}"
        );
    }
    fs::write(&path, "{").expect("a manifest");
    assert!(failure(folder.path()).contains("not a manifest"));
    fs::write(&path, manifest().to_string()).expect("a manifest");
    fs::write(folder.path().join("validity.png"), "PNG").expect("a file");
    assert!(failure(folder.path()).contains("not a readable PNG"));
}
