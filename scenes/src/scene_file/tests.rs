use super::*;
use crate::camera::FieldOfView;
use crate::id::FaceId;
use crate::load::{Loaded, load};
use crate::material::{Sidedness, Specular};
use crate::radiometry::{Intensity, Irradiance, Radiance, Rgb};
use crate::sky::Sky;
use glam::DVec3;
use proptest::prelude::*;
use std::f64::consts::PI;
use std::fs;

/// A polygon and its material, so that a file has a face.
const FACE: &str = "[material.m]\nreflectance = 0.5\n[[polygon]]\nobject = \"o\"\nmaterial = \"m\"\n\
                    vertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\n";

const OBJ: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\no lamp_1\nusemtl glow\nf 1 2 3\no wall\n\
                   usemtl white\nf 3 2 1\n";
const MTL: &str = "newmtl white\nKd 0.7 0.7 0.7\nnewmtl glow\nKe 2 2 2\n";

/// Loads this text as a scene file beside `a.obj` and `a.mtl`.
fn try_scene(text: &str) -> Result<Loaded, String> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, content) in [("s.toml", text), ("a.obj", OBJ), ("a.mtl", MTL)] {
        fs::write(folder.path().join(name), content).expect("the file is written");
    }
    let prefix = format!("{}/", folder.path().display());
    load(folder.path().join("s.toml")).map_err(|e| e.to_string().replace(&prefix, ""))
}

fn scene(text: &str) -> Loaded {
    try_scene(text).unwrap_or_else(|error| panic!("{text}\n{error}"))
}

fn light(lines: &str) -> LightKind {
    let loaded = scene(&format!("{FACE}[[light]]\n{lines}\n"));
    loaded
        .scene
        .lights
        .into_iter()
        .next()
        .expect("there is a light")
        .kind
}

#[test]
fn polygons_are_faces_in_f64() {
    let loaded = scene(FACE);
    assert_eq!(loaded.warnings, []);
    assert_eq!(loaded.scene.name, "s");
    assert_eq!(loaded.scene.vector_area(FaceId(0)), DVec3::Z);
    assert_eq!(loaded.scene.objects[0].name, "o");
}

#[test]
fn scale_applies_to_every_length() {
    let text = format!(
        "geometry = [\"a.obj\"]\n[scene]\nscale = 0.001\nname = \"n\"\n{FACE}\
         [[camera]]\nposition = [0, 0, 1000]\nlook_at = [0, 0, 0]\nheight = 2000\n\
         [[light]]\nkind = \"point\"\nposition = [0, 500, 0]\nwatts = 1\n"
    );
    let scene = scene(&text).scene;
    assert_eq!(scene.name, "n");
    assert_eq!(scene.polygon(FaceId(0)).nth(1), Some(DVec3::X * 0.001));
    assert_eq!(scene.polygon(FaceId(2)).nth(1), Some(DVec3::X * 0.001));
    assert_eq!(scene.cameras[0].position, DVec3::Z);
    assert_eq!(
        scene.cameras[0].projection,
        Projection::Orthographic { height: 2.0 }
    );
    let LightKind::Point { position, .. } = scene.lights[0].kind else {
        panic!("a point light");
    };
    assert_eq!(position, DVec3::Y * 0.5);
}

#[test]
fn z_up_is_the_default_of_cameras_and_skies_only() {
    let text = format!(
        "[scene]\nup = \"z\"\n{FACE}[[camera]]\nposition = [5, 0, 0]\nlook_at = [0, 0, 0]\n\
         [[light]]\nkind = \"sky\"\nmodel = \"uniform\"\nradiance = 1\n"
    );
    let scene = scene(&text).scene;
    assert_eq!(scene.vector_area(FaceId(0)), DVec3::Z, "coordinates stay");
    assert_eq!(scene.cameras[0].up, DVec3::Z);
    assert!(matches!(
        scene.lights[0].kind,
        LightKind::Sky { up: DVec3::Z, .. }
    ));
}

