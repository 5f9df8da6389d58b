//! Which texels get light, and from which point of which face: conservative rasterisation of the charts.
//!
//! A texel gets light when its square shares area with a face, however little: bilinear filtering reads it. Its point is its
//! centre where a face lies there. Beside a chart's edge it has those of four points within it that lie on the chart, or the
//! chart's point that is nearest to its centre where none does; [`super::fit`] finds what the texel has to hold for filtering
//! to give the light at these points. Of faces at the same place the first counts.
//!
//! Source: J. Hasselgren, T. Akenine-Möller, L. Ohlsson, "Conservative Rasterization", GPU Gems 2, 2005 (the squares that
//! triangles overlap). Cost: a few operations for each texel of each triangle's box.

use super::atlas::{Atlas, ChartId};
use glam::DVec2;
use luxel_scenes::Scene;
use luxel_solver::geometry::{Geometry, TriangleId};
use luxel_solver::surface::SurfacePoint;
use std::collections::HashMap;

/// A point on a face that tells what a texel holds. A texel may have several.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Luxel {
    /// Position of the texel: page by page, row by row.
    pub texel: u32,
    /// The chart that it belongs to.
    pub chart: ChartId,
    /// The point.
    pub point: SurfacePoint,
    /// That point from the texel's centre, in texels.
    pub offset: DVec2,
}

impl Luxel {
    /// Whether its point is its texel's centre.
    pub fn is_centred(&self) -> bool {
        self.offset == DVec2::ZERO
    }
}

/// Width in texels of a strip of a texel that is too narrow to give it light: rounding makes such.
const MARGIN: f64 = 0.01;

/// How far from an edge, in texels, points are that would lie on it. At 0.25 small charts lose the ends of what they show (a furnished
/// office: 6.8 % instead of 5.0).
const INSET: f64 = 0.05;

