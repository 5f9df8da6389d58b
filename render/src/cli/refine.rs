//! Adds samples to a film until its error suits.
//!
//! The noise of n samples falls as n^-1/2 or faster, so that (e/e*)² times the samples so far suffice
//! for the error e*; no round more than quadruples them, because the first estimates are rough. What
//! patches leave does not fall: the noise must fit beside it, and when it cannot the error is out of
//! reach.

use super::goal::Goal;
use super::steering::{CONFIDENCE, Steering};
use crate::film::{Film, FilmError};
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

/// Exposes `film` by `add`, which adds some samples to every replicate, until `steering` is
/// satisfied; `first` samples in the first round. `None` when it was stopped
/// before there was any sample.
pub(super) fn refine(
    film: &mut Film,
    first: u32,
    goal: Option<&Goal>,
    steering: &mut Steering<'_, '_>,
    mut add: impl FnMut(&mut Film, u32, &dyn Progress),
) -> Option<FilmError> {
    let receivers = film.size()[0] * film.size()[1];
    let error = goal.and_then(|goal| goal.error).map(|error| error.0);
    let mut wanted = first;
    let mut before: Option<(u32, f64)> = None;
    loop {
        let round = wanted - film.samples();
        let cost = |samples: u32| f64::from(samples) * receivers as f64;
        let share = steering.allow(cost(round));
        let allowed = ((f64::from(round) * share) as u32).max(1);
        if share > 0.0 {
            let piece = allowed.div_ceil(PIECES);
            steering.start("sampling", cost(allowed), receivers * allowed as usize);
            let end = film.samples() + allowed;
            while film.samples() < end && !steering.must_stop() {
                let samples = piece.min(end - film.samples());
                let progress = steering.per_receiver(samples);
                add(film, samples, &progress);
            }
        }
        if film.samples() == 0 {
            return None;
        }
        let reached = film.relative_error();
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
        let next = (f64::from(film.samples()) * growth)
            .ceil()
            .min(f64::from(MAX_SAMPLES)) as u32;
        let hopeless = error.is_some_and(|error| reached.discretisation * CONFIDENCE > error);
        let stalled = before.is_some_and(|(samples, noise)| {
            film.samples() >= 2 * samples && reached.sampling > STALLED * noise
        });
        if next <= film.samples() || hopeless || stalled {
            return Some(reached);
        }
        before = Some((film.samples(), reached.sampling));
        wanted = next;
    }
}
