//! Bakes: light gathered at luxels, to a stated error.
//!
//! Luxels are receivers of the final gather like any others: direct light exact times sampled visibility, indirect light by rays into
//! the radiosity solution, joined over luxels that share a plane ([`luxel_solver::adaptive`]).
//!
//! Valid for diffuse receivers. Biased as the gather is, by the finite size of patches and of the polynomials that join luxels;
//! both are in the stated error.

use super::atlas::Atlas;
use super::denoise::denoise;
use super::dilation::dilate;
use super::fit::fit;
use super::luxels::{self, Luxel, Placed};
use super::map::Lightmap;
use super::receivers::{self, Lit};
use super::seams::matched;
use luxel_scenes::Rgb;
use luxel_solver::adaptive::{self, Adaptive, AdaptiveConfig, Checkpoint, Control};
use luxel_solver::gather::{self, Gathered};
use luxel_solver::pilot::PilotError;
use luxel_solver::world::World;

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

/// Gathers light at luxels until `control` is satisfied, from the start or a checkpoint; `None` when it stopped before
/// there was any. A checkpoint of other luxels counts for nothing.
///
/// # Errors
/// As [`adaptive::irradiance`].
pub fn bake(
    world: &World<'_>,
    luxels: &Luxels,
    config: &AdaptiveConfig,
    from: Option<Checkpoint<'_>>,
    control: &mut dyn Control,
) -> Result<Option<Baked>, PilotError> {
    let receivers = &luxels.lit.receivers;
    let mut adaptive = match from.filter(|checkpoint| checkpoint.is_of(receivers.len())) {
        Some(checkpoint) => adaptive::resume(world, receivers, config, checkpoint, control)?,
        None => adaptive::irradiance(world, receivers, config, control)?,
    };
    if adaptive.tallies.is_empty() {
        return Ok(None);
    }
    let gathered = gather::finish(&std::mem::take(&mut adaptive.tallies));
    Ok(Some(Baked { gathered, adaptive }))
}

/// What is done about the noise that is left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Smoothing {
    /// Nothing.
    None,
    /// [`denoise`](crate::lightmap::denoise).
    NonLocalMeans,
}

/// Maps that are ready to be delivered.
pub struct Finished {
    /// What was gathered, zero where nothing was.
    pub raw: Lightmap,
    /// What is looked up: smoothed, filled and fitted; its errors hold what filtering leaves.
    pub map: Lightmap,
}

/// Makes maps of what was gathered at luxels.
///
/// # Panics
/// When there is not one of `gathered` for each luxel.
pub fn finish(
    world: &World<'_>,
    atlas: &Atlas,
    luxels: &Luxels,
    gathered: &[Gathered],
    smoothing: Smoothing,
) -> Finished {
    let lit = &luxels.lit;
    let raw = Lightmap::new(atlas, &lit.luxels, &lit.buried, gathered);
    let mut map = raw.clone();
    add_resolution(&mut map, &lit.luxels);
    if smoothing == Smoothing::NonLocalMeans {
        denoise(&mut map, &lit.luxels, gathered);
    }
    // What smoothing changed at a texel it changed at its luxels.
    let value = |(luxel, gathered): (&Luxel, &Gathered)| {
        let texel = luxel.texel as usize;
        gathered.irradiance().0 + (map.values[texel] - raw.values[texel])
    };
    let values: Vec<Rgb> = lit.luxels.iter().zip(gathered).map(value).collect();
    dilate(atlas, &lit.luxels, &luxels.triangles, &mut map);
    let seams = matched(atlas, world);
    fit(atlas, &mut map, &lit.luxels, &values, &seams);
    Finished { raw, map }
}

/// Adds to the errors of lit luxels what bilinear filtering leaves between their centres: of a function of second derivatives f_xx and
/// f_yy at most (|f_xx| + |f_yy|) / 8 in texels, judged by differences of neighbours in the same chart less the noise in
/// them. Valid where light varies slowly against a texel; at the outlines of sharp shadows it is of the size of the step.
fn add_resolution(map: &mut Lightmap, luxels: &[Luxel]) {
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
