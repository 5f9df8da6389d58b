//! `luxel render`: a picture.

mod footprint;
mod prepare;

use super::exit::{ExitCode, Failure};
use super::footprint::{Footprint, held_back};
use super::goal::Goal;
use super::memory;
use super::occlusion::Reach;
use super::refine::{Refined, refine};
use super::reflections::{Reflected, Reflections};
use super::scene;
use super::stated::StatedError;
use super::steering::Steering;
use super::transport::{Transport, VIEW_PATCHES};
use super::{Context, Session};
use crate::camera::CameraFrame;
use crate::files::Output;
use crate::film::{Alike, Film, PixelError, SampleCounts};
use crate::image::exr::{Origin, Picture, Rendered};
use crate::image::{Image, exr, png};
use crate::integrators::ao::AmbientOcclusion;
use crate::integrators::gather::Gatherer;
use crate::integrators::path::PathTracer;
use crate::integrators::radiosity::RadiosityView;
use crate::integrators::whitted::{self, Highlight, Whitted};
use crate::integrators::{Integrator, Samples, expose_further};
use crate::progress::Progress;
use crate::tone_map::ToneMap;
use crate::view::view;
use clap::ValueEnum;
use luxel_scenes::{Irradiance, Rgb};
use luxel_solver::audit;
use luxel_solver::world::World;
use prepare::{Prepared, indirect_field, of_direct_light, prepare};
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

/// Shadow rays of a camera sample, unless a pilot says better.
const SHADOW_RAYS: usize = 4;

/// Refinement of a mesh whose error, or noise, is too large, and the most patches.
const FINER: usize = 4;
const MOST_PATCHES: usize = 1_000_000;

/// Samples of a pixel that a refinement begins with; where a field knows the indirect light, few show the rest.
const FIRST_SAMPLES: u32 = 8;
const FIRST_SAMPLES_OF_FIELD: u32 = 4;

/// Rays for ambient occlusion of a camera sample.
const AO_RAYS: u32 = 8;

/// Reflections and refractions that Whitted's recursion follows: a glass body needs four for what
/// is behind it, a hall of mirrors shows the eighth reflection as a speck.
const WHITTED_DEPTH: u32 = 8;

