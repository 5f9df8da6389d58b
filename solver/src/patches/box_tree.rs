//! A tree of boxes, to find those that meet a given one.
//!
//! Boxes are halved by the median of their middles along the longest side of the box around those, down to
//! a few. Nodes lie depth first, each with the place to go on at when it is passed over, so that a search
//! needs no stack (B. Smits, "Efficiency Issues for Ray Tracing", Journal of Graphics Tools 3(2), 1998).
//! Cost: n log n to build, log n and what it finds for a search.

use glam::DVec3;

/// Boxes up to which a node is not divided.
const LEAF: usize = 4;

/// Lower and upper corner.
pub(super) type Bounds = [DVec3; 2];

/// The box around points; upside down without any.
pub(super) fn bounds_of<'p>(points: impl IntoIterator<Item = &'p DVec3>) -> Bounds {
    points
        .into_iter()
        .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[l, u], &p| {
            [l.min(p), u.max(p)]
        })
}

/// A box, larger by `margin` on every side.
pub(super) fn grown([lower, upper]: Bounds, margin: f64) -> Bounds {
    [lower - margin, upper + margin]
}

fn meet([al, au]: &Bounds, [bl, bu]: &Bounds) -> bool {
    al.cmple(*bu).all() && bl.cmple(*au).all()
}

struct Node {
    bounds: Bounds,
    /// Where a search goes on that has no business here.
    next: u32,
    /// Items of a leaf; empty in others.
    first: u32,
    count: u32,
}

/// The tree.
pub(super) struct BoxTree {
    nodes: Vec<Node>,
    items: Vec<(Bounds, u32)>,
}

impl BoxTree {
    /// A tree of boxes, which are known by their position in the order given.
    pub(super) fn new(boxes: impl Iterator<Item = Bounds>) -> Self {
        let mut tree = Self {
            nodes: Vec::new(),
            items: boxes.zip(0..).collect(),
        };
        if !tree.items.is_empty() {
            tree.build(0, tree.items.len());
        }
        tree
    }

    fn build(&mut self, first: usize, end: usize) {
        let items = &mut self.items[first..end];
        let bounds = bounds_of(items.iter().flat_map(|(bounds, _)| bounds));
        let slot = self.nodes.len();
        let is_leaf = items.len() <= LEAF;
        self.nodes.push(Node {
            bounds,
            next: 0,
            first: first as u32,
            count: if is_leaf { items.len() as u32 } else { 0 },
        });
        if !is_leaf {
            let middles: Vec<DVec3> = items.iter().map(|([l, u], _)| *l + *u).collect();
            let [lower, upper] = bounds_of(&middles);
            let side = upper - lower;
            let axis = (0..3).fold(0, |a, b| if side[b] > side[a] { b } else { a });
            let key = |([l, u], _): &(Bounds, u32)| l[axis] + u[axis];
            let half = items.len() / 2;
            // By position, too: what is equal must not depend on how the selection runs.
            items
                .select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)).then(a.1.cmp(&b.1)));
            self.build(first, first + half);
            self.build(first + half, end);
        }
        self.nodes[slot].next = self.nodes.len() as u32;
    }

    /// Calls `found` with the positions of the boxes that meet `bounds`, touching included.
    pub(super) fn search(&self, bounds: &Bounds, mut found: impl FnMut(usize)) {
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            if !meet(&node.bounds, bounds) {
                at = node.next as usize;
                continue;
            }
            let items = node.first as usize..(node.first + node.count) as usize;
            for (item, position) in &self.items[items] {
                if meet(item, bounds) {
                    found(*position as usize);
                }
            }
            at += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Stage, hash};

    #[test]
    fn a_search_finds_what_a_comparison_with_all_finds() {
        let random = |item: u64, k: u64| {
            let at = |d: u64| hash::uniform(4, Stage::PATCHES, item, 3 * k + d);
            DVec3::new(at(0), at(1), at(2))
        };
        let boxes: Vec<Bounds> = (0..500)
            .map(|k| {
                let lower = random(0, k);
                [lower, lower + 0.1 * random(1, k)]
            })
            .collect();
        let tree = BoxTree::new(boxes.iter().copied());
        for k in 0..100 {
            let lower = random(2, k);
            let wanted = [lower, lower + 0.2 * random(3, k)];
            let mut found = Vec::new();
            tree.search(&wanted, |position| found.push(position));
            found.sort_unstable();
            let all: Vec<usize> = (0..boxes.len())
                .filter(|&position| meet(&boxes[position], &wanted))
                .collect();
            assert_eq!(found, all);
        }
    }

    #[test]
    fn nothing_is_found_among_none() {
        BoxTree::new(std::iter::empty())
            .search(&[DVec3::ZERO, DVec3::ONE], |_| unreachable!("no box"));
    }
}
