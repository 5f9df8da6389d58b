//! Lightmaps as they are delivered: against references, between rooms, over seams, in furnaces.

use glam::DVec3;
use luxel::cli::ExitCode;
use luxel::image::exr;
use luxel::lightmap::seams::{matched, steps};
use luxel_scenes::{Rgb, Scene};
use luxel_tests::baked::look_up;
use luxel_tests::builder::{Part, Polygon, flipped, parallelogram, room, scene, solid_box};
use luxel_tests::command::{arg, luxel};
use luxel_tests::lightmaps::{baked, bent_wall, push_smooth, sphere, torus};
use luxel_tests::metrics::Errors;
use luxel_tests::picture::example;
use luxel_tests::references::IrradianceReference;
use luxel_tests::scene_files;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::Path;

/// Bakes a reference scene and compares what an engine would look up with the reference: errors, and the share of values within 1.96
/// stated standard errors. Points inside solids, whose reference is exactly zero, are not seen and left out.
fn against_reference(scene: &str, options: &[&str]) -> (Errors, f64) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = example(scene);
    let mut args = vec!["bake", arg(&file), "-o", arg(folder.path()), "-q"];
    args.extend(options);
    luxel(&args).assert_success();
    let reference = IrradianceReference::load(scene);
    let found = look_up(folder.path(), &reference.position, &reference.normal);
    let seen: Vec<usize> = (0..found.len())
        .filter(|&i| reference.irradiance[i] != Rgb::ZERO)
        .collect();
    assert!(seen.len() > 900, "{} points are seen", seen.len());
    let pick = |list: &[Rgb]| seen.iter().map(|&i| list[i]).collect::<Vec<Rgb>>();
    let found = seen
        .iter()
        .map(|&i| found[i].expect("a face at each point"));
    let (values, stated): (Vec<Rgb>, Vec<Rgb>) = found.map(|[value, error]| (value, error)).unzip();
    let (expected, uncertain) = (pick(&reference.irradiance), pick(&reference.standard_error));
    let mut within = 0.0;
    for (index, value) in values.iter().enumerate() {
        let difference = (*value - expected[index]).abs();
        let error = (stated[index].powf(2.0) + uncertain[index].powf(2.0)).map(f64::sqrt);
        let inside = difference.cmple(1.96 * error);
        within += f64::from(inside.bitmask().count_ones());
    }
    let errors = Errors::new(&values, &expected, &uncertain);
    (errors, within / (3.0 * values.len() as f64))
}

/// At 512² the maps of a bare room, of a room lit through a slit and of a furnished one with 5000 charts are as near the reference as
/// asked, bilinear look-up between texels included.
#[test]
fn maps_are_as_near_as_asked() {
    for (scene, asked, nrmse) in [
        ("cornell", "2%", 0.02),
        ("corridor", "1.5%", 0.02),
        ("office", "3.5%", 0.05),
    ] {
        let (errors, within) = against_reference(scene, &["--size", "512", "--error", asked]);
        println!("{scene}: {errors:?}, within {within}");
        assert!(errors.nrmse <= nrmse, "{scene}: {errors:?}");
        // A thousand points of errors of their own know the mean to nRMSE / √1000.
        let known = 2.0 * errors.nrmse / 1000_f64.sqrt();
        assert!(errors.bias.abs() <= 0.005 + known, "{scene}: {errors:?}");
        // Of normal errors 95 % lie within; those of filtering are not, and small charts have no neighbours to tell them by.
        assert!(within >= 0.85, "{scene}: {within}");
    }
}

