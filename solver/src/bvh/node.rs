//! Nodes of eight children and leaf blocks of four triangles, as structures of arrays.

use glam::Vec3;

/// Children of a node.
pub(super) const WIDTH: usize = 8;
/// Triangles of one leaf block.
pub(super) const BLOCK: usize = 4;

/// Bit of a child reference that says it names a block.
const LEAF: u32 = 1 << 31;

/// A reference to a child: a node or a leaf block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub(super) struct Child(u32);

impl Child {
    /// The block without triangles that stands first in every tree: the child of empty lanes, and
    /// what lies at the bottom of a stack.
    pub(super) const NOTHING: Self = Self(LEAF);
    /// The node that every ray starts at.
    pub(super) const ROOT: Self = Self(0);

    pub(super) fn node(index: usize) -> Self {
        debug_assert!((index as u32) < LEAF, "a tree holds fewer than 2^31 nodes");
        Self(index as u32)
    }

    pub(super) fn block(index: usize) -> Self {
        debug_assert!((index as u32) < LEAF, "a tree holds fewer than 2^31 blocks");
        Self(index as u32 | LEAF)
    }

    #[inline]
    pub(super) fn is_block(self) -> bool {
        self.0 & LEAF != 0
    }

    #[inline]
    pub(super) fn index(self) -> usize {
        (self.0 & !LEAF) as usize
    }

    /// The same reference in a tree that is appended to `nodes` nodes and `blocks` blocks.
    pub(super) fn moved(self, nodes: usize, blocks: usize) -> Self {
        if self == Self::NOTHING {
            self
        } else if self.is_block() {
            Self::block(self.index() + blocks)
        } else {
            Self::node(self.index() + nodes)
        }
    }
}

/// Eight boxes. `planes[2 * axis]` holds the lower, `planes[2 * axis + 1]` the upper planes; lanes
/// without a child hold an empty box (lower +∞, upper −∞), which no ray meets.
#[derive(Clone, Debug, PartialEq)]
#[repr(C, align(64))]
pub(super) struct Node {
    pub(super) planes: [[f32; WIDTH]; 6],
    pub(super) children: [Child; WIDTH],
}

impl Node {
    pub(super) const EMPTY: Self = Self {
        planes: [
            [f32::INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
        ],
        children: [Child::NOTHING; WIDTH],
    };
}

/// Four triangles: `corners[corner][axis][lane]`, `normals[axis][lane]`. Lanes without a triangle hold NaN,
/// which no test accepts. Four cache lines, of which rays that meet no triangle touch three.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Block {
    pub(super) corners: [[[f32; BLOCK]; 3]; 3],
    pub(super) triangles: [u32; BLOCK],
    /// Cross products of the edges from the first corner to the second and third, in f64.
    pub(super) normals: [[f64; BLOCK]; 3],
}

impl Block {
    pub(super) const EMPTY: Self = Self {
        corners: [[[f32::NAN; BLOCK]; 3]; 3],
        triangles: [u32::MAX; BLOCK],
        normals: [[f64::NAN; BLOCK]; 3],
    };

    /// Puts a triangle into a lane.
    pub(super) fn set(&mut self, lane: usize, triangle: u32, corners: [Vec3; 3]) {
        for (planes, corner) in self.corners.iter_mut().zip(corners) {
            for (plane, value) in planes.iter_mut().zip(corner.to_array()) {
                plane[lane] = value;
            }
        }
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        let normal = (b - a).cross(c - a);
        for (plane, value) in self.normals.iter_mut().zip(normal.to_array()) {
            plane[lane] = value;
        }
        self.triangles[lane] = triangle;
    }
}
