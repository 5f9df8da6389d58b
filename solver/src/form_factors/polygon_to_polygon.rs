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
    let between = q.centre() - p.centre();
    let distance = between.length();
    if distance <= 2.0 * (p.radius() + q.radius()) {
        return None;
    }
    let accuracy = accuracy * grazing(p, q, between);
    let mut buffers = [[(DVec3::ZERO, 0.0); MAX_POINTS]; 2];
    let mut counts = [0; 2];
    let gaps = [distance - q.radius(), distance - p.radius()];
    for (side, polygon) in [p, q].into_iter().enumerate() {
        for quad in area::quads(polygon) {
            let reach = offset(&quad, polygon);
            let orders = area::orders(&quad, gaps[side] - reach, accuracy)?;
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

/// cos θ₁ cos θ₂ between centres: the kernel against r⁻², not below a thousandth.
fn grazing(p: &Polygon, q: &Polygon, between: DVec3) -> f64 {
    let r2 = between.length_squared();
    let cosines = -p.normal().dot(between) * q.normal().dot(between) / r2;
    cosines.clamp(1e-3, 1.0)
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
    if rounding <= accuracy * contour.value || depth >= MAX_DEPTH {
        return contour.value;
    }
    if let Some(value) = by_lambert() {
        return value;
    }
    // Halving the larger one separates its far half; polygons of one size that touch stay as they are.
    let (large, small) = if p.radius() >= q.radius() {
        (p, q)
    } else {
        (q, p)
    };
    if large.radius() <= 2.0 * small.radius() && is_touching(p, q) {
        return contour.value;
    }
    large
        .halves()
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
    let accuracy = accuracy * grazing(one, other, other.centre() - one.centre());
    let mut points = 0;
    let mut pieces = Vec::with_capacity(2);
    for quad in area::quads(one) {
        let middle = (quad[0] + quad[1] + quad[2] + quad[3]) * 0.25;
        let orders = area::orders(&quad, other.distance(middle), accuracy)?;
        points += orders[0] * orders[1];
        pieces.push((quad, orders));
    }
    Some((points, pieces))
}
