//! A region: faces that are meshed together, and the map between points and elements.

use super::Side;
use super::clipped::Clipped;
use super::cuts::{Cuts, Part};
use super::quad_grid::QuadGrid;
use super::triangle_grid::TriangleGrid;
use crate::geometry::{Geometry, ray_origin};
use glam::{DVec3, Vec3};
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

/// Faces that are meshed together. Its elements are numbered from zero: those of its shape, or the first
/// part of each that walls divide, then the other parts. The patches of its front start at `first`, those of
/// its back (of two-sided faces) at `first_back`.
#[derive(Clone, Debug)]
pub(super) struct Region {
    pub(super) shape: Shape,
    pub(super) faces: Vec<FaceId>,
    /// The walls across it; `None` without, and before it has been examined.
    pub(super) cuts: Option<Box<Cuts>>,
    pub(super) is_examined: bool,
    pub(super) first: u32,
    pub(super) first_back: Option<u32>,
}

/// How a region is divided.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    /// A convex quad, divided along the lines of its bilinear map.
    Quad(QuadGrid),
    /// A triangle, divided into similar ones.
    Triangle(TriangleGrid),
    /// A polygon of five or more corners, divided by a square grid.
    Clipped(Clipped),
    /// One element: whole faces, with their cumulative share of the area.
    Faces { cumulative: Vec<f64> },
}

/// Area-uniform point of a triangle for a uniform sample; keeps strata connected.
///
/// Source: G. Turk, "Generating Random Points in Triangles", Graphics Gems, 1990.
pub(super) fn sample_triangle([a, b, c]: [DVec3; 3], [x, y]: [f64; 2]) -> DVec3 {
    let root = x.sqrt();
    a * (1.0 - root) + b * (root * (1.0 - y)) + c * (root * y)
}

pub(super) fn triangle_area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

impl Region {
    /// Elements on one side.
    pub(super) fn element_count(&self) -> u32 {
        self.shape_count() + self.cuts.as_ref().map_or(0, |cuts| cuts.extra())
    }

    /// Elements of the shape, whether walls divide them or not.
    pub(super) fn shape_count(&self) -> u32 {
        match &self.shape {
            Shape::Quad(quad) => quad.forest().len(),
            Shape::Triangle(triangle) => triangle.forest().len(),
            Shape::Clipped(clipped) => clipped.elements.len() as u32,
            Shape::Faces { .. } => 1,
        }
    }

    /// The element at a point, which is computed only where it matters. Beside a wall it is that on the
    /// side of `seen_from`.
    pub(super) fn element_at(
        &self,
        point: impl FnOnce() -> DVec3,
        seen_from: Option<DVec3>,
    ) -> u32 {
        match &self.cuts {
            None => self.shape_at(point),
            Some(cuts) => cuts.element_at(point(), seen_from, |point| self.shape_at(|| point)),
        }
    }

    /// The element of the shape that an element is or is a part of.
    pub(super) fn whole(&self, element: u32) -> u32 {
        self.cuts
            .as_ref()
            .map_or(element, |cuts| cuts.whole(element))
    }

    fn shape_at(&self, point: impl FnOnce() -> DVec3) -> u32 {
        match &self.shape {
            Shape::Quad(quad) => quad.element_at(point()),
            Shape::Triangle(triangle) => triangle.element_at(point()),
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

    fn part(&self, element: u32) -> Option<&Part> {
        self.cuts.as_ref()?.part(element)
    }

    pub(super) fn element_area(&self, geometry: &Geometry, element: u32) -> f64 {
        match self.part(element) {
            None => self.shape_area(geometry, element),
            Some(part) => part.area(),
        }
    }

    pub(super) fn shape_area(&self, geometry: &Geometry, element: u32) -> f64 {
        match &self.shape {
            Shape::Quad(quad) => {
                let [a, b, c, d] = quad.cell(element);
                0.5 * (c - a).cross(d - b).length()
            }
            Shape::Triangle(triangle) => triangle_area(triangle.cell(element)),
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
        match self.part(element) {
            None => self.shape_polygons(geometry, element),
            Some(part) => part.polygons.clone(),
        }
    }

    pub(super) fn shape_polygons(&self, geometry: &Geometry, element: u32) -> Vec<Vec<DVec3>> {
        match &self.shape {
            Shape::Quad(quad) => vec![quad.cell(element).to_vec()],
            Shape::Triangle(triangle) => vec![triangle.cell(element).to_vec()],
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
        sample: [f64; 2],
    ) -> SurfaceSample {
        let (face, position) = match &self.cuts {
            None => self.shape_sample(geometry, element, sample),
            Some(cuts) => {
                let at = |[x, y]: [f64; 2]| match cuts.part(element) {
                    None => self.shape_sample(geometry, element, [x, y]),
                    Some(part) => {
                        let (face, corners, x) = part.triangle(x);
                        (face, sample_triangle(corners, [x, y]))
                    }
                };
                let (face, position) = at(sample);
                // No point of a part that is wider than the guard of its walls is nearer to them than the
                // middle of a triangle.
                let middle = match cuts.part(element) {
                    None => self.middle(geometry, element),
                    Some(part) => part.middle(sample[0]),
                };
                (face, cuts.kept_off(element, position, middle))
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

    /// The mean of the corners of an element of the shape.
    fn middle(&self, geometry: &Geometry, element: u32) -> DVec3 {
        let polygons = self.shape_polygons(geometry, element);
        let corners = || polygons.iter().flatten();
        corners().sum::<DVec3>() / corners().count() as f64
    }

    /// A point of an element of the shape, and its face.
    fn shape_sample(
        &self,
        geometry: &Geometry,
        element: u32,
        [mut x, y]: [f64; 2],
    ) -> (FaceId, DVec3) {
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
            Shape::Triangle(triangle) => sample_triangle(triangle.cell(element), [x, y]),
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
        (face, position)
    }
}

/// The triangles of a convex polygon.
pub(super) fn fan(polygon: &[DVec3]) -> impl Iterator<Item = [DVec3; 3]> + Clone + '_ {
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