/// Render a picture
///
/// The EXR file holds linear radiance (RGB), its estimated error (layer `error`, one standard
/// deviation), the part of it that patches make (layer `discretisation`) and, where pixels differ in
/// it, their number of samples (layer `samples`).
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

    /// Samples per pixel, whatever the error [default: as many as the error asks for]
    #[arg(long, conflicts_with_all = ["error", "time"], value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    spp: Option<u32>,

    #[command(flatten)]
    reach: Reach,

    #[command(flatten)]
    reflections: Reflections,
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
        self.reach
            .require(self.integrator == Method::Ao, "--integrator ao")?;
        self.reflections.require(match self.integrator {
            Method::Gather | Method::Whitted | Method::Path => Reflected::Some,
            Method::Radiosity | Method::Ao => {
                Reflected::None("--integrator gather, whitted or path")
            }
        })?;
        if self.png.as_ref() == Some(&self.output) {
            return Err(Failure::new(
                ExitCode::Usage,
                "-o and --png name the same file",
            ));
        }
        let output = Output::prepare(&self.output)?;
        let preview = self.png.as_deref().map(Output::prepare).transpose()?;

        let scene = scene::read(&self.scene, &session.context)?;
        let camera = scene::camera(&scene, self.camera.as_deref())?;
        let frame = CameraFrame::new(camera, self.size.unwrap_or(camera.size))?;
        let context = &session.context;
        let goal = context.common.goal(context.started);
        let goal = self.spp.is_none().then_some(&goal);

        Footprint::to_prepare(&scene).require(context, || None)?;
        let exposed = context.common.install(|| {
            let world = World::new(&scene);
            self.require_memory(&world, &frame, goal, context)?;
            if self.integrator != Method::Ao {
                scene::require_light(&world)?;
            }
            self.judge_view(&world, &camera.name, &frame, context)?;
            self.expose(&world, &frame, goal, context)
        })??;
        let Some(Exposed { film, error }) = exposed else {
            return Ok(ExitCode::Interrupted);
        };

        let samples = film.sample_counts();
        let picture = Picture {
            layers: layers(&film),
            image: film.mean(),
            origin: Some(Origin::Rendered(Rendered {
                software: concat!("luxel ", env!("CARGO_PKG_VERSION")).into(),
                scene: scene.name.clone(),
                camera: camera.name.clone(),
                integrator: super::name(&self.integrator),
                unit: match self.integrator {
                    Method::Ao => "1".into(),
                    _ => scene::radiance_unit(scene.units).into(),
                },
                samples,
                seed: context.common.seed,
            })),
        };
        output.write(&exr::encode(&picture)?)?;
        if let Some(preview) = &preview {
            let tone_map = match self.integrator {
                Method::Ao => ToneMap { exposure: 1.0 },
                _ => ToneMap::automatic(&picture.image),
            };
            preview.write(&png::encode(&picture.image, tone_map)?)?;
        }
        self.report(&frame, samples, error.as_ref(), goal, session)?;
        Ok(if session.context.interrupt.is_set() {
            ExitCode::Interrupted
        } else {
            error.map_or(ExitCode::Ok, |error| error.exit(goal))
        })
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

    /// The film; `None` when it was interrupted before the first sample.
    fn expose(
        &self,
        world: &World<'_>,
        frame: &CameraFrame,
        goal: Option<&Goal>,
        context: &Context<'_>,
    ) -> Result<Option<Exposed>, Failure> {
        let seed = context.common.seed;
        let show = |integrator: &dyn Integrator, solver_bound: f64| {
            self.refine(integrator, frame, solver_bound, goal, context)
        };
        match self.integrator {
            Method::Ao => {
                let config = self.reach.config(AO_RAYS, seed);
                Ok(show(&AmbientOcclusion::new(world, config), 0.0))
            }
            Method::Path => {
                let tracer = PathTracer::new(world, seed).with_bounces(self.reflections.bounces());
                Ok(show(&tracer, 0.0))
            }
            Method::Radiosity => {
                let mut patches = VIEW_PATCHES;
                loop {
                    let fine = Transport::view(world, patches, context)?;
                    let coarse = Transport::view(world, patches / 4, context)?;
                    let view = RadiosityView::new(world, &fine.patches, &fine.solutions)
                        .with_coarse(&coarse.patches, &coarse.solutions);
                    let shown = show(&view, fine.solver_bound() / PI);
                    if !needs_finer(shown.as_ref(), goal, patches, context)
                        || !self.may_be_finer(world, frame, goal, FINER * patches, context)
                    {
                        return Ok(shown);
                    }
                    patches *= FINER;
                }
            }
            Method::Gather | Method::Whitted if !self.reflections.bounces().reflect() => {
                let gatherer = Gatherer::of_direct_light(world, of_direct_light(seed));
                Ok(self.show_gathered(world, gatherer, seed, |integrator| show(integrator, 0.0)))
            }
            Method::Gather | Method::Whitted => {
                let most_patches = self.most_patches(world, frame, goal, context);
                let bounces = self.reflections.bounces();
                let Some(Prepared {
                    scene,
                    mut lookup,
                    mut patches,
                    config,
                    field_error,
                }) = prepare(world, frame, most_patches, bounces, goal, context)?
                else {
                    return Ok(None);
                };
                loop {
                    let field = field_error.and_then(|error| {
                        let mut steering = Steering::new(context, goal);
                        indirect_field(world, &lookup, frame, config, error, &mut steering)
                    });
                    let mut gatherer = Gatherer::new(world, &lookup, config);
                    if let Some(field) = &field {
                        gatherer = gatherer.with_field(field);
                    }
                    // What a bound on E leaves of L = ρE/π, for ρ up to one.
                    let solver_bound = lookup.solver_bound() / PI;
                    let shown = self.show_gathered(world, gatherer, seed, |integrator| {
                        show(integrator, solver_bound)
                    });
                    if !needs_finer(shown.as_ref(), goal, patches, context) {
                        return Ok(shown);
                    }
                    if FINER * patches > most_patches {
                        held_back(context);
                        return Ok(shown);
                    }
                    patches *= FINER;
                    let mut steering = Steering::new(context, goal);
                    match scene.solve(patches, &mut steering)? {
                        Some(finer) => lookup = finer,
                        None => return Ok(shown),
                    }
                }
            }
        }
    }

    /// Shows what a gatherer finds, behind mirrors and glass as well where that is asked for.
    fn show_gathered<'w>(
        &self,
        world: &'w World<'w>,
        gatherer: Gatherer<'w>,
        seed: u64,
        show: impl Fn(&dyn Integrator) -> Option<Exposed>,
    ) -> Option<Exposed> {
        if self.integrator == Method::Gather {
            return show(&gatherer);
        }
        let config = whitted::Config {
            depth: WHITTED_DEPTH,
            highlight: Highlight::BlinnPhong,
            ambient: Irradiance::ZERO,
            shadow_rays: SHADOW_RAYS,
            seed,
        };
        show(&Whitted::new(world, Some(gatherer), config))
    }

    /// Exposes a film until the goal, or the number of samples, is reached.
    fn refine(
        &self,
        integrator: &dyn Integrator,
        frame: &CameraFrame,
        solver_bound: f64,
        goal: Option<&Goal>,
        context: &Context<'_>,
    ) -> Option<Exposed> {
        let seed = context.common.seed;
        let fixed = self.spp.map(|spp| Samples::new(spp, seed));
        let few = match self.integrator {
            Method::Gather | Method::Whitted => FIRST_SAMPLES_OF_FIELD,
            Method::Radiosity | Method::Path | Method::Ao => FIRST_SAMPLES,
        };
        let first = fixed.unwrap_or(Samples::new(few, seed));
        let film = Film::new(frame.size(), first.replicates);
        let mut steering = Steering::new(context, goal);
        let add = |film: &mut Film, further: &[u32], progress: &dyn Progress| {
            expose_further(film, integrator, frame, seed, further, progress);
        };
        let start = Refined::first(film, first.per_replicate);
        let (film, error) = refine(start, Alike::Neighbours, goal, &mut steering, add)?;
        let level: f64 = film.values().map(|value| value.element_sum() / 3.0).sum();
        let level = level / film.values().count() as f64;
        let solver = if level > 0.0 {
            solver_bound / level
        } else {
            0.0
        };
        let knows = film.replicates() > 1;
        Some(Exposed {
            error: knows
                .then(|| StatedError::of_samples(error.sampling, error.discretisation, solver)),
            film,
        })
    }

    fn report(
        &self,
        frame: &CameraFrame,
        samples: SampleCounts,
        error: Option<&StatedError>,
        goal: Option<&Goal>,
        session: &mut Session<'_>,
    ) -> Result<(), Failure> {
        let [width, height] = frame.size();
        let seconds = session.context.started.elapsed().as_secs_f64();
        let stated = error.map_or(String::new(), |error| format!("; {}", error.summary(goal)));
        session.context.reporter.note(format_args!(
            "{width}x{height} pixels, {} samples each, {seconds:.2} s{}{stated}",
            in_words(samples),
            memory::peak_in_words()
        ));
        let path = |path: &Path| path.display().to_string();
        let text = if session.context.common.json {
            let mut json = serde_json::json!({
                "output": path(&self.output),
                "png": self.png.as_deref().map(path),
                "integrator": super::name(&self.integrator),
                "size": [width, height],
                "samples": samples,
                "error": error.map(|error| error.to_json(goal)),
                "seconds": seconds,
            });
            memory::add_peak(&mut json);
            serde_json::to_string_pretty(&json)?
        } else {
            let paths = [Some(&self.output), self.png.as_ref()];
            let lines: Vec<_> = paths.into_iter().flatten().map(|p| path(p)).collect();
            lines.join("\n")
        };
        session.print(&text)
    }
}

