//! A planar convex polygon with what form factors ask of it, computed once.

use super::clip::{Plane, clip};
use glam::DVec3;
use thiserror::Error;

/// Why vertices do not bound a polygon that has form factors.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum PolygonError {
    /// Fewer than three vertices.
    #[error("a polygon needs at least 3 vertices, not {0}")]
    TooFewVertices(usize),
    /// A coordinate is NaN or infinite.
    #[error("vertex {0} is not finite")]
    NotFinite(usize),
    /// All vertices lie on one line.
    #[error("the polygon has no area")]
    NoArea,
}

/// A planar convex polygon, counter-clockwise seen from its front.
#[derive(Clone, Debug, PartialEq)]
pub struct Polygon {
    vertices: Vec<DVec3>,
    normal: DVec3,
    area: f64,
    centre: DVec3,
    radius: f64,
    bounds: [DVec3; 2],
}

impl Polygon {
    /// A polygon from its vertices in metres, counter-clockwise from its front. Planarity and
    /// convexity are the caller's to keep; a polygon that is not planar is taken as its boundary.
    ///
    /// # Errors
    /// When there are fewer than three vertices, one is not finite, or the area is zero.
    pub fn new(vertices: &[DVec3]) -> Result<Self, PolygonError> {
        if vertices.len() < 3 {
            return Err(PolygonError::TooFewVertices(vertices.len()));
        }
        if let Some(at) = vertices.iter().position(|v| !v.is_finite()) {
            return Err(PolygonError::NotFinite(at));
        }
        Self::assemble(vertices.to_vec()).ok_or(PolygonError::NoArea)
    }

    /// The polygon of vertices known to be finite, if it has an area.
    fn assemble(vertices: Vec<DVec3>) -> Option<Self> {
        let first = *vertices.first()?;
        let mut vector_area = DVec3::ZERO;
        let mut moment = DVec3::ZERO;
        let mut previous = DVec3::ZERO;
        let mut extent = 0.0_f64;
        for &v in &vertices[1..] {
            let u = v - first;
            vector_area += previous.cross(u) * 0.5;
            extent = extent.max(u.length());
            previous = u;
        }
        let area = vector_area.length();
        // Below, the cross products are rounding: the normal would be noise.
        if area <= 4.0 * f64::EPSILON * extent * extent {
            return None;
        }
        let normal = vector_area / area;
        for pair in vertices[1..].windows(2) {
            let (a, b) = (pair[0] - first, pair[1] - first);
            moment += (a + b) * (a.cross(b).dot(normal) / 6.0);
        }
        let centre = first + moment / area;
        let radius = vertices
            .iter()
            .map(|v| v.distance(centre))
            .fold(0.0, f64::max);
        let bounds = [
            vertices.iter().copied().fold(first, DVec3::min),
            vertices.iter().copied().fold(first, DVec3::max),
        ];
        Some(Self {
            vertices,
            normal,
            area,
            centre,
            radius,
            bounds,
        })
    }

    /// Its vertices in metres.
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// Unit normal of the front.
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Area in m².
    pub fn area(&self) -> f64 {
        self.area
    }

    /// Centre of gravity in metres.
    pub fn centre(&self) -> DVec3 {
        self.centre
    }

    /// Radius in metres of the sphere around the centre that holds the polygon.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Lower and upper corner of its bounding box in metres.
    pub(super) fn bounds(&self) -> [DVec3; 2] {
        self.bounds
    }

    /// The plane it lies in, facing where it faces.
    pub fn plane(&self) -> Plane {
        Plane {
            point: self.vertices[0],
            normal: self.normal,
        }
    }

