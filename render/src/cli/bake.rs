//! `luxel bake`: lightmaps.

pub(super) mod deliver;
mod footprint;
mod gathered;
mod places;

use super::exit::{ExitCode, Failure};
use super::footprint::Footprint;
use super::goal::Goal;
use super::memory;
use super::scene;
use super::stated::StatedError;
use super::{Context, Session};
use crate::files::OutputFolder;
use crate::integrators::ao::Falloff;
use crate::lightmap::atlas::Atlas;
use crate::lightmap::bake::{self, Finished, Luxels, Smoothing};
use crate::lightmap::encoding::Format;
use crate::lightmap::handover::Handover;
use crate::lightmap::manifest::{self, Manifest};
use crate::lightmap::target::Target;
use clap::ValueEnum;
use deliver::Delivery;
use gathered::AtLuxels;
use luxel_scenes::Scene;
use luxel_solver::gather::Components;
use luxel_solver::world::World;
use std::path::PathBuf;

/// Bake the light of a scene into textures
///
/// Writes a folder: the lightmaps, linear, in the kind of file that --format names; E as EXR with its standard error; the scene as
/// glTF and OBJ with the lightmap's texture coordinates; manifest.json, which says what is where and in which unit; and pictures to look
/// at. luxel export makes another folder of it for somebody else.
#[derive(clap::Args)]
pub(super) struct Bake {
    /// Scene file (.toml), or geometry (.obj, .gltf, .glb)
    scene: PathBuf,

    /// Folder to write to; it is made when it does not exist
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,

    /// Who is to show the maps: sets what a texel holds, and adds a file that shows how to load them
    #[arg(long = "for", value_enum, default_value = "raw", value_name = "WHOM")]
    target: Target,

    /// Kind of file of the maps [default: what --for loads best: ktx2 for bevy, else exr]
    #[arg(long, value_enum, value_name = "FORMAT")]
    format: Option<Format>,

    /// What the maps hold; for several, separated by commas, there is a set of maps each, the first called lightmap
    #[arg(
        long,
        value_enum,
        default_value = "all",
        value_name = "WHAT",
        value_delimiter = ','
    )]
    include: Vec<Include>,

    /// Of ambient occlusion: metres beyond which nothing occludes
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

    /// Where texture coordinates come from
    #[arg(long, value_enum, default_value = "auto", value_name = "WHENCE")]
    uv: places::Whence,

    /// Texels along each side of a page, a multiple of 4 [default: 256 to 1024, as 16 texels a metre need]
    #[arg(long, value_name = "N", value_parser = places::parse_side)]
    size: Option<usize>,

    /// Texels a metre, on as many pages as are needed [default: as fine as one page allows]
    #[arg(long, value_name = "F", value_parser = places::parse_density)]
    texels_per_metre: Option<f64>,

    /// Texels around each chart: charts are at least twice as many apart
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=64))]
    padding: u8,

    /// Give each chart blocks of 4 × 4 texels of its own, for block compression
    #[arg(long)]
    block_align: bool,

    /// Share of a texel's rays that may meet backs of faces before it counts as lying inside a solid
    #[arg(long, value_name = "SHARE", default_value_t = 0.5, value_parser = places::parse_share)]
    backface_tolerance: f64,

    /// What smooths the noise that is left; the maps of luxels stay as they were gathered
    #[arg(long, value_enum, default_value = "builtin", value_name = "HOW")]
    denoise: Denoise,
}

/// What smooths noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Denoise {
    /// Nothing
    None,
    /// Means of texels that noise alone tells apart, within charts
    Builtin,
}

/// What is baked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Include {
    /// All light
    All,
    /// Light straight from a source
    Direct,
    /// Light after at least one reflection
    Indirect,
    /// Ambient occlusion, 1 = open
    Ao,
}

impl Include {
    /// Which light; `None` for occlusion.
    fn components(self) -> Option<Components> {
        match self {
            Self::All => Some(Components::All),
            Self::Direct => Some(Components::Direct),
            Self::Indirect => Some(Components::Indirect),
            Self::Ao => None,
        }
    }
}

/// A finished bake.
struct Baked {
    atlas: Atlas,
    luxels: Luxels,
    layers: Vec<Layer>,
}

/// One set of maps.
struct Layer {
    include: Include,
    maps: Finished,
    /// The error of luxels by its parts, and what bilinear filtering adds.
    stated: StatedError,
    error: manifest::Error,
    /// Of light: where the flux goes, and patches of the solution.
    energy: Option<manifest::Energy>,
    patches: usize,
}

impl Bake {
    pub(super) fn run(self, session: &mut Session<'_>) -> Result<ExitCode, Failure> {
        self.check_options()?;
        let handover = Handover::new(self.target, self.format)?;
        let folder = OutputFolder::prepare(&self.output)?;
        let loaded = scene::read_with_origin(&self.scene, &session.context)?;
        let scene = &loaded.scene;
        let context = &session.context;
        let goal = context.common.goal(context.started);
        Footprint::to_prepare(scene).require(context, || None)?;
        let delivered = context.common.install(|| {
            let world = World::new(scene);
            if self.include.iter().any(|include| *include != Include::Ao) {
                scene::require_light(&world)?;
            }
            let Some(baked) = self.bake(&world, &goal, context)? else {
                return Ok(None);
            };
            let delivery = Delivery {
                folder: &folder,
                world: &world,
                origin: loaded.origin.as_ref(),
                baked: &baked,
                handover,
                seed: context.common.seed,
            };
            let manifest = delivery.write()?;
            Ok::<_, Failure>(Some((manifest, baked.layers)))
        })??;
        let Some((manifest, layers)) = delivered else {
            return Ok(ExitCode::Interrupted);
        };
        self.report(&manifest, &layers, &goal, session)?;
        let missed = layers
            .iter()
            .map(|layer| layer.stated.exit(Some(&goal)))
            .find(|exit| *exit != ExitCode::Ok);
        Ok(if session.context.interrupt.is_set() {
            ExitCode::Interrupted
        } else {
            missed.unwrap_or(ExitCode::Ok)
        })
    }

