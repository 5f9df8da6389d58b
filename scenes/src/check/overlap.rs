//! Duplicate faces, and faces in one plane that overlap and face the same side.
//!
//! Faces are hashed by plane and sorted along one axis within it; pairs whose boxes meet are tested
//! for a separating axis (S. Gottschalk, M. C. Lin, D. Manocha, "OBBTree", SIGGRAPH 1996; in the
//! plane, edge normals of convex polygons suffice). Valid for the planar convex faces that scenes
//! hold. Cost: O(n log n) for usual tessellations.

use super::finding::{FaceRef, Finding};
use super::weld::Welded;
use crate::id::FaceId;
use crate::scene::Scene;
use glam::DVec3;
use std::collections::{BTreeMap, HashMap, HashSet};

/// Difference of unit normals within which faces may lie in one plane. Larger compares more pairs in
/// vain, smaller misses small faces whose corners were rounded.
const SAME_NORMAL: f64 = 1e-4;
/// Width of a hash cell in units of the tolerance: each face goes into the one to sixteen cells that
/// it may share.
const CELL: f64 = 8.0;
/// Depth of an overlap over the extent of the smaller face, from which it is one. Neighbours that
/// meet in a rounded edge overlap by 1e-5 and less.
const DEEP: f64 = 1e-3;

/// What the tests need of a face.
struct Flat {
    face: FaceId,
    normal: DVec3,
    /// Distance of its plane from the scene's middle.
    distance: f64,
    low: DVec3,
    high: DVec3,
}

/// Pairs counted by the object of their first face.
#[derive(Default)]
struct Pairs(BTreeMap<u32, (usize, [FaceId; 2])>);

impl Pairs {
    fn add(&mut self, scene: &Scene, pair: [FaceId; 2]) {
        let object = scene.faces[pair[0].index()].object.0;
        self.0.entry(object).or_insert((0, pair)).0 += 1;
    }

    fn findings(
        self,
        scene: &Scene,
        finding: fn(usize, [FaceRef; 2]) -> Finding,
    ) -> impl Iterator<Item = Finding> {
        self.0
            .into_values()
            .map(move |(count, pair)| finding(count, pair.map(|face| FaceRef::new(scene, face))))
    }
}

/// Findings about faces at the same place.
pub(super) fn report(scene: &Scene, welded: &Welded, findings: &mut Vec<Finding>) {
    let duplicates = duplicates(scene, welded);
    let mut pairs = Pairs::default();
    for &[a, b] in &duplicates {
        pairs.add(scene, [a, b]);
    }
    findings.extend(
        pairs.findings(scene, |count, [first, second]| Finding::DuplicateFaces {
            count,
            first,
            second,
        }),
    );
    let known: HashSet<[FaceId; 2]> = duplicates.into_iter().collect();
    let mut pairs = Pairs::default();
    for pair in overlaps(scene, welded) {
        if !known.contains(&pair) {
            pairs.add(scene, pair);
        }
    }
    findings.extend(
        pairs.findings(scene, |count, [first, second]| Finding::OverlappingFaces {
            count,
            first,
            second,
        }),
    );
}

/// Faces that have the corners of an earlier one and face the same side.
fn duplicates(scene: &Scene, welded: &Welded) -> Vec<[FaceId; 2]> {
    let mut seen: HashMap<Vec<u32>, Vec<FaceId>> = HashMap::new();
    let mut duplicates = Vec::new();
    for face in scene.face_ids() {
        let corners = &scene.corners.vertex[scene.faces[face.index()].corners()];
        let mut places: Vec<u32> = corners.iter().map(|&v| welded.place[v as usize]).collect();
        places.sort_unstable();
        let alike = seen.entry(places).or_default();
        let area = scene.vector_area(face);
        if let Some(&first) = alike
            .iter()
            .find(|&&f| scene.vector_area(f).dot(area) > 0.0)
        {
            duplicates.push([first, face]);
        } else {
            alike.push(face);
        }
    }
    duplicates
}

