//! Edges: open ones, T-junctions, neighbours that face opposite sides.
//!
//! An edge of a closed surface runs once each way. What runs one way only is split at all vertices
//! that lie on it; pieces that then find their counterpart are T-junctions, the others are open.
//! Cost: O(n log n) in the number of edges, plus the length of the open ones in cells of a grid.

use super::finding::{FaceRef, Finding};
use super::weld::{Welded, cell};
use crate::id::FaceId;
use crate::scene::Scene;
use glam::{DVec3, I64Vec3};
use std::collections::{BTreeMap, HashMap};

/// A directed edge between two places.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Edge {
    low: u32,
    high: u32,
    /// It runs from `low` to `high`.
    forward: bool,
    /// Index of its face, or of the longer edge that it is a piece of.
    pub(super) owner: u32,
}

impl Edge {
    fn new(from: u32, to: u32, owner: u32) -> Self {
        Self {
            low: from.min(to),
            high: from.max(to),
            forward: from < to,
            owner,
        }
    }

    /// True when as many edges of a group run one way as the other.
    pub(super) fn is_balanced(group: &[Self]) -> bool {
        2 * group.iter().filter(|edge| edge.forward).count() == group.len()
    }

    fn ends(self) -> [u32; 2] {
        if self.forward {
            [self.low, self.high]
        } else {
            [self.high, self.low]
        }
    }
}

/// Edges of all faces, sorted, so that the same ones lie together.
pub(super) fn edges(scene: &Scene, welded: &Welded) -> Vec<Edge> {
    let mut edges = Vec::with_capacity(scene.corners.vertex.len());
    for (index, face) in scene.faces.iter().enumerate() {
        let corners = &scene.corners.vertex[face.corners()];
        let places = corners.iter().map(|&vertex| welded.place[vertex as usize]);
        let next = places.clone().cycle().skip(1);
        for (from, to) in places.zip(next) {
            if from != to {
                edges.push(Edge::new(from, to, index as u32));
            }
        }
    }
    edges.sort_unstable();
    edges
}

/// Groups of edges between the same two places.
pub(super) fn groups(edges: &[Edge]) -> impl Iterator<Item = &[Edge]> {
    edges.chunk_by(|a, b| (a.low, a.high) == (b.low, b.high))
}

/// What counts of an object's edges.
#[derive(Default)]
struct Count {
    count: usize,
    first: Option<Edge>,
}

/// Counts by object, in the order of objects.
#[derive(Default)]
struct ByObject(BTreeMap<u32, Count>);

impl ByObject {
    fn add(&mut self, scene: &Scene, edge: Edge) {
        let object = scene.faces[edge.owner as usize].object.0;
        let count = self.0.entry(object).or_default();
        count.count += 1;
        count.first.get_or_insert(edge);
    }

    fn findings(
        self,
        scene: &Scene,
        welded: &Welded,
        finding: fn(usize, FaceRef, DVec3) -> Finding,
    ) -> impl Iterator<Item = Finding> {
        self.0
            .into_values()
            .filter_map(move |Count { count, first }| {
                let edge = first?;
                let [a, b] = edge.ends().map(|end| welded.position[end as usize]);
                let face = FaceRef::new(scene, FaceId(edge.owner));
                Some(finding(count, face, a.midpoint(b)))
            })
    }
}

/// Findings about edges.
pub(super) fn report(scene: &Scene, welded: &Welded, edges: &[Edge], findings: &mut Vec<Finding>) {
    let mut single: Vec<Edge> = Vec::new();
    let mut winding: BTreeMap<u32, (usize, [u32; 2])> = BTreeMap::new();
    for group in groups(edges) {
        match *group {
            [edge] => single.push(edge),
            [a, b] if a.forward == b.forward && !same_corners(scene, welded, a.owner, b.owner) => {
                let object = scene.faces[a.owner as usize].object.0;
                winding.entry(object).or_insert((0, [a.owner, b.owner])).0 += 1;
            }
            _ => {}
        }
    }
    for (count, pair) in winding.into_values() {
        let [first, second] = pair.map(|face| FaceRef::new(scene, FaceId(face)));
        findings.push(Finding::InconsistentWinding {
            count,
            first,
            second,
        });
    }
    let mut open = ByObject::default();
    let mut junctions = ByObject::default();
    for (edge, is_split, state) in split(welded, &single) {
        if state.is_open {
            open.add(scene, edge);
        }
        if is_split && state.is_met {
            junctions.add(scene, edge);
        }
    }
    findings.extend(
        open.findings(scene, welded, |count, first, at| Finding::OpenEdges {
            count,
            first,
            at,
        }),
    );
    findings.extend(
        junctions.findings(scene, welded, |count, first, at| Finding::TJunctions {
            count,
            first,
            at,
        }),
    );
}

