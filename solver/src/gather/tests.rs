//! The pipeline from rows to gather on scenes with a known answer.

use super::{Components, GatherConfig, Gathered, Key, Lookup, SkyRays, Solutions, finish, gather};
use crate::bounces::Bounces;
use crate::patches::PatchSize;
use crate::radiosity::{RadiosityConfig, RadiositySolution, solve, solve_partial};
use crate::solvers::{Config, Tolerance};
use crate::world::World;
use glam::DVec3;
use luxel_scenes::{
    Intensity, Irradiance, Light, LightKind, Material, Radiance, Reflectance, Rgb, Scene, Sky,
};
use std::f64::consts::PI;

const CONFIG: GatherConfig = GatherConfig {
    rays: 256,
    shadow_rays: 64,
    rays_before: 0,
    sky: SkyRays::Gather,
    gathers: 4,
    solutions: Solutions::All,
    components: Components::All,
    seed: 3,
};

const DIRECT: GatherConfig = GatherConfig {
    components: Components::Direct,
    ..CONFIG
};

fn solutions(
    world: &World,
    patches: &crate::patches::Patches,
    rays: usize,
) -> Vec<RadiositySolution> {
    (0..4)
        .map(|replicate| {
            let config = RadiosityConfig {
                rays,
                shadow_rays: 4,
                solver: Config {
                    tolerance: Tolerance::Error(1e-9),
                    max_iterations: 10_000,
                },
                seed: 3,
                replicate,
            };
            solve(world, patches, &config).expect("reflectances are below one")
        })
        .collect()
}

fn push_box(scene: &mut Scene, lower: DVec3, upper: DVec3, inwards: bool, material: Material) {
    let object = scene.push_object(material.name.clone());
    let material = scene.push_material(material);
    for axis in 0..3 {
        for high in [false, true] {
            let corner = |u: bool, v: bool| {
                let mut p = lower;
                p[axis] = if high { upper[axis] } else { lower[axis] };
                p[(axis + 1) % 3] = if u { upper } else { lower }[(axis + 1) % 3];
                p[(axis + 2) % 3] = if v { upper } else { lower }[(axis + 2) % 3];
                p
            };
            let mut face = [
                corner(false, false),
                corner(true, false),
                corner(true, true),
                corner(false, true),
            ];
            if high == inwards {
                face.reverse();
            }
            scene.push_face(&face, object, material);
        }
    }
}

fn grey(name: &str, rho: f64, radiance: f64) -> Material {
    Material::diffuse(name, Reflectance::splat(rho)).with_emission(Radiance::splat(radiance))
}

fn gather_at(
    scene: &Scene,
    points: &[(DVec3, DVec3)],
    size: PatchSize,
    config: &GatherConfig,
) -> Vec<Gathered> {
    let world = World::new(scene);
    let patches = world.mesh(size).expect("meshes");
    let solutions = solutions(&world, &patches, 32);
    let (positions, normals): (Vec<_>, Vec<_>) = points.iter().copied().unzip();
    let receivers = world.receivers(&positions, &normals);
    let keys: Vec<Key> = (0..points.len() as u64).map(Key::of).collect();
    let lookup = Lookup::new(patches, &solutions);
    finish(&gather(&world, Some(&lookup), &receivers, &keys, config))
}

/// A closed box of uniform emission L and reflectance ρ: L / (1 − ρ) everywhere, so that every
/// sample has the same value and only rounding is left.
#[test]
fn a_furnace_is_exact_to_rounding() {
    let mut scene = Scene::default();
    push_box(
        &mut scene,
        DVec3::ZERO,
        DVec3::new(1.0, 2.0, 3.0),
        true,
        grey("glow", 0.5, 1.0),
    );
    let points = [
        (DVec3::new(0.3, 0.0, 1.0), DVec3::Y),
        (
            DVec3::new(0.5, 1.0, 1.5),
            DVec3::new(1.0, 2.0, -0.5).normalize(),
        ),
    ];
    for gathered in gather_at(&scene, &points, PatchSize::Length(0.5), &CONFIG) {
        let expected = PI / (1.0 - 0.5);
        let error = (gathered.irradiance().0 - Rgb::splat(expected))
            .abs()
            .max_element();
        // The solver's tolerance of 1e-9 of max B = 2π, and half a unit of single precision in what
        // is looked up; the near chain's Russian roulette is exact in the mean only, within 5
        // standard errors.
        let allowed = 1e-8
            + expected * f64::from(f32::EPSILON) / 2.0
            + 5.0 * gathered.standard_error().0.max_element();
        assert!(error < allowed, "{error} {allowed}");
        assert!(gathered.standard_error().0.max_element() < 0.03 * expected);
    }
}