/// In the furnace E = 2π everywhere: gathers are exact there, and nothing that is done to the maps afterwards changes a constant.
#[test]
fn the_furnace_is_even() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = example("furnace");
    luxel(&[
        "bake",
        arg(&file),
        "-o",
        arg(folder.path()),
        "--size",
        "128",
        "-q",
    ])
    .assert_success();
    let luxels = exr::read(&folder.path().join("lightmap_000_luxels.exr")).expect("luxels");
    let map = exr::read(&folder.path().join("lightmap_000.exr")).expect("a map");
    let lit = luxels.image.pixels.iter().filter(|pixel| pixel[0] > 0.0);
    assert!(
        lit.clone().count() > 128 * 128 / 2,
        "{} luxels",
        lit.count()
    );
    for pixel in lit.chain(&map.image.pixels) {
        for value in pixel {
            let relative = f64::from(*value) / TAU - 1.0;
            assert!(relative.abs() <= 1e-3, "E = {value}");
        }
    }
}

/// A room of 4 × 2 × 2 m with one floor, lit from the ceiling of its one half, and something between the halves.
fn two_rooms(between: Vec<Polygon>) -> Scene {
    let lamp = parallelogram(DVec3::new(0.6, 1.99, 0.7), DVec3::X * 0.5, DVec3::Z * 0.6);
    scene(
        "two rooms",
        [
            Part::grey("room", 0.7, room(DVec3::ZERO, DVec3::new(4.0, 2.0, 2.0))),
            Part::grey("wall", 0.7, between),
            Part::lamp("lamp", 10.0, vec![lamp]),
        ],
    )
}

/// Nor does filtering carry light through a wall that is thinner than two texels: the floor has a chart on each side of it.
#[test]
fn filtering_does_not_leak_through_thin_walls() {
    let sheet = parallelogram(DVec3::new(1.937, 0.0, 0.0), DVec3::Y * 2.0, DVec3::Z * 2.0);
    // 3 cm where a texel is about 4 cm wide.
    let thin = solid_box(DVec3::new(1.9, 0.0, 0.0), DVec3::new(1.93, 2.0, 2.0));
    for (name, wall, faces) in [
        ("a sheet", vec![sheet.clone(), flipped(sheet)], [1.937; 2]),
        ("a thin wall", thin, [1.9, 1.93]),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        let scene = scene_files::write(&two_rooms(wall), folder.path(), "");
        let output = folder.path().join("baked");
        let options = ["--size", "192", "--error", "3%", "-q"];
        let arguments = ["bake", arg(&scene), "-o", arg(&output)];
        luxel(&[&arguments[..], &options[..]].concat()).assert_success();
        // On floor, ceiling and a wall, from a tenth of a millimetre to ten centimetres beside the thin one.
        let distances = [1e-4, 1e-3, 1e-2, 3e-2, 0.1];
        let of_side = |x: f64, away: f64| {
            distances.into_iter().flat_map(move |distance| {
                (0..9).flat_map(move |along| {
                    let (x, along) = (x + away * distance, 0.15 + 0.2 * f64::from(along));
                    [
                        (DVec3::new(x, 0.0, along), DVec3::Y),
                        (DVec3::new(x, 2.0, along), -DVec3::Y),
                        (DVec3::new(x, along, 0.0), DVec3::Z),
                    ]
                })
            })
        };
        let values = |x: f64, away: f64| -> Vec<f64> {
            let (positions, normals): (Vec<_>, Vec<_>) = of_side(x, away).unzip();
            let found = look_up(&output, &positions, &normals);
            let value = |found: &Option<_>| {
                let [value, _]: [Rgb; 2] = found.expect("a face");
                value.max_element()
            };
            found.iter().map(value).collect()
        };
        let (lit, dark) = (values(faces[0], -1.0), values(faces[1], 1.0));
        let [brightest, leak] =
            [&lit, &dark].map(|values| values.iter().copied().fold(0.0, f64::max));
        // The lamp is in view of all of the lit side.
        assert!(lit.iter().all(|value| *value > 0.1), "{name}: {lit:?}");
        assert!(leak <= 1e-6 * brightest, "{name}: {leak} of {brightest}");
    }
}

