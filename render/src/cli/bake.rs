//! `luxel bake`: lightmaps.

mod deliver;
mod directional;
mod footprint;
mod gathered;
mod places;
mod volume;

use super::exit::{ExitCode, Failure};
use super::footprint::Footprint;
use super::goal::Goal;
use super::memory;
use super::scene;
use super::stated::StatedError;
use super::steering::first_error;
use super::{Context, Session};
use crate::files::OutputFolder;
use crate::integrators::ao::Falloff;
use crate::lightmap::atlas::Atlas;
use crate::lightmap::bake::{self, Finished, Luxels, Smoothing};
use crate::lightmap::manifest::{self, Manifest};
use crate::lightmap::target::Target;
use clap::ValueEnum;
use deliver::Delivery;
use directional::{Directional, DirectionalMaps, Pass};
use gathered::AtLuxels;
use luxel_scenes::Scene;
use luxel_solver::gather::Components;
use luxel_solver::world::World;
use std::path::PathBuf;
use volume::{BakedVolume, VolumeOptions};

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

    /// Maps of where the light comes from, beside those of the light: for normal maps
    #[arg(long, value_enum, default_value = "none", value_name = "HOW")]
    directional: Directional,

    #[command(flatten)]
    volume: VolumeOptions,
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
    volume: Option<BakedVolume>,
}

impl Baked {
    /// All errors that are stated, by what they belong to.
    fn stated(&self) -> impl Iterator<Item = (String, &StatedError)> {
        let of_layers = self.layers.iter().flat_map(|layer| {
            let include = super::name(&layer.include);
            let directional = layer.directional.as_ref();
            let directions =
                directional.map(|maps| (format!("directions of {include}"), &maps.stated));
            std::iter::once((include, &layer.stated)).chain(directions)
        });
        let volume = self.volume.iter();
        of_layers.chain(volume.map(|volume| ("volume".to_owned(), &volume.stated)))
    }
}

/// One set of maps.
struct Layer {
    include: Include,
    maps: Finished,
    /// Where its light comes from.
    directional: Option<DirectionalMaps>,
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
                target: self.target,
                seed: context.common.seed,
            };
            let manifest = delivery.write()?;
            Ok::<_, Failure>(Some((manifest, baked)))
        })??;
        let Some((manifest, baked)) = delivered else {
            return Ok(ExitCode::Interrupted);
        };
        self.report(&manifest, &baked, &goal, session)?;
        let missed = baked
            .stated()
            .map(|(_, stated)| stated.exit(Some(&goal)))
            .find(|exit| *exit != ExitCode::Ok);
        Ok(if session.context.interrupt.is_set() {
            ExitCode::Interrupted
        } else {
            missed.unwrap_or(ExitCode::Ok)
        })
    }

    /// Whether any map is one of light.
    fn bakes_light(&self) -> bool {
        let mut include = self.include.iter();
        include.any(|include| include.components().is_some())
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
        } else if !self.bakes_light() && self.directional != Directional::None {
            "--directional belongs to maps of light, not to --include ao alone"
        } else if !self.bakes_light() && self.volume.resolution().is_some() {
            "volumes hold the light of the first map of light; --include ao alone has none"
        } else if let Some(problem) = self.volume.problem() {
            problem
        } else {
            return Ok(());
        };
        Err(Failure::new(ExitCode::Usage, problem))
    }

    /// Tells what was delivered, and how right it is.
    fn report(
        &self,
        manifest: &Manifest,
        baked: &Baked,
        goal: &Goal,
        session: &mut Session<'_>,
    ) -> Result<(), Failure> {
        let context = &session.context;
        let seconds = context.started.elapsed().as_secs_f64();
        for layer in &baked.layers {
            context.reporter.note(format_args!(
                "{}: {}; between texels filtering leaves {:.2} %",
                super::name(&layer.include),
                layer.stated.summary(Some(goal)),
                100.0 * layer.error.filtering,
            ));
            if let Some(directional) = &layer.directional {
                context.reporter.note(format_args!(
                    "directions of {}: {}",
                    super::name(&layer.include),
                    directional.stated.summary(Some(goal))
                ));
            }
        }
        if let Some(volume) = &baked.volume {
            context
                .reporter
                .note(format_args!("{}", volume.summary(goal)));
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
        for object in &manifest.objects {
            context.reporter.detail(format_args!(
                "{}: {:.3} m², {:.1} texels a metre",
                object.name, object.area, object.texels_per_metre
            ));
        }
        let text = if context.common.json {
            let mut json = serde_json::to_value(manifest)?;
            json["seconds"] = seconds.into();
            json["stated"] = baked
                .stated()
                .map(|(what, stated)| (what, stated.to_json(Some(goal))))
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
        let grid = self.volume.grid(world.scene())?;
        let of_layer = 1 + usize::from(self.directional != Directional::None);
        let passes = of_layer * self.include.len() + usize::from(grid.is_some());
        let mut layers = Vec::new();
        for &include in &self.include {
            let done = of_layer * layers.len();
            let whole = goal;
            let goal = &whole.part(done + 1, passes);
            let gathered = match include.components() {
                Some(components) => self.light(world, &luxels, components, &held, goal, context)?,
                None => self.occlusion(world, &luxels, goal, context),
            };
            let Some(gathered) = gathered else {
                return Ok(None);
            };
            let mut layer = self.layer(world, &atlas, &luxels, include, gathered);
            if self.directional != Directional::None
                && let Some(light) = include.components()
            {
                let pass = Pass {
                    world,
                    held: &held,
                    goal: &whole.part(done + 2, passes),
                    context,
                    components: light,
                    patches: self.patches(&layer, whole),
                };
                let found = self.directions(&pass, &atlas, &luxels, &layer)?;
                if found.is_none() {
                    return Ok(None);
                }
                layer.directional = found;
            }
            layers.push(layer);
        }
        let mut volume = None;
        if let Some(grid) = grid {
            let lit = layers
                .iter()
                .find_map(|layer| Some((layer, layer.include.components()?)));
            let (layer, components) = lit.expect("options were checked: some map is of light");
            let include = super::name(&layer.include);
            let pass = Pass {
                world,
                held: &held,
                goal,
                context,
                components,
                patches: self.patches(layer, goal),
            };
            volume = self.volume(&pass, grid, &include)?;
            if volume.is_none() {
                return Ok(None);
            }
        }
        Ok(Some(Baked {
            atlas,
            luxels,
            layers,
            volume,
        }))
    }

    /// Patches with which more is begun about the light of a layer.
    fn patches(&self, layer: &Layer, goal: &Goal) -> usize {
        let first = self.first_patches(first_error(Some(goal)));
        layer.patches.max(first)
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
            directional: None,
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
