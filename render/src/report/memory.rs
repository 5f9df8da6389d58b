//! What a size of a family holds in memory.

use super::family::Family;
use super::operators::row_rays;
use super::solver::Solver;
use crate::film::Film;
use luxel_scenes::Scene;
use luxel_solver::adaptive::{bytes_to_gather, bytes_to_solve};
use luxel_solver::bounces::Bounces;
use luxel_solver::patches::Patches;
use luxel_solver::transport::{Columns, Dense, SparseRows};

impl Family {
    /// Memory of a size at so many receivers, in bytes. Operators are counted with what they are made from, and twice
    /// where the first of several is kept.
    pub fn bytes(self, step: u32, receivers: usize, scene: &Scene) -> usize {
        let patches = Patches::at_most(self.patches(step).unwrap_or(0));
        let matrix = Dense::bytes_for(patches);
        let pairs = patches * patches;
        let solving =
            Columns::bytes_for(patches, pairs).max(if patches <= Solver::Direct.max_patches() {
                3 * matrix
            } else {
                0
            });
        let rays = row_rays(self, patches);
        let entries = patches * rays;
        let at_receivers = Film::bytes_to_refine(receivers);
        let work = match self {
            Self::Analytic | Self::Hemicube => 2 * matrix + solving.max(matrix),
            Self::RayCast => 3 * matrix + solving.max(matrix),
            Self::RayCastRows => {
                let columns = Columns::bytes_for(patches, entries.min(pairs));
                3 * SparseRows::bytes_for(patches, entries) + columns
            }
            Self::Radiosity => bytes_to_solve(patches, Bounces::All, scene),
            Self::Gather => {
                bytes_to_solve(patches, Bounces::All, scene) + bytes_to_gather(receivers)
            }
            Self::Path => 0,
        };
        Patches::bytes_for(patches, scene) + work + at_receivers
    }
}