/// No light comes through a wall, whether it has no thickness, stands on the floor, or goes through floor and ceiling: whatever is
/// filled, smoothed and fitted, dark luxels stay darker than a millionth of the lit ones.
#[test]
fn walls_do_not_leak() {
    let sheet = parallelogram(DVec3::new(1.937, 0.0, 0.0), DVec3::Y * 2.0, DVec3::Z * 2.0);
    let sheets = vec![sheet.clone(), flipped(sheet)];
    let standing = solid_box(DVec3::new(1.9, 0.0, 0.0), DVec3::new(2.037, 2.0, 2.0));
    let through = solid_box(DVec3::new(1.9, -0.3, -0.2), DVec3::new(2.037, 2.3, 2.2));
    for (name, wall, dark_from) in [
        ("a sheet", sheets, 1.937),
        ("a wall on the floor", standing, 2.037),
        ("a wall through the floor", through, 2.037),
    ] {
        let scene = two_rooms(wall);
        let baked = baked(&scene, 192, 0.02);
        let frame = *baked.world.surfaces().geometry().frame();
        let (mut brightest, mut leak, mut dark) = (0.0_f64, 0.0_f64, 0);
        for (luxel, receiver) in baked
            .luxels
            .lit
            .luxels
            .iter()
            .zip(&baked.luxels.lit.receivers)
        {
            let position = frame.to_world(receiver.position);
            let value = baked.maps.map.values[luxel.texel as usize].max_element();
            let faces_dark_room = position.x + 1e-6 * receiver.normal.x > dark_from;
            if faces_dark_room {
                leak = leak.max(value);
                dark += 1;
            } else {
                brightest = brightest.max(value);
            }
        }
        assert!(
            dark > 5000 && brightest > 1.0,
            "{name}: {dark} dark luxels, {brightest}"
        );
        assert!(leak <= 1e-6 * brightest, "{name}: {leak} of {brightest}");
    }
}

/// Where a smooth surface is cut into charts, filtered values on both sides agree to a thousandth.
#[test]
fn seams_do_not_show() {
    let mut scene = scene(
        "round things",
        [
            Part::grey("room", 0.6, room(DVec3::ZERO, DVec3::new(4.0, 2.0, 3.0))),
            Part::lamp(
                "lamp",
                10.0,
                vec![parallelogram(
                    DVec3::new(1.6, 1.99, 1.2),
                    DVec3::X * 0.8,
                    DVec3::Z * 0.6,
                )],
            ),
        ],
    );
    let [ball, ring] = [DVec3::new(0.9, 0.6, 1.5), DVec3::new(2.9, 0.5, 1.2)];
    push_smooth(&mut scene, "sphere", 0.6, [48, 24], sphere(ball, 0.45));
    push_smooth(&mut scene, "torus", 0.6, [64, 32], torus(ring, 0.5, 0.2));
    let wall = bent_wall(DVec3::new(2.9, 0.01, 1.9), 1.0, 1.8);
    push_smooth(&mut scene, "bent wall", 0.6, [24, 4], wall);
    let baked = baked(&scene, 256, 0.02);
    let seams = matched(&baked.atlas, &baked.world);
    let of_raw = steps(&baked.maps.raw, &seams);
    let [largest, typical] = steps(&baked.maps.map, &seams);
    println!(
        "{} seams: {of_raw:?} before, {largest}, {typical}",
        seams.len()
    );
    assert!(seams.len() > 50, "{} seams", seams.len());
    assert!(largest <= 1e-3, "a step of {largest}, typically {typical}");
}

/// All files of a folder by name.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    entries
        .map(|entry| {
            let entry = entry.expect("an entry");
            let bytes = std::fs::read(entry.path()).expect("a file");
            (entry.file_name().to_string_lossy().into_owned(), bytes)
        })
        .collect()
}

