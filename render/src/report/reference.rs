//! What methods are compared with: a file, the exact answer, or luxel's own best.
//!
//! The best of luxel is its path tracer, because it is unbiased: run far longer than any
//! method, with a seed that nothing else has. Its standard errors come with it and are subtracted.

use super::exact::furnace_radiance;
use super::methods;
use super::metrics::{mean_of_channels, root_mean_square};
use super::surface_points::surface_points;
use super::target::{Kind, Target, exact_estimates};
use crate::camera::{CameraError, CameraFrame};
use crate::image::exr::Picture;
use crate::points::{Estimate, Point};
use luxel_scenes::{Camera, Rgb};
use luxel_solver::sampling::hash::mix64;
use luxel_solver::world::World;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Points at which methods are compared when none are given: the error of an nRMSE over 256 independent
/// points of three channels is about 5 % of itself.
pub const POINTS: usize = 256;

/// Independent repetitions of luxel's own reference, which make its standard errors certain to 18 %.
const REPLICATES: usize = 16;

/// Paths of the trial run that says how many fit into the time.
const TRIAL_PATHS: usize = 64;

/// Most paths a receiver: beyond, 32-bit sample indices run out.
const MAX_PATHS: usize = 1 << 26;

/// A reference that the user gave.
#[derive(Clone, Debug)]
pub enum Given {
    /// Irradiance at points, with standard errors where the file has them.
    Points {
        /// The file.
        path: PathBuf,
        /// Where.
        points: Vec<Point>,
        /// What.
        estimates: Vec<Estimate>,
        /// True when the file has standard errors.
        states_error: bool,
    },
    /// A picture of linear radiance of a camera.
    Picture {
        /// The file.
        path: PathBuf,
        /// Its content.
        picture: Picture,
    },
}

/// Where a reference comes from.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Source {
    /// A file of the user's.
    File {
        /// Its path.
        path: String,
    },
    /// The exact answer.
    Exact {
        /// Radiance L, the same everywhere, W/(m² sr).
        radiance: [f64; 3],
    },
    /// luxel's path tracer, with an independent seed.
    OwnBest {
        /// Paths of each receiver.
        paths: usize,
        /// What it took.
        #[serde(skip)]
        seconds: f64,
    },
}

/// A reference at the receivers of a comparison.
pub struct Reference {
    /// Where it comes from.
    pub source: Source,
    /// Values with standard errors; zero where they are exact or unknown.
    pub estimates: Vec<Estimate>,
    /// Mean over receivers and channels.
    pub mean: f64,
    /// Root mean square of the standard errors over the mean; `None` where they are unknown.
    pub noise: Option<f64>,
}

/// Why there is no reference.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// The scene has no surface to put points on.
    #[error("no surface of the scene is open to light; there is nowhere to compare methods")]
    NoReceivers,
    /// The picture has another shape than the camera's.
    #[error(
        "{}: the picture has {}x{} pixels, the camera {camera:?} has the shape {}x{}; give a picture of \
         this camera, or choose another one with --camera",
        .path.display(), .size[0], .size[1], .expected[0], .expected[1]
    )]
    Shape {
        /// The file.
        path: PathBuf,
        /// Width and height of the picture.
        size: [usize; 2],
        /// The camera's name.
        camera: String,
        /// Width and height of the camera's own picture.
        expected: [usize; 2],
    },
    /// A value of the picture is infinite or not a number.
    #[error(
        "{}: the pixel x = {x}, y = {y} (from the top) holds {value}, which is no radiance; \
         repair the picture",
        .path.display()
    )]
    Pixel {
        /// The file.
        path: PathBuf,
        /// Column.
        x: usize,
        /// Row from the top.
        y: usize,
        /// What is there.
        value: f32,
    },
    /// Nothing but black.
    #[error("{}: the reference is black; relative errors need light", .0.display())]
    Black(PathBuf),
    /// No receiver gets light.
    #[error("no light arrives at the points where methods are compared; check lights and normals")]
    Dark,
    /// The camera has no frame.
    #[error(transparent)]
    Camera(#[from] CameraError),
}

/// How long luxel's own reference may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Effort {
    /// As many paths as fit into these seconds.
    Seconds(f64),
    /// This many paths a receiver.
    Paths(usize),
}

