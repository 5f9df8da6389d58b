//! Clipping of a polygon by a plane: what of it lies in front.
//!
//! Source: I. E. Sutherland, G. W. Hodgman, "Reentrant polygon clipping", Communications of the ACM
//! 17(1), 1974, for one plane. Valid for planar polygons of any shape whose result is to be
//! integrated over its boundary (pieces of a concave polygon stay joined along the plane, where
//! boundary terms cancel). Cost: O(n), no square roots.
//!
//! There is no absolute epsilon: a vertex counts as lying on the plane when its height is within the
//! rounding error of computing it, so that polygons which share an edge with the plane are returned
//! as they are. The point at which an edge crosses is computed from its lower end whichever way the
//! edge runs, so that neighbours clipped by one plane still share their vertices.

use glam::DVec3;

/// An oriented plane: a point on it and its normal, of any non-zero length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// A point on the plane, in metres.
    pub point: DVec3,
    /// The side that counts as front.
    pub normal: DVec3,
}

impl Plane {
    /// n·(v − o): the height of a point above the plane in metres times |n|, exactly zero when it is
    /// within rounding.
    pub fn height(&self, vertex: DVec3) -> f64 {
        let offset = vertex - self.point;
        let height = self.normal.dot(offset);
        // Coordinates, difference, three products and two sums: at most 6 units of rounding of the
        // sum of magnitudes, where the normal itself carries a few more.
        let noise = 16.0 * f64::EPSILON * self.normal.abs().dot(offset.abs());
        if height.abs() <= noise { 0.0 } else { height }
    }
}

/// The point where the segment between two vertices at heights of strictly opposite sign meets the
/// plane; the same bits for either direction of the segment.
pub(super) fn crossing(a: DVec3, height_a: f64, b: DVec3, height_b: f64) -> DVec3 {
    let (low, below, high, above) = if height_a < height_b {
        (a, height_a, b, height_b)
    } else {
        (b, height_b, a, height_a)
    };
    low + (high - low) * (below / (below - above))
}

/// Writes the part of a polygon that lies on the plane or in front of it to `out`, in the same
/// orientation; empty when nothing lies strictly in front.
pub fn clip(polygon: &[DVec3], plane: &Plane, out: &mut Vec<DVec3>) {
    out.clear();
    let Some(&last) = polygon.last() else { return };
    let mut previous = last;
    let mut previous_height = plane.height(last);
    let mut is_in_front = false;
    for &vertex in polygon {
        let height = plane.height(vertex);
        if (previous_height < 0.0 && height > 0.0) || (previous_height > 0.0 && height < 0.0) {
            out.push(crossing(previous, previous_height, vertex, height));
        }
        if height >= 0.0 {
            out.push(vertex);
        }
        is_in_front |= height > 0.0;
        previous = vertex;
        previous_height = height;
    }
    if !is_in_front {
        out.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [DVec3; 4] = [
        DVec3::new(0.0, 0.0, 0.0),
        DVec3::new(1.0, 0.0, 0.0),
        DVec3::new(1.0, 1.0, 0.0),
        DVec3::new(0.0, 1.0, 0.0),
    ];

    fn clipped(polygon: &[DVec3], point: DVec3, normal: DVec3) -> Vec<DVec3> {
        let mut out = Vec::new();
        clip(polygon, &Plane { point, normal }, &mut out);
        out
    }

    #[test]
    fn a_polygon_in_front_is_returned_as_it_is() {
        assert_eq!(clipped(&SQUARE, -DVec3::X, DVec3::X), SQUARE, "clear");
        assert_eq!(clipped(&SQUARE, DVec3::ZERO, DVec3::X), SQUARE, "touching");
    }

    #[test]
    fn nothing_is_left_behind_or_in_the_plane() {
        assert!(clipped(&SQUARE, DVec3::X, DVec3::X).is_empty(), "touching");
        assert!(clipped(&SQUARE, DVec3::ZERO, DVec3::Z).is_empty(), "in it");
        assert!(clipped(&[], DVec3::ZERO, DVec3::Z).is_empty(), "no polygon");
    }

    #[test]
    fn a_plane_through_a_diagonal_leaves_a_triangle() {
        let half = clipped(&SQUARE, DVec3::ZERO, DVec3::new(1.0, -1.0, 0.0));
        assert_eq!(half, [SQUARE[0], SQUARE[1], SQUARE[2]], "lower half");
    }

    #[test]
    fn the_cut_does_not_depend_on_units() {
        let normal = DVec3::new(3.0, 1.0, 0.0);
        let base = clipped(&SQUARE, DVec3::splat(0.4), normal);
        for exponent in [-300, -40, 40, 300] {
            let scale = 2.0_f64.powi(exponent);
            let scaled: Vec<_> = SQUARE.iter().map(|&v| v * scale).collect();
            let cut = clipped(&scaled, DVec3::splat(0.4) * scale, normal);
            let back: Vec<_> = cut.iter().map(|&v| v / scale).collect();
            assert_eq!(back, base, "a power of two changes no digit: 2^{exponent}");
        }
    }

    #[test]
    fn neighbours_share_the_vertices_of_the_cut() {
        let (a, b) = (DVec3::new(0.1, 0.7, 0.3), DVec3::new(-0.9, 0.2, 0.77));
        let plane = Plane {
            point: DVec3::ZERO,
            normal: DVec3::new(0.3, 0.1, -0.2),
        };
        let (ha, hb) = (plane.height(a), plane.height(b));
        assert!(ha * hb < 0.0, "the edge crosses");
        assert_eq!(crossing(a, ha, b, hb), crossing(b, hb, a, ha), "to the bit");
    }
}
