//! Fields: noisy values at receivers, joined by least squares in the planes that the receivers lie in.
//!
//! Neighbours in a plane see nearly the same light by independent rays, so that a smooth function through
//! their values is far less noisy than each: with n receivers to a polynomial of p coefficients √(n/p)
//! times. Which cells of a plane get which polynomial follows from the noise, which independent replicates
//! tell (`dyadic`). Cells leave steps at their edges, so that four sets of them, each displaced, are
//! averaged (R. R. Coifman, D. L. Donoho, "Translation-invariant de-noising", Wavelets and Statistics,
//! 1995).
//!
//! The same linear map is applied to every replicate: what the joined replicates scatter is the noise that
//! is left. The bias of the polynomials shows in their residuals, which exceed the noise by its square;
//! [`Cells::widening`] is the factor by which it and the noise together exceed the noise.
//!
//! Receivers that a wall stands between are not joined, where it is asked for (`regions`).
//! Receivers that share a plane with fewer than [`FEWEST`] others stay as they are. Valid for values that
//! are independent between receivers. Cost: about 4 µs a receiver with a few dozen columns, and 8 bytes a
//! coefficient and column.

mod dyadic;
mod planes;
mod polynomial;
mod regions;

use crate::world::Receiver;
use dyadic::{Excess, Leaf, Point, Tree};
use glam::DVec3;
use planes::Planes;
use polynomial::{Factor, Sums, TERMS};
use rayon::prelude::*;
pub(crate) use regions::regions;
use std::ops::Range;

/// Receivers in a plane from which they are joined.
pub const FEWEST: usize = 16;

/// How the boxes of the sets of cells are displaced, in shares: the points of R. Kronecker's sequence with
/// the plastic ratio, which fill the square evenly.
const SHIFTS: [[f64; 2]; 4] = [[0.5, 0.5], [0.255, 0.07], [0.01, 0.64], [0.765, 0.21]];

/// Square of the bias of joined values over their variance as it is most often, and how far it is from that:
/// of what `tests` makes 0.6 to 0.8 on smooth functions and 0.3 to 0.5 on edges (3.5 where noise is a third of
/// their height, too much to be told).
const USUAL_BIAS: f64 = 0.8;
const BIAS_SPREAD: f64 = 0.5;

/// The largest that is believed: more is of outliers.
const LARGEST_BIAS: f64 = 3.0;

/// Receivers to a coefficient in each set of cells, about, where noise is small and cells are too: what memory is
/// expected follows from it. Measured on tables of 100 000 points to 1.5 %.
const POINTS_A_COEFFICIENT: usize = 16;

/// A value at a receiver, by which cells are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Value {
    /// The value, in any unit.
    pub value: f64,
    /// The variance of its noise, unbiased, in the unit squared.
    pub variance: f64,
}

/// The cells of all planes.
pub struct Cells {
    planes: Planes,
    trees: Vec<Vec<Tree>>,
}

impl Cells {
    /// The best cells for values at receivers. With `regions`, one for each receiver, no cell holds receivers of two regions.
    ///
    /// # Panics
    /// When there is not one value for each receiver.
    pub fn new(receivers: &[Receiver], values: &[Value], regions: Option<&[u32]>) -> Self {
        assert_eq!(receivers.len(), values.len(), "a value a receiver");
        let planes = Planes::new(receivers, regions, FEWEST);
        let trees = planes
            .all()
            .par_iter()
            .map(|plane| {
                let point = |&index: &u32| {
                    let position = receivers[index as usize].position;
                    let Value { value, variance } = values[index as usize];
                    Point {
                        x: plane.coordinates(position).to_array(),
                        y: value,
                        variance,
                        index,
                    }
                };
                let points: Vec<Point> = plane.members.iter().map(point).collect();
                SHIFTS
                    .par_iter()
                    .map(|&shift| Tree::new(points.clone(), shift))
                    .collect()
            })
            .collect();
        Self { planes, trees }
    }

    /// Memory of the cells of so many receivers and of fields of so many columns in them, in bytes, while they are made.
    pub fn bytes_for(receivers: usize, columns: usize) -> usize {
        let points = (SHIFTS.len() + 1) * size_of::<Point>() + size_of::<(u32, [f64; 3])>();
        let leaf = size_of::<Leaf>() + 2 * columns * size_of::<f64>();
        receivers * (size_of::<Value>() + points + SHIFTS.len() * leaf / POINTS_A_COEFFICIENT)
    }

    /// By what factor standard deviations of joined values are to be widened, so that they hold the bias:
    /// √(1 + b), with b the square of the bias over the variance, at all receivers together.
    ///
    /// n residuals tell the p σ² that the bias adds to their sum of squares only as well as they tell σ²,
    /// within σ² √(2n (1 + 1/d)) with d degrees of freedom in each variance. b is therefore the mean of what
    /// they tell and of what is usual, weighted by their precisions.
    pub fn widening(&self, degrees: u32) -> f64 {
        let mut all = Excess::default();
        for tree in self.trees.iter().flatten() {
            all += tree.excess();
        }
        if all.variance <= 0.0 {
            return 1.0;
        }
        // The sets of cells share their points.
        let sets = SHIFTS.len() as f64;
        let known = 2.0 * (1.0 + 1.0 / f64::from(degrees)) * all.points * sets;
        let told = all.coefficients.powi(2) / known;
        let expected = BIAS_SPREAD.powi(-2);
        let bias = (told * all.bias / all.variance + expected * USUAL_BIAS) / (told + expected);
        (1.0 + bias.clamp(0.0, LARGEST_BIAS)).sqrt()
    }

