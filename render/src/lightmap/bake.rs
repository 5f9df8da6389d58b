//! Bakes: light gathered at luxels, to a stated error.
//!
//! Luxels are receivers of the final gather like any others: direct light exact times sampled visibility, indirect light by rays into
//! the radiosity solution, joined over luxels that share a plane ([`luxel_solver::adaptive`]).
//!
//! Valid for diffuse receivers. Biased as the gather is, by the finite size of patches and of the polynomials that join luxels;
//! both are in the stated error.

use super::atlas::Atlas;
use super::luxels::{self, Luxel, Placed};
use super::map::Lightmap;
use super::receivers::{self, Lit};
use luxel_scenes::Rgb;
use luxel_solver::adaptive::{self, Adaptive, AdaptiveConfig, Control};
use luxel_solver::gather::{Gathered, finish};
use luxel_solver::pilot::PilotError;
use luxel_solver::world::World;

/// What a bake is made with besides the scene and its atlas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BakeConfig {
    /// What is gathered and how well.
    pub gather: AdaptiveConfig,
}

/// Luxels of a scene, ready to be lit.
pub struct Luxels {
    /// The triangles that have a place.
    pub triangles: Vec<Placed>,
    /// Luxels, receivers, and what is buried.
    pub lit: Lit,
}

impl Luxels {
    /// The luxels of an atlas whose rays meet backs in no more than the share `backface_tolerance`.
    pub fn new(world: &World<'_>, atlas: &Atlas, backface_tolerance: f64) -> Self {
        let triangles = luxels::placed(atlas, world.scene(), world.surfaces().geometry());
        let all = luxels::luxels(atlas, &triangles);
        let lit = receivers::lit(world, atlas, &triangles, all, backface_tolerance);
        Self { triangles, lit }
    }
}

/// What was gathered at luxels.
pub struct Baked {
    /// Irradiance at each luxel with its errors.
    pub gathered: Vec<Gathered>,
    /// How the gather went; its tallies are used up.
    pub adaptive: Adaptive,
}

/// Gathers light at luxels until `control` is satisfied; `None` when it stopped before there was any.
///
/// # Errors
/// As [`adaptive::irradiance`].
pub fn bake(
    world: &World<'_>,
    luxels: &Luxels,
    config: &BakeConfig,
    control: &mut dyn Control,
) -> Result<Option<Baked>, PilotError> {
    let receivers = &luxels.lit.receivers;
    let mut adaptive = adaptive::irradiance(world, receivers, &config.gather, control)?;
    if adaptive.tallies.is_empty() {
        return Ok(None);
    }
    let gathered = finish(&std::mem::take(&mut adaptive.tallies));
    Ok(Some(Baked { gathered, adaptive }))
}

/// Adds to the errors of lit luxels what bilinear filtering leaves between their centres: of a function of second derivatives f_xx and
/// f_yy at most (|f_xx| + |f_yy|) / 8 in texels, judged by differences of neighbours in the same chart less the noise in
/// them. Valid where light varies slowly against a texel; at the outlines of sharp shadows it is of the size of the step.
pub fn add_resolution(map: &mut Lightmap, luxels: &[Luxel]) {
    const NONE: u32 = u32::MAX;
    let [width, height] = map.size;
    let mut charts = vec![NONE; map.texels.len()];
    for luxel in luxels {
        charts[luxel.texel as usize] = luxel.chart.0;
    }
    let second = |texel: usize, before: Option<usize>, after: Option<usize>| {
        let chart = charts[texel];
        let (Some(before), Some(after)) = (before, after) else {
            return Rgb::ZERO;
        };
        if charts[before] != chart || charts[after] != chart {
            return Rgb::ZERO;
        }
        let difference = map.values[before] - 2.0 * map.values[texel] + map.values[after];
        // Noise of neighbours that were joined is alike and cancels; what is left is at most that of independent ones.
        let noise = map.errors[texel] * map.errors[texel] * 6.0;
        (difference * difference - noise).max(Rgb::ZERO) / 64.0
    };
    let squares: Vec<Rgb> = luxels
        .iter()
        .map(|luxel| {
            let texel = luxel.texel as usize;
            let (column, row) = (texel % width, texel / width % height);
            let sideways = second(
                texel,
                (column > 0).then(|| texel - 1),
                (column + 1 < width).then_some(texel + 1),
            );
            let upwards = second(
                texel,
                (row > 0).then(|| texel - width),
                (row + 1 < height).then_some(texel + width),
            );
            sideways + upwards
        })
        .collect();
    for (luxel, square) in luxels.iter().zip(squares) {
        let error = &mut map.errors[luxel.texel as usize];
        *error = (*error * *error + square).map(f64::sqrt);
    }
}

/// Root of the mean square of the errors of lit luxels over the mean of their values, all channels together.
pub fn relative_error(map: &Lightmap) -> f64 {
    let count = 3.0 * map.lit().count().max(1) as f64;
    let squares: f64 = map
        .lit()
        .map(|texel| map.errors[texel].length_squared())
        .sum();
    let sum: f64 = map.lit().map(|texel| map.values[texel].element_sum()).sum();
    if sum > 0.0 {
        (squares / count).sqrt() / (sum / count)
    } else {
        0.0
    }
}
