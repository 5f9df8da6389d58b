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

/// Cost of a leaf block in units of a node step. Measured equal between 0.7 and 1.5; 0.4 is worse.
const BLOCK_COST: f32 = 1.0;

/// The wide tree.
pub(super) struct Wide {
    pub(super) nodes: Vec<Node>,
    pub(super) blocks: Vec<Block>,
    /// Levels of nodes, at least one.
    pub(super) depth: usize,
    /// The triangles in the order of the leaves.
    pub(super) leaf_order: Vec<TriangleId>,
}

/// The choice for a forest of one root that it is a leaf block.
const AS_BLOCK: u8 = 0;

struct Plan {
    cost: [f32; WIDTH],
    /// `split[j]`: roots that the left child gets when a forest of j + 1 roots is split; for
    /// j = 0 the split of the eight children, or [`AS_BLOCK`]; for j ≥ 1 zero means "use one root
    /// fewer".
    split: [u8; WIDTH],
}

/// Collapses `binary`. Deterministic: ties go to the smaller left part.
pub(super) fn collapse(binary: &Binary, geometry: &Geometry) -> Wide {
    let plans = plan(binary);
    let mut wide = Wide {
        nodes: vec![Node::EMPTY],
        blocks: vec![Block::EMPTY],
        depth: 1,
        leaf_order: Vec::new(),
    };
    // A root that is a block still hangs in a node, so that traversal has one entry.
    let root_is_block = plans[0].split[0] == AS_BLOCK;
    let mut forest = Vec::with_capacity(WIDTH);
    if root_is_block {
        forest.push(0);
    } else {
        children(binary, &plans, 0, &mut forest);
    }
    let mut pending = vec![(0usize, 1usize, forest)];
    while let Some((node, depth, roots)) = pending.pop() {
        wide.depth = wide.depth.max(depth);
        // Deeper nodes are pushed in reverse, so that the first child follows its parent.
        let mut inner = Vec::new();
        for (lane, &root) in roots.iter().enumerate() {
            let child = if plans[root].split[0] == AS_BLOCK {
                Child::block(emit_block(binary, geometry, root, &mut wide))
            } else {
                wide.nodes.push(Node::EMPTY);
                let index = wide.nodes.len() - 1;
                let mut grandchildren = Vec::with_capacity(WIDTH);
                children(binary, &plans, root, &mut grandchildren);
                inner.push((index, depth + 1, grandchildren));
                Child::node(index)
            };
            let bounds = binary.bounds[root];
            let target = &mut wide.nodes[node];
            target.children[lane] = child;
            for axis in 0..3 {
                target.planes[2 * axis][lane] = bounds.lower[axis];
                target.planes[2 * axis + 1][lane] = bounds.upper[axis];
            }
        }
        pending.extend(inner.into_iter().rev());
    }
    wide
}

fn plan(binary: &Binary) -> Vec<Plan> {
    let count = binary.content.len();
    let mut plans: Vec<Plan> = (0..count)
        .map(|_| Plan {
            cost: [0.0; WIDTH],
            split: [0; WIDTH],
        })
        .collect();
    for node in (0..count).rev() {
        let area = binary.bounds[node].half_area();
        let mut plan = Plan {
            cost: [area * BLOCK_COST; WIDTH],
            split: [AS_BLOCK; WIDTH],
        };
        if let Content::Pair(left, right) = binary.content[node] {
            let distribute = |roots: usize| {
                let mut best = (f32::INFINITY, 0u8);
                for k in 1..roots {
                    let cost = plans[left].cost[k - 1] + plans[right].cost[roots - k - 1];
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
        plans[node] = plan;
    }
    plans
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
                for (corner, position) in geometry.triangle(triangle).iter().enumerate() {
                    for (axis, value) in position.as_vec3().to_array().into_iter().enumerate() {
                        block.corners[corner][axis][lane] = value;
                    }
                }
                block.triangles[lane] = triangle.0;
                wide.leaf_order.push(triangle);
                lane += 1;
            }
        }
    }
    wide.blocks.push(block);
    wide.blocks.len() - 1
}
