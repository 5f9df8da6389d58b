//! Rays and hits, in the unit frame.

use super::triangle::Point;
use crate::geometry::TriangleId;
use glam::Vec3;

/// A ray in the unit frame. Only hits with `tmin` ≤ t < `tmax` count.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Ray {
    /// Origin, within about twice the bounds of the scene.
    pub origin: Vec3,
    /// Nearest distance that counts, in lengths of `direction`, at least +0.
    pub tmin: f32,
    /// Direction. Its length is the unit of t; directions of unit length are the rule.
    pub direction: Vec3,
    /// Distance from which nothing counts.
    pub tmax: f32,
}

impl Ray {
    /// A ray without an end.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self {
            origin,
            tmin: 0.0,
            direction,
            tmax: f32::INFINITY,
        }
    }

    /// The open segment from `origin` to `target`. A target on a surface should be moved off it by
    /// the rounding bound ([`crate::geometry::ray_target`]), as the origin is.
    ///
    /// The boxes around its target's surface are entered although nothing in them counts: half of the cost in
    /// a bare room of many triangles. To end 64 ulp earlier saves that, and lets light through walls that
    /// touch a lamp.
    pub fn segment(origin: Vec3, target: Vec3) -> Self {
        Self {
            origin,
            tmin: 0.0,
            direction: target - origin,
            tmax: 1.0,
        }
    }

    /// The point at distance t.
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}

/// What a ray met first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in lengths of the ray's direction; infinite for a miss.
    pub t: f32,
    /// Weight of the triangle's second corner.
    pub u: f32,
    /// Weight of the triangle's third corner.
    pub v: f32,
    triangle: u32,
}

impl Hit {
    /// Nothing was hit.
    pub const MISS: Self = Self {
        t: f32::INFINITY,
        u: 0.0,
        v: 0.0,
        triangle: u32::MAX,
    };

    #[inline]
    pub(super) fn new(point: Point, triangle: u32) -> Self {
        let Point { t, u, v } = point;
        Self { t, u, v, triangle }
    }

    /// Whether a point of `triangle` at no more than `nearest` takes this hit's place, which is at
    /// `nearest` unless it is a miss: when it is nearer, or as near with a lower id.
    #[inline]
    pub(super) fn is_replaced_by(&self, point: &Point, nearest: f32, triangle: u32) -> bool {
        point.t < nearest || triangle < self.triangle
    }

    /// The triangle, or `None` for a miss.
    pub fn triangle(&self) -> Option<TriangleId> {
        (self.triangle != u32::MAX).then_some(TriangleId(self.triangle))
    }
}
