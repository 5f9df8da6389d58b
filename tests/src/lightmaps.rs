//! Lightmaps of scenes made in code, and smooth surfaces to cut into charts.

use glam::{DVec3, Vec3};
use luxel::lightmap::atlas::Atlas;
use luxel::lightmap::bake::{Finished, Luxels, Smoothing, bake, finish};
use luxel::lightmap::unwrap::{Density, UnwrapConfig, Unwrapper, UvUnwrap};
use luxel_scenes::{Material, Reflectance, Scene};
use luxel_solver::adaptive::{AdaptiveConfig, Control, Stage};
use luxel_solver::bounces::Bounces;
use luxel_solver::gather::{Components, ErrorParts, Gathered};
use luxel_solver::world::World;
use std::f64::consts::TAU;

/// A bake with everything that it was made of.
pub struct Baked<'s> {
    /// The scene, ready for rays.
    pub world: World<'s>,
    /// Where its faces lie.
    pub atlas: Atlas,
    /// What was lit.
    pub luxels: Luxels,
    /// The maps.
    pub maps: Finished,
}

/// Stops at an error.
struct Until(f64);

impl Control for Until {
    fn begin(&mut self, _what: Stage, _cost: f64, _parts: usize) -> f64 {
        1.0
    }

    fn advance(&mut self) -> bool {
        true
    }

    fn suits(&mut self, parts: &ErrorParts) -> bool {
        parts.upper() <= self.0
    }
}

/// The faces of a scene on one page of `side` texels.
///
/// # Panics
/// When it cannot be unwrapped.
pub fn atlas(scene: &Scene, side: usize) -> Atlas {
    let config = UnwrapConfig {
        density: Density::Page(side),
        padding: 1,
        block_align: false,
    };
    UvUnwrap
        .unwrap(scene, &[], &config, &|_, _| true)
        .expect("an atlas")
}

/// What is gathered at luxels in the light of `world`, to a relative error, and the error that is stated for all of it.
///
/// # Panics
/// When the scene cannot be meshed.
pub fn gathered(
    world: &World<'_>,
    luxels: &Luxels,
    components: Components,
    bounces: Bounces,
    error: f64,
    seed: u64,
) -> (Vec<Gathered>, f64) {
    let config = AdaptiveConfig {
        error,
        components,
        bounces,
        most_patches: usize::MAX,
        seed,
    };
    let found = bake(world, luxels, &config, None, &mut Until(error)).expect("a mesh");
    let found = found.expect("nobody stops it");
    (found.gathered, found.adaptive.parts.total())
}

/// Bakes a scene on one page of `side` texels to a relative error, smoothed.
///
/// # Panics
/// When it cannot be unwrapped or meshed.
pub fn baked(scene: &Scene, side: usize, error: f64) -> Baked<'_> {
    let world = World::new(scene);
    let atlas = atlas(scene, side);
    let luxels = Luxels::new(&world, &atlas, 0.5);
    let (gathered, _) = gathered(&world, &luxels, Components::All, Bounces::All, error, 0);
    let maps = finish(&world, &atlas, &luxels, &gathered, Smoothing::NonLocalMeans);
    Baked {
        world,
        atlas,
        luxels,
        maps,
    }
}

/// Adds a surface of points and unit normals over [0, 1]², in so many faces each way, smooth over its edges. It faces along its
/// normals.
pub fn push_smooth(
    scene: &mut Scene,
    name: &str,
    reflectance: f64,
    faces: [usize; 2],
    at: impl Fn(f64, f64) -> (DVec3, DVec3),
) {
    let object = scene.push_object(name);
    let material = scene.push_material(Material::diffuse(name, Reflectance::splat(reflectance)));
    // Ends that meet are the same to the bit: positions come from whole numbers.
    let corner = |i: usize, j: usize| at(i as f64 / faces[0] as f64, j as f64 / faces[1] as f64);
    for i in 0..faces[0] {
        for j in 0..faces[1] {
            let ring = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| corner(i, j));
            for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
                let mut corners = [a, b, c].map(|k| ring[k]);
                let [p, q, r] = corners.map(|corner| corner.0);
                if (q - p).cross(r - p).dot(corners[0].1) < 0.0 {
                    corners.swap(1, 2);
                }
                let [p, q, r] = corners.map(|corner| corner.0);
                if (q - p).cross(r - p).length() < 1e-12 {
                    continue;
                }
                scene.push_face(&[p, q, r], object, material);
                let normals = corners.map(|corner| corner.1.as_vec3());
                let first = scene.corners.vertex.len() - 3;
                scene.corners.normal.resize(first, Vec3::ZERO);
                scene.corners.normal.extend(normals);
            }
        }
    }
}

/// A point of a circle that closes to the bit.
fn on_circle(share: f64) -> (f64, f64) {
    (TAU * (share % 1.0)).sin_cos()
}

/// A sphere that faces outwards, by two shares of its circumference and of half of it.
pub fn sphere(centre: DVec3, radius: f64) -> impl Fn(f64, f64) -> (DVec3, DVec3) {
    move |u, v| {
        let (sin, cos) = on_circle(u);
        let (sin_v, cos_v) = (std::f64::consts::PI * v).sin_cos();
        let sin_v = if v >= 1.0 { 0.0 } else { sin_v };
        let normal = DVec3::new(sin * sin_v, cos_v, cos * sin_v);
        (centre + normal * radius, normal)
    }
}

/// A torus about the y axis that faces outwards.
pub fn torus(centre: DVec3, radius: f64, tube: f64) -> impl Fn(f64, f64) -> (DVec3, DVec3) {
    move |u, v| {
        let ((sin, cos), (sin_v, cos_v)) = (on_circle(u), on_circle(v));
        let outwards = DVec3::new(sin, 0.0, cos);
        let normal = outwards * sin_v + DVec3::Y * cos_v;
        (centre + outwards * radius + normal * tube, normal)
    }
}

/// A quarter of a cylinder about the y axis that faces its axis.
pub fn bent_wall(corner: DVec3, radius: f64, height: f64) -> impl Fn(f64, f64) -> (DVec3, DVec3) {
    move |u, v| {
        let (sin, cos) = (0.25 * TAU * u).sin_cos();
        let outwards = DVec3::new(cos, 0.0, sin);
        (
            corner + outwards * radius + DVec3::Y * (height * v),
            -outwards,
        )
    }
}
