//! Bakes as they are handed over: to whom, in which unit and file, and again to others.

use luxel::cli::ExitCode;
use luxel::image::exr::{self, Origin};
use luxel_tests::command::{Outcome, arg, luxel};
use luxel_tests::picture::example;
use serde_json::Value;
use std::collections::BTreeMap;
use std::f64::consts::FRAC_1_PI;
use std::fs;
use std::path::Path;

/// Bakes on several pages, two sets of maps.
const PAGES: [&str; 12] = [
    "--texels-per-metre",
    "60",
    "--size",
    "64",
    "--error",
    "20%",
    "--include",
    "all,ao",
    "--max-distance",
    "0.3",
    "-j",
    "2",
];

fn bake(scene: &str, out: &Path, options: &[&str]) -> Outcome {
    let file = example(scene);
    luxel(&[&["bake", arg(&file), "-o", arg(out)][..], options].concat())
}

fn export(folder: &Path, out: &Path, options: &[&str]) -> Outcome {
    luxel(&[&["export", arg(folder), "-o", arg(out)][..], options].concat())
}

/// All files of a folder by name.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).expect("a folder");
    entries
        .map(|entry| {
            let entry = entry.expect("an entry");
            let bytes = fs::read(entry.path()).expect("a file");
            (entry.file_name().to_string_lossy().into_owned(), bytes)
        })
        .collect()
}

fn assert_same(one: &Path, other: &Path, what: &str) {
    let [one, other] = [one, other].map(files);
    let [left, right] = [&one, &other].map(|files| files.keys().collect::<Vec<_>>());
    assert_eq!(left, right, "{what}");
    for (name, bytes) in &one {
        assert!(*bytes == other[name], "{what}: {name} differs");
    }
}

fn manifest(folder: &Path) -> Value {
    let text = fs::read(folder.join("manifest.json")).expect("a manifest");
    serde_json::from_slice(&text).expect("JSON")
}

/// Whoever a bake was made for, exporting it for another gives what baking for him gives, byte by byte; and so does exporting that.
#[test]
fn exporting_is_baking() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for scene in ["cornell", "pavilion"] {
        let options: Vec<&str> = if scene == "cornell" {
            PAGES.to_vec()
        } else {
            vec!["--size", "64", "--error", "20%"]
        };
        let mut last = folder.path().join(format!("{scene} raw"));
        bake(scene, &last, &options).assert_success();
        if scene == "cornell" {
            let pages = manifest(&last)["lightmap"]["pages"]
                .as_array()
                .map(Vec::len);
            assert!(pages > Some(1), "{pages:?}");
        }
        let all = [
            ("bevy", "ktx2"),
            ("godot", "rgbm"),
            ("three", "hdr"),
            ("blender", "exr"),
            ("raw", "exr"),
        ];
        // Of the glTF document nothing depends on the format but names.
        let first = if scene == "cornell" { 0 } else { 3 };
        for (target, format) in all.into_iter().skip(first) {
            let handed = ["--for", target, "--format", format];
            let [direct, out] = ["direct", "out"]
                .map(|name| folder.path().join(format!("{scene} {target} {name}")));
            bake(scene, &direct, &[&options[..], &handed].concat()).assert_success();
            export(&last, &out, &handed).assert_success();
            assert_same(&direct, &out, &format!("{scene} for {target}"));
            last = out;
        }
        let raw = folder.path().join(format!("{scene} raw"));
        assert_same(&raw, &last, "all the way round");
    }
}

/// What is said of files holds: the manifest of formats and factors, pictures of quantities and units.
#[test]
fn files_say_what_they_hold() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [baked, out] = ["baked", "out"].map(|name| folder.path().join(name));
    bake(
        "pavilion",
        &baked,
        &["--size", "64", "--error", "20%", "--for", "three"],
    )
    .assert_success();
    let outcome = export(&baked, &out, &["--for", "unity", "--json"]);
    outcome.assert_success();
    let told = outcome.json();
    assert_eq!(told, manifest(&out), "--json tells the manifest");
    let page = &told["lightmap"]["pages"][0];
    let encoding = &page["encoding"];
    assert_eq!(
        (&encoding["format"], &encoding["formula"]),
        (&"exr".into(), &"texel = rgb".into())
    );
    assert_eq!(encoding["factor"].as_f64(), Some(FRAC_1_PI));
    assert_eq!(told["units"]["factor"].as_f64(), Some(FRAC_1_PI));
    let origin = |name: &Value| {
        let path = out.join(name.as_str().expect("a name"));
        let picture = exr::read(&path).expect("a picture");
        let Some(Origin::Baked(origin)) = picture.origin else {
            panic!("{name} says nothing of itself");
        };
        assert_eq!(
            origin.error.to_string(),
            told["lightmap"]["error"]["luxels"].to_string()
        );
        (origin.quantity, origin.unit)
    };
    // The pavilion is lit in lumens.
    let expected = |quantity: &str, unit: &str| (quantity.to_owned(), unit.to_owned());
    assert_eq!(origin(&page["file"]), expected("white radiance", "cd/m2"));
    assert_eq!(origin(&page["master"]), expected("irradiance", "lx"));
    assert_eq!(
        origin(&page["error"]),
        expected("standard error of irradiance", "lx")
    );
    assert_eq!(
        origin(&page["luxels"]),
        expected("irradiance at luxels", "lx")
    );
    let [file, master] = ["file", "master"].map(|key| {
        let path = out.join(page[key].as_str().expect("a name"));
        exr::read(&path).expect("a picture").image.pixels
    });
    // One rounding of the product.
    let product = |e: &f32| ((f64::from(*e) * FRAC_1_PI) as f32).to_bits();
    assert!(
        file.iter()
            .zip(&master)
            .all(|(file, master)| file.map(f32::to_bits) == master.each_ref().map(product))
    );
    // three.js takes E: the master is what it loads.
    let page = &manifest(&baked)["lightmap"]["pages"][0];
    assert_eq!(page["file"], page["master"]);
}

