//! Mean value coordinates of a point in a planar convex polygon.
//!
//! λ_i ∝ (tan(α_{i−1}/2) + tan(α_i/2)) / |v_i − x|, α_i the angle at x between v_i and v_{i+1}. They are
//! affine on the edges, corners on straight edges included, and reproduce affine functions. Source:
//! M. S. Floater, "Mean value coordinates", Computer Aided Geometric Design 20, 2003; in the form of
//! K. Hormann, M. S. Floater, "Mean Value Coordinates for Arbitrary Planar Polygons", ACM TOG 25(4),
//! 2006, figure 10, without angles.

use glam::DVec3;

/// Twice the vector area of a polygon.
pub(super) fn vector_area(polygon: &[DVec3]) -> DVec3 {
    polygon[1..]
        .windows(2)
        .map(|pair| (pair[0] - polygon[0]).cross(pair[1] - polygon[0]))
        .sum()
}

/// Least signed distance of a point from the edges, positive inside.
pub(super) fn depth(polygon: &[DVec3], position: DVec3) -> f64 {
    let normal = vector_area(polygon).normalize_or_zero();
    (0..polygon.len())
        .map(|k| {
            let (a, b) = (polygon[k], polygon[(k + 1) % polygon.len()]);
            let inward = normal.cross(b - a).normalize_or_zero();
            inward.dot(position - a)
        })
        .fold(f64::INFINITY, f64::min)
}

/// The coordinates of a point, one for each corner, of sum one; `None` for a degenerate polygon.
/// Points outside by rounding are taken to lie on the nearest edge.
pub(super) fn mean_value(polygon: &[DVec3], position: DVec3) -> Option<Vec<f64>> {
    let n = polygon.len();
    let area = vector_area(polygon);
    let scale = area.length();
    let normal = area / scale;
    if !normal.is_finite() {
        return None;
    }
    // Triangles of a smaller share of the polygon lie on an edge.
    let tiny = 1e-9 * scale;
    let to: Vec<DVec3> = polygon.iter().map(|&corner| corner - position).collect();
    let distance: Vec<f64> = to.iter().map(|s| s.length()).collect();
    let next = |k: usize| (k + 1) % n;
    let areas: Vec<f64> = (0..n)
        .map(|k| to[k].cross(to[next(k)]).dot(normal))
        .collect();
    let dots: Vec<f64> = (0..n).map(|k| to[k].dot(to[next(k)])).collect();
    let mut weights = vec![0.0; n];
    for k in 0..n {
        // On an edge, or on one of its ends: affine along it.
        if areas[k] <= tiny && dots[k] <= 0.0 {
            let (one, other) = (distance[k], distance[next(k)]);
            let share = if one + other > 0.0 {
                one / (one + other)
            } else {
                0.0
            };
            weights[k] = 1.0 - share;
            weights[next(k)] += share;
            return Some(weights);
        }
    }
    for k in 0..n {
        let before = (k + n - 1) % n;
        let half = |area: f64, dot: f64, other: usize| {
            if area.abs() > tiny {
                (distance[other] - dot / distance[k]) / area
            } else {
                0.0
            }
        };
        weights[k] = half(areas[before], dots[before], before) + half(areas[k], dots[k], next(k));
    }
    let total: f64 = weights.iter().sum();
    if !(total > 0.0 && total.is_finite()) {
        return None;
    }
    for weight in &mut weights {
        *weight /= total;
    }
    Some(weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn affine_functions_are_reproduced_inside_and_on_edges() {
        // The third corner lies in the middle of an edge.
        let corners = [
            DVec3::new(0.0, 0.0, 0.2),
            DVec3::new(1.0, 0.0, 0.2),
            DVec3::new(1.1, 0.35, 0.2),
            DVec3::new(1.2, 0.7, 0.2),
            DVec3::new(0.4, 1.0, 0.2),
            DVec3::new(-0.1, 0.6, 0.2),
        ];
        let affine = |p: DVec3| 3.0 + p.x - 2.0 * p.y;
        for position in [
            DVec3::new(0.5, 0.4, 0.2),
            DVec3::new(0.1, 0.1, 0.2),
            DVec3::new(0.5, 0.0, 0.2),
            DVec3::new(1.0, 0.0, 0.2),
            DVec3::new(1.05, 0.175, 0.2),
            DVec3::new(1.1, 0.35, 0.2),
        ] {
            let weights = mean_value(&corners, position).expect("a polygon");
            let value: f64 = weights
                .iter()
                .zip(&corners)
                .map(|(w, c)| w * affine(*c))
                .sum();
            // A point within 1e-9 of the area of an edge counts as on it.
            assert!(
                (value - affine(position)).abs() < 1e-8,
                "{position}: {value}"
            );
        }
    }

    #[test]
    fn on_an_edge_only_its_own_ends_count() {
        let corners = [
            DVec3::ZERO,
            DVec3::X * 0.5,
            DVec3::X,
            DVec3::new(1.0, 1.0, 0.0),
            DVec3::Y,
        ];
        let weights = mean_value(&corners, DVec3::X * 0.25).expect("a polygon");
        for (weight, expected) in weights.iter().zip([0.5, 0.5, 0.0, 0.0, 0.0]) {
            assert!((weight - expected).abs() < 1e-12, "{weights:?}");
        }
    }
}
