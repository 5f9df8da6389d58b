//! Clusters faces that are smaller than a patch.
//!
//! Greedy, in the order of the ray tree's leaves, which keeps neighbours together: a face joins
//! the newest open cluster of its material whose normals agree, as long as the cluster's area and
//! extent stay those of a patch. Measured against a hash grid and against one patch a face: equal
//! error at a given number of patches, and 45 ms for 393 000 faces.

use crate::geometry::Geometry;
use glam::DVec3;
use luxel_scenes::{FaceId, MaterialId};

/// Clusters that stay open at a time. With one, faces that alternate in leaf order (the two sides
/// of a board) would close each other's clusters.
const OPEN: usize = 24;

/// Least cosine between a face's normal and its cluster's first normal. 0.5 and 0.95 measured
/// within 10 % of the error at this value.
const CONE: f64 = 0.8;

/// Largest side of a cluster's box, in patch sizes.
const EXTENT: f64 = 1.6;

struct Cluster {
    material: MaterialId,
    normal: DVec3,
    /// Side of a patch at its first face.
    size: f64,
    area: f64,
    lower: DVec3,
    upper: DVec3,
    faces: Vec<FaceId>,
}

/// Groups `faces` (in leaf order) into clusters of at most the square of their `size_of` in area, in
/// the unit frame.
pub(super) fn cluster(
    geometry: &Geometry,
    faces: impl Iterator<Item = FaceId>,
    material_of: impl Fn(FaceId) -> MaterialId,
    area_of: impl Fn(FaceId) -> f64,
    size_of: impl Fn(FaceId) -> f64,
) -> Vec<Vec<FaceId>> {
    let mut clusters: Vec<Cluster> = Vec::new();
    let mut open: Vec<usize> = Vec::with_capacity(OPEN);
    for face in faces {
        let (material, normal, area) = (material_of(face), geometry.normal(face), area_of(face));
        let (lower, upper) = bounds(geometry, face);
        let fits = |cluster: &Cluster| {
            let side = cluster.upper.max(upper) - cluster.lower.min(lower);
            cluster.material == material
                && cluster.normal.dot(normal) > CONE
                && cluster.area + area <= cluster.size * cluster.size
                && side.max_element() <= EXTENT * cluster.size
        };
        if let Some(slot) = open.iter().rposition(|&index| fits(&clusters[index])) {
            let cluster = &mut clusters[open[slot]];
            cluster.area += area;
            cluster.lower = cluster.lower.min(lower);
            cluster.upper = cluster.upper.max(upper);
            cluster.faces.push(face);
        } else {
            if open.len() == OPEN {
                open.remove(0);
            }
            open.push(clusters.len());
            clusters.push(Cluster {
                material,
                normal,
                size: size_of(face),
                area,
                lower,
                upper,
                faces: vec![face],
            });
        }
    }
    clusters.into_iter().map(|cluster| cluster.faces).collect()
}

/// Lower and upper corner of the box around a face, in the unit frame.
fn bounds(geometry: &Geometry, face: FaceId) -> (DVec3, DVec3) {
    geometry
        .triangles_of(face)
        .flat_map(|triangle| geometry.triangle(triangle))
        .fold(
            (DVec3::INFINITY, DVec3::NEG_INFINITY),
            |(lower, upper), corner| (lower.min(corner), upper.max(corner)),
        )
}