/// What a gather of so many bounces finds at points, with a second mesh beside the first.
fn gather_bounces(
    scene: &Scene,
    points: &[(DVec3, DVec3)],
    size: PatchSize,
    bounces: u32,
    config: &GatherConfig,
) -> Vec<Gathered> {
    let world = World::new(scene);
    let (positions, normals): (Vec<_>, Vec<_>) = points.iter().copied().unzip();
    let receivers = world.receivers(&positions, &normals);
    let keys: Vec<Key> = (0..points.len() as u64).map(Key::of).collect();
    let partial = |patches: &crate::patches::Patches| -> Vec<RadiositySolution> {
        let config = |replicate| RadiosityConfig {
            rays: 64,
            shadow_rays: 4,
            solver: Config {
                tolerance: Tolerance::Error(1e-9),
                max_iterations: 1,
            },
            seed: 3,
            replicate,
        };
        let orders = super::orders(Bounces::AtMost(bounces));
        let solve = |r| solve_partial(&world, patches, bounces, orders, &config(r));
        (0..4).map(|r| solve(r).expect("a system")).collect()
    };
    let lookup = (bounces > 0).then(|| {
        let fine = world.mesh(size).expect("meshes");
        let coarse = world.mesh(PatchSize::Whole).expect("meshes");
        let (on_fine, on_coarse) = (partial(&fine), partial(&coarse));
        Lookup::new(fine, &on_fine).with_coarse(coarse, &on_coarse)
    });
    let components = config.components.within(Bounces::AtMost(bounces));
    let config = GatherConfig {
        components: components.expect("direct light at least"),
        ..*config
    };
    finish(&gather(&world, lookup.as_ref(), &receivers, &keys, &config))
}

/// In the furnace of emission M light after at most N bounces is M Σ_{k ≤ N} ρ^k everywhere, whatever is looked up and whatever gone
/// on from: on whole walls nearly every hit is near, and chains go on for as many links as there are bounces.
#[test]
fn bounces_are_counted_exactly() {
    let rho: f64 = 0.7;
    let mut scene = Scene::default();
    push_box(
        &mut scene,
        DVec3::ZERO,
        DVec3::new(1.0, 2.0, 3.0),
        true,
        grey("glow", rho, 1.0),
    );
    let points = [
        (DVec3::new(0.3, 0.0, 1.0), DVec3::Y),
        (
            DVec3::new(0.5, 1.0, 1.5),
            DVec3::new(1.0, 2.0, -0.5).normalize(),
        ),
    ];
    for size in [PatchSize::Length(0.3), PatchSize::Whole] {
        for bounces in [0, 1, 2, 3, 4, 30, 1_000_000] {
            let expected: f64 = (0..=bounces.min(200))
                .map(|k| PI * rho.powf(f64::from(k)))
                .sum();
            for gathered in gather_bounces(&scene, &points, size, bounces, &CONFIG) {
                let error = (gathered.irradiance().0 - Rgb::splat(expected))
                    .abs()
                    .max_element();
                // Rounding of single precision in what is looked up, and of a few hundred additions. Chains show what the
                // solution does, so that roulette makes no noise.
                let allowed = expected * (f64::from(f32::EPSILON) + 1e-12);
                assert!(
                    error <= allowed,
                    "{size:?}, {bounces} bounces: {} for {expected}",
                    gathered.irradiance().0.x
                );
                // Direct light is listed apart from what was reflected.
                assert!((gathered.direct.0.x - PI).abs() < 1e-12);
            }
        }
    }
}

