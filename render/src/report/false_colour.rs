//! Pictures of errors in false colours.
//!
//! The signed error of each pixel, the mean of its channels over the mean of the whole reference, from blue
//! (too dark) over white to orange (too bright), on one scale for all methods. Where methods are compared
//! at points, the pictures show irradiance at the first hits of the camera's pixel centres, against a
//! reference of their own.

use super::family::Family;
use super::measure::Field;
use super::methods;
use super::metrics::Errors;
use super::palette::diverging;
use super::reference::{self, Effort, Reference, ReferenceError, Source};
use super::study::Setup;
use super::target::Target;
use crate::camera::CameraFrame;
use crate::image::{Image, png};
use crate::integrators::unit_ray;
use crate::points::Estimate;
use crate::tone_map::ToneMap;
use glam::DVec2;
use luxel_scenes::{Camera, Rgb};
use luxel_solver::bvh::{Hit, Ray};
use luxel_solver::world::{Receiver, World};

/// Longest side of a picture made for the report, in pixels: it is shown at twice the size.
const SIDE: usize = 120;

/// Rays, and paths, of a pixel of methods that are run for a picture; fewer where its reference has fewer.
const SAMPLES: usize = 64;

/// Patches of the gather that is run for a picture.
const GATHER_PATCHES: usize = 3000;

/// The grey of pixels where there is nothing to compare.
const NOTHING: [u8; 3] = [200, 200, 200];

/// The values of a method, to be shown.
pub(super) struct Picture {
    family: Family,
    budget: String,
    values: Vec<Option<Rgb>>,
}

impl Picture {
    pub(super) fn new(family: Family, budget: String, estimates: &[Estimate]) -> Self {
        let values = estimates.iter().map(|e| Some(e.value)).collect();
        Self {
            family,
            budget,
            values,
        }
    }
}

/// An error as a picture.
#[derive(Clone, Debug)]
pub struct Shown {
    /// The method.
    pub family: Family,
    /// How much was spent on it.
    pub budget: String,
    /// What the picture adds up to.
    pub error: Option<Errors>,
    /// A PNG file.
    pub png: Vec<u8>,
}

/// All pictures of a report.
#[derive(Clone, Debug)]
pub struct Gallery {
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// The reference, tone-mapped.
    pub reference: Vec<u8>,
    /// Noise of the reference, root mean square over mean; `None` where it is unknown.
    pub noise: Option<f64>,
    /// Whether the pictures have a reference of their own, and how many paths a pixel it is made of.
    pub own_paths: Option<usize>,
    /// The error at the ends of the scale.
    pub limit: f64,
    /// The scale from −1 to 1, as a PNG file.
    pub scale: Vec<u8>,
    /// The errors.
    pub shown: Vec<Shown>,
    /// Why there are no pictures.
    pub absent: Option<String>,
}

impl Gallery {
    /// No pictures, because of `reason`.
    pub(super) fn none(reason: impl Into<String>) -> Self {
        Self {
            size: [0, 0],
            reference: Vec::new(),
            noise: None,
            own_paths: None,
            limit: 0.0,
            scale: Vec::new(),
            shown: Vec::new(),
            absent: Some(reason.into()),
        }
    }
}

/// Pictures of `size` (width, height) pixels. `places` gives the index of each pixel's value, where it has
/// one; without it every pixel has its own.
pub(super) fn gallery(
    size: [usize; 2],
    places: Option<&[Option<usize>]>,
    reference: &Reference,
    pictures: Vec<Picture>,
) -> Gallery {
    let every: Vec<Option<usize>>;
    let places = if let Some(places) = places {
        places
    } else {
        every = (0..size[0] * size[1]).map(Some).collect();
        &every
    };
    let errors: Vec<Option<Errors>> = pictures
        .iter()
        .map(|picture| Errors::new(&picture.values, &reference.estimates))
        .collect();
    let limit = limit(errors.iter().flatten().map(|error| error.p95));
    let shown = pictures
        .into_iter()
        .zip(errors)
        .map(|(picture, error)| {
            let colour = |place: &Option<usize>| {
                let index = (*place)?;
                let d = picture.values[index]? - reference.estimates[index].value;
                Some(diverging(d.element_sum() / 3.0 / reference.mean / limit))
            };
            let samples: Vec<u8> = places
                .iter()
                .flat_map(|place| colour(place).unwrap_or(NOTHING))
                .collect();
            Shown {
                family: picture.family,
                budget: picture.budget,
                error,
                png: png::encode_rgb8(&samples, size).unwrap_or_default(),
            }
        })
        .collect();
    Gallery {
        size,
        reference: tone_mapped(size, places, reference),
        noise: reference.noise,
        own_paths: match reference.source {
            Source::OwnBest { paths, .. } => Some(paths),
            _ => None,
        },
        limit,
        scale: scale(),
        shown,
        absent: None,
    }
}