#[test]
fn materials_override_the_geometry_file() {
    let text = "geometry = [\"a.obj\"]\n[material.white]\nreflectance = [0.1, 0.2, 0.3]\n\
                emission = 3\ntwo_sided = true\nmirror = 0.5\n";
    let scene = scene(text).scene;
    let white = scene.material(FaceId(1));
    assert_eq!(white.reflectance, Reflectance::new(0.1, 0.2, 0.3));
    assert_eq!(white.emission, Radiance::splat(3.0));
    assert_eq!(white.sidedness, Sidedness::Both);
    assert_eq!(
        white.specular,
        Specular::Mirror {
            reflectance: Rgb::splat(0.5)
        }
    );
    assert_eq!(
        scene.material(FaceId(0)).emission,
        Radiance::splat(2.0),
        "others stay"
    );
}

#[test]
fn glass_and_gloss_are_read() {
    let specular = |lines: &str| {
        let text = FACE.replace("reflectance = 0.5", lines);
        scene(&text).scene.materials[0].specular
    };
    let glass = Specular::Glass {
        index_of_refraction: 1.5,
        transmittance: Rgb::splat(0.9),
    };
    assert_eq!(specular("glass = 1.5\ntransmittance = 0.9"), glass);
    let glossy = Specular::Glossy {
        reflectance: Rgb::splat(0.1),
        exponent: 40.0,
    };
    assert_eq!(specular("glossy = 0.1\nexponent = 40"), glossy);
    assert_eq!(specular("mirror = 0"), Specular::None);
}

#[test]
fn objects_are_matched_by_pattern() {
    let text = "geometry = [\"a.obj\"]\n[object.\"lamp*\"]\nmaterial = \"white\"\n";
    let loaded = scene(text);
    assert_eq!(loaded.scene.material(FaceId(0)).name, "white");
    assert_eq!(loaded.warnings, []);
}

#[test]
fn sections_that_apply_to_nothing_are_warned_of() {
    let text = "geometry = [\"a.obj\"]\n[object.\"lmap*\"]\nmaterial = \"white\"\n\
                [material.whit]\nreflectance = 0.5\n";
    let texts: Vec<String> = scene(text)
        .warnings
        .iter()
        .map(ToString::to_string)
        .collect();
    assert!(
        texts[0].contains("s.toml:2: [object] applies to nothing: `lmap*`"),
        "{texts:?}"
    );
    assert!(texts[1].contains("[material] applies to nothing: `whit`; did you mean `white`?"));
}

#[test]
fn two_geometry_files_become_one_scene() {
    let scene = scene("geometry = [\"a.obj\", \"a.obj\"]\n").scene;
    let names: Vec<&str> = scene.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["lamp_1", "wall", "lamp_1.2", "wall.2"]);
}

#[test]
fn cameras_have_angles_along_either_axis() {
    let camera = |lines: &str| {
        let text =
            format!("{FACE}[[camera]]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\n{lines}\n");
        scene(&text).scene.cameras.remove(0)
    };
    let plain = camera("");
    assert_eq!(plain.name, "camera");
    assert_eq!((plain.up, plain.size), (DVec3::Y, [512, 512]));
    let fov = FieldOfView::Vertical(PI / 2.0);
    assert_eq!(
        camera("fov = 90\nfov_axis = \"y\"").projection,
        Projection::Perspective { fov }
    );
    let fov = FieldOfView::Horizontal(PI / 2.0);
    assert_eq!(
        camera("fov = 90.0").projection,
        Projection::Perspective { fov }
    );
    assert_eq!(camera("size = [640, 480]").size, [640, 480]);
}

#[test]
fn point_lights_have_the_intensity_of_their_flux() {
    let intensity =
        |lines: &str| match light(&format!("kind = \"point\"\nposition = [0, 1, 0]\n{lines}")) {
            LightKind::Point { intensity, .. } => intensity,
            other => panic!("a point light, not {other:?}"),
        };
    assert_eq!(intensity("candela = 800"), Intensity::splat(800.0));
    assert_eq!(
        intensity("watts_per_steradian = [1, 2, 3]"),
        Intensity::new(1.0, 2.0, 3.0)
    );
    assert_eq!(
        intensity("lumens = 10\ncolor = [1, 0.5, 0]").0,
        Rgb::new(1.0, 0.5, 0.0) * 10.0 / (4.0 * PI)
    );
    assert_eq!(intensity("watts = 10").0, Rgb::splat(10.0 / (4.0 * PI)));
}

