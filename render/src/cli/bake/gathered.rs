//! What luxels see: light by the final gather, or how open they are.

use super::Bake;
use crate::cli::Context;
use crate::cli::checkpoint::{AtLuxels, Current, Keeper};
use crate::cli::exit::Failure;
use crate::cli::footprint::{Footprint, held_back};
use crate::cli::goal::Goal;
use crate::cli::refine::{Refined, refine};
use crate::cli::stated::StatedError;
use crate::cli::steering::{Steering, first_error};
use crate::film::{Alike, Film};
use crate::integrators::ao::{AmbientOcclusion, Config};
use crate::lightmap::bake::{self, Luxels};
use crate::progress::Progress;
use luxel_scenes::Irradiance;
use luxel_solver::adaptive::{AdaptiveConfig, Ending};
use luxel_solver::gather::{Components, Gathered, MAX_REPLICATES};
use luxel_solver::world::World;

/// Rays of a sample of ambient occlusion, and the samples of each replicate that are begun with.
const AO_RAYS: u32 = 4;
const FIRST_AO_SAMPLES: u32 = 2;

impl Bake {
    /// Light; `None` when it was stopped before there was any.
    pub(super) fn light<'r>(
        &self,
        world: &World<'_>,
        luxels: &Luxels,
        components: Components,
        held: &Footprint,
        goal: &Goal,
        keeper: &Keeper<'_, 'r>,
        context: &Context<'r>,
    ) -> Result<Option<AtLuxels>, Failure> {
        let error = first_error(Some(goal));
        let first = self.first_patches(error);
        let config = AdaptiveConfig {
            error,
            components,
            most_patches: held.most_patches(world.scene(), first, context),
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

    /// Ambient occlusion; `None` when it was stopped before there was any.
    pub(super) fn occlusion<'r>(
        &self,
        world: &World<'_>,
        luxels: &Luxels,
        goal: &Goal,
        keeper: &Keeper<'_, 'r>,
        context: &Context<'r>,
    ) -> Option<AtLuxels> {
        let receivers = &luxels.lit.receivers;
        let config = Config {
            rays: AO_RAYS,
            max_distance: self.max_distance,
            falloff: self.falloff,
            seed: context.common.seed,
        };
        let occlusion = AmbientOcclusion::new(world, config);
        let add = |film: &mut Film, samples: &[u32], progress: &dyn Progress| {
            occlusion.at_receivers(film, receivers, samples, progress);
        };
        let mut steering = Steering::new(context, Some(goal)).keeping(keeper);
        let start = match keeper.current() {
            Some(Current::Film(refined)) => refined,
            _ => Refined::first(
                Film::new([receivers.len(), 1], MAX_REPLICATES as u32),
                FIRST_AO_SAMPLES,
            ),
        };
        let (film, error) = refine(start, Alike::Values, Some(goal), &mut steering, add)?;
        let rays = film.sample_counts().max * AO_RAYS;
        let errors = film.errors(Alike::Fractions { rays })?;
        // Openness has a value and a noise, as direct light has.
        let value = |(value, error): (_, &crate::film::PixelError)| Gathered {
            direct: Irradiance(value),
            direct_noise: Irradiance(error.total()),
            ..Gathered::default()
        };
        if self.max_distance.is_none() && film.values().all(|value| value.max_element() <= 0.0) {
            context.reporter.warning(
                "nothing is open to the outside: without --max-distance ambient occlusion is black in a closed room",
            );
        }
        Some(AtLuxels {
            values: film.values().zip(&errors).map(value).collect(),
            stated: StatedError::of_samples(error.sampling, error.discretisation, 0.0),
            energy: None,
            patches: 0,
        })
    }
}
