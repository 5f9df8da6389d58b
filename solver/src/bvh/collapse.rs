//! Collapse of the binary tree into nodes of eight children with leaves of one block.
//!
//! Chooses, bottom-up, the cut of least expected cost (surface-area heuristic):
//! C(n, 1) = min(block cost · area if n fits a block, node cost · area + D(n, 8)),
//! D(n, j) = min over k of C(left, k) + C(right, j − k), C(n, j) = min(C(n, j − 1), D(n, j)),
//! where C(n, j) is the cost of representing subtree n as a forest of at most j roots.
//!
//! Source: H. Ylitie, T. Karras, S. Laine, "Efficient Incoherent Ray Traversal on GPUs Through
//! Compressed Wide BVHs", HPG 2017, §3. Cost: about 0.5 µs a triangle.

use super::build::{Binary, Content};
use super::node::{BLOCK, Block, Child, Node, WIDTH};
use crate::geometry::{Geometry, TriangleId};
use crate::memory::held;
use glam::DVec3;
use rayon::prelude::*;

/// Cost of a leaf block in units of a node step. Measured equal between 0.7 and 1.5; 0.4 is worse.
const BLOCK_COST: f32 = 1.0;

/// Level of wide nodes where the tree is cut for work in parallel. The result does not depend on it.
const CUT: usize = 3;

/// Triangles up to which a ray is tested against all of them, and no box is looked at. Measured against
/// the tree: with 12 triangles 2.7 to 4.6 times as fast, with 38 1.1 (shadow rays) to 2.1 times. With more
/// the tree wins, first for shadow rays; with less, rooms of boxes lose what this gains.
pub(super) const FEW: usize = 48;

/// Memory while a tree is collapsed, at most, for each triangle: plans of two nodes, and the wide tree twice, in parts
/// and strung together. A block holds three triangles or more on average, a node of the wide tree seven children.
pub(super) const BYTES_A_TRIANGLE: usize = size_of::<[Plan; 2]>()
    + 2 * (size_of::<Block>() / 3 + size_of::<Node>() / 18 + size_of::<TriangleId>());

/// The wide tree.
pub(super) struct Wide {
    pub(super) nodes: Vec<Node>,
    /// The first is empty ([`Child::NOTHING`]).
    pub(super) blocks: Vec<Block>,
    /// Levels of nodes, at least one.
    pub(super) depth: usize,
    /// The triangles in the order of the leaves.
    pub(super) leaf_order: Vec<TriangleId>,
}

/// The choice for a forest of one root that it is a leaf block.
const AS_BLOCK: u8 = 0;

#[derive(Clone)]
struct Plan {
    cost: [f32; WIDTH],
    /// `split[j]`: roots that the left child gets when a forest of j + 1 roots is split; for
    /// j = 0 the split of the eight children, or [`AS_BLOCK`]; for j ≥ 1 zero means "use one root
    /// fewer".
    split: [u8; WIDTH],
}

impl Plan {
    const NONE: Self = Self {
        cost: [0.0; WIDTH],
        split: [0; WIDTH],
    };
}

/// Collapses `binary`. Deterministic: ties go to the smaller left part, and the parts that are made
/// in parallel are strung together in order.
pub(super) fn collapse(binary: &Binary, geometry: &Geometry) -> Wide {
    let plans = plan(binary);
    let collapse = Collapse {
        binary,
        geometry,
        plans: &plans,
    };
    let mut parts = Vec::new();
    // (part that has the node as a child, lane), part
    let mut links = Vec::new();
    let mut pending = vec![(None, 1, 0)];
    while let Some((parent, depth, root)) = pending.pop() {
        if let Some((part, lane)) = parent {
            links.push((part, lane, parts.len()));
        }
        if depth > CUT {
            parts.push(Err((root, depth)));
            continue;
        }
        let mut part = Wide::empty();
        part.depth = depth;
        let inner = collapse.emit_node(0, root, &mut part);
        let here = parts.len();
        // In reverse, so that the first child follows its parent.
        let below = inner.into_iter().rev();
        pending.extend(below.map(|(lane, root)| (Some((here, lane)), depth + 1, root)));
        parts.push(Ok(part));
    }
    let parts: Vec<Wide> = parts
        .into_par_iter()
        .map(|part| part.unwrap_or_else(|(root, depth)| collapse.emit(root, depth)))
        .collect();
    let wide = string_together(parts, &links);
    wide.check();
    wide
}

