//! The form factor between two polygons that see each other entirely.
//!
//! S = A₁F₁₂ = A₂F₂₁, the exchange area, symmetric by construction, from which both form factors follow.
//! Each polygon is first clipped exactly to the front of the other's plane. Then, in a frame centred
//! between them and scaled by a power of two, one of three methods computes S, the cheapest that
//! reaches the accuracy asked for:
//!
//! | method | where | relative error |
//! |---|---|---|
//! | rules over both areas | far: a few radii apart | the bound in `area`, at any distance |
//! | rule over one area, Lambert's formula for the other | apart by the size of one | the same |
//! | contour integral | near and touching | ε × magnitude of its terms / S |
//!
//! Where the contour integral would cancel too many digits (very unequal or very thin polygons that
//! nearly touch), the larger polygon is halved and the method chosen anew for each half, so that what
//! is far is done by area and only what touches by contour.
//!
//! Sources: see the three modules. Valid for planar convex polygons in any position and at any scale.
//! What limits it: two polygons of similar size that touch and see each other at a grazing angle have
//! F ≪ 1 from terms of order 1, and an error of about 1e-16/F relative (1e-11 at a fold of 179°).
//! Cost: 0.1–1 µs far, 1–10 µs near, 1–50 µs touching.

use super::area;
use super::clip::Plane;
use super::contour;
use super::polygon::Polygon;
use glam::DVec3;
use std::borrow::Cow;

/// Cost of one kernel evaluation in ns, of one Lambert formula, and of a contour integral: they decide
/// between methods that are all accurate enough, so that only the time depends on them.
const KERNEL_COST: usize = 4;
const LAMBERT_COST: usize = 80;
const CONTOUR_COST: usize = 8000;

/// Points that fit the buffers of the rule over both areas.
const MAX_POINTS: usize = 64;

/// Rounding of a contour integral, relative to the magnitude of its terms.
const CONTOUR_ROUNDING: f64 = f64::EPSILON;

/// Error of a form factor below which no effort is made for its relative accuracy: rounding of the rest
/// of a row is as large. Larger, faint pairs lose digits; smaller, pairs that touch at grazing angles
/// take milliseconds.
const NEGLIGIBLE: f64 = 1e-15;

/// Halvings of polygons that nearly touch: enough for a ratio of sizes of 2^20 and more.
const MAX_DEPTH: u32 = 40;

/// The best accuracy that is worth asking for: rounding keeps better ones from being reached.
const BEST_ACCURACY: f64 = 1e-13;

/// S = A₁F₁₂ = A₂F₂₁ in m² of two polygons with nothing between them, to a relative `accuracy` of 1e-13
/// at best; between zero and the smaller area.
pub fn exchange_area(p: &Polygon, q: &Polygon, accuracy: f64) -> f64 {
    let accuracy = accuracy.max(BEST_ACCURACY);
    let Some(p_seen) = front_part(p, &q.plane()) else {
        return 0.0;
    };
    let Some(q_seen) = front_part(q, &p.plane()) else {
        return 0.0;
    };
    if let Some(value) = far(&p_seen, &q_seen, accuracy) {
        return value.clamp(0.0, p.area().min(q.area()));
    }
    // A frame in which lengths are about one and coordinates as small as they can be.
    let origin = nearest_vertex(&p_seen, &q_seen);
    let exponent = -p_seen.radius().max(q_seen.radius()).log2().round();
    let scale = exponent.exp2();
    let value = near(
        &p_seen.relative_to(origin, scale),
        &q_seen.relative_to(origin, scale),
        accuracy,
        0,
    );
    (value / (scale * scale)).clamp(0.0, p.area().min(q.area()))
}

/// F from one polygon to another with nothing between them, to a relative `accuracy`; in [0, 1].
pub fn polygon_to_polygon(from: &Polygon, to: &Polygon, accuracy: f64) -> f64 {
    (exchange_area(from, to, accuracy) / from.area()).clamp(0.0, 1.0)
}

/// The part of a polygon in front of a plane.
fn front_part<'a>(polygon: &'a Polygon, plane: &Plane) -> Option<Cow<'a, Polygon>> {
    // Most polygons are clear of the plane by more than their radius.
    let height = plane.normal.dot(polygon.centre() - plane.point);
    let clear = polygon.radius() * (1.0 + 1e-9);
    if height > clear || (height > -clear && is_touching_front(polygon, plane)) {
        return Some(Cow::Borrowed(polygon));
    }
    if height < -clear {
        return None;
    }
    polygon.in_front_of(plane).map(Cow::Owned)
}

/// True when a polygon lies in front of a plane, touching it or not, but not in it.
fn is_touching_front(polygon: &Polygon, plane: &Plane) -> bool {
    polygon.is_in_front_of(plane) && plane.height(polygon.centre()) > 0.0
}

/// The vertex of one polygon that is nearest to the centre of the other.
fn nearest_vertex(p: &Polygon, q: &Polygon) -> DVec3 {
    let centre = q.centre();
    let nearer = |a: DVec3, b: DVec3| {
        if b.distance_squared(centre) < a.distance_squared(centre) {
            b
        } else {
            a
        }
    };
    p.vertices().iter().copied().fold(p.vertices()[0], nearer)
}