/// Pairs of faces that overlap in one plane and face the same side, sorted.
fn overlaps(scene: &Scene, welded: &Welded) -> Vec<[FaceId; 2]> {
    let middle = scene
        .bounds()
        .map_or(DVec3::ZERO, |(low, high)| low.midpoint(high));
    let faces: Vec<Flat> = scene
        .face_ids()
        .map(|face| flat(scene, face, middle))
        .collect();
    // A normal that is off by the tolerance moves the plane at the scene's edge by this much.
    let same_distance = SAME_NORMAL * welded.diagonal;
    let mut by_plane: HashMap<[i64; 4], Vec<u32>> = HashMap::new();
    for (index, face) in faces.iter().enumerate() {
        let coordinates = [
            face.normal.x / SAME_NORMAL,
            face.normal.y / SAME_NORMAL,
            face.normal.z / SAME_NORMAL,
            face.distance / same_distance,
        ];
        for key in keys(coordinates) {
            by_plane.entry(key).or_default().push(index as u32);
        }
    }
    let mut pairs = Vec::new();
    for group in by_plane.values_mut().filter(|group| group.len() > 1) {
        sweep(scene, welded, &faces, group, &mut pairs);
    }
    // The hash map's order is not the same in every run, and neighbouring cells find pairs twice.
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}

fn flat(scene: &Scene, face: FaceId, middle: DVec3) -> Flat {
    let normal = scene.vector_area(face).normalize_or_zero();
    let corners = scene.polygon(face);
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let mut sum = 0.0;
    for corner in corners.clone() {
        low = low.min(corner);
        high = high.max(corner);
        sum += (corner - middle).dot(normal);
    }
    Flat {
        face,
        normal,
        distance: sum / corners.len() as f64,
        low,
        high,
    }
}

/// The cells that lie within the tolerance (one) of a point in the space of planes.
fn keys(coordinates: [f64; 4]) -> Vec<[i64; 4]> {
    let mut keys = vec![[0; 4]];
    for (axis, x) in coordinates.into_iter().enumerate() {
        let [low, high] = [x - 1.0, x + 1.0].map(|x| (x / CELL).floor() as i64);
        for i in 0..keys.len() {
            keys[i][axis] = low;
            if high != low {
                let mut key = keys[i];
                key[axis] = high;
                keys.push(key);
            }
        }
    }
    keys
}

/// Tests the faces of one cell in which boxes meet.
fn sweep(
    scene: &Scene,
    welded: &Welded,
    faces: &[Flat],
    group: &mut [u32],
    pairs: &mut Vec<[FaceId; 2]>,
) {
    // Along the axis in which the group is longest, which its normal is not.
    let at = |i: u32| &faces[i as usize];
    let low = group
        .iter()
        .fold(DVec3::INFINITY, |low, &i| low.min(at(i).low));
    let high = group
        .iter()
        .fold(DVec3::NEG_INFINITY, |high, &i| high.max(at(i).high));
    let axis = (high - low).max_position();
    group.sort_unstable_by(|&a, &b| at(a).low[axis].total_cmp(&at(b).low[axis]).then(a.cmp(&b)));
    let mut active: Vec<u32> = Vec::new();
    for &index in group.iter() {
        let face = at(index);
        active.retain(|&other| at(other).high[axis] > face.low[axis]);
        for &other in &active {
            let (first, second) = (at(index.min(other)), at(index.max(other)));
            if overlap(scene, welded, first, second) {
                pairs.push([first.face, second.face]);
            }
        }
        active.push(index);
    }
}

/// True when two faces overlap in one plane and face the same side.
fn overlap(scene: &Scene, welded: &Welded, a: &Flat, b: &Flat) -> bool {
    let extent = |f: &Flat| (f.high - f.low).max_element();
    let depth = DEEP * extent(a).min(extent(b));
    let boxes = a.high.min(b.high) - a.low.max(b.low);
    // In the plane both extents of the common box must be deep; across it, none is.
    let shallow = boxes.to_array().iter().filter(|&&x| x < depth).count();
    if boxes.min_element() < -welded.tolerance || shallow > 1 || a.normal.dot(b.normal) < 0.5 {
        return false;
    }
    let large = if extent(a) >= extent(b) { a } else { b };
    let small = if extent(a) >= extent(b) { b } else { a };
    let origin = scene.polygon(large.face).next().unwrap_or_default();
    let is_flat = scene
        .polygon(small.face)
        .all(|p| (p - origin).dot(large.normal).abs() <= 2.0 * welded.tolerance);
    is_flat && !is_separated(scene, a, b, depth) && !is_separated(scene, b, a, depth)
}

/// True when `b` lies beyond an edge of `a`, or within `depth` of it.
fn is_separated(scene: &Scene, a: &Flat, b: &Flat, depth: f64) -> bool {
    let corners = scene.polygon(a.face);
    let next = corners.clone().cycle().skip(1);
    corners.zip(next).any(|(from, to)| {
        let inward = a.normal.cross(to - from).normalize_or_zero();
        scene
            .polygon(b.face)
            .all(|p| (p - from).dot(inward) <= depth)
    })
}
