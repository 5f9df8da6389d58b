//! What texels have to hold so that filtering gives the light that was found: a least-squares fit.
//!
//! Luxels whose point is not their texel's centre ([`super::luxels`]) tell what the bilinear value there is to be; along every
//! edge at which a smooth surface was cut into charts ([`super::seams`]) the values on both sides are to be the same:
//!
//!   minimise  Σ_l |Σ_i a_li x_i − E_l|²  +  μ Σ_s |Σ_i b_si x_i − Σ_j c_sj x_j|²  +  Σ_i w_i |x_i − x_i⁰|²,
//!
//! a, b and c the weights of [`lookup::taps`]. Texels with light found at their centre have w = 1 and are moved by seams alone, so
//! that nothing leaks through a wall between two luxels; those that only filtering reads are nearly free. x⁰ is what
//! [`super::dilation`] filled in, and no texel becomes less than a quarter or more than twice of that.
//!
//! Sources: S. Iwanicki, "Lighting Technology of The Last of Us", SIGGRAPH 2013 talks (seams); M. R. Hestenes, E. Stiefel,
//! "Methods of Conjugate Gradients for Solving Linear Systems", 1952, here with a diagonal preconditioner. Cost: a few
//! dozen to hundred passes over the points.

use super::atlas::Atlas;
use super::lookup;
use super::luxels::{Luxel, centre};
use super::map::{Lightmap, Texel};
use super::seams::Matched;
use luxel_scenes::Rgb;

/// Weight μ of a point of a seam against that of a lit luxel: nearly a constraint. Measured on a sphere, a torus and a bent wall: at 100,
/// 10 000 and 30 000 the largest steps are 0.9, 0.11 and 0.07 %.
const SEAM_WEIGHT: f64 = 30_000.0;

/// Weight w of a texel without light of its own.
const FREE_WEIGHT: f64 = 0.02;

/// What a texel may become of what was filled in. Linear continuation needs no more; further, and what a point at an edge tells by
/// chance is continued into black or glare.
const LOWEST: f64 = 0.25;
const HIGHEST: f64 = 2.0;

/// Iterations after which the solution is as good as it gets, and the share of the first residual at which it ends.
const MAX_ITERATIONS: usize = 1000;
const TOLERANCE: f64 = 1e-6;

/// Texels of a row at most: four on each side of a seam.
const ENTRIES: usize = 8;

/// A weighted sum of unknowns that is to have a value.
struct Row {
    entries: [(u32, f64); ENTRIES],
    target: Rgb,
    weight: f64,
}

/// Fits a map, whose empty texels are filled, to the light at luxels and to seams.
///
/// # Panics
/// When there is not one of `values` for each luxel.
pub fn fit(atlas: &Atlas, map: &mut Lightmap, luxels: &[Luxel], values: &[Rgb], seams: &[Matched]) {
    assert_eq!(luxels.len(), values.len(), "a value a luxel");
    let is_centred = centred(map, luxels);
    let mut unknowns = Unknowns {
        number: vec![NONE; map.texels.len()],
        texels: Vec::new(),
    };
    let mut rows = Vec::new();
    for (luxel, value) in luxels.iter().zip(values) {
        if luxel.is_centred() {
            continue;
        }
        let page = (luxel.texel as usize / map.page_texels()) as u32;
        let place = centre(atlas, luxel.texel as usize) + luxel.offset;
        let mut row = Row::new(*value, 1.0);
        for (entry, (texel, weight)) in lookup::taps(map.size, page, place).into_iter().enumerate()
        {
            if weight > 0.0 && is_centred[texel] {
                row.target -= map.values[texel] * weight;
            } else if weight > 0.0 {
                row.entries[entry] = (unknowns.number(texel), weight);
            }
        }
        rows.push(row);
    }
    for [one, other] in seams.iter().flat_map(Matched::points) {
        let mut row = Row::new(Rgb::ZERO, SEAM_WEIGHT);
        let sides = [(one, 1.0), (other, -1.0)].into_iter();
        let taps = sides.flat_map(|((page, place), sign)| {
            lookup::taps(map.size, page, place).map(|(texel, weight)| (texel, sign * weight))
        });
        for (entry, (texel, weight)) in row.entries.iter_mut().zip(taps) {
            if weight != 0.0 {
                *entry = (unknowns.number(texel), weight);
            }
        }
        rows.push(row);
    }
    let texels = unknowns.texels;
    let weight = |&texel: &usize| if is_centred[texel] { 1.0 } else { FREE_WEIGHT };
    let system = System {
        rows,
        weights: texels.iter().map(weight).collect(),
    };
    let found: Vec<Rgb> = texels.iter().map(|&texel| map.values[texel]).collect();
    for (&texel, change) in texels.iter().zip(system.changes(&found)) {
        let value = map.values[texel];
        map.values[texel] = (value + change).clamp(LOWEST * value, HIGHEST * value);
    }
}