#[test]
fn folders_are_the_same_at_any_number_of_threads() {
    let file = example("pavilion");
    let [one, two] = ["1", "2"].map(|threads| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let out = arg(folder.path());
        luxel(&[
            "bake",
            arg(&file),
            "-o",
            out,
            "--size",
            "128",
            "--for",
            "bevy",
            "-q",
            "-j",
            threads,
        ])
        .assert_success();
        files(folder.path())
    });
    let names: Vec<&String> = one.keys().collect();
    assert!(one.len() >= 10 && one.keys().eq(two.keys()), "{names:?}");
    for (name, bytes) in &one {
        assert!(two[name] == *bytes, "{name} differs");
    }
}

/// What was delivered is baked again with its own coordinates: the same atlas, the same light.
#[test]
fn delivered_coordinates_are_kept() {
    let [first, second] = [(); 2].map(|()| tempfile::tempdir().expect("a temporary folder"));
    let file = example("cornell");
    let options = ["--size", "128", "--error", "5%", "-q"];
    let bake = |scene: &Path, folder: &Path, uv: &str| {
        let mut args = vec!["bake", arg(scene), "-o", arg(folder), "--uv", uv];
        args.extend(options);
        luxel(&args)
    };
    bake(&file, first.path(), "unwrap").assert_success();
    bake(&first.path().join("scene.glb"), second.path(), "keep").assert_success();
    let [one, two] = [&first, &second].map(|folder| {
        let map = exr::read(&folder.path().join("lightmap_000_luxels.exr")).expect("luxels");
        map.image.pixels
    });
    let is_lit = |pixel: &[f32; 3]| pixel[0] > 0.0;
    let same = one
        .iter()
        .zip(&two)
        .filter(|(a, b)| is_lit(a) == is_lit(b))
        .count();
    // Positions and coordinates are rounded to f32 on the way: texels that faces only just touch may differ.
    assert!(
        same as f64 >= 0.995 * one.len() as f64,
        "{same} of {}",
        one.len()
    );
    let refused = bake(&file, second.path(), "keep");
    assert_eq!(refused.exit, ExitCode::InvalidInput);
    assert!(
        refused.stderr.contains("no second texture coordinates")
            && refused.stderr.contains("--uv unwrap"),
        "{}",
        refused.stderr
    );
}

#[test]
fn bad_bakes_are_refused_with_a_reason() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let occupied = folder.path().join("occupied");
    std::fs::write(&occupied, "a file").expect("a file");
    let dark = scene(
        "dark",
        [Part::grey("room", 0.5, room(DVec3::ZERO, DVec3::ONE))],
    );
    let dark = scene_files::write(&dark, folder.path(), "");
    let out = folder.path().join("out");
    let [cornell, pavilion] = ["cornell", "pavilion"].map(example);
    for (scene, out, options, exit, words) in [
        (
            &pavilion,
            &out,
            vec!["--uv", "keep"],
            ExitCode::InvalidInput,
            "overlap",
        ),
        (&cornell, &occupied, vec![], ExitCode::Failure, "occupied"),
        (
            &dark,
            &out,
            vec![],
            ExitCode::NothingToDo,
            "nothing emits light",
        ),
        (
            &cornell,
            &out,
            vec!["--size", "50"],
            ExitCode::Usage,
            "multiple of 4",
        ),
        (
            &cornell,
            &out,
            vec!["--texels-per-metre", "1000", "--size", "64"],
            ExitCode::InvalidInput,
            "--texels-per-metre",
        ),
        (
            &cornell,
            &out,
            vec!["--size", "2048", "--max-memory", "64M"],
            ExitCode::MemoryLimit,
            "--max-memory",
        ),
    ] {
        let mut args = vec!["bake", arg(scene), "-o", arg(out), "-q"];
        args.extend(options);
        let outcome = luxel(&args);
        assert_eq!(outcome.exit, exit, "{args:?}: {}", outcome.stderr);
        assert!(
            outcome.stderr.contains(words),
            "{args:?}: {}",
            outcome.stderr
        );
    }
}
