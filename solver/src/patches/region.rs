//! A region: faces that are meshed together, and the map between points and elements.

use super::Side;
use super::clipped::Clipped;
use crate::geometry::{Geometry, ray_origin};
use glam::{DVec2, DVec3, Vec3};
use luxel_scenes::FaceId;

/// A point of a patch.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceSample {
    /// Position in the unit frame.
    pub position: DVec3,
    /// Unit normal of the patch's side.
    pub normal: DVec3,
    /// Origin for rays that leave the surface: the position, moved off by the rounding bound.
    pub origin: Vec3,
    /// The face.
    pub face: FaceId,
}

/// Faces that are meshed together. Its elements are numbered from zero; the patches of its front
/// start at `first`, those of its back (of two-sided faces) at `first_back`.
#[derive(Clone, Debug)]
pub(super) struct Region {
    pub(super) shape: Shape,
    pub(super) faces: Vec<FaceId>,
    pub(super) first: u32,
    pub(super) first_back: Option<u32>,
}

/// How a region is divided.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    /// A convex quad, divided along the lines of its bilinear map.
    Quad(Quad),
    /// A triangle, divided into `side`² similar ones.
    Triangle { corners: [DVec3; 3], side: u32 },
    /// A polygon of five or more corners, divided by a square grid.
    Clipped(Clipped),
    /// One element: whole faces, with their cumulative share of the area.
    Faces { cumulative: Vec<f64> },
}

/// A convex quad P(s, t), bilinear in its corners, with `counts` elements along s and t.
#[derive(Clone, Debug)]
pub(super) struct Quad {
    /// P(0,0), P(1,0), P(1,1), P(0,1).
    pub(super) corners: [DVec3; 4],
    pub(super) counts: [u32; 2],
}

impl Quad {
    fn at(&self, s: f64, t: f64) -> DVec3 {
        let [a, b, c, d] = self.corners;
        a.lerp(b, s).lerp(d.lerp(c, s), t)
    }

    /// What keeps the quad from being a parallelogram.
    fn twist(&self) -> DVec3 {
        let [a, b, c, d] = self.corners;
        (a + c) - (b + d)
    }

    fn is_parallelogram(&self) -> bool {
        let [a, _, c, _] = self.corners;
        self.twist().length_squared() <= 1e-24 * (c - a).length_squared()
    }

    /// (s, t) of a point of the quad's plane, clamped to [0, 1]². Lines of constant s are
    /// straight, so s solves the quadratic (a + s(b−a) − p) × ((d−a) + s·twist) = 0.
    fn invert(&self, p: DVec3) -> DVec2 {
        let [a, b, c, d] = self.corners;
        let normal = (c - a).cross(d - b);
        let cross = |u: DVec3, v: DVec3| u.cross(v).dot(normal);
        let (e, f, g, h) = (b - a, d - a, self.twist(), p - a);
        let (k2, k1, k0) = (cross(e, g), cross(e, f) - cross(h, g), -cross(h, f));
        // The root that stays finite as the twist vanishes; k1 > 0 in a convex quad.
        let discriminant = (k1 * k1 - 4.0 * k2 * k0).max(0.0).sqrt();
        let s = -2.0 * k0 / (k1 + discriminant);
        let (start, end) = (a.lerp(b, s), d.lerp(c, s));
        let t = (p - start).dot(end - start) / (end - start).length_squared();
        DVec2::new(s, t).clamp(DVec2::ZERO, DVec2::ONE)
    }

    fn element_at(&self, p: DVec3) -> u32 {
        let st = self.invert(p);
        let index = |x: f64, count: u32| ((x * f64::from(count)) as u32).min(count - 1);
        index(st.y, self.counts[1]) * self.counts[0] + index(st.x, self.counts[0])
    }

    fn cell(&self, element: u32) -> [DVec3; 4] {
        let [nu, nv] = self.counts;
        let (i, j) = (element % nu, element / nu);
        let [s0, s1] = [i, i + 1].map(|i| f64::from(i) / f64::from(nu));
        let [t0, t1] = [j, j + 1].map(|j| f64::from(j) / f64::from(nv));
        [
            self.at(s0, t0),
            self.at(s1, t0),
            self.at(s1, t1),
            self.at(s0, t1),
        ]
    }
}

/// The element of a triangle that is divided into `side`² ones, numbered row by row: the weights
/// of the second and third corner count columns and rows.
fn triangle_element(corners: [DVec3; 3], side: u32, p: DVec3) -> u32 {
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    let scale = f64::from(side) / normal.length_squared();
    let x = ((p - a).cross(c - a).dot(normal) * scale).max(0.0);
    let y = ((b - a).cross(p - a).dot(normal) * scale).max(0.0);
    let row = (y as u32).min(side - 1);
    let column = (x as u32).min(side - 1 - row);
    let upper = (x - f64::from(column)) + (y - f64::from(row)) > 1.0 && column + row + 1 < side;
    row * (2 * side - row) + 2 * column + u32::from(upper)
}

fn triangle_cell(corners: [DVec3; 3], side: u32, element: u32) -> [DVec3; 3] {
    let mut row = 0;
    let mut rest = element;
    while rest >= 2 * (side - row) - 1 {
        rest -= 2 * (side - row) - 1;
        row += 1;
    }
    let column = rest / 2;
    let [a, b, c] = corners;
    let at = |i: u32, j: u32| {
        a + (b - a) * (f64::from(i) / f64::from(side)) + (c - a) * (f64::from(j) / f64::from(side))
    };
    if rest.is_multiple_of(2) {
        [at(column, row), at(column + 1, row), at(column, row + 1)]
    } else {
        [
            at(column + 1, row),
            at(column + 1, row + 1),
            at(column, row + 1),
        ]
    }
}