impl Wide {
    /// Memory that it holds, in bytes.
    pub(super) fn bytes(&self) -> usize {
        held(&self.nodes) + held(&self.blocks) + held(&self.leaf_order)
    }

    /// A node without children.
    fn empty() -> Self {
        Self {
            nodes: vec![Node::EMPTY],
            blocks: vec![Block::EMPTY],
            depth: 1,
            leaf_order: Vec::new(),
        }
    }

    /// Whether there are so few triangles that the tree does not pay.
    pub(super) fn is_few(&self) -> bool {
        self.leaf_order.len() <= FEW
    }

    /// That every reference to a child names a node or a block. What follows references without a
    /// check of bounds relies on it.
    ///
    /// # Panics
    /// When one does not.
    fn check(&self) {
        let is_valid = |child: &Child| {
            if child.is_block() {
                child.index() < self.blocks.len()
            } else {
                child.index() < self.nodes.len()
            }
        };
        let valid = self
            .nodes
            .par_iter()
            .all(|node| node.children.iter().all(is_valid));
        assert!(
            valid && !self.nodes.is_empty() && !self.blocks.is_empty(),
            "children of the ray tree are in range"
        );
    }
}

/// One tree of parts, whose first nodes are children of other parts' first nodes.
fn string_together(parts: Vec<Wide>, links: &[(usize, usize, usize)]) -> Wide {
    let mut wide = Wide {
        nodes: Vec::with_capacity(parts.iter().map(|part| part.nodes.len()).sum()),
        blocks: Vec::with_capacity(1 + parts.iter().map(|part| part.blocks.len()).sum::<usize>()),
        depth: 1,
        leaf_order: Vec::with_capacity(parts.iter().map(|part| part.leaf_order.len()).sum()),
    };
    wide.blocks.push(Block::EMPTY);
    let mut starts = Vec::with_capacity(parts.len());
    for part in parts {
        // Each part begins with the empty block, which counts once.
        let (nodes, blocks) = (wide.nodes.len(), wide.blocks.len() - 1);
        starts.push(nodes);
        wide.nodes.extend(part.nodes.into_iter().map(|mut node| {
            node.children = node.children.map(|child| child.moved(nodes, blocks));
            node
        }));
        wide.blocks.extend_from_slice(&part.blocks[1..]);
        wide.leaf_order.extend(part.leaf_order);
        wide.depth = wide.depth.max(part.depth);
    }
    for &(parent, lane, child) in links {
        wide.nodes[starts[parent]].children[lane] = Child::node(starts[child]);
    }
    wide
}

struct Collapse<'a> {
    binary: &'a Binary,
    geometry: &'a Geometry,
    plans: &'a [Plan],
}

impl Collapse<'_> {
    /// The wide tree below `root`, whose node is on level `depth`.
    fn emit(&self, root: usize, depth: usize) -> Wide {
        let mut part = Wide::empty();
        let mut pending = vec![(0, depth, root)];
        while let Some((node, depth, root)) = pending.pop() {
            part.depth = part.depth.max(depth);
            let inner = self.emit_node(node, root, &mut part);
            for (lane, root) in inner.into_iter().rev() {
                let child = part.nodes.len();
                part.nodes.push(Node::EMPTY);
                part.nodes[node].children[lane] = Child::node(child);
                pending.push((child, depth + 1, root));
            }
        }
        part
    }

    /// Fills a node and writes its blocks; returns the lanes and roots of children that are nodes.
    fn emit_node(&self, node: usize, root: usize, part: &mut Wide) -> Vec<(usize, usize)> {
        let mut roots = Vec::with_capacity(WIDTH);
        if self.plans[root].split[0] == AS_BLOCK {
            // The root of all is a block: it hangs in a node, so that traversal has one entry.
            roots.push(root);
        } else {
            children(self.binary, self.plans, root, &mut roots);
        }
        let mut inner = Vec::new();
        for (lane, &root) in roots.iter().enumerate() {
            if self.plans[root].split[0] == AS_BLOCK {
                let block = emit_block(self.binary, self.geometry, root, part);
                part.nodes[node].children[lane] = Child::block(block);
            } else {
                inner.push((lane, root));
            }
            let bounds = self.binary.bounds[root];
            for axis in 0..3 {
                part.nodes[node].planes[2 * axis][lane] = bounds.lower[axis];
                part.nodes[node].planes[2 * axis + 1][lane] = bounds.upper[axis];
            }
        }
        inner
    }
}

