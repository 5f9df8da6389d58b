//! Geometry that touches, overlaps, leaks or turns its back, and scenes far away, huge and tiny.

use glam::{DQuat, DVec3, EulerRot};
use luxel::display::Display;
use luxel_scenes::{FaceId, Rgb, Scene, Sidedness};
use luxel_solver::form_factors::{
    AnalyticConfig, Polygon, RayCastConfig, analytic_factors, closure, ray_cast, unoccluded_matrix,
};
use luxel_solver::geometry::{Geometry, ray_origin};
use luxel_solver::patches::PatchSize;
use luxel_solver::radiosity::{self, RadiosityConfig};
use luxel_solver::solvers::{Config, Tolerance};
use luxel_solver::transport::Transport;
use luxel_solver::world::World;
use luxel_tests::builder::{self, Part, flipped, parallelogram, room, scene, solid_box};
use luxel_tests::command::{arg, luxel};
use luxel_tests::picture::render;
use luxel_tests::probe::Probe;
use luxel_tests::scene_files;
use std::f64::consts::PI;

/// A lamp of 0.2 m × 0.2 m below the ceiling of a unit room.
fn lamp() -> Part {
    let corner = DVec3::new(0.4, 0.4, 0.99);
    let face = flipped(parallelogram(corner, DVec3::X * 0.2, DVec3::Y * 0.2));
    Part::lamp("lamp", 100.0, vec![face])
}

