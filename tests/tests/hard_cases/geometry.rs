//! Geometry that touches, overlaps, leaks or turns its back, and scenes far away, huge and tiny.

use glam::{DQuat, DVec3, EulerRot};
use luxel_scenes::Scene;
use luxel_solver::form_factors::{
    AnalyticConfig, Polygon, RayCastConfig, analytic_factors, closure, ray_cast, unoccluded_matrix,
};
use luxel_solver::patches::PatchSize;
use luxel_solver::transport::Transport;
use luxel_solver::world::World;
use luxel_tests::builder::{self, Part, flipped, parallelogram, room, scene, solid_box};
use luxel_tests::command::{arg, luxel};
use luxel_tests::picture::render;
use luxel_tests::probe::Probe;
use luxel_tests::scene_files;
use std::f64::consts::PI;

/// A lamp of 0.2 m × 0.2 m below the ceiling of a unit room.
pub(super) fn lamp() -> Part {
    let corner = DVec3::new(0.4, 0.4, 0.99);
    let face = flipped(parallelogram(corner, DVec3::X * 0.2, DVec3::Y * 0.2));
    Part::lamp("lamp", 100.0, vec![face])
}

/// Irradiance in the red channel at points of a scene.
pub(super) fn probe(scene: &Scene, toml: &str, points: Vec<(DVec3, DVec3)>) -> Vec<f64> {
    let probe = Probe {
        scene,
        toml,
        points,
        arguments: Vec::new(),
    };
    probe.run(1).iter().map(|e| e.value.x).collect()
}

/// Row 6: a floor of three pieces whose edges meet in a T, at places that no binary number has.
#[test]
fn a_t_junction_neither_leaks_nor_shows() {
    const SAMPLES: f64 = 4.0;
    let turn = DQuat::from_euler(EulerRot::XYZ, 0.3, 1.1, -0.7);
    let floor = |x: [f64; 2], y: [f64; 2]| {
        let corner = DVec3::new(x[0], y[0], 0.0);
        parallelogram(corner, DVec3::X * (x[1] - x[0]), DVec3::Y * (y[1] - y[0]))
    };
    let mut faces = room(DVec3::ZERO, DVec3::ONE);
    faces.remove(4);
    faces.extend([
        floor([0.0, 1.0 / 3.0], [0.0, 1.0]),
        floor([1.0 / 3.0, 1.0], [0.0, 0.4]),
        floor([1.0 / 3.0, 1.0], [0.4, 1.0]),
    ]);
    let turned: Vec<builder::Polygon> = faces
        .iter()
        .map(|face| face.iter().map(|&v| turn * v).collect())
        .collect();
    let polygons: Vec<_> = turned
        .iter()
        .map(|f| Polygon::new(f).expect("a face"))
        .collect();
    let defect = closure(&unoccluded_matrix(&polygons, 1e-12)).largest_defect;
    assert!(defect <= 1e-9, "row sums are off by {defect:e}");

    // The picture of a furnace is one colour: 1/2 emitted, 1/2 reflected, so that B = 1.
    let glowing = Part {
        emission: luxel_scenes::Radiance::splat(0.5 / PI),
        ..Part::grey("room", 0.5, turned.clone())
    };
    let at = |x: f64, y: f64, z: f64| {
        let v = turn * DVec3::new(x, y, z);
        format!("[{}, {}, {}]", v.x, v.y, v.z)
    };
    let camera = format!(
        "[[camera]]\nname = \"main\"\nposition = {}\nlook_at = {}\nup = {}\nfov = 60\nsize = [64, 64]\n",
        at(0.4, 0.5, 0.6),
        at(1.0 / 3.0, 0.4, 0.0),
        at(0.0, 1.0, 0.0)
    );
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = scene_files::write(&scene("t", [glowing]), folder.path(), &camera);
    let picture = render(&file, &["--spp", "4"]);
    for pixel in &picture.image.pixels {
        let share = f64::from(pixel[0]) * PI;
        // One of four rays that fell through the floor would take a quarter.
        assert!((share - 1.0).abs() < 0.5 / SAMPLES, "a pixel of {share}");
    }

    // Lit inside, two-sided, in a dark room: nothing comes out below the T.
    let outer = room(DVec3::splat(-2.0), DVec3::splat(3.0));
    let place = |faces: Vec<builder::Polygon>| -> Vec<builder::Polygon> {
        let turn = |face: builder::Polygon| face.into_iter().map(|v| turn * v).collect();
        faces.into_iter().map(turn).collect()
    };
    let lamp = Part {
        faces: place(lamp().faces),
        ..lamp()
    };
    let lit = scene(
        "lit",
        [
            Part::grey("inner", 0.7, turned),
            Part::grey("outer", 0.7, place(outer)),
            lamp,
        ],
    );
    let mut points: Vec<(DVec3, DVec3)> = [[1.0 / 3.0, 0.4], [1.0 / 3.0, 0.7], [0.6, 0.4]]
        .into_iter()
        .map(|[x, y]| (turn * DVec3::new(x, y, -0.01), turn * DVec3::Z))
        .collect();
    points.push((turn * DVec3::new(0.5, 0.5, -2.0), turn * DVec3::Z));
    points.push((turn * DVec3::new(0.6, 0.6, 0.0), turn * DVec3::Z));
    let values = probe(&lit, "[material.inner]\ntwo_sided = true\n", points);
    let (inside, outside) = (values[4], &values[..4]);
    assert!(inside > 1.0, "the inner room is dark: {inside}");
    for &e in outside {
        assert!(e <= 1e-9 * inside, "{e} below the junction, {inside} above");
    }
}

