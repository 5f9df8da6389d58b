//! Cells of a plane, as large as the noise of the values in them asks for.
//!
//! The bounding box of the points is halved again and again along its longer side. From the smallest cells
//! up, each cell is either one polynomial of degree k ≤ 3 or what its halves are, whichever has the smaller
//!
//!   C = Σ_i (f(x_i) − y_i)² + λ p σ²,
//!
//! with p the number of coefficients and σ² the variance of the values, which is known. With λ = 2, E[C] is,
//! but for a constant, the mean square error of f (C. L. Mallows, "Some comments on C_p", Technometrics 15,
//! 1973); among many cells the one with the least C is then one whose noise happens to look like a shape, and
//! a larger λ is best. The best of all ways of halving is found in one pass (D. L. Donoho, "CART and
//! best-ortho-basis: a connection", Annals of Statistics 25, 1997). Where values are smooth, cells are large and noise averages
//! out; where they jump by more than their noise, cells shrink to single points, and nothing is smeared. Cells
//! of values that are known to have no noise are left alone.
//!
//! Valid for values that are independent of each other. What is left of a bias shows in the residuals
//! ([`Excess`]). Cost: O(n log n), about 1 µs a point.

use super::polynomial::{Chart, Factor, MAX_DEGREE, Sums, TERMS, terms};
use std::ops::AddAssign;

/// λ, a tuned value: with 2, 3, 4, 5, 6 and 8 the noise of 4096 values falls 2.1, 10, 12, 11.7, 11.3 and 10.9 times
/// where they are smooth, 2.0, 4.6, 6.5, 7.1, 7.4 and 7.3 times where half of them are dark; that of a
/// constant 2, 7, 39, 124 times and no further. Edges that noise of a third of their height hides are smeared
/// more when it is larger.
const PENALTY: f64 = 5.0;

/// Points of a polynomial for each of its coefficients at least: with fewer it oscillates between them.
const POINTS_A_TERM: usize = 2;

/// Points from which the variance is averaged at least: that of one point, from a few replicates, would be
/// zero by chance, and no other would be believed.
const POOL: usize = 24;

/// By how much of its extents the displaced box is larger than that of the points.
const ROOM: f64 = 0.5;

/// Points of a piece of work that is worth a task of its own.
const TASK: usize = 4096;

/// A point with its value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    /// Coordinates in the plane.
    pub(super) x: [f64; 2],
    /// The value whose smoothness decides.
    pub(super) y: f64,
    /// Its variance, as few replicates scatter.
    pub(super) variance: f64,
    /// Position among all points.
    pub(super) index: u32,
}

/// A rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cell {
    pub(super) low: [f64; 2],
    pub(super) high: [f64; 2],
}

impl Cell {
    /// The bounding box of points.
    fn of(points: &[Point]) -> Self {
        let mut cell = Self {
            low: [f64::INFINITY; 2],
            high: [f64::NEG_INFINITY; 2],
        };
        for point in points {
            for axis in 0..2 {
                cell.low[axis] = cell.low[axis].min(point.x[axis]);
                cell.high[axis] = cell.high[axis].max(point.x[axis]);
            }
        }
        cell
    }

    fn extent(&self, axis: usize) -> f64 {
        self.high[axis] - self.low[axis]
    }

    fn longer_axis(&self) -> usize {
        usize::from(self.extent(1) > self.extent(0))
    }

    /// The part below or above a coordinate.
    fn half(mut self, axis: usize, at: f64, above: bool) -> Self {
        if above {
            self.low[axis] = at;
        } else {
            self.high[axis] = at;
        }
        self
    }
}

/// A cell with one polynomial.
#[derive(Clone, Debug)]
pub(super) struct Leaf {
    /// Its points, among the points as [`Tree::points`] orders them.
    pub(super) points: std::ops::Range<usize>,
    /// Where the polynomial is at home.
    pub(super) chart: Chart,
    /// Its number of terms; none where the values are exact, and stay as they are.
    pub(super) terms: usize,
    /// Where the polynomial holds: about the points.
    pub(super) support: Cell,
}

#[derive(Clone, Copy, Debug)]
enum Node {
    Halved { axis: usize, at: f64, above: u32 },
    Leaf(u32),
}

/// All cells.
#[derive(Debug)]
pub(super) struct Tree {
    /// In preorder: the lower half follows its parent.
    nodes: Vec<Node>,
    /// All leaves.
    pub(super) leaves: Vec<Leaf>,
    /// All points, those of a leaf together.
    pub(super) points: Vec<Point>,
    excess: Excess,
}

