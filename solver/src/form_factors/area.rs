//! Exchange area by quadrature over areas, for polygons that are well separated.
//!
//! S = A₁F₁₂ = ∫∫ cos θ₁ cos θ₂ / (π r²) dA₂ dA₁, either by Gauss–Legendre rules over both areas, or over
//! one of them with Lambert's formula for the other. Nothing cancels: the relative error does not
//! grow as polygons become small and far.
//!
//! # How many points
//!
//! Along a line across one polygon, of half length a, the kernel is analytic up to complex points no
//! nearer to the line's centre than the distance d to the other polygon (r² vanishes there). An
//! n-point rule therefore converges as ρ^(−2n), ρ = x + √(x² − 1), x = d/a: the Bernstein ellipse through
//! the nearest singularity. The pole is of fourth order in r, which multiplies by at most
//! C(n) = n (2n + 2)(2n + 3) π/6 (the Gauss remainder with the 2n-th derivative (2n + 3)!/3! d^(−2n) of
//! r⁻⁴). [`order`] solves for n.
//!
//! The cosines make a factor f(x) g(y), the heights of each point above the other's plane over r², linear in
//! each. Where the height h varies little over a polygon (h > 2R), the product's derivative exceeds that
//! of r⁻⁴ by at most 1 + d/h, and so much more accuracy is asked for. Where it varies by its own size, two
//! more degrees are integrated (one more point), which takes in f and the Jacobian exactly; f is then
//! at most three times its mean, so a quarter of the error is asked for. A Jacobian that is not
//! constant (a triangle, a trapezium) also costs one more point.
//!
//! Sources: P. J. Davis, P. Rabinowitz, "Methods of Numerical Integration", 2nd edition, 1984, section
//! 4.6; L. N. Trefethen, "Is Gauss quadrature better than Clenshaw–Curtis?", SIAM Review 50(1), 2008,
//! theorem 4.5. Valid for polygons entirely in front of each other. Cost: about 4 ns per pair of
//! points, or one Lambert formula per point.

use super::gauss::{Node, gauss};
use super::point_to_polygon::point_to_polygon;
use super::polygon::Polygon;
use glam::DVec3;
use std::f64::consts::PI;

/// The largest number of points along one direction: beyond, polygons are near and the contour
/// integral is both faster and exact.
pub(super) const MAX_ORDER: usize = 14;

/// Points along the two directions of a quadrilateral piece of a polygon.
pub(super) type Orders = [usize; 2];

/// A quadrilateral with corners in order; a triangle repeats its last one.
pub(super) type Quad = [DVec3; 4];

/// The fewest points along a line of half length `half` whose centre is `distance` away from the other
/// polygon that integrate the kernel to a relative `accuracy`; `None` beyond [`MAX_ORDER`].
pub(super) fn order(half: f64, distance: f64, accuracy: f64) -> Option<usize> {
    if half == 0.0 {
        return Some(1);
    }
    let x = distance / half;
    if x.is_nan() || x <= 1.25 {
        return None;
    }
    let rho = x + (x * x - 1.0).sqrt();
    let step = 1.0 / (rho * rho);
    let mut decay = 1.0;
    (1..=MAX_ORDER).find(|&n| {
        decay *= step;
        let n = n as f64;
        decay * n * (2.0 * n + 2.0) * (2.0 * n + 3.0) * PI / 6.0 <= accuracy
    })
}

/// The pieces of a polygon as quadrilaterals.
pub(super) fn quads(polygon: &Polygon) -> impl Iterator<Item = Quad> + '_ {
    let v = polygon.vertices();
    (1..v.len() - 1).step_by(2).map(move |k| {
        let last = v[(k + 2).min(v.len() - 1)];
        [v[0], v[k], v[k + 1], last]
    })
}

/// Half the larger extent of a quadrilateral along each of its two directions, in metres.
pub(super) fn half_extents(q: &Quad) -> [f64; 2] {
    [
        0.5 * q[0].distance(q[1]).max(q[3].distance(q[2])),
        0.5 * q[0].distance(q[3]).max(q[1].distance(q[2])),
    ]
}

/// How a polygon lies towards another one.
pub(super) struct View {
    /// Height of its centre above the plane of the other, in metres.
    pub(super) height: f64,
    /// Its radius in metres.
    pub(super) radius: f64,
}

/// The points a quadrilateral needs when its centre is `distance` away from the other polygon.
pub(super) fn orders(quad: &Quad, distance: f64, view: &View, accuracy: f64) -> Option<Orders> {
    let [a, b] = half_extents(quad);
    let is_grazing = view.height <= 2.0 * view.radius;
    let accuracy = if is_grazing {
        accuracy / 4.0
    } else {
        accuracy / (1.0 + distance / view.height)
    };
    // A parallelogram's Jacobian is constant.
    let twist = (quad[0] - quad[1]) + (quad[2] - quad[3]);
    let is_twisted = twist.length_squared() > 1e-6 * (a * a).max(b * b);
    let more = usize::from(is_grazing || is_twisted);
    Some([
        order(a, distance - b, accuracy)? + more,
        order(b, distance - a, accuracy)? + more,
    ])
}