/// Irradiance in the red channel at points of a scene.
fn probe(scene: &Scene, toml: &str, points: Vec<(DVec3, DVec3)>) -> Vec<f64> {
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

/// A lit room up to x = `ends[0]`, a dark one from x = `ends[1]` to 2, both open there, and what stands
/// between. Each has its own faces.
fn divided(ends: [f64; 2], wall: Part) -> Scene {
    let mut lit = room(DVec3::ZERO, DVec3::new(ends[0], 1.0, 1.0));
    lit.remove(1);
    let mut dark = room(DVec3::X * ends[1], DVec3::new(2.0, 1.0, 1.0));
    dark.remove(0);
    let parts = [Part::grey("lit", 0.7, lit), Part::grey("dark", 0.7, dark)];
    scene("divided", parts.into_iter().chain([lamp(), wall]))
}

/// One room up to x = 2 with something in the middle: its floor, ceiling and side walls are one face each and
/// run on below what stands on them.
fn shared(wall: Part) -> Scene {
    let whole = room(DVec3::ZERO, DVec3::new(2.0, 1.0, 1.0));
    scene("shared", [Part::grey("room", 0.7, whole), lamp(), wall])
}

/// Points on floor and far wall of the dark half, on the dividing wall from both sides at `x`, and on
/// the floor of the lit half.
fn points(x: [f64; 2]) -> Vec<(DVec3, DVec3)> {
    vec![
        (DVec3::new(1.5, 0.5, 0.0), DVec3::Z),
        (DVec3::new(x[1] + 0.001, 0.001, 0.0), DVec3::Z),
        (DVec3::new(2.0, 0.5, 0.5), -DVec3::X),
        (DVec3::new(x[1], 0.5, 0.5), DVec3::X),
        (DVec3::new(x[0], 0.5, 0.5), -DVec3::X),
        (DVec3::new(0.5, 0.5, 0.0), DVec3::Z),
    ]
}

/// Row 15.
#[test]
fn walls_that_cross_and_gaps_keep_a_room_dark() {
    let slab = |low: [f64; 3], high: [f64; 3]| {
        let faces = solid_box(DVec3::from_array(low), DVec3::from_array(high));
        Part::grey("slab", 0.7, faces)
    };
    let sheet = parallelogram(DVec3::X, DVec3::Y, DVec3::Z * (1.0 - 1e-6));
    let sides = "[material.slab]\ntwo_sided = true\n";
    for (name, ends, slab, toml, share) in [
        // The slab goes through floor, ceiling and walls.
        (
            "crossing",
            [0.9, 1.1],
            slab([0.9, -0.1, -0.1], [1.1, 1.1, 1.1]),
            "",
            1e-9,
        ),
        (
            "shared edges",
            [0.9, 1.1],
            slab([0.9, 0.0, 0.0], [1.1, 1.0, 1.0]),
            "",
            1e-9,
        ),
        (
            "gap",
            [1.0, 1.0],
            Part::grey("slab", 0.7, vec![sheet]),
            sides,
            1e-5,
        ),
    ] {
        let values = probe(&divided(ends, slab), toml, points(ends));
        let lit = values[5];
        assert!(lit > 1.0 && values[4] > 1.0, "{name}: the lit half is dark");
        for e in &values[..4] {
            assert!(*e <= share * lit, "{name}: {e} beside {lit}");
        }
    }
}

/// Walls across a shared floor: their name, the x of their sides, their faces, and whether they have two
/// sides. Those "on a line" stand where meshes of even numbers of patches have an edge.
fn walls_across() -> Vec<(&'static str, [f64; 2], Vec<builder::Polygon>, bool)> {
    let sheet = |x: f64, over: f64| {
        let corner = DVec3::new(x, -over, -over);
        let side = 1.0 + 2.0 * over;
        vec![parallelogram(corner, DVec3::Y * side, DVec3::Z * side)]
    };
    let slab = |x: [f64; 2], over: f64| {
        let high = DVec3::new(x[1], 1.0 + over, 1.0 + over);
        solid_box(DVec3::new(x[0], -over, -over), high)
    };
    let thin = [1.0, 1.0 + 1e-5];
    vec![
        ("sheet on a line", [1.0, 1.0], sheet(1.0, 0.0), true),
        ("sheet", [1.03, 1.03], sheet(1.03, 0.0), true),
        ("sheet that crosses", [1.03, 1.03], sheet(1.03, 0.1), true),
        ("thin slab", thin, slab(thin, 0.0), false),
        ("thin slab that crosses", thin, slab(thin, 0.1), false),
        ("slab", [1.0, 1.1], slab([1.0, 1.1], 0.0), false),
        (
            "slab that crosses",
            [1.03, 1.13],
            slab([1.03, 1.13], 0.1),
            false,
        ),
    ]
}

/// Rows 15 and 16, one floor for both rooms: what gather rays find.
#[test]
fn a_floor_shared_by_two_rooms_keeps_one_dark() {
    let sides = "[material.wall]\ntwo_sided = true\n";
    for (name, x, faces, is_two_sided) in walls_across() {
        let scene = shared(Part::grey("wall", 0.7, faces));
        let values = probe(&scene, if is_two_sided { sides } else { "" }, points(x));
        let lit = values[5];
        assert!(lit > 1.0 && values[4] > 1.0, "{name}: the lit half is dark");
        for e in &values[..4] {
            assert!(*e <= 1e-9 * lit, "{name}: {e} beside {lit}");
        }
    }
}

/// The same for radiosity solutions, down to one patch for both floors, and for what is drawn of them.
#[test]
fn patches_of_a_floor_shared_by_two_rooms_keep_one_dark() {
    let sizes = [0.1, 0.24, 1.0, 5.0].map(PatchSize::Length);
    for (name, x, faces, is_two_sided) in walls_across() {
        let mut scene = shared(Part::grey("wall", 0.7, faces));
        if is_two_sided {
            let wall = scene.materials.iter_mut().find(|m| m.name == "wall");
            wall.expect("a material").sidedness = Sidedness::Both;
        }
        let world = World::new(&scene);
        let geometry = world.surfaces().geometry();
        for size in sizes.into_iter().chain([PatchSize::Whole]) {
            let patches = world.mesh(size).expect("a mesh");
            let config = RadiosityConfig {
                rays: 128,
                shadow_rays: 1,
                solver: Config {
                    tolerance: Tolerance::Error(1e-6),
                    max_iterations: 1000,
                },
                seed: 1,
                replicate: 0,
            };
            let solution = radiosity::solve(&world, &patches, &config).expect("a solution");
            let exposed: Vec<bool> = patches.ids().map(|p| solution.is_exposed(p)).collect();
            let display = Display::new(&world, &patches, &exposed, |_, _| true);
            let of_patches: Vec<Rgb> = patches
                .ids()
                .map(|patch| solution.mean_irradiance(patch).0)
                .collect();
            let at_vertices = display.at_vertices(&of_patches);
            let (mut lit, mut dark) = (0.0_f64, 0.0_f64);
            for patch in patches.ids() {
                let sample = patches.sample(geometry, patch, [0.4, 0.6]);
                // Just above the surface, to tell the two sides of a wall apart.
                let above = sample.position + sample.normal * 1e-6;
                let place = geometry.frame().to_world(above);
                let inside =
                    place.cmpgt(DVec3::ZERO).all() && place.cmplt(DVec3::new(2.0, 1.0, 1.0)).all();
                let drawn = display
                    .pieces(patch)
                    .iter()
                    .flat_map(|piece| &piece.vertices)
                    .map(|&vertex| at_vertices[vertex as usize].max_element())
                    .fold(of_patches[patch.index()].max_element(), f64::max);
                if inside && place.x < x[0] {
                    lit = lit.max(drawn);
                } else if inside && place.x > x[1] {
                    dark = dark.max(drawn);
                }
            }
            assert!(lit > 1.0, "{name}, {size:?}: the lit half is dark");
            assert!(dark <= 1e-9 * lit, "{name}, {size:?}: {dark} beside {lit}");
        }
    }
}

/// Row 16: no thickness with two sides, and 1e-5 of the room.
#[test]
fn the_sides_of_a_thin_wall_are_independent() {
    const THIN: f64 = 1e-5;
    let sheet = parallelogram(DVec3::X, DVec3::Y, DVec3::Z);
    let slab = solid_box(DVec3::X, DVec3::new(1.0 + THIN, 1.0, 1.0));
    for (faces, thickness, toml) in [
        (vec![sheet], 0.0, "[material.thin]\ntwo_sided = true\n"),
        (slab, THIN, ""),
    ] {
        let scene = divided([1.0, 1.0 + thickness], Part::grey("thin", 0.7, faces));
        let values = probe(&scene, toml, points([1.0, 1.0 + thickness]));
        assert!(values[5] > 1.0 && values[4] > 1.0, "the lit half is dark");
        for e in &values[..4] {
            assert_eq!(
                e.to_bits(),
                0,
                "{thickness} thick: {e} in a sealed dark cell"
            );
        }
        let geometry = Geometry::new(&scene);
        let frame = geometry.frame();
        for face in (0..geometry.face_count()).map(FaceId::new) {
            let polygon = geometry.polygon(face);
            let centre = polygon.iter().sum::<DVec3>() / polygon.len() as f64;
            let origin = ray_origin(centre, geometry.normal(face), geometry.extent(face));
            let step = (origin.as_dvec3() - centre).length() * frame.metres_per_unit;
            assert!(step < THIN / 10.0, "a step of {step} m off face {face:?}");
        }
    }
}