    /// Joins further values in the cells: `columns` of them at each receiver, written by `write`. They are
    /// joined all alike.
    pub fn join(self, columns: usize, write: impl Fn(usize, &mut [f64]) + Sync) -> Field {
        let fits = self
            .trees
            .par_iter()
            .map(|trees| {
                trees
                    .par_iter()
                    .map(|tree| Fit::new(tree, columns, &write))
                    .collect()
            })
            .collect();
        Field {
            cells: self,
            fits,
            columns,
        }
    }
}

/// Functions on all planes.
pub struct Field {
    cells: Cells,
    fits: Vec<Vec<Fit>>,
    columns: usize,
}

impl Field {
    /// Adds some columns of the field at a place to `sums`, which has one entry for each, and returns how
    /// many receivers share one coefficient there (at least one); `None` (and nothing is added) where it is
    /// not known: between planes, far from all receivers, and where their values are exact.
    ///
    /// `position` and `normal` (unit) are in the unit frame. Planes that are divided into regions are not known by places.
    ///
    /// # Panics
    /// When the columns do not exist, or `sums` has not one entry for each.
    pub fn add_at(
        &self,
        position: DVec3,
        normal: DVec3,
        columns: Range<usize>,
        sums: &mut [f64],
    ) -> Option<f64> {
        let plane = self.cells.planes.find(position, normal)?;
        self.add_in(plane, position, columns, sums)
    }

    /// The same for a receiver that the field was made of, by its number and position, in its own region.
    ///
    /// # Panics
    /// As [`Self::add_at`], and when there is no such receiver.
    pub fn add_of(
        &self,
        receiver: usize,
        position: DVec3,
        columns: Range<usize>,
        sums: &mut [f64],
    ) -> Option<f64> {
        let plane = self.cells.planes.of(receiver)?;
        self.add_in(plane, position, columns, sums)
    }

    fn add_in(
        &self,
        plane: usize,
        position: DVec3,
        columns: Range<usize>,
        sums: &mut [f64],
    ) -> Option<f64> {
        assert!(columns.end <= self.columns && columns.len() == sums.len());
        let trees = &self.cells.trees[plane];
        let x = self.cells.planes.all()[plane]
            .coordinates(position)
            .to_array();
        let found: [Option<usize>; SHIFTS.len()] = std::array::from_fn(|set| trees[set].find(x));
        let known = found.iter().flatten().count();
        let is_exact = |(set, leaf): (usize, &Option<usize>)| {
            leaf.is_some_and(|leaf| trees[set].leaves[leaf].terms == 0)
        };
        if known == 0 || found.iter().enumerate().any(is_exact) {
            return None;
        }
        let share = 1.0 / known as f64;
        let mut shared = 0.0;
        for (set, leaf) in found.into_iter().enumerate() {
            let Some(leaf) = leaf else { continue };
            let shape = &trees[set].leaves[leaf];
            let monomials = shape.chart.monomials(x);
            let own = self.fits[plane][set].coefficients(leaf, shape.terms, self.columns);
            for (row, monomial) in own.chunks_exact(self.columns).zip(monomials) {
                for (sum, coefficient) in sums.iter_mut().zip(&row[columns.clone()]) {
                    *sum += monomial * share * coefficient;
                }
            }
            shared += share * shape.points.len() as f64 / shape.terms as f64;
        }
        Some(shared.max(1.0))
    }
}

/// The coefficients of all leaves of a tree.
struct Fit {
    /// Where those of each leaf begin.
    first: Vec<usize>,
    /// By leaf, term and column.
    coefficients: Vec<f64>,
}

impl Fit {
    fn new(tree: &Tree, columns: usize, write: &(impl Fn(usize, &mut [f64]) + Sync)) -> Self {
        let of_leaves: Vec<Vec<f64>> = tree
            .leaves
            .par_iter()
            .with_min_len(16)
            .map(|leaf| {
                if leaf.terms == 0 {
                    return Vec::new();
                }
                let points = &tree.points[leaf.points.clone()];
                let positions = points.iter().map(|point| (point.x, 0.0));
                let sums = Sums::new(&leaf.chart, leaf.terms, positions);
                let factor = Factor::new(&sums.normal, leaf.terms);
                let mut right = vec![0.0; TERMS * columns];
                let mut values = vec![0.0; columns];
                for point in points {
                    write(point.index as usize, &mut values);
                    let monomials = leaf.chart.monomials(point.x);
                    for (row, monomial) in right
                        .chunks_exact_mut(columns)
                        .zip(monomials)
                        .take(leaf.terms)
                    {
                        for (sum, value) in row.iter_mut().zip(&values) {
                            *sum += monomial * value;
                        }
                    }
                }
                let mut coefficients = vec![0.0; leaf.terms * columns];
                for column in 0..columns {
                    let b = std::array::from_fn(|term| right[term * columns + column]);
                    let c = factor.backward(factor.forward(&b));
                    for term in 0..leaf.terms {
                        coefficients[term * columns + column] = c[term];
                    }
                }
                coefficients
            })
            .collect();
        let mut first = Vec::with_capacity(of_leaves.len());
        let mut coefficients = Vec::with_capacity(of_leaves.iter().map(Vec::len).sum());
        for own in of_leaves {
            first.push(coefficients.len());
            coefficients.extend(own);
        }
        Self {
            first,
            coefficients,
        }
    }

    fn coefficients(&self, leaf: usize, terms: usize, columns: usize) -> &[f64] {
        &self.coefficients[self.first[leaf]..][..terms * columns]
    }
}

#[cfg(test)]
mod tests;
