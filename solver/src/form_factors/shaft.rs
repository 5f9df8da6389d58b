//! Can a polygon stand between two others?
//!
//! A segment from a point of P to a point of Q stays in the convex hull of both. A polygon is out of the way
//! if a plane separates it from that hull: the planes of P, Q and of the polygon itself, the sides of the
//! hull's bounding box, and the planes through an edge of P and a vertex of Q (or the other way round) that
//! have the whole hull on one side. Touching is no obstacle: a segment that grazes a polygon is not
//! blocked by it.
//!
//! Source: E. A. Haines, J. R. Wallace, "Shaft culling for efficient ray-traced radiosity", Eurographics
//! Workshop on Rendering 1991. Conservative: what is kept need not block anything, what is dropped cannot.
//! Cost: a few dot products for most polygons; the supporting planes (about 1 µs) are made once a pair,
//! when a polygon gets past the rest.

use super::clip::Plane;
use super::polygon::Polygon;
use glam::DVec3;

/// The indices of the polygons that may stand between two others. Those that reach less than `margin`
/// (in metres) into the shaft touch it: coordinates that were rounded ask for more than zero.
pub(super) fn candidates(
    p: &Polygon,
    q: &Polygon,
    occluders: &[Polygon],
    margin: f64,
) -> Vec<usize> {
    let planes = [p.plane(), q.plane()];
    let ([p_low, p_high], [q_low, q_high]) = (p.bounds(), q.bounds());
    let (low, high) = (p_low.min(q_low) + margin, p_high.max(q_high) - margin);
    let is_behind = |vertices: &[DVec3], plane: &Plane| is_behind(vertices, plane, margin);
    let mut sides: Option<Vec<Plane>> = None;
    let mut found = Vec::new();
    for (index, occluder) in occluders.iter().enumerate() {
        let vertices = occluder.vertices();
        let [o_low, o_high] = occluder.bounds();
        if o_low.cmpgt(high).any() || o_high.cmplt(low).any() {
            continue;
        }
        if planes.iter().any(|plane| is_behind(vertices, plane)) {
            continue;
        }
        let own = occluder.plane();
        let opposite = Plane {
            point: own.point,
            normal: -own.normal,
        };
        if [own, opposite]
            .iter()
            .any(|plane| is_behind(p.vertices(), plane) && is_behind(q.vertices(), plane))
        {
            continue;
        }
        let sides = sides.get_or_insert_with(|| supporting_planes(p, q, margin));
        if !sides.iter().any(|plane| is_behind(vertices, plane)) {
            found.push(index);
        }
    }
    found
}

/// True when no vertex is in front of a plane with a unit normal by more than `margin`.
fn is_behind(vertices: &[DVec3], plane: &Plane, margin: f64) -> bool {
    vertices.iter().all(|&v| plane.height(v) <= margin)
}

/// Planes through an edge of one and a vertex of the other, with all vertices in front or on them.
fn supporting_planes(p: &Polygon, q: &Polygon, margin: f64) -> Vec<Plane> {
    let mut planes = Vec::new();
    for (one, other) in [(p, q), (q, p)] {
        for (a, b) in one.edges() {
            for &v in other.vertices() {
                let Some(normal) = (b - a).cross(v - a).try_normalize() else {
                    continue;
                };
                for normal in [normal, -normal] {
                    let plane = Plane { point: a, normal };
                    let mut heights = one
                        .vertices()
                        .iter()
                        .chain(other.vertices())
                        .map(|&v| plane.height(v));
                    let mut is_proper = false;
                    let holds = heights.all(|h| {
                        is_proper |= h > margin;
                        h >= -margin
                    });
                    if holds && is_proper {
                        planes.push(plane);
                    }
                }
            }
        }
    }
    planes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(centre: DVec3, u: DVec3, v: DVec3) -> Polygon {
        Polygon::new(&[
            centre - u - v,
            centre + u - v,
            centre + u + v,
            centre - u + v,
        ])
        .expect("a square")
    }

    #[test]
    fn only_what_reaches_into_the_shaft_is_kept() {
        let (x, y, z) = (DVec3::X * 0.5, DVec3::Y * 0.5, DVec3::Z);
        let floor = square(DVec3::ZERO, x, y);
        let ceiling = square(z * 2.0, y, x);
        let occluders = [
            square(z, x * 0.1, y * 0.1),
            square(z + x * 2.1, x * 0.1, y * 0.1),
            square(z + x, x * 0.1, y * 0.1),
            square(z + x * 3.0, x, y),
            square(-z, x, y),
            square(z * 3.0, x, y),
            square(z + x, y, z),
            floor.clone(),
            ceiling.clone(),
            square(z + x * 0.9, y * 0.1, z * 0.1),
        ];
        let found = candidates(&floor, &ceiling, &occluders, 0.0);
        // In the middle, half outside (2), and the wall inside (9); a wall along the side (6) only
        // touches the shaft.
        assert_eq!(found, [0, 2, 9], "of ten");
    }

    #[test]
    fn no_wall_of_a_convex_room_is_in_the_way() {
        let c = DVec3::splat(0.5);
        let (x, y, z) = (DVec3::X * 0.5, DVec3::Y * 0.5, DVec3::Z * 0.5);
        let walls = [
            square(c - x, y, z),
            square(c + x, z, y),
            square(c - y, z, x),
            square(c + y, x, z),
            square(c - z, x, y),
            square(c + z, y, x),
        ];
        for p in &walls {
            for q in &walls {
                assert!(candidates(p, q, &walls, 0.0).is_empty(), "{p:?} {q:?}");
            }
        }
    }
}