/// How far from an edge, in texels, a place may be and still lie on it: coordinates are rounded to f32.
const ROUNDING: f64 = 1e-3;

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

    /// Whether a place lies in the triangle or at its edge.
    pub fn contains(&self, place: DVec2) -> bool {
        let [u, v] = self.weights(place);
        u >= 0.0 && v >= 0.0 && u + v <= 1.0
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

    /// Distances of a place to the three edges, inwards, in texels.
    fn distances_to_edges(&self, place: DVec2) -> [f64; 3] {
        let [a, b, c] = self.corners;
        let area = (b - a).perp_dot(c - a).abs();
        let [u, v] = self.weights(place);
        let height = |opposite: DVec2| area / opposite.length();
        [
            (1.0 - u - v) * height(c - b),
            u * height(a - c),
            v * height(b - a),
        ]
    }

    /// The place of the triangle nearest to `place`, but not at its edges, where geometry that it meets there may hide
    /// a light; and its weights.
    pub fn inside(&self, place: DVec2) -> (DVec2, [f64; 2]) {
        let nearest = self.nearest(place).0;
        let [a, b, c] = self.corners;
        let middle = (a + b + c) / 3.0;
        let edges = self
            .distances_to_edges(nearest)
            .into_iter()
            .zip(self.distances_to_edges(middle));
        // On the way to the middle the distances change in proportion.
        let shares = edges.map(|(near, far)| {
            let wanted = INSET.min(0.5 * far);
            if near < wanted {
                (wanted - near) / (far - near)
            } else {
                0.0
            }
        });
        let place = nearest.lerp(middle, shares.fold(0.0, f64::max));
        (place, self.weights(place))
    }

    /// Whether the square of texel (column, row) shares area with it: no edge has all but a margin of the square beyond it.
    pub(super) fn overlaps(&self, column: usize, row: usize) -> bool {
        let centre = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
        let [a, b, c] = self.corners;
        // A mirrored triangle has its inside on the other side of its edges.
        let side = (b - a).perp_dot(c - a).signum();
        [(0, 1), (1, 2), (2, 0)].iter().all(|&(from, to)| {
            let (a, edge) = (self.corners[from], self.corners[to] - self.corners[from]);
            let reach = 0.5 * (edge.x.abs() + edge.y.abs()) - MARGIN * edge.length();
            side * edge.perp_dot(centre - a) > -reach
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
            (b - a).perp_dot(c - a).abs() > 0.0
        })
        .collect()
}

/// Places in a texel from its centre that are tried where no face lies at the centre.
const QUARTERS: [DVec2; 4] = [
    DVec2::new(-0.25, -0.25),
    DVec2::new(0.25, -0.25),
    DVec2::new(-0.25, 0.25),
    DVec2::new(0.25, 0.25),
];

/// Charts of so many texels have no centre that tells what lies around it: all their texels get several points.
const SMALL_CHART: usize = 12;

/// What was found of a texel.
#[derive(Clone, Copy)]
struct Found {
    /// The triangle nearest to the centre, and the square of its distance.
    nearest: (u32, f32),
    /// Triangles at whose edge the centre lies, up to rounding.
    at_edge: u8,
    /// The first triangle at each of the quarters.
    quarters: [u32; 4],
}

const NONE: u32 = u32::MAX;

/// Memory that is needed to find the luxels of so many texels, in bytes.
pub fn bytes_to_find(texels: usize) -> usize {
    texels * size_of::<Found>()
}

/// The luxels of an atlas, in the order of their texels.
pub fn luxels(atlas: &Atlas, triangles: &[Placed]) -> Vec<Luxel> {
    let nothing = Found {
        nearest: (NONE, f32::INFINITY),
        at_edge: 0,
        quarters: [NONE; 4],
    };
    let mut found = vec![nothing; atlas.texels()];
    for (index, triangle) in triangles.iter().enumerate() {
        let [columns, rows] = triangle.texels(atlas.size);
        for row in rows {
            for column in columns.clone() {
                if !triangle.overlaps(column, row) {
                    continue;
                }
                let centre = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
                let distance = triangle.nearest(centre).0.distance_squared(centre) as f32;
                let found = &mut found[atlas.texel(triangle.page, column, row)];
                if distance < found.nearest.1 {
                    found.nearest = (index as u32, distance);
                }
                if distance <= 0.0
                    && triangle
                        .distances_to_edges(centre)
                        .iter()
                        .any(|&d| d < ROUNDING)
                {
                    found.at_edge = found.at_edge.saturating_add(1);
                }
                for (quarter, offset) in found.quarters.iter_mut().zip(QUARTERS) {
                    if *quarter == NONE && triangle.contains(centre + offset) {
                        *quarter = index as u32;
                    }
                }
            }
        }
    }
    let mut texels_of: HashMap<ChartId, usize> = HashMap::new();
    for found in &found {
        if let Some(triangle) = triangles.get(found.nearest.0 as usize) {
            *texels_of.entry(triangle.chart).or_default() += 1;
        }
    }
    let mut luxels = Vec::new();
    for (texel, found) in found.iter().enumerate() {
        if found.nearest.0 == NONE {
            continue;
        }
        let centre = centre(atlas, texel);
        let first = &triangles[found.nearest.0 as usize];
        let mut push = |triangle: &Placed, (place, [u, v]): (DVec2, [f64; 2])| {
            luxels.push(Luxel {
                texel: texel as u32,
                chart: triangle.chart,
                point: SurfacePoint {
                    triangle: triangle.id,
                    u,
                    v,
                },
                offset: place - centre,
            });
        };
        let quarters = found.quarters.iter().zip(QUARTERS);
        let inside = quarters.filter_map(|(&index, offset)| {
            let triangle = triangles.get(index as usize)?;
            (triangle.chart == first.chart).then_some((triangle, centre + offset))
        });
        let mut inside = inside.peekable();
        let is_small = texels_of[&first.chart] <= SMALL_CHART;
        // The edge of one triangle alone is an edge of the chart.
        if first.contains(centre) && !is_small && found.at_edge != 1 {
            push(first, (centre, first.weights(centre)));
        } else if inside.peek().is_none() {
            push(first, first.inside(centre));
        } else {
            inside.for_each(|(triangle, place)| push(triangle, triangle.inside(place)));
        }
    }
    luxels
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

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(corners: [[f64; 2]; 3]) -> Placed {
        Placed {
            id: TriangleId(0),
            chart: ChartId(0),
            page: 0,
            corners: corners.map(DVec2::from_array),
        }
    }

    fn page(triangles: &[Placed]) -> Vec<Luxel> {
        let atlas = Atlas {
            size: [16, 16],
            pages: 1,
            corners: Vec::new(),
            face_chart: Vec::new(),
            charts: Vec::new(),
            padding: 1,
        };
        luxels(&atlas, triangles)
    }

    /// Every point of a triangle is filtered from texels that have luxels or touch such; every luxel's point is on the triangle.
    #[test]
    fn luxels_cover_triangles_and_lie_on_them() {
        for corners in [
            [[1.0, 1.0], [14.0, 2.0], [3.0, 13.0]],
            // Mirrored.
            [[1.0, 1.0], [3.0, 13.0], [14.0, 2.0]],
            // Thinner than a texel, and smaller.
            [[2.1, 3.2], [13.0, 3.4], [2.1, 3.3]],
            [[5.2, 5.2], [5.6, 5.3], [5.3, 5.7]],
        ] {
            let placed = triangle(corners);
            let found = page(&[placed]);
            for luxel in &found {
                let SurfacePoint { u, v, .. } = luxel.point;
                assert!(u.min(v).min(1.0 - u - v) > 0.0, "{corners:?}: {luxel:?}");
                let texel = luxel.texel as usize;
                let centre = DVec2::new((texel % 16) as f64 + 0.5, (texel / 16) as f64 + 0.5);
                let [a, b, c] = placed.corners;
                let place = a + (b - a) * u + (c - a) * v;
                assert!((centre + luxel.offset).distance(place) < 1e-9);
            }
            for share in 0..100 {
                let along = f64::from(share) / 99.0;
                let [a, b, c] = placed.corners;
                for place in [a.lerp(b, along), b.lerp(c, along), c.lerp(a, along)] {
                    let inside = place.lerp((a + b + c) / 3.0, 0.1);
                    let texel = inside.y.floor() as u32 * 16 + inside.x.floor() as u32;
                    assert!(
                        found.iter().any(|luxel| luxel.texel == texel),
                        "{corners:?}: nothing at {inside}"
                    );
                }
            }
        }
    }

    /// Two triangles with a common edge through a texel's centre give it that centre once.
    #[test]
    fn centres_on_inner_edges_are_centres() {
        let one = triangle([[0.5, 0.5], [12.5, 12.5], [0.5, 12.5]]);
        let other = triangle([[0.5, 0.5], [12.5, 0.5], [12.5, 12.5]]);
        let found = page(&[one, other]);
        let at = |texel: u32| found.iter().filter(move |luxel| luxel.texel == texel);
        for k in 2..10 {
            let own: Vec<&Luxel> = at(k * 16 + k).collect();
            assert!(own.len() == 1 && own[0].is_centred(), "{k}: {own:?}");
        }
        // On the chart's own edge they are moved off it.
        assert!(at(5).all(|luxel| !luxel.is_centred()));
    }
}
