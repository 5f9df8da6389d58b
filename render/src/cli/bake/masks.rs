//! Shadow masks to a stated error.
//!
//! A mask is the light of its source alone over what that would be unoccluded ([`crate::lightmap::masks`]). The gather
//! aims at an error of the light relative to its mean; what is asked for is one of the share, root mean square over luxels. So
//! the light is gathered to an error that is as much smaller as the shares of a first gather were too noisy, until they are not.

use super::Bake;
use crate::cli::Context;
use crate::cli::checkpoint::Keeper;
use crate::cli::exit::Failure;
use crate::cli::goal::Goal;
use crate::cli::stated::StatedError;
use crate::cli::steering::{CONFIDENCE, Steering, first_error};
use crate::lightmap::atlas::Atlas;
use crate::lightmap::bake::{self, Luxels};
use crate::lightmap::manifest::Error;
use crate::lightmap::masks::{self, Mask};
use luxel_solver::adaptive::AdaptiveConfig;
use luxel_solver::bounces::Bounces;
use luxel_solver::direct::NamedLight;
use luxel_solver::gather::{Components, ErrorParts, Gathered};
use luxel_solver::sampling::hash;
use luxel_solver::world::World;

/// Gathers after which a mask is taken as it is: each halves the noise at least.
const MAX_ROUNDS: usize = 8;

/// How far below the error that would do the next gather aims: noise falls with rays as it does on the average only.
const SAFETY: f64 = 1.25;

/// What sets the random numbers of a light's mask apart from those of others.
const MASK: u64 = 0x3a5c_0000;

/// The mask of a light with its errors.
pub(super) struct Masked {
    pub(super) light: NamedLight,
    pub(super) mask: Mask,
    pub(super) stated: StatedError,
    pub(super) error: Error,
}

impl Bake {
    /// A mask for each of some lights; `None` when it was stopped before all were had.
    pub(super) fn masks(
        &self,
        world: &World<'_>,
        atlas: &Atlas,
        luxels: &Luxels,
        lights: Vec<NamedLight>,
        goal: &Goal,
        keeper: &Keeper<'_, '_>,
    ) -> Result<Option<Vec<Masked>>, Failure> {
        let context = keeper.context();
        if !lights.is_empty() && world.lights().has_unlisted_emission() {
            context.reporter.note(
                "masks: emission from textures, or of more polygons than are sources, is in no mask",
            );
        }
        let mut masked = Vec::new();
        for (index, light) in (0..).zip(lights) {
            let lit = world.lit_by(world.lights().only(&light.sources));
            let seed = hash::mix64(context.common.seed ^ hash::mix64(MASK + index));
            let work = || visible(&lit, luxels, seed, goal, context);
            let Some(visible) = keeper.whole(&format!("mask_{index}"), work)? else {
                return Ok(None);
            };
            let maps = bake::finish(world, atlas, luxels, &visible, self.smoothing());
            let [of_luxels, total] = [&maps.raw, &maps.map].map(masks::error);
            masked.push(Masked {
                light,
                mask: Mask::new(&maps.raw, &maps.map),
                stated: StatedError::of_gather(&of_shadow_rays(of_luxels), 0.0),
                error: Error {
                    luxels: of_luxels,
                    filtering: (total * total - of_luxels * of_luxels).max(0.0).sqrt(),
                    total,
                },
            });
        }
        Ok(Some(masked))
    }
}

/// The shares of a world's only light that reach luxels, to the goal.
fn visible(
    lit: &World<'_>,
    luxels: &Luxels,
    seed: u64,
    goal: &Goal,
    context: &Context<'_>,
) -> Result<Option<Vec<Gathered>>, Failure> {
    let unoccluded = masks::unoccluded(lit, &luxels.lit.receivers);
    let mut aim = first_error(Some(goal));
    let mut best: Option<(f64, Vec<Gathered>)> = None;
    for _ in 0..MAX_ROUNDS {
        let config = AdaptiveConfig {
            error: aim,
            components: Components::Direct,
            bounces: Bounces::AtMost(0),
            most_patches: usize::MAX,
            seed,
        };
        let of_light = goal.with_error(aim);
        let mut steering = Steering::new(context, Some(&of_light));
        let Some(found) = bake::bake(lit, luxels, &config, None, &mut steering)? else {
            break;
        };
        let visible = masks::visible(&found.gathered, &unoccluded);
        let reached = rms(&visible);
        let of_the_light = found.adaptive.parts.total();
        if best.as_ref().is_none_or(|(best, _)| reached < *best) {
            best = Some((reached, visible));
        }
        let is_over =
            goal.time_left().is_some_and(|left| left.is_zero()) || context.interrupt.is_set();
        let Some(wanted) = goal.error.filter(|_| !is_over) else {
            break;
        };
        if reached * CONFIDENCE <= wanted.0 {
            break;
        }
        // Smaller than it was in any case: the estimate itself is noisy.
        aim = (of_the_light * wanted.0 / (SAFETY * reached)).min(aim / SAFETY);
    }
    Ok(best.map(|(_, visible)| visible))
}

/// An error that shadow rays make.
fn of_shadow_rays(direct: f64) -> ErrorParts {
    ErrorParts {
        direct,
        ..ErrorParts::default()
    }
}

/// Root of the mean square of the errors.
fn rms(visible: &[Gathered]) -> f64 {
    let squares: f64 = visible.iter().map(|g| g.direct_noise.0.x.powi(2)).sum();
    (squares / visible.len().max(1) as f64).sqrt()
}
