//! `luxel bake`: lightmaps.

pub(super) mod deliver;
mod directional;
mod footprint;
mod gathered;
mod include;
mod mask_files;
mod masks;
mod options;
mod places;
mod volume;

use super::checkpoint::{AtLuxels, Keeper, Options, Resume};
use super::exit::{ExitCode, Failure};
use super::footprint::Footprint;
use super::goal::Goal;
use super::interrupt::Listening;
use super::memory;
use super::occlusion::Reach;
use super::probe::Method;
use super::reflections::Reflections;
use super::scene;
use super::stated::StatedError;
use super::steering::first_error;
use super::{Context, Session};
use crate::files::OutputFolder;
use crate::lightmap::atlas::Atlas;
use crate::lightmap::bake::{self, Finished, Luxels, Smoothing};
use crate::lightmap::cut::{self, CutScene};
use crate::lightmap::encoding::Format;
use crate::lightmap::handover::Handover;
use crate::lightmap::manifest::{self, Manifest};
use crate::lightmap::target::Target;
use crate::lightmap::walls;
use clap::ValueEnum;
use deliver::Delivery;
use directional::{Directional, DirectionalMaps, Pass};
use include::Include;
use luxel_scenes::Scene;
use luxel_solver::direct::{Lights, NamedLight};
use luxel_solver::gather::Components;
use luxel_solver::world::World;
use masks::Masked;
use places::Charts;
use serde::Serialize;
use std::path::PathBuf;
use std::time::Duration;
use volume::{BakedVolume, VolumeOptions};

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

/// Where a scene is to be lit.
struct Placed {
    atlas: Atlas,
    charts: Charts,
    luxels: Luxels,
    held: Footprint,
}

impl Placed {
    /// The scene with faces cut at thin walls; `None` where there is nothing to cut.
    fn cut(&self, world: &World<'_>) -> Option<CutScene> {
        if self.charts == Charts::Given {
            return None;
        }
        let planes = walls::cuts(world, &self.atlas, &self.luxels);
        (!planes.is_empty()).then(|| cut::cut(world.scene(), &planes))
    }
}

