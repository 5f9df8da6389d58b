//! Seams: makes filtered values agree where a smooth surface was cut into charts.
//!
//! At points s along every edge that two charts share, the bilinear values on both sides are to be the same, while texels keep
//! close to what was found for them:
//!
//!   minimise  μ Σ_s |Σ_i a_si x_i − Σ_j b_sj x_j|²  +  Σ_i w_i |x_i − x_i⁰|²,
//!
//! a and b the weights of [`lookup::taps`]. Lit luxels have w = 1, texels that only filtering reads nearly none: mostly these
//! move. An edge counts where surfaces are smooth across it: the shading normals of both faces agree at its ends, or the faces'
//! own where there are none; light has a true step elsewhere.
//!
//! Source: the problem is that of S. Iwanicki, "Lighting Technology of The Last of Us", SIGGRAPH 2013 talks. Solved by conjugate
//! gradients with a diagonal preconditioner (M. R. Hestenes, E. Stiefel, 1952). Cost: a few hundred passes over the points.

use super::atlas::Atlas;
use super::lookup;
use super::map::{Lightmap, Texel};
use glam::{DVec2, DVec3};
use luxel_scenes::{Rgb, Scene};
use std::collections::HashMap;

/// Weight μ of a point against that of a lit luxel: a tuned value. Smaller, and steps stay; larger, and shadows that cross a
/// seam are flattened along it.
const POINT_WEIGHT: f64 = 100.0;

/// Weight w of a texel that no face's light was gathered for.
const FREE_WEIGHT: f64 = 0.01;

/// Points of an edge to a texel of its length.
const POINTS_A_TEXEL: f64 = 2.0;

/// Cosine from which normals agree: one degree.
const AGREEMENT: f64 = 0.999_85;

/// Iterations after which the solution is as good as it gets, and the share of the first residual at which it ends.
const MAX_ITERATIONS: usize = 1000;
const TOLERANCE: f64 = 1e-6;

/// An edge of a face in its chart.
#[derive(Clone, Copy)]
struct Edge {
    page: u32,
    /// Its ends in texels, the first at the key's lower position.
    ends: [DVec2; 2],
    normals: [DVec3; 2],
}

/// Two places that are one place of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Matched {
    /// Page and ends in texels on one side.
    pub one: (u32, [DVec2; 2]),
    /// The same on the other.
    pub other: (u32, [DVec2; 2]),
}

impl Matched {
    /// Points along it, as places on both sides.
    pub fn points(&self) -> impl Iterator<Item = [(u32, DVec2); 2]> + use<> {
        let Self { one, other } = *self;
        let length = |ends: [DVec2; 2]| ends[0].distance(ends[1]);
        let texels = length(one.1).max(length(other.1));
        let count = (POINTS_A_TEXEL * texels).ceil().max(1.0) as usize;
        (0..=count).map(move |index| {
            let along = index as f64 / count as f64;
            [one, other].map(|(page, ends)| (page, ends[0].lerp(ends[1], along)))
        })
    }
}

/// Edges that two charts share, or that lie apart in one, where the surface is smooth.
pub fn matched(atlas: &Atlas, scene: &Scene) -> Vec<Matched> {
    type Key = [[u64; 3]; 2];
    let bits = |position: DVec3| position.to_array().map(|x| (x + 0.0).to_bits());
    let mut edges: HashMap<Key, Vec<Edge>> = HashMap::new();
    let mut order: Vec<Key> = Vec::new();
    for face in scene.face_ids() {
        let Some((_, chart)) = atlas.chart(face) else {
            continue;
        };
        let corners = scene.faces[face.index()].corners();
        let front = scene.vector_area(face).normalize_or_zero();
        for corner in corners.clone() {
            let next = if corner + 1 == corners.end {
                corners.start
            } else {
                corner + 1
            };
            let mut ends = [corner, next];
            let mut key =
                ends.map(|corner| bits(scene.vertices[scene.corners.vertex[corner] as usize]));
            if key[0] > key[1] {
                key.swap(0, 1);
                ends.swap(0, 1);
            }
            let edge = Edge {
                page: chart.page,
                ends: ends.map(|corner| atlas.corners[corner]),
                normals: ends.map(|corner| normal(scene, corner, front)),
            };
            let own = edges.entry(key).or_default();
            if own.is_empty() {
                order.push(key);
            }
            own.push(edge);
        }
    }
    let mut found = Vec::new();
    for key in order {
        let own = &edges[&key];
        for (index, one) in own.iter().enumerate() {
            let mut others = own[index + 1..].iter();
            // Where more than two smooth faces meet, one partner is enough.
            if let Some(other) = others.find(|other| one.is_cut_from(other)) {
                found.push(Matched {
                    one: (one.page, one.ends),
                    other: (other.page, other.ends),
                });
            }
        }
    }
    found
}

impl Edge {
    /// Whether the surface goes on smoothly from one to the other, but the atlas does not.
    fn is_cut_from(&self, other: &Self) -> bool {
        let agree = |end: usize| self.normals[end].dot(other.normals[end]) >= AGREEMENT;
        let apart = self.page != other.page
            || (0..2).any(|end| self.ends[end].distance(other.ends[end]) > 1e-3);
        apart && agree(0) && agree(1)
    }
}

