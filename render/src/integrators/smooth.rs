//! A value for each patch, made continuous over smooth surfaces.
//!
//! Every corner of a patch's polygons gets the mean of the values of the patches that meet there
//! and whose normals lie within [`CREASE`] of each other; in between, values follow Wachspress'
//! coordinates λ_i ∝ area(v_{i−1}, v_i, v_{i+1}) / (area(x, v_{i−1}, v_i) area(x, v_i, v_{i+1})),
//! which are affine on the edges, so that neighbours agree along them. Where patches of different
//! sizes meet, a corner in the middle of a longer edge leaves a small step. Source: E. L. Wachspress,
//! "A Rational Finite Element Basis", Academic Press, 1975. Validity: convex polygons. For display
//! only: interpolation does not lower the error of a radiosity solution. Cost: a hash of all
//! corners once, a few dozen operations a lookup.

use glam::{DVec3, I64Vec3};
use luxel_scenes::Irradiance;
use luxel_solver::geometry::{Geometry, TriangleId};
use luxel_solver::patches::{PatchId, Patches};
use luxel_solver::surface::SurfacePoint;
use std::collections::HashMap;

/// Least cosine between the normals of patches that are smoothed into each other: 30°. A smaller
/// angle shows the facets of coarse spheres, a larger one blurs the edges of furniture.
const CREASE: f64 = 0.866;

/// Corners nearer than this in units are the same; f64 puts them 1e-15 apart.
const GRID: f64 = 1.0 / 4_194_304.0;

/// Polygons up to which the one that holds a point is searched for. Clusters have more; their
/// triangles are used directly.
const MAX_POLYGONS: usize = 4;

/// Irradiance at the corners of patches.
pub(super) struct SmoothField {
    patches: Vec<Pieces>,
    triangles: HashMap<TriangleId, [Irradiance; 3]>,
    values: Vec<Irradiance>,
}

/// The polygons of a patch; none for clusters.
type Pieces = Vec<Piece>;

/// A convex polygon with a value at each corner.
struct Piece {
    corners: Vec<DVec3>,
    values: Vec<Irradiance>,
}

/// What a patch brings to a corner.
struct Share {
    normal: DVec3,
    value: Irradiance,
}

/// The patches that meet at each corner.
#[derive(Default)]
struct Corners(HashMap<I64Vec3, Vec<Share>>);

impl Corners {
    fn key(position: DVec3) -> I64Vec3 {
        (position / GRID).round().as_i64vec3()
    }

    fn add(&mut self, position: DVec3, normal: DVec3, value: Irradiance) {
        let shares = self.0.entry(Self::key(position)).or_default();
        shares.push(Share { normal, value });
    }

    /// The mean over the shares on the same smooth surface; `own` where there is none.
    fn mean(&self, position: DVec3, normal: DVec3, own: Irradiance) -> Irradiance {
        let shares = self.0.get(&Self::key(position)).into_iter().flatten();
        let (mut sum, mut count) = (Irradiance::ZERO, 0.0);
        for share in shares.filter(|share| share.normal.dot(normal) > CREASE) {
            sum += share.value;
            count += 1.0;
        }
        if count > 0.0 {
            sum * (1.0 / count)
        } else {
            own
        }
    }
}

impl SmoothField {
    /// The field of `values`, one for each patch.
    ///
    /// # Panics
    /// When there is not one value per patch.
    pub(super) fn new(geometry: &Geometry, patches: &Patches, values: Vec<Irradiance>) -> Self {
        assert_eq!(values.len(), patches.len(), "one value per patch");
        let polygons: Vec<Vec<Vec<DVec3>>> = patches
            .ids()
            .map(|patch| patches.polygons(geometry, patch))
            .collect();
        let mut corners = Corners::default();
        for (polygons, &value) in polygons.iter().zip(&values) {
            for polygon in polygons {
                let normal = normal(polygon);
                for &corner in polygon {
                    corners.add(corner, normal, value);
                }
            }
        }
        let mut field = Self {
            patches: Vec::with_capacity(polygons.len()),
            triangles: HashMap::new(),
            values,
        };
        for (id, polygons) in patches.ids().zip(polygons) {
            let own = field.values[id.index()];
            if polygons.len() > MAX_POLYGONS {
                let (faces, side) = patches.faces(id);
                for triangle in faces.iter().flat_map(|&face| geometry.triangles_of(face)) {
                    let front = geometry.normal(geometry.face(triangle));
                    // Both sides of a cluster share its triangles; the front is what is shown.
                    if side == luxel_solver::patches::Side::Front {
                        let vertices = geometry.triangle(triangle);
                        let values = vertices.map(|vertex| corners.mean(vertex, front, own));
                        field.triangles.insert(triangle, values);
                    }
                }
                field.patches.push(Vec::new());
            } else {
                let pieces = polygons.into_iter().map(|polygon| {
                    let normal = normal(&polygon);
                    let values = polygon
                        .iter()
                        .map(|&corner| corners.mean(corner, normal, own))
                        .collect();
                    Piece {
                        corners: polygon,
                        values,
                    }
                });
                field.patches.push(pieces.collect());
            }
        }
        field
    }

