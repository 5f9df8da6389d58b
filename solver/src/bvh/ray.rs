//! Rays and hits, in the unit frame.

use crate::geometry::TriangleId;
use glam::Vec3;

/// A ray in the unit frame. Only hits with `tmin` ≤ t < `tmax` count.
#[derive(Clone, Copy, Debug, PartialEq)]
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

    pub(super) fn new(t: f32, u: f32, v: f32, triangle: u32) -> Self {
        Self { t, u, v, triangle }
    }

    /// The triangle, or `None` for a miss.
    pub fn triangle(&self) -> Option<TriangleId> {
        (self.triangle != u32::MAX).then_some(TriangleId(self.triangle))
    }
}