/// Below a sky, whose light rays find, partial sums rise to the whole: each bounce adds less than ρ of the one before.
#[test]
fn partial_sums_of_a_sky_rise_to_the_whole() {
    let mut scene = Scene::default();
    push_box(
        &mut scene,
        DVec3::ZERO,
        DVec3::new(1.0, 1.0, 1.0),
        true,
        grey("room", 0.5, 0.0),
    );
    // Without its ceiling.
    scene.faces.remove(3);
    scene.lights.push(Light {
        name: "sky".into(),
        kind: LightKind::Sky {
            sky: Sky::Uniform {
                radiance: Radiance::splat(1.0),
            },
            up: DVec3::Y,
            ground: Radiance::ZERO,
        },
    });
    let points = [(DVec3::new(0.4, 0.0, 0.6), DVec3::Y)];
    let config = GatherConfig {
        rays: 16_384,
        ..CONFIG
    };
    let sums: Vec<Gathered> = (0..6)
        .map(|n| gather_bounces(&scene, &points, PatchSize::Length(0.2), n, &config)[0])
        .collect();
    let all = gather_at(&scene, &points, PatchSize::Length(0.2), &config)[0];
    let value = |gathered: &Gathered| gathered.irradiance().0.x;
    let noise = 5.0 * sums[5].standard_error().0.x.hypot(all.standard_error().0.x);
    for pair in sums.windows(3) {
        let [first, second] = [
            value(&pair[1]) - value(&pair[0]),
            value(&pair[2]) - value(&pair[1]),
        ];
        assert!(first > 0.0 && second > 0.0, "{sums:?}");
        assert!(second < 0.5 * first + noise, "{sums:?}");
    }
    // What is left after five is less than a fifth step and all that may follow it.
    let last = value(&sums[5]) - value(&sums[4]);
    let left = value(&all) - value(&sums[5]);
    assert!(left.abs() < last + noise, "{left} is left after {last}");
    // Small enough that a bounce too many or too few would show.
    let first = value(&sums[1]) - value(&sums[0]);
    assert!(noise < 0.5 * first, "{noise} of {first}");
}

/// Under a point light alone the direct part is I cos θ / r², whatever the frame's scale.
#[test]
fn a_point_light_falls_with_the_square_of_the_distance() {
    let mut scene = Scene::default();
    push_box(
        &mut scene,
        DVec3::ZERO,
        DVec3::splat(40.0),
        true,
        grey("black", 0.0, 0.0),
    );
    scene.lights.push(Light {
        name: "lamp".into(),
        kind: LightKind::Point {
            position: DVec3::new(20.0, 30.0, 20.0),
            intensity: Intensity::splat(800.0),
        },
    });
    let points = [
        (DVec3::new(20.0, 0.0, 20.0), DVec3::Y),
        (DVec3::new(10.0, 0.0, 20.0), DVec3::Y),
    ];
    let gathered = gather_at(&scene, &points, PatchSize::Length(10.0), &CONFIG);
    let expected = [800.0 / 900.0, 800.0 * 30.0 / 1000f64.powf(1.5)];
    for (gathered, expected) in gathered.iter().zip(expected) {
        // Coordinates are exact; five roundings.
        assert!((gathered.irradiance().0.x / expected - 1.0).abs() < 1e-14);
        assert_eq!(gathered.standard_error(), Irradiance::ZERO);
    }
}