#[test]
fn what_is_no_whole_bake_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [baked, out] = ["baked", "out"].map(|name| folder.path().join(name));
    bake(
        "cornell",
        &baked,
        &["--size", "32", "--error", "20%", "--for", "bevy"],
    )
    .assert_success();
    let whole = files(&baked);
    let restore = || {
        for (name, bytes) in &whole {
            fs::write(baked.join(name), bytes).expect("written");
        }
    };
    let refused = |options: &[&str], exit: ExitCode, words: &[&str]| {
        let outcome = export(&baked, &out, options);
        assert_eq!(outcome.exit, exit, "{}", outcome.stderr);
        assert_eq!(outcome.stdout, "");
        for word in words {
            assert!(outcome.stderr.contains(word), "{word}: {}", outcome.stderr);
        }
        assert!(!out.join("manifest.json").exists(), "nothing is complete");
        restore();
    };
    // The map and the snippet are made anew.
    let made = ["lightmap_000.ktx2", "bevy.rs"];
    for name in whole.keys().filter(|name| !made.contains(&name.as_str())) {
        fs::remove_file(baked.join(name)).expect("it is there");
        let exit = if name == "manifest.json" {
            ExitCode::InvalidInput
        } else {
            ExitCode::Failure
        };
        refused(&[], exit, &[name, "luxel bake SCENE -o"]);
        assert!(!out.exists(), "{name}: nothing is written");
    }
    let change = |from: &str, to: &str| {
        let text = String::from_utf8(whole["manifest.json"].clone()).expect("text");
        assert!(text.contains(from), "{from}");
        fs::write(baked.join("manifest.json"), text.replacen(from, to, 1)).expect("written");
    };
    change("\"schema\": 2", "\"schema\": 1");
    refused(&[], ExitCode::InvalidInput, &["schema 1", "bake again"]);
    change("\"include\": \"all\"", "\"include\": \"../all\"");
    refused(&[], ExitCode::InvalidInput, &["../all", "bake again"]);
    change("\"unit\": \"W/m2\"", "\"unit\": \"fc\"");
    refused(&[], ExitCode::InvalidInput, &["unit `fc`", "bake again"]);
    refused(
        &["--for", "unity", "--format", "rgbm"],
        ExitCode::Usage,
        &["exr, hdr", "--for raw"],
    );
    let bytes = &whole["lightmap_000_master.exr"];
    fs::write(
        baked.join("lightmap_000_master.exr"),
        &bytes[..bytes.len() / 2],
    )
    .expect("written");
    refused(&[], ExitCode::InvalidInput, &["lightmap_000_master.exr"]);
    fs::write(baked.join("scene.glb"), "glTF").expect("written");
    refused(&[], ExitCode::Failure, &["not the scene of a bake"]);
    let outcome = export(&baked, &baked, &[]);
    assert_eq!(outcome.exit, ExitCode::Usage, "{}", outcome.stderr);
    assert!(
        outcome.stderr.contains("name another folder"),
        "{}",
        outcome.stderr
    );
    assert_eq!(files(&baked), whole, "the bake is as it was");
    export(&baked, &out, &[]).assert_success();
}

/// Light beyond what half floats hold is moved to their end, and the page is named; Bevy's E/π of it fits.
#[test]
fn light_that_is_too_bright_for_a_format_is_told() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = folder.path().join("bright.toml");
    let geometry = "v 0 0 0\nv 1 0 0\nv 1 0 -1\nv 0 0 -1\nf 1 2 3 4\n";
    fs::write(folder.path().join("floor.obj"), geometry).expect("written");
    let text = "geometry = [\"floor.obj\"]\n[scene]\nunits = \"photometric\"\n[[light]]\nkind = \"directional\"\ndirection = [0, -1, 0]\nlux = 120000\n";
    fs::write(&scene, text).expect("written");
    for (target, format, told) in [
        ("three", "ktx2", true),
        ("bevy", "ktx2", false),
        ("three", "hdr", false),
    ] {
        let out = folder.path().join(format!("{target} {format}"));
        let outcome = luxel(&[
            "bake",
            arg(&scene),
            "-o",
            arg(&out),
            "--for",
            target,
            "--format",
            format,
            "--size",
            "16",
            "--include",
            "direct",
        ]);
        outcome.assert_success();
        let warning = format!("lightmap_000.{format}: ");
        let has_warning = outcome.stderr.contains(&warning) && outcome.stderr.contains("65504");
        assert_eq!(has_warning, told, "{target} {format}: {}", outcome.stderr);
        let clamped = &manifest(&out)["lightmap"]["pages"][0]["encoding"]["clamped"];
        assert_eq!(clamped.as_u64() > Some(0), told);
    }
}
