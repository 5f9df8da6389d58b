//! An element cut along its walls into cells.
//!
//! The wall that stands on the largest share of its chord cuts first, and only the cells on whose chords
//! it stands: a binary space partition (H. Fuchs, Z. M. Kedem, B. F. Naylor, "On Visible Surface
//! Generation by A Priori Tree Structures", SIGGRAPH 1980) that follows walls which end at others. Cost:
//! cells times walls.

use super::walls::{Barrier, COVERED, Wall};
use glam::DVec3;
use luxel_scenes::FaceId;

/// Cells of an element at most. More rooms than that do not fit on a patch in any mesh worth solving.
const MAX_CELLS: usize = 32;

/// Where a step through the tree leads.
#[derive(Clone, Copy, Debug)]
enum Child {
    Node(u32),
    Cell(u32),
}

/// A convex polygon of an element, with its face.
pub(super) type Piece = (FaceId, Vec<DVec3>);

/// The tree: walls by their number.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    root: Child,
    nodes: Vec<(u32, [Child; 2])>,
}

impl Tree {
    /// The cell at a point.
    pub(super) fn find(&self, walls: &[Wall], point: DVec3) -> usize {
        let mut at = self.root;
        loop {
            match at {
                Child::Cell(cell) => return cell as usize,
                Child::Node(node) => {
                    let (wall, children) = self.nodes[node as usize];
                    let is_above = walls[wall as usize].line.distance(point) > 0.0;
                    at = children[usize::from(is_above)];
                }
            }
        }
    }
}

/// Cells and the way to them.
pub(super) struct Partition {
    pub(super) tree: Tree,
    pub(super) cells: Vec<Vec<Piece>>,
}

/// Cuts an element; a single cell where no wall divides it.
pub(super) fn partition(pieces: Vec<Piece>, barriers: &[Barrier], tolerance: f64) -> Partition {
    let mut cells = vec![pieces];
    let mut tree = Tree {
        root: Child::Cell(0),
        nodes: Vec::new(),
    };
    // The place that leads to each cell: a node and which of its sides.
    let mut leads: Vec<Option<(usize, usize)>> = vec![None];
    while cells.len() < MAX_CELLS {
        let mut best: Option<(f64, usize, usize)> = None;
        for (cell, pieces) in cells.iter().enumerate() {
            for (number, barrier) in barriers.iter().enumerate() {
                let share = share(pieces, barrier, tolerance);
                if share >= COVERED
                    && best.is_none_or(|(most, ..)| share > most)
                    && divides(pieces, &barrier.wall, tolerance)
                {
                    best = Some((share, cell, number));
                }
            }
        }
        let Some((_, cell, number)) = best else { break };
        let mut sides = [Vec::new(), Vec::new()];
        for (face, polygon) in std::mem::take(&mut cells[cell]) {
            let parts = barriers[number].wall.line.split(&polygon, tolerance);
            if parts.iter().all(Option::is_none) {
                // Thinner than the tolerance: it may lie on either side.
                sides[0].push((face, polygon));
                continue;
            }
            for (side, part) in sides.iter_mut().zip(parts) {
                side.extend(part.map(|part| (face, part)));
            }
        }
        let node = tree.nodes.len();
        let other = cells.len();
        tree.nodes.push((
            number as u32,
            [Child::Cell(cell as u32), Child::Cell(other as u32)],
        ));
        match leads[cell] {
            None => tree.root = Child::Node(node as u32),
            Some((parent, side)) => tree.nodes[parent].1[side] = Child::Node(node as u32),
        }
        leads[cell] = Some((node, 0));
        leads.push(Some((node, 1)));
        let [below, above] = sides;
        cells[cell] = below;
        cells.push(above);
    }
    Partition { tree, cells }
}

/// True when parts of a cell lie on both sides of a wall.
pub(super) fn divides(pieces: &[Piece], wall: &Wall, tolerance: f64) -> bool {
    let line = &wall.line;
    let corners = || pieces.iter().flat_map(|(_, polygon)| polygon);
    corners().any(|&p| line.distance(p) > tolerance)
        && corners().any(|&p| line.distance(p) < -tolerance)
}

/// Share of a cell's chord that the wall stands on; the chord of pieces that lie apart on both sides is
/// all of their width. Zero where the cell does not meet the wall.
fn share(pieces: &[Piece], barrier: &Barrier, tolerance: f64) -> f64 {
    let line = &barrier.wall.line;
    let mut chord = [f64::INFINITY, f64::NEG_INFINITY];
    let mut add = |[low, high]: [f64; 2]| chord = [chord[0].min(low), chord[1].max(high)];
    for (_, polygon) in pieces {
        if let Some(span) = line.meets(polygon, barrier.along, tolerance) {
            add(span);
        }
    }
    if chord[0] > chord[1] {
        if !divides(pieces, &barrier.wall, tolerance) {
            return 0.0;
        }
        for point in pieces.iter().flat_map(|(_, polygon)| polygon) {
            let x = point.dot(barrier.along);
            chord = [chord[0].min(x), chord[1].max(x)];
        }
    }
    if chord[1] - chord[0] > tolerance {
        barrier.covered(chord)
    } else {
        0.0
    }
}

/// True when a wall stands across a cell or along its border.
pub(super) fn is_beside(pieces: &[Piece], barrier: &Barrier, tolerance: f64) -> bool {
    share(pieces, barrier, tolerance) >= COVERED
}
