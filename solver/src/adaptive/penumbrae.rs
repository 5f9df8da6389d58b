//! Which receivers get how many shadow rays.
//!
//! The noise of direct light is that of penumbrae: most receivers see every light wholly or not at all, and more rays
//! tell them nothing. With v_i n_i^(2b) the variance of the light at receiver i (from n_i rays) times that power, the
//! rays that lessen the mean of all variances most at the same cost are
//!
//!   n_i ∝ (v_i n_i^(2b))^(1/(1+2b))
//!
//! (Lagrange; see [`super::budget`]). v_i is what the shares of rays that pass let expect ([`crate::direct::Lit`]), not
//! the scatter of the replicates: rays that were chosen where replicates happen to agree would make an error that
//! the replicates do not tell. Receivers are put into classes whose numbers of rays differ by factors of two. Measured
//! at equal noise: 0.08 of the rays in a bare room, 0.4 in a furnished one with twelve lamps. Cost: O(n).
//!
//! Source: J. Neyman, "On the two different aspects of the representative method", 1934 (optimal allocation).

use crate::gather::{SHADOW_EXPONENT, Tally};
use std::collections::BTreeMap;

/// Receivers that get equally many shadow rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Class {
    /// How many receivers.
    pub(super) receivers: usize,
    /// Shadow rays of each, over all gathers, so far.
    pub(super) rays: usize,
    /// The fewest that they may have.
    pub(super) fewest: usize,
    /// What they have of the squared relative error of all receivers.
    pub(super) square: f64,
}

/// Receivers by how noisy their direct light is.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Penumbrae {
    pub(super) classes: Vec<Class>,
    /// The class of each receiver.
    of_receiver: Vec<u32>,
}

impl Penumbrae {
    /// All receivers alike, with a part of the relative error.
    pub(super) fn even(receivers: usize, rays: usize, fewest: usize, error: f64) -> Self {
        Self {
            classes: vec![Class {
                receivers,
                rays,
                fewest,
                square: error * error,
            }],
            of_receiver: vec![0; receivers],
        }
    }

    /// Receivers by the noise that is expected of them, which together make a part of the relative error.
    pub(super) fn new(tallies: &[Tally], error: f64) -> Self {
        let mut classes: BTreeMap<(u32, i32), Class> = BTreeMap::new();
        let keys: Vec<_> = tallies.iter().map(key).collect();
        let mut sum = 0.0;
        for (tally, key) in tallies.iter().zip(&keys) {
            let variance = tally.expected_direct_variance().element_sum();
            sum += variance;
            let class = classes.entry(*key).or_insert(Class {
                receivers: 0,
                rays: tally.all_shadow_rays(),
                fewest: tally.all_shadow_rays(),
                square: 0.0,
            });
            class.receivers += 1;
            class.square += variance;
        }
        if sum <= 0.0 {
            let rays = tallies.iter().map(Tally::all_shadow_rays).max();
            let rays = rays.unwrap_or(0);
            return Self::even(tallies.len(), rays, rays, error);
        }
        let position: BTreeMap<_, u32> = classes.keys().copied().zip(0..).collect();
        Self {
            of_receiver: keys.iter().map(|key| position[key]).collect(),
            classes: classes
                .into_values()
                .map(|class| Class {
                    square: class.square * error * error / sum,
                    ..class
                })
                .collect(),
        }
    }

    /// Groups of receivers (by position) with the rays that they get anew, when each class gets so many in all.
    ///
    /// # Panics
    /// When there is not one number for each class.
    pub(super) fn due(&self, rays: &[usize]) -> Vec<(usize, Vec<u32>)> {
        assert_eq!(rays.len(), self.classes.len(), "a number a class");
        let mut groups: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
        for (receiver, &class) in (0..).zip(&self.of_receiver) {
            let (before, after) = (self.classes[class as usize].rays, rays[class as usize]);
            if after > before {
                groups.entry(after).or_default().push(receiver);
            }
        }
        groups.into_iter().collect()
    }
}

/// Rays so far and the class of noise: the binary logarithm of the number of rays that is due, but for a constant.
/// Receivers without noise have a class of their own.
fn key(tally: &Tally) -> (u32, i32) {
    let variance = tally.expected_direct_variance().element_sum();
    let rays = tally.all_shadow_rays();
    let of_one = variance * (rays.max(1) as f64).powf(2.0 * SHADOW_EXPONENT);
    let class = if of_one > 0.0 {
        (of_one.log2() / (1.0 + 2.0 * SHADOW_EXPONENT)).floor() as i32
    } else {
        i32::MIN
    };
    (rays as u32, class)
}

