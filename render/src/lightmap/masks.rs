//! Shadow masks: the share of a light that reaches a texel, for engines that compute the light itself.
//!
//!   V = E / E⁰,   E = ∫ L v cos θ dω over the light,   E⁰ the same with v = 1,
//!
//! v being 1 where nothing stands between the point and that of the light, and 0 else: the visible share weighted by the irradiance
//! that each part of the light would give. Then E = V E⁰ is right for whatever E⁰ the engine computes of the light at that place, also
//! in penumbrae. Of points and parallel light V is 0 or 1. Where the light is below the horizon E⁰ is zero and V is said to be 0: the
//! surface itself is in the way, and a normal map that leans towards the light must not be lit through it. Sums of V E⁰ over all lights
//! are the direct light, but for sky and textured emission, which have no mask.
//!
//! E⁰ is exact (Lambert's formula), E has the noise of its shadow rays, so that the standard error of V is that of E over E⁰.
//! Cost: as direct light from the one light.

use super::map::Lightmap;
use luxel_scenes::{Irradiance, Rgb};
use luxel_solver::direct::Source;
use luxel_solver::gather::Gathered;
use luxel_solver::world::{Receiver, World};
use rayon::prelude::*;

/// Lights whose masks share a picture, one a channel.
pub const LIGHTS_OF_PICTURE: usize = 4;

/// Irradiance in W/m² at receivers, the sum of the channels, from all sources of a world as if nothing stood in between.
pub fn unoccluded(world: &World<'_>, receivers: &[Receiver]) -> Vec<f64> {
    let sources = world.lights().sources();
    receivers
        .par_iter()
        .map(|receiver| {
            let of_source = |s: &Source| s.irradiance(receiver.position, receiver.normal);
            sources.iter().map(of_source).sum::<Rgb>().element_sum()
        })
        .collect()
}

/// Visible shares, as direct light that is the same in all channels, from what was gathered of a light and what would have been
/// without anything in between. Zero where there is nothing to be seen.
///
/// # Panics
/// When there is not one unoccluded irradiance for each receiver.
pub fn visible(gathered: &[Gathered], unoccluded: &[f64]) -> Vec<Gathered> {
    assert_eq!(gathered.len(), unoccluded.len(), "an irradiance a receiver");
    let of_receiver = |(gathered, &unoccluded): (&Gathered, &f64)| {
        if unoccluded <= 0.0 {
            return Gathered::default();
        }
        let share = |light: Irradiance| Irradiance(Rgb::splat(light.0.element_sum() / unoccluded));
        // Channels differ by the colour of the light alone: their errors are the same noise, and add up.
        Gathered {
            direct: share(gathered.direct),
            direct_noise: share(gathered.direct_noise),
            ..Gathered::default()
        }
    };
    gathered.iter().zip(unoccluded).map(of_receiver).collect()
}

/// The mask of a light, of all texels of an atlas.
#[derive(Clone, Debug, PartialEq)]
pub struct Mask {
    /// What is looked up, from 0 to 1.
    pub values: Vec<f32>,
    /// Its standard error, with what bilinear filtering leaves.
    pub errors: Vec<f32>,
    /// What was found at luxels, zero where nothing was.
    pub luxels: Vec<f32>,
    /// Its standard error.
    pub luxel_errors: Vec<f32>,
}

impl Mask {
    /// A mask of a map and of what it was made from.
    ///
    /// Filtering and noise may have left the range of shares; the nearest share is nearer to the truth, which is one.
    pub fn new(raw: &Lightmap, map: &Lightmap) -> Self {
        let of = |values: &[Rgb]| values.iter().map(|value| value.x as f32).collect();
        Self {
            values: map
                .values
                .iter()
                .map(|value| value.x.clamp(0.0, 1.0) as f32)
                .collect(),
            errors: of(&map.errors),
            luxels: of(&raw.values),
            luxel_errors: of(&raw.errors),
        }
    }

    /// Memory of masks of so many lights and texels, in bytes.
    pub fn bytes_for(texels: usize, lights: usize) -> usize {
        4 * lights * texels * size_of::<f32>()
    }
}

/// Root of the mean square of the errors of lit texels: of shares, whose whole is 1.
pub fn error(map: &Lightmap) -> f64 {
    let squares: f64 = map.lit().map(|texel| map.errors[texel].x.powi(2)).sum();
    (squares / map.lit().count().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_of_what_would_be_there() {
        let gathered = Gathered {
            direct: Irradiance(Rgb::new(1.0, 2.0, 3.0)),
            direct_noise: Irradiance(Rgb::new(0.1, 0.2, 0.3)),
            ..Gathered::default()
        };
        let [half, below] = visible(&[gathered; 2], &[12.0, 0.0])
            .try_into()
            .expect("two receivers");
        // Sums of a few numbers of two digits.
        assert!((half.direct.0 - Rgb::splat(0.5)).abs().max_element() < 1e-15);
        assert!((half.direct_noise.0 - Rgb::splat(0.05)).abs().max_element() < 1e-15);
        assert_eq!(below, Gathered::default());
    }
}