/// The flux of a spot is the integral of its falloff over the sphere, here by midpoints.
#[test]
fn spots_have_the_intensity_of_their_flux() {
    let lines = "kind = \"spot\"\nposition = [0, 1, 0]\ndirection = [0, -2, 0]\nlumens = 100\n\
                 inner_angle = 20\nouter_angle = 40";
    let LightKind::Spot {
        direction,
        intensity,
        inner_angle,
        outer_angle,
        ..
    } = light(lines)
    else {
        panic!("a spot");
    };
    assert_eq!(direction, -DVec3::Y);
    let (inner, outer) = (inner_angle.cos(), outer_angle.cos());
    let steps = 100_000;
    let flux: f64 = (0..steps)
        .map(|i| outer + (1.0 - outer) * (f64::from(i) + 0.5) / f64::from(steps))
        .map(|cosine| ((cosine - outer) / (inner - outer)).clamp(0.0, 1.0).powi(2))
        .sum::<f64>()
        * (1.0 - outer)
        / f64::from(steps)
        * 2.0
        * PI
        * intensity.0.x;
    // The midpoint rule on 1e5 steps of a function with a kink.
    assert!((flux - 100.0).abs() < 1e-3, "{flux}");
}

#[test]
fn suns_and_skies_are_read_in_both_systems() {
    let sun = light("kind = \"directional\"\ndirection = [0, -3, 0]\nlux = 100000");
    let irradiance = Irradiance::splat(100_000.0);
    assert_eq!(
        sun,
        LightKind::Directional {
            direction: -DVec3::Y,
            irradiance
        }
    );
    let sky = |lines: &str| match light(&format!("kind = \"sky\"\n{lines}")) {
        LightKind::Sky { sky, .. } => sky,
        other => panic!("a sky, not {other:?}"),
    };
    let radiance = Radiance::splat(2.0);
    assert_eq!(
        sky("model = \"uniform\"\nnits = 2"),
        Sky::Uniform { radiance }
    );
    // The level ground under an overcast sky: E = 7π/9 of the zenith's radiance, by midpoints.
    let overcast = sky("model = \"cie-overcast\"\nlux = 10000");
    let steps = 10_000;
    let ground: f64 = (0..steps)
        .map(|i| (f64::from(i) + 0.5) / f64::from(steps))
        .map(|sine| {
            overcast
                .radiance(DVec3::new((1.0 - sine * sine).sqrt(), sine, 0.0), DVec3::Y)
                .0
                .x
                * sine
                * 2.0
                * PI
                / f64::from(steps)
        })
        .sum();
    assert!((ground / 10_000.0 - 1.0).abs() < 1e-6, "{ground}");
}

/// A Lambertian source of flux Φ has Φ/π in its direction.
#[test]
fn lambertian_sources_have_the_intensity_of_their_flux() {
    let lines = "kind = \"point\"\ndistribution = \"lambertian\"\nposition = [0, 1, 0]\n\
                 direction = [0, -2, 0]\nlumens = 100";
    let LightKind::Lambertian {
        direction,
        intensity,
        ..
    } = light(lines)
    else {
        panic!("a Lambertian source");
    };
    assert_eq!(direction, -DVec3::Y);
    assert_eq!(intensity, Intensity::splat(100.0 / PI));
}

/// East is +x, whichever of y and z is up, and the sun rises there.
#[test]
fn suns_stand_by_the_compass() {
    let sun = |up: &str, azimuth: f64| {
        let text = format!(
            "[scene]\nup = \"{up}\"\n{FACE}[[light]]\nkind = \"directional\"\nelevation = 30\n\
             azimuth = {azimuth}\nlux = 1\n"
        );
        match scene(&text).scene.lights[0].kind {
            LightKind::Directional { direction, .. } => -direction,
            ref other => panic!("a sun, not {other:?}"),
        }
    };
    let cos = 30f64.to_radians().cos();
    for (up, azimuth, expected) in [
        ("z", 0.0, DVec3::new(0.0, cos, 0.5)),
        ("z", 90.0, DVec3::new(cos, 0.0, 0.5)),
        ("y", 0.0, DVec3::new(0.0, 0.5, -cos)),
        ("y", 90.0, DVec3::new(cos, 0.5, 0.0)),
    ] {
        let error = (sun(up, azimuth) - expected).length();
        assert!(error < 1e-15, "{up} {azimuth}: off by {error}");
    }
    let turned =
        light("kind = \"directional\"\nelevation = 0\nazimuth = 0\nnorth = [1, 5, 0]\nlux = 1");
    assert!(
        matches!(turned, LightKind::Directional { direction, .. } if direction == DVec3::NEG_X)
    );
}