/// `solve` and `probe` on a lit room, and on the same with lines appended to its geometry; the
/// warnings of the second.
fn with_and_without(more: &str) -> ([Vec<String>; 2], String) {
    let scene = scene(
        "room",
        [
            Part::grey("walls", 0.5, room(DVec3::ZERO, DVec3::ONE)),
            lamp(),
        ],
    );
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = scene_files::write(&scene, folder.path(), "");
    let points = folder.path().join("p.csv");
    std::fs::write(
        &points,
        "x,y,z,nx,ny,nz\n0.3,0.3,0,0,0,1\n0,0.5,0.5,1,0,0\n",
    )
    .expect("a writable folder");
    let table = folder.path().join("e.csv");
    let mut warnings = String::new();
    let mut results = || {
        let mut results = Vec::new();
        for options in [
            vec!["--patch-size", "0.2"],
            vec!["--patch-size", "whole", "--form-factors", "analytic"],
        ] {
            let solved = luxel(&[vec!["solve", arg(&file), "--json"], options].concat());
            solved.assert_success();
            warnings.clone_from(&solved.stderr);
            let json = solved.json();
            results.push(format!(
                "{} {} {}",
                json["patches"], json["objects"], json["energy"]
            ));
        }
        let probed = [
            "probe",
            arg(&file),
            "--points",
            arg(&points),
            "-o",
            arg(&table),
        ];
        luxel(&probed).assert_success();
        results.push(std::fs::read_to_string(&table).expect("a table"));
        results
    };
    let without = results();
    let geometry = folder.path().join("room.obj");
    let text = std::fs::read_to_string(&geometry).expect("the geometry");
    std::fs::write(&geometry, format!("{text}{more}")).expect("a writable folder");
    let with = results();
    ([without, with], warnings)
}

/// Row 7: the policy is to drop what is there before, with a warning.
#[test]
fn a_face_that_is_there_twice_counts_once() {
    // Two walls, the lamp again (corners 25 to 28), and the lamp from its third corner on.
    let more = "o walls\nusemtl walls\nf 1 2 3 4\nf 17 18 19 20\no lamp\nusemtl lamp\nf 25 26 27 28\n\
        f 27 28 25 26\n";
    let ([without, with], warnings) = with_and_without(more);
    assert_eq!(without, with, "not a bit differs");
    assert!(warnings.contains("4 face(s)"), "{warnings}");
    assert!(warnings.contains("`walls`"), "{warnings}");
}

/// Row 8.
#[test]
fn faces_without_area_change_nothing() {
    let more = "v 0.1 0.1 0.1\nv 0.2 0.2 0.2\nv 0.3 0.3 0.3\no walls\nusemtl walls\nf 29 30 31\nf 1 1 2\n\
        o lamp\nusemtl lamp\nf 25 25 25\n";
    let ([without, with], warnings) = with_and_without(more);
    assert_eq!(without, with, "not a bit differs");
    assert!(warnings.contains("3 face(s) without area"), "{warnings}");
}

