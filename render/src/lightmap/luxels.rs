//! Which texels get light, and from which point of which face: conservative rasterisation of the charts.
//!
//! A texel is a *luxel* when its square shares area with a face, however little: bilinear filtering reads it. Its point is the
//! place of a face that is nearest to the texel's centre, the centre itself where a face lies there; so that neighbours
//! across a chart's edge are clamped to the edge. Of faces at the same distance the first counts.
//!
//! Source: J. Hasselgren, T. Akenine-Möller, L. Ohlsson, "Conservative Rasterization", GPU Gems 2, 2005 (the squares that
//! triangles overlap). Cost: a few operations for each texel of each triangle's box.

use super::atlas::{Atlas, ChartId};
use glam::DVec2;
use luxel_scenes::Scene;
use luxel_solver::geometry::{Geometry, TriangleId};
use luxel_solver::surface::SurfacePoint;

/// A texel with a point on a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Luxel {
    /// Position of the texel: page by page, row by row.
    pub texel: u32,
    /// The chart that it belongs to.
    pub chart: ChartId,
    /// The point that stands for it.
    pub point: SurfacePoint,
    /// That point from the texel's centre, in texels.
    pub offset: DVec2,
}

/// A triangle of a chart in texels of its page.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// The triangle.
    pub id: TriangleId,
    /// Its chart.
    pub chart: ChartId,
    /// The page.
    pub page: u32,
    /// Its corners.
    pub corners: [DVec2; 3],
}

impl Placed {
    /// The point of the triangle at a place, by the weights of its second and third corner; beyond the triangle they are
    /// outside [0, 1].
    pub fn weights(&self, place: DVec2) -> [f64; 2] {
        let [a, b, c] = self.corners;
        let area = (b - a).perp_dot(c - a);
        [
            (place - a).perp_dot(c - a) / area,
            (b - a).perp_dot(place - a) / area,
        ]
    }

    /// The place of the triangle nearest to `place`, and its weights.
    pub fn nearest(&self, place: DVec2) -> (DVec2, [f64; 2]) {
        let [u, v] = self.weights(place);
        if u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
            return (place, [u, v]);
        }
        // Weights of the corners along each edge, from where it begins.
        let edges = [(0, 1), (1, 2), (2, 0)].map(|(from, to)| {
            let (a, b) = (self.corners[from], self.corners[to]);
            let along = ((place - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
            let mut weights = [0.0; 3];
            weights[from] += 1.0 - along;
            weights[to] += along;
            (a.lerp(b, along), [weights[1], weights[2]])
        });
        let distance = |found: &(DVec2, [f64; 2])| found.0.distance_squared(place);
        let mut best = edges[0];
        for edge in &edges[1..] {
            if distance(edge) < distance(&best) {
                best = *edge;
            }
        }
        best
    }

    /// Columns and rows of the texels that its box touches.
    pub fn texels(&self, size: [usize; 2]) -> [std::ops::Range<usize>; 2] {
        let [a, b, c] = self.corners;
        let low = a.min(b).min(c).floor().max(DVec2::ZERO).to_array();
        let high = a.max(b).max(c).ceil().max(DVec2::ZERO).to_array();
        [0, 1].map(|axis| low[axis] as usize..(high[axis] as usize).min(size[axis]))
    }

    /// Whether the square of texel (column, row) shares area with it: no edge has the square beyond it.
    pub(super) fn overlaps(&self, column: usize, row: usize) -> bool {
        let centre = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
        [(0, 1), (1, 2), (2, 0)].iter().all(|&(from, to)| {
            let (a, edge) = (self.corners[from], self.corners[to] - self.corners[from]);
            let reach = 0.5 * (edge.x.abs() + edge.y.abs());
            edge.perp_dot(centre - a) > -reach
        })
    }
}

/// The triangles of all faces that have a chart, in their order.
pub fn placed(atlas: &Atlas, scene: &Scene, geometry: &Geometry) -> Vec<Placed> {
    let faces = scene
        .face_ids()
        .filter_map(|face| Some((face, atlas.chart(face)?)));
    faces
        .flat_map(|(face, (id, chart))| {
            geometry
                .triangles_of(face)
                .map(move |triangle| (triangle, id, chart))
        })
        .map(|(id, chart, of_chart)| Placed {
            id,
            chart,
            page: of_chart.page,
            corners: atlas.triangle(scene, geometry, id),
        })
        // A sliver of a face may have no area in texels; its texels are its neighbours'.
        .filter(|placed| {
            let [a, b, c] = placed.corners;
            (b - a).perp_dot(c - a) > 0.0
        })
        .collect()
}

/// All luxels of an atlas, in the order of their texels.
pub fn luxels(atlas: &Atlas, triangles: &[Placed]) -> Vec<Luxel> {
    const NONE: u32 = u32::MAX;
    let [width, height] = atlas.size;
    // By texel the nearest triangle so far, and how far it is.
    let mut nearest = vec![(NONE, f32::INFINITY); atlas.texels()];
    for (index, triangle) in triangles.iter().enumerate() {
        let [columns, rows] = triangle.texels(atlas.size);
        for row in rows {
            for column in columns.clone() {
                if !triangle.overlaps(column, row) {
                    continue;
                }
                let centre = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
                let distance = triangle.nearest(centre).0.distance_squared(centre) as f32;
                let texel = (triangle.page as usize * height + row) * width + column;
                if distance < nearest[texel].1 {
                    nearest[texel] = (index as u32, distance);
                }
            }
        }
    }
    let found = nearest
        .iter()
        .enumerate()
        .filter(|(_, found)| found.0 != NONE);
    found
        .map(|(texel, &(index, _))| {
            let triangle = &triangles[index as usize];
            let centre = centre(atlas, texel);
            let (place, [u, v]) = triangle.nearest(centre);
            Luxel {
                texel: texel as u32,
                chart: triangle.chart,
                point: SurfacePoint {
                    triangle: triangle.id,
                    u,
                    v,
                },
                offset: place - centre,
            }
        })
        .collect()
}

/// The centre of a texel in its page.
pub fn centre(atlas: &Atlas, texel: usize) -> DVec2 {
    let [width, height] = atlas.size;
    let in_page = texel % (width * height);
    DVec2::new(
        (in_page % width) as f64 + 0.5,
        (in_page / width) as f64 + 0.5,
    )
}