#[cfg(test)]
mod tests {
    use super::super::budget::{Budget, Changes};
    use super::*;
    use crate::gather::ErrorParts;
    use luxel_scenes::Rgb;

    /// Shadow rays of each receiver so far.
    const RAYS: usize = 96;

    fn tally(variance: f64) -> Tally {
        Tally::with_direct_variance(Rgb::splat(variance), RAYS as u32 / 2, 2)
    }

    /// Nine of ten receivers see the light wholly; the variances of the others rise 2000-fold.
    fn room() -> Vec<Tally> {
        let variance = |i: i32| match i % 10 {
            0 => 1e-3 * 10_f64.powf(f64::from(i) / 300.0),
            _ => 0.0,
        };
        (0..1000).map(|i| tally(variance(i))).collect()
    }

    #[test]
    fn nobody_and_nothing_is_no_class() {
        for tallies in [vec![], vec![tally(0.0); 3]] {
            let penumbrae = Penumbrae::new(&tallies, 0.0);
            assert_eq!(penumbrae.classes.len(), 1);
            assert_eq!(penumbrae.classes[0].receivers, tallies.len());
            assert!(penumbrae.due(&[RAYS]).is_empty());
        }
    }

    #[test]
    fn classes_hold_all_receivers_and_all_of_the_error() {
        let penumbrae = Penumbrae::new(&room(), 0.02);
        let receivers: usize = penumbrae.classes.iter().map(|c| c.receivers).sum();
        let square: f64 = penumbrae.classes.iter().map(|c| c.square).sum();
        assert_eq!(receivers, 1000);
        // A sum of some ten terms.
        assert!((square / 4e-4 - 1.0).abs() < 1e-14, "{square}");
        // A variance of 10^3.3 times as much asks for 10^(3.3/2.4) = 24 times the rays: between four and five doublings
        // in five or six classes, and the class without noise.
        assert!((6..=7).contains(&penumbrae.classes.len()));
        assert!(penumbrae.classes.iter().all(|class| class.rays == RAYS));
    }

    #[test]
    fn rays_go_where_the_noise_is_and_cost_less_than_for_all() {
        let tallies = room();
        let parts = ErrorParts {
            direct: 0.02,
            ..ErrorParts::default()
        };
        let spent = Budget {
            patches: 1000,
            rays: 128,
            shadow_rays: RAYS,
        };
        let plan = |penumbrae: &Penumbrae| {
            spent.for_error(0.005, &parts, penumbrae, tallies.len(), Changes::Rays)
        };
        let even = plan(&Penumbrae::even(tallies.len(), RAYS, RAYS, parts.direct));
        let penumbrae = Penumbrae::new(&tallies, parts.direct);
        let planned = plan(&penumbrae);
        let due = penumbrae.due(&planned.shadow_rays);
        // Each noisy receiver once, and no other.
        let mut chosen: Vec<u32> = due.iter().flat_map(|(_, group)| group.clone()).collect();
        chosen.sort_unstable();
        assert!(chosen.iter().all(|receiver| receiver % 10 == 0));
        assert!(due.iter().all(|(rays, _)| *rays > RAYS));
        // A quarter of the error takes 4^(1/0.7) = 7.2 times the rays of all receivers; of a tenth of them, whose
        // variances differ, less than a tenth of that. The others keep theirs.
        let cost: usize = due.iter().map(|(rays, group)| rays * group.len()).sum();
        assert!(even.budget.shadow_rays > 7 * RAYS, "{even:?}");
        assert!(cost < even.budget.shadow_rays * 1000 / 10, "{cost}");
        // And they suffice, as the exponent has it.
        let square = |(&rays, class): (&usize, &Class)| {
            class.square * (class.rays as f64 / rays as f64).powf(2.0 * SHADOW_EXPONENT)
        };
        let classes = planned.shadow_rays.iter().zip(&penumbrae.classes);
        let left = classes.map(square).sum::<f64>().sqrt();
        assert!(left <= 0.005, "{left}");
    }
}