/// Row 9.
#[test]
fn a_plate_that_faces_away_exchanges_nothing() {
    let plate = |is_up: bool| {
        let up = parallelogram(DVec3::new(0.25, 0.25, 0.3), DVec3::X * 0.5, DVec3::Y * 0.5);
        if is_up { up } else { flipped(up) }
    };
    let ceiling = flipped(parallelogram(DVec3::Z, DVec3::X, DVec3::Y));
    let pair = |is_up| {
        let parts = [
            Part::grey("plate", 0.5, vec![plate(is_up)]),
            Part::grey("ceiling", 0.5, vec![ceiling.clone()]),
        ];
        scene("pair", parts)
    };
    for is_up in [true, false] {
        let scene = pair(is_up);
        let world = World::new(&scene);
        let patches = world.mesh(PatchSize::Objects).expect("two patches");
        let config = AnalyticConfig {
            accuracy: 1e-11,
            points: 100,
            seed: 1,
        };
        let exact = analytic_factors(&world, &patches, &config).matrix;
        let rays = RayCastConfig {
            rays: 4096,
            seed: 1,
        };
        let cast = ray_cast(&world, &patches, &rays).factors;
        for (there, back) in [(exact.get(0, 1), exact.get(1, 0)), (cast[1], cast[2])] {
            assert_eq!(is_up, there > 0.0, "{there}");
            assert_eq!(is_up, back > 0.0, "{back}");
            assert!(there >= 0.0 && back >= 0.0, "{there} {back}");
        }
    }

    // In a lit room the back of the plate is seen, which `check` says; with two sides it does not matter
    // which is which.
    let in_room = |is_up| {
        let walls = Part::grey("walls", 0.5, room(DVec3::ZERO, DVec3::ONE));
        scene(
            "room",
            [walls, Part::grey("plate", 0.5, vec![plate(is_up)]), lamp()],
        )
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = scene_files::write(&in_room(false), folder.path(), "");
    let checked = luxel(&["check", arg(&file)]);
    assert!(
        checked.stdout.contains("`plate` is seen from behind"),
        "{}",
        checked.stdout
    );
    let solved = [true, false].map(|is_up| {
        let toml = "[material.plate]\ntwo_sided = true\n";
        let file = scene_files::write(&in_room(is_up), folder.path(), toml);
        let options = ["--form-factors", "analytic", "--solver", "direct"];
        let size = ["--patch-size", "whole", "--rays", "4096"];
        let outcome = luxel(&[&["solve", arg(&file), "--json"], &options[..], &size].concat());
        outcome.assert_success();
        let json = outcome.json();
        ["walls", "plate"].map(|object| {
            let b = &json["objects"][object]["radiosity"][0];
            b.as_f64().expect("a number")
        })
    });
    for (one, other) in solved[0].iter().zip(&solved[1]) {
        // Other lattices on the turned plate: the error of occluded pairs, 1e-4 at 4096 points.
        assert!((one / other - 1.0).abs() < 1e-4, "{one} {other}");
    }
}

/// Rows 11 and 12.
#[test]
fn neither_units_nor_origin_change_the_light() {
    let still = scene(
        "still",
        [
            Part::grey("walls", 0.5, room(DVec3::ZERO, DVec3::ONE)),
            Part::grey(
                "box",
                0.5,
                solid_box(DVec3::new(0.2, 0.3, 0.1), DVec3::splat(0.5)),
            ),
        ],
    );
    let config = AnalyticConfig {
        accuracy: 1e-12,
        points: 400,
        seed: 1,
    };
    let factors = |scene: &Scene| {
        let world = World::new(scene);
        let patches = world.mesh(PatchSize::Whole).expect("a mesh");
        let matrix = analytic_factors(&world, &patches, &config).matrix;
        let rays = RayCastConfig {
            rays: 4096,
            seed: 1,
        };
        (matrix, ray_cast(&world, &patches, &rays).factors)
    };
    let (exact, cast) = factors(&still);
    let n = exact.len();
    for (scale, offset, limit) in [(1e-6, 0.0, 1e-9), (1e6, 0.0, 1e-9), (1.0, 1e6, 1e-8)] {
        let mut moved = still.clone();
        for vertex in &mut moved.vertices {
            *vertex = *vertex * scale + DVec3::new(1.0, -1.0, 1.0) * offset;
        }
        let (matrix, rays) = factors(&moved);
        for i in 0..n {
            for j in 0..n {
                let (f, there) = (exact.get(i, j), matrix.get(i, j));
                let error = (there - f).abs();
                assert!(
                    error <= limit * f.max(1e-3),
                    "{scale}, {offset}: {there} for {f}"
                );
                // A ray or two at an edge may go to the neighbour.
                let difference = (rays[i * n + j] - cast[i * n + j]).abs();
                assert!(
                    difference <= 3.0 / 4096.0,
                    "{scale}, {offset}: {difference}"
                );
            }
            // No ray leaves the closed room, and none meets the plane that it starts from.
            let row = &rays[i * n..(i + 1) * n];
            assert!(
                (row.iter().sum::<f64>() - 1.0).abs() < 1e-12,
                "a ray is lost"
            );
            assert_eq!(row[i].to_bits(), 0, "a ray meets its own face");
        }
    }
}
