//! A convex quad P(s, t), bilinear in its corners, divided along lines of constant s and t.

use super::forest::{Forest, Node};
use glam::{DVec2, DVec3};

/// The quad with its grid.
#[derive(Clone, Debug)]
pub(super) struct QuadGrid {
    /// P(0,0), P(1,0), P(1,1), P(0,1).
    corners: [DVec3; 4],
    /// Cells of the grid along s and t.
    counts: [u32; 2],
    inverse: Inverse,
    forest: Forest,
}

/// What finds (s, t) of a point of the quad's plane from h, the vector from P(0,0) to it.
#[derive(Clone, Debug)]
enum Inverse {
    /// Of a parallelogram: s and t are products of h with these.
    Linear([DVec3; 2]),
    /// Lines of constant s are straight, so that s solves the quadratic (s e − h) × (f + s g) = 0 with the edges
    /// e and f at P(0,0) and the twist g; likewise t.
    Quadratic {
        /// Normal of the plane times e, f and g.
        by_normal: [DVec3; 3],
        /// e × g, −f × g and e × f, times the normal.
        constants: [f64; 3],
    },
}

impl Inverse {
    fn new([a, b, c, d]: [DVec3; 4]) -> Self {
        let (e, f, g) = (b - a, d - a, (a + c) - (b + d));
        if g.length_squared() <= 1e-24 * (c - a).length_squared() {
            let normal = e.cross(f);
            let inverse = [f.cross(normal), normal.cross(e)];
            return Self::Linear(inverse.map(|v| v / normal.length_squared()));
        }
        let normal = (c - a).cross(d - b);
        Self::Quadratic {
            by_normal: [e, f, g].map(|v| v.cross(normal)),
            constants: [e.cross(g), g.cross(f), e.cross(f)].map(|v| v.dot(normal)),
        }
    }

    /// (s, t), clamped to [0, 1]².
    fn at(&self, h: DVec3) -> DVec2 {
        let st = match self {
            Self::Linear([u, v]) => DVec2::new(h.dot(*u), h.dot(*v)),
            Self::Quadratic {
                by_normal,
                constants: [k2, l2, k1],
            } => {
                // Products h × e, h × f and h × g with the normal.
                let [he, hf, hg] = by_normal.map(|v| h.dot(v));
                // The root that stays finite as the twist vanishes; the linear terms are positive in a
                // convex quad.
                let root = |square: f64, linear: f64, constant: f64| {
                    let discriminant = linear * linear - 4.0 * square * constant;
                    -2.0 * constant / (linear + discriminant.max(0.0).sqrt())
                };
                DVec2::new(root(*k2, k1 - hg, -hf), root(*l2, k1 + hg, he))
            }
        };
        st.clamp(DVec2::ZERO, DVec2::ONE)
    }
}

impl QuadGrid {
    /// A grid of cells of side about `size`.
    pub(super) fn new(corners: [DVec3; 4], size: f64) -> Self {
        let [a, b, c, d] = corners;
        let count = |first: DVec3, second: DVec3| {
            ((first.length() + second.length()) / (2.0 * size))
                .round()
                .max(1.0) as u32
        };
        let counts = [count(b - a, c - d), count(d - a, c - b)];
        Self {
            corners,
            counts,
            inverse: Inverse::new(corners),
            forest: Forest::uniform(counts[0] * counts[1]),
        }
    }

    /// The same grid with some nodes divided.
    pub(super) fn divided(&self, divides: impl FnMut(Node) -> bool) -> Self {
        Self {
            forest: Forest::grow(self.counts[0] * self.counts[1], divides),
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

    /// The nodes of the same level across the edges of a node.
    fn neighbours(&self, node: Node) -> Vec<Node> {
        let [i, j] = self.index(node);
        let counts = self.counts.map(|count| i64::from(count) << node.level);
        [(i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)]
            .into_iter()
            .filter(|&(i, j)| (0..counts[0]).contains(&i) && (0..counts[1]).contains(&j))
            .map(|(i, j)| {
                let root = (j >> node.level) as u32 * self.counts[0] + (i >> node.level) as u32;
                (0..node.level)
                    .rev()
                    .fold(Node::of_root(root), |node, level| {
                        node.child((i >> level & 1) as u32 + 2 * (j >> level & 1) as u32)
                    })
            })
            .collect()
    }

    pub(super) fn forest(&self) -> &Forest {
        &self.forest
    }

    /// The point of parameters s, t in [0, 1].
    pub(super) fn at(&self, s: f64, t: f64) -> DVec3 {
        let [a, b, c, d] = self.corners;
        a.lerp(b, s).lerp(d.lerp(c, s), t)
    }

    pub(super) fn is_parallelogram(&self) -> bool {
        matches!(self.inverse, Inverse::Linear(_))
    }

    pub(super) fn element_at(&self, p: DVec3) -> u32 {
        let [nu, nv] = self.counts;
        let counts = DVec2::new(f64::from(nu), f64::from(nv));
        let mut local = self.inverse.at(p - self.corners[0]) * counts;
        let cell = [(local.x as u32).min(nu - 1), (local.y as u32).min(nv - 1)];
        local -= DVec2::new(f64::from(cell[0]), f64::from(cell[1]));
        self.forest.find(cell[1] * nu + cell[0], || {
            local *= 2.0;
            let half = [local.x, local.y].map(|x| u32::from(x >= 1.0));
            local -= DVec2::new(f64::from(half[0]), f64::from(half[1]));
            half[0] + 2 * half[1]
        })
    }

    /// Column and row of a node among those of its level.
    fn index(&self, node: Node) -> [i64; 2] {
        let nu = self.counts[0];
        let mut index = [node.root % nu, node.root / nu].map(i64::from);
        for quadrant in node.quadrants() {
            index = [
                2 * index[0] + i64::from(quadrant & 1),
                2 * index[1] + i64::from(quadrant >> 1),
            ];
        }
        index
    }

    /// The rectangle of parameters of a node: lower s and t, and its extent in both. The same edge
    /// gives the same bits on both of its sides and on every level.
    fn rectangle(&self, node: Node) -> [[f64; 2]; 2] {
        let index = self.index(node);
        [0, 1].map(|axis| {
            let count = (u64::from(self.counts[axis]) << node.level) as f64;
            [index[axis], index[axis] + 1].map(|line| line as f64 / count)
        })
    }

    /// A point of a node, (x, y) in [0, 1]² of its rectangle.
    pub(super) fn point(&self, node: Node, [x, y]: [f64; 2]) -> DVec3 {
        let [[s0, s1], [t0, t1]] = self.rectangle(node);
        self.at(s0 + (s1 - s0) * x, t0 + (t1 - t0) * y)
    }

    /// The corners of an element.
    pub(super) fn cell(&self, element: u32) -> [DVec3; 4] {
        let [[s0, s1], [t0, t1]] = self.rectangle(self.forest.leaf(element));
        [
            self.at(s0, t0),
            self.at(s1, t0),
            self.at(s1, t1),
            self.at(s0, t1),
        ]
    }
}