/// S by rules over both areas, if the polygons are far enough apart for these to be cheap.
fn far(p: &Polygon, q: &Polygon, accuracy: f64) -> Option<f64> {
    let distance = p.centre().distance(q.centre());
    if distance <= 2.0 * (p.radius() + q.radius()) {
        return None;
    }
    let mut buffers = [[(DVec3::ZERO, 0.0); MAX_POINTS]; 2];
    let mut counts = [0; 2];
    let gaps = [distance - q.radius(), distance - p.radius()];
    for (side, (polygon, other)) in [(p, q), (q, p)].into_iter().enumerate() {
        let view = view(polygon, other);
        for quad in area::quads(polygon) {
            let reach = offset(&quad, polygon);
            let orders = area::orders(&quad, gaps[side] - reach, &view, accuracy)?;
            if counts[side] + orders[0] * orders[1] > MAX_POINTS {
                return None;
            }
            area::points(&quad, polygon.normal(), orders, |x, w| {
                buffers[side][counts[side]] = (x, w);
                counts[side] += 1;
            });
        }
    }
    let [a, b] = counts;
    if a * b * KERNEL_COST > a.min(b) * LAMBERT_COST {
        return None;
    }
    Some(area::by_kernel(
        &buffers[0][..a],
        p.normal(),
        &buffers[1][..b],
        q.normal(),
    ))
}

/// Distance between the centres of a piece and of its polygon: what separates the two at most.
fn offset(quad: &area::Quad, polygon: &Polygon) -> f64 {
    let middle = (quad[0] + quad[1] + quad[2] + quad[3]) * 0.25;
    middle.distance(polygon.centre())
}

/// How a polygon lies towards another.
fn view(one: &Polygon, other: &Polygon) -> area::View {
    area::View {
        height: other.normal().dot(one.centre() - other.centre()),
        radius: one.radius(),
    }
}

/// S of polygons in a frame of unit size.
fn near(p: &Polygon, q: &Polygon, accuracy: f64, depth: u32) -> f64 {
    if let Some(value) = far(p, q, accuracy) {
        return value;
    }
    let lambert = [plan(p, q, accuracy), plan(q, p, accuracy)];
    let cost = |plan: &Option<(usize, Vec<(area::Quad, area::Orders)>)>| {
        plan.as_ref()
            .map_or(usize::MAX, |(points, _)| points * LAMBERT_COST)
    };
    let (one, other, best) = if cost(&lambert[0]) <= cost(&lambert[1]) {
        (p, q, &lambert[0])
    } else {
        (q, p, &lambert[1])
    };
    let by_lambert = || {
        best.as_ref().map(|(_, pieces)| {
            pieces
                .iter()
                .map(|(quad, orders)| area::by_lambert(quad, one.normal(), *orders, other))
                .sum::<f64>()
        })
    };
    if cost(best) <= CONTOUR_COST
        && let Some(value) = by_lambert()
    {
        return value;
    }
    let contour = contour::exchange_area(p, q);
    let rounding = CONTOUR_ROUNDING * contour.magnitude;
    let negligible = NEGLIGIBLE * p.area().min(q.area());
    if rounding <= negligible.max(accuracy * contour.value) || depth >= MAX_DEPTH {
        return contour.value;
    }
    if let Some(value) = by_lambert() {
        return value;
    }
    // Halving the larger one separates its far half. Where polygons of one size touch, it helps only if
    // a half does not touch any more: not along a common edge that is halved itself.
    let (large, small) = if p.radius() >= q.radius() {
        (p, q)
    } else {
        (q, p)
    };
    let halves = large.halves();
    let is_helping = large.radius() > 2.0 * small.radius()
        || halves
            .iter()
            .flatten()
            .any(|half| !is_touching(half, small));
    if !is_helping {
        return contour.value;
    }
    halves
        .iter()
        .flatten()
        .map(|half| near(half, small, accuracy, depth + 1))
        .sum()
}

/// True when polygons are nearer to each other than a thousandth of the size of the smaller one.
fn is_touching(p: &Polygon, q: &Polygon) -> bool {
    let gap = |a: &Polygon, b: &Polygon| {
        a.vertices()
            .iter()
            .map(|&v| b.distance(v))
            .fold(f64::INFINITY, f64::min)
    };
    gap(p, q).min(gap(q, p)) <= 1e-3 * p.radius().min(q.radius())
}