    /// Refuses options that would have no effect.
    fn check_options(&self) -> Result<(), Failure> {
        let mut kinds = self.include.clone();
        kinds.sort_by_key(|include| *include as u8);
        kinds.dedup();
        let problem = if self.max_distance.is_some() && !self.include.contains(&Include::Ao) {
            "--max-distance belongs to --include ao"
        } else if kinds.len() < self.include.len() {
            "--include names the same twice"
        } else {
            return Ok(());
        };
        Err(Failure::new(ExitCode::Usage, problem))
    }

    /// Tells what was delivered, and how right it is.
    fn report(
        &self,
        manifest: &Manifest,
        layers: &[Layer],
        goal: &Goal,
        session: &mut Session<'_>,
    ) -> Result<(), Failure> {
        let context = &session.context;
        let seconds = context.started.elapsed().as_secs_f64();
        for layer in layers {
            context.reporter.note(format_args!(
                "{}: {}; between texels filtering leaves {:.2} %",
                super::name(&layer.include),
                layer.stated.summary(Some(goal)),
                100.0 * layer.error.filtering,
            ));
        }
        context.reporter.note(format_args!(
            "{} luxels on {} page(s) of {} × {}, {:.1} texels a metre, {seconds:.2} s{}",
            manifest.atlas.lit,
            manifest.lightmap.pages.len(),
            manifest.atlas.width,
            manifest.atlas.height,
            manifest.atlas.texels_per_metre,
            memory::peak_in_words(),
        ));
        deliver::tell_losses(manifest, &context.reporter);
        for object in &manifest.objects {
            context.reporter.detail(format_args!(
                "{}: {:.3} m², {:.1} texels a metre",
                object.name, object.area, object.texels_per_metre
            ));
        }
        let text = if context.common.json {
            let mut json = serde_json::to_value(manifest)?;
            json["seconds"] = seconds.into();
            json["stated"] = layers
                .iter()
                .map(|layer| {
                    (
                        super::name(&layer.include),
                        layer.stated.to_json(Some(goal)),
                    )
                })
                .collect::<serde_json::Map<_, _>>()
                .into();
            memory::add_peak(&mut json);
            serde_json::to_string_pretty(&json)?
        } else {
            self.output.join("manifest.json").display().to_string()
        };
        session.print(&text)
    }

    /// Bakes a scene; `None` when it was stopped before all maps were had.
    fn bake(
        &self,
        world: &World<'_>,
        goal: &Goal,
        context: &Context<'_>,
    ) -> Result<Option<Baked>, Failure> {
        let atlas = self.places(world, context)?;
        // At least the texels that faces cover: what does not fit then is refused before luxels are looked for.
        let covered: f64 = atlas.object_texels(world.scene()).iter().sum();
        self.require_memory(world, &atlas, covered as usize, goal, context)?;
        let luxels = Luxels::new(world, &atlas, self.backface_tolerance);
        let count = luxels.lit.luxels.len();
        let held = self.require_memory(world, &atlas, count, goal, context)?;
        if luxels.lit.luxels.is_empty() {
            return Err(Failure::new(
                ExitCode::NothingToDo,
                format!(
                    "{}: all luxels lie inside solids; check which way faces look (luxel check)",
                    world.scene().name
                ),
            ));
        }
        let mut layers = Vec::new();
        for &include in &self.include {
            let gathered = match include.components() {
                Some(components) => self.light(world, &luxels, components, &held, goal, context)?,
                None => self.occlusion(world, &luxels, goal, context),
            };
            let Some(gathered) = gathered else {
                return Ok(None);
            };
            layers.push(self.layer(world, &atlas, &luxels, include, gathered));
        }
        Ok(Some(Baked {
            atlas,
            luxels,
            layers,
        }))
    }

    /// Makes maps of what was gathered.
    fn layer(
        &self,
        world: &World<'_>,
        atlas: &Atlas,
        luxels: &Luxels,
        include: Include,
        gathered: AtLuxels,
    ) -> Layer {
        let smoothing = match self.denoise {
            Denoise::None => Smoothing::None,
            Denoise::Builtin => Smoothing::NonLocalMeans,
        };
        let maps = bake::finish(world.scene(), atlas, luxels, &gathered.values, smoothing);
        let [of_luxels, total] = [&maps.raw, &maps.map].map(bake::relative_error);
        Layer {
            include,
            maps,
            stated: gathered.stated,
            error: manifest::Error {
                luxels: of_luxels,
                filtering: (total * total - of_luxels * of_luxels).max(0.0).sqrt(),
                total,
            },
            energy: gathered.energy,
            patches: gathered.patches,
        }
    }
}

/// Texels a metre, the root mean square over all surfaces that have texels.
fn texels_per_metre(atlas: &Atlas, scene: &Scene) -> f64 {
    let texels: f64 = atlas.object_texels(scene).iter().sum();
    let charted = scene.face_ids().filter(|face| atlas.chart(*face).is_some());
    let area: f64 = charted.map(|face| scene.area(face)).sum();
    if area > 0.0 {
        (texels / area).sqrt()
    } else {
        0.0
    }
}
