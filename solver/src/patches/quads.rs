//! Joins coplanar pairs of triangles into convex quads.
//!
//! Modellers and file formats cut rectangles into triangles; a grid of elements wants the
//! rectangle back. A triangle joins the neighbour with which it makes the quad nearest to a
//! parallelogram. Linear in the number of faces.

use crate::geometry::Geometry;
use glam::DVec3;
use luxel_scenes::{FaceId, MaterialId};
use std::collections::{HashMap, HashSet};

/// How far normals may differ (sine) for two triangles to be one plane: the rounding of f32
/// coordinates in a file, over an edge a thousandth of the scene.
const COPLANAR: f64 = 1e-4;

/// A quad made of two triangles, as corners in the order of its boundary.
pub(super) struct JoinedQuad {
    pub(super) faces: [FaceId; 2],
    pub(super) corners: [DVec3; 4],
}

type EdgeKey = [[u64; 3]; 2];

fn edge_key(a: DVec3, b: DVec3) -> EdgeKey {
    // Adding zero turns −0 into +0, which is the same place.
    [a, b].map(|p| (p + DVec3::ZERO).to_array().map(f64::to_bits))
}

/// Pairs the triangles among `faces`; what finds no partner is left out. The order of the result
/// follows `faces`.
pub(super) fn join(
    geometry: &Geometry,
    faces: &[FaceId],
    material_of: impl Fn(FaceId) -> MaterialId,
) -> Vec<JoinedQuad> {
    let is_triangle = |face: FaceId| geometry.triangles_of(face).len() == 1;
    let corners = |face: FaceId| -> [DVec3; 3] {
        let triangle = geometry
            .triangles_of(face)
            .next()
            .expect("a face has a triangle");
        geometry.triangle(triangle)
    };
    // Directed edge → the triangle on its left.
    let mut owner: HashMap<EdgeKey, FaceId> = HashMap::new();
    for &face in faces.iter().filter(|&&face| is_triangle(face)) {
        let c = corners(face);
        for k in 0..3 {
            owner.insert(edge_key(c[k], c[(k + 1) % 3]), face);
        }
    }
    let mut joined = HashSet::new();
    let mut quads = Vec::new();
    for &face in faces.iter().filter(|&&face| is_triangle(face)) {
        if joined.contains(&face) {
            continue;
        }
        let c = corners(face);
        let mut best: Option<(f64, FaceId, [DVec3; 4])> = None;
        for k in 0..3 {
            let (a, b, apex) = (c[k], c[(k + 1) % 3], c[(k + 2) % 3]);
            let Some(&other) = owner.get(&edge_key(b, a)) else {
                continue;
            };
            let partner = corners(other);
            let same_plane = geometry.normal(face).cross(geometry.normal(other)).length()
                < COPLANAR
                && geometry.normal(face).dot(geometry.normal(other)) > 0.0;
            if other == face
                || joined.contains(&other)
                || !same_plane
                || material_of(face) != material_of(other)
            {
                continue;
            }
            let Some(&far) = partner.iter().find(|&&p| p != a && p != b) else {
                continue;
            };
            let quad = [apex, a, far, b];
            if !is_convex(quad, geometry.normal(face)) {
                continue;
            }
            let skew = (apex + far - a - b).length() / (apex - far).length().max((a - b).length());
            if best.as_ref().is_none_or(|(least, ..)| skew < *least) {
                best = Some((skew, other, quad));
            }
        }
        if let Some((_, other, corners)) = best {
            joined.extend([face, other]);
            quads.push(JoinedQuad {
                faces: [face, other],
                corners,
            });
        }
    }
    quads
}

/// Every corner turns left by more than rounding, and no angle is nearly straight: elements of a
/// degenerate quad would be slivers.
pub(super) fn is_convex(quad: [DVec3; 4], normal: DVec3) -> bool {
    (0..4).all(|k| {
        let before = quad[k] - quad[(k + 3) % 4];
        let after = quad[(k + 1) % 4] - quad[k];
        before.cross(after).dot(normal) > 0.05 * before.length() * after.length()
    })
}
