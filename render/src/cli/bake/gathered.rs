//! What luxels see: light by the final gather or by paths, or how open they are.

use super::Bake;
use crate::cli::checkpoint::{AtLuxels, Current, Keeper};
use crate::cli::exit::Failure;
use crate::cli::footprint::{Footprint, held_back};
use crate::cli::goal::Goal;
use crate::cli::refine::{Refined, refine};
use crate::cli::stated::StatedError;
use crate::cli::steering::{Steering, first_error};
use crate::film::{Alike, Film, PixelError};
use crate::integrators::ao::AmbientOcclusion;
use crate::integrators::path::PathTracer;
use crate::lightmap::bake::{self, Luxels};
use crate::progress::Progress;
use luxel_scenes::Irradiance;
use luxel_solver::adaptive::{AdaptiveConfig, Ending};
use luxel_solver::gather::{Components, Gathered, MAX_REPLICATES};
use luxel_solver::world::World;

/// Rays of a sample of ambient occlusion, and the samples of each replicate that are begun with.
const AO_RAYS: u32 = 4;
const FIRST_AO_SAMPLES: u32 = 2;

/// Paths of each replicate that are begun with: with fewer, the rare bright ones that make the noise are seen by too few luxels to
/// tell it.
const FIRST_PATHS: u32 = 16;

impl Bake {
    /// Light; `None` when it was stopped before there was any.
    pub(super) fn light(
        &self,
        world: &World<'_>,
        luxels: &Luxels,
        components: Components,
        held: &Footprint,
        goal: &Goal,
        keeper: &Keeper<'_, '_>,
    ) -> Result<Option<AtLuxels>, Failure> {
        let context = keeper.context();
        let error = first_error(Some(goal));
        let first = self.first_patches(error);
        let bounces = self.reflections.bounces();
        let config = AdaptiveConfig {
            error,
            components,
            bounces,
            most_patches: held.most_patches(world.scene(), first, bounces, context),
            seed: context.common.seed,
        };
        let mut steering = Steering::new(context, Some(goal)).keeping(keeper);
        let from = match keeper.current() {
            Some(Current::Gather(checkpoint)) => Some(checkpoint),
            _ => None,
        };
        let Some(found) = bake::bake(world, luxels, &config, from, &mut steering)? else {
            return Ok(None);
        };
        if found.adaptive.ending == Ending::TooManyPatches {
            held_back(context);
        }
        let sum: f64 = found
            .gathered
            .iter()
            .map(|gathered| gathered.irradiance().0.element_sum())
            .sum();
        let level = sum / (3.0 * found.gathered.len() as f64);
        let bound = found.adaptive.solver_bound;
        let solver = if level > 0.0 { bound / level } else { 0.0 };
        Ok(Some(AtLuxels {
            stated: StatedError::of_gather(&found.adaptive.parts, solver),
            energy: found.adaptive.ledger.map(Into::into),
            patches: found.adaptive.patches,
            values: found.gathered,
        }))
    }

    /// Light by paths; `None` when it was stopped before there was any.
    pub(super) fn traced(
        &self,
        world: &World<'_>,
        luxels: &Luxels,
        components: Components,
        goal: &Goal,
        keeper: &Keeper<'_, '_>,
    ) -> Option<AtLuxels> {
        let context = keeper.context();
        let receivers = &luxels.lit.receivers;
        let bounces = self.reflections.bounces();
        let tracer = PathTracer::new(world, context.common.seed).with_bounces(bounces);
        let add = |film: &mut Film, paths: &[u32], progress: &dyn Progress| {
            tracer.irradiance(film, receivers, components, paths, progress);
        };
        let alike = |_| Alike::Values;
        sampled(receivers.len(), FIRST_PATHS, alike, goal, keeper, add)
    }

    /// Ambient occlusion; `None` when it was stopped before there was any.
    pub(super) fn occlusion(
        &self,
        world: &World<'_>,
        luxels: &Luxels,
        goal: &Goal,
        keeper: &Keeper<'_, '_>,
    ) -> Option<AtLuxels> {
        let context = keeper.context();
        let receivers = &luxels.lit.receivers;
        let occlusion =
            AmbientOcclusion::new(world, self.reach.config(AO_RAYS, context.common.seed));
        let add = |film: &mut Film, samples: &[u32], progress: &dyn Progress| {
            occlusion.at_receivers(film, receivers, samples, progress);
        };
        let alike = |samples| Alike::Fractions {
            rays: samples * AO_RAYS,
        };
        let (count, first) = (receivers.len(), FIRST_AO_SAMPLES);
        let found = sampled(count, first, alike, goal, keeper, add)?;
        let is_black = |gathered: &Gathered| gathered.direct.0.max_element() <= 0.0;
        if !self.reach.is_limited() && found.values.iter().all(is_black) {
            context.reporter.warning(
                "nothing is open to the outside: without --max-distance ambient occlusion is black in a closed room",
            );
        }
        Some(found)
    }
}

/// Values of independent samples at so many receivers, `first` of each replicate to begin with; `None` when it was stopped before
/// there was any. `alike` tells how noise is judged where each has so many samples.
fn sampled(
    receivers: usize,
    first: u32,
    alike: impl Fn(u32) -> Alike,
    goal: &Goal,
    keeper: &Keeper<'_, '_>,
    add: impl FnMut(&mut Film, &[u32], &dyn Progress),
) -> Option<AtLuxels> {
    let context = keeper.context();
    let mut steering = Steering::new(context, Some(goal)).keeping(keeper);
    let start = match keeper.current() {
        Some(Current::Film(refined)) if refined.is_of(receivers) => refined,
        _ => Refined::first(Film::new([receivers, 1], MAX_REPLICATES as u32), first),
    };
    let (film, error) = refine(start, Alike::Values, Some(goal), &mut steering, add)?;
    let errors = film.errors(alike(film.sample_counts().max))?;
    // A sample has a value and a noise, as direct light has.
    let value = |(value, error): (_, &PixelError)| Gathered {
        direct: Irradiance(value),
        direct_noise: Irradiance(error.total()),
        ..Gathered::default()
    };
    Some(AtLuxels {
        values: film.values().zip(&errors).map(value).collect(),
        stated: StatedError::of_samples(error.sampling, error.discretisation, 0.0),
        energy: None,
        patches: 0,
    })
}