/// The receivers of a comparison and the reference at them.
///
/// # Errors
/// When the given reference does not fit the scene's camera or holds no light, or the scene has no
/// place to compare at.
pub fn choose(
    world: &World<'_>,
    camera: Option<&Camera>,
    given: Option<Given>,
    effort: Effort,
    seed: u64,
) -> Result<(Target, Reference), ReferenceError> {
    match given {
        Some(Given::Points {
            path,
            points,
            estimates,
            states_error,
        }) => {
            let positions: Vec<_> = points.iter().map(|point| point.position).collect();
            let normals: Vec<_> = points.iter().map(|point| point.normal).collect();
            let target = Target::points(world, &positions, &normals);
            let reference = from_file(&path, estimates, states_error)?;
            Ok((target, reference))
        }
        Some(Given::Picture { path, picture }) => {
            let camera = camera.ok_or(ReferenceError::NoReceivers)?;
            let size = [picture.image.width, picture.image.height];
            check_picture(&path, &picture, camera, size)?;
            let target = Target::pixels(world, CameraFrame::new(camera, size)?, seed);
            let layers = &picture.layers;
            let errors = layers.iter().find(|(name, _)| name == ERROR_LAYER);
            let rgb = |pixel: &[f32; 3]| Rgb::from_array(pixel.map(f64::from));
            let estimates = (0..picture.image.pixels.len())
                .map(|index| Estimate {
                    value: rgb(&picture.image.pixels[index]),
                    standard_error: errors
                        .map_or(Rgb::ZERO, |(_, image)| rgb(&image.pixels[index])),
                })
                .collect();
            let reference = from_file(&path, estimates, errors.is_some())?;
            Ok((target, reference))
        }
        None => {
            let receivers = surface_points(world, POINTS, seed);
            if receivers.is_empty() {
                return Err(ReferenceError::NoReceivers);
            }
            let target = Target::receivers(world, receivers);
            let reference = own(world, &target, effort, seed)?;
            Ok((target, reference))
        }
    }
}

/// The layer of an EXR picture that holds its standard errors.
const ERROR_LAYER: &str = "error";

/// The exact answer at a target, or luxel's own best.
///
/// # Errors
/// When no light arrives.
pub fn own(
    world: &World<'_>,
    target: &Target,
    effort: Effort,
    seed: u64,
) -> Result<Reference, ReferenceError> {
    if let Some(radiance) = furnace_radiance(world) {
        let value = match target.kind() {
            Kind::Points(_) => radiance.to_irradiance().0,
            Kind::Pixels(_) => radiance.0,
        };
        let source = Source::Exact {
            radiance: radiance.0.to_array(),
        };
        let estimates = exact_estimates(vec![value; target.len()]);
        return Reference::new(source, estimates, true).ok_or(ReferenceError::Dark);
    }
    let seed = mix64(!seed);
    let started = Instant::now();
    let run = |paths| methods::path(world, target, paths, seed).estimates;
    let paths = match effort {
        Effort::Paths(paths) => paths.max(REPLICATES),
        Effort::Seconds(seconds) => {
            run(TRIAL_PATHS);
            let left = seconds - started.elapsed().as_secs_f64();
            let fits = left / started.elapsed().as_secs_f64().max(1e-6);
            // Powers of two fill their cube evenly.
            let doublings = fits.max(1.0).log2().floor() as u32;
            (TRIAL_PATHS << doublings.min(30)).min(MAX_PATHS)
        }
    };
    let estimates = run(paths);
    let source = Source::OwnBest {
        paths,
        seconds: started.elapsed().as_secs_f64(),
    };
    Reference::new(source, estimates, true).ok_or(ReferenceError::Dark)
}

impl Reference {
    /// `None` when it is black.
    fn new(source: Source, estimates: Vec<Estimate>, states_error: bool) -> Option<Self> {
        let mean = mean_of_channels(estimates.iter().map(|estimate| estimate.value))?;
        let noise = root_mean_square(estimates.iter().map(|e| e.standard_error)) / mean;
        (mean > 0.0).then_some(Self {
            source,
            estimates,
            mean,
            noise: states_error.then_some(noise),
        })
    }

    /// Standard error of the mean over all receivers, as if those of receivers were independent;
    /// `None` where they are unknown.
    pub fn mean_standard_error(&self) -> Option<f64> {
        let rms = self.noise? * self.mean;
        Some(rms / (self.estimates.len() as f64).sqrt())
    }
}

