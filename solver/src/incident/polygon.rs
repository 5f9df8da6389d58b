//! Moments of a polygon of even radiance, as a point sees it: solid angle, ∫ ω dω and ∫ ωω dω, exact.
//!
//! With unit vectors a, b to the ends of each edge, θ the angle between them, and m = ±(a × b)/sin θ the normal of the plane
//! through the edge and the point, towards the polygon:
//!
//!   T = ½ Σ θ m,   T_ij = ⅓ (δ_ij Ω + Σ m_j tan(θ/2) (a + b)_i).
//!
//! Source: J. Arvo, "Applications of irradiance tensors to the simulation of non-Lambertian phenomena", SIGGRAPH 1995, §4; the first
//! is J. H. Lambert's (Photometria, 1760). Validity: planar convex polygons that do not pass through the point. The relative error is about 1e-16 over the
//! angle under which the polygon is seen. Cost: about 30 ns an edge.

use super::harmonics::of_moments;
use crate::sampling::SphericalTriangle;
use glam::DVec3;

/// A triangle of a polygon's fan, as it is seen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slice {
    pub(super) triangle: SphericalTriangle,
    pub(super) corners: [DVec3; 3],
}

/// Writes the fan of a convex polygon as seen from `position` to `slices`; returns its solid angle in sr.
pub(super) fn fan(position: DVec3, polygon: &[DVec3], slices: &mut Vec<Slice>) -> f64 {
    slices.clear();
    let pairs = polygon.get(1..).unwrap_or_default().windows(2);
    slices.extend(pairs.filter_map(|pair| {
        let corners = [polygon[0], pair[0], pair[1]];
        let triangle = SphericalTriangle::new(position, corners)?;
        Some(Slice { triangle, corners })
    }));
    slices
        .iter()
        .map(|slice| slice.triangle.solid_angle())
        .sum()
}

/// The coefficients of radiance one from a convex polygon that covers `solid_angle` (sr) as seen from `position`.
pub(super) fn coefficients<const N: usize>(
    position: DVec3,
    polygon: &[DVec3],
    solid_angle: f64,
) -> [f64; N] {
    let towards = |k: usize| (polygon[k % polygon.len()] - position).normalize_or_zero();
    let mut first = DVec3::ZERO;
    // xx, yy, zz, xy, yz, xz.
    let mut second = [0.0; 6];
    let mut middle = DVec3::ZERO;
    for k in 0..polygon.len() {
        let (a, b) = (towards(k), towards(k + 1));
        middle += a;
        let (cross, cosine) = (a.cross(b), a.dot(b));
        let sine = cross.length();
        if sine <= 0.0 {
            continue;
        }
        first += cross * (0.5 * sine.atan2(cosine) / sine);
        // m tan(θ/2) = (a × b) / (1 + cos θ), which has no meaning for an edge through the point.
        let (m, s) = (cross / (1.0 + cosine).max(f64::EPSILON), a + b);
        let mixed = |i: usize, j: usize| 0.5 * (m[i] * s[j] + m[j] * s[i]);
        let terms = [
            m.x * s.x,
            m.y * s.y,
            m.z * s.z,
            mixed(0, 1),
            mixed(1, 2),
            mixed(0, 2),
        ];
        for (sum, term) in second.iter_mut().zip(terms) {
            *sum += term;
        }
    }
    // The polygon is seen with its corners in one order or the other.
    let sign = if first.dot(middle) < 0.0 { -1.0 } else { 1.0 };
    for (k, sum) in second.iter_mut().enumerate() {
        let even = if k < 3 { solid_angle } else { 0.0 };
        *sum = (even + sign * *sum) / 3.0;
    }
    of_moments(solid_angle, first * sign, second)
}

#[cfg(test)]
mod tests {
    use super::super::harmonics::{MOST, basis};
    use super::*;
    use crate::sampling::{Sequence, Stage};

    fn polygons() -> Vec<Vec<DVec3>> {
        let square = |x: f64, y: f64, z: f64, side: f64| {
            let p = DVec3::new(x, y, z);
            let [u, v] = [DVec3::X * side, DVec3::new(0.0, 0.6, 0.8) * side];
            vec![p, p + u, p + u + v, p + v]
        };
        vec![
            square(-0.5, 0.2, 1.0, 1.0),
            square(-3.0, -2.0, 0.1, 6.0),
            square(4.0, 2.0, -3.0, 1e-3),
            // The other way round, and five corners.
            square(0.3, 0.3, 0.5, 0.7).into_iter().rev().collect(),
            [[0.0, 0.0], [1.0, 0.0], [1.4, 0.8], [0.5, 1.5], [-0.3, 0.7]]
                .map(|[x, y]| DVec3::new(x, y, 0.3 - 0.2 * x))
                .to_vec(),
        ]
    }

    #[test]
    fn coefficients_are_those_of_points_spread_over_the_polygon() {
        const COUNT: u32 = 1 << 14;
        for (number, polygon) in polygons().iter().enumerate() {
            let mut slices = Vec::new();
            let solid_angle = fan(DVec3::ZERO, polygon, &mut slices);
            let exact = coefficients::<MOST>(DVec3::ZERO, polygon, solid_angle);
            let mut found = [0.0; MOST];
            for (index, slice) in slices.iter().enumerate() {
                let share = slice.triangle.solid_angle() / f64::from(COUNT);
                let sequence = Sequence::new(3, Stage::INCIDENT, index as u64);
                for sample in 0..COUNT {
                    let direction = slice.triangle.sample(sequence.point2(sample)).direction;
                    for (sum, y) in found.iter_mut().zip(basis::<MOST>(direction)) {
                        *sum += y * share;
                    }
                }
            }
            for (k, (a, b)) in exact.iter().zip(found).enumerate() {
                // Even points of smooth functions err by less than one over their number.
                let allowed = solid_angle / f64::from(COUNT);
                assert!((a - b).abs() < allowed, "polygon {number}, {k}: {a} {b}");
            }
        }
    }

    #[test]
    fn what_is_seen_edge_on_or_not_at_all_has_no_coefficients() {
        let flat = [DVec3::X, DVec3::X + DVec3::Y, DVec3::new(2.0, 0.3, 0.0)];
        for polygon in [&flat[..], &flat[..2], &[]] {
            let mut slices = Vec::new();
            let solid_angle = fan(DVec3::ZERO, polygon, &mut slices);
            assert!(solid_angle.abs() < 1e-15 && slices.is_empty());
            let found = coefficients::<MOST>(DVec3::ZERO, polygon, solid_angle);
            assert!(found.iter().all(|c| c.abs() < 1e-15), "{found:?}");
        }
    }
}
