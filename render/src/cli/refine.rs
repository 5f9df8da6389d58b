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

/// Exposes `film` by `add`, which adds some samples to each replicate of every pixel, until `steering`
/// is satisfied; `first` samples in the first round, then more where the noise is if pixels are `alike`
/// by neighbourhood, else evenly. `None` when it was stopped before there was any sample.
pub(super) fn refine(
    film: &mut Film,
    first: u32,
    alike: Alike,
    goal: Option<&Goal>,
    steering: &mut Steering<'_, '_>,
    mut add: impl FnMut(&mut Film, &[u32], &dyn Progress),
) -> Option<FilmError> {
    let error = goal.and_then(|goal| goal.error).map(|error| error.0);
    let mut round = film.evenly(first);
    let mut before: Option<(f64, f64)> = None;
    loop {
        let cost = film.cost(&round);
        let share = steering.allow(cost as f64);
        if share > 0.0 {
            shorten(&mut round, share);
            let cost = film.cost(&round);
            steering.start("sampling", cost as f64, cost as usize);
            expose_in_pieces(film, &round, steering, &mut add);
        }
        let samples = film.sample_counts();
        if samples.min == 0 {
            return None;
        }
        let reached = film.relative_error(alike);
        let total = reached.total();
        if steering.judge(total) || share < 1.0 || steering.must_stop() {
            return Some(reached);
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
        let stalled = before.is_some_and(|(few, noise)| {
            samples.mean >= 2.0 * few && reached.sampling > STALLED * noise
        });
        round = match alike {
            Alike::Neighbours => film.where_noisy(growth),
            Alike::Values | Alike::Fractions { .. } => {
                let each = samples.max / film.replicates();
                film.evenly((f64::from(each) * (growth - 1.0)).ceil() as u32)
            }
        };
        limit(film, &mut round);
        if film.cost(&round) == 0 || hopeless || stalled {
            return Some(reached);
        }
        if before.is_none_or(|(few, _)| samples.mean >= 2.0 * few) {
            before = Some((samples.mean, reached.sampling));
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

/// Leaves a share of a round, but something of what it gives to a pixel.
fn shorten(round: &mut [u32], share: f64) {
    if share < 1.0 {
        for further in round.iter_mut().filter(|further| **further > 0) {
            *further = ((f64::from(*further) * share) as u32).max(1);
        }
    }
}

/// Exposes a film piece by piece until `steering` must stop.
fn expose_in_pieces(
    film: &mut Film,
    round: &[u32],
    steering: &Steering<'_, '_>,
    add: &mut impl FnMut(&mut Film, &[u32], &dyn Progress),
) {
    let pieces = round.iter().copied().max().unwrap_or(0).min(PIECES);
    for piece in 0..pieces {
        if steering.must_stop() {
            return;
        }
        let until = |further: u32, piece: u32| {
            (u64::from(further) * u64::from(piece) / u64::from(pieces)) as u32
        };
        let part: Vec<u32> = round
            .iter()
            .map(|&further| until(further, piece + 1) - until(further, piece))
            .collect();
        add(film, &part, &steering.piece());
    }
}
