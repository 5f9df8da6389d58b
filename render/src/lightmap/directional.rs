//! Directional lightmaps: what a texel would receive if its surface looked elsewhere, for normal maps.
//!
//! With φ = ∫ L dω and F = ∫ L ω dω over the hemisphere above a luxel, spherical harmonics of degree one give (`luxel_solver::incident`)
//!
//!   E(n) ≈ a₀ + n·a,   a₀ = φ/4,   a = F/2.
//!
//! At the surface's own normal n·F = E exactly, so that the map is E = 2 n·a, and a₀ + n·a is E times a ratio of ½ + φ/4E: one where radiance is even,
//! ¾ under light from above alone, more for grazing light. E (a₀ + m·a) / (a₀ + n·a) at a mapped normal m is the map where m = n.
//!
//! What is baked is the shape a/E: it varies less from texel to texel than light itself, and its noise is small where light's is. A texel holds the sum
//! of its luxels' a over that of their E; texels beside charts continue it ([`super::dilation`]); then it is multiplied by the finished map, so that
//! E = 2 n·a holds to rounding at every texel of a flat chart, whatever was smoothed and fitted there.
//!
//! The dominant direction is one for all channels: D = F/φ of their luminance, at most one long (½ where radiance is even, one under a single light), with
//!
//!   E(m) ≈ E (½ + ½ m·D) / w,   w = ½ + ½ n·D = ½ + E/2φ,
//!
//! Unity's directional lightmap. Axes are those of the scene.

use super::atlas::Atlas;
use super::bake::Luxels;
use super::dilation::dilate;
use super::map::{Lightmap, Texel};
use luxel_scenes::Rgb;
use luxel_solver::gather::ErrorParts;
use luxel_solver::incident::estimate::{Estimate, finish};
use luxel_solver::incident::harmonics::{mean_irradiance, mean_square, vector_irradiance};
use luxel_solver::incident::{Aim, Incident, Place, joined, until};
use luxel_solver::pilot::PilotError;
use luxel_solver::world::World;
use luxel_solver::{adaptive::Control, incident};

/// Coefficients of degree one and less.
pub const COEFFICIENTS: usize = 4;

/// Share of each channel in luminance, linear Rec. 709.
const LUMINANCE: Rgb = Rgb::new(0.2126, 0.7152, 0.0722);

/// Rays of either kind and replicate that are begun with at each luxel.
const FIRST_RAYS: u32 = 12;

/// What was gathered at luxels.
pub struct Gathered {
    /// Coefficients of incident radiance at each luxel; their errors are those that are left where the irradiance is known.
    pub estimates: Vec<Estimate<COEFFICIENTS>>,
    /// Relative errors of E(n), over all normals, where the irradiance at the luxel's own is known.
    pub parts: ErrorParts,
    /// Gather rays and shadow rays of a luxel.
    pub rays: [usize; 2],
}

/// Gathers at luxels until `control` is satisfied; `None` when it stopped before there was anything.
///
/// # Errors
/// As [`until`].
pub fn gather(
    world: &World<'_>,
    luxels: &Luxels,
    aim: &Aim,
    control: &mut dyn Control,
) -> Result<Option<Gathered>, PilotError> {
    let receivers = &luxels.lit.receivers;
    let places: Vec<Place> = receivers.iter().map(Place::from).collect();
    let aim = Aim {
        first_rays: FIRST_RAYS,
        ..*aim
    };
    let treat = |incidents: Vec<Incident<COEFFICIENTS>>| {
        let mut joined = joined(world, receivers, &incidents);
        for (incident, receiver) in joined.iter_mut().zip(receivers) {
            *incident = incident.given_irradiance(receiver.normal);
        }
        joined
    };
    let found = until(world, &places, &aim, &treat, control)?;
    Ok(found.map(|found| Gathered {
        estimates: finish(&found.incidents),
        parts: found.parts,
        rays: found.rays,
    }))
}

/// Memory while so many luxels are gathered, in bytes.
pub fn bytes_to_gather(luxels: usize) -> usize {
    incident::bytes_to_gather::<COEFFICIENTS>(luxels, true)
        + luxels * size_of::<Estimate<COEFFICIENTS>>()
}

/// Memory of the maps of so many texels, in bytes, while they are made.
pub fn bytes_for(texels: usize) -> usize {
    texels * (COEFFICIENTS + 1) * size_of::<Rgb>() + Lightmap::bytes_for(texels)
}

/// Maps by texel, in the unit of irradiance.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Directions {
    /// a₀ and the three of a along x, y and z.
    pub coefficients: [Vec<Rgb>; COEFFICIENTS],
    /// Standard error of a₀ + n·a, root mean square over all n, besides that of the map.
    pub errors: Vec<Rgb>,
    /// (a₀ + n·a)/E at the normals of lit texels: the mean, and how far it is from that, root mean square.
    pub ratio: [f64; 2],
}