/// A uniform sky over a black floor: E = π L at an upward receiver, and half of it seen edge-on.
#[test]
fn a_uniform_sky_fills_the_hemisphere() {
    let mut scene = Scene::default();
    let object = scene.push_object("floor");
    let material = scene.push_material(grey("floor", 0.0, 0.0));
    let v = |x: f64, z: f64| DVec3::new(x, 0.0, z);
    scene.push_face(
        &[v(-1.0, -1.0), v(-1.0, 1.0), v(1.0, 1.0), v(1.0, -1.0)],
        object,
        material,
    );
    scene.lights.push(Light {
        name: "sky".into(),
        kind: LightKind::Sky {
            sky: Sky::Uniform {
                radiance: Radiance::splat(2.0),
            },
            up: DVec3::Y,
            ground: Radiance::ZERO,
        },
    });
    let points = [
        (DVec3::ZERO, DVec3::Y),
        (DVec3::new(0.0, 0.5, 0.0), DVec3::X),
    ];
    let gathered = gather_at(&scene, &points, PatchSize::Whole, &CONFIG);
    // No direction upwards is blocked: every ray carries the same value.
    assert!((gathered[0].irradiance().0.x - 2.0 * PI).abs() < 1e-12);
    let error = (gathered[1].irradiance().0.x - PI).abs();
    assert!(
        error < 5.0 * gathered[1].standard_error().0.x + 1e-12,
        "{error}"
    );
    // It is direct light, also when nothing else is asked for.
    for (all, direct) in gathered
        .iter()
        .zip(gather_at(&scene, &points, PatchSize::Whole, &DIRECT))
    {
        assert_eq!(all.direct, direct.direct);
        assert_eq!(direct.indirect, Irradiance::ZERO);
    }
}

/// A sealed dark box beside a lit one, sharing a wall of no thickness, stays black.
#[test]
fn no_light_leaks_through_a_wall_of_no_thickness() {
    let mut scene = Scene::default();
    push_box(
        &mut scene,
        DVec3::ZERO,
        DVec3::ONE,
        true,
        grey("lit", 0.7, 1.0),
    );
    push_box(
        &mut scene,
        DVec3::X,
        DVec3::new(2.0, 1.0, 1.0),
        true,
        grey("dark", 0.7, 0.0),
    );
    let points = [
        (DVec3::new(1.0, 0.5, 0.5), DVec3::X),
        (DVec3::new(1.0001, 0.0, 0.3), DVec3::Y),
        (DVec3::new(1.5, 0.0, 0.5), DVec3::Y),
    ];
    for gathered in gather_at(&scene, &points, PatchSize::Length(0.2), &CONFIG) {
        assert_eq!(gathered.irradiance(), Irradiance::ZERO);
    }
}

/// The floor beneath a box is inside a solid: its samples are dropped.
#[test]
fn points_inside_a_solid_are_dropped() {
    let mut scene = Scene::default();
    push_box(
        &mut scene,
        DVec3::ZERO,
        DVec3::splat(4.0),
        true,
        grey("room", 0.5, 1.0),
    );
    push_box(
        &mut scene,
        DVec3::new(1.0, 0.0, 1.0),
        DVec3::new(2.0, 1.0, 2.0),
        false,
        grey("box", 0.5, 1.0),
    );
    let world = World::new(&scene);
    let patches = world.mesh(PatchSize::Length(0.5)).expect("meshes");
    let solution = solutions(&world, &patches, 32).remove(0);
    // The four floor patches under the box, 16 points each; the box's own bottom looks out of the
    // room and sees nothing.
    assert_eq!(solution.buried_points, 4 * 16);
}

/// The same bytes at any thread count, and whichever receivers are gathered together.
#[test]
fn the_result_does_not_depend_on_threads_or_company() {
    let mut scene = Scene::default();
    push_box(
        &mut scene,
        DVec3::ZERO,
        DVec3::splat(4.0),
        true,
        grey("room", 0.6, 0.0),
    );
    push_box(
        &mut scene,
        DVec3::ONE,
        DVec3::splat(1.5),
        false,
        grey("lamp", 0.2, 5.0),
    );
    let points: Vec<(DVec3, DVec3)> = (0..40)
        .map(|i| (DVec3::new(0.1 * f64::from(i), 0.0, 2.0), DVec3::Y))
        .collect();
    let run = |threads: usize, points: &[(DVec3, DVec3)]| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool of threads")
            .install(|| gather_at(&scene, points, PatchSize::Length(0.4), &CONFIG))
    };
    let one = run(1, &points);
    assert_eq!(one, run(2, &points));
    assert_eq!(one, run(3, &points));
    // What is added up; the noise of a receiver is judged in the company of others.
    for (one, seven) in one.iter().zip(run(2, &points[..7])) {
        assert_eq!(one.irradiance(), seven.irradiance());
    }
}

