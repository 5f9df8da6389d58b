//! Cuts a polygon that is concave or not planar into triangles.
//!
//! Quads are cut along the better diagonal; larger polygons by ear clipping (G. H. Meisters,
//! "Polygons have ears", American Mathematical Monthly 82(6), 1975) in the plane of the mean
//! normal, the best shaped ear first. Clipping a corner takes exactly its triangle's vector area
//! from the polygon's, so the vector areas always sum to the polygon's, whatever its shape.
//!
//! Valid for every input; a self-intersecting outline gives overlapping triangles. Cost: O(n²) for
//! common outlines, O(n³) at worst.

use glam::{DVec2, DVec3};

/// Outlines with more corners are clipped at the first ear instead of the best shaped one: looking
/// at every ear costs a factor n. Larger is slower, smaller makes more slivers.
const BEST_EAR_LIMIT: usize = 64;

/// Surfaces of two cuts closer than this (relative) are equal up to rounding of the file's numbers;
/// then the length of the diagonal decides. Larger cuts bent quads the less flat way.
const EQUAL: f64 = 1e-9;

/// Triangles of a normalised polygon, as indices of its corners.
pub(crate) fn triangulate(points: &[DVec3], normal: DVec3) -> Vec<[usize; 3]> {
    match points.len() {
        0..=2 => Vec::new(),
        3 => vec![[0, 1, 2]],
        4 => cut_quad(points, normal),
        _ => clip_ears(points, normal),
    }
}

/// The diagonal that leaves both triangles facing the normal; where both do, the one with the
/// smaller surface (the flatter pair), then the shorter one.
fn cut_quad(points: &[DVec3], normal: DVec3) -> Vec<[usize; 3]> {
    let candidates = [[[0, 1, 2], [0, 2, 3]], [[1, 2, 3], [1, 3, 0]]];
    let cost = |pair: &[[usize; 3]; 2]| {
        let areas = pair.map(|[a, b, c]| (points[b] - points[a]).cross(points[c] - points[a]));
        let turned = areas.iter().filter(|area| area.dot(normal) <= 0.0).count();
        let surface = areas[0].length() + areas[1].length();
        let diagonal = points[pair[0][0]].distance(points[pair[1][1]]);
        (turned, surface, diagonal)
    };
    let (first, second) = (cost(&candidates[0]), cost(&candidates[1]));
    let second_is_better = if first.0 != second.0 {
        second.0 < first.0
    } else if (first.1 - second.1).abs() > EQUAL * first.1 {
        second.1 < first.1
    } else {
        second.2 < first.2
    };
    candidates[usize::from(second_is_better)].to_vec()
}

fn clip_ears(points: &[DVec3], normal: DVec3) -> Vec<[usize; 3]> {
    let flat = project(points, normal);
    let mut ring: Vec<usize> = (0..flat.len()).collect();
    let mut triangles = Vec::with_capacity(flat.len() - 2);
    let mut start = 0;
    while ring.len() > 3 {
        let at = find_ear(&flat, &ring, start);
        triangles.push(ear_at(&ring, at));
        ring.remove(at);
        // Going on behind the clipped corner spreads the cuts instead of making a fan.
        start = if at >= ring.len() { 0 } else { at };
    }
    triangles.push([ring[0], ring[1], ring[2]]);
    triangles
}

/// The position in the ring of the corner to clip next, looked for from `start` on.
fn find_ear(flat: &[DVec2], ring: &[usize], start: usize) -> usize {
    let mut best_ear = None;
    let mut best_corner = (f64::NEG_INFINITY, start);
    for step in 0..ring.len() {
        let at = (start + step) % ring.len();
        let [a, b, c] = ear_at(ring, at).map(|i| flat[i]);
        let quality = quality(a, b, c);
        if quality > best_corner.0 {
            best_corner = (quality, at);
        }
        let improves = best_ear.is_none_or(|(best, _)| quality > best);
        if quality > 0.0 && improves && is_empty(flat, ring, at) {
            best_ear = Some((quality, at));
            if ring.len() > BEST_EAR_LIMIT {
                break;
            }
        }
    }
    // An outline that crosses itself may have no ear: then the best shaped corner goes.
    best_ear.map_or(best_corner.1, |(_, at)| at)
}

fn ear_at(ring: &[usize], at: usize) -> [usize; 3] {
    let n = ring.len();
    [ring[(at + n - 1) % n], ring[at], ring[(at + 1) % n]]
}

/// Doubled area over the sum of squared edges: positive for left turns, largest when equilateral.
fn quality(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let squares = a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
    if squares > 0.0 {
        (b - a).perp_dot(c - b) / squares
    } else {
        0.0
    }
}

