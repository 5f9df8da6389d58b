//! A triangle divided into `side`² similar ones, and each of them by halving its edges.
//!
//! Cells are numbered row by row: the weights of the second and third corner count columns and
//! rows. A cell and its middle child are turned by half a turn against each other, so that every
//! node has corners of its own: children 0, 1 and 2 lie at them, child 3 in the middle.

use super::forest::{Forest, Node};
use glam::DVec3;

/// The triangle with its grid.
#[derive(Clone, Debug)]
pub(super) struct TriangleGrid {
    corners: [DVec3; 3],
    side: u32,
    /// What the vector from the first corner to a point gives weights of the second and third corner with,
    /// in units of a cell.
    cells_along: [DVec3; 2],
    forest: Forest,
}

/// Weights of the second and third corner, in units of a cell of some level.
type Lattice = [u64; 2];

/// Weights of a node's own second and third corner.
struct Local(f64, f64);

impl Local {
    /// Goes to the child that holds the point and tells which it is.
    fn step(&mut self) -> u32 {
        let (x, y) = (2.0 * self.0, 2.0 * self.1);
        let (quadrant, local) = if x >= 1.0 {
            (1, Self(x - 1.0, y))
        } else if y >= 1.0 {
            (2, Self(x, y - 1.0))
        } else if x + y <= 1.0 {
            (0, Self(x, y))
        } else {
            (3, Self(1.0 - x, 1.0 - y))
        };
        *self = local;
        quadrant
    }
}

impl TriangleGrid {
    /// A grid of cells of area about `size`².
    pub(super) fn new(corners: [DVec3; 3], area: f64, size: f64) -> Self {
        let side = (area.sqrt() / size).round().max(1.0) as u32;
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a);
        let per_cell = f64::from(side) / normal.length_squared();
        let cells_along = [(c - a).cross(normal), normal.cross(b - a)].map(|v| v * per_cell);
        Self {
            corners,
            side,
            cells_along,
            forest: Forest::uniform(side * side),
        }
    }

    /// The same grid with some nodes divided.
    pub(super) fn divided(&self, divides: impl FnMut(Node) -> bool) -> Self {
        Self {
            forest: Forest::grow(self.side * self.side, divides),
            ..self.clone()
        }
    }

    /// The grid with the marked elements divided, balanced.
    pub(super) fn refined(&self, marked: impl Fn(u32) -> bool) -> Self {
        Self {
            forest: self.forest.refined(marked, |node| self.neighbours(node)),
            ..self.clone()
        }
    }

    /// The nodes of the same level across the edges of a node: those that hold its mirror images.
    fn neighbours(&self, node: Node) -> Vec<Node> {
        let [a, b, c] = self.lattice(node).map(|corner| corner.map(|x| x as f64));
        let cells = f64::from(1 << node.level);
        let side = f64::from(self.side);
        [[a, b, c], [b, c, a], [c, a, b]]
            .into_iter()
            .map(|[a, b, c]| [0, 1].map(|k| (2.0 * b[k] + 2.0 * c[k] - a[k]) / (3.0 * cells)))
            .filter(|[x, y]| *x > 0.0 && *y > 0.0 && x + y < side)
            .map(|[x, y]| {
                let (root, mut local) = self.root_at(x, y);
                (0..node.level).fold(Node::of_root(root), |node, _| node.child(local.step()))
            })
            .collect()
    }

    pub(super) fn forest(&self) -> &Forest {
        &self.forest
    }

    /// The point with the given weights of the second and third corner.
    pub(super) fn at(&self, x: f64, y: f64) -> DVec3 {
        let [a, b, c] = self.corners;
        a + (b - a) * x + (c - a) * y
    }

    pub(super) fn element_at(&self, p: DVec3) -> u32 {
        let from_corner = p - self.corners[0];
        let [x, y] = self.cells_along.map(|v| from_corner.dot(v).max(0.0));
        let (root, mut local) = self.root_at(x, y);
        self.forest.find(root, || local.step())
    }

    /// The root at weights in units of a cell, and where in it.
    fn root_at(&self, x: f64, y: f64) -> (u32, Local) {
        let side = self.side;
        let row = (y as u32).min(side - 1);
        let column = (x as u32).min(side - 1 - row);
        let (x, y) = (x - f64::from(column), y - f64::from(row));
        let upper = x + y > 1.0 && column + row + 1 < side;
        let root = row * (2 * side - row) + 2 * column + u32::from(upper);
        let local = if upper {
            Local(1.0 - x, 1.0 - y)
        } else {
            Local(x, y)
        };
        (root, local)
    }

    /// The corners of a node on the lattice of its level.
    fn lattice(&self, node: Node) -> [Lattice; 3] {
        let side = self.side;
        let mut row = 0;
        let mut rest = node.root;
        while rest >= 2 * (side - row) - 1 {
            rest -= 2 * (side - row) - 1;
            row += 1;
        }
        let [column, row] = [rest / 2, row].map(u64::from);
        let mut corners = if rest.is_multiple_of(2) {
            [[column, row], [column + 1, row], [column, row + 1]]
        } else {
            // Half a turn against its neighbour below.
            [[column + 1, row + 1], [column, row + 1], [column + 1, row]]
        };
        for quadrant in node.quadrants() {
            let [a, b, c] = corners.map(|[x, y]| [2 * x, 2 * y]);
            let middle = |p: Lattice, q: Lattice| [0, 1].map(|axis| p[axis].midpoint(q[axis]));
            corners = match quadrant {
                0 => [a, middle(a, b), middle(c, a)],
                1 => [middle(a, b), b, middle(b, c)],
                2 => [middle(c, a), middle(b, c), c],
                _ => [middle(b, c), middle(c, a), middle(a, b)],
            };
        }
        corners
    }

    fn node_corners(&self, node: Node) -> [DVec3; 3] {
        let scale = (u64::from(self.side) << node.level) as f64;
        self.lattice(node)
            .map(|[x, y]| self.at(x as f64 / scale, y as f64 / scale))
    }

    /// The point of a node with the given weights of its second and third corner.
    pub(super) fn point(&self, node: Node, [x, y]: [f64; 2]) -> DVec3 {
        let [a, b, c] = self.node_corners(node);
        a + (b - a) * x + (c - a) * y
    }

    /// The corners of an element, counter-clockwise as those of the triangle.
    pub(super) fn cell(&self, element: u32) -> [DVec3; 3] {
        self.node_corners(self.forest.leaf(element))
    }
}