/// Every model gives the level ground what the file says, and the ground its share of it.
#[test]
fn skies_light_the_ground_as_written() {
    for model in [
        "\"uniform\"",
        "\"cie-overcast\"",
        "\"cie-clear\"\nsun_elevation = 40\nsun_azimuth = 10",
        "\"cie-general\"\ntype = 5",
        "\"cie-general\"\ntype = 15\nsun_elevation = 20\nsun_azimuth = 0",
    ] {
        let lines = format!("kind = \"sky\"\nmodel = {model}\nlux = 800\nground_reflectance = 0.2");
        let LightKind::Sky { sky, ground, .. } = light(&lines) else {
            panic!("a sky");
        };
        // A few roundings.
        let level = sky.ground_irradiance().0;
        assert!((level / 800.0 - Rgb::ONE).length() < 1e-14, "{model}");
        assert!(
            (ground.0 * PI / 160.0 - Rgb::ONE).length() < 1e-14,
            "{model}"
        );
    }
}

#[test]
fn keys_of_suns_and_skies_that_have_no_effect_are_refused() {
    for (lines, expected) in [
        (
            "kind = \"sky\"\nmodel = \"cie-general\"\nlux = 1",
            "has no `type`",
        ),
        (
            "kind = \"sky\"\nmodel = \"cie-general\"\ntype = 16\nlux = 1",
            "from 1 to 15",
        ),
        (
            "kind = \"sky\"\nmodel = \"cie-general\"\ntype = 1.5\nlux = 1",
            "from 1 to 15",
        ),
        (
            "kind = \"sky\"\nmodel = \"cie-clear\"\nlux = 1",
            "has no `sun_elevation`",
        ),
        (
            "kind = \"sky\"\nmodel = \"cie-clear\"\nsun_elevation = -1\nsun_azimuth = 0\nlux = 1",
            "from 0 to 90 degrees",
        ),
        (
            "kind = \"sky\"\nmodel = \"uniform\"\ntype = 3\nlux = 1",
            "`type` needs",
        ),
        (
            "kind = \"sky\"\nmodel = \"cie-overcast\"\nsun_azimuth = 3\nlux = 1",
            "`sun_azimuth` needs",
        ),
        (
            "kind = \"sky\"\nmodel = \"uniform\"\nground_reflectance = 1\nlux = 1",
            "at least 0 and below 1",
        ),
        (
            "kind = \"directional\"\ndirection = [1, 0, 0]\nelevation = 3\nlux = 1",
            "cannot stand beside",
        ),
        (
            "kind = \"directional\"\ndirection = [1, 0, 0]\nazimuth = 3\nlux = 1",
            "needs `elevation`",
        ),
        (
            "kind = \"directional\"\nelevation = 3\nazimuth = 3\nnorth = [0, 1, 0]\nlux = 1",
            "`north` has no direction",
        ),
        (
            "kind = \"point\"\nposition = [0, 0, 0]\ndirection = [0, 0, 1]\nlumens = 1",
            "`direction` needs",
        ),
    ] {
        let error = try_scene(&format!("{FACE}[[light]]\n{lines}\n")).expect_err(lines);
        assert!(error.contains(expected), "{lines}: {error}");
    }
}

#[test]
fn environments_load_their_image() {
    let error = try_scene(&format!(
        "{FACE}[[light]]\nkind = \"environment\"\nimage = \"none.hdr\"\nradiance = 1\n"
    ))
    .expect_err("there is no image");
    assert!(error.starts_with("s.toml:9: no such image"), "{error}");
}

