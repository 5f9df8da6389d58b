//! Directional lightmaps and irradiance volumes: laws, closed forms, agreement with probes, honesty, determinism.

use glam::DVec3;
use luxel::cli::ExitCode;
use luxel::image::exr;
use luxel::lightmap::directional::{self, Directions};
use luxel_scenes::{Rgb, Scene};
use luxel_solver::adaptive::{Control, Stage};
use luxel_solver::bounces::Bounces;
use luxel_solver::gather::{Components, ErrorParts};
use luxel_solver::incident::Aim;
use luxel_solver::incident::harmonics::{MOST, basis, rest, vector_irradiance};
use luxel_tests::builder::{Part, parallelogram, room, scene, solid_box};
use luxel_tests::command::{arg, luxel};
use luxel_tests::lightmaps::{Baked, baked};
use luxel_tests::picture::example;
use luxel_tests::probe::Probe;
use luxel_tests::scene_files;
use luxel_tests::volumes::ReadVolume;
use std::f64::consts::{PI, TAU};
use std::path::Path;

/// Bakes into a folder; small maps, for what is asked is beside them.
fn bake(scene: &Path, folder: &Path, options: &[&str]) -> luxel_tests::command::Outcome {
    let mut arguments = vec!["bake", arg(scene), "-o", arg(folder), "--size", "32", "-q"];
    arguments.extend(options);
    luxel(&arguments)
}

/// A floor under light from one direction.
const SUN: &str = "[[light]]\nkind = \"directional\"\ndirection = [-0.6, -0.64, 0.48]\nwatts_per_square_metre = 2.0\n";

fn floor() -> Scene {
    let corner = DVec3::new(-1.0, 0.0, -1.0);
    let floor = parallelogram(corner, DVec3::Z * 2.0, DVec3::X * 2.0);
    scene("floor", [Part::grey("floor", 0.5, vec![floor])])
}

/// A room with a lamp near one wall and a box below it.
fn lit_room() -> Scene {
    let lamp = parallelogram(DVec3::new(0.4, 1.9, 0.5), DVec3::X * 0.5, DVec3::Z * 0.6);
    let block = solid_box(DVec3::new(1.2, 0.0, 0.6), DVec3::new(1.8, 0.7, 1.3));
    scene(
        "room",
        [
            Part::grey("walls", 0.6, room(DVec3::ZERO, DVec3::new(3.0, 2.0, 2.0))),
            Part::grey("block", 0.4, block),
            Part::lamp("lamp", 10.0, vec![lamp]),
        ],
    )
}