    /// Its edges as pairs of vertices.
    pub(super) fn edges(&self) -> impl ExactSizeIterator<Item = (DVec3, DVec3)> + Clone + '_ {
        let n = self.vertices.len();
        (0..n).map(move |k| (self.vertices[k], self.vertices[(k + 1) % n]))
    }

    /// The part in front of a plane, if it has an area.
    pub(super) fn in_front_of(&self, plane: &Plane) -> Option<Self> {
        let mut out = Vec::with_capacity(self.vertices.len() + 1);
        clip(&self.vertices, plane, &mut out);
        if out.is_empty() {
            None
        } else {
            Self::assemble(out)
        }
    }

    /// True when no part lies behind a plane.
    pub(super) fn is_in_front_of(&self, plane: &Plane) -> bool {
        self.vertices.iter().all(|&v| plane.height(v) >= 0.0)
    }

    /// Halves, cut through the centre across the longest edge.
    pub(super) fn halves(&self) -> [Option<Self>; 2] {
        let along = self
            .edges()
            .map(|(a, b)| b - a)
            .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
            .unwrap_or(DVec3::X);
        [along, -along].map(|normal| {
            self.in_front_of(&Plane {
                point: self.centre,
                normal,
            })
        })
    }

    /// The polygon moved by −`origin` and then scaled.
    pub(super) fn relative_to(&self, origin: DVec3, scale: f64) -> Self {
        Self {
            vertices: self
                .vertices
                .iter()
                .map(|&v| (v - origin) * scale)
                .collect(),
            normal: self.normal,
            area: self.area * scale * scale,
            centre: (self.centre - origin) * scale,
            radius: self.radius * scale,
            bounds: self.bounds.map(|v| (v - origin) * scale),
        }
    }

    /// Distance in metres from a point to the nearest point of the polygon.
    pub(super) fn distance(&self, point: DVec3) -> f64 {
        let offset = point - self.centre;
        let height = offset.dot(self.normal);
        let is_above = self
            .edges()
            .all(|(a, b)| (b - a).cross(point - a).dot(self.normal) >= 0.0);
        if is_above {
            return height.abs();
        }
        self.edges()
            .map(|(a, b)| segment_distance_squared(point, a, b))
            .fold(f64::INFINITY, f64::min)
            .sqrt()
    }
}

/// Squared distance from a point to a segment.
pub(super) fn segment_distance_squared(point: DVec3, a: DVec3, b: DVec3) -> f64 {
    let along = b - a;
    let t = (point - a).dot(along) / along.length_squared();
    let t = if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) };
    point.distance_squared(a + along * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trapezium_has_its_area_centre_and_normal() {
        let polygon = Polygon::new(&[
            DVec3::new(0.0, 0.0, 2.0),
            DVec3::new(3.0, 0.0, 2.0),
            DVec3::new(1.0, 1.0, 2.0),
            DVec3::new(0.0, 1.0, 2.0),
        ])
        .expect("a polygon");
        // Area (3 + 1)/2; centre of a unit square and of a triangle of area 1.
        assert!((polygon.area() - 2.0).abs() < 1e-15, "area");
        let centre = DVec3::new(13.0, 5.0, 24.0) / 12.0;
        assert!(polygon.centre().distance(centre) < 1e-15, "centre");
        assert_eq!(polygon.normal(), DVec3::Z, "normal");
        assert!(
            (polygon.distance(DVec3::new(4.0, 0.0, 3.0)) - 2.0_f64.sqrt()).abs() < 1e-15,
            "distance beside it"
        );
        assert!(
            (polygon.distance(DVec3::new(0.5, 0.5, -1.0)) - 3.0).abs() < 1e-15,
            "distance below it"
        );
    }

    #[test]
    fn what_is_no_polygon_is_refused_with_the_reason() {
        let (o, x) = (DVec3::ZERO, DVec3::X);
        assert_eq!(
            Polygon::new(&[o, x]),
            Err(PolygonError::TooFewVertices(2)),
            "two vertices"
        );
        assert_eq!(
            Polygon::new(&[o, x, DVec3::NAN]),
            Err(PolygonError::NotFinite(2)),
            "NaN"
        );
        assert_eq!(
            Polygon::new(&[o, x, x * 3.0]),
            Err(PolygonError::NoArea),
            "collinear"
        );
    }

    #[test]
    fn halves_cover_the_whole() {
        let polygon = Polygon::new(&[DVec3::ZERO, DVec3::X * 7.0, DVec3::Y]).expect("a triangle");
        let area: f64 = polygon.halves().iter().flatten().map(Polygon::area).sum();
        assert!((area - 3.5).abs() < 1e-14, "{area}");
    }
}