/// Maps of what was gathered at luxels, that go with a finished map.
///
/// # Panics
/// When there is not one of `estimates` for each luxel.
pub fn maps(
    atlas: &Atlas,
    luxels: &Luxels,
    estimates: &[Estimate<COEFFICIENTS>],
    map: &Lightmap,
) -> Directions {
    let lit = &luxels.lit;
    assert_eq!(lit.luxels.len(), estimates.len(), "an estimate a luxel");
    let texels = map.texels.len();
    let mut shapes = [(); COEFFICIENTS].map(|()| vec![Rgb::ZERO; texels]);
    let mut errors = vec![Rgb::ZERO; texels];
    let mut rest = estimates.iter().zip(&lit.receivers);
    for own in lit.luxels.chunk_by(|a, b| a.texel == b.texel) {
        let (mut sums, mut level, mut square) = ([Rgb::ZERO; COEFFICIENTS], Rgb::ZERO, Rgb::ZERO);
        for (estimate, receiver) in rest.by_ref().take(own.len()) {
            let [x, y, z] = vector_irradiance(&estimate.coefficients);
            let normal = receiver.normal;
            level += x * normal.x + y * normal.y + z * normal.z;
            let a0 = mean_irradiance(&estimate.coefficients).0;
            for (sum, value) in sums.iter_mut().zip([a0, x / 2.0, y / 2.0, z / 2.0]) {
                *sum += value;
            }
            // Luxels of a texel are not independent where they were joined.
            let own = mean_square(&estimate.standard_error.map(|error| error * error));
            square += own.map(f64::sqrt);
        }
        let texel = own[0].texel as usize;
        let over_level = |value: Rgb| Rgb::select(level.cmpgt(Rgb::ZERO), value / level, Rgb::ZERO);
        for (shape, sum) in shapes.iter_mut().zip(sums) {
            shape[texel] = over_level(sum);
        }
        errors[texel] = over_level(square);
    }
    let ratio = ratio(&shapes[0], map);
    let dilated = |values: Vec<Rgb>, errors: Vec<Rgb>| {
        let mut filled = Lightmap {
            size: map.size,
            pages: map.pages,
            texels: map.texels.clone(),
            values,
            errors,
        };
        dilate(atlas, &lit.luxels, &luxels.triangles, &mut filled);
        filled
    };
    let times_map = |values: Vec<Rgb>| -> Vec<Rgb> {
        let pairs = values.iter().zip(&map.values);
        pairs.map(|(shape, value)| *shape * *value).collect()
    };
    let none = vec![Rgb::ZERO; texels];
    let mut with_errors = Vec::new();
    let coefficients = shapes.map(|shape| {
        let is_first = with_errors.is_empty();
        let own_errors = if is_first {
            errors.clone()
        } else {
            none.clone()
        };
        let filled = dilated(shape, own_errors);
        if is_first {
            with_errors = filled.errors;
        }
        times_map(filled.values)
    });
    Directions {
        coefficients,
        errors: times_map(with_errors),
        ratio,
    }
}

/// Mean and spread of ½ + a₀/E over the lit texels and channels that are not black.
fn ratio(of_a0: &[Rgb], map: &Lightmap) -> [f64; 2] {
    let lit = map.texels.iter().zip(of_a0).zip(&map.values);
    let lit = lit.filter(|((texel, _), _)| **texel == Texel::Lit);
    let ratios: Vec<f64> = lit
        .flat_map(|((_, shape), value)| shape.to_array().into_iter().zip(value.to_array()))
        .filter(|(shape, value)| *shape > 0.0 && *value > 0.0)
        .map(|(shape, _)| 0.5 + shape)
        .collect();
    let count = ratios.len().max(1) as f64;
    let mean = ratios.iter().sum::<f64>() / count;
    let squares: f64 = ratios.iter().map(|r| (r - mean).powi(2)).sum();
    [mean, (squares / count).sqrt()]
}

impl Directions {
    /// ½ + ½ D by axis and w of each texel; a half throughout where it is dark. `map` is what the coefficients were multiplied by.
    ///
    /// # Panics
    /// When `map` has another number of texels.
    pub fn dominant(&self, map: &Lightmap) -> Vec<[f32; 4]> {
        let [a0, x, y, z] = &self.coefficients;
        assert_eq!(a0.len(), map.values.len(), "the map of the coefficients");
        (0..a0.len())
            .map(|texel| {
                let fluence = 4.0 * a0[texel].dot(LUMINANCE);
                if fluence <= 0.0 {
                    return [0.5; 4];
                }
                let along = |axis: &[Rgb]| 2.0 * axis[texel].dot(LUMINANCE) / fluence;
                let level = map.values[texel].dot(LUMINANCE) / fluence;
                [along(x), along(y), along(z), level].map(|d| (0.5 + 0.5 * d) as f32)
            })
            .collect()
    }
}
