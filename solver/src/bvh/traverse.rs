//! Traversal of the wide tree, one ray at a time.
//!
//! The eight boxes of a node are tested together; the children that are hit go onto a stack with
//! their entry distances, the nearest on top. The slab test is conservative: far distances are
//! enlarged by 1 + 4ε (T. Ize, "Robust BVH Ray Traversal", JCGT 2(2), 2013).

#![allow(
    clippy::needless_range_loop,
    reason = "loops over lanes without branches become vector instructions"
)]

use super::collapse::Wide;
use super::node::{BLOCK, Child, Node, WIDTH};
use super::ray::{Hit, Ray};
use super::triangle::{self, Shear};
use glam::Vec3;

/// 1 + 4ε with ε = 2⁻²⁴: covers the three roundings of a slab distance.
const FAR_SLACK: f32 = 1.0 + 4.0 / 16_777_216.0;

/// Children still to visit.
pub(super) type Stack = Vec<(Child, f32)>;

/// A stack that holds any path through `wide` without growing.
pub(super) fn stack_for(wide: &Wide) -> Stack {
    Vec::with_capacity(1 + (WIDTH - 1) * wide.depth)
}

struct Slabs {
    origin: Vec3,
    reciprocal: Vec3,
    /// Per axis, the index of the plane that the ray enters through.
    near: [usize; 3],
}

impl Slabs {
    fn new(ray: &Ray) -> Self {
        let reciprocal = triangle::safe_reciprocal(ray.direction);
        let near = [0, 1, 2].map(|axis| 2 * axis + usize::from(reciprocal[axis] < 0.0));
        Self {
            origin: ray.origin,
            reciprocal,
            near,
        }
    }

    /// Entry distances of the eight boxes; infinite where a box is missed.
    #[inline]
    fn entries(&self, node: &Node, tmin: f32, tmax: f32) -> [f32; WIDTH] {
        let mut enter = [tmin; WIDTH];
        let mut leave = [tmax; WIDTH];
        for axis in 0..3 {
            let near = &node.planes[self.near[axis]];
            let far = &node.planes[self.near[axis] ^ 1];
            let (origin, reciprocal) = (self.origin[axis], self.reciprocal[axis]);
            for lane in 0..WIDTH {
                let first = (near[lane] - origin) * reciprocal;
                let second = (far[lane] - origin) * reciprocal * FAR_SLACK;
                enter[lane] = if first > enter[lane] {
                    first
                } else {
                    enter[lane]
                };
                leave[lane] = if second < leave[lane] {
                    second
                } else {
                    leave[lane]
                };
            }
        }
        let mut entries = [f32::INFINITY; WIDTH];
        for lane in 0..WIDTH {
            entries[lane] = if enter[lane] <= leave[lane] {
                enter[lane]
            } else {
                f32::INFINITY
            };
        }
        entries
    }
}

/// The nearest hit with tmin ≤ t < tmax. Of hits at the same distance the triangle of lowest id
/// counts, so that the answer does not depend on the tree.
pub(super) fn closest(wide: &Wide, ray: &Ray, stack: &mut Stack) -> Hit {
    let slabs = Slabs::new(ray);
    let shear = Shear::new(ray);
    // Hits at t = tmax do not count: the test keeps ties at the largest float below.
    let mut nearest = ray.tmax.next_down();
    let mut best = Hit::MISS;
    let mut best_id = u32::MAX;
    stack.clear();
    stack.push((Child::node(0), ray.tmin));
    while let Some((child, entry)) = stack.pop() {
        if entry > nearest {
            continue;
        }
        if child.is_block() {
            let block = &wide.blocks[child.index()];
            let hits = triangle::intersect(block, &shear, ray.tmin, nearest);
            for lane in 0..BLOCK {
                let (t, id) = (hits.t[lane], block.triangles[lane]);
                let is_tie = t.total_cmp(&nearest).is_eq();
                if t < nearest || (is_tie && id < best_id) {
                    nearest = t;
                    best_id = id;
                    best = Hit::new(t, hits.u[lane], hits.v[lane], id);
                }
            }
        } else {
            let node = &wide.nodes[child.index()];
            let entries = slabs.entries(node, ray.tmin, nearest);
            let first = stack.len();
            for lane in 0..WIDTH {
                if entries[lane] < f32::INFINITY {
                    // Insertion keeps the new part of the stack sorted, the nearest on top.
                    let mut slot = stack.len();
                    stack.push((node.children[lane], entries[lane]));
                    while slot > first && stack[slot - 1].1 < stack[slot].1 {
                        stack.swap(slot - 1, slot);
                        slot -= 1;
                    }
                }
            }
        }
    }
    best
}

/// True when anything is hit with tmin ≤ t < tmax; stops at the first such hit.
pub(super) fn any(wide: &Wide, ray: &Ray, stack: &mut Stack) -> bool {
    let slabs = Slabs::new(ray);
    let shear = Shear::new(ray);
    let farthest = ray.tmax.next_down();
    stack.clear();
    stack.push((Child::node(0), ray.tmin));
    while let Some((child, _)) = stack.pop() {
        if child.is_block() {
            let block = &wide.blocks[child.index()];
            let hits = triangle::intersect(block, &shear, ray.tmin, farthest);
            if hits.t.iter().any(|&t| t <= farthest) {
                return true;
            }
        } else {
            let node = &wide.nodes[child.index()];
            let entries = slabs.entries(node, ray.tmin, farthest);
            for lane in 0..WIDTH {
                if entries[lane] < f32::INFINITY {
                    stack.push((node.children[lane], entries[lane]));
                }
            }
        }
    }
    false
}
