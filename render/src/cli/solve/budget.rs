//! How many patches and rays a wanted error takes.
//!
//! A first round with few rays tells the sampling error s and the discretisation error d. They fall as
//! s ∝ K^−0.55 with the rays K of a row (Owen-scrambled points across shadows; 0.5 for independent ones) and as
//! d ∝ n^−0.5 with the number n of patches (constant elements: first order in their side, and
//! n ∝ side^−2). Whichever part is too large for its share of the target is given what it needs, at
//! most a few times more at once, since the estimates are rough; rounds are repeated from fresh random
//! numbers, so that stopping at a low estimate does not pick out lucky ones. All decisions follow
//! from sampled values: the same seed gives the same budget.

use crate::accuracy::RelativeErrors;

/// What one solution costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Budget {
    /// About this many patches.
    pub(super) patches: usize,
    /// Rays of each row of each replicate.
    pub(super) rays: usize,
}

/// Rays of each row in the first round. Fewer leave near classes without rows.
const FIRST_RAYS: usize = 16;

/// Patches in the first round at a target of 1 %. Rounds with fewer tell little about finer meshes;
/// with more, large targets are overspent on.
const FIRST_PATCHES: f64 = 2000.0;

/// Bounds of the number of patches: what a few objects need, and what memory holds.
const PATCHES: [f64; 2] = [600.0, 200_000.0];

/// Entries of one solution, 4 bytes each (twice that while they are cast).
const MAX_ENTRIES: usize = 1 << 26;

/// The share of the target at which an estimate counts as reached: the estimate of a root mean square
/// from four replicates errs by 10 to 20 %.
pub(super) const MARGIN: f64 = 0.85;

/// The share of the target that patches may take. Rays are cheaper than patches, since each patch
/// brings a row of rays.
const DISCRETISATION: f64 = 0.55;

/// Exponents by which errors fall.
const RAYS_EXPONENT: f64 = 0.55;
const PATCHES_EXPONENT: f64 = 0.5;

/// Growth from round to round. More would overspend on a rough estimate, less repeats rounds for
/// little.
const GROWTH: [f64; 2] = [1.5, 16.0];
const PATCH_GROWTH: [f64; 2] = [1.5, 4.0];

impl Budget {
    /// The first round towards a relative error.
    pub(super) fn first(target: f64) -> Self {
        let patches = FIRST_PATCHES * 0.01 / target;
        Self {
            patches: patches.clamp(PATCHES[0], PATCHES[0] * 20.0) as usize,
            rays: FIRST_RAYS,
        }
    }

    /// The next round after one that did not suffice; `None` when nothing more can be done.
    /// `fixed` says that the mesh is given.
    pub(super) fn next(self, errors: &RelativeErrors, target: f64, fixed: bool) -> Option<Self> {
        let goal = MARGIN * target;
        let mut next = self;
        let mut discretisation = errors.discretisation;
        if !fixed && discretisation > DISCRETISATION * goal {
            let ratio = discretisation / (DISCRETISATION * goal);
            let growth = ratio.powf(1.0 / PATCHES_EXPONENT);
            let growth = growth.clamp(PATCH_GROWTH[0], PATCH_GROWTH[1]);
            next.patches = (self.patches as f64 * growth).min(PATCHES[1]) as usize;
            let grown = next.patches as f64 / self.patches as f64;
            discretisation *= grown.powf(-PATCHES_EXPONENT);
        }
        // Where patches take more than their share, the rest is still left a part.
        let taken = (discretisation / goal).min(0.8);
        let share = goal * (1.0 - taken * taken).sqrt();
        let sampling = errors.sampling.unwrap_or(0.0);
        if sampling > share || next.patches == self.patches {
            let growth = (sampling / share).powf(1.0 / RAYS_EXPONENT);
            let growth = growth.clamp(GROWTH[0], GROWTH[1]);
            next.rays = even(self.rays as f64 * growth);
        }
        next.rays = next.rays.min(MAX_ENTRIES / next.patches.max(1) / 2 * 2);
        (next.work() > self.work() && next.rays >= FIRST_RAYS).then_some(next)
    }

    /// The next round when only time counts: `growth` times the work, on what dominates.
    pub(super) fn grown(self, errors: &RelativeErrors, growth: f64, fixed: bool) -> Option<Self> {
        let sampling = errors.sampling.unwrap_or(0.0);
        let mut next = self;
        if !fixed && errors.discretisation > sampling {
            next.patches = ((self.patches as f64 * growth).min(PATCHES[1])) as usize;
        } else {
            next.rays = even(self.rays as f64 * growth);
        }
        next.rays = next.rays.min(MAX_ENTRIES / next.patches.max(1) / 2 * 2);
        (next.work() > self.work() && next.rays >= FIRST_RAYS).then_some(next)
    }

    /// Work, in rays.
    pub(super) fn work(self) -> f64 {
        self.patches as f64 * self.rays as f64
    }
}

/// The even number of rays just above.
fn even(rays: f64) -> usize {
    2 * (rays / 2.0).ceil() as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    fn errors(sampling: f64, discretisation: f64) -> RelativeErrors {
        RelativeErrors {
            solver: 0.0,
            sampling: Some(sampling),
            discretisation,
        }
    }

    #[test]
    fn what_dominates_is_given_more() {
        let start = Budget::first(0.01);
        let more_rays = start
            .next(&errors(0.05, 0.001), 0.01, false)
            .expect("can grow");
        assert_eq!(more_rays.patches, start.patches);
        assert!(more_rays.rays > 4 * start.rays);
        let more_patches = start
            .next(&errors(0.001, 0.02), 0.01, false)
            .expect("can grow");
        assert!(more_patches.patches > start.patches);
        assert_eq!(more_patches.rays, start.rays);
        let fixed = start
            .next(&errors(0.02, 0.02), 0.01, true)
            .expect("can grow");
        assert_eq!(fixed.patches, start.patches);
    }

    #[test]
    fn budgets_end() {
        let mut budget = Budget::first(1e-5);
        let mut rounds = 0;
        while let Some(next) = budget.next(&errors(0.1, 0.1), 1e-5, false) {
            assert!(next.work() > budget.work() && next.patches * next.rays <= MAX_ENTRIES);
            budget = next;
            rounds += 1;
            assert!(rounds < 40, "{budget:?}");
        }
    }
}