#[test]
fn units_follow_what_shines() {
    let candela = "[[light]]\nkind = \"point\"\nposition = [0, 1, 0]\ncandela = 683\n";
    let geometry = "geometry = [\"a.obj\"]\n";
    let all_photometric = scene(&format!("{FACE}{candela}")).scene;
    assert_eq!(all_photometric.units, UnitSystem::Photometric);
    assert_eq!(scene(geometry).scene.units, UnitSystem::Radiometric);
    let declared = format!("{geometry}[scene]\nunits = \"photometric\"\n{candela}");
    let declared = scene(&declared);
    assert_eq!(declared.scene.units, UnitSystem::Photometric);
    assert_eq!(declared.warnings, []);
    assert_eq!(
        declared.scene.material(FaceId(0)).emission,
        Radiance::splat(2.0)
    );

    let mixed = scene(&format!("{geometry}{candela}"));
    assert_eq!(mixed.scene.units, UnitSystem::Radiometric);
    let LightKind::Point { intensity, .. } = mixed.scene.lights[0].kind else {
        panic!("a point light");
    };
    assert_eq!(intensity, Intensity::splat(1.0), "683 lm are 1 W");
    assert!(matches!(
        mixed.warnings[..],
        [Warning::MixedUnits { count: 1, .. }]
    ));
}

/// Lines, the one among them that is wrong, and what the message says.
const WRONG: &[(&str, usize, &str)] = &[
    (
        "[[camra]]\n",
        1,
        "unknown key `camra`; did you mean `camera`?",
    ),
    (
        "[[camera]]\npostion = [0, 0, 0]\n",
        2,
        "unknown key `postion`; did you mean `position`?",
    ),
    (
        "[[camera]]\nlook_at = [0, 0, 0]\n",
        1,
        "has no `position`; add",
    ),
    (
        "[[camera]]\nposition = [1, 0, 0]\nlook_at = [1, 0, 0]\n",
        3,
        "looks at its own position",
    ),
    (
        "[[camera]]\nposition = [0, 9, 0]\nlook_at = [0, 0, 0]\n",
        3,
        "parallel to the view",
    ),
    (
        "[[camera]]\nposition = [0, 0, 9]\nlook_at = [0, 0, 0]\nfov = 180\n",
        4,
        "between 0 and 180",
    ),
    (
        "[[camera]]\nposition = [0, 0, 9]\nlook_at = [0, 0, 0]\nsize = [0, 5]\n",
        4,
        "whole number",
    ),
    (
        "[[camera]]\nposition = [0, nan, 9]\nlook_at = [0, 0, 0]\n",
        2,
        "must be finite",
    ),
    (
        "[[light]]\nkind = \"pint\"\n",
        2,
        "`pint`; did you mean `point`?",
    ),
    (
        "[[light]]\nkind = \"point\"\nposition = [0, 0, 0]\n",
        1,
        "exactly one of candela",
    ),
    (
        "[[light]]\nkind = \"point\"\nposition = [0, 0, 0]\nwatts = 1\nlumens = 1\n",
        1,
        "lumens and watts",
    ),
    (
        "[[light]]\nkind = \"point\"\nposition = [0, 0, 0]\nwatts = -1\n",
        4,
        "at least 0",
    ),
    (
        "[[light]]\nkind = \"point\"\nposition = [0, 0, 0]\nlux = 1\n",
        4,
        "unknown key `lux`",
    ),
    (
        "[[light]]\nkind = \"directional\"\ndirection = [0, 0, 0]\nlux = 1\n",
        3,
        "other than zero",
    ),
    ("[material.x]\nreflectance = 1\n", 2, "below 1"),
    (
        "[material.x]\nreflectance = [0.5, -0.1, 0]\n",
        2,
        "at least 0",
    ),
    (
        "[material.x]\nreflectance = [0.5, 0.1]\n",
        2,
        "must be a number or [red, green, blue]",
    ),
    ("[material.x]\nemission = -1\n", 2, "at least 0"),
    ("[material.x]\nemission = inf\n", 2, "finite"),
    (
        "[material.x]\nexponent = 3\n",
        2,
        "`exponent` needs `glossy`",
    ),
    (
        "[material.x]\nmirror = 1\nglass = 1.5\n",
        1,
        "exactly one of mirror, glass, glossy",
    ),
    ("[object.\"o\"]\nmaterial = \"n\"\n", 2, "no material `n`"),
    ("[object.\"a**b\"]\n", 1, "not a pattern"),
    (
        "[[polygon]]\nmaterial = \"m\"\nvertices = [[0, 0, 0], [1, 0, 0], [2, 0, 0]]\n",
        3,
        "has no area",
    ),
    (
        "[[polygon]]\nmaterial = \"m\"\nvertices = [[0, 0, 0], [9, 0, 0], [1, 1, 0], [0, 9, 0]]\n",
        3,
        "not convex",
    ),
    (
        "[[polygon]]\nmaterial = \"m\"\nvertices = [[0, 0, 0], [9, 0, 0], [9, 9, 5], [0, 9, 0]]\n",
        3,
        "not flat",
    ),
    ("[scene]\nscale = 0\n", 2, "above 0"),
    ("[scene]\nup = \"x\"\n", 2, "one of y, z"),
    ("[scene\n", 1, "not valid TOML"),
];

