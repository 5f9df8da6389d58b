//! The binary tree, built by obvhs.
//!
//! PLOC (D. Meister, J. Bittner, "Parallel Locally-Ordered Clustering for Bounding Volume
//! Hierarchy Construction", IEEE TVCG 24(3), 2018), run on one thread because obvhs sorts equal
//! Morton codes in any order otherwise, followed by [`reinsertion`]. The rest is parallel; the tree
//! is the same at any thread count. Cost: about 1 µs a triangle.
//!
//! On a regular, axis-aligned tessellation, which is what rooms are made of, equal merge costs
//! make PLOC's trees three to ten times slower to traverse. The boxes that it sees are therefore
//! enlarged by a random 1e-3 of the triangle's size; [`Binary`] then holds the true boxes again,
//! padded by what rounding needs.

use super::reinsertion;
use crate::geometry::{Geometry, TriangleId};
use crate::sampling::{Stage, hash};
use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use rayon::prelude::*;

/// Enlargement of boxes against equal merge costs, relative to the triangle's longest side.
/// Measured with 1e-4, 1e-3 and 1e-2: equal trees; without it the trees are 3–10 times worse.
const JITTER: f32 = 1e-3;

/// Fraction of the nodes that reinsertion moves. More costs 4–8 times the build for 3–7 % faster
/// rays; zero makes rays 3–10 % slower.
const REINSERTION: f32 = 0.15;

/// Padding of a triangle's box in units of its longest side.
///
/// The watertight test works on corners sheared to the ray, x = (Pₓ − oₓ) − sₓ (P_z − o_z). With
/// |sₓ| ≤ 1 the roundings amount to at most 5ε (|Pₓ − oₓ| + E), and those of the edge functions to
/// a few ε E, for a triangle of extent E and ε = 2⁻²⁴. A ray that the test accepts therefore passes
/// its box, along each axis, within some 10ε E and 5ε of the distance along that axis. The first is
/// this padding; the second is in the slacks of `slabs`. A padding by the size of the scene instead
/// would hold the origins of all rays that leave a surface in its boxes, and slow them by half.
const PADDING: f32 = 16.0 / 16_777_216.0;

/// Level below the root where the tree is cut for work in parallel. The result does not depend on it.
const CUT: usize = 9;

/// Memory while a tree is built, at most, for each triangle: its box twice, two nodes of obvhs and what PLOC sorts
/// and merges them with, two nodes in order with their copies in subtrees.
pub(super) const BYTES_A_TRIANGLE: usize = size_of::<(Bounds, Aabb, u32)>()
    + 2 * size_of::<[Bvh2Node; 2]>()
    + size_of::<[u64; 4]>()
    + 2 * size_of::<[(Content, Bounds, u32); 2]>();

/// A box in f32.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub(super) lower: Vec3,
    pub(super) upper: Vec3,
}

impl Bounds {
    const EMPTY: Self = Self {
        lower: Vec3::splat(f32::INFINITY),
        upper: Vec3::splat(f32::NEG_INFINITY),
    };

    fn union(self, other: Self) -> Self {
        Self {
            lower: self.lower.min(other.lower),
            upper: self.upper.max(other.upper),
        }
    }

    /// Enlarged by [`PADDING`], and by no less than one ulp, so that rounding does not undo it.
    fn padded(self) -> Self {
        let padding = Vec3::splat(PADDING * (self.upper - self.lower).max_element());
        Self {
            lower: (self.lower - padding).map(f32::next_down),
            upper: (self.upper + padding).map(f32::next_up),
        }
    }

