//! Incident radiance at many places, to a stated error.
//!
//! The error that counts is that of E(n) over all normals, all places together ([`error_parts`]). A few rays are cast from each place; what
//! noise they leave says how many more are due, and what patches leave, whether a finer mesh is. Gather rays are kept, their sequences go on;
//! shadow rays are cast anew. A finer mesh begins anew.
//!
//! Every decision follows from sampled values, never from a clock, as in [`crate::adaptive`].

use super::estimate::error_parts;
use super::{Incident, IncidentConfig, Place, incident};
use crate::adaptive::{Adapted, Control, Stage};
use crate::bounces::Bounces;
use crate::gather::{Components, ErrorParts, Lookup, MAX_REPLICATES};
use crate::pilot::PilotError;
use crate::world::World;

/// How the noise of rays falls with their number: as of even points, n^−0.6 to n^−0.75 alone, n^−0.4 where joined.
const EXPONENT: f64 = 0.6;

/// The smallest and the largest growth of rays in a round.
const GROWTH: [f64; 2] = [1.25, 4.0];

/// Most rays of each kind and replicate at a place: where an error is out of reach no number suffices.
const MOST_RAYS: u32 = 1 << 14;

/// Share of the square of the error that is left to what patches leave. Larger, and rays must make up for it.
const MESH_SHARE: f64 = 0.6;

/// The smallest and the largest growth of a mesh.
const MESH_GROWTH: [f64; 2] = [1.5, 4.0];

/// How far below the error that is asked for rounds are planned: noise is known from a scatter.
const SAFETY: f64 = 1.1;

/// Parts in which places are gathered, so that the control hears of them.
const PARTS: usize = 50;

/// Part of the error below which it is not worth while to lessen one kind of noise.
const WORTHWHILE: f64 = 0.1;

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aim {
    /// Relative error of E(n), rms over mean.
    pub error: f64,
    /// Which light.
    pub components: Components,
    /// How often it may be reflected.
    pub bounces: Bounces,
    /// Rays of either kind and replicate that are begun with.
    pub first_rays: u32,
    /// Patches of the mesh that is begun with, and of the finest that may be used.
    pub patches: [usize; 2],
    /// Seed of all random numbers.
    pub seed: u64,
}

/// What is made of what was gathered before its error is judged.
pub type Treatment<'a, const N: usize> = &'a dyn Fn(Vec<Incident<N>>) -> Vec<Incident<N>>;

/// What was found.
pub struct Outcome<const N: usize> {
    /// What arrives at each place, after treatment.
    pub incidents: Vec<Incident<N>>,
    /// Its errors.
    pub parts: ErrorParts,
    /// Patches of the mesh that was looked up; zero where none was.
    pub patches: usize,
    /// Gather rays and shadow rays of each place.
    pub rays: [usize; 2],
}

/// Gathers at places until `control` is satisfied, or as far as it goes; `None` when that stopped before there was anything.
///
/// # Errors
/// As [`crate::adaptive::irradiance`].
///
/// # Panics
/// When reflected light alone is asked for, and no bounce.
pub fn until<const N: usize>(
    world: &World,
    places: &[Place],
    aim: &Aim,
    treatment: Treatment<'_, N>,
    control: &mut dyn Control,
) -> Result<Option<Outcome<N>>, PilotError> {
    let components = aim.components.within(aim.bounces);
    let aim = &Aim {
        components: components.expect("without a bounce there is no reflected light to ask for"),
        ..*aim
    };
    let adapted = match aim.components {
        Components::Direct => None,
        Components::All | Components::Indirect => {
            Some(Adapted::new(world, &[], aim.bounces, aim.seed)?)
        }
    };
    let solve = |patches: usize, control: &mut dyn Control| match &adapted {
        Some(adapted) => adapted.solve(patches, control).map(|lookup| (lookup, true)),
        None => Ok((None, false)),
    };
    let [mut patches, most_patches] = aim.patches;
    let (mut lookup, is_needed) = solve(patches, control)?;
    if is_needed && lookup.is_none() {
        return Ok(None);
    }
    let mut gathering = Gathering::new(world, places, aim);
    let mut rays = [aim.first_rays; 2];
    let mut outcome = None;
    loop {
        if !gathering.go_on(lookup.as_ref(), rays, control) {
            return Ok(outcome);
        }
        // What the last round made is not needed any more: many places would be held once more.
        drop(outcome.take());
        let incidents = treatment(gathering.incidents.clone());
        let parts = error_parts(&incidents);
        outcome = Some(Outcome {
            incidents,
            parts,
            patches: lookup.as_ref().map_or(0, |lookup| lookup.patches().len()),
            rays: gathering.rays.map(|rays| rays as usize * MAX_REPLICATES),
        });
        if control.suits(&parts) {
            return Ok(outcome);
        }
        // Without an error that suits more is made of what there is.
        let error = (aim.error / SAFETY).min(0.9 * parts.total());
        let finer = parts.mesh * parts.mesh / (MESH_SHARE * error * error);
        if is_needed && finer > 1.0 {
            let grown = patches as f64 * finer.clamp(MESH_GROWTH[0], MESH_GROWTH[1]);
            if grown <= most_patches as f64 && grown <= crate::patches::MAX_PATCHES as f64 {
                patches = grown as usize;
                let (solved, _) = solve(patches, control)?;
                if solved.is_none() {
                    return Ok(outcome);
                }
                lookup = solved;
                gathering = Gathering::new(world, places, aim);
                continue;
            }
        }
        let Some(next) = more_rays(gathering.rays, &parts, error) else {
            return Ok(outcome);
        };
        rays = next;
    }
}