/// Plans all nodes, the subtrees below the top in parallel.
fn plan(binary: &Binary) -> Vec<Plan> {
    let mut plans = vec![Plan::NONE; binary.content.len()];
    let top = binary.top();
    let mut subtrees = Vec::with_capacity(top.len());
    let (mut rest, mut end) = (&mut plans[..], 0);
    for &(node, count) in &top {
        let (_, from_here) = std::mem::take(&mut rest).split_at_mut(node - end);
        let (subtree, behind) = from_here.split_at_mut(count);
        subtrees.push((node, subtree));
        (rest, end) = (behind, node + count);
    }
    subtrees.into_par_iter().for_each(|(first, plans)| {
        for node in (0..plans.len()).rev() {
            plans[node] = plan_node(binary, first + node, &plans[..], first);
        }
    });
    for &(node, _) in top.iter().rev().filter(|(_, count)| *count == 0) {
        plans[node] = plan_node(binary, node, &plans, 0);
    }
    plans
}

/// The plan of a node from those of its children, in `plans` from number `first` on.
fn plan_node(binary: &Binary, node: usize, plans: &[Plan], first: usize) -> Plan {
    let area = binary.bounds[node].half_area();
    let mut plan = Plan {
        cost: [area * BLOCK_COST; WIDTH],
        split: [AS_BLOCK; WIDTH],
    };
    if let Content::Pair(left, right) = binary.content[node] {
        let (left, right) = (&plans[left - first].cost, &plans[right - first].cost);
        let distribute = |roots: usize| {
            let mut best = (f32::INFINITY, 0u8);
            for k in 1..roots {
                let cost = left[k - 1] + right[roots - k - 1];
                if cost < best.0 {
                    best = (cost, k as u8);
                }
            }
            best
        };
        let (forest, split) = distribute(WIDTH);
        let as_node = area + forest;
        let fits = binary.triangle_count[node] as usize <= BLOCK;
        if !fits || as_node < plan.cost[0] {
            plan.cost[0] = as_node;
            plan.split[0] = split;
        }
        for j in 1..WIDTH {
            let (cost, split) = distribute(j + 1);
            if cost < plan.cost[j - 1] {
                plan.cost[j] = cost;
                plan.split[j] = split;
            } else {
                plan.cost[j] = plan.cost[j - 1];
                plan.split[j] = 0;
            }
        }
    }
    plan
}

/// The roots below `node` when it becomes a wide node.
fn children(binary: &Binary, plans: &[Plan], node: usize, roots: &mut Vec<usize>) {
    let Content::Pair(left, right) = binary.content[node] else {
        unreachable!("a single triangle is planned as a block")
    };
    let k = usize::from(plans[node].split[0]);
    collect(binary, plans, left, k, roots);
    collect(binary, plans, right, WIDTH - k, roots);
}

/// The roots of the best forest of at most `count` roots of `node`. Recursion ends after at most
/// seven splits.
fn collect(binary: &Binary, plans: &[Plan], node: usize, mut count: usize, roots: &mut Vec<usize>) {
    while count > 1 && plans[node].split[count - 1] == 0 {
        count -= 1;
    }
    if count == 1 {
        roots.push(node);
        return;
    }
    let Content::Pair(left, right) = binary.content[node] else {
        unreachable!("a single triangle is never split")
    };
    let k = usize::from(plans[node].split[count - 1]);
    collect(binary, plans, left, k, roots);
    collect(binary, plans, right, count - k, roots);
}

fn emit_block(binary: &Binary, geometry: &Geometry, root: usize, wide: &mut Wide) -> usize {
    let mut block = Block::EMPTY;
    let mut lane = 0;
    let mut stack = vec![root];
    while let Some(node) = stack.pop() {
        match binary.content[node] {
            Content::Pair(left, right) => stack.extend([right, left]),
            Content::Leaf(triangle) => {
                let corners = geometry.triangle(triangle).map(DVec3::as_vec3);
                block.set(lane, triangle.0, corners);
                wide.leaf_order.push(triangle);
                lane += 1;
            }
        }
    }
    wide.blocks.push(block);
    wide.blocks.len() - 1
}
