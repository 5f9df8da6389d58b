//! How much to spend on what, so that the error asked for costs least.
//!
//! The squared error is a sum of parts that each fall with their own budget,
//!
//!   e² = Σ_k e_k² (x_k / x'_k)^(2 b_k),   cost = Σ_k c_k x'_k,
//!
//! where e_k was measured at the budget x_k. The cheapest x'_k for a given e satisfy
//! Σ 2 b_k e_k²(x'_k) = λ c_k x'_k with one λ for all (Lagrange), the sum over the parts that the same
//! budget lessens: each part's squared error times its exponent is in proportion to what it costs. x'
//! and λ are found by bisection. Cost: nothing.
//!
//! Source: the allocation rule of stratified sampling (J. Neyman, "On the two different aspects of
//! the representative method", 1934) with measured exponents in place of 1/2.

use super::penumbrae::Penumbrae;
use crate::gather::{ErrorParts, MAX_REPLICATES, SHADOW_EXPONENT};
use serde::{Deserialize, Serialize};

/// What is spent. Rays are over all replicates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Budget {
    /// Patches of the mesh that is looked up.
    pub patches: usize,
    /// Gather rays of a receiver.
    pub rays: usize,
    /// Shadow rays of a receiver, the mean of all receivers.
    pub shadow_rays: usize,
}

/// A budget with the shadow rays of each class of receivers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Planned {
    pub(super) budget: Budget,
    pub(super) shadow_rays: Vec<usize>,
}

/// What of a budget may change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Changes {
    /// Mesh and rays.
    All,
    /// Rays: those that were gathered in the mesh stay.
    Rays,
}

/// Rays of a patch's row in each solution. 64 measured no better per ray; 16 biases the near
/// classes, whose rows are then often empty.
pub const ROW_RAYS: usize = 32;

/// Exponents with which errors fall, measured on the reference scenes: the noise of the solution and the
/// stated error of the mesh with the number of patches (0.5; 0.7–1.1, where the error itself falls with
/// 0.6), and that of gather rays (0.62–0.73). Too large, and a second round adds what is missing; too small, and the
/// first spends too much.
const SOLUTION_EXPONENT: f64 = 0.5;
const MESH_EXPONENT: f64 = 0.9;
const RAY_EXPONENT: f64 = 0.7;

/// Times in units of a gather ray with what follows it, measured on the reference scenes: a row's
/// ray with its share of direct light (0.7–1.2), and a shadow ray (0.3–0.5). Only their rough ratio
/// matters: a factor of two costs a few percent.
const ROW_RAY_COST: f64 = 0.9;
const SHADOW_RAY_COST: f64 = 0.4;

/// Fewest of each, below which exponents do not hold, and most.
const PATCHES: [usize; 2] = [300, 400_000];
const RAYS: [usize; 2] = [64, 1 << 22];
const SHADOW_RAYS: [usize; 2] = [48, 1 << 20];

/// Receivers from which their gather rays are joined. A thousand on the reference scenes took 0.85 of the time, but
/// the bias of so few is stated less well than noise.
pub(super) const JOINED_FROM: usize = 4096;

/// Fewest gather rays of a receiver that is joined with others.
const JOINED_RAYS: usize = 8;

/// Rays of all receivers together that there are at least, and how many of them one receiver gets at
/// most. What no ray has met, a small window, adds nothing to the scatter from which the error is
/// judged: few rays of few receivers would agree on being wrong.
const ALL_RAYS: usize = 1 << 16;
const FEWEST_OF_ONE: usize = 1 << 12;

/// Patches with which most rooms are within 1 % before their rays are counted, and how their number
/// rises as the error falls.
const PATCHES_AT_PERCENT: f64 = 1500.0;
const PATCHES_EXPONENT: f64 = 1.2;

impl Budget {
    /// The budget of a pilot for a relative error: the mesh is meant to be kept, the rays are few.
    pub fn pilot(error: f64) -> Self {
        let patches = PATCHES_AT_PERCENT * (0.01 / error).powf(PATCHES_EXPONENT);
        Self {
            patches: (patches as usize).clamp(PATCHES[0], PATCHES[1] / 4),
            rays: 2 * RAYS[0],
            shadow_rays: 2 * SHADOW_RAYS[0],
        }
    }

    /// A mesh and so many gather rays, with three shadow rays to four gather rays up to 1024, beyond
    /// which the noise of direct light is most often small, and a share of a large budget. A `sky`
    /// gets as many rays as the gather.
    pub fn of_rays(patches: usize, rays: usize, sky: bool) -> Self {
        const ENOUGH: usize = 1024;
        let shadow_rays = if sky {
            rays
        } else {
            (rays * 3 / 4).min(ENOUGH.max(rays / 16))
        };
        Self {
            patches,
            rays: rays.next_multiple_of(MAX_REPLICATES),
            shadow_rays: shadow_rays.next_multiple_of(MAX_REPLICATES),
        }
    }