/// Of light from one direction every coefficient of a volume is E Y, the dominant direction is the light's, wholly so, and spherical harmonics of degree
/// one give what they must: a₀ = E₀/4 and a = E₀ ω/2.
#[test]
fn light_from_one_direction_is_known() {
    let files = tempfile::tempdir().expect("a temporary folder");
    let file = scene_files::write(&floor(), files.path(), SUN);
    let towards = DVec3::new(0.6, 0.64, -0.48);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let options = ["--include", "direct", "--directional", "dominant"];
    let above = [
        "--volume-probes",
        "2x2x2",
        "--volume-box",
        "-1,0.5,-1,1,1.5,1",
    ];
    bake(&file, folder.path(), &[&options[..], &above[..]].concat()).assert_success();
    let volume = ReadVolume::load(folder.path());
    for (probe, coefficients) in volume.coefficients.iter().enumerate() {
        for (found, y) in coefficients.iter().zip(basis::<MOST>(towards)) {
            // Single precision, of directions in the file and of coefficients.
            let wrong = (*found - Rgb::splat(2.0 * y)).abs().max_element();
            assert!(wrong < 1e-6, "probe {probe}: {found} is not {}", 2.0 * y);
        }
        for normal in [DVec3::X, DVec3::Y, towards] {
            let [found, error] = volume.irradiance(probe, normal);
            let exact = 2.0 * towards.dot(normal).max(0.0);
            // What degree two leaves at most, of the mean E₀/4.
            let [_, largest] = rest(2);
            assert!((found.x - exact).abs() <= largest * 0.5 + 1e-5, "{found}");
            assert_eq!(error, Rgb::ZERO);
        }
    }
    let dominant = rgba(&folder.path().join("lightmap_000_dominant.exr"));
    for texel in dominant {
        let [x, y, z, w] = texel.map(f64::from);
        let found = 2.0 * DVec3::new(x, y, z) - 1.0;
        assert!((found - towards).length() < 1e-5, "{found}");
        assert!((w - (0.5 + 0.5 * towards.y)).abs() < 1e-5, "{w}");
    }
    let options = ["--include", "direct", "--directional", "sh1"];
    bake(&file, folder.path(), &options).assert_success();
    let manifest = manifest(folder.path());
    assert!(
        manifest["volume"].is_null(),
        "that of the last bake is gone"
    );
    assert!(!folder.path().join("volume.json").exists());
    let said = &manifest["lightmap"]["directional"];
    // ½ + φ/4E with E = φ cos θ.
    let ratio = said["ratio"]["mean"].as_f64().expect("a ratio");
    assert!((ratio - (0.5 + 0.25 / towards.y)).abs() < 1e-6, "{ratio}");
    let expected = [1.0, 2.0 * towards.x, 2.0 * towards.y, 2.0 * towards.z].map(|c| 0.5 * c);
    for (file, expected) in said["pages"][0]["files"]
        .as_array()
        .expect("files")
        .iter()
        .zip(expected)
    {
        let name = file.as_str().expect("a name");
        let picture = exr::read(&folder.path().join(name)).expect("a map");
        for pixel in &picture.image.pixels {
            assert!(
                (f64::from(pixel[1]) - expected).abs() < 1e-5,
                "{name}: {pixel:?}"
            );
        }
    }
}

fn manifest(folder: &Path) -> serde_json::Value {
    let text = std::fs::read(folder.join("manifest.json")).expect("a manifest");
    serde_json::from_slice(&text).expect("JSON")
}

/// The texels of an EXR file with four channels.
fn rgba(path: &Path) -> Vec<[f32; 4]> {
    use ::exr::prelude::read_first_rgba_layer_from_file;
    let image = read_first_rgba_layer_from_file(
        path,
        |size, _| vec![[0.0; 4]; size.0 * size.1],
        |texels: &mut Vec<[f32; 4]>, at, (r, g, b, a): (f32, f32, f32, f32)| {
            // Texels of a page are asked for row by row.
            let width = 32;
            texels[at.1 * width + at.0] = [r, g, b, a];
        },
    );
    image.expect("four channels").layer_data.channel_data.pixels
}

/// In the furnace L = 2 everywhere: E(n) = 2π at every probe and normal, a₀ = |a| = π, and the linear formula needs no ratio.
#[test]
fn the_furnace_is_even() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let options = [
        "--directional",
        "sh1",
        "--volume-probes",
        "2x2x2",
        "--error",
        "1%",
    ];
    bake(&example("furnace"), folder.path(), &options).assert_success();
    let volume = ReadVolume::load(folder.path());
    assert_eq!(volume.validity, [255; 8]);
    for probe in 0..8 {
        for normal in [DVec3::X, -DVec3::Y, DVec3::new(0.6, 0.0, -0.8)] {
            let [found, error] = volume.irradiance(probe, normal);
            // Five standard errors; constants of six digits, and the solver's tolerance.
            let allowed = 5.0 * error.max_element() + 1e-5 * TAU;
            assert!(
                (found - Rgb::splat(TAU)).abs().max_element() < allowed,
                "{found} ± {error}"
            );
            assert!(error.max_element() < 0.03 * TAU, "{error}");
        }
    }
    let said = &manifest(folder.path())["lightmap"]["directional"];
    let [mean, spread] =
        ["mean", "spread"].map(|name| said["ratio"][name].as_f64().expect("a number"));
    let stated = said["error"].as_f64().expect("an error");
    assert!(stated < 0.01);
    assert!(
        (mean - 1.0).abs() < 0.01 && spread < 0.02,
        "{mean} {spread}"
    );
    let first = said["pages"][0]["files"][0].as_str().expect("a name");
    let picture = exr::read(&folder.path().join(first)).expect("a map");
    let texels = picture.image.pixels.iter();
    let squares: f64 = texels.map(|p| (f64::from(p[0]) / PI - 1.0).powi(2)).sum();
    let wrong = (squares / picture.image.pixels.len() as f64).sqrt();
    // a₀ is part of what the stated error holds.
    assert!(
        wrong < 2.0 * stated + 1e-4,
        "{wrong} where {stated} is stated"
    );
}

