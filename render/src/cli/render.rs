//! `luxel render`: a picture.

use super::exit::{ExitCode, Failure};
use super::scene;
use super::transport::{Purpose, Transport};
use super::{Context, Session};
use crate::camera::CameraFrame;
use crate::files::Output;
use crate::film::Film;
use crate::image::exr::{Origin, Picture};
use crate::image::{exr, png};
use crate::integrators::ao::{self, AmbientOcclusion, Falloff};
use crate::integrators::gather::{self, Gatherer};
use crate::integrators::path::PathTracer;
use crate::integrators::radiosity::RadiosityView;
use crate::integrators::whitted::{self, Highlight, Whitted};
use crate::integrators::{Integrator, Samples, expose};
use crate::tone_map::ToneMap;
use crate::view::view;
use clap::ValueEnum;
use luxel_scenes::{Irradiance, Rgb};
use luxel_solver::audit;
use luxel_solver::world::World;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Rays for indirect light of a camera sample: with 16 samples 256 a pixel.
const GATHER_RAYS: usize = 16;

/// Shadow rays of a camera sample.
const SHADOW_RAYS: usize = 4;

/// Rays for ambient occlusion of a camera sample.
const AO_RAYS: u32 = 8;

/// Reflections and refractions that Whitted's recursion follows: a glass body needs four for what
/// is behind it, a hall of mirrors shows the eighth reflection as a speck.
const WHITTED_DEPTH: u32 = 8;

/// Render a picture
///
/// The EXR file holds linear radiance (RGB) and its standard error (layer `standard_error`).
#[derive(clap::Args)]
pub(super) struct Render {
    /// Scene file (.toml), or geometry (.obj, .gltf, .glb)
    scene: PathBuf,

    /// Linear picture to write
    #[arg(short, long, value_name = "OUT.exr", value_parser = exr_path)]
    output: PathBuf,

    /// Tone-mapped preview to write
    #[arg(long, value_name = "OUT.png")]
    png: Option<PathBuf>,

    /// How light is computed
    #[arg(long, value_enum, default_value = "gather", value_name = "HOW")]
    integrator: Method,

    /// Size of the picture in pixels [default: the camera's]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<[usize; 2]>,

    /// Camera [default: the first]
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,

    /// Samples per pixel [default: 16; path: 64]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    spp: Option<u32>,

    /// With --integrator ao: metres beyond which nothing occludes
    #[arg(long, value_name = "D", value_parser = super::parse_length)]
    max_distance: Option<f64>,

    /// With --max-distance: how nearer blockers count
    #[arg(
        long,
        value_name = "HOW",
        requires = "max_distance",
        default_value = "sharp"
    )]
    falloff: Falloff,
}

/// How light is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Method {
    /// The radiosity solution itself, interpolated between patches
    Radiosity,
    /// Direct light exact, indirect light gathered from a radiosity solution
    Gather,
    /// The gather behind mirrors and glass, with highlights
    Whitted,
    /// Unbiased path tracing: the reference
    Path,
    /// Ambient occlusion, 1 = open
    Ao,
}

impl Render {
    pub(super) fn run(self, session: &mut Session<'_>) -> Result<ExitCode, Failure> {
        if self.max_distance.is_some() && self.integrator != Method::Ao {
            return Err(Failure::new(
                ExitCode::Usage,
                "--max-distance belongs to --integrator ao",
            ));
        }
        if self.png.as_ref() == Some(&self.output) {
            return Err(Failure::new(
                ExitCode::Usage,
                "-o and --png name the same file",
            ));
        }
        let started = Instant::now();
        let output = Output::prepare(&self.output)?;
        let preview = self.png.as_deref().map(Output::prepare).transpose()?;

        let scene = scene::read(&self.scene, &session.context)?;
        let camera = scene::camera(&scene, self.camera.as_deref())?;
        let frame = CameraFrame::new(camera, self.size.unwrap_or(camera.size))?;
        let default = if self.integrator == Method::Path {
            64
        } else {
            16
        };
        let samples = Samples::new(self.spp.unwrap_or(default), session.context.common.seed);

        let film = session.context.common.install(|| {
            let world = World::new(&scene);
            if self.integrator != Method::Ao {
                scene::require_light(&world)?;
            }
            self.judge_view(&world, &camera.name, &frame, &session.context)?;
            self.expose(&world, &frame, samples, &session.context)
        })??;

        let image = film.mean();
        let error = film.standard_error();
        let noise = error.as_ref().map(|_| relative_noise(&film));
        let picture = Picture {
            layers: error
                .map(|error| ("standard_error".into(), error))
                .into_iter()
                .collect(),
            image,
            origin: Some(Origin {
                software: concat!("luxel ", env!("CARGO_PKG_VERSION")).into(),
                scene: scene.name.clone(),
                camera: camera.name.clone(),
                integrator: super::name(&self.integrator),
                unit: match self.integrator {
                    Method::Ao => "1".into(),
                    _ => scene::radiance_unit(scene.units).into(),
                },
                samples: samples.replicates * samples.per_replicate,
                seed: session.context.common.seed,
            }),
        };
        output.write(&exr::encode(&picture)?)?;
        if let Some(preview) = &preview {
            let tone_map = match self.integrator {
                Method::Ao => ToneMap { exposure: 1.0 },
                _ => ToneMap::automatic(&picture.image),
            };
            preview.write(&png::encode(&picture.image, tone_map)?)?;
        }
        self.report(&frame, samples, noise, started, session)?;
        Ok(ExitCode::Ok)
    }

