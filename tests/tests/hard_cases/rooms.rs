//! Rooms beside each other: light does not pass walls (rows 15 and 16).

use super::geometry::{lamp, probe};
use glam::DVec3;
use luxel::display::Display;
use luxel_scenes::{FaceId, Rgb, Scene, Sidedness};
use luxel_solver::geometry::{Geometry, ray_origin};
use luxel_solver::patches::PatchSize;
use luxel_solver::radiosity::{self, RadiosityConfig};
use luxel_solver::solvers::{Config, Tolerance};
use luxel_solver::world::World;
use luxel_tests::builder::{self, Part, parallelogram, room, scene, solid_box};

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