/// Whether light was found at the centre of each texel.
fn centred(map: &Lightmap, luxels: &[Luxel]) -> Vec<bool> {
    let mut is_centred = vec![false; map.texels.len()];
    for luxel in luxels {
        let texel = luxel.texel as usize;
        is_centred[texel] = luxel.is_centred() && map.texels[texel] == Texel::Lit;
    }
    is_centred
}

const NONE: u32 = u32::MAX;

/// Texels that are solved for.
struct Unknowns {
    number: Vec<u32>,
    texels: Vec<usize>,
}

impl Unknowns {
    fn number(&mut self, texel: usize) -> u32 {
        if self.number[texel] == NONE {
            self.number[texel] = self.texels.len() as u32;
            self.texels.push(texel);
        }
        self.number[texel]
    }
}

impl Row {
    fn new(target: Rgb, weight: f64) -> Self {
        Self {
            entries: [(0, 0.0); ENTRIES],
            target,
            weight,
        }
    }

    fn sum(&self, values: &[Rgb]) -> Rgb {
        let entries = self.entries.iter().filter(|entry| entry.1 != 0.0);
        entries
            .map(|&(index, weight)| values[index as usize] * weight)
            .sum()
    }
}

/// The normal equations of the problem, for the change of each unknown.
struct System {
    rows: Vec<Row>,
    weights: Vec<f64>,
}

impl System {
    /// By unknown the weighted sum over rows of what is at them.
    fn gathered(&self, at_rows: impl Iterator<Item = Rgb>) -> Vec<Rgb> {
        let mut sums = vec![Rgb::ZERO; self.weights.len()];
        for (row, value) in self.rows.iter().zip(at_rows) {
            for &(index, weight) in &row.entries {
                sums[index as usize] += value * (row.weight * weight);
            }
        }
        sums
    }

    fn apply(&self, values: &[Rgb]) -> Vec<Rgb> {
        let mut sums = self.gathered(self.rows.iter().map(|row| row.sum(values)));
        for ((sum, value), weight) in sums.iter_mut().zip(values).zip(&self.weights) {
            *sum += *value * *weight;
        }
        sums
    }

    fn diagonal(&self) -> Vec<f64> {
        let mut diagonal = self.weights.clone();
        for row in &self.rows {
            for &(index, weight) in &row.entries {
                diagonal[index as usize] += row.weight * weight * weight;
            }
        }
        diagonal
    }

    /// What the values have to be changed by.
    fn changes(&self, values: &[Rgb]) -> Vec<Rgb> {
        let diagonal = self.diagonal();
        let dot = |a: &[Rgb], b: &[Rgb]| a.iter().zip(b).map(|(a, b)| *a * *b).sum::<Rgb>();
        let precondition = |residual: &[Rgb]| -> Vec<Rgb> {
            let pairs = residual.iter().zip(&diagonal);
            pairs
                .map(|(residual, diagonal)| *residual / *diagonal)
                .collect()
        };
        let mut change = vec![Rgb::ZERO; values.len()];
        let missing = self.rows.iter().map(|row| row.target - row.sum(values));
        let mut residual = self.gathered(missing);
        let mut direction = precondition(&residual);
        let mut level = dot(&residual, &direction);
        let enough = level * TOLERANCE.powi(2);
        for _ in 0..MAX_ITERATIONS {
            if level.cmple(enough).all() {
                break;
            }
            let applied = self.apply(&direction);
            let step = ratio(level, dot(&direction, &applied));
            for index in 0..values.len() {
                change[index] += direction[index] * step;
                residual[index] -= applied[index] * step;
            }
            let next = precondition(&residual);
            let next_level = dot(&residual, &next);
            let share = ratio(next_level, level);
            level = next_level;
            for (direction, next) in direction.iter_mut().zip(next) {
                *direction = next + *direction * share;
            }
        }
        change
    }
}

/// a / b by channel, zero where b is.
fn ratio(a: Rgb, b: Rgb) -> Rgb {
    Rgb::select(b.cmpgt(Rgb::ZERO), a / b, Rgb::ZERO)
}
