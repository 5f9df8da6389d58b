//! How an engine reads a lightmap: bilinear interpolation between the centres of texels.

use super::atlas::Atlas;
use super::map::Lightmap;
use glam::DVec2;
use luxel_scenes::{Rgb, Scene};
use luxel_solver::geometry::Geometry;
use luxel_solver::surface::SurfacePoint;

/// The four texels around a place of a page, with their weights. Beyond the page's edge its outermost texels count, as with
/// clamped texture coordinates.
pub fn taps(size: [usize; 2], page: u32, place: DVec2) -> [(usize, f64); 4] {
    let place = place - 0.5;
    let low = place.floor();
    let share = place - low;
    let at = |dx: f64, dy: f64| {
        let column = (low.x + dx).clamp(0.0, (size[0] - 1) as f64) as usize;
        let row = (low.y + dy).clamp(0.0, (size[1] - 1) as f64) as usize;
        (page as usize * size[1] + row) * size[0] + column
    };
    [
        (at(0.0, 0.0), (1.0 - share.x) * (1.0 - share.y)),
        (at(1.0, 0.0), share.x * (1.0 - share.y)),
        (at(0.0, 1.0), (1.0 - share.x) * share.y),
        (at(1.0, 1.0), share.x * share.y),
    ]
}

/// Where a point lies in the pages: page and place in texels; `None` where its face has no chart.
pub fn place(
    atlas: &Atlas,
    scene: &Scene,
    geometry: &Geometry,
    point: SurfacePoint,
) -> Option<(u32, DVec2)> {
    let (_, chart) = atlas.chart(geometry.face(point.triangle))?;
    let [a, b, c] = atlas.triangle(scene, geometry, point.triangle);
    Some((chart.page, a + (b - a) * point.u + (c - a) * point.v))
}

/// The value of a map at a place of a page.
pub fn sample(map: &Lightmap, values: &[Rgb], page: u32, place: DVec2) -> Rgb {
    let taps = taps(map.size, page, place).into_iter();
    taps.map(|(texel, weight)| values[texel] * weight).sum()
}
