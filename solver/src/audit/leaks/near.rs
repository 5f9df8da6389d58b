//! The surface nearest to a point, within a small distance.
//!
//! Triangles are listed in the cells of a grid that their boxes touch; a query looks into the cells
//! around its point. Point to triangle after C. Ericson, "Real-Time Collision Detection", 2005,
//! section 5.1.5, in f64. Cost: O(n) to build, about 1 µs a query.

use crate::geometry::{Geometry, TriangleId};
use glam::{DVec3, IVec3};
use luxel_scenes::FaceId;
use std::collections::HashMap;

/// Cells along the longest side of a scene of many faces: more, and large faces fill too many.
const MOST_CELLS: f64 = 64.0;

/// A surface near a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Near {
    /// Distance in units.
    pub(super) distance: f64,
    /// Its nearest point in the unit frame.
    pub(super) point: DVec3,
    /// The face.
    pub(super) face: FaceId,
}

/// Triangles by place.
pub(super) struct Neighbourhood<'g> {
    geometry: &'g Geometry,
    cell: f64,
    cells: HashMap<IVec3, Vec<TriangleId>>,
}

impl<'g> Neighbourhood<'g> {
    pub(super) fn new(geometry: &'g Geometry) -> Self {
        // The unit frame is at most one wide.
        let cell = 1.0 / (geometry.len() as f64).cbrt().ceil().clamp(4.0, MOST_CELLS);
        let mut cells: HashMap<IVec3, Vec<TriangleId>> = HashMap::new();
        for id in (0..geometry.len() as u32).map(TriangleId) {
            let [a, b, c] = geometry.triangle(id);
            for key in keys(a.min(b).min(c), a.max(b).max(c), cell) {
                cells.entry(key).or_default().push(id);
            }
        }
        Self {
            geometry,
            cell,
            cells,
        }
    }

    /// The nearest surface within `reach` of a point, of those for which `counts` says so; of several
    /// at the same distance the first in the file.
    pub(super) fn nearest(
        &self,
        point: DVec3,
        reach: f64,
        counts: impl Fn(&Near) -> bool,
    ) -> Option<Near> {
        let mut best: Option<Near> = None;
        for key in keys(point - reach, point + reach, self.cell) {
            for &id in self.cells.get(&key).into_iter().flatten() {
                let on = closest(point, self.geometry.triangle(id));
                let found = Near {
                    distance: on.distance(point),
                    point: on,
                    face: self.geometry.face(id),
                };
                let is_better = best.is_none_or(|best| {
                    (found.distance, found.face.index()) < (best.distance, best.face.index())
                });
                if found.distance <= reach && is_better && counts(&found) {
                    best = Some(found);
                }
            }
        }
        best
    }
}

/// The cells that a box touches.
fn keys(low: DVec3, high: DVec3, cell: f64) -> impl Iterator<Item = IVec3> {
    let [low, high] = [low, high].map(|p| (p / cell).floor().as_ivec3());
    (low.x..=high.x).flat_map(move |x| {
        (low.y..=high.y).flat_map(move |y| (low.z..=high.z).map(move |z| IVec3::new(x, y, z)))
    })
}

/// The point of a triangle that is nearest to `p`.
fn closest(p: DVec3, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let sum = va + vb + vc;
    a + ab * (vb / sum) + ac * (vc / sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the nearest of many points of the triangle.
    #[test]
    fn the_closest_point_is_the_nearest_of_all() {
        let triangle = [
            DVec3::new(0.1, 0.0, 0.0),
            DVec3::new(0.5, 0.1, 0.2),
            DVec3::new(0.0, 0.4, 0.1),
        ];
        let [a, b, c] = triangle;
        for i in 0..7 {
            for j in 0..7 {
                for k in 0..3 {
                    let p = DVec3::new(f64::from(i), f64::from(j), f64::from(k)) * 0.2 - 0.4;
                    let found = closest(p, triangle).distance(p);
                    let mut nearest = f64::INFINITY;
                    for u in 0..=60 {
                        for v in 0..=60 - u {
                            let (u, v) = (f64::from(u) / 60.0, f64::from(v) / 60.0);
                            nearest = nearest.min((a + (b - a) * u + (c - a) * v).distance(p));
                        }
                    }
                    // Points of the grid are 0.008 apart at most.
                    assert!(found <= nearest + 1e-12 && found > nearest - 0.008, "{p}");
                }
            }
        }
    }
}
