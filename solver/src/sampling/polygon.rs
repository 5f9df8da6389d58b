//! A planar convex polygon, uniformly by area.
//!
//! Equation: a quadrilateral is the bilinear image P(s, t) of the unit square; where it is planar
//! its Jacobian |∂P/∂s × ∂P/∂t| is linear in s and t, so that (s, t) drawn with the bilinear
//! density of its values at the corners is uniform by area. Other polygons are fans of triangles,
//! one of them chosen in proportion to its area with the remainder of u₀. p = 1/A per area.
//!
//! Source: J. Arvo, "Stratified sampling of 2-manifolds", SIGGRAPH course notes, 2001 (sampling
//! through the Jacobian's marginals); fans by [`super::discrete`] and [`super::triangle`].
//!
//! Validity: planar, convex, of non-zero area; collinear corners are allowed. Parallelograms are
//! sampled by the affine map. Cost: O(1) for up to four corners, O(log n) else.

use super::{bilinear, discrete::Discrete, triangle};
use glam::DVec3;

/// A polygon prepared for sampling.
#[derive(Clone, Debug, PartialEq)]
pub struct Polygon {
    vertices: Vec<DVec3>,
    /// Unit normal.
    normal: DVec3,
    area: f64,
    map: Map,
}

/// How the unit square is laid over the polygon.
#[derive(Clone, Debug, PartialEq)]
enum Map {
    /// As it is: a parallelogram.
    Affine,
    /// Bilinearly, with the Jacobian at (0, 0), (1, 0), (0, 1), (1, 1).
    Quadrilateral([f64; 4]),
    /// A fan around corner 0.
    Fan(Discrete),
}

impl Polygon {
    /// Prepares a planar convex polygon (metres); `None` where its area is zero or not finite, or
    /// where it has fewer than three corners.
    pub fn new(vertices: &[DVec3]) -> Option<Self> {
        let (&origin, rest) = vertices.split_first()?;
        let fan = || {
            rest.windows(2)
                .map(|edge| (edge[0] - origin).cross(edge[1] - origin) * 0.5)
        };
        let vector_area: DVec3 = fan().sum();
        let area = vector_area.length();
        if !(area > 0.0 && area.is_finite()) {
            return None;
        }
        let normal = vector_area / area;
        let map = if let &[a, b, c, d] = vertices {
            let jacobian = |s: DVec3, t: DVec3| s.cross(t).dot(normal).max(0.0);
            let twist = (a + c) - (b + d);
            if twist.length_squared() <= 1e-24 * (c - a).length_squared() {
                Map::Affine
            } else {
                Map::Quadrilateral([
                    jacobian(b - a, d - a),
                    jacobian(b - a, c - b),
                    jacobian(c - d, d - a),
                    jacobian(c - d, c - b),
                ])
            }
        } else {
            Map::Fan(Discrete::new(fan().map(|part| part.dot(normal).max(0.0))).ok()?)
        };
        Some(Self {
            vertices: vertices.to_vec(),
            normal,
            area,
            map,
        })
    }

    /// Its area in m².
    pub fn area(&self) -> f64 {
        self.area
    }

    /// Its unit normal: the side from which the corners run counter-clockwise.
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Density per area of every point: 1/A, in 1/m².
    pub fn pdf(&self) -> f64 {
        1.0 / self.area
    }

    /// The point (metres) for `u` in the unit square.
    pub fn sample(&self, u: [f64; 2]) -> DVec3 {
        match &self.map {
            Map::Affine => {
                let [a, b, _, d] = self.corners();
                a + (b - a) * u[0] + (d - a) * u[1]
            }
            Map::Quadrilateral(jacobian) => {
                let [s, t] = bilinear::sample(u, *jacobian);
                let [a, b, c, d] = self.corners();
                a.lerp(b, s).lerp(d.lerp(c, s), t)
            }
            Map::Fan(areas) => {
                let choice = areas.sample(u[0]);
                let barycentric = triangle::sample([choice.remainder, u[1]]);
                self.triangle(choice.index)
                    .into_iter()
                    .zip(barycentric)
                    .map(|(vertex, weight)| vertex * weight)
                    .sum()
            }
        }
    }

    /// The point of the unit square that [`Self::sample`] maps to `point`, which lies in the
    /// polygon.
    pub fn invert(&self, point: DVec3) -> [f64; 2] {
        match &self.map {
            Map::Affine => self.invert_bilinear(point),
            Map::Quadrilateral(jacobian) => {
                bilinear::invert(self.invert_bilinear(point), *jacobian)
            }
            Map::Fan(areas) => {
                // The part in which the point is deepest inside: rounding may put it outside all.
                let depth = |b: [f64; 3]| b.into_iter().fold(f64::INFINITY, f64::min);
                let parts = (0..areas.len()).filter(|&i| areas.probability(i) > 0.0);
                let (index, barycentric) = parts
                    .map(|i| (i, self.barycentric(i, point)))
                    .max_by(|(_, a), (_, b)| depth(*a).total_cmp(&depth(*b)))
                    .unwrap_or((0, [1.0 / 3.0; 3]));
                let [remainder, v] = triangle::invert(barycentric);
                [areas.invert(index, remainder), v]
            }
        }
    }

    fn corners(&self) -> [DVec3; 4] {
        [0, 1, 2, 3].map(|corner| self.vertices[corner])
    }

    fn triangle(&self, part: usize) -> [DVec3; 3] {
        [
            self.vertices[0],
            self.vertices[part + 1],
            self.vertices[part + 2],
        ]
    }

    fn barycentric(&self, part: usize, point: DVec3) -> [f64; 3] {
        let [a, b, c] = self.triangle(part).map(|vertex| vertex - point);
        let parts = [b.cross(c), c.cross(a), a.cross(b)].map(|v| v.dot(self.normal));
        let sum: f64 = parts.iter().sum();
        parts.map(|p| p / sum)
    }

    /// (s, t) with P(s, t) = `point`. With e, f, g the edges from corner 0 and the twist,
    /// point − P₀ = e s + f t + g s t; the component across e + g t vanishes, which is a quadratic
    /// equation in t, solved without cancellation.
    fn invert_bilinear(&self, point: DVec3) -> [f64; 2] {
        let [a, b, c, d] = self.corners();
        let (e, f, g, h) = (b - a, d - a, (a - b) + (c - d), point - a);
        let cross = |p: DVec3, q: DVec3| p.cross(q).dot(self.normal);
        let (k2, k1, k0) = (cross(g, f), cross(e, f) + cross(h, g), cross(h, e));
        let root = (k1 * k1 - 4.0 * k2 * k0).max(0.0).sqrt();
        let q = -0.5 * (k1 + root.copysign(k1));
        let candidates = [k0 / q, q / k2];
        let outside = |t: f64| {
            if t.is_nan() {
                f64::INFINITY
            } else {
                (t - 0.5).abs()
            }
        };
        let t = if outside(candidates[0]) <= outside(candidates[1]) {
            candidates[0]
        } else {
            candidates[1]
        };
        let across = e + g * t;
        let s = (h - f * t).dot(across) / across.length_squared();
        [s.clamp(0.0, 1.0), t.clamp(0.0, 1.0)]
    }
}
