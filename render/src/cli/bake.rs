//! `luxel bake`: lightmaps.

pub(super) mod deliver;
mod directional;
mod footprint;
mod gathered;
mod include;
mod mask_files;
mod masks;
mod options;
mod passes;
mod places;
mod report;
mod volume;

use super::Session;
use super::checkpoint::{Keeper, Options, Resume};
use super::exit::{ExitCode, Failure};
use super::footprint::Footprint;
use super::occlusion::Reach;
use super::probe::Method;
use super::reflections::Reflections;
use super::scene;
use crate::files::OutputFolder;
use crate::lightmap::encoding::Format;
use crate::lightmap::handover::Handover;
use crate::lightmap::target::Target;
use clap::ValueEnum;
use deliver::Delivery;
use directional::Directional;
use include::Include;
use luxel_solver::world::World;
use passes::{Baked, Layer};
use serde::Serialize;
use std::path::PathBuf;
use std::time::Duration;
use volume::VolumeOptions;

/// Bake the light of a scene into textures
///
/// Writes a folder: the lightmaps, linear, in the kind of file that --format names; E as EXR with its standard error; the scene as
/// glTF and OBJ with the lightmap's texture coordinates; manifest.json, which says what is where and in which unit; and pictures to look
/// at. luxel export makes another folder of it for somebody else.
#[derive(clap::Args, Serialize)]
pub(super) struct Bake {
    /// Scene file (.toml), or geometry (.obj, .gltf, .glb)
    #[serde(skip)]
    scene: PathBuf,

    /// Folder to write to; it is made when it does not exist
    #[arg(short, long, value_name = "DIR")]
    #[serde(skip)]
    output: PathBuf,

    /// Go on from the checkpoint in the folder, if there is one, to what would have come out without the interruption
    #[arg(long)]
    #[serde(skip)]
    resume: bool,

    /// How often to write a checkpoint to the folder, beside the one when Ctrl-C ends the work
    #[arg(long, value_name = "T", default_value = "1m", value_parser = super::goal::parse_time)]
    #[serde(skip)]
    checkpoint_every: Duration,

    /// Who is to show the maps: sets what a texel holds, and adds a file that shows how to load them
    #[arg(long = "for", value_enum, default_value = "raw", value_name = "WHOM")]
    #[serde(rename = "for")]
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

    #[command(flatten)]
    #[serde(flatten)]
    reach: Reach,

    #[command(flatten)]
    #[serde(flatten)]
    reflections: Reflections,

    /// How light is computed; sky and masks have rays of their own [default: gather]
    #[arg(long, value_enum, value_name = "HOW")]
    integrator: Option<Method>,

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

    /// Maps of where the light comes from, beside those of the light: for normal maps
    #[arg(long, value_enum, default_value = "none", value_name = "HOW")]
    directional: Directional,

    #[command(flatten)]
    #[serde(flatten)]
    volume: VolumeOptions,
}

/// What smooths noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
enum Denoise {
    /// Nothing
    None,
    /// Means of texels that noise alone tells apart, within charts
    Builtin,
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
        let options = Options::new(&self, context)?;
        let delivered = context.common.install(|| {
            let keeper = Keeper::new(&folder, scene, options, self.checkpoint_every, context);
            if self.resume {
                folder.remove_temporaries()?;
                keeper.take_up(Resume::GoOn)?;
            } else {
                keeper.take_up(Resume::Anew)?;
            }
            let cut;
            let mut world = World::new(scene);
            if self.include.iter().any(|include| *include != Include::Ao) {
                scene::require_light(&world)?;
            }
            let masked = self.masked(&world);
            self.check_lights(&world, &masked)?;
            let mut placed = self.place(&world, &[], masked.len(), &goal, context)?;
            let mut corners = None;
            if let Some(found) = placed.cut(&world) {
                cut = found;
                world = World::new(&cut.scene);
                placed = self.place(&world, &cut.edges, masked.len(), &goal, context)?;
                corners = Some(cut.corners.as_slice());
            }
            let masked = self.masked(&world);
            let Some(baked) = self.bake(&world, placed, masked, &goal, &keeper)? else {
                keeper.tell();
                return Ok(None);
            };
            let is_interrupted = context.interrupt.is_set();
            let delivery = Delivery {
                folder: &folder,
                world: &world,
                origin: loaded.origin.as_ref(),
                corners,
                baked: &baked,
                handover,
                bounces: self.reflections.bounces(),
                seed: context.common.seed,
            };
            let manifest = delivery.write()?;
            if is_interrupted {
                keeper.tell();
            } else {
                keeper.finish()?;
            }
            let stated = baked.stated();
            Ok::<_, Failure>(Some((manifest, stated)))
        })??;
        let Some((manifest, stated)) = delivered else {
            return Ok(ExitCode::Interrupted);
        };
        self.report(&manifest, &stated, &goal, session)?;
        let missed = stated
            .iter()
            .map(|stated| stated.error.exit(Some(&goal)))
            .find(|exit| *exit != ExitCode::Ok);
        Ok(if session.context.interrupt.is_set() {
            ExitCode::Interrupted
        } else {
            missed.unwrap_or(ExitCode::Ok)
        })
    }
}
