//! What an engine sees of a finished bake: the delivered files, read anew.

use glam::DVec3;
use luxel::image::exr;
use luxel_scenes::{Rgb, load};
use luxel_solver::bvh::{Hit, Ray};
use luxel_solver::world::World;
use std::path::Path;

/// How far a point may lie from its surface, in units of the scene's size.
const NEAR: f64 = 1e-5;

/// Irradiance and its standard error by bilinear look-up in the folder's first page, at points on surfaces: position and normal
/// find the face in `scene.obj`, its texture coordinates find the texels. `None` where no face is.
///
/// # Panics
/// When a file of the folder cannot be read.
pub fn look_up(folder: &Path, positions: &[DVec3], normals: &[DVec3]) -> Vec<Option<[Rgb; 2]>> {
    let scene = load(folder.join("scene.obj"))
        .expect("the delivered scene")
        .scene;
    let world = World::new(&scene);
    let [map, error] = ["lightmap_000.exr", "lightmap_000_error.exr"].map(|name| {
        exr::read(&folder.join(name))
            .expect("a delivered map")
            .image
    });
    let frame = world.surfaces().geometry().frame();
    let rays: Vec<Ray> = positions
        .iter()
        .zip(normals)
        .map(|(&position, &normal)| Ray {
            origin: (frame.to_unit(position) + normal * NEAR).as_vec3(),
            tmin: 0.0,
            direction: -normal.as_vec3(),
            tmax: 2.0 * NEAR as f32,
        })
        .collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    world.bvh().closest_hits(&rays, &mut hits);
    let bilinear = |image: &luxel::image::Image, x: f64, y: f64| {
        let at = |column: f64, row: f64| {
            let column = column.clamp(0.0, (image.width - 1) as f64) as usize;
            let row = row.clamp(0.0, (image.height - 1) as f64) as usize;
            Rgb::from_array(image.pixels[row * image.width + column].map(f64::from))
        };
        let (x, y) = (x - 0.5, y - 0.5);
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let top = at(x.floor(), y.floor()).lerp(at(x.floor() + 1.0, y.floor()), fx);
        let bottom = at(x.floor(), y.floor() + 1.0).lerp(at(x.floor() + 1.0, y.floor() + 1.0), fx);
        top.lerp(bottom, fy)
    };
    rays.iter()
        .zip(&hits)
        .map(|(ray, hit)| {
            let point = world.interaction(ray, hit)?.point;
            // v of the scene grows upwards, rows grow downwards.
            let uv = world.surfaces().uv(point);
            let (x, y) = (uv.x * map.width as f64, (1.0 - uv.y) * map.height as f64);
            Some([bilinear(&map, x, y), bilinear(&error, x, y)])
        })
        .collect()
}