/// The pieces of one polygon, their orders and the number of points, for a rule over it with Lambert's
/// formula for the other.
fn plan(
    one: &Polygon,
    other: &Polygon,
    accuracy: f64,
) -> Option<(usize, Vec<(area::Quad, area::Orders)>)> {
    let view = view(one, other);
    let mut points = 0;
    let mut pieces = Vec::with_capacity(2);
    for quad in area::quads(one) {
        let middle = (quad[0] + quad[1] + quad[2] + quad[3]) * 0.25;
        let orders = area::orders(&quad, other.distance(middle), &view, accuracy)?;
        points += orders[0] * orders[1];
        pieces.push((quad, orders));
    }
    Some((points, pieces))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uniform numbers in [−1, 1) from a fixed linear congruential sequence.
    struct Numbers(u64);

    impl Numbers {
        fn next(&mut self) -> f64 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }

        fn vector(&mut self) -> DVec3 {
            DVec3::new(self.next(), self.next(), self.next())
        }

        /// A planar convex quadrilateral around a centre.
        fn quad(&mut self, centre: DVec3) -> Polygon {
            let u = self.vector();
            let v = self.vector();
            let v = v - u * (u.dot(v) / u.length_squared());
            Polygon::new(&[
                centre - u - v,
                centre + u - v,
                centre + u * 0.6 + v,
                centre - u + v,
            ])
            .expect("random vectors span an area")
        }
    }

    fn quarters(polygon: &Polygon) -> Vec<Polygon> {
        polygon
            .halves()
            .iter()
            .flatten()
            .flat_map(Polygon::halves)
            .flatten()
            .collect()
    }

    #[test]
    fn a_whole_sees_what_its_parts_see() {
        let mut numbers = Numbers(7);
        for accuracy in [1e-3, 1e-6, 1e-9, 1e-12] {
            for distance in [0.0, 0.5, 1.5, 3.0, 10.0, 300.0] {
                for _ in 0..30 {
                    let p = numbers.quad(DVec3::ZERO);
                    let centre = numbers.vector().normalize() * distance;
                    let q = numbers.quad(centre);
                    let whole = exchange_area(&p, &q, accuracy);
                    let parts: f64 = quarters(&q).iter().map(|q| exchange_area(q, &p, 0.0)).sum();
                    // The accuracy asked for, the contour's rounding, and that of cut coordinates.
                    let tolerance = accuracy * parts + 1e-14 * p.area().min(q.area());
                    assert!(
                        (whole - parts).abs() <= tolerance,
                        "{accuracy:e} at {distance}: {whole:e} against {parts:e}"
                    );
                    let smaller = p.area().min(q.area());
                    assert!((0.0..=smaller).contains(&whole), "F in [0, 1]");
                }
            }
        }
    }

    #[test]
    fn units_and_origin_do_not_matter() {
        let mut numbers = Numbers(11);
        for _ in 0..20 {
            let (p, centre) = (numbers.quad(DVec3::ZERO), numbers.vector());
            let q = numbers.quad(centre);
            let f = polygon_to_polygon(&p, &q, 1e-11);
            for scale in [1e-6, 1e6] {
                let scaled = polygon_to_polygon(
                    &p.relative_to(DVec3::ZERO, scale),
                    &q.relative_to(DVec3::ZERO, scale),
                    1e-11,
                );
                // Coordinates are rounded anew: 1e-16 of a coordinate, amplified by grazing angles.
                assert!((scaled - f).abs() <= 1e-13, "{scale}: {scaled} against {f}");
            }
            let far = DVec3::new(1e6, -1e6, 1e6);
            let moved = |polygon: &Polygon| {
                let vertices: Vec<_> = polygon.vertices().iter().map(|&v| v + far).collect();
                Polygon::new(&vertices).expect("a polygon")
            };
            let f_moved = polygon_to_polygon(&moved(&p), &moved(&q), 1e-11);
            // Coordinates are rounded to 1e6 eps = 2e-10; dF/dx is of order one and logarithmic.
            assert!((f_moved - f).abs() <= 1e-8, "moved: {f_moved} against {f}");
        }
    }

    #[test]
    fn near_plates_keep_what_escapes_between_them() {
        // Howell C-11 for 1 − F at gap g: 2g/side to first order in g.
        for gap in [1e-3, 1e-4, 1e-6] {
            let square = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
            let mut over = square.map(|v| v + DVec3::Z * gap);
            over.reverse();
            let p = Polygon::new(&square).expect("a square");
            let q = Polygon::new(&over).expect("a square");
            let f = polygon_to_polygon(&p, &q, 1e-11);
            // The next term is of order g² ln g.
            let escaping = (1.0 - f) / (2.0 * gap);
            assert!(
                f <= 1.0 && (escaping - 1.0).abs() < 0.01,
                "{gap}: {escaping}"
            );
        }
    }

    #[test]
    fn what_cannot_be_seen_is_exactly_zero() {
        let square = |z: f64| {
            [DVec3::ZERO, DVec3::X, DVec3::ONE - DVec3::Z, DVec3::Y].map(|v| v + DVec3::Z * z)
        };
        let up = |z| Polygon::new(&square(z)).expect("a square");
        let down = |z| {
            let mut v = square(z);
            v.reverse();
            Polygon::new(&v).expect("a square")
        };
        for (p, q) in [
            (up(0.0), up(0.0)),
            (up(0.0), up(1.0)),
            (up(0.0), down(0.0)),
            (up(0.0), down(-1.0)),
            (down(0.0), up(1.0)),
        ] {
            let s = exchange_area(&p, &q, 1e-11);
            assert_eq!(s.to_bits(), 0, "{p:?} {q:?}");
        }
    }
}