/// True when two faces have all corners in common: they are reported as duplicates.
fn same_corners(scene: &Scene, welded: &Welded, a: u32, b: u32) -> bool {
    let corners = |face: u32| {
        let face = scene.faces[face as usize];
        let mut places: Vec<u32> = scene.corners.vertex[face.corners()]
            .iter()
            .map(|&vertex| welded.place[vertex as usize])
            .collect();
        places.sort_unstable();
        places
    };
    corners(a) == corners(b)
}

/// Whether pieces of an edge meet a counterpart, and whether others do not.
#[derive(Clone, Copy, Default)]
struct State {
    is_met: bool,
    is_open: bool,
}

/// Splits edges at the places that lie on them, and matches the pieces.
fn split(welded: &Welded, single: &[Edge]) -> Vec<(Edge, bool, State)> {
    let grid = Grid::new(welded, single);
    let mut pieces = Vec::with_capacity(single.len());
    let mut is_split = vec![false; single.len()];
    for (index, edge) in single.iter().enumerate() {
        let [from, to] = edge.ends();
        let mut last = from;
        for place in grid.places_on(welded, from, to) {
            is_split[index] = true;
            pieces.push(Edge::new(last, place, index as u32));
            last = place;
        }
        pieces.push(Edge::new(last, to, index as u32));
    }
    pieces.sort_unstable();
    let mut states = vec![State::default(); single.len()];
    for group in groups(&pieces) {
        let has_both = group.iter().any(|p| p.forward) && group.iter().any(|p| !p.forward);
        for piece in group {
            let state = &mut states[piece.owner as usize];
            state.is_met |= has_both;
            state.is_open |= !has_both;
        }
    }
    let edges = single.iter().copied();
    edges
        .zip(is_split)
        .zip(states)
        .map(|((e, s), t)| (e, s, t))
        .collect()
}

/// Ends of single edges, by cell.
struct Grid {
    size: f64,
    cells: HashMap<I64Vec3, Vec<u32>>,
}

impl Grid {
    fn new(welded: &Welded, single: &[Edge]) -> Self {
        let mut places: Vec<u32> = single.iter().flat_map(|edge| edge.ends()).collect();
        places.sort_unstable();
        places.dedup();
        // About as many cells as places; a surface fills few of them.
        let size = welded.diagonal / (places.len() as f64).cbrt().max(1.0);
        let mut cells: HashMap<I64Vec3, Vec<u32>> = HashMap::new();
        for place in places {
            let key = cell(welded.position[place as usize], welded.low, size);
            cells.entry(key).or_default().push(place);
        }
        Self { size, cells }
    }

    /// Places strictly between two others, in order.
    fn places_on(&self, welded: &Welded, from: u32, to: u32) -> Vec<u32> {
        let [a, b] = [from, to].map(|end| welded.position[end as usize]);
        let length = a.distance(b);
        let direction = (b - a) / length;
        let mut on: Vec<(f64, u32)> = Vec::new();
        for key in self.cells_along(welded, a, b) {
            for &place in self.cells.get(&key).into_iter().flatten() {
                let offset = welded.position[place as usize] - a;
                let along = offset.dot(direction);
                let is_between = along > welded.tolerance && along < length - welded.tolerance;
                let is_near = (offset - direction * along).length() <= welded.tolerance;
                if is_between && is_near && place != from && place != to {
                    on.push((along, place));
                }
            }
        }
        on.sort_unstable_by(|x, y| x.0.total_cmp(&y.0));
        on.into_iter().map(|(_, place)| place).collect()
    }

    /// All cells that a segment may touch: those around points on it, a cell apart.
    fn cells_along(&self, welded: &Welded, a: DVec3, b: DVec3) -> Vec<I64Vec3> {
        let steps = (a.distance(b) / self.size).ceil();
        let mut keys = Vec::new();
        let mut step = 0.0;
        while step <= steps {
            let middle = cell(a.lerp(b, step / steps.max(1.0)), welded.low, self.size);
            for x in -1..=1 {
                for y in -1..=1 {
                    for z in -1..=1 {
                        keys.push(middle + I64Vec3::new(x, y, z));
                    }
                }
            }
            step += 1.0;
        }
        keys.sort_unstable_by_key(I64Vec3::to_array);
        keys.dedup();
        keys
    }
}