/// Rays for an error, gather and shadow rays; `None` when no more of them help.
fn more_rays(rays: [u32; 2], parts: &ErrorParts, error: f64) -> Option<[u32; 2]> {
    let noise = parts.sampling();
    // Where patches leave too much, noise is lessened until it hardly adds to that.
    let left = (error * error - parts.mesh * parts.mesh).max(0.25 * parts.mesh * parts.mesh);
    let excess = noise / left.sqrt();
    if excess <= 1.0 {
        return None;
    }
    let growth = excess.powf(1.0 / EXPONENT).clamp(GROWTH[0], GROWTH[1]);
    let grown = |rays: u32, part: f64| {
        if part < WORTHWHILE * noise {
            rays
        } else {
            ((f64::from(rays) * growth).ceil() as u32).min(MOST_RAYS)
        }
    };
    let next = [grown(rays[0], parts.gather), grown(rays[1], parts.direct)];
    (next != rays).then_some(next)
}

/// Places with what was gathered at them.
struct Gathering<'a, const N: usize> {
    world: &'a World<'a>,
    places: &'a [Place],
    aim: &'a Aim,
    incidents: Vec<Incident<N>>,
    /// Gather and shadow rays of each replicate so far.
    rays: [u32; 2],
}

impl<'a, const N: usize> Gathering<'a, N> {
    fn new(world: &'a World<'a>, places: &'a [Place], aim: &'a Aim) -> Self {
        Self {
            world,
            places,
            aim,
            incidents: vec![Incident::default(); places.len()],
            rays: [0; 2],
        }
    }

    /// Casts rays up to so many. False when `control` stops; there is then no going on.
    fn go_on(
        &mut self,
        lookup: Option<&Lookup>,
        [rays, shadow_rays]: [u32; 2],
        control: &mut dyn Control,
    ) -> bool {
        let further = rays - self.rays[0];
        let anew = if shadow_rays > self.rays[1] {
            shadow_rays
        } else {
            0
        };
        let cost = f64::from(further + anew) * (MAX_REPLICATES * self.places.len()) as f64;
        let part = self.places.len().div_ceil(PARTS).max(1);
        let share = control.begin(Stage::Gathering, cost, self.places.len().div_ceil(part));
        if share <= 0.0 {
            return false;
        }
        let scaled = |rays: u32| (f64::from(rays) * share.min(1.0)).ceil() as u32;
        let config = IncidentConfig {
            rays: scaled(further),
            rays_before: self.rays[0],
            shadow_rays: scaled(anew),
            components: self.aim.components,
            seed: self.aim.seed,
        };
        let mut first = 0;
        for (places, incidents) in self
            .places
            .chunks(part)
            .zip(self.incidents.chunks_mut(part))
        {
            let items: Vec<u64> = (first..first + places.len() as u64).collect();
            first += places.len() as u64;
            let found = incident(self.world, lookup, places, &items, &config);
            for (incident, more) in incidents.iter_mut().zip(&found) {
                incident.join(more);
            }
            if !control.advance() {
                return false;
            }
        }
        self.rays[0] += config.rays;
        self.rays[1] = self.rays[1].max(config.shadow_rays);
        true
    }
}

/// Memory while so many places are gathered and joined, in bytes.
pub fn bytes_to_gather<const N: usize>(places: usize, are_joined: bool) -> usize {
    let own = places * (size_of::<Place>() + 2 * size_of::<Incident<N>>());
    let joining = if are_joined {
        super::joined::bytes_for::<N>(places)
    } else {
        0
    };
    own + joining
}
