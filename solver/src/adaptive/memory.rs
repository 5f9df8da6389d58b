//! What adaptive work holds at its peak, known before it begins.
//!
//! Rays come and go in batches: memory follows the patches that are solved and the receivers that are gathered,
//! and not the number of their rays.

use super::budget::{Budget, JOINED_FROM, ROW_RAYS};
use super::{SAFETY, WORTHWHILE};
use crate::bounces::Bounces;
use crate::field::Cells;
use crate::gather::{Gathered, JOINED_COLUMNS, Lookup, MAX_REPLICATES, Tally, orders};
use crate::patches::{PatchId, Patches};
use crate::radiosity::{self, RadiositySolution};
use crate::world::Receiver;
use luxel_scenes::Scene;

/// Memory while a mesh of about so many patches is solved, and what one of a quarter of them would show, in bytes: both meshes, all
/// solutions, and the work on the last one.
pub fn bytes_to_solve(patches: usize, bounces: Bounces, scene: &Scene) -> usize {
    let fine = Patches::at_most(patches);
    let coarse = fine / 4;
    let has_parents = bounces == Bounces::All;
    let solutions = |patches| {
        let own = RadiositySolution::bytes_for(patches, has_parents);
        MAX_REPLICATES * (own + RadiositySolution::bytes_for_orders(patches, orders(bounces)))
    };
    let of_coarse = if has_parents {
        fine * size_of::<(PatchId, f32)>()
    } else {
        solutions(coarse)
    };
    Patches::bytes_for(fine, scene)
        + Patches::bytes_for(coarse, scene)
        + solutions(fine)
        + of_coarse
        + radiosity::bytes_to_solve(fine, ROW_RAYS, has_parents)
}

/// As [`bytes_to_solve`], while coarser solutions are kept that the new ones take the place of: at least
/// so much finer as is worth a new mesh.
pub fn bytes_to_refine(patches: usize, bounces: Bounces, scene: &Scene) -> usize {
    let kept = (Patches::at_most(patches) as f64 / WORTHWHILE) as usize;
    bytes_to_solve(patches, bounces, scene)
        + Lookup::bytes_for(kept, MAX_REPLICATES, bounces, scene)
}

/// Memory while receivers are gathered, in bytes, the receivers themselves included: what was gathered, what is made of
/// it, and the cells in which they are joined.
pub fn bytes_to_gather(receivers: usize) -> usize {
    let joined = if receivers >= JOINED_FROM {
        Cells::bytes_for(receivers, JOINED_COLUMNS)
    } else {
        0
    };
    receivers * (size_of::<Receiver>() + 2 * size_of::<Tally>() + size_of::<Gathered>()) + joined
}

/// Patches of the first mesh for a relative error.
pub fn first_patches(error: f64) -> usize {
    Budget::pilot(error / SAFETY).patches
}
