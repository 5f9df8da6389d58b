//! Reinsertion: moves subtrees of a binary tree to where they add least area.
//!
//! Each round takes the largest nodes, finds for each, in parallel, the place that lowers the summed
//! area most, and moves those that do not touch each other's surroundings, the best first. Later
//! rounds take fewer nodes, nearer to the root.
//!
//! Source: D. Meister, J. Bittner, "Parallel Reinsertion for Bounding Volume Hierarchy
//! Optimization", Computer Graphics Forum 37(2), 2018. The search and the move are those of obvhs;
//! its driver is not used because in parallel it sorts equal costs in any order. Here ties go to the
//! lower node, so that the tree is the same at any thread count. Cost: about half of that of the
//! tree.

use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::{Reinsertion, find_reinsertion, reinsert_node};
use rayon::prelude::*;

/// Rounds n take 1 / (2n + 1) of the nodes of the first.
const ROUNDS: usize = 16;

/// Improves `tree`; the first round moves at most `fraction` of the nodes.
pub(super) fn optimise(tree: &mut Bvh2, fraction: f32) {
    if tree.nodes.len() < 3 {
        return;
    }
    tree.init_parents_if_uninit();
    tree.children_are_ordered_after_parents = false;
    let mut touched = vec![false; tree.nodes.len()];
    for round in 0..ROUNDS {
        let share = fraction / (2 * round + 1) as f32;
        let count = ((tree.nodes.len() as f32 * share) as usize).clamp(1, tree.nodes.len() - 1);
        let candidates = largest(tree, count);
        let mut moves: Vec<Reinsertion> = candidates
            .par_iter()
            .map(|&(_, node)| find_reinsertion(tree, node as usize))
            .filter(|found| found.area_diff > 0.0)
            .collect();
        moves.par_sort_unstable_by(|a, b| {
            b.area_diff
                .total_cmp(&a.area_diff)
                .then(a.from.cmp(&b.from))
        });
        touched.fill(false);
        for found in moves {
            let (from, to) = (found.from as usize, found.to as usize);
            let concerned = [
                to,
                from,
                Bvh2Node::get_sibling_id(from),
                tree.parents[to] as usize,
                tree.parents[from] as usize,
            ];
            if !concerned.iter().any(|&node| touched[node]) {
                for node in concerned {
                    touched[node] = true;
                }
                reinsert_node(tree, from, to);
            }
        }
    }
}

/// The `count` largest of the first 2 `count` nodes below the root, in any order: those nodes are
/// nearest to the root, as far as the builder's order goes.
fn largest(tree: &Bvh2, count: usize) -> Vec<(f32, u32)> {
    let end = tree.nodes.len().min(2 * count + 2);
    let mut candidates: Vec<(f32, u32)> = (1..end as u32)
        .into_par_iter()
        .map(|node| (tree.nodes[node as usize].aabb().half_area(), node))
        .collect();
    if count < candidates.len() {
        candidates.select_nth_unstable_by(count, |a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        candidates.truncate(count);
    }
    candidates
}
