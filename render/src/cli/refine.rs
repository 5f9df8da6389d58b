//! Adds samples to a film until its error suits.
//!
//! The noise of n samples falls as n^-1/2 or faster, so that (e/e*)² times the samples so far suffice
//! for the error e*, fewer when they go where the noise is ([`Film::where_noisy`]); no round more than
//! quadruples them, because the first estimates are rough. What patches leave does not fall: the noise
//! must fit beside it, and when it cannot the error is out of reach.

use super::goal::Goal;
use super::steering::{CONFIDENCE, Steering};
use crate::film::{Alike, Film, FilmError};
use crate::progress::Progress;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Most samples of a replicate: sequences have 2³² points, of which a sample may use several.
const MAX_SAMPLES: u32 = 1 << 24;

/// The largest growth of a round.
const MAX_GROWTH: f64 = 4.0;

/// The smallest growth of a round: less, and its overhead counts.
const MIN_GROWTH: f64 = 1.1;

/// Noise that falls by less than this factor when samples are doubled is none of theirs: it is that of
/// the solutions that they look up. (Noise of samples falls by 0.7 and less.)
const STALLED: f64 = 0.95;

/// Pieces of a round, after each of which it may be stopped: a film is valid after any sample.
const PIECES: u32 = 16;

/// A film between two pieces of its refinement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Refined<'a> {
    film: Cow<'a, Film>,
    round: Cow<'a, Round>,
}

impl Refined<'_> {
    /// Nothing exposed; each pixel is to take `first` samples of each replicate.
    pub(super) fn first(film: Film, first: u32) -> Self {
        let round = Round {
            further: film.evenly(first),
            pieces: 0,
            before: None,
        };
        Self {
            film: Cow::Owned(film),
            round: Cow::Owned(round),
        }
    }

    /// Whether it can be of so many receivers, one pixel each.
    pub(super) fn is_of(&self, receivers: usize) -> bool {
        self.film.size() == [receivers, 1] && self.round.further.len() == receivers
    }
}

/// A round of exposure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Round {
    /// Samples of each replicate, by pixel.
    further: Vec<u32>,
    /// Pieces of it that have been exposed.
    pieces: u32,
    /// Mean number of samples and noise, when samples were half as many.
    before: Option<(f64, f64)>,
}

/// Exposes a film by `add`, which adds some samples to each replicate of every pixel, until `steering`
/// is satisfied: what is due of the round in progress, then more where the noise is if pixels are `alike`
/// by neighbourhood, else evenly. Returns the film with its error; `None` when it was stopped before all pixels had a sample.
pub(super) fn refine(
    refined: Refined<'_>,
    alike: Alike,
    goal: Option<&Goal>,
    steering: &mut Steering<'_, '_>,
    mut add: impl FnMut(&mut Film, &[u32], &dyn Progress),
) -> Option<(Film, FilmError)> {
    let error = goal.and_then(|goal| goal.error).map(|error| error.0);
    let mut film = refined.film.into_owned();
    let mut round = refined.round.into_owned();
    loop {
        let cost = round.cost(&film);
        let share = steering.allow(cost as f64);
        if share > 0.0 {
            round.shorten(share);
            let cost = round.cost(&film);
            steering.start("sampling", cost as f64, cost as usize);
            expose_in_pieces(&mut film, &mut round, steering, &mut add);
        }
        let samples = film.sample_counts();
        if samples.min == 0 {
            return None;
        }
        let reached = film.relative_error(alike);
        let total = reached.total();
        if steering.judge(total) || share < 1.0 || steering.must_stop() {
            return Some((film, reached));
        }
        // Without an error to reach, time ends the work.
        let aim = error.map_or(0.5 * total, |error| error / (CONFIDENCE * CONFIDENCE));
        let room = (aim.powi(2) - reached.discretisation.powi(2))
            .max(0.0)
            .sqrt();
        let growth = (reached.sampling / room)
            .powi(2)
            .clamp(MIN_GROWTH, MAX_GROWTH);
        let hopeless = error.is_some_and(|error| reached.discretisation * CONFIDENCE > error);
        let stalled = round.before.is_some_and(|(few, noise)| {
            samples.mean >= 2.0 * few && reached.sampling > STALLED * noise
        });
        let mut further = match alike {
            Alike::Neighbours => film.where_noisy(growth),
            Alike::Values | Alike::Fractions { .. } => {
                let each = samples.max / film.replicates();
                film.evenly((f64::from(each) * (growth - 1.0)).ceil() as u32)
            }
        };
        limit(&film, &mut further);
        if film.cost(&further) == 0 || hopeless || stalled {
            return Some((film, reached));
        }
        round.further = further;
        round.pieces = 0;
        if round
            .before
            .is_none_or(|(few, _)| samples.mean >= 2.0 * few)
        {
            round.before = Some((samples.mean, reached.sampling));
        }
    }
}

/// Keeps the samples of replicates within [`MAX_SAMPLES`].
fn limit(film: &Film, round: &mut [u32]) {
    let replicates = film.replicates();
    for (further, samples) in round.iter_mut().zip(film.samples()) {
        *further = (*further).min(MAX_SAMPLES.saturating_sub(samples / replicates));
    }
}

impl Round {
    fn all_pieces(&self) -> u32 {
        let most = self.further.iter().copied().max();
        most.unwrap_or(0).min(PIECES)
    }

    /// Samples of each replicate between two of the ends of pieces, by pixel.
    fn between(&self, from: u32, to: u32) -> Vec<u32> {
        let pieces = u64::from(self.all_pieces().max(1));
        let until = |further: u32, end: u32| (u64::from(further) * u64::from(end) / pieces) as u32;
        self.further
            .iter()
            .map(|&further| until(further, to) - until(further, from))
            .collect()
    }

    /// Samples that are left of it, all replicates together.
    fn cost(&self, film: &Film) -> u64 {
        film.cost(&self.between(self.pieces, self.all_pieces()))
    }

    /// Leaves a share of a round that has not begun, but something of what it gives to a pixel.
    fn shorten(&mut self, share: f64) {
        if share < 1.0 && self.pieces == 0 {
            for further in self.further.iter_mut().filter(|further| **further > 0) {
                *further = ((f64::from(*further) * share) as u32).max(1);
            }
        }
    }
}

/// Exposes a film piece by piece until `steering` must stop.
fn expose_in_pieces(
    film: &mut Film,
    round: &mut Round,
    steering: &Steering<'_, '_>,
    add: &mut impl FnMut(&mut Film, &[u32], &dyn Progress),
) {
    for piece in round.pieces..round.all_pieces() {
        if steering.must_stop() {
            return;
        }
        add(film, &round.between(piece, piece + 1), &steering.piece());
        round.pieces = piece + 1;
        steering.keep_film(Refined {
            film: Cow::Borrowed(film),
            round: Cow::Borrowed(round),
        });
    }
}