/// A volume agrees with probes at the same points: what a normal receives more than its opposite follows from degree one alone and agrees within the stated
/// errors; the whole within these and what degree two leaves at most.
#[test]
fn volumes_agree_with_probes() {
    let scene = lit_room();
    let files = tempfile::tempdir().expect("a temporary folder");
    let file = scene_files::write(&scene, files.path(), "");
    let folder = tempfile::tempdir().expect("a temporary folder");
    bake(&file, folder.path(), &["--volume", "0.5", "--error", "2%"]).assert_success();
    let volume = ReadVolume::load(folder.path());
    let open: Vec<usize> = (0..volume.validity.len())
        .filter(|&i| volume.validity[i] == 255)
        .collect();
    assert_eq!(volume.validity.len(), 6 * 4 * 4);
    assert!(open.len() < volume.validity.len(), "some lie in the block");
    let normals = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| [axis, -axis]);
    let points = open.iter().flat_map(|&probe| {
        let position = volume.position(probe);
        normals
            .as_flattened()
            .iter()
            .map(move |normal| (position, *normal))
    });
    let probe = Probe {
        scene: &scene,
        toml: "",
        points: points.collect(),
        arguments: ["--error", "0.5%"].map(String::from).to_vec(),
    };
    let expected = probe.run(7);
    let (mut squares, mut count) = (0.0, 0.0);
    for (&probe, expected) in open.iter().zip(expected.chunks_exact(6)) {
        let largest = 0.375 * volume.coefficients[probe][0] * (0.25 / 0.282_094_8);
        for (pair, expected) in normals.iter().zip(expected.chunks_exact(2)) {
            let [[a, _], [b, _]] = pair.map(|normal| volume.irradiance(probe, normal));
            let (known, degree_one) = (
                expected[0]
                    .standard_error
                    .x
                    .hypot(expected[1].standard_error.x),
                // E(n) − E(−n) = 2 A₁ Y₁(n) c.
                2.0 * TAU / 3.0 * 0.488_603,
            );
            let k = [3, 1, 2][(0..3).find(|&axis| pair[0][axis] > 0.5).expect("an axis")];
            let own = degree_one * volume.errors[probe][k].x;
            let difference = (a - b).x - (expected[0].value - expected[1].value).x;
            squares += (difference / own.hypot(known)).powi(2);
            count += 1.0;
            for (normal, expected) in pair.iter().zip(expected) {
                let [found, error] = volume.irradiance(probe, *normal);
                let wrong = (found - expected.value).abs();
                let allowed = largest + 5.0 * (error + expected.standard_error);
                assert!(wrong.cmple(allowed).all(), "{wrong} of {found}");
            }
        }
    }
    let rms = f64::sqrt(squares / count);
    println!("{count} differences of {rms} stated errors, root mean square");
    // The noise of some 270 is known to a twentieth; what patches leave is common to many and known to a factor of two.
    assert!((0.4..1.6).contains(&rms), "{rms} of the stated error");
}

/// Suits at an error.
struct Until(f64);

impl Control for Until {
    fn begin(&mut self, _: Stage, _: f64, _: usize) -> f64 {
        1.0
    }
    fn advance(&mut self) -> bool {
        true
    }
    fn suits(&mut self, parts: &ErrorParts) -> bool {
        parts.total() <= self.0
    }
}

