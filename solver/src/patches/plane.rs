//! Planes, and convex polygons that they cut.
//!
//! Clipping after I. E. Sutherland, G. W. Hodgman, "Reentrant polygon clipping", Communications of the
//! ACM 17(1), 1974, with a tolerance within which corners lie on the plane.

use glam::DVec3;

/// The points p with n · p = offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plane {
    /// Of unit length.
    pub(super) normal: DVec3,
    pub(super) offset: f64,
}

impl Plane {
    /// The plane through a point.
    pub(super) fn through(point: DVec3, normal: DVec3) -> Self {
        Self {
            normal,
            offset: normal.dot(point),
        }
    }

    /// Signed distance of a point.
    pub(super) fn distance(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }

    /// The same plane seen from its other side.
    pub(super) fn flipped(&self) -> Self {
        Self {
            normal: -self.normal,
            offset: -self.offset,
        }
    }

    /// The parts of a convex polygon on the negative and the positive side; `None` where no corner
    /// lies farther from the plane than `tolerance`.
    pub(super) fn split(&self, polygon: &[DVec3], tolerance: f64) -> [Option<Vec<DVec3>>; 2] {
        [self.flipped(), *self].map(|plane| plane.part(polygon, tolerance))
    }

    fn part(&self, polygon: &[DVec3], tolerance: f64) -> Option<Vec<DVec3>> {
        let distances: Vec<f64> = polygon.iter().map(|&p| self.distance(p)).collect();
        if distances.iter().all(|&d| d <= tolerance) {
            return None;
        }
        if distances.iter().all(|&d| d >= -tolerance) {
            return Some(polygon.to_vec());
        }
        let mut part = Vec::with_capacity(polygon.len() + 1);
        for (k, &a) in polygon.iter().enumerate() {
            let next = (k + 1) % polygon.len();
            let (da, db) = (distances[k], distances[next]);
            if da >= -tolerance {
                part.push(a);
            }
            if da.min(db) < -tolerance && da.max(db) > tolerance {
                part.push(a.lerp(polygon[next], da / (da - db)));
            }
        }
        Some(part)
    }

    /// Where a convex polygon meets the plane, as positions along a direction; `None` where it does not.
    pub(super) fn meets(
        &self,
        polygon: &[DVec3],
        along: DVec3,
        tolerance: f64,
    ) -> Option<[f64; 2]> {
        let mut span: Option<[f64; 2]> = None;
        let mut add = |point: DVec3| {
            let x = point.dot(along);
            let [low, high] = span.unwrap_or([x, x]);
            span = Some([low.min(x), high.max(x)]);
        };
        for (k, &a) in polygon.iter().enumerate() {
            let b = polygon[(k + 1) % polygon.len()];
            let (da, db) = (self.distance(a), self.distance(b));
            if da.abs() <= tolerance {
                add(a);
            } else if da * db < 0.0 {
                add(a.lerp(b, da / (da - db)));
            }
        }
        span
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Vec<DVec3> {
        vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y]
    }

    #[test]
    fn a_square_is_cut_in_two_or_left_whole() {
        let plane = |x: f64| Plane::through(DVec3::X * x, DVec3::X);
        let [low, high] = plane(0.25)
            .split(&square(), 1e-9)
            .map(|part| part.expect("a part"));
        assert!(low.iter().all(|p| p.x <= 0.25) && high.iter().all(|p| p.x >= 0.25));
        assert_eq!((low.len(), high.len()), (4, 4));
        // On an edge, give or take the tolerance.
        for x in [0.0, 1e-10, -1e-10] {
            assert_eq!(plane(x).split(&square(), 1e-9), [None, Some(square())]);
        }
    }

    #[test]
    fn a_square_meets_a_plane_along_its_chord() {
        let diagonal = DVec3::new(1.0, 1.0, 0.0).normalize();
        let along = DVec3::new(1.0, -1.0, 0.0).normalize();
        let plane = Plane::through(DVec3::X * 0.5, diagonal);
        let [low, high] = plane.meets(&square(), along, 1e-9).expect("a chord");
        assert!((high - low - 0.5f64.sqrt()).abs() < 1e-12);
        assert_eq!(
            Plane::through(DVec3::X * 2.0, DVec3::X).meets(&square(), DVec3::Y, 1e-9),
            None
        );
    }
}
