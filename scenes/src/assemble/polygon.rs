//! Tests on one polygon: area, planarity, convexity.
//!
//! All work on coordinates relative to the polygon's first corner and divided by its extent, so
//! that their tolerances hold at every scale and far from the origin.
//!
//! The normal is Newell's: twice the vector area is Σ (pᵢ − p₀) × (pᵢ₊₁ − p₀) (I. E. Sutherland,
//! R. F. Sproull, R. A. Schumacker, "A characterization of ten hidden-surface algorithms", ACM
//! Computing Surveys 6(1), 1974). Cost: O(n).

use glam::DVec3;

/// Twice the area over the squared extent, below which a face is dropped as having none. It is the
/// resolution of f32 coordinates, in which rays see the face: a larger value drops slivers that
/// rays could still hit, a smaller one keeps faces whose normal is rounding noise.
const NO_AREA: f64 = 1e-7;

/// Distance from the mean plane, or depth of a dent, over the extent, that still counts as flat and
/// convex. Files that write six decimals bend a quad of 10 cm by 1e-5; a larger value would flatten
/// what is modelled bent, a smaller one would cut rounded quads into triangles.
const FLATNESS: f64 = 1e-4;

/// What a polygon is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Shape {
    /// Fewer than three different corners, or no area.
    Degenerate,
    /// Flat and convex.
    Convex,
    /// Flat, but not convex (concave or self-intersecting).
    Concave,
    /// Not in one plane.
    NonPlanar,
}

/// Moves the first corner to the origin and scales the largest coordinate to one, in place.
/// Returns false when all corners coincide.
pub(crate) fn normalise(points: &mut [DVec3]) -> bool {
    let Some(&origin) = points.first() else {
        return false;
    };
    let mut extent = 0.0_f64;
    for point in points.iter_mut() {
        *point -= origin;
        extent = extent.max(point.abs().max_element());
    }
    if extent <= 0.0 || !extent.is_finite() {
        return false;
    }
    for point in points.iter_mut() {
        *point /= extent;
    }
    true
}

/// Twice the vector area of a polygon whose first corner is the origin.
pub(crate) fn doubled_area(points: &[DVec3]) -> DVec3 {
    points.windows(2).map(|edge| edge[0].cross(edge[1])).sum()
}

/// True when a normalised triangle or polygon of this doubled area is to be dropped.
pub(crate) fn has_no_area(doubled_area: DVec3) -> bool {
    let doubled = doubled_area.length();
    doubled <= NO_AREA || doubled.is_nan()
}

/// Classifies a normalised polygon.
pub(crate) fn classify(points: &[DVec3]) -> Shape {
    if points.len() < 3 {
        return Shape::Degenerate;
    }
    let doubled = doubled_area(points);
    if has_no_area(doubled) {
        return Shape::Degenerate;
    }
    if points.len() == 3 {
        return Shape::Convex;
    }
    let normal = doubled.normalize();
    if !is_planar(points, normal) {
        return Shape::NonPlanar;
    }
    if is_convex(points, normal) {
        Shape::Convex
    } else {
        Shape::Concave
    }
}

fn is_planar(points: &[DVec3], normal: DVec3) -> bool {
    let centroid = points.iter().copied().sum::<DVec3>() / points.len() as f64;
    points
        .iter()
        .all(|&p| (p - centroid).dot(normal).abs() <= FLATNESS)
}

/// Every corner turns left, and the whole outline turns once. Straight corners are allowed; an
/// outline that folds back on itself is not convex.
fn is_convex(points: &[DVec3], normal: DVec3) -> bool {
    let n = points.len();
    let mut turning = 0.0;
    for i in 0..n {
        let (a, b, c) = (points[i], points[(i + 1) % n], points[(i + 2) % n]);
        let (incoming, outgoing) = (b - a, c - b);
        let sine = incoming.cross(outgoing).dot(normal);
        let cosine = incoming.dot(outgoing);
        // sine / |c − a| is the distance of the corner from the line through its neighbours.
        let dent = -sine > FLATNESS * (c - a).length();
        let spike = cosine < 0.0 && sine.abs() <= FLATNESS * incoming.length() * outgoing.length();
        if dent || spike {
            return false;
        }
        turning += sine.atan2(cosine);
    }
    // A pentagram only turns left too, but twice round.
    (turning - std::f64::consts::TAU).abs() < 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shape(points: &[[f64; 3]]) -> Shape {
        let mut points: Vec<DVec3> = points.iter().map(|&p| DVec3::from(p)).collect();
        if normalise(&mut points) {
            classify(&points)
        } else {
            Shape::Degenerate
        }
    }

    const SQUARE: [[f64; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];

    #[test]
    fn a_square_is_convex_at_every_scale_and_place() {
        for scale in [1e-12, 1.0, 1e12] {
            for offset in [0.0, 1e3 * scale] {
                let moved = SQUARE.map(|p| p.map(|c| c * scale + offset));
                assert_eq!(
                    shape(&moved),
                    Shape::Convex,
                    "scale {scale}, offset {offset}"
                );
            }
        }
    }

    #[test]
    fn collinear_and_coincident_corners_have_no_area() {
        assert_eq!(
            shape(&[[0., 0., 0.], [0.1, 0.1, 0.1], [0.3, 0.3, 0.3]]),
            Shape::Degenerate
        );
        assert_eq!(shape(&[[5., 5., 5.]; 4]), Shape::Degenerate);
        assert_eq!(shape(&[]), Shape::Degenerate);
    }

    #[test]
    fn straight_corners_stay_convex() {
        let with_middle = [
            [0., 0., 0.],
            [0.5, 0., 0.],
            [1., 0., 0.],
            [1., 1., 0.],
            [0., 1., 0.],
        ];
        assert_eq!(shape(&with_middle), Shape::Convex);
    }

    #[test]
    fn dents_bow_ties_pentagrams_and_spikes_are_not_convex() {
        let dent = [[0., 0., 0.], [1., 0., 0.], [0.3, 0.3, 0.], [0., 1., 0.]];
        assert_eq!(shape(&dent), Shape::Concave);
        let bow = [[0., 0., 0.], [2., 0., 0.], [0., 1., 0.], [1., 1., 0.]];
        assert_eq!(shape(&bow), Shape::Concave);
        let star: Vec<[f64; 3]> = (0..5)
            .map(|i| {
                let angle = f64::from(i) * 2.0 * std::f64::consts::TAU / 5.0;
                [angle.cos(), angle.sin(), 0.0]
            })
            .collect();
        assert_eq!(shape(&star), Shape::Concave);
        let spike = [
            [0., 0., 0.],
            [1., 0., 0.],
            [2., 0., 0.],
            [1., 0., 0.],
            [1., 1., 0.],
        ];
        assert_eq!(shape(&spike), Shape::Concave);
    }

    #[test]
    fn a_bent_quad_is_not_planar_but_a_rounded_one_is() {
        let bent = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.01], [0., 1., 0.]];
        assert_eq!(shape(&bent), Shape::NonPlanar);
        let rounded = [[0., 0., 0.], [0.1, 0., 0.], [0.1, 0.1, 1e-6], [0., 0.1, 0.]];
        assert_eq!(shape(&rounded), Shape::Convex);
    }
}