/// True when no other corner of the ring lies in the ear's triangle. Corners at the same place as
/// one of the ear's own (bridges to holes) do not count.
fn is_empty(flat: &[DVec2], ring: &[usize], at: usize) -> bool {
    let corners = ear_at(ring, at);
    let [a, b, c] = corners.map(|i| flat[i]);
    ring.iter().all(|&i| {
        let p = flat[i];
        p == a
            || p == b
            || p == c
            || (b - a).perp_dot(p - a) < 0.0
            || (c - b).perp_dot(p - b) < 0.0
            || (a - c).perp_dot(p - c) < 0.0
    })
}

/// Drops the coordinate in which the normal is largest; the outline stays counter-clockwise.
fn project(points: &[DVec3], normal: DVec3) -> Vec<DVec2> {
    let size = normal.abs();
    let (axis, sign) = if size.x >= size.y && size.x >= size.z {
        (0, normal.x)
    } else if size.y >= size.z {
        (1, normal.y)
    } else {
        (2, normal.z)
    };
    let (u, v) = match axis {
        0 => (1, 2),
        1 => (2, 0),
        _ => (0, 1),
    };
    points
        .iter()
        .map(|p| {
            if sign < 0.0 {
                DVec2::new(p[v], p[u])
            } else {
                DVec2::new(p[u], p[v])
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::polygon::{doubled_area, normalise};
    use super::*;
    use proptest::prelude::*;

    fn cut(points: &mut [DVec3]) -> (Vec<[usize; 3]>, DVec3) {
        assert!(normalise(points), "the test polygon has an extent");
        let doubled = doubled_area(points);
        (triangulate(points, doubled.normalize()), doubled)
    }

    fn areas(points: &[DVec3], triangles: &[[usize; 3]]) -> Vec<DVec3> {
        triangles
            .iter()
            .map(|&[a, b, c]| (points[b] - points[a]).cross(points[c] - points[a]))
            .collect()
    }

    #[test]
    fn a_dented_quad_is_cut_through_the_dent() {
        let mut points = [[0., 0.], [1., 0.], [0.3, 0.3], [0., 1.]]
            .map(|[x, y]: [f64; 2]| DVec3::new(x, y, 0.0));
        let (triangles, doubled) = cut(&mut points);
        for area in areas(&points, &triangles) {
            assert!(area.dot(doubled) > 0.0, "no triangle is turned over");
        }
    }

    #[test]
    fn a_comb_is_cut_without_overlap() {
        // Teeth of a comb: many reflex corners. Without overlap the unsigned areas sum to the area.
        let mut points: Vec<DVec3> = vec![DVec3::new(0.0, -1.0, 0.0), DVec3::new(8.0, -1.0, 0.0)];
        for tooth in (0..8).rev() {
            let x = f64::from(tooth);
            points.push(DVec3::new(x + 0.9, 2.0, 0.0));
            points.push(DVec3::new(x + 0.5, 0.0, 0.0));
        }
        let (triangles, doubled) = cut(&mut points);
        let sum: f64 = areas(&points, &triangles).iter().map(|a| a.length()).sum();
        assert_eq!(triangles.len(), points.len() - 2);
        // Sixteen triangles of f64 sums.
        assert!((sum - doubled.length()).abs() < 1e-12 * 16.0 * sum, "{sum}");
    }

    #[test]
    fn a_large_outline_takes_the_quick_path() {
        let mut points: Vec<DVec3> = (0..200)
            .map(|i| {
                let angle = f64::from(i) * std::f64::consts::TAU / 200.0;
                let radius = if i % 2 == 0 { 1.0 } else { 0.6 };
                DVec3::new(0.0, radius * angle.cos(), radius * angle.sin())
            })
            .collect();
        let (triangles, doubled) = cut(&mut points);
        let sum: f64 = areas(&points, &triangles).iter().map(|a| a.length()).sum();
        assert!((sum - doubled.length()).abs() < 1e-10 * sum, "no overlap");
    }

    proptest! {
        /// Triangulation preserves the vector area of any outline, planar or not, crossing or not.
        #[test]
        fn vector_area_is_preserved(
            coordinates in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 4..24),
        ) {
            let mut points: Vec<DVec3> = coordinates.into_iter().map(DVec3::from).collect();
            let (triangles, doubled) = cut(&mut points);
            let sum: DVec3 = areas(&points, &triangles).into_iter().sum();
            prop_assert_eq!(triangles.len(), points.len() - 2);
            // Each of up to 24 terms rounds to 1e-16 of an area of up to 8.
            prop_assert!((sum - doubled).length() < 1e-13, "{} against {}", sum, doubled);
        }
    }
}
