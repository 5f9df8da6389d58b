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

/// The indices of the polygons that may stand between two others.
pub(super) fn candidates(p: &Polygon, q: &Polygon, occluders: &[Polygon]) -> Vec<usize> {
    let planes = [p.plane(), q.plane()];
    let (low, high) = bounds(p.vertices().iter().chain(q.vertices()));
    let mut sides: Option<Vec<Plane>> = None;
    let mut found = Vec::new();
    for (index, occluder) in occluders.iter().enumerate() {
        let vertices = occluder.vertices();
        let (o_low, o_high) = bounds(vertices.iter());
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
        let sides = sides.get_or_insert_with(|| supporting_planes(p, q));
        if !sides.iter().any(|plane| is_behind(vertices, plane)) {
            found.push(index);
        }
    }
    found
}

/// True when no vertex is in front of a plane.
fn is_behind(vertices: &[DVec3], plane: &Plane) -> bool {
    vertices.iter().all(|&v| plane.height(v) <= 0.0)
}

fn bounds<'a>(vertices: impl Iterator<Item = &'a DVec3>) -> (DVec3, DVec3) {
    vertices.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &v| {
        (low.min(v), high.max(v))
    })
}

/// Planes through an edge of one and a vertex of the other, with all vertices in front or on them.
fn supporting_planes(p: &Polygon, q: &Polygon) -> Vec<Plane> {
    let mut planes = Vec::new();
    for (one, other) in [(p, q), (q, p)] {
        for (a, b) in one.edges() {
            for &v in other.vertices() {
                let normal = (b - a).cross(v - a);
                for normal in [normal, -normal] {
                    let plane = Plane { point: a, normal };
                    let mut heights = one
                        .vertices()
                        .iter()
                        .chain(other.vertices())
                        .map(|&v| plane.height(v));
                    let mut is_proper = false;
                    let holds = heights.all(|h| {
                        is_proper |= h > 0.0;
                        h >= 0.0
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
        let found = candidates(&floor, &ceiling, &occluders);
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
                assert!(candidates(p, q, &walls).is_empty(), "{p:?} {q:?}");
            }
        }
    }
}