/// Area-uniform point of a triangle for a uniform sample; keeps strata connected.
///
/// Source: G. Turk, "Generating Random Points in Triangles", Graphics Gems, 1990.
fn sample_triangle([a, b, c]: [DVec3; 3], [x, y]: [f64; 2]) -> DVec3 {
    let root = x.sqrt();
    a * (1.0 - root) + b * (root * (1.0 - y)) + c * (root * y)
}

fn triangle_area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

impl Region {
    /// Elements on one side.
    pub(super) fn element_count(&self) -> u32 {
        match &self.shape {
            Shape::Quad(quad) => quad.counts[0] * quad.counts[1],
            Shape::Triangle { side, .. } => side * side,
            Shape::Clipped(clipped) => clipped.elements.len() as u32,
            Shape::Faces { .. } => 1,
        }
    }

    /// The element at a point, which is computed only where it matters.
    pub(super) fn element_at(&self, point: impl FnOnce() -> DVec3) -> u32 {
        match &self.shape {
            Shape::Quad(quad) => quad.element_at(point()),
            Shape::Triangle { corners, side } => triangle_element(*corners, *side, point()),
            Shape::Clipped(clipped) => clipped.element_at(point()),
            Shape::Faces { .. } => 0,
        }
    }

    /// The element and side of one of the region's patches.
    pub(super) fn element_of(&self, patch: u32) -> (u32, Side) {
        match self.first_back {
            Some(first_back) if patch >= first_back => (patch - first_back, Side::Back),
            _ => (patch - self.first, Side::Front),
        }
    }

    pub(super) fn element_area(&self, geometry: &Geometry, element: u32) -> f64 {
        match &self.shape {
            Shape::Quad(quad) => {
                let [a, b, c, d] = quad.cell(element);
                0.5 * (c - a).cross(d - b).length()
            }
            Shape::Triangle { corners, side } => {
                triangle_area(*corners) / (f64::from(*side) * f64::from(*side))
            }
            Shape::Clipped(clipped) => fan(&clipped.elements[element as usize])
                .map(triangle_area)
                .sum(),
            Shape::Faces { .. } => self
                .faces
                .iter()
                .flat_map(|&face| geometry.triangles_of(face))
                .map(|triangle| triangle_area(geometry.triangle(triangle)))
                .sum(),
        }
    }

    pub(super) fn polygons(&self, geometry: &Geometry, element: u32) -> Vec<Vec<DVec3>> {
        match &self.shape {
            Shape::Quad(quad) => vec![quad.cell(element).to_vec()],
            Shape::Triangle { corners, side } => {
                vec![triangle_cell(*corners, *side, element).to_vec()]
            }
            Shape::Clipped(clipped) => vec![clipped.elements[element as usize].clone()],
            Shape::Faces { .. } => self
                .faces
                .iter()
                .map(|&face| geometry.polygon(face))
                .collect(),
        }
    }

    pub(super) fn sample(
        &self,
        geometry: &Geometry,
        element: u32,
        side: Side,
        [mut x, y]: [f64; 2],
    ) -> SurfaceSample {
        let mut face = self.faces[0];
        let position = match &self.shape {
            Shape::Quad(quad) => {
                let [a, b, c, d] = quad.cell(element);
                if quad.is_parallelogram() {
                    a + (b - a) * x + (d - a) * y
                } else {
                    let halves = [[a, b, c], [a, c, d]];
                    let share = triangle_area(halves[0])
                        / (triangle_area(halves[0]) + triangle_area(halves[1]));
                    let (half, x) = if x < share {
                        (halves[0], x / share)
                    } else {
                        (halves[1], (x - share) / (1.0 - share))
                    };
                    sample_triangle(half, [x, y])
                }
            }
            Shape::Triangle { corners, side } => {
                sample_triangle(triangle_cell(*corners, *side, element), [x, y])
            }
            Shape::Clipped(clipped) => sample_fan(fan(&clipped.elements[element as usize]), [x, y]),
            Shape::Faces { cumulative } => {
                let index = cumulative
                    .partition_point(|&c| c <= x)
                    .min(cumulative.len() - 1);
                let below = if index == 0 {
                    0.0
                } else {
                    cumulative[index - 1]
                };
                x = ((x - below) / (cumulative[index] - below)).clamp(0.0, 1.0);
                face = self.faces[index];
                let triangles = geometry.triangles_of(face).map(|t| geometry.triangle(t));
                sample_fan(triangles, [x, y])
            }
        };
        let front = geometry.normal(face);
        let normal = if side == Side::Front { front } else { -front };
        let origin = ray_origin(position, normal, geometry.extent(face));
        SurfaceSample {
            position,
            normal,
            origin,
            face,
        }
    }
}

/// The triangles of a convex polygon.
fn fan(polygon: &[DVec3]) -> impl Iterator<Item = [DVec3; 3]> + Clone + '_ {
    polygon[1..]
        .windows(2)
        .map(|pair| [polygon[0], pair[0], pair[1]])
}

/// Area-uniform point of a fan of triangles.
fn sample_fan(triangles: impl Iterator<Item = [DVec3; 3]> + Clone, [x, y]: [f64; 2]) -> DVec3 {
    let total: f64 = triangles.clone().map(triangle_area).sum();
    let mut rest = x * total;
    let mut last = None;
    for corners in triangles {
        let area = triangle_area(corners);
        if rest < area {
            return sample_triangle(corners, [rest / area, y]);
        }
        rest -= area;
        last = Some(corners);
    }
    // Rounding let the sum fall short of the total.
    sample_triangle(last.expect("a polygon has at least one triangle"), [1.0, y])
}