/// Between black faces there is direct light only; its exact value does not depend on the rays.
#[test]
fn unoccluded_direct_light_is_exact() {
    let mut scene = Scene::default();
    let object = scene.push_object("lamp");
    let material = scene.push_material(grey("lamp", 0.0, 100.0 / PI));
    let v = DVec3::new;
    let lamp = [
        v(-1.0, 3.0, -0.5),
        v(1.0, 3.0, -0.5),
        v(1.0, 3.0, 0.5),
        v(-1.0, 3.0, 0.5),
    ];
    scene.push_face(&lamp, object, material);
    let points = [(DVec3::ZERO, DVec3::Y), (v(10.0, 0.0, 0.0), DVec3::Y)];
    let gathered = gather_at(&scene, &points, PatchSize::Whole, &DIRECT);
    // Howell B-3 corner sums (forty digits), rounded.
    for (gathered, expected) in gathered
        .iter()
        .zip([6.481_615_684_133_388, 0.049_496_973_299_182_06])
    {
        assert!(
            (gathered.irradiance().0.x / expected - 1.0).abs() < 1e-12,
            "{gathered:?}"
        );
    }
}

/// Rays that are cast in two rounds are those of one round: sequences go on where they ended.
#[test]
fn rounds_add_up() {
    let mut scene = Scene::default();
    push_box(
        &mut scene,
        DVec3::ZERO,
        DVec3::splat(4.0),
        true,
        grey("room", 0.6, 1.0),
    );
    let world = World::new(&scene);
    let patches = world.mesh(PatchSize::Length(0.5)).expect("meshes");
    let lookup = Lookup::new(
        patches,
        &solutions(
            &world,
            &world.mesh(PatchSize::Length(0.5)).expect("meshes"),
            32,
        ),
    );
    let receivers = world.receivers(&[DVec3::new(1.0, 0.0, 2.0)], &[DVec3::Y]);
    let round = |rays: usize, rays_before: usize, shadow_rays: usize| {
        let config = GatherConfig {
            rays,
            rays_before,
            shadow_rays,
            ..CONFIG
        };
        gather(&world, Some(&lookup), &receivers, &[Key::of(5)], &config)[0]
    };
    let mut joined = round(256, 0, 64);
    joined.join(&round(768, 64, 0));
    let at_once = round(1024, 0, 64);
    // The same values, added in another order: rounding of sums of 256 terms.
    let difference = (joined.irradiance().0 - at_once.irradiance().0)
        .abs()
        .max_element();
    assert!(
        difference <= 256.0 * f64::EPSILON * at_once.irradiance().0.x,
        "{difference}"
    );
    assert_eq!(joined.direct, at_once.direct);
}

/// The coarser of two equal meshes differs from the finer by its noise alone, and the estimate of the
/// mesh's error is freed of noise.
#[test]
fn a_second_mesh_tells_the_error_of_the_first() {
    let scene = luxel_scenes::generate::cornell_box();
    let world = World::new(&scene);
    let positions: Vec<DVec3> = (0..64)
        .map(|i| DVec3::new(0.05 + 0.007 * f64::from(i), 0.0, 0.05))
        .collect();
    let receivers = world.receivers(&positions, &[DVec3::Y; 64]);
    let keys: Vec<Key> = (0..64).map(Key::of).collect();
    let mesh = |count| world.mesh(PatchSize::Count(count)).expect("meshes");
    let stated = |fine: usize, coarse: usize| {
        let (fine, coarse) = (mesh(fine), mesh(coarse));
        let (on_fine, on_coarse) = (
            solutions(&world, &fine, 128),
            solutions(&world, &coarse, 128),
        );
        let lookup = Lookup::new(fine, &on_fine).with_coarse(coarse, &on_coarse);
        let tallies = gather(&world, Some(&lookup), &receivers, &keys, &CONFIG);
        super::error_parts(&tallies).mesh
    };
    assert!(
        stated(500, 500) < 1e-12,
        "the same mesh with the same solutions"
    );
    let (coarse, fine) = (stated(400, 100), stated(6400, 1600));
    assert!(
        fine < 0.5 * coarse,
        "{coarse} falls to {fine} at four times the resolution"
    );
}
