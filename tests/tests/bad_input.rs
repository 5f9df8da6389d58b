//! Bad input through the command: the right exit code, a message that names the place and the
//! remedy, no panic, nothing on stdout and no file, whole or half.

use luxel::cli::ExitCode;
use luxel_tests::command::{Outcome, arg, luxel};
use luxel_tests::picture::example;
use std::path::Path;

const MTL: &str = "newmtl grey\nKd 0.5 0.5 0.5\nnewmtl lamp\nKd 0 0 0\nKe 5 5 5\n";

/// A floor and a lamp above it.
const OBJ: &str = "mtllib s.mtl\n\
    v -1 0 -1\nv -1 0 1\nv 1 0 1\nv 1 0 -1\n\
    v -1 2 -1\nv 1 2 -1\nv 1 2 1\nv -1 2 1\n\
    o floor\nusemtl grey\nf 1 2 3 4\n\
    o lamp\nusemtl lamp\nf 5 6 7 8\n";

const TOML: &str = "geometry = [\"s.obj\"]\n\
    [[camera]]\nname = \"main\"\nposition = [0, 1, 3]\nlook_at = [0, 1, 0]\nfov = 40\nsize = [8, 8]\n";

const POINTS: &str = "x,y,z,nx,ny,nz\n0,0,0,0,1,0\n";

/// The files of a scene, in which rows change one thing.
#[derive(Clone)]
struct Files {
    toml: String,
    obj: String,
    mtl: String,
}

impl Files {
    fn good() -> Self {
        Self {
            toml: TOML.to_owned(),
            obj: OBJ.to_owned(),
            mtl: MTL.to_owned(),
        }
    }

    fn obj(from: &str, to: &str) -> Self {
        Self {
            obj: replaced(OBJ, from, to),
            ..Self::good()
        }
    }

    fn mtl(from: &str, to: &str) -> Self {
        Self {
            mtl: replaced(MTL, from, to),
            ..Self::good()
        }
    }

    fn toml(more: &str) -> Self {
        Self {
            toml: format!("{TOML}{more}"),
            ..Self::good()
        }
    }

    fn write(&self, folder: &Path) {
        let save = |name: &str, text: &str| {
            std::fs::write(folder.join(name), text).expect("a writable folder");
        };
        save("s.toml", &self.toml);
        save("s.obj", &self.obj);
        save("s.mtl", &self.mtl);
        save("p.csv", POINTS);
    }
}

fn replaced(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from:?} is not in the file");
    text.replacen(from, to, 1)
}

/// Runs a verb in a folder; `{}` in an argument is the folder.
fn run(folder: &Path, arguments: &[&str]) -> Outcome {
    let arguments: Vec<String> = arguments
        .iter()
        .map(|argument| argument.replace("{}", arg(folder)))
        .collect();
    luxel(&arguments.iter().map(String::as_str).collect::<Vec<_>>())
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> = entries
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    names.sort();
    names
}

/// Verbs that take a scene.
const VERBS: [&[&str]; 4] = [
    &[
        "render",
        "{}/s.toml",
        "-o",
        "{}/out.exr",
        "--png",
        "{}/out.png",
    ],
    &[
        "probe",
        "{}/s.toml",
        "--points",
        "{}/p.csv",
        "-o",
        "{}/out.csv",
    ],
    &["solve", "{}/s.toml", "--json", "-o", "{}/out.ply"],
    &["form-factors", "{}/s.toml", "--json", "-o", "{}/out.csv"],
];

/// Asserts that `arguments` fail as they should in a folder with `files`.
#[track_caller]
fn refuses(files: &Files, arguments: &[&str], exit: ExitCode, mentions: &[&str]) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    files.write(folder.path());
    let before = names(folder.path());
    let outcome = run(folder.path(), arguments);
    assert_eq!(outcome.exit, exit, "{arguments:?}: {outcome:?}");
    assert_eq!(outcome.stdout, "", "{arguments:?}: a result of a failure");
    for mention in mentions {
        assert!(
            outcome.stderr.contains(mention),
            "{arguments:?}: {mention:?} is missing: {}",
            outcome.stderr
        );
    }
    assert!(!outcome.stderr.contains("panicked"), "{}", outcome.stderr);
    assert_eq!(
        names(folder.path()),
        before,
        "{arguments:?} left files behind"
    );
}

#[test]
fn the_scene_that_rows_change_is_good() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    Files::good().write(folder.path());
    for verb in VERBS {
        run(folder.path(), verb).assert_success();
    }
}

/// What a row is about, its files, and what the message must mention.
type Row<'a> = (&'a str, Files, &'a [&'a str]);

