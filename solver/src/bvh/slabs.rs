//! Rays against the eight boxes of a node.
//!
//! A box is met where max over axes of (near − o) / d ≤ min over axes of (far − o) / d. Both sides
//! are moved apart by 1 ∓ 16ε (as T. Ize, "Robust BVH Ray Traversal", JCGT 2(2), 2013, does with the
//! far one), which covers the roundings here and those of the triangle test that grow with the
//! distance; those that grow with the triangle are in the padding of the boxes.
//!
//! The entry distance is rounded towards zero by three bits, which the kernel needs for the number
//! of the lane. Rounding is monotone: a box inside another has no smaller entry, and is never met
//! where the outer one is not. Vector kernels do the same operations, so that which boxes a ray
//! meets, and where, is the same in all.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over lanes without branches become vector instructions"
)]

use super::node::{Node, WIDTH};
use super::ray::Ray;
use glam::Vec3;

/// 1 ∓ 16ε with ε = 2⁻²⁴, for the near and the far side: three roundings of a slab distance, one of
/// the product, and five of the triangle test, in all less than 10ε.
pub(super) const SLACK: [f32; 2] = [1.0 - 16.0 / 16_777_216.0, 1.0 + 16.0 / 16_777_216.0];

/// Bits of an entry distance that are cleared: enough for the number of a lane.
pub(super) const LANE_BITS: u32 = WIDTH as u32 - 1;

/// Components of directions below it count as it.
pub(super) const LEAST_COMPONENT: f32 = 1e-30;

/// The reciprocal of the least component: finite, and a plane's distance times it is, too.
pub(super) const RECIPROCAL_OF_LESS: f32 = 1e30;

/// The part of the test that depends on the ray only.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slabs {
    pub(super) origin: Vec3,
    pub(super) reciprocal: Vec3,
    /// Per axis, the index in [`Node::planes`] of the plane that the ray enters through; the other
    /// one differs in the last bit.
    pub(super) near: [usize; 3],
    /// Nearest distance that counts, not −0.
    pub(super) tmin: f32,
}

impl Slabs {
    #[inline]
    pub(super) fn new(ray: &Ray) -> Self {
        let reciprocal = safe_reciprocal(ray.direction);
        let near = [0, 1, 2].map(|axis| 2 * axis + usize::from(reciprocal[axis] < 0.0));
        Self {
            origin: ray.origin,
            reciprocal,
            near,
            tmin: ray.tmin + 0.0,
        }
    }

    /// Entry distances of the eight boxes; infinite where a box is missed or entered beyond `tmax`.
    #[inline]
    pub(super) fn entries(&self, node: &Node, tmax: f32) -> [f32; WIDTH] {
        let mut enter = [self.tmin; WIDTH];
        let mut leave = [tmax; WIDTH];
        for axis in 0..3 {
            let near = &node.planes[self.near[axis]];
            let far = &node.planes[self.near[axis] ^ 1];
            let (origin, reciprocal) = (self.origin[axis], self.reciprocal[axis]);
            for lane in 0..WIDTH {
                let first = (near[lane] - origin) * reciprocal * SLACK[0];
                let second = (far[lane] - origin) * reciprocal * SLACK[1];
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
            let enter = f32::from_bits(enter[lane].to_bits() & !LANE_BITS);
            entries[lane] = if enter <= leave[lane] {
                enter
            } else {
                f32::INFINITY
            };
        }
        entries
    }
}

/// The reciprocals of a direction's components; of zeros, and of what is too small, a large number
/// of the same sign that is finite.
#[inline]
fn safe_reciprocal(direction: Vec3) -> Vec3 {
    let reciprocal = |component: f32| {
        if component.abs() < LEAST_COMPONENT {
            RECIPROCAL_OF_LESS.copysign(component)
        } else {
            1.0 / component
        }
    };
    Vec3::new(
        reciprocal(direction.x),
        reciprocal(direction.y),
        reciprocal(direction.z),
    )
}
