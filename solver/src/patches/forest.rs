//! Quadtrees over the cells of a region's grid.
//!
//! Each cell of the grid is the root of a tree; a node is a leaf, which is an element, or has four
//! children, which halve both of its sides. Leaves are numbered depth first, so that neighbours in
//! space are mostly neighbours in memory. A forest without a divided root stores nothing. Source:
//! R. A. Finkel, J. L. Bentley, "Quad Trees: A Data Structure for Retrieval on Composite Keys",
//! Acta Informatica 4, 1974. Cost of a lookup: one step a level.

use std::collections::HashSet;

/// Levels below a root that a leaf can lie on: a path holds two bits for each.
pub(super) const MAX_LEVEL: u8 = 16;

/// Marks a node that is a leaf.
const LEAF: u32 = 1 << 31;

/// Memory of a leaf with its share of the nodes above: four children have one parent.
pub(super) const BYTES_A_LEAF: usize = size_of::<Node>() + 4 * size_of::<u32>() / 3;

/// A node of a forest: its root and the way to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Node {
    /// Number of the cell of the grid.
    pub(super) root: u32,
    /// Halvings below the root.
    pub(super) level: u8,
    path: u32,
}

impl Node {
    /// A cell of the grid.
    pub(super) fn of_root(root: u32) -> Self {
        Self {
            root,
            level: 0,
            path: 0,
        }
    }

    /// One of the four children.
    pub(super) fn child(self, quadrant: u32) -> Self {
        Self {
            root: self.root,
            level: self.level + 1,
            path: self.path << 2 | quadrant,
        }
    }

    /// The node above; `None` for a root.
    fn parent(self) -> Option<Self> {
        (self.level > 0).then(|| Self {
            root: self.root,
            level: self.level - 1,
            path: self.path >> 2,
        })
    }

    /// The quadrants on the way from the root.
    pub(super) fn quadrants(self) -> impl Iterator<Item = u32> {
        (0..self.level)
            .rev()
            .map(move |level| self.path >> (2 * level) & 3)
    }
}

/// The trees of a region.
#[derive(Clone, Debug)]
pub(super) struct Forest {
    roots: u32,
    /// Of each node: [`LEAF`] and its element, or its first child. Empty when no root is divided.
    nodes: Vec<u32>,
    leaves: Vec<Node>,
}

impl Forest {
    /// Roots that are leaves.
    pub(super) fn uniform(roots: u32) -> Self {
        Self {
            roots,
            nodes: Vec::new(),
            leaves: Vec::new(),
        }
    }

    /// Divides the nodes for which `divides` is true, from the roots down.
    pub(super) fn grow(roots: u32, mut divides: impl FnMut(Node) -> bool) -> Self {
        let mut forest = Self {
            roots,
            nodes: vec![0; roots as usize],
            leaves: Vec::new(),
        };
        let mut pending = Vec::new();
        for root in 0..roots {
            pending.push((root as usize, Node::of_root(root)));
            while let Some((slot, node)) = pending.pop() {
                if node.level < MAX_LEVEL && divides(node) {
                    let first = forest.nodes.len();
                    forest.nodes[slot] = first as u32;
                    forest.nodes.extend([0; 4]);
                    pending.extend((0..4).rev().map(|k| (first + k, node.child(k as u32))));
                } else {
                    forest.nodes[slot] = LEAF | forest.leaves.len() as u32;
                    forest.leaves.push(node);
                }
            }
        }
        if forest.leaves.len() == roots as usize {
            return Self::uniform(roots);
        }
        forest
    }

    /// The forest with the leaves divided for which `marked` is true, and as many more as it takes
    /// for leaves that share an edge to differ by one level at most (a restricted quadtree, B. Von
    /// Herzen, A. H. Barr, "Accurate Triangulations of Deformed, Intersecting Surfaces", SIGGRAPH
    /// 1987). `neighbours` are the nodes of the same level across the edges.
    pub(super) fn refined<I: IntoIterator<Item = Node>>(
        &self,
        marked: impl Fn(u32) -> bool,
        neighbours: impl Fn(Node) -> I,
    ) -> Self {
        let mut divided = HashSet::new();
        let mut pending: Vec<Node> = (0..self.len())
            .filter(|&element| marked(element))
            .map(|element| self.leaf(element))
            .collect();
        pending.extend((0..self.len()).filter_map(|element| self.leaf(element).parent()));
        while let Some(node) = pending.pop() {
            if node.level < MAX_LEVEL && divided.insert(node) {
                pending.extend(node.parent());
                // What lies beside its children must be a node, too.
                pending.extend(neighbours(node).into_iter().filter_map(Node::parent));
            }
        }
        Self::grow(self.roots, |node| divided.contains(&node))
    }

    /// Number of elements.
    pub(super) fn len(&self) -> u32 {
        if self.nodes.is_empty() {
            self.roots
        } else {
            self.leaves.len() as u32
        }
    }

    /// The node of an element.
    pub(super) fn leaf(&self, element: u32) -> Node {
        if self.nodes.is_empty() {
            Node::of_root(element)
        } else {
            self.leaves[element as usize]
        }
    }

    /// The element that is reached from a root when `step` tells the quadrant to go to.
    pub(super) fn find(&self, root: u32, mut step: impl FnMut() -> u32) -> u32 {
        if self.nodes.is_empty() {
            return root;
        }
        let mut node = self.nodes[root as usize];
        while node & LEAF == 0 {
            node = self.nodes[(node + step()) as usize];
        }
        node & !LEAF
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_are_found_by_their_own_paths() {
        let forest = Forest::grow(3, |node| {
            node.root == 1 && node.level < 3 && node.quadrants().all(|q| q == 2)
        });
        // Roots 0 and 2, three quadrants on two levels and four on the third.
        assert_eq!(forest.len(), 2 + 3 + 3 + 4);
        for element in 0..forest.len() {
            let leaf = forest.leaf(element);
            let mut quadrants = leaf.quadrants();
            let found = forest.find(leaf.root, || {
                quadrants.next().expect("no deeper than it is")
            });
            assert_eq!(found, element);
        }
    }

    #[test]
    fn what_is_not_divided_is_the_grid() {
        let forest = Forest::grow(5, |_| false);
        assert_eq!(forest.len(), 5);
        assert_eq!(forest.leaf(4), Node::of_root(4));
        assert_eq!(forest.find(3, || unreachable!("roots are leaves")), 3);
    }
}
