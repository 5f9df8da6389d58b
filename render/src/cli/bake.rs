//! `luxel bake`: lightmaps.

mod deliver;
mod footprint;
mod places;

use super::exit::{ExitCode, Failure};
use super::footprint::{Footprint, held_back};
use super::memory;
use super::scene;
use super::stated::StatedError;
use super::steering::{Steering, first_error};
use super::{Context, Session};
use crate::files::OutputFolder;
use crate::lightmap::atlas::Atlas;
use crate::lightmap::bake::{self, Finished, Luxels, Smoothing};
use crate::lightmap::manifest;
use crate::lightmap::map::Lightmap;
use crate::lightmap::target::Target;
use clap::ValueEnum;
use deliver::Delivery;
use luxel_scenes::Scene;
use luxel_solver::adaptive::{Adaptive, AdaptiveConfig, Ending};
use luxel_solver::gather::Components;
use luxel_solver::world::World;
use std::path::PathBuf;

/// Bake the light of a scene into textures
///
/// Writes a folder: the lightmaps as linear EXR, their standard error, the scene as glTF and OBJ with the lightmap's texture
/// coordinates, manifest.json, which says what is where and in which unit, and pictures to look at.
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

    /// Which light the maps hold
    #[arg(long, value_enum, default_value = "all", value_name = "WHICH")]
    include: Include,

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

/// Which light is baked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Include {
    /// All
    All,
    /// Straight from a source
    Direct,
    /// After at least one reflection
    Indirect,
}

impl From<Include> for Components {
    fn from(include: Include) -> Self {
        match include {
            Include::All => Self::All,
            Include::Direct => Self::Direct,
            Include::Indirect => Self::Indirect,
        }
    }
}

/// A finished bake.
struct Baked {
    atlas: Atlas,
    luxels: Luxels,
    /// What was gathered, with nothing filled in.
    raw: Lightmap,
    /// What is delivered.
    map: Lightmap,
    error: manifest::Error,
    adaptive: Adaptive,
}

impl Bake {
    pub(super) fn run(self, session: &mut Session<'_>) -> Result<ExitCode, Failure> {
        let folder = OutputFolder::prepare(&self.output)?;
        let loaded = scene::read_with_origin(&self.scene, &session.context)?;
        let scene = &loaded.scene;
        let context = &session.context;
        let goal = context.common.goal(context.started);
        Footprint::to_prepare(scene).require(context, || None)?;
        let baked = context.common.install(|| {
            let world = World::new(scene);
            scene::require_light(&world)?;
            let Some(baked) = self.bake(&world, context)? else {
                return Ok(None);
            };
            let delivery = Delivery {
                folder: &folder,
                world: &world,
                origin: loaded.origin.as_ref(),
                baked: &baked,
                target: self.target,
                include: super::name(&self.include),
                seed: context.common.seed,
            };
            let manifest = delivery.write()?;
            Ok::<_, Failure>(Some((manifest, stated(&baked))))
        })??;
        let Some((manifest, error)) = baked else {
            return Ok(ExitCode::Interrupted);
        };
        let seconds = context.started.elapsed().as_secs_f64();
        context.reporter.note(format_args!(
            "{} luxels on {} page(s), {:.1} texels a metre, {seconds:.2} s{}; {}; between texels filtering leaves {:.2} %",
            manifest.atlas.lit,
            manifest.pages.len(),
            manifest.atlas.texels_per_metre,
            memory::peak_in_words(),
            error.summary(Some(&goal)),
            100.0 * manifest.error.filtering,
        ));
        let text = if context.common.json {
            let mut json = serde_json::to_value(&manifest)?;
            json["seconds"] = seconds.into();
            json["target_error"] = error.to_json(Some(&goal));
            memory::add_peak(&mut json);
            serde_json::to_string_pretty(&json)?
        } else {
            self.output.join("manifest.json").display().to_string()
        };
        session.print(&text)?;
        Ok(if session.context.interrupt.is_set() {
            ExitCode::Interrupted
        } else {
            error.exit(Some(&goal))
        })
    }

    /// Bakes a scene; `None` when it was stopped before there was any light.
    fn bake(&self, world: &World<'_>, context: &Context<'_>) -> Result<Option<Baked>, Failure> {
        let goal = context.common.goal(context.started);
        let atlas = self.places(world, context)?;
        let luxels = Luxels::new(world, &atlas, self.backface_tolerance);
        let count = luxels.lit.luxels.len();
        if count == 0 {
            return Err(Failure::new(
                ExitCode::NothingToDo,
                format!(
                    "{}: all luxels lie inside solids; check which way faces look (luxel check)",
                    world.scene().name
                ),
            ));
        }
        let held = self.require_memory(world, &atlas, count, &goal, context)?;
        let error = first_error(Some(&goal));
        let first = self.first_patches(error);
        let config = AdaptiveConfig {
            error,
            components: self.include.into(),
            most_patches: held.most_patches(world.scene(), first, context),
            seed: context.common.seed,
        };
        let mut steering = Steering::new(context, Some(&goal));
        let Some(found) = bake::bake(world, &luxels, &config, &mut steering)? else {
            return Ok(None);
        };
        if found.adaptive.ending == Ending::TooManyPatches {
            held_back(context);
        }
        let smoothing = match self.denoise {
            Denoise::None => Smoothing::None,
            Denoise::Builtin => Smoothing::NonLocalMeans,
        };
        let Finished { raw, map } =
            bake::finish(world.scene(), &atlas, &luxels, &found.gathered, smoothing);
        let [of_luxels, total] = [&raw, &map].map(bake::relative_error);
        Ok(Some(Baked {
            error: manifest::Error {
                luxels: of_luxels,
                filtering: (total * total - of_luxels * of_luxels).max(0.0).sqrt(),
                total,
            },
            atlas,
            luxels,
            raw,
            map,
            adaptive: found.adaptive,
        }))
    }
}

/// The error of the light at luxels: what was asked for.
fn stated(baked: &Baked) -> StatedError {
    let lit = baked
        .raw
        .lit()
        .map(|texel| baked.raw.values[texel].element_sum());
    let level = lit.sum::<f64>() / (3.0 * baked.raw.lit().count() as f64);
    let bound = baked.adaptive.solver_bound;
    let solver = if level > 0.0 { bound / level } else { 0.0 };
    StatedError::of_gather(&baked.adaptive.parts, solver)
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
