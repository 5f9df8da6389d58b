//! Cameras as the audit of a scene sees them.

use crate::camera::CameraFrame;
use crate::integrators::unit_ray;
use glam::DVec2;
use luxel_solver::audit::View;
use luxel_solver::world::World;

/// Rays along each side of a view: enough to notice a solid that fills a hundredth of the picture.
const SIDE: usize = 16;

/// A grid of rays over the picture of a camera.
pub fn view(world: &World<'_>, camera: &str, frame: &CameraFrame) -> View {
    let [width, height] = frame.size().map(|size| size as f64 / SIDE as f64);
    let rays = (0..SIDE * SIDE).map(|index| {
        let cell = DVec2::new((index % SIDE) as f64, (index / SIDE) as f64);
        let raster = (cell + 0.5) * DVec2::new(width, height);
        unit_ray(world, &frame.ray(raster))
    });
    View {
        camera: camera.to_owned(),
        eye: frame.eye(),
        rays: rays.collect(),
    }
}
