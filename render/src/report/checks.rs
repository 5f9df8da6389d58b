//! What physics asks of a solution: closure, reciprocity, energy.

use super::operators::Operator;
use luxel_scenes::{Flux, Rgb};
use luxel_solver::form_factors::{closure, reciprocity_defect_of_largest};
use luxel_solver::patches::Patches;
use luxel_solver::solvers::Ledger;
use luxel_solver::world::World;
use serde::Serialize;

/// Closure, reciprocity and energy of a solution.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Check {
    /// Patches.
    pub patches: usize,
    /// Of the form factors; `None` where the method keeps them to itself.
    pub factors: Option<FactorCheck>,
    /// Where the flux goes.
    pub energy: Energy,
}

/// Closure and reciprocity of form factors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FactorCheck {
    /// Mean of the row sums; 1 in a closed scene.
    pub mean_row_sum: f64,
    /// max_i |Σ_j F_ij − 1|, which includes what escapes from an open scene.
    pub closure_defect: f64,
    /// max_i (Σ_j F_ij − 1), an error in every scene.
    pub closure_excess: f64,
    /// max |A_i F_ij − A_j F_ji| over the largest exchange; `None` where pairs are not stored.
    pub reciprocity_defect: Option<f64>,
}

/// The energy ledger in W, each channel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Energy {
    /// Emitted by surfaces.
    pub emitted: [f64; 3],
    /// Delivered by lights that are not patches, or computed apart.
    pub direct: [f64; 3],
    /// Absorbed.
    pub absorbed: [f64; 3],
    /// Left the scene.
    pub escaped: [f64; 3],
    /// Made or lost by form factors that are not reciprocal.
    pub defect: [f64; 3],
    /// Left by the iteration.
    pub residual: [f64; 3],
    /// (in − out) / in of the worst channel: rounding.
    pub imbalance: f64,
}

impl Energy {
    pub(super) fn of(ledgers: &[Ledger]) -> Self {
        let share = 1.0 / ledgers.len().max(1) as f64;
        let mean = |part: fn(&Ledger) -> Flux| {
            (ledgers.iter().map(|ledger| part(ledger).0).sum::<Rgb>() * share).to_array()
        };
        Self {
            emitted: mean(|ledger| ledger.emitted),
            direct: mean(|ledger| ledger.direct),
            absorbed: mean(|ledger| ledger.absorbed),
            escaped: mean(|ledger| ledger.escaped),
            defect: mean(|ledger| ledger.defect),
            residual: mean(|ledger| ledger.residual),
            imbalance: ledgers
                .iter()
                .map(|ledger| ledger.imbalance().abs().max_element())
                .fold(0.0, f64::max),
        }
    }
}

/// Areas in m².
pub(super) fn areas(world: &World<'_>, patches: &Patches) -> Vec<f64> {
    let frame = world.surfaces().geometry().frame();
    let area = |&area| frame.area_to_world(area);
    patches.areas().iter().map(area).collect()
}

/// What can be told of an operator and of its solutions.
pub(super) fn check(
    world: &World<'_>,
    patches: &Patches,
    operator: &Operator,
    ledgers: &[Ledger],
) -> Check {
    let closure = closure(operator.transport());
    let sum: f64 = closure.row_sums.iter().sum();
    let reciprocity_defect = match operator {
        Operator::Dense(dense) => {
            let areas = areas(world, patches);
            Some(reciprocity_defect_of_largest(dense, &areas))
        }
        Operator::Rows(_) => None,
    };
    Check {
        patches: patches.len(),
        factors: Some(FactorCheck {
            mean_row_sum: sum / patches.len().max(1) as f64,
            closure_defect: closure.largest_defect,
            closure_excess: closure.largest_excess,
            reciprocity_defect,
        }),
        energy: Energy::of(ledgers),
    }
}