fn directions(baked: &Baked<'_>, error: f64, seed: u64) -> (directional::Gathered, Directions) {
    let aim = Aim {
        error,
        components: Components::All,
        bounces: Bounces::All,
        first_rays: 1,
        patches: [1000, usize::MAX],
        seed,
    };
    let found = directional::gather(&baked.world, &baked.luxels, &aim, &mut Until(error));
    let found = found.expect("a mesh").expect("nobody stops it");
    let maps = directional::maps(
        &baked.atlas,
        &baked.luxels,
        &found.estimates,
        &baked.maps.map,
    );
    (found, maps)
}

/// 2 n·a is the irradiance of the map to rounding, |a| ≤ 2 a₀ as of any light, and errors are what is stated: two seeds differ by them.
#[test]
fn directions_go_with_the_map_and_state_their_error() {
    let scene = lit_room();
    let baked = baked(&scene, 96, 0.03);
    let asked = 0.02;
    let (found, maps) = directions(&baked, asked, 1);
    assert!(found.parts.total() <= asked);
    let map = &baked.maps.map;
    for (luxel, receiver) in baked
        .luxels
        .lit
        .luxels
        .iter()
        .zip(&baked.luxels.lit.receivers)
    {
        let texel = luxel.texel as usize;
        let [a0, x, y, z] = [0, 1, 2, 3].map(|k| maps.coefficients[k][texel]);
        let n = receiver.normal;
        let along = 2.0 * (x * n.x + y * n.y + z * n.z);
        let wrong = (along - map.values[texel]).abs();
        // Coefficients are gathered in single precision.
        assert!(
            wrong.cmple(map.values[texel] * 1e-5 + 1e-12).all(),
            "{along}"
        );
        for channel in 0..3 {
            let length = DVec3::new(x[channel], y[channel], z[channel]).length();
            // To the noise of joined neighbours, which are sums of light only up to polynomials.
            let allowed = 2.0 * a0[channel] + 5.0 * maps.errors[texel][channel] + 1e-12;
            assert!(length <= allowed, "{length} {}", a0[channel]);
        }
    }
    let (other, _) = directions(&baked, asked, 2);
    let (mut made, mut stated, mut dark) = (0.0, 0.0, 0);
    let pairs = found.estimates.iter().zip(&other.estimates);
    for ((a, b), receiver) in pairs.zip(&baked.luxels.lit.receivers) {
        // The second for the irradiance of the first: what is stated is the error of shapes.
        let [level, its_level] = [a, b].map(|estimate| {
            let flux = vector_irradiance(&estimate.coefficients).map(|axis| axis.x);
            DVec3::from_array(flux).dot(receiver.normal)
        });
        // The bottom of the block looks out of the room.
        if level <= 0.0 {
            let none = [Rgb::ZERO; directional::COEFFICIENTS];
            assert_eq!([a.coefficients, b.coefficients], [none; 2]);
            dark += 1;
            continue;
        }
        assert!(its_level > 0.0, "{level} is not {its_level}");
        for k in 0..directional::COEFFICIENTS {
            let its = b.coefficients[k].x * level / its_level;
            made += (a.coefficients[k].x - its).powi(2);
            stated += a.standard_error[k].x.powi(2) + b.standard_error[k].x.powi(2);
        }
    }
    let ratio = f64::sqrt(made / stated);
    println!("{ratio} of the stated error, {dark} are dark");
    assert!(dark * 20 < found.estimates.len(), "{dark} are dark");
    // What patches leave is stated but common to both seeds, and joining has a bias that is stated and common in part.
    assert!((0.3..1.2).contains(&ratio), "{ratio}");
}

