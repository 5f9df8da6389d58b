//! Directions from a point to a triangle, uniformly by solid angle.
//!
//! Equation: for unit vectors a, b, c to the corners, tan(Ω/2) = G₀ / (G₁ + G₂) with
//! G₀ = |det(a, b, c)|, G₁ = c·(a + b), G₂ = 1 + a·b = |a + b|²/2. The corner c′ on the arc from
//! a to c that cuts off the solid angle Ω′ = u₀Ω together with b is a mirrored at
//! r = (G₀ cos Ω′/2 − G₁ sin Ω′/2) a + G₂ sin(Ω′/2) c; on the arc from b to c′ the distance
//! 1 − b·ω is proportional to u₁. p = 1/Ω per solid angle.
//!
//! Sources: A. van Oosterom, J. Strackee, "The solid angle of a plane triangle", IEEE Trans.
//! Biomed. Eng. 30(2), 1983 (Ω); J. Arvo, "Stratified sampling of spherical triangles", SIGGRAPH
//! 1995 (the construction); C. Peters, "BRDF importance sampling for polygonal lights", ACM TOG
//! 40(4), 2021 (without inverse functions and stable). Differences of nearly equal numbers are
//! written here as half squared distances of unit vectors, which hold for tiny triangles too.
//!
//! Validity: any triangle, either orientation, solid angles from [`MIN_SOLID_ANGLE`] up to the
//! hemisphere; below that points are drawn by area with the density that belongs to them. The
//! relative error of a position in the triangle is about 1e-16/√Ω.
//!
//! Cost: one sine, one cosine, two square roots a sample; preparation is three square roots and an
//! arc tangent.

use super::triangle;
use glam::DVec3;

/// Solid angle in sr below which sampling is by area. At this size of a well-shaped triangle
/// the error of a position is 1e-10 of its extent; a sliver one radian long is 1e-12 wide, and
/// rounding of directions begins to show. Larger values would bring back the variance of 1/r² for
/// lights seen edge-on, for nothing; much smaller ones let directions miss slivers.
pub const MIN_SOLID_ANGLE: f64 = 1e-12;

/// A triangle as seen from a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphericalTriangle {
    /// From the point to the corners, metres.
    vertices: [DVec3; 3],
    /// Unit vectors to the corners.
    corners: [DVec3; 3],
    /// G₀, G₁, G₂ of the file's header.
    g: [f64; 3],
    solid_angle: f64,
}

/// A direction to a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleSample {
    /// Unit vector from the point to the triangle.
    pub direction: DVec3,
    /// Where it meets the triangle: weights of the corners, in [0, 1], sum 1.
    pub barycentric: [f64; 3],
    /// Density per solid angle, 1/sr.
    pub pdf: f64,
}

impl SphericalTriangle {
    /// The triangle `vertices` (metres) seen from `origin`; `None` where it covers no solid angle:
    /// degenerate, edge-on, or with a corner at `origin`.
    pub fn new(origin: DVec3, vertices: [DVec3; 3]) -> Option<Self> {
        let vertices = vertices.map(|vertex| vertex - origin);
        let lengths = vertices.map(DVec3::length);
        let [a, b, c] = [0, 1, 2].map(|i| vertices[i] / lengths[i]);
        // From the edges, which are exact where the triangle is small: no cancellation.
        let volume = vertices[0].dot((vertices[1] - vertices[0]).cross(vertices[2] - vertices[0]));
        let g = [
            volume.abs() / lengths[0] / lengths[1] / lengths[2],
            c.dot(a + b),
            0.5 * (a + b).length_squared(),
        ];
        let solid_angle = 2.0 * g[0].atan2(g[1] + g[2]);
        // A point in the triangle's own plane sees nothing of it, or stands on it.
        (g[0] > 0.0 && solid_angle > 0.0).then_some(Self {
            vertices,
            corners: [a, b, c],
            g,
            solid_angle,
        })
    }

    /// Ω in sr, in (0, 2π].
    pub fn solid_angle(&self) -> f64 {
        self.solid_angle
    }

    /// Unit vectors to the corners.
    pub fn corners(&self) -> [DVec3; 3] {
        self.corners
    }

    /// True where samples are uniform by solid angle, false where the triangle is so small that
    /// they are uniform by area.
    pub fn is_uniform(&self) -> bool {
        self.solid_angle >= MIN_SOLID_ANGLE
    }

