//! The snippet as a bake writes it, with a number that no scene has, so that it is seen where it arrives.

use std::{env, fs, path::Path};

fn main() {
    let snippet = "../../../render/src/lightmap/snippets/bevy.rs";
    println!("cargo::rerun-if-changed={snippet}");
    let text = fs::read_to_string(snippet).expect("the snippet");
    let place = "{lightmap_exposure}";
    assert_eq!(text.matches(place).count(), 1, "one number is filled in");
    let out = env::var("OUT_DIR").expect("cargo says where");
    let text = text.replace(place, "123.25");
    fs::write(Path::new(&out).join("snippet.rs"), text).expect("writable");
}