#[track_caller]
fn every_verb_refuses(rows: &[Row<'_>]) {
    for (name, files, mentions) in rows {
        for verb in VERBS {
            println!("{name}: {}", verb[0]);
            refuses(files, verb, ExitCode::InvalidInput, mentions);
        }
    }
}

#[test]
fn broken_geometry_and_materials_are_refused_by_every_verb() {
    let mut unreadable = Files::good();
    unreadable.toml = unreadable.toml.replace("s.obj", "missing.obj");
    every_verb_refuses(&[
        ("missing geometry", unreadable, &["s.toml:1", "missing.obj"]),
        (
            "missing library",
            Files::obj("s.mtl", "none.mtl"),
            &["s.obj:1", "none.mtl"],
        ),
        (
            "index out of range",
            Files::obj("f 1 2 3 4", "f 1 2 3 9"),
            &["s.obj", "floor", "9"],
        ),
        (
            "index zero",
            Files::obj("f 1 2 3 4", "f 0 1 2 3"),
            &["s.obj", "floor", "0"],
        ),
        (
            "NaN vertex",
            Files::obj("v -1 0 -1", "v NaN 0 -1"),
            &["s.obj:2", "finite"],
        ),
        (
            "infinite vertex",
            Files::obj("v -1 0 1", "v -1 inf 1"),
            &["s.obj:3", "finite"],
        ),
        (
            "a vertex of words",
            Files::obj("v -1 0 -1", "v here and there"),
            &["s.obj:2"],
        ),
        (
            "unknown material",
            Files::obj("usemtl grey", "usemtl gray"),
            &["s.obj", "gray"],
        ),
        (
            "negative emission",
            Files::mtl("Ke 5 5 5", "Ke -5 5 5"),
            &["s.mtl", "lamp", "-5"],
        ),
        (
            "infinite emission",
            Files::mtl("Ke 5 5 5", "Ke 5 inf 5"),
            &["s.mtl", "lamp"],
        ),
        (
            "reflectance above one",
            Files::mtl("0.5 0.5 0.5", "0.5 1.2 0.5"),
            &["s.mtl", "grey", "1.2"],
        ),
        (
            "negative reflectance",
            Files::mtl("0.5 0.5 0.5", "-0.5 0.5 0.5"),
            &["s.mtl", "grey", "-0.5"],
        ),
        (
            "NaN reflectance",
            Files::mtl("0.5 0.5 0.5", "NaN 0.5 0.5"),
            &["s.mtl", "grey"],
        ),
        (
            "reflectance of words",
            Files::mtl("0.5 0.5 0.5", "red"),
            &["s.mtl:2", "red"],
        ),
    ]);
}

#[test]
fn broken_scene_files_are_refused_by_every_verb() {
    every_verb_refuses(&[
        (
            "unknown key",
            Files::toml("\n[material.grey]\nreflectence = 0.5\n"),
            &["s.toml:10", "reflectence", "reflectance"],
        ),
        (
            "unknown section",
            Files::toml("\n[lihgt]\n"),
            &["s.toml:9", "lihgt", "light"],
        ),
        (
            "not TOML",
            Files::toml("\nthis is = = no TOML\n"),
            &["s.toml:9"],
        ),
        (
            "light without strength",
            Files::toml("\n[[light]]\nkind = \"point\"\nposition = [0, 1, 0]\n"),
            &["s.toml:9", "candela"],
        ),
        (
            "NaN light",
            Files::toml("\n[[light]]\nkind = \"point\"\nposition = [0, nan, 0]\ncandela = 1\n"),
            &["s.toml:11", "position"],
        ),
    ]);
}

#[test]
fn missing_scenes_and_points_are_named() {
    let files = Files::good();
    let missing = &[
        "probe",
        "{}/none.toml",
        "--points",
        "{}/p.csv",
        "-o",
        "{}/out.csv",
    ];
    refuses(&files, missing, ExitCode::InvalidInput, &["none.toml"]);
    let missing = &[
        "probe",
        "{}/s.toml",
        "--points",
        "{}/none.csv",
        "-o",
        "{}/out.csv",
    ];
    refuses(&files, missing, ExitCode::Failure, &["none.csv"]);
    let missing = &["render", "{}/none.obj", "-o", "{}/out.exr"];
    refuses(&files, missing, ExitCode::InvalidInput, &["none.obj"]);
    let folder = &["solve", "{}", "--json"];
    refuses(&files, folder, ExitCode::InvalidInput, &["extension"]);
}

#[test]
fn libraries_that_cannot_be_read_are_io_failures() {
    // A folder in the place of the library: nobody, not even root, can read it as a file.
    let folder = tempfile::tempdir().expect("a temporary folder");
    Files::good().write(folder.path());
    std::fs::remove_file(folder.path().join("s.mtl")).expect("the library");
    std::fs::create_dir(folder.path().join("s.mtl")).expect("a folder");
    let before = names(folder.path());
    for verb in VERBS {
        let outcome = run(folder.path(), verb);
        assert_eq!(outcome.exit, ExitCode::Failure, "{outcome:?}");
        assert!(outcome.stderr.contains("s.mtl"), "{}", outcome.stderr);
        assert_eq!(names(folder.path()), before, "{verb:?} left files behind");
    }
}

#[test]
fn scenes_with_nothing_to_do_say_what_is_missing() {
    let dark = Files::mtl("Ke 5 5 5", "Ke 0 0 0");
    for verb in &VERBS[..3] {
        refuses(&dark, verb, ExitCode::NothingToDo, &["light"]);
    }
    let mut empty = Files::good();
    empty.obj = "mtllib s.mtl\nv 0 0 0\no nothing\n".to_owned();
    for verb in VERBS {
        refuses(&empty, verb, ExitCode::NothingToDo, &["no faces"]);
    }
}

#[test]
fn outputs_that_cannot_be_written_are_refused_before_the_work() {
    let files = Files::good();
    for (verb, output) in [
        (&["render", "{}/s.toml"][..], "out.exr"),
        (&["probe", "{}/s.toml", "--points", "{}/p.csv"], "out.csv"),
        (&["solve", "{}/s.toml"], "out.ply"),
        (&["form-factors", "{}/s.toml"], "out.csv"),
    ] {
        // No such folder; a file in the place of a folder; a folder in the place of the file.
        let missing = format!("{{}}/missing/{output}");
        let arguments = [verb, &["-o", &missing]].concat();
        refuses(&files, &arguments, ExitCode::Failure, &["missing", output]);
        let inside = format!("{{}}/s.obj/{output}");
        let arguments = [verb, &["-o", &inside]].concat();
        refuses(&files, &arguments, ExitCode::Failure, &["s.obj", output]);
    }
}

#[test]
fn what_can_be_put_right_is_warned_of_and_counted() {
    // A face without area, a concave one, one that is not flat, and an object without faces.
    let more = "v 0 0 0\nv 0.5 0 0\nv 1 0 0\n\
        o broken\nusemtl grey\nf 9 10 11\nf 9 9 10\n\
        v 0 1 0\nv 1 1 0\nv 0.2 1.2 0\nv 0 2 0\nf 12 13 14 15\n\
        v 0 1 1\nv 1 1 1\nv 1 2 1\nv 0 2 1.5\nf 16 17 18 19\n\
        o hollow\n";
    let files = Files {
        obj: format!("{OBJ}{more}"),
        ..Files::good()
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    files.write(folder.path());
    for verb in VERBS {
        let outcome = run(folder.path(), verb);
        outcome.assert_success();
        for mention in ["2 ", "broken", "hollow", "convex", "flat"] {
            assert!(
                outcome.stderr.contains(mention),
                "{mention:?} in {}",
                outcome.stderr
            );
        }
    }
}

#[test]
fn a_camera_inside_a_wall_is_refused_or_gives_a_finite_picture() {
    let seen_from = |position| Files {
        toml: replaced(TOML, "[0, 1, 3]", position)
            .replace("look_at = [0, 1, 0]", "look_at = [0.3, 1, 0.2]"),
        ..Files::good()
    };
    // On the lamp and on the floor these themselves, seen from behind, fill the view.
    for (position, object) in [("[0, 2, 0]", "lamp"), ("[0, 0, 0]", "floor")] {
        let mentions = [
            "camera `main`",
            &format!("object `{object}`"),
            "move the camera",
        ];
        refuses(
            &seen_from(position),
            VERBS[0],
            ExitCode::InvalidInput,
            &mentions,
        );
    }
    // Far below most rays see nothing.
    let folder = tempfile::tempdir().expect("a temporary folder");
    seen_from("[0, -5, 0]").write(folder.path());
    run(folder.path(), VERBS[0]).assert_success();
    let picture = luxel::image::exr::read(&folder.path().join("out.exr")).expect("a picture");
    let mut values = picture.image.pixels.iter().flatten();
    assert!(values.all(|x| x.is_finite() && *x >= 0.0));

    // No view at all: the camera looks at itself.
    let files = Files {
        toml: replaced(TOML, "[0, 1, 3]", "[0, 1, 0]"),
        ..Files::good()
    };
    refuses(&files, VERBS[0], ExitCode::InvalidInput, &["look_at"]);
}

#[test]
fn wrong_arguments_are_usage_errors() {
    let files = Files::good();
    for arguments in [
        &["render", "{}/s.toml"][..],
        &["render", "{}/s.toml", "-o", "{}/out.jpg"],
        &["render", "{}/s.toml", "-o", "{}/out.exr", "--size", "0x8"],
        &["render", "{}/s.toml", "-o", "{}/out.exr", "--spp", "0"],
        &[
            "render",
            "{}/s.toml",
            "-o",
            "{}/out.exr",
            "--camera",
            "other",
        ],
        &["probe", "{}/s.toml"],
        &[
            "probe",
            "{}/s.toml",
            "--points",
            "{}/p.csv",
            "--max-distance",
            "-1",
            "--quantity",
            "ao",
        ],
        &[
            "probe",
            "{}/s.toml",
            "--points",
            "{}/p.csv",
            "--max-distance",
            "nan",
            "--quantity",
            "ao",
        ],
        &["solve", "{}/s.toml", "--tolerance", "-1"],
        &["solve", "{}/s.toml", "--patch-size", "-2"],
        &["solve", "{}/s.toml", "--solver", "magic"],
        &["form-factors", "{}/s.toml", "--rays", "-5"],
    ] {
        refuses(&files, arguments, ExitCode::Usage, &[]);
    }
}

/// Errors and times that cannot be asked for, whatever the verb.
#[test]
fn goals_that_make_no_sense_are_usage_errors() {
    let files = Files::good();
    let render = ["render", "{}/s.toml", "-o", "{}/out.exr"];
    let probe = ["probe", "{}/s.toml", "--points", "{}/p.csv"];
    for verb in [&render[..], &probe] {
        for (goal, mention) in [
            (["--error", "0%"], "above 0%"),
            (["--error", "-1%"], "above 0%"),
            (["--error", "100%"], "below 100%"),
            (["--error", "NaN%"], "above 0%"),
            (["--error", "1"], "percentage"),
            (["--error", "0.00001%"], "single-precision"),
            (["--time", "0s"], "above 0"),
            (["--time", "NaNs"], "above 0"),
            (["--time", "5"], "unit"),
        ] {
            let arguments = [verb, &goal].concat();
            refuses(&files, &arguments, ExitCode::Usage, &[goal[0], mention]);
        }
    }
    let both = [&probe[..], &["--rays", "64", "--error", "1%"]].concat();
    refuses(&files, &both, ExitCode::Usage, &["--rays", "--error"]);
    let both = [&render[..], &["--spp", "4", "--time", "1s"]].concat();
    refuses(&files, &both, ExitCode::Usage, &["--spp", "--time"]);
}

/// An error that the time does not allow: the result is written, says what was reached, and the exit
/// code tells.
#[test]
fn a_missed_error_is_told_and_the_result_kept() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let points = "x,y,z,nx,ny,nz\n0.05,0,0.05,0,1,0\n0.1,0,0.05,0,1,0\n";
    std::fs::write(folder.path().join("p.csv"), points).expect("a writable folder");
    let cornell = example("cornell");
    for (verb, file) in [
        (
            &["probe", arg(&cornell), "--points", "{}/p.csv"][..],
            "out.csv",
        ),
        (&["render", arg(&cornell), "--size", "16x16"], "out.exr"),
        (&["solve", arg(&cornell)], "out.ply"),
    ] {
        let output = format!("{{}}/{file}");
        let goal = ["--error", "0.01%", "--time", "1s", "--json", "-o", &output];
        let outcome = run(folder.path(), &[verb, &goal].concat());
        assert_eq!(outcome.exit, ExitCode::TargetMissed, "{outcome:?}");
        let error = &outcome.json()["error"];
        assert_eq!(error["reached"], false);
        let total = error["total"].as_f64();
        assert!(total.is_some_and(|e| e > 1e-4), "{error}");
        assert!(folder.path().join(file).exists());
    }
}

/// An open scene under a sky has an answer: what escapes does not come back.
#[test]
fn an_open_scene_under_a_sky_is_no_error() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let sky = "[[light]]\nkind = \"sky\"\nmodel = \"uniform\"\nradiance = 1\n";
    Files::toml(sky).write(folder.path());
    let arguments = ["probe", "{}/s.toml", "--points", "{}/p.csv", "--json"];
    let outcome = run(folder.path(), &arguments);
    outcome.assert_success();
    let json = outcome.json();
    assert_eq!(json["error"]["reached"], true);
    assert!(json["mean"][0].as_f64().is_some_and(|e| e > 0.0));
}