/// Calls `visit` with each point of the product of Gauss rules on a quadrilateral in the plane of
/// `normal` and its weight in m².
pub(super) fn points(quad: &Quad, normal: DVec3, orders: Orders, visit: impl FnMut(DVec3, f64)) {
    points_of(quad, normal, gauss(orders[0]), gauss(orders[1]), visit);
}

/// The same for any two rules on [0, 1].
pub(super) fn points_of(
    quad: &Quad,
    normal: DVec3,
    rule_u: &[Node],
    rule_v: &[Node],
    mut visit: impl FnMut(DVec3, f64),
) {
    let [a, b, c, d] = *quad;
    let (ab, dc, ad) = (b - a, c - d, d - a);
    let twist = dc - ab;
    for &(v, wv) in rule_v {
        let along_u = ab + twist * v;
        let start = a + ad * v;
        for &(u, wu) in rule_u {
            let along_v = ad + twist * u;
            let jacobian = along_u.cross(along_v).dot(normal);
            visit(start + along_u * u, wu * wv * jacobian);
        }
    }
}

/// S in m² by rules over the pieces of both polygons; the orders belong to the pieces in turn.
pub(super) fn by_kernel(from: &[(DVec3, f64)], n1: DVec3, to: &[(DVec3, f64)], n2: DVec3) -> f64 {
    let mut sum = 0.0;
    for &(x, wx) in from {
        let mut row = 0.0;
        for &(y, wy) in to {
            let r = y - x;
            let r2 = r.length_squared();
            row -= wy * n1.dot(r) * n2.dot(r) / (r2 * r2);
        }
        sum += wx * row;
    }
    sum / PI
}

/// S in m² by a rule over one polygon and Lambert's formula for the other.
pub(super) fn by_lambert(quad: &Quad, normal: DVec3, orders: Orders, other: &Polygon) -> f64 {
    let mut sum = 0.0;
    points(quad, normal, orders, |x, w| {
        sum += w * point_to_polygon(x, normal, other.vertices());
    });
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rule_covers_triangles_quads_and_pentagons() {
        let pentagon = [
            DVec3::new(0.0, 0.0, 1.0),
            DVec3::new(2.0, 0.0, 1.0),
            DVec3::new(3.0, 1.0, 1.0),
            DVec3::new(1.5, 2.5, 1.0),
            DVec3::new(-0.5, 1.0, 1.0),
        ];
        for n in 3..=5 {
            let polygon = Polygon::new(&pentagon[..n]).expect("a polygon");
            let (mut area, mut moment) = (0.0, DVec3::ZERO);
            for quad in quads(&polygon) {
                points(&quad, polygon.normal(), [2, 2], |x, w| {
                    area += w;
                    moment += x * w;
                });
            }
            // Two points integrate cubics: area and first moment are exact.
            assert!((area - polygon.area()).abs() < 1e-14, "{n} vertices");
            assert!(
                (moment / area).distance(polygon.centre()) < 1e-14,
                "{n} vertices"
            );
        }
    }

    #[test]
    fn the_order_keeps_the_stated_accuracy() {
        // A unit square over a parallel one at many distances; the reference has more points.
        for accuracy in [1e-3, 1e-6, 1e-9, 1e-12] {
            for distance in [1.2, 2.0, 3.0, 5.0, 10.0, 100.0] {
                let square = |z: f64, x: f64| {
                    [
                        DVec3::new(x, 0.0, z),
                        DVec3::new(x + 1.0, 0.0, z),
                        DVec3::new(x + 1.0, 1.0, z),
                        DVec3::new(x, 1.0, z),
                    ]
                };
                let floor = square(0.0, 0.3);
                let mut ceiling = square(distance, 0.0);
                ceiling.reverse();
                let other = Polygon::new(&ceiling).expect("a square");
                let centre = (floor[0] + floor[2]) * 0.5;
                let view = View {
                    height: distance,
                    radius: 0.5_f64.sqrt(),
                };
                let Some(orders) = orders(&floor, other.distance(centre), &view, accuracy) else {
                    continue;
                };
                let value = by_lambert(&floor, DVec3::Z, orders, &other);
                let reference = by_lambert(&floor, DVec3::Z, [20, 20], &other);
                assert!(
                    (value / reference - 1.0).abs() <= accuracy + 1e-14,
                    "{accuracy} at {distance} with {orders:?}: {}",
                    value / reference - 1.0
                );
            }
        }
    }
}