    /// The cheapest budget for a relative error, from the errors that this one had at the receivers of `penumbrae`.
    /// There are `count` receivers of which those are a sample.
    pub(super) fn for_error(
        self,
        error: f64,
        parts: &ErrorParts,
        penumbrae: &Penumbrae,
        count: usize,
        changes: Changes,
    ) -> Planned {
        let fewest = fewest_rays(count);
        let patches = match changes {
            Changes::All => PATCHES,
            Changes::Rays => [self.patches; 2],
        };
        let least_rays = least_rays(count);
        let mut items = vec![
            Item {
                spent: self.patches as f64,
                parts: vec![
                    (parts.solution.powi(2), SOLUTION_EXPONENT),
                    (parts.mesh.powi(2), MESH_EXPONENT),
                ],
                cost: patch_cost(),
                limits: patches,
            },
            Item {
                spent: self.rays as f64,
                parts: vec![(parts.gather.powi(2), RAY_EXPONENT)],
                cost: count as f64,
                limits: [fewest.max(least_rays), RAYS[1]],
            },
        ];
        let sampled: usize = penumbrae.classes.iter().map(|class| class.receivers).sum();
        items.extend(penumbrae.classes.iter().map(|class| {
            let share = class.receivers as f64 / sampled as f64;
            Item {
                spent: class.rays.max(1) as f64,
                parts: vec![(class.square, SHADOW_EXPONENT)],
                cost: count as f64 * share * SHADOW_RAY_COST,
                limits: [class.fewest.min(SHADOW_RAYS[1]), SHADOW_RAYS[1]],
            }
        }));
        let wanted = error * error;
        // Bisection over the price of squared error, in logarithms.
        let (mut low, mut high) = (-40.0_f64, 40.0_f64);
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            let squares: f64 = items
                .iter()
                .map(|item| item.square_at(item.at_price(middle.exp())))
                .sum();
            if squares > wanted {
                high = middle;
            } else {
                low = middle;
            }
        }
        let spending: Vec<f64> = items
            .iter()
            .map(|item| item.at_price(low.exp()).ceil())
            .collect();
        let shadow_rays: Vec<usize> = spending[2..].iter().map(|&rays| even(rays)).collect();
        let all_shadow_rays: usize = penumbrae
            .classes
            .iter()
            .zip(&shadow_rays)
            .map(|(class, rays)| class.receivers * rays)
            .sum();
        Planned {
            budget: Self {
                patches: spending[0] as usize,
                rays: even(spending[1]),
                shadow_rays: all_shadow_rays.div_ceil(sampled.max(1)),
            },
            shadow_rays,
        }
    }
}

/// Time of so many gather and shadow rays, in units of gather rays.
pub(super) fn gather_cost(rays: usize, shadow_rays: usize) -> f64 {
    rays as f64 + SHADOW_RAY_COST * shadow_rays as f64
}

/// Time of solving with so many patches, in units of gather rays, what larger patches would show included.
pub(super) fn solve_cost(patches: usize) -> f64 {
    patches as f64 * patch_cost()
}

/// Time of a patch in all its solutions; what larger ones would show takes no rays, but a quarter more in sweeps.
fn patch_cost() -> f64 {
    1.25 * (MAX_REPLICATES * ROW_RAYS) as f64 * ROW_RAY_COST
}

/// Fewest gather rays of a receiver, where the number of all does not ask for more: joined ones need few.
pub(super) fn least_rays(receivers: usize) -> usize {
    if receivers >= JOINED_FROM {
        JOINED_RAYS
    } else {
        RAYS[0]
    }
}

/// Fewest shadow rays of each of so many receivers that a plan may have.
pub(super) fn fewest_shadow_rays(receivers: usize) -> usize {
    fewest_rays(receivers).max(SHADOW_RAYS[0])
}

/// Fewest rays of each of so many receivers.
pub fn fewest_rays(receivers: usize) -> usize {
    (ALL_RAYS / receivers.max(1)).min(FEWEST_OF_ONE)
}

/// As many for each replicate.
pub(super) fn even(rays: f64) -> usize {
    (rays as usize).next_multiple_of(MAX_REPLICATES)
}

/// What can be spent on, with the parts of the error that it lessens.
struct Item {
    spent: f64,
    /// Squares and exponents.
    parts: Vec<(f64, f64)>,
    cost: f64,
    limits: [usize; 2],
}

impl Item {
    /// The square of a part with its exponent, for a budget.
    fn squares(&self, budget: f64) -> impl Iterator<Item = (f64, f64)> {
        let ratio = self.spent / budget;
        let at = move |&(square, exponent): &(f64, f64)| {
            // What has no error has none at a budget of nothing, too.
            let fall = if square > 0.0 {
                ratio.powf(2.0 * exponent)
            } else {
                0.0
            };
            (square * fall, exponent)
        };
        self.parts.iter().map(at)
    }

    fn square_at(&self, budget: f64) -> f64 {
        self.squares(budget).map(|(square, _)| square).sum()
    }