/// What the residuals of polynomials tell of their bias, summed over points.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(super) struct Excess {
    /// Residual squares less those of the noise: the squared bias (negative by chance), in the unit of the
    /// values squared.
    pub(super) bias: f64,
    /// Variances that polynomials leave of the values', in the same unit.
    pub(super) variance: f64,
    /// Points.
    pub(super) points: f64,
    /// Coefficients of all polynomials.
    pub(super) coefficients: f64,
}

impl AddAssign for Excess {
    fn add_assign(&mut self, other: Self) {
        self.bias += other.bias;
        self.variance += other.variance;
        self.points += other.points;
        self.coefficients += other.coefficients;
    }
}

impl Tree {
    /// The best cells for some points, with the box displaced by a share of its extents (0 to 1) along
    /// each axis.
    ///
    /// # Panics
    /// When there is no point.
    pub(super) fn new(mut points: Vec<Point>, shift: [f64; 2]) -> Self {
        assert!(!points.is_empty(), "a field has points");
        let tight = Cell::of(&points);
        let mut root = tight;
        for (axis, share) in shift.into_iter().enumerate() {
            let room = ROOM * tight.extent(axis);
            root.low[axis] -= room * share;
            root.high[axis] += room * (1.0 - share);
        }
        let variance = mean_variance(&points);
        let grown = grow(&mut points, root, variance);
        let mut tree = Self {
            nodes: Vec::new(),
            leaves: Vec::new(),
            points,
            excess: Excess::default(),
        };
        tree.lay_out(&grown, 0);
        tree
    }

    fn lay_out(&mut self, grown: &Grown, first: usize) {
        match &grown.shape {
            Shape::Leaf(polynomial) => {
                let points = first..first + grown.count;
                self.excess += polynomial.excess;
                self.nodes.push(Node::Leaf(self.leaves.len() as u32));
                self.leaves.push(Leaf {
                    support: support(&self.points[points.clone()], &polynomial.cell),
                    points,
                    chart: polynomial.chart,
                    terms: polynomial.terms,
                });
            }
            Shape::Halved { axis, at, halves } => {
                let node = self.nodes.len();
                self.nodes.push(Node::Leaf(0));
                self.lay_out(&halves[0], first);
                self.nodes[node] = Node::Halved {
                    axis: *axis,
                    at: *at,
                    above: self.nodes.len() as u32,
                };
                self.lay_out(&halves[1], first + halves[0].count);
            }
        }
    }

    /// The leaf of a place, if its polynomial holds there.
    #[inline]
    pub(super) fn find(&self, x: [f64; 2]) -> Option<usize> {
        let mut node = 0;
        loop {
            match self.nodes[node] {
                Node::Halved { axis, at, above } => {
                    node = if x[axis] < at {
                        node + 1
                    } else {
                        above as usize
                    };
                }
                Node::Leaf(leaf) => {
                    let Cell { low, high } = self.leaves[leaf as usize].support;
                    let holds = (0..2).all(|axis| (low[axis]..=high[axis]).contains(&x[axis]));
                    return holds.then_some(leaf as usize);
                }
            }
        }
    }

    /// What the residuals tell of the bias.
    pub(super) fn excess(&self) -> Excess {
        self.excess
    }
}

/// A polynomial of a cell with what it costs.
struct Polynomial {
    cell: Cell,
    chart: Chart,
    terms: usize,
    excess: Excess,
}

enum Shape {
    Leaf(Box<Polynomial>),
    Halved {
        axis: usize,
        at: f64,
        halves: Box<[Grown; 2]>,
    },
}

/// The best cells of some points.
struct Grown {
    /// C.
    cost: f64,
    count: usize,
    shape: Shape,
}

fn mean_variance(points: &[Point]) -> f64 {
    let sum: f64 = points.iter().map(|point| point.variance).sum();
    sum / points.len().max(1) as f64
}

/// The best cells of points within a cell, and the points sorted accordingly. `pooled` is the variance about
/// the cell, for few points.
fn grow(points: &mut [Point], cell: Cell, pooled: f64) -> Grown {
    let variance = if points.len() >= POOL {
        mean_variance(points)
    } else {
        pooled
    };
    let count = points.len();
    if variance <= 0.0 {
        return exact(points, cell);
    }
    let (cost, polynomial) = best_polynomial(points, cell, variance);
    let whole = Grown {
        cost,
        count,
        shape: Shape::Leaf(Box::new(polynomial)),
    };
    let Some((axis, at, low, high)) = halve(points, cell) else {
        return whole;
    };
    let (below, above) = points.split_at_mut(low);
    let [first, second] = [false, true].map(|above| high.half(axis, at, above));
    let mut grow_below = || grow(below, first, variance);
    let mut grow_above = || grow(above, second, variance);
    let (first, second) = if count >= TASK {
        rayon::join(grow_below, grow_above)
    } else {
        (grow_below(), grow_above())
    };
    let halved = first.cost + second.cost;
    if halved < cost {
        Grown {
            cost: halved,
            count,
            shape: Shape::Halved {
                axis,
                at,
                halves: Box::new([first, second]),
            },
        }
    } else {
        whole
    }
}

