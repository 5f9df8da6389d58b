//! Where surfaces end: edges that one face has alone, and the sharp convex edges of solids.
//!
//! Vertices count as one only where their coordinates are the same: a gap of a millionth of the scene
//! is a gap to light. Cost: O(n).

use crate::geometry::Geometry;
use glam::DVec3;
use luxel_scenes::{FaceId, Scene};
use std::collections::HashMap;

/// Cosine between the normals of two faces from which their edge is no longer sharp: round things need not
/// be searched all over.
const SHARP: f64 = 0.87;

/// An edge at which a surface ends, in the unit frame, counter-clockwise around its face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Edge {
    pub(super) face: FaceId,
    /// The other face of a solid's edge; nothing for a free edge.
    pub(super) other: Option<FaceId>,
    pub(super) ends: [DVec3; 2],
    /// The places of its ends, by number.
    places: [u32; 2],
}

/// All such edges, in the order of faces, and who meets where.
pub(super) struct Boundary {
    pub(super) edges: Vec<Edge>,
    /// For each face, the numbers of the places of its corners.
    places: Vec<Vec<u32>>,
}

/// Who has an edge: how many faces, and the last of them that has it in each direction, the one from
/// the lower to the higher number first.
#[derive(Clone, Copy, Default)]
struct Use {
    count: u32,
    faces: [Option<FaceId>; 2],
}

impl Boundary {
    pub(super) fn new(scene: &Scene, geometry: &Geometry) -> Self {
        let mut numbers: HashMap<[u64; 3], u32> = HashMap::new();
        let mut places = Vec::with_capacity(scene.faces.len());
        let mut uses: HashMap<[u32; 2], Use> = HashMap::new();
        for face in scene.face_ids() {
            let ring: Vec<u32> = geometry
                .polygon(face)
                .iter()
                .map(|corner| {
                    // Adding zero makes -0 the same as 0.
                    let key = corner.to_array().map(|c| (c + 0.0).to_bits());
                    let next = numbers.len() as u32;
                    *numbers.entry(key).or_insert(next)
                })
                .collect();
            for edge in around(&ring) {
                let found = uses.entry(sorted(edge)).or_default();
                found.count += 1;
                found.faces[usize::from(edge[0] > edge[1])] = Some(face);
            }
            places.push(ring);
        }
        let mut edges = Vec::new();
        for face in scene.face_ids() {
            let corners = geometry.polygon(face);
            let ring = &places[face.index()];
            for (index, edge) in around(ring).enumerate() {
                let found = uses[&sorted(edge)];
                let ends = [corners[index], corners[(index + 1) % corners.len()]];
                let other = match (found.count, found.faces) {
                    (1, _) => None,
                    // Once, from the face that comes first.
                    (2, [Some(a), Some(b)])
                        if face == a.min(b) && is_sharp(geometry, ends[0], face, a.max(b)) =>
                    {
                        Some(a.max(b))
                    }
                    _ => continue,
                };
                edges.push(Edge {
                    face,
                    other,
                    ends,
                    places: edge,
                });
            }
        }
        Self { edges, places }
    }

    /// Which end of an edge is a corner of `face` too.
    pub(super) fn shared_end(&self, edge: &Edge, face: FaceId) -> Option<DVec3> {
        let places = &self.places[face.index()];
        let shared = edge
            .places
            .iter()
            .position(|place| places.contains(place))?;
        Some(edge.ends[shared])
    }
}

/// Whether two faces that share an edge through `point` make a sharp edge of a solid.
fn is_sharp(geometry: &Geometry, point: DVec3, face: FaceId, other: FaceId) -> bool {
    let normal = geometry.normal(face);
    let corners = geometry.polygon(other);
    let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
    normal.dot(geometry.normal(other)) < SHARP && normal.dot(middle - point) < 0.0
}

fn around(ring: &[u32]) -> impl Iterator<Item = [u32; 2]> + '_ {
    (0..ring.len()).map(|i| [ring[i], ring[(i + 1) % ring.len()]])
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}