    /// The value at a point of a patch, `position` in units.
    pub(super) fn at(&self, patch: PatchId, point: SurfacePoint, position: DVec3) -> Irradiance {
        let own = self.values[patch.index()];
        let pieces = &self.patches[patch.index()];
        if pieces.is_empty() {
            return self
                .triangles
                .get(&point.triangle)
                .map_or(own, |[a, b, c]| {
                    *a * (1.0 - point.u - point.v) + *b * point.u + *c * point.v
                });
        }
        let nearest = pieces
            .iter()
            .max_by(|a, b| depth(&a.corners, position).total_cmp(&depth(&b.corners, position)));
        nearest
            .and_then(|piece| wachspress(piece, position))
            .unwrap_or(own)
    }
}

/// Unit normal of a planar convex polygon.
fn normal(polygon: &[DVec3]) -> DVec3 {
    vector_area(polygon).normalize_or_zero()
}

/// Twice the vector area of a polygon.
fn vector_area(polygon: &[DVec3]) -> DVec3 {
    polygon[1..]
        .windows(2)
        .map(|pair| (pair[0] - polygon[0]).cross(pair[1] - polygon[0]))
        .sum()
}

/// Least signed distance of a point from the edges, positive inside.
fn depth(polygon: &[DVec3], position: DVec3) -> f64 {
    let normal = normal(polygon);
    edges(polygon)
        .map(|(a, b)| {
            let inward = normal.cross(b - a).normalize_or_zero();
            inward.dot(position - a)
        })
        .fold(f64::INFINITY, f64::min)
}

fn edges(polygon: &[DVec3]) -> impl Iterator<Item = (DVec3, DVec3)> + '_ {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().copied().zip(next.copied())
}

/// The interpolated value; `None` for a degenerate polygon. Points outside (by rounding) are
/// clamped to the edges.
fn wachspress(piece: &Piece, position: DVec3) -> Option<Irradiance> {
    let n = piece.corners.len();
    let normal = normal(&piece.corners);
    let area = |a: DVec3, b: DVec3, c: DVec3| (b - a).cross(c - a).dot(normal);
    let scale = vector_area(&piece.corners).length();
    // Kept above zero, so that the weights of an edge's ends dominate on the edge.
    let tiny = 1e-9 * scale;
    let of_edge: Vec<f64> = edges(&piece.corners)
        .map(|(a, b)| area(position, a, b).max(tiny))
        .collect();
    let (mut sum, mut total) = (Irradiance::ZERO, 0.0);
    for i in 0..n {
        let [before, after] = [(i + n - 1) % n, (i + 1) % n];
        let [a, b, c] = [before, i, after].map(|k| piece.corners[k]);
        let weight = area(a, b, c).max(0.0) / (of_edge[before] * of_edge[i]);
        sum += piece.values[i] * weight;
        total += weight;
    }
    (total > 0.0 && total.is_finite()).then(|| sum * (1.0 / total))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolation_reproduces_affine_functions_inside_and_on_edges() {
        let corners = vec![
            DVec3::new(0.0, 0.0, 0.2),
            DVec3::new(1.0, 0.0, 0.2),
            DVec3::new(1.2, 0.7, 0.2),
            DVec3::new(0.4, 1.0, 0.2),
            DVec3::new(-0.1, 0.6, 0.2),
        ];
        let affine = |p: DVec3| Irradiance::splat(3.0 + p.x - 2.0 * p.y);
        let piece = Piece {
            values: corners.iter().map(|&corner| affine(corner)).collect(),
            corners,
        };
        for position in [
            DVec3::new(0.5, 0.4, 0.2),
            DVec3::new(0.1, 0.1, 0.2),
            DVec3::new(0.5, 0.0, 0.2),
            DVec3::new(1.0, 0.0, 0.2),
        ] {
            let value = wachspress(&piece, position).expect("a polygon");
            // The floor of 1e-9 on edge areas shows on edges and corners only.
            assert!(
                (value.0 - affine(position).0).abs().max_element() < 1e-7,
                "{position}"
            );
        }
    }

    #[test]
    fn corners_are_shared_on_smooth_surfaces_only() {
        let mut corners = Corners::default();
        let tilted = DVec3::new(0.3, 0.0, 1.0).normalize();
        corners.add(DVec3::ZERO, DVec3::Z, Irradiance::splat(1.0));
        corners.add(DVec3::splat(1e-15), tilted, Irradiance::splat(3.0));
        corners.add(DVec3::ZERO, DVec3::X, Irradiance::splat(100.0));
        let mean = |normal| corners.mean(DVec3::ZERO, normal, Irradiance::ZERO).0.x;
        assert!((mean(DVec3::Z) - 2.0).abs() < 1e-15);
        assert!((mean(DVec3::X) - 100.0).abs() < 1e-15);
    }
}
