//! The passes of a bake: where luxels are, the light of each set of maps and where it comes from, shadow masks, a volume.

use super::directional::{Directional, DirectionalMaps, Pass};
use super::masks::Masked;
use super::places::Charts;
use super::volume::BakedVolume;
use super::{Bake, Denoise, Include, Method};
use crate::cli::Context;
use crate::cli::checkpoint::{AtLuxels, Keeper};
use crate::cli::exit::{ExitCode, Failure};
use crate::cli::footprint::Footprint;
use crate::cli::goal::Goal;
use crate::cli::interrupt::Listening;
use crate::cli::stated::StatedError;
use crate::cli::steering::first_error;
use crate::lightmap::atlas::Atlas;
use crate::lightmap::bake::{self, Finished, Luxels, Smoothing};
use crate::lightmap::cut::{self, CutScene};
use crate::lightmap::manifest;
use crate::lightmap::walls;
use luxel_solver::direct::{Lights, NamedLight};
use luxel_solver::gather::Components;
use luxel_solver::world::World;

/// Where a scene is to be lit.
pub(super) struct Placed {
    atlas: Atlas,
    charts: Charts,
    luxels: Luxels,
    held: Footprint,
}

impl Placed {
    /// The scene with faces cut at thin walls; `None` where there is nothing to cut.
    pub(super) fn cut(&self, world: &World<'_>) -> Option<CutScene> {
        if self.charts == Charts::Given {
            return None;
        }
        let planes = walls::cuts(world, &self.atlas, &self.luxels);
        (!planes.is_empty()).then(|| cut::cut(world.scene(), &planes))
    }
}

/// A finished bake.
pub(super) struct Baked {
    pub(super) atlas: Atlas,
    pub(super) luxels: Luxels,
    pub(super) layers: Vec<Layer>,
    pub(super) masks: Vec<Masked>,
    pub(super) volume: Option<BakedVolume>,
    /// What was gathered is delivered: only a second wish to stop ends that.
    _listening: Listening,
}

/// One set of maps.
pub(super) struct Layer {
    pub(super) include: Include,
    pub(super) maps: Finished,
    /// Where its light comes from.
    pub(super) directional: Option<DirectionalMaps>,
    /// The error of luxels by its parts, and what bilinear filtering adds.
    pub(super) stated: StatedError,
    pub(super) error: manifest::Error,
    /// Of light: where the flux goes, and patches of the solution.
    pub(super) energy: Option<manifest::Energy>,
    pub(super) patches: usize,
}

impl Bake {
    /// Finds the places and luxels of a scene, whose faces are to be parted at edges for which `cuts` is true.
    pub(super) fn place(
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
    pub(super) fn bake(
        &self,
        world: &World<'_>,
        placed: Placed,
        masked: Vec<NamedLight>,
        goal: &Goal,
        keeper: &Keeper<'_, '_>,
    ) -> Result<Option<Baked>, Failure> {
        let Placed {
            atlas,
            luxels,
            held,
            ..
        } = placed;
        let context = keeper.context();
        let listening = context.interrupt.listen();
        let grid = self.volume.grid(world.scene())?;
        let of_layer = 1 + usize::from(self.directional != Directional::None);
        let passes = of_layer * self.include.len() + usize::from(grid.is_some());
        let mut layers = Vec::new();
        for &include in &self.include {
            let done = of_layer * layers.len();
            let of_light = &goal.part(done + 1, passes);
            let known = keeper.begin(layers.len())?;
            let gathered = match (known, include, include.components()) {
                (_, Include::Masks, _) => continue,
                (Some(complete), ..) => Some(complete),
                (None, _, Some(components)) if self.is_traced() => {
                    self.traced(world, &luxels, components, of_light, keeper)
                }
                (None, _, Some(components)) => {
                    self.light(world, &luxels, components, &held, of_light, keeper)?
                }
                (None, Include::Ao, _) => self.occlusion(world, &luxels, of_light, keeper),
                (None, ..) => {
                    let sky = world.lit_by(Lights::sky_of(world.scene()));
                    let components = Components::Direct;
                    self.light(&sky, &luxels, components, &held, of_light, keeper)?
                }
            };
            let Some(gathered) = gathered else {
                return Ok(None);
            };
            let mut layer = self.layer(world, &atlas, &luxels, include, &gathered);
            if passes > 1 {
                keeper.keep_complete(&gathered);
            }
            drop(gathered);
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
                let name = format!("{}_directions", layers.len());
                let work = || self.directions(&pass, &atlas, &luxels, &layer);
                let found = keeper.whole(&name, work)?;
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
            let include = crate::cli::name(&layer.include);
            let pass = Pass {
                world,
                held: &held,
                goal,
                context,
                components,
                bounces: self.reflections.bounces(),
                patches: self.patches(layer, goal),
            };
            volume = keeper.whole("volume", || self.volume(&pass, grid, &include))?;
            if volume.is_none() {
                return Ok(None);
            }
        }
        let Some(masks) = self.masks(world, &atlas, &luxels, masked, goal, keeper)? else {
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
    pub(super) fn masked(&self, world: &World<'_>) -> Vec<NamedLight> {
        if self.include.contains(&Include::Masks) {
            world.lights().named(world.scene())
        } else {
            Vec::new()
        }
    }

    /// Whether light is computed by paths.
    pub(super) fn is_traced(&self) -> bool {
        self.integrator == Some(Method::Path)
    }

    /// What is done about noise.
    pub(super) fn smoothing(&self) -> Smoothing {
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