    pub(super) fn half_area(self) -> f32 {
        let d = self.upper - self.lower;
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

/// What stands below a node of the binary tree.
#[derive(Clone, Copy, Debug)]
pub(super) enum Content {
    /// Two nodes.
    Pair(usize, usize),
    /// One triangle.
    Leaf(TriangleId),
}

/// A binary tree with one triangle a leaf. Every node stands before its children.
pub(super) struct Binary {
    pub(super) content: Vec<Content>,
    pub(super) bounds: Vec<Bounds>,
    pub(super) triangle_count: Vec<u32>,
}

impl Binary {
    /// Builds the tree of all triangles; `None` without triangles.
    pub(super) fn build(geometry: &Geometry) -> Option<Self> {
        if geometry.is_empty() {
            return None;
        }
        let boxes: Vec<Bounds> = (0..geometry.len() as u32)
            .into_par_iter()
            .map(|id| {
                geometry
                    .triangle(TriangleId(id))
                    .iter()
                    .fold(Bounds::EMPTY, |bounds, corner| {
                        let corner = corner.as_vec3();
                        bounds.union(Bounds {
                            lower: corner,
                            upper: corner,
                        })
                    })
            })
            .collect();
        let jittered: Vec<Aabb> = boxes
            .par_iter()
            .enumerate()
            .map(|(index, bounds)| jitter(index as u32, *bounds))
            .collect();
        let indices = (0..boxes.len() as u32).collect();
        let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
            PlocSearchDistance::Medium,
            &jittered,
            indices,
            SortPrecision::U64,
            3,
        );
        reinsertion::optimise(&mut tree, REINSERTION);
        Some(Self::flatten(&tree, &boxes))
    }

    /// Puts the nodes of obvhs into depth-first order and refits them to the true boxes, padded.
    /// Subtrees [`CUT`] levels down are put in order in parallel and strung together.
    fn flatten(tree: &Bvh2, boxes: &[Bounds]) -> Self {
        let top = top(tree);
        let subtrees: Vec<Option<Self>> = top
            .par_iter()
            .map(|node| (node.is_whole).then(|| Self::subtree(tree, boxes, node.source)))
            .collect();
        let mut starts = Vec::with_capacity(top.len());
        let mut count = 0;
        for subtree in &subtrees {
            starts.push(count);
            count += subtree.as_ref().map_or(1, |subtree| subtree.content.len());
        }
        let mut whole = Self::with_capacity(count);
        for subtree in subtrees {
            let start = whole.content.len();
            match subtree {
                Some(subtree) => {
                    whole
                        .content
                        .extend(subtree.content.iter().map(|content| match *content {
                            Content::Pair(a, b) => Content::Pair(a + start, b + start),
                            leaf @ Content::Leaf(_) => leaf,
                        }));
                    whole.bounds.extend(subtree.bounds);
                    whole.triangle_count.extend(subtree.triangle_count);
                }
                None => whole.push(Content::Pair(start + 1, start + 1), Bounds::EMPTY),
            }
        }
        for (node, &start) in top.iter().zip(&starts) {
            if let Some(parent) = node.second_child_of {
                whole.content[starts[parent]] = Content::Pair(starts[parent] + 1, start);
            }
        }
        for (node, &start) in top.iter().zip(&starts).rev() {
            if !node.is_whole {
                whole.refit(start);
            }
        }
        whole
    }

    /// The subtree below a node of obvhs.
    fn subtree(tree: &Bvh2, boxes: &[Bounds], root: usize) -> Self {
        let mut subtree = Self::with_capacity(boxes.len() >> (CUT - 1));
        // (node of obvhs, parent here if this is its second child)
        let mut stack = vec![(root, None)];
        while let Some((source, second_child_of)) = stack.pop() {
            let here = subtree.content.len();
            if let Some(parent) = second_child_of {
                subtree.content[parent] = Content::Pair(parent + 1, here);
            }
            let node = &tree.nodes[source];
            let first = node.first_index as usize;
            if node.is_leaf() {
                let triangle = tree.primitive_indices[first];
                let bounds = boxes[triangle as usize].padded();
                subtree.push(Content::Leaf(TriangleId(triangle)), bounds);
            } else {
                subtree.push(Content::Pair(0, 0), Bounds::EMPTY);
                stack.push((first + 1, Some(here)));
                stack.push((first, None));
            }
        }
        for node in (0..subtree.content.len()).rev() {
            subtree.refit(node);
        }
        subtree
    }

    fn with_capacity(count: usize) -> Self {
        Self {
            content: Vec::with_capacity(count),
            bounds: Vec::with_capacity(count),
            triangle_count: Vec::with_capacity(count),
        }
    }

    fn push(&mut self, content: Content, bounds: Bounds) {
        self.content.push(content);
        self.bounds.push(bounds);
        self.triangle_count.push(1);
    }

    /// Bounds and count of an inner node from its children.
    fn refit(&mut self, node: usize) {
        if let Content::Pair(a, b) = self.content[node] {
            self.bounds[node] = self.bounds[a].union(self.bounds[b]);
            self.triangle_count[node] = self.triangle_count[a] + self.triangle_count[b];
        }
    }

    /// The nodes of the uppermost [`CUT`] levels in order; of those at the last level, each with the
    /// number of nodes that it is the root of, and of inner ones zero.
    pub(super) fn top(&self) -> Vec<(usize, usize)> {
        let mut top = Vec::new();
        let mut stack = vec![(0, 0)];
        while let Some((node, level)) = stack.pop() {
            match self.content[node] {
                Content::Pair(left, right) if level < CUT => {
                    top.push((node, 0));
                    stack.extend([(right, level + 1), (left, level + 1)]);
                }
                _ => top.push((node, 2 * self.triangle_count[node] as usize - 1)),
            }
        }
        top
    }
}

/// A node near the root of the tree of obvhs.
struct TopNode {
    source: usize,
    /// The parent, by its place in the list, if this is its second child.
    second_child_of: Option<usize>,
    /// Whether it stands for all that is below it.
    is_whole: bool,
}

/// The uppermost levels of a tree, depth first.
fn top(tree: &Bvh2) -> Vec<TopNode> {
    let mut nodes = Vec::new();
    let mut stack = vec![(0, None, 0)];
    while let Some((source, second_child_of, level)) = stack.pop() {
        let node = &tree.nodes[source];
        let is_whole = level == CUT || node.is_leaf();
        if !is_whole {
            let first = node.first_index as usize;
            stack.push((first + 1, Some(nodes.len()), level + 1));
            stack.push((first, None, level + 1));
        }
        nodes.push(TopNode {
            source,
            second_child_of,
            is_whole,
        });
    }
    nodes
}

fn jitter(index: u32, bounds: Bounds) -> Aabb {
    let size = JITTER * (bounds.upper - bounds.lower).max_element();
    let random = |dimension: u64| {
        hash::unit_f32((hash::bits(0, Stage::BVH, u64::from(index), dimension) >> 32) as u32)
    };
    let triple = |first: u64| Vec3::new(random(first), random(first + 1), random(first + 2)) * size;
    Aabb::new(
        Vec3A::from(bounds.lower - triple(0)),
        Vec3A::from(bounds.upper + triple(3)),
    )
}