    /// A direction for `u` in the unit square. u₁ = 0 is corner 1, u₁ = 1 the edge from corner 0
    /// (u₀ = 0) to corner 2 (u₀ = 1).
    pub fn sample(&self, u: [f64; 2]) -> TriangleSample {
        if !self.is_uniform() {
            let barycentric = triangle::sample(u);
            let direction = self.towards(barycentric);
            return TriangleSample {
                direction,
                barycentric,
                pdf: self.area_pdf(barycentric),
            };
        }
        let [a, b, c] = self.corners;
        let [g0, g1, g2] = self.g;
        let (sin, cos) = (0.5 * u[0] * self.solid_angle).sin_cos();
        let r = a * (g0 * cos - g1 * sin) + c * (g2 * sin);
        let cut = r * (2.0 * a.dot(r) / r.length_squared()) - a;
        // 1 − b·c′ and 1 + b·c′.
        let (near, far) = (
            0.5 * (b - cut).length_squared(),
            0.5 * (b + cut).length_squared(),
        );
        // √((1 − s²)/(1 − (b·c′)²)) with 1 − s = u₁ (1 − b·c′).
        let t = (u[1] * (2.0 * (1.0 - u[1]) + u[1] * far) / far).sqrt();
        let direction = (b * (1.0 - u[1] * near - t * (1.0 - near)) + cut * t).normalize();
        TriangleSample {
            direction,
            barycentric: self.barycentric(direction),
            pdf: 1.0 / self.solid_angle,
        }
    }

    /// Density per solid angle (1/sr) of [`Self::sample`] at a direction that meets the triangle.
    pub fn pdf(&self, direction: DVec3) -> f64 {
        if self.is_uniform() {
            1.0 / self.solid_angle
        } else {
            self.area_pdf(self.barycentric(direction))
        }
    }

    /// The point of the unit square that [`Self::sample`] maps to `direction`, which meets the
    /// triangle.
    pub fn invert(&self, direction: DVec3) -> [f64; 2] {
        if !self.is_uniform() {
            return triangle::invert(self.barycentric(direction));
        }
        let [a, b, c] = self.corners;
        // Differences keep the normals of the two planes exact where the triangle is small.
        let cut = (b.cross(direction - b)).cross(a.cross(c - a));
        let cut = cut * cut.dot(a + c).signum();
        let Some(cut) = cut.try_normalize() else {
            // The direction of corner 1 belongs to every u₀.
            return [0.5, 0.0];
        };
        let part = Self::new(DVec3::ZERO, [a, b, cut]).map_or(0.0, |part| part.solid_angle);
        let u1 = (direction - b).length_squared() / (cut - b).length_squared();
        [(part / self.solid_angle).min(1.0), u1.min(1.0)]
    }

    /// Weights of the corners at the point that `direction` meets; clamped to the triangle.
    pub fn barycentric(&self, direction: DVec3) -> [f64; 3] {
        let [a, b, c] = self.vertices;
        // Ratios of the volumes that the direction spans with two corners each; b − a for b keeps
        // them exact where the triangle is small and far.
        let volumes = [
            direction.dot(b.cross(c - b)),
            direction.dot(c.cross(a - c)),
            direction.dot(a.cross(b - a)),
        ];
        let total: f64 = volumes.iter().sum();
        let weights = volumes.map(|volume| (volume / total).max(0.0));
        let sum: f64 = weights.iter().sum();
        if sum > 0.0 {
            weights.map(|weight| weight / sum)
        } else {
            [1.0 / 3.0; 3]
        }
    }

    /// Unit vector to a point of the triangle.
    fn towards(&self, barycentric: [f64; 3]) -> DVec3 {
        self.position(barycentric).normalize()
    }

    fn position(&self, [p, q, r]: [f64; 3]) -> DVec3 {
        let [a, b, c] = self.vertices;
        a * p + b * q + c * r
    }

    /// Density per solid angle of a point that is uniform by area: d² / (A |cos θ|) = 2 d³ / V
    /// with V = |det| of the corners, six times the volume over the triangle.
    fn area_pdf(&self, barycentric: [f64; 3]) -> f64 {
        let [a, b, c] = self.vertices;
        let volume = a.dot((b - a).cross(c - a)).abs();
        2.0 * self.position(barycentric).length().powi(3) / volume
    }
}