/// A finished bake.
struct Baked {
    atlas: Atlas,
    luxels: Luxels,
    layers: Vec<Layer>,
    masks: Vec<Masked>,
    volume: Option<BakedVolume>,
    /// What was gathered is delivered: only a second wish to stop ends that.
    _listening: Listening,
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

/// How wrong something is that was baked.
struct Stated {
    what: String,
    error: StatedError,
    /// What bilinear filtering leaves between texels.
    filtering: Option<f64>,
}

impl Baked {
    /// How wrong everything is. Of masks the noisiest speaks for all.
    fn stated(&self) -> Vec<Stated> {
        let layers = self.layers.iter().flat_map(|layer| {
            let name = super::name(&layer.include);
            let directions = layer.directional.as_ref().map(|maps| Stated {
                what: format!("directions of {name}"),
                error: maps.stated.clone(),
                filtering: None,
            });
            let light = Stated {
                what: name,
                error: layer.stated.clone(),
                filtering: Some(layer.error.filtering),
            };
            std::iter::once(light).chain(directions)
        });
        let noisiest = |a: &&Masked, b: &&Masked| a.stated.total().total_cmp(&b.stated.total());
        let masks = self.masks.iter().max_by(noisiest).map(|masked| Stated {
            what: super::name(&Include::Masks),
            error: masked.stated.clone(),
            filtering: Some(masked.error.filtering),
        });
        let volume = self.volume.as_ref().map(|volume| Stated {
            what: "volume".into(),
            error: volume.stated.clone(),
            filtering: None,
        });
        layers.chain(masks).chain(volume).collect()
    }
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
            let Some(baked) = self.bake(&world, placed, masked, &goal, &keeper, context)? else {
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

    /// Whether any map is one of light that directions and volumes can be of.
    fn bakes_light(&self) -> bool {
        let mut include = self.include.iter();
        include.any(|include| include.components().is_some())
    }

    /// Tells what was delivered, and how right it is.
    fn report(
        &self,
        manifest: &Manifest,
        stated: &[Stated],
        goal: &Goal,
        session: &mut Session<'_>,
    ) -> Result<(), Failure> {
        let context = &session.context;
        let seconds = context.started.elapsed().as_secs_f64();
        for stated in stated {
            let filtering = stated.filtering.map_or(String::new(), |filtering| {
                format!(
                    "; between texels filtering leaves {:.2} %",
                    100.0 * filtering
                )
            });
            context.reporter.note(format_args!(
                "{}: {}{filtering}",
                stated.what,
                stated.error.summary(Some(goal)),
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
            json["stated"] = stated
                .iter()
                .map(|stated| (stated.what.clone(), stated.error.to_json(Some(goal))))
                .collect::<serde_json::Map<_, _>>()
                .into();
            memory::add_peak(&mut json);
            serde_json::to_string_pretty(&json)?
        } else {
            self.output.join("manifest.json").display().to_string()
        };
        session.print(&text)
    }

    /// Finds the places and luxels of a scene, whose faces are to be parted at edges for which `cuts` is true.
    fn place(
        &self,
        world: &World<'_>,
        cuts: &[bool],
        masked: usize,
        goal: &Goal,
        context: &Context<'_>,
    ) -> Result<Placed, Failure> {
        let (atlas, charts) = self.places(world, cuts, context)?;
        // At least the texels that faces cover: what does not fit then is refused before luxels are looked for.
        let covered: f64 = atlas.object_texels(world.scene()).iter().sum();
        self.require_memory(world, &atlas, covered as usize, masked, goal, context)?;
        let luxels = Luxels::new(world, &atlas, self.backface_tolerance);
        let count = luxels.lit.luxels.len();
        let held = self.require_memory(world, &atlas, count, masked, goal, context)?;
        if luxels.lit.luxels.is_empty() {
            return Err(Failure::new(
                ExitCode::NothingToDo,
                format!(
                    "{}: all luxels lie inside solids; check which way faces look (luxel check)",
                    world.scene().name
                ),
            ));
        }
        Ok(Placed {
            atlas,
            charts,
            luxels,
            held,
        })
    }

    /// Bakes a scene; `None` when it was stopped before all maps were had.
    fn bake<'r>(
        &self,
        world: &World<'_>,
        placed: Placed,
        masked: Vec<NamedLight>,
        goal: &Goal,
        keeper: &Keeper<'_, 'r>,
        context: &Context<'r>,
    ) -> Result<Option<Baked>, Failure> {
        let Placed {
            atlas,
            luxels,
            held,
            ..
        } = placed;
        let listening = context.interrupt.listen();
        let grid = self.volume.grid(world.scene())?;
        let of_layer = 1 + usize::from(self.directional != Directional::None);
        let passes = of_layer * self.include.len() + usize::from(grid.is_some());
        let mut layers = Vec::new();
        for &include in &self.include {
            let done = of_layer * layers.len();
            let of_light = &goal.part(done + 1, passes);
            let known = keeper.complete(layers.len());
            let gathered = match (known, include, include.components()) {
                (_, Include::Masks, _) => continue,
                (Some(complete), ..) => Some(complete),
                (None, _, Some(components)) if self.is_traced() => {
                    self.traced(world, &luxels, components, of_light, keeper, context)
                }
                (None, _, Some(components)) => {
                    self.light(world, &luxels, components, &held, of_light, keeper, context)?
                }
                (None, Include::Ao, _) => self.occlusion(world, &luxels, of_light, keeper, context),
                (None, ..) => {
                    let sky = world.lit_by(Lights::sky_of(world.scene()));
                    let components = Components::Direct;
                    self.light(&sky, &luxels, components, &held, of_light, keeper, context)?
                }
            };
            let Some(gathered) = gathered else {
                return Ok(None);
            };
            let mut layer = self.layer(world, &atlas, &luxels, include, &gathered);
            if self.directional != Directional::None
                && let Some(light) = include.components()
            {
                let pass = Pass {
                    world,
                    held: &held,
                    goal: &goal.part(done + 2, passes),
                    context,
                    components: light,
                    bounces: self.reflections.bounces(),
                    patches: self.patches(&layer, goal),
                };
                let found = self.directions(&pass, &atlas, &luxels, &layer)?;
                if found.is_none() {
                    return Ok(None);
                }
                layer.directional = found;
            }
            layers.push(layer);
            let is_last = layers.len() == self.include.len();
            if !is_last && !context.interrupt.is_set() {
                keeper.add(layers.len() - 1, gathered);
            }
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
                bounces: self.reflections.bounces(),
                patches: self.patches(layer, goal),
            };
            volume = self.volume(&pass, grid, &include)?;
            if volume.is_none() {
                return Ok(None);
            }
        }
        let Some(masks) = self.masks(world, &atlas, &luxels, masked, goal, context)? else {
            return Ok(None);
        };
        Ok(Some(Baked {
            atlas,
            luxels,
            layers,
            masks,
            volume,
            _listening: listening,
        }))
    }

    /// The lights whose masks are asked for.
    fn masked(&self, world: &World<'_>) -> Vec<NamedLight> {
        if self.include.contains(&Include::Masks) {
            world.lights().named(world.scene())
        } else {
            Vec::new()
        }
    }

    /// Whether light is computed by paths.
    fn is_traced(&self) -> bool {
        self.integrator == Some(Method::Path)
    }

    /// What is done about noise.
    fn smoothing(&self) -> Smoothing {
        match self.denoise {
            Denoise::None => Smoothing::None,
            Denoise::Builtin => Smoothing::NonLocalMeans,
        }
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
        gathered: &AtLuxels,
    ) -> Layer {
        let maps = bake::finish(world, atlas, luxels, &gathered.values, self.smoothing());
        let [of_luxels, total] = [&maps.raw, &maps.map].map(bake::relative_error);
        Layer {
            include,
            maps,
            directional: None,
            stated: gathered.stated.clone(),
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