/// Errors of luxel's methods seen from a camera.
pub(super) fn from_camera<'f>(
    setup: &Setup<'_, '_>,
    camera: &Camera,
    fields: impl Iterator<Item = &'f Field>,
    effort: Effort,
) -> Result<Gallery, ReferenceError> {
    let world = setup.world;
    let longest = camera.size[0].max(camera.size[1]).max(1);
    let size = camera
        .size
        .map(|side| (side * SIDE).div_ceil(longest).max(1));
    let frame = CameraFrame::new(camera, size)?;
    let (places, receivers) = first_hits(world, &frame);
    if receivers.is_empty() {
        return Ok(Gallery::none("The camera sees no lit side of a surface."));
    }
    let target = Target::receivers(world, receivers);
    let samples = match effort {
        Effort::Paths(paths) => paths.min(SAMPLES),
        Effort::Seconds(_) => SAMPLES,
    };
    let reference = match reference::own(world, &target, effort, setup.seed) {
        Err(ReferenceError::Dark) => {
            return Ok(Gallery::none("No light reaches what the camera sees."));
        }
        other => other?,
    };
    let mut pictures: Vec<Picture> = fields
        .map(|field| {
            let values = target.values(world, &field.patches, &field.irradiance);
            Picture {
                family: field.family,
                budget: format!("{} patches", field.patches.len()),
                values: values
                    .into_iter()
                    .zip(target.on_surface())
                    .map(|(value, &on)| on.then_some(value))
                    .collect(),
            }
        })
        .collect();
    if let Ok(gathered) = methods::final_gather(world, &target, GATHER_PATCHES, samples, setup.seed)
    {
        let budget = format!("{samples} rays a pixel");
        pictures.push(Picture::new(Family::Gather, budget, &gathered.estimates));
    }
    let traced = methods::path(world, &target, samples, setup.seed);
    let budget = format!("{samples} paths a pixel");
    pictures.push(Picture::new(Family::Path, budget, &traced.estimates));
    Ok(gallery(size, Some(&places), &reference, pictures))
}

/// What the pixel centres of a camera see first: the lit sides of surfaces as receivers, and the index of
/// each pixel's own.
fn first_hits(world: &World<'_>, frame: &CameraFrame) -> (Vec<Option<usize>>, Vec<Receiver>) {
    let [width, height] = frame.size();
    let rays: Vec<Ray> = (0..width * height)
        .map(|pixel| {
            let corner = DVec2::new((pixel % width) as f64, (pixel / width) as f64);
            unit_ray(world, &frame.ray(corner + 0.5))
        })
        .collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    world.bvh().closest_hits(&rays, &mut hits);
    let mut receivers = Vec::new();
    let places = rays
        .iter()
        .zip(&hits)
        .map(|(ray, hit)| {
            let met = world.interaction(ray, hit)?;
            if !world.surfaces().has_side(met.face, met.side) {
                return None;
            }
            receivers.push(met.receiver);
            Some(receivers.len() - 1)
        })
        .collect();
    (places, receivers)
}

/// The end of the scale: the lower quartile of the methods' 95th percentiles, rounded up to 1, 2 or 5 of a
/// power of ten, so that good methods show structure and only the worst leave the scale.
fn limit(p95: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = p95.collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let quartile = sorted.get(sorted.len() / 4).copied().unwrap_or(1.0);
    if quartile <= 0.0 || !quartile.is_finite() {
        return 1.0;
    }
    let decade = 10_f64.powf(quartile.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|step| step * decade)
        .find(|&step| step >= quartile)
        .unwrap_or(10.0 * decade)
}

fn tone_mapped(size: [usize; 2], places: &[Option<usize>], reference: &Reference) -> Vec<u8> {
    let value = |place: &Option<usize>| {
        place.map_or([0.0; 3], |index| {
            reference.estimates[index].value.as_vec3().to_array()
        })
    };
    let image = Image {
        width: size[0],
        height: size[1],
        pixels: places.iter().map(value).collect(),
    };
    let tone_map = ToneMap::automatic(&image);
    png::encode(&image, tone_map).unwrap_or_default()
}

/// The colours from one end of the scale to the other.
fn scale() -> Vec<u8> {
    const WIDTH: usize = 201;
    let samples: Vec<u8> = (0..WIDTH)
        .flat_map(|i| diverging(2.0 * i as f64 / (WIDTH - 1) as f64 - 1.0))
        .collect();
    png::encode_rgb8(&samples, [WIDTH, 1]).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_end_at_round_numbers() {
        let cases = [
            (0.013, 0.02),
            (0.2, 0.2),
            (0.21, 0.5),
            (0.7, 1.0),
            (0.0, 1.0),
        ];
        for (p95, expected) in cases {
            let found = limit([p95].into_iter());
            assert!((found - expected).abs() < 1e-12, "{p95}: {found}");
        }
        assert!((limit(std::iter::empty()) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_scale_is_a_picture() {
        let decoded = image::load_from_memory(&scale())
            .expect("a PNG image")
            .to_rgb8();
        assert_eq!(decoded.dimensions(), (201, 1));
        assert_eq!(decoded.get_pixel(100, 0).0, [255; 3]);
    }
}