/// The shading normal of a corner, or that of its face where it has none.
fn normal(scene: &Scene, corner: usize, front: DVec3) -> DVec3 {
    let normal = scene
        .corners
        .normal
        .get(corner)
        .map_or(DVec3::ZERO, |n| n.as_dvec3());
    if normal.dot(front) > 0.0 {
        normal.normalize()
    } else {
        front
    }
}

/// Makes the values of a map agree along matched edges.
pub fn stitch(map: &mut Lightmap, edges: &[Matched]) {
    let mut number: HashMap<usize, u32> = HashMap::new();
    let mut texels = Vec::new();
    let mut rows: Vec<[(u32, f64); 8]> = Vec::new();
    for [one, other] in edges.iter().flat_map(Matched::points) {
        let mut row = [(0, 0.0); 8];
        let sides = [(one, 1.0), (other, -1.0)];
        let taps = sides.into_iter().flat_map(|((page, place), sign)| {
            lookup::taps(map.size, page, place).map(|(t, w)| (t, sign * w))
        });
        for (entry, (texel, weight)) in row.iter_mut().zip(taps) {
            let index = *number.entry(texel).or_insert_with(|| {
                texels.push(texel);
                texels.len() as u32 - 1
            });
            *entry = (index, weight);
        }
        rows.push(row);
    }
    if rows.is_empty() {
        return;
    }
    let weights: Vec<f64> = texels
        .iter()
        .map(|&texel| {
            if map.texels[texel] == Texel::Lit {
                1.0
            } else {
                FREE_WEIGHT
            }
        })
        .collect();
    let system = System { rows, weights };
    let found: Vec<Rgb> = texels.iter().map(|&texel| map.values[texel]).collect();
    for (texel, change) in texels.iter().zip(system.changes(&found)) {
        // A lit value may not be pulled below darkness.
        map.values[*texel] = (map.values[*texel] + change).max(Rgb::ZERO);
    }
}

/// The normal equations of the problem, for the change of each texel.
struct System {
    rows: Vec<[(u32, f64); 8]>,
    weights: Vec<f64>,
}

impl System {
    /// By point the difference of the two sides.
    fn steps(&self, values: &[Rgb]) -> Vec<Rgb> {
        let step = |row: &[(u32, f64); 8]| row.iter().map(|&(i, w)| values[i as usize] * w).sum();
        self.rows.iter().map(step).collect()
    }

    /// By texel the sum over points of what is at them.
    fn gathered(&self, points: &[Rgb]) -> Vec<Rgb> {
        let mut sums = vec![Rgb::ZERO; self.weights.len()];
        for (row, point) in self.rows.iter().zip(points) {
            for &(index, weight) in row {
                sums[index as usize] += *point * weight;
            }
        }
        sums
    }

    fn apply(&self, values: &[Rgb]) -> Vec<Rgb> {
        let mut sums = self.gathered(&self.steps(values));
        for ((sum, value), weight) in sums.iter_mut().zip(values).zip(&self.weights) {
            *sum = *sum * POINT_WEIGHT + *value * *weight;
        }
        sums
    }

    /// What the values have to be changed by.
    fn changes(&self, values: &[Rgb]) -> Vec<Rgb> {
        let count = values.len();
        let mut diagonal = self.weights.clone();
        for row in &self.rows {
            for &(index, weight) in row {
                diagonal[index as usize] += POINT_WEIGHT * weight * weight;
            }
        }
        let dot = |a: &[Rgb], b: &[Rgb]| a.iter().zip(b).map(|(a, b)| *a * *b).sum::<Rgb>();
        let mut change = vec![Rgb::ZERO; count];
        let steps = self.steps(values);
        let mut residual: Vec<Rgb> = self
            .gathered(&steps)
            .iter()
            .map(|r| *r * -POINT_WEIGHT)
            .collect();
        let precondition = |residual: &[Rgb]| -> Vec<Rgb> {
            residual
                .iter()
                .zip(&diagonal)
                .map(|(r, d)| *r / *d)
                .collect()
        };
        let mut direction = precondition(&residual);
        let mut level = dot(&residual, &direction);
        let enough = level * TOLERANCE.powi(2);
        for _ in 0..MAX_ITERATIONS {
            if level.cmple(enough).all() {
                break;
            }
            let applied = self.apply(&direction);
            let step = ratio(level, dot(&direction, &applied));
            for index in 0..count {
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

/// The largest step along matched edges relative to the value there, and the root of the mean square of the steps relative to the
/// mean value; what an eye sees of the seams.
pub fn steps(map: &Lightmap, edges: &[Matched]) -> [f64; 2] {
    let (mut largest, mut squares, mut values, mut count) = (0.0_f64, 0.0, 0.0, 0.0);
    for sides in edges.iter().flat_map(Matched::points) {
        let [one, other] = sides.map(|(page, place)| lookup::sample(map, &map.values, page, place));
        let value = 0.5 * (one + other).element_sum();
        let step = (one - other).element_sum().abs();
        if value > 0.0 {
            largest = largest.max(step / value);
        }
        squares += step * step;
        values += value;
        count += 1.0;
    }
    if values > 0.0 {
        [largest, (squares / count).sqrt() / (values / count)]
    } else {
        [largest, 0.0]
    }
}
