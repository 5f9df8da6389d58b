//! Merges coplanar emissive polygons that share an edge.
//!
//! A luminaire that was cut into triangles or tiles shines as one polygon: exact integration costs
//! by the edge, and shadow rays spread better over the whole. Two convex polygons are merged when
//! their union is convex; repeated until nothing changes. Quadratic in the number of polygons of
//! one plane, which is small for luminaires.

use glam::DVec3;

/// Sine of the angle below which edges count as parallel and planes as equal: the rounding of f32
/// coordinates in a file.
const PARALLEL: f64 = 1e-5;

/// Most polygons for which all pairs are tried.
const MAX_POLYGONS: usize = 2048;

/// Merges polygons for which `alike` holds into convex ones. Each polygon carries a value; the
/// values of a merged polygon are joined by `join`.
pub(super) fn merge<T>(
    mut polygons: Vec<(Vec<DVec3>, T)>,
    alike: impl Fn(&T, &T) -> bool,
    join: impl Fn(&mut T, T),
) -> Vec<(Vec<DVec3>, T)> {
    if polygons.len() > MAX_POLYGONS {
        return polygons;
    }
    let mut i = 0;
    while i < polygons.len() {
        let partner = (0..polygons.len()).find_map(|j| {
            if j == i || !alike(&polygons[i].1, &polygons[j].1) {
                return None;
            }
            union(&polygons[i].0, &polygons[j].0).map(|merged| (j, merged))
        });
        let Some((j, merged)) = partner else {
            i += 1;
            continue;
        };
        // Keep the earlier place, so that the order follows the file.
        let (first, second) = (i.min(j), i.max(j));
        let (_, value) = polygons.remove(second);
        polygons[first].0 = merged;
        join(&mut polygons[first].1, value);
        i = first;
    }
    polygons
}

/// The union of two convex polygons that share an edge (with equal corners, in opposite order), if
/// it is convex and planar.
fn union(a: &[DVec3], b: &[DVec3]) -> Option<Vec<DVec3>> {
    let (n, m) = (a.len(), b.len());
    let (k, l) = (0..n)
        .flat_map(|k| (0..m).map(move |l| (k, l)))
        .find(|&(k, l)| a[k] == b[(l + 1) % m] && a[(k + 1) % n] == b[l])?;
    // a from the end of the edge around to its start, then b's corners beyond the edge.
    let mut ring: Vec<DVec3> = (0..n).map(|i| a[(k + 1 + i) % n]).collect();
    ring.extend((2..m).map(|i| b[(l + i) % m]));
    let normal: DVec3 = ring[1..]
        .windows(2)
        .map(|p| (p[0] - ring[0]).cross(p[1] - ring[0]))
        .sum::<DVec3>();
    let normal = normal.normalize();
    let flat = |p: &DVec3| {
        let offset = *p - ring[0];
        offset.dot(normal).abs() <= PARALLEL * offset.length()
    };
    let turn = |i: usize| {
        let before = ring[i] - ring[(i + ring.len() - 1) % ring.len()];
        let after = ring[(i + 1) % ring.len()] - ring[i];
        before.cross(after).dot(normal) / (before.length() * after.length())
    };
    let turns: Vec<f64> = (0..ring.len()).map(turn).collect();
    if !ring.iter().all(flat) || turns.iter().any(|&turn| turn < -PARALLEL || turn.is_nan()) {
        return None;
    }
    // Corners on a straight line are dropped.
    let merged: Vec<DVec3> = ring
        .iter()
        .zip(&turns)
        .filter(|(_, turn)| **turn > PARALLEL)
        .map(|(p, _)| *p)
        .collect();
    (merged.len() >= 3).then_some(merged)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(polygon: &[DVec3]) -> f64 {
        polygon[1..]
            .windows(2)
            .map(|p| 0.5 * (p[0] - polygon[0]).cross(p[1] - polygon[0]).length())
            .sum()
    }

    /// A panel of 3×2 tiles, each cut into two triangles, is one rectangle of four corners.
    #[test]
    fn tiles_become_one_rectangle() {
        let mut polygons = Vec::new();
        for i in 0..3 {
            for j in 0..2 {
                let at = |x: i32, y: i32| DVec3::new(f64::from(x), f64::from(y), 1.0);
                polygons.push((vec![at(i, j), at(i + 1, j), at(i + 1, j + 1)], 1));
                polygons.push((vec![at(i, j), at(i + 1, j + 1), at(i, j + 1)], 1));
            }
        }
        let merged = merge(polygons, |_, _| true, |a, b| *a += b);
        assert_eq!(merged.len(), 1);
        assert_eq!((merged[0].0.len(), merged[0].1), (4, 12));
        // Integers: exact.
        assert!((area(&merged[0].0) - 6.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_not_alike_convex_or_planar_stays() {
        let square = |x: f64, y: f64, z: f64| {
            let p = DVec3::new(x, y, z);
            vec![p, p + DVec3::X, p + DVec3::X + DVec3::Y, p + DVec3::Y]
        };
        let l_shape = vec![
            (square(0.0, 0.0, 0.0), 0),
            (square(1.0, 0.0, 0.0), 1),
            (square(1.0, 1.0, 0.0), 2),
        ];
        assert_eq!(merge(l_shape.clone(), |_, _| true, |_, _| ()).len(), 2);
        assert_eq!(merge(l_shape, |_, _| false, |_, _| ()).len(), 3);
        let fold = vec![
            (square(0.0, 0.0, 0.0), 0),
            (
                vec![
                    DVec3::X,
                    DVec3::new(1.0, 0.0, 1.0),
                    DVec3::new(1.0, 1.0, 1.0),
                    DVec3::new(1.0, 1.0, 0.0),
                ],
                1,
            ),
        ];
        assert_eq!(merge(fold, |_, _| true, |_, _| ()).len(), 2);
    }
}