#[test]
fn errors_name_the_line_the_key_and_the_remedy() {
    let face_end = FACE.lines().count();
    for &(lines, line, part) in WRONG {
        let error = try_scene(&format!("{FACE}{lines}")).expect_err(lines);
        assert!(
            error.starts_with(&format!("s.toml:{}: ", face_end + line)),
            "{lines}{error}"
        );
        assert!(error.contains(part), "{lines}{error}");
    }
}

#[test]
fn geometry_that_is_missing_or_none_is_named() {
    let error = try_scene("\ngeometry = [\"b.obj\"]\n").expect_err("there is no such file");
    assert!(
        error.starts_with("s.toml:2: no such file: b.obj"),
        "{error}"
    );
    let error = try_scene("geometry = [\"b.stl\"]\n").expect_err("not a format");
    assert!(
        error.contains("b.stl is not geometry by its extension"),
        "{error}"
    );
}

/// A reflectance of one is wrong in the library, and right once the scene file lowers it.
#[test]
fn reflectances_are_checked_after_overriding() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("a.obj");
    fs::write(&file, OBJ).expect("the file is written");
    fs::write(
        folder.path().join("a.mtl"),
        "newmtl white\nKd 1 1 1\nnewmtl glow\nKe 1 1 1\n",
    )
    .expect("the file is written");
    let error = load(&file)
        .expect_err("a surface that absorbs nothing")
        .to_string();
    assert!(
        error.contains("a.mtl:1: material `white`: Kd = [1.0, 1.0, 1.0]"),
        "{error}"
    );
    assert!(error.contains("at most 0.98"), "{error}");
    fs::write(
        folder.path().join("a.toml"),
        "[material.white]\nreflectance = 0.9\n",
    )
    .expect("the file is written");
    let loaded = load(&file).expect("the reflectance is overridden");
    assert_eq!(
        loaded.scene.material(FaceId(1)).reflectance,
        Reflectance::splat(0.9)
    );

    fs::write(
        folder.path().join("a.mtl"),
        "newmtl white\nKd 0 0 0\nnewmtl glow\nKe 1 -1 1\n",
    )
    .expect("the file is written");
    let error = load(&file).expect_err("negative emission").to_string();
    assert!(
        error.contains("material `glow`: Ke = [1.0, -1.0, 1.0] is not a finite"),
        "{error}"
    );
}

#[test]
fn vertices_beyond_computing_are_refused() {
    let text = format!("[scene]\nscale = 1e30\n{FACE}");
    let error = try_scene(&text).expect_err("too far away");
    assert!(
        error.contains("object `o` lies 1e30 m from the origin"),
        "{error}"
    );
}

#[test]
fn a_scene_without_faces_is_warned_of() {
    assert!(matches!(scene("").warnings[..], [Warning::NoFaces { .. }]));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Whatever bytes stand in the file, reading ends in a scene or an error.
    #[test]
    fn no_bytes_make_the_reader_panic(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), any::<bool>()), 1..10),
    ) {
        const WORDS: [&str; 10] =
            ["nan", "[", "]]", "1e308", "-", "\n", "= ", "\"", "[[light]]\n", "0x7fffffffffffffff"];
        let mut text = format!(
            "geometry = [\"a.obj\"]\n[scene]\nscale = 2\n{FACE}[[camera]]\nposition = [0, 0, 5]\n\
             look_at = [0, 0, 0]\nfov = 40\n[[light]]\nkind = \"spot\"\nposition = [0, 1, 0]\n\
             direction = [0, -1, 0]\nlumens = 100\nouter_angle = 40\n[object.\"o\"]\nmaterial = \"m\"\n"
        ).into_bytes();
        for (at, byte, replaces) in edits {
            let at = at.index(text.len());
            if replaces {
                text[at] = byte;
            } else {
                text.splice(at..at, WORDS[usize::from(byte) % WORDS.len()].bytes());
            }
        }
        let _ = try_scene(&String::from_utf8_lossy(&text));
    }
}
