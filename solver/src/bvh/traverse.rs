//! Traversal of the wide tree, one ray at a time, without vector instructions of its own: what runs
//! where no kernel does, and what the kernels are tested against.
//!
//! The children of a node that are hit go onto a stack with their entry distances, the nearest on
//! top.
//!
//! The answer does not depend on the order of visits. No triangle is hit nearer than the entry
//! into its block's box (a nearer distance is raised), no box is entered nearer than
//! a box around it, and boxes are passed over only when they are entered beyond the nearest hit.
//! So the nearest hit, and of those at the same distance the one of lowest id, is found in any
//! order, and every kernel gives the same bits.
//!
//! Where there are few triangles a ray is tested against all of them, and there are no boxes.

use super::collapse::Wide;
use super::node::{Child, WIDTH};
use super::ray::{Hit, Ray};
use super::slabs::Slabs;
use super::triangle::{self, Shear};

/// Children still to visit.
type Stack = Vec<(Child, f32)>;

/// The closest hit of each ray.
pub(super) fn closest_hits(wide: &Wide, rays: &[Ray], hits: &mut [Hit]) {
    let mut stack = stack_for(wide);
    for (ray, hit) in rays.iter().zip(hits) {
        *hit = closest(wide, ray, &mut stack);
    }
}

/// Whether each ray is blocked.
pub(super) fn occluded(wide: &Wide, rays: &[Ray], blocked: &mut [bool]) {
    let mut stack = stack_for(wide);
    for (ray, answer) in rays.iter().zip(blocked) {
        *answer = any(wide, ray, &mut stack);
    }
}

/// A stack that holds any path through `wide` without growing.
fn stack_for(wide: &Wide) -> Stack {
    Vec::with_capacity(1 + (WIDTH - 1) * wide.depth)
}

/// The nearest hit with tmin ≤ t < tmax. Of hits at the same distance the triangle of lowest id
/// counts, so that the answer does not depend on the tree.
fn closest(wide: &Wide, ray: &Ray, stack: &mut Stack) -> Hit {
    let shear = Shear::new(ray);
    // Hits at t = tmax do not count: the test keeps ties at the largest float below.
    let mut nearest = ray.tmax.next_down();
    let mut best = Hit::MISS;
    if wide.is_few() {
        for block in &wide.blocks {
            triangle::nearest(block, &shear, everywhere(ray), &mut nearest, &mut best);
        }
        return best;
    }
    let slabs = Slabs::new(ray);
    stack.clear();
    stack.push((Child::ROOT, 0.0));
    while let Some((child, entry)) = stack.pop() {
        if entry > nearest {
            continue;
        }
        if child.is_block() {
            let block = &wide.blocks[child.index()];
            let limits = [ray.tmin, entry];
            triangle::nearest(block, &shear, limits, &mut nearest, &mut best);
        } else {
            let node = &wide.nodes[child.index()];
            let entries = slabs.entries(node, nearest);
            let first = stack.len();
            for (&entry, &child) in entries.iter().zip(&node.children) {
                if entry < f32::INFINITY {
                    // Insertion keeps the new part of the stack sorted, the nearest on top.
                    let mut slot = stack.len();
                    stack.push((child, entry));
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

/// Limits of a test without a box: what is nearest, and where the box is entered.
fn everywhere(ray: &Ray) -> [f32; 2] {
    [ray.tmin, ray.tmin + 0.0]
}

/// True when anything is hit with tmin ≤ t < tmax; stops at the first such hit.
fn any(wide: &Wide, ray: &Ray, stack: &mut Stack) -> bool {
    let shear = Shear::new(ray);
    let farthest = ray.tmax.next_down();
    if wide.is_few() {
        return wide.blocks.iter().any(|block| {
            let (mut nearest, mut hit) = (farthest, Hit::MISS);
            triangle::nearest(block, &shear, everywhere(ray), &mut nearest, &mut hit)
        });
    }
    let slabs = Slabs::new(ray);
    stack.clear();
    stack.push((Child::ROOT, 0.0));
    while let Some((child, entry)) = stack.pop() {
        if child.is_block() {
            let block = &wide.blocks[child.index()];
            let limits = [ray.tmin, entry];
            let (mut nearest, mut hit) = (farthest, Hit::MISS);
            if triangle::nearest(block, &shear, limits, &mut nearest, &mut hit) {
                return true;
            }
        } else {
            let node = &wide.nodes[child.index()];
            let entries = slabs.entries(node, farthest);
            for (&entry, &child) in entries.iter().zip(&node.children) {
                if entry < f32::INFINITY {
                    stack.push((child, entry));
                }
            }
        }
    }
    false
}