    /// What to spend when a unit of cost must buy `price` of squared error. What the next unit buys
    /// falls as more is spent: bisection, in logarithms.
    fn at_price(&self, price: f64) -> f64 {
        let buys = |budget: f64| -> f64 {
            let squares = self.squares(budget);
            squares.map(|(square, b)| 2.0 * b * square).sum::<f64>() / budget
        };
        let (mut low, mut high) = (self.limits[0] as f64, self.limits[1] as f64);
        for _ in 0..50 {
            let middle = (low * high).sqrt();
            if buys(middle) > price * self.cost {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPENT: Budget = Budget {
        patches: 1500,
        rays: 128,
        shadow_rays: 96,
    };

    const PARTS: ErrorParts = ErrorParts {
        direct: 0.004,
        gather: 0.03,
        solution: 0.003,
        mesh: 0.004,
        spread: 0.0,
    };

    fn plan(error: f64, parts: &ErrorParts, receivers: usize, changes: Changes) -> Budget {
        let fewest = fewest_shadow_rays(receivers);
        let even = Penumbrae::even(receivers, SPENT.shadow_rays, fewest, parts.direct);
        SPENT
            .for_error(error, parts, &even, receivers, changes)
            .budget
    }

    fn predicted(budget: Budget) -> f64 {
        let fall = |from: usize, to: usize, b: f64| (from as f64 / to as f64).powf(2.0 * b);
        (PARTS.solution.powi(2) * fall(SPENT.patches, budget.patches, SOLUTION_EXPONENT)
            + PARTS.mesh.powi(2) * fall(SPENT.patches, budget.patches, MESH_EXPONENT)
            + PARTS.gather.powi(2) * fall(SPENT.rays, budget.rays, RAY_EXPONENT)
            + PARTS.direct.powi(2) * fall(SPENT.shadow_rays, budget.shadow_rays, SHADOW_EXPONENT))
        .sqrt()
    }

    #[test]
    fn the_budget_meets_the_error_and_no_cheaper_one_does() {
        for error in [0.02, 0.01, 0.005, 0.001] {
            let best = plan(error, &PARTS, 1000, Changes::All);
            // Rounding up to whole rays gains less than a hundredth.
            assert!(
                (0.99 * error..=error).contains(&predicted(best)),
                "{error}: {best:?} gives {}",
                predicted(best)
            );
            // What is taken from one part must be given to another: shift a tenth of the rays.
            let cost =
                |b: &Budget| solve_cost(b.patches) + 1000.0 * gather_cost(b.rays, b.shadow_rays);
            for (patches, rays) in [(0.9, None), (1.1, None)].map(|(p, r)| (p, r.unwrap_or(p))) {
                let other = Budget {
                    patches: (best.patches as f64 / patches) as usize,
                    rays: (best.rays as f64 * rays) as usize,
                    ..best
                };
                let at_same_error = predicted(other) / predicted(best);
                // Cost rises as error^-(1/b), b about 0.7.
                let worth = cost(&other) / cost(&best) * at_same_error.powf(1.0 / 0.7);
                assert!(worth > 0.99, "{error}: {other:?} is worth {worth}");
            }
        }
    }

    #[test]
    fn a_mesh_that_is_kept_leaves_the_rest_to_rays() {
        let kept = plan(0.01, &PARTS, 1000, Changes::Rays);
        assert_eq!(kept.patches, SPENT.patches);
        assert!((0.0099..=0.01).contains(&predicted(kept)), "{kept:?}");
        let free = plan(0.01, &PARTS, 1000, Changes::All);
        assert!(kept.rays > free.rays && free.patches > kept.patches);
    }

    /// Of reflected light alone no shadow rays are cast, and none are planned; the others do not wait for them.
    #[test]
    fn what_is_not_cast_is_not_planned() {
        let parts = ErrorParts {
            direct: 0.0,
            ..PARTS
        };
        let none = Penumbrae::even(1000, 0, 0, 0.0);
        let planned = SPENT.for_error(0.01, &parts, &none, 1000, Changes::Rays);
        assert_eq!(planned.shadow_rays, [0]);
        let usual = plan(0.01, &parts, 1000, Changes::Rays);
        assert_eq!(planned.budget.rays, usual.rays);
        assert!(usual.rays > 2 * SPENT.rays);
    }

    #[test]
    fn parts_without_error_cost_the_least_possible() {
        let none = ErrorParts::default();
        for (receivers, rays) in [(4000, RAYS[0]), (10_000, JOINED_RAYS)] {
            let least = plan(0.01, &none, receivers, Changes::All);
            assert_eq!(
                (least.patches, least.rays, least.shadow_rays),
                (PATCHES[0], rays, SHADOW_RAYS[0])
            );
        }
        // What cannot be reached is approached as far as it goes.
        let most = plan(1e-9, &PARTS, 10, Changes::All);
        assert_eq!(most.rays, RAYS[1]);
    }
}