/// What was rendered.
struct Exposed {
    film: Film,
    /// `None` for a single sample, which does not tell.
    error: Option<StatedError>,
}

/// The estimated error of every pixel, the part that patches make, and the number of samples where
/// pixels differ in it.
fn layers(film: &Film) -> Vec<(String, Image)> {
    let mut layers = Vec::new();
    if let Some(errors) = film.errors(Alike::Neighbours) {
        let total = film.image(errors.iter().map(PixelError::total));
        let patches = film.image(errors.iter().map(|error| error.discretisation));
        layers.push(("error".into(), total));
        layers.push(("discretisation".into(), patches));
    }
    let SampleCounts { min, max, .. } = film.sample_counts();
    if min < max {
        let numbers = film.samples().map(|n| Rgb::splat(f64::from(n)));
        layers.push(("samples".into(), film.image(numbers)));
    }
    layers
}

/// Samples of a pixel for people.
fn in_words(SampleCounts { mean, min, max }: SampleCounts) -> String {
    if min == max {
        format!("{min}")
    } else {
        format!("{mean:.1} ({min} to {max})")
    }
}

/// Whether an error was missed that a finer mesh may reach: what samples cannot lessen is left.
fn needs_finer(
    shown: Option<&Exposed>,
    goal: Option<&Goal>,
    patches: usize,
    context: &Context<'_>,
) -> bool {
    let Some(Exposed {
        error: Some(error), ..
    }) = shown
    else {
        return false;
    };
    let in_time = goal.is_none_or(|goal| goal.time_left().is_none_or(|left| !left.is_zero()));
    error.exit(goal) == ExitCode::TargetMissed
        && patches * FINER <= MOST_PATCHES
        && in_time
        && !context.interrupt.is_set()
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