/// Two seeds of a volume differ by what is stated of them.
#[test]
fn volumes_state_their_error() {
    let files = tempfile::tempdir().expect("a temporary folder");
    let file = scene_files::write(&lit_room(), files.path(), "");
    let read = |seed: &str| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let options = ["--volume", "0.4", "--error", "3%", "--seed", seed];
        bake(&file, folder.path(), &options).assert_success();
        ReadVolume::load(folder.path())
    };
    let [one, other] = ["1", "2"].map(read);
    let (mut made, mut stated, mut within, mut count) = (0.0, 0.0, 0.0, 0.0);
    for probe in (0..one.validity.len()).filter(|&i| one.validity[i] == 255) {
        for k in 0..MOST {
            let difference = (one.coefficients[probe][k] - other.coefficients[probe][k]).x;
            let error = one.errors[probe][k].x.hypot(other.errors[probe][k].x);
            made += difference * difference;
            stated += error * error;
            within += f64::from(u8::from(difference.abs() <= 1.96 * error));
            count += 1.0;
        }
    }
    let (ratio, share) = (f64::sqrt(made / stated), within / count);
    println!("{ratio} of the stated error, {share} within 1.96 of it, of {count}");
    // What patches leave is stated but common to both seeds: no more than is stated, and not much less.
    assert!((0.4..1.2).contains(&ratio), "{ratio}");
    assert!(share > 0.93, "{share}");
    // The header says the same of all together.
    let said = one.header["error"]["irradiance"]
        .as_f64()
        .expect("an error");
    assert!(said <= 0.03 && said > 0.003, "{said}");
}

/// The same bytes at any number of threads; another seed, other bytes.
#[test]
fn bytes_do_not_depend_on_threads() {
    let files = tempfile::tempdir().expect("a temporary folder");
    let file = scene_files::write(&lit_room(), files.path(), "");
    let all = |threads: &str, seed: &str| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let options = [
            "--directional",
            "sh1",
            "--volume-probes",
            "4x3x3",
            "--volume-order",
            "1",
        ];
        let rest = ["--error", "20%", "-j", threads, "--seed", seed];
        bake(&file, folder.path(), &[&options[..], &rest[..]].concat()).assert_success();
        let names = [
            "lightmap_000_sh1_0.exr",
            "lightmap_000_sh1_z.exr",
            "lightmap_000_sh1_error.exr",
        ];
        let of_volume = [
            "volume.bin",
            "volume_error.bin",
            "volume_validity.bin",
            "volume.json",
            "manifest.json",
        ];
        let files = names.into_iter().chain(of_volume);
        files
            .map(|name| std::fs::read(folder.path().join(name)).expect(name))
            .collect::<Vec<_>>()
    };
    let one = all("1", "3");
    assert!(one == all("3", "3"), "threads show");
    let other = all("2", "4");
    assert!(
        one[0] != other[0] && one[3] != other[3],
        "the seed does not show"
    );
    // Four coefficients of three channels at 36 probes.
    assert_eq!(one[3].len(), 36 * 4 * 3 * 4);
}

/// What cannot be done is refused before the work, with the remedy.
#[test]
fn what_has_no_effect_or_no_room_is_refused() {
    let files = tempfile::tempdir().expect("a temporary folder");
    let file = scene_files::write(&floor(), files.path(), SUN);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let cases: [(&[&str], ExitCode, &str); 8] = [
        (
            &["--include", "ao", "--directional", "sh1"],
            ExitCode::Usage,
            "--directional",
        ),
        (
            &["--include", "ao", "--volume", "0.5"],
            ExitCode::Usage,
            "volumes hold the light",
        ),
        (&["--volume-order", "1"], ExitCode::Usage, "--volume-order"),
        (
            &["--volume-box", "0,0,0,1,1,1"],
            ExitCode::Usage,
            "--volume-box",
        ),
        (
            &["--volume", "0.5", "--volume-probes", "2x2x2"],
            ExitCode::Usage,
            "--volume-probes",
        ),
        (
            &["--volume", "0.5"],
            ExitCode::NothingToDo,
            "no extent along y",
        ),
        (
            &["--volume", "1e-9", "--volume-box", "0,0,0,1,1,1"],
            ExitCode::Usage,
            "--volume 0.00",
        ),
        (
            &["--volume", "0.5", "--volume-box", "-1,-3,-1,1,-2,1"],
            ExitCode::NothingToDo,
            "backs of faces",
        ),
    ];
    for (options, exit, word) in cases {
        let outcome = bake(&file, folder.path(), options);
        assert_eq!(outcome.exit, exit, "{options:?}: {}", outcome.stderr);
        assert!(
            outcome.stderr.contains(word),
            "{options:?}: {}",
            outcome.stderr
        );
        assert!(!folder.path().join("manifest.json").exists(), "{options:?}");
    }
}