    /// Refuses a camera that sees nothing but backs, which are black; warns of one that sees mostly
    /// backs. Ambient occlusion shows backs, too.
    fn judge_view(
        &self,
        world: &World<'_>,
        camera: &str,
        frame: &CameraFrame,
        context: &Context<'_>,
    ) -> Result<(), Failure> {
        let Some(finding) = audit::inside_view(world, &view(world, camera, frame)) else {
            return Ok(());
        };
        if finding.is_total() && self.integrator != Method::Ao {
            return Err(Failure::new(ExitCode::InvalidInput, finding.to_string()));
        }
        context.reporter.warning(finding);
        Ok(())
    }

    fn expose(
        &self,
        world: &World<'_>,
        frame: &CameraFrame,
        samples: Samples,
        context: &Context<'_>,
    ) -> Result<Film, Failure> {
        let seed = context.common.seed;
        let show =
            |integrator: &dyn Integrator| expose(integrator, frame, samples, &context.reporter);
        let config = gather::Config {
            rays: GATHER_RAYS,
            shadow_rays: SHADOW_RAYS,
            seed,
        };
        let film = match self.integrator {
            Method::Ao => show(&AmbientOcclusion::new(
                world,
                ao::Config {
                    rays: AO_RAYS,
                    max_distance: self.max_distance,
                    falloff: self.falloff,
                    seed,
                },
            )),
            Method::Path => show(&PathTracer::new(world, seed)),
            Method::Radiosity => {
                let transport = Transport::solve(world, Purpose::View, context)?;
                show(&RadiosityView::new(
                    world,
                    &transport.patches,
                    &transport.solutions,
                ))
            }
            Method::Gather | Method::Whitted => {
                let purpose = Purpose::Gather(samples.replicates);
                let transport = Transport::solve(world, purpose, context)?;
                let gatherer =
                    Gatherer::new(world, &transport.patches, &transport.solutions, config);
                if self.integrator == Method::Gather {
                    show(&gatherer)
                } else {
                    let config = whitted::Config {
                        depth: WHITTED_DEPTH,
                        highlight: Highlight::BlinnPhong,
                        ambient: Irradiance::ZERO,
                        shadow_rays: SHADOW_RAYS,
                        seed,
                    };
                    show(&Whitted::new(world, Some(gatherer), config))
                }
            }
        };
        Ok(film)
    }

    fn report(
        &self,
        frame: &CameraFrame,
        samples: Samples,
        noise: Option<f64>,
        started: Instant,
        session: &mut Session<'_>,
    ) -> Result<(), Failure> {
        let [width, height] = frame.size();
        let spp = samples.replicates * samples.per_replicate;
        let seconds = started.elapsed().as_secs_f64();
        let stated = noise.map_or(String::new(), |noise| {
            format!(", noise {:.2} % (rms over mean)", 100.0 * noise)
        });
        session.context.reporter.note(format_args!(
            "{width}x{height} pixels, {spp} samples each, {seconds:.2} s{stated}"
        ));
        let path = |path: &Path| path.display().to_string();
        let text = if session.context.common.json {
            serde_json::to_string_pretty(&serde_json::json!({
                "output": path(&self.output),
                "png": self.png.as_deref().map(path),
                "integrator": super::name(&self.integrator),
                "size": [width, height],
                "samples": spp,
                "error": { "noise": noise },
                "seconds": seconds,
            }))?
        } else {
            let paths = [Some(&self.output), self.png.as_ref()];
            let lines: Vec<_> = paths.into_iter().flatten().map(|p| path(p)).collect();
            lines.join("\n")
        };
        session.print(&text)
    }
}

/// Root mean square of the standard errors over the mean of the picture.
fn relative_noise(film: &Film) -> f64 {
    let (mut squares, mut mean) = (0.0, 0.0);
    for pixel in film.pixels() {
        let error = pixel.standard_error().unwrap_or_default();
        squares += error.dot(error) / 3.0;
        mean += pixel.mean().dot(Rgb::ONE) / 3.0;
    }
    let count = film.pixels().len() as f64;
    let (rms, mean) = ((squares / count).sqrt(), mean / count);
    if mean > 0.0 { rms / mean } else { 0.0 }
}

/// `WxH` in pixels.
fn parse_size(text: &str) -> Result<[usize; 2], String> {
    /// Pixels along a side: what EXR and PNG readers commonly accept.
    const MAX_SIDE: usize = 65_536;
    let side = |text: &str| {
        text.parse()
            .ok()
            .filter(|side| (1..=MAX_SIDE).contains(side))
    };
    text.split_once(['x', 'X'])
        .and_then(|(width, height)| Some([side(width)?, side(height)?]))
        .ok_or_else(|| format!("WxH in pixels is needed, 1 to {MAX_SIDE} each, such as 640x480"))
}

/// A path that ends in `.exr`.
fn exr_path(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let extension = path.extension().unwrap_or_default();
    if extension.eq_ignore_ascii_case("exr") {
        Ok(path)
    } else {
        Err("the picture is an EXR file: end its name in .exr (--png writes a preview)".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_or_refused() {
        assert_eq!(parse_size("640x480"), Ok([640, 480]));
        for bad in ["", "640", "0x10", "10x0", "-1x5", "1e9x1", "99999x1"] {
            assert!(parse_size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn pictures_are_exr_files() {
        assert!(exr_path("a.EXR").is_ok() && exr_path("a.png").is_err());
    }
}
