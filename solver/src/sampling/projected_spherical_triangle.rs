//! Directions from a surface point to a triangle, nearly uniformly by projected solid angle.
//!
//! Equation: the uniform map of [`super::spherical_triangle`] after a bilinear warp of its square
//! by the cosines at the corners: p(ω) = q(u)/Ω with q the bilinear density at the warped u.
//!
//! Source: D. Hart, M. Pharr, T. Müller, W. Lopes, M. McGuire, P. Shirley, "Practical product
//! sampling by fitting and composing warps", EGSR 2020; as in M. Pharr, W. Jakob, G. Humphreys,
//! "Physically Based Rendering", 4th edition, 2023, §6.5.4.
//!
//! Validity: as there. The density is exact, so that weights cos θ / p are unbiased; they are
//! nearly equal, not equal, and vary most where the triangle crosses the horizon. Cost: that of
//! the uniform map and two square roots.

use super::bilinear;
use super::spherical_triangle::{SphericalTriangle, TriangleSample};
use glam::DVec3;

/// Least cosine that a corner counts with. The interior of a triangle with all corners at the
/// horizon is above it: with 0 such directions would get no samples and the estimate would be
/// biased; a larger value wastes samples at the horizon.
const MIN_COSINE: f64 = 0.01;

/// A triangle as seen from a point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProjectedSphericalTriangle {
    triangle: SphericalTriangle,
    /// Cosines at (0, 0), (1, 0), (0, 1), (1, 1) of the uniform map's square.
    cosines: [f64; 4],
}

impl ProjectedSphericalTriangle {
    /// The triangle `vertices` (metres) seen from `origin` on a surface of unit normal `normal`;
    /// `None` where it covers no solid angle. Parts below the horizon are sampled too, with few
    /// samples, which the caller gives no weight.
    pub fn new(origin: DVec3, normal: DVec3, vertices: [DVec3; 3]) -> Option<Self> {
        let triangle = SphericalTriangle::new(origin, vertices)?;
        let [a, b, c] = triangle
            .corners()
            .map(|corner| corner.dot(normal).max(MIN_COSINE));
        Some(Self {
            triangle,
            cosines: [b, b, a, c],
        })
    }

    /// The triangle without regard to the normal.
    pub fn triangle(&self) -> &SphericalTriangle {
        &self.triangle
    }

    /// A direction for `u` in the unit square.
    pub fn sample(&self, u: [f64; 2]) -> TriangleSample {
        if !self.triangle.is_uniform() {
            return self.triangle.sample(u);
        }
        let warped = bilinear::sample(u, self.cosines);
        let mut sample = self.triangle.sample(warped);
        sample.pdf *= bilinear::pdf(warped, self.cosines);
        sample
    }

    /// Density per solid angle (1/sr) of [`Self::sample`] at a direction that meets the triangle.
    pub fn pdf(&self, direction: DVec3) -> f64 {
        let uniform = self.triangle.pdf(direction);
        if self.triangle.is_uniform() {
            uniform * bilinear::pdf(self.triangle.invert(direction), self.cosines)
        } else {
            uniform
        }
    }

    /// The point of the unit square that [`Self::sample`] maps to `direction`, which meets the
    /// triangle.
    pub fn invert(&self, direction: DVec3) -> [f64; 2] {
        let warped = self.triangle.invert(direction);
        if self.triangle.is_uniform() {
            bilinear::invert(warped, self.cosines)
        } else {
            warped
        }
    }
}