fn from_file(
    path: &Path,
    estimates: Vec<Estimate>,
    states_error: bool,
) -> Result<Reference, ReferenceError> {
    let source = Source::File {
        path: path.display().to_string(),
    };
    Reference::new(source, estimates, states_error)
        .ok_or_else(|| ReferenceError::Black(path.to_path_buf()))
}

/// Refuses a picture of another shape than the camera's, or with pixels that hold no radiance.
fn check_picture(
    path: &Path,
    picture: &Picture,
    camera: &Camera,
    size: [usize; 2],
) -> Result<(), ReferenceError> {
    let [width, height] = size.map(|side| side as f64);
    let [own_width, own_height] = camera.size.map(|side| side as f64);
    // A scaled picture is rounded to whole pixels: half a pixel on either side.
    let expected = width * own_height / own_width;
    if (height - expected).abs() > 0.5 + 0.5 * own_height / own_width {
        return Err(ReferenceError::Shape {
            path: path.to_path_buf(),
            size,
            camera: camera.name.clone(),
            expected: camera.size,
        });
    }
    let layers = picture.layers.iter();
    let errors = layers.filter(|(name, _)| name == ERROR_LAYER);
    let images = std::iter::once(&picture.image).chain(errors.map(|(_, image)| image));
    for image in images {
        for (index, pixel) in image.pixels.iter().enumerate() {
            let bad = pixel.iter().find(|value| !value.is_finite());
            if let Some(&value) = bad {
                return Err(ReferenceError::Pixel {
                    path: path.to_path_buf(),
                    x: index % image.width,
                    y: index / image.width,
                    value,
                });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;
    use luxel_scenes::generate::{Surface, cornell_box, furnace_box};

    fn picture(width: usize, height: usize, value: f32) -> Given {
        Given::Picture {
            path: "r.exr".into(),
            picture: Picture {
                image: Image {
                    width,
                    height,
                    pixels: vec![[value; 3]; width * height],
                },
                layers: Vec::new(),
                origin: None,
            },
        }
    }

    fn choose_for(given: Given) -> Result<(Target, Reference), ReferenceError> {
        let scene = cornell_box();
        let world = World::new(&scene);
        let camera = scene.cameras.first();
        choose(&world, camera, Some(given), Effort::Paths(16), 0)
    }

    #[test]
    fn a_furnace_has_its_exact_answer() {
        let scene = furnace_box(glam::DVec3::ONE, Surface::grey(0.5, 1.0));
        let world = World::new(&scene);
        let chosen = choose(&world, None, None, Effort::Paths(16), 0);
        let (target, reference) = chosen.expect("a furnace");
        assert_eq!(target.len(), POINTS);
        assert!(matches!(reference.source, Source::Exact { .. }));
        assert_eq!(reference.noise, Some(0.0));
        let exact = 2.0 * std::f64::consts::PI;
        assert!((reference.mean - exact).abs() < 1e-12);
    }

    #[test]
    fn another_scene_has_luxels_best_with_its_noise() {
        let scene = cornell_box();
        let world = World::new(&scene);
        let chosen = choose(&world, None, None, Effort::Paths(64), 0);
        let (_, reference) = chosen.expect("a lit scene");
        assert!(matches!(
            reference.source,
            Source::OwnBest { paths: 64, .. }
        ));
        assert!(reference.noise.is_some_and(|noise| noise > 0.0));
    }

    #[test]
    fn a_picture_decides_the_size_and_must_have_the_shape() {
        let (target, reference) = choose_for(picture(8, 8, 1.0)).expect("a square picture");
        assert_eq!((target.len(), reference.noise), (64, None));
        let message = |given| choose_for(given).err().map(|error| error.to_string());
        let wrong = message(picture(8, 6, 1.0)).expect("not the camera's shape");
        assert!(
            wrong.contains("8x6") && wrong.contains("256x256"),
            "{wrong}"
        );
        let wrong = message(picture(4, 4, f32::NAN)).expect("not a number");
        assert!(
            wrong.contains("r.exr") && wrong.contains("x = 0, y = 0"),
            "{wrong}"
        );
        let wrong = message(picture(4, 4, 0.0)).expect("black");
        assert!(wrong.contains("black"), "{wrong}");
    }
}