/// A cell of values without noise.
fn exact(points: &[Point], cell: Cell) -> Grown {
    let tight = Cell::of(points);
    Grown {
        cost: 0.0,
        count: points.len(),
        shape: Shape::Leaf(Box::new(Polynomial {
            cell,
            chart: Chart::of(tight.low, tight.high),
            terms: 0,
            excess: Excess::default(),
        })),
    }
}

/// Halves a cell until there are points in both halves, and sorts them: the axis, where, how many are
/// below, and the cell that was halved. `None` for points that coincide.
fn halve(points: &mut [Point], mut cell: Cell) -> Option<(usize, f64, usize, Cell)> {
    let tight = Cell::of(points);
    if tight.extent(0) <= 0.0 && tight.extent(1) <= 0.0 {
        return None;
    }
    loop {
        let axis = cell.longer_axis();
        let at = 0.5 * (cell.low[axis] + cell.high[axis]);
        if at <= cell.low[axis] || at >= cell.high[axis] {
            return None;
        }
        if tight.high[axis] < at || tight.low[axis] >= at {
            cell = cell.half(axis, at, tight.low[axis] >= at);
            continue;
        }
        let below = partition(points, |point| point.x[axis] < at);
        return Some((axis, at, below, cell));
    }
}

/// Brings those for which something holds to the front, all in their order; how many they are.
fn partition(points: &mut [Point], holds: impl Fn(&Point) -> bool) -> usize {
    let rest: Vec<Point> = points
        .iter()
        .filter(|point| !holds(point))
        .copied()
        .collect();
    let mut front = 0;
    for i in 0..points.len() {
        if holds(&points[i]) {
            points[front] = points[i];
            front += 1;
        }
    }
    points[front..].copy_from_slice(&rest);
    front
}

/// The polynomial of the least cost, and that.
fn best_polynomial(points: &[Point], cell: Cell, variance: f64) -> (f64, Polynomial) {
    let count = points.len();
    let tight = Cell::of(points);
    let chart = Chart::of(tight.low, tight.high);
    // Residuals are small differences of large sums unless values are taken from their mean.
    let mean = points.iter().map(|point| point.y).sum::<f64>() / count as f64;
    let highest = (1..=MAX_DEGREE)
        .rev()
        .find(|&degree| count >= POINTS_A_TERM * terms(degree))
        .unwrap_or(0);
    let (residual, rank, degree) = if highest == 0 {
        let squares = points.iter().map(|point| (point.y - mean).powi(2));
        (squares.sum(), 1, 0)
    } else {
        let values = points.iter().map(|point| (point.x, point.y - mean));
        let sums = Sums::new(&chart, terms(highest), values);
        let factor = Factor::new(&sums.normal, terms(highest));
        let z: [f64; TERMS] = factor.forward(&sums.right);
        let of_degree = |degree: usize| {
            let fitted: f64 = z[..terms(degree)].iter().map(|z| z * z).sum();
            let rank = factor.rank(terms(degree));
            ((sums.square - fitted).max(0.0), rank, degree)
        };
        let cost = |&(residual, rank, _): &(f64, usize, usize)| residual + price(rank, variance);
        (1..=highest)
            .map(of_degree)
            .fold(of_degree(0), |best, other| {
                if cost(&other) < cost(&best) {
                    other
                } else {
                    best
                }
            })
    };
    let noise: f64 = points.iter().map(|point| point.variance).sum();
    let share = rank as f64 / count as f64;
    let polynomial = Polynomial {
        cell,
        chart,
        terms: terms(degree),
        excess: Excess {
            bias: residual - noise * (1.0 - share),
            variance: noise * share,
            points: count as f64,
            coefficients: rank as f64,
        },
    };
    (residual + price(rank, variance), polynomial)
}

/// What so many coefficients must gain.
fn price(coefficients: usize, variance: f64) -> f64 {
    PENALTY * coefficients as f64 * variance
}

/// The box about the points of a cell, with a margin of about their distances.
fn support(points: &[Point], cell: &Cell) -> Cell {
    let mut support = Cell::of(points);
    let area = cell.extent(0) * cell.extent(1);
    let margin = (area / points.len() as f64).sqrt();
    for axis in 0..2 {
        support.low[axis] -= margin;
        support.high[axis] += margin;
    }
    support
}
