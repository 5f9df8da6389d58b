//! Ray-cast rows as an operator: every ray of a patch stays the id of the patch that it met.
//!
//! E_i = (1/N) Σ_k B_{hit(i,k)}: the same estimator as `ray_cast`, in 4N bytes a row instead of 8n, so that the
//! number of patches is not bound by n². One randomisation of a row; whoever wants its error repeats
//! the whole solution with other replicates, because noise of rows is handed on by reflection and
//! is common to all patches.
//!
//! Source: T. J. V. Malley, "A Shading Method for Computer Generated Images", master's thesis,
//! University of Utah, 1988. Unbiased rows; valid for any geometry. Cost: one ray and four bytes an
//! entry.

use super::ray_cast::cast;
use crate::patches::{PatchId, Patches};
use crate::sampling::{Sequence, Stage};
use crate::transport::{Row, SparseRows};
use crate::world::World;
use rayon::prelude::*;

/// How many rays to cast.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RayCastRowsConfig {
    /// Rays of each row.
    pub rays: u32,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Which of several independent randomisations this is.
    pub replicate: u32,
}

/// Replicates of rows, far from those of `ray_cast`, so that no sequence is drawn twice.
const FIRST_REPLICATE: u64 = 1 << 16;

/// The transport between all patches (each side of a two-sided face is a patch of its own).
pub fn ray_cast_rows(world: &World, patches: &Patches, config: &RayCastRowsConfig) -> SparseRows {
    let replicate = FIRST_REPLICATE + u64::from(config.replicate);
    let met: Vec<Vec<u32>> = (0..patches.len())
        .into_par_iter()
        .map(|i| {
            let item = (replicate << 32) | i as u64;
            let sequence = Sequence::new(config.seed, Stage::FORM_FACTORS, item);
            let mut row = Vec::with_capacity(config.rays as usize);
            let patch = PatchId::new(i);
            cast(world, patches, patch, &[sequence], config.rays, |_, met| {
                row.push(met.0);
            });
            row
        })
        .collect();
    let mut entries = Vec::with_capacity(met.iter().map(Vec::len).sum());
    let rows = met
        .into_iter()
        .map(|row| {
            let first = entries.len();
            entries.extend(row);
            Row {
                first,
                end: entries.len(),
                rays: config.rays,
            }
        })
        .collect();
    SparseRows::new(entries, rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::closure;
    use crate::patches::PatchSize;
    use crate::transport::Transport;
    use luxel_scenes::generate::{Surface, furnace_box};

    /// A cube of one patch a wall: F is 0.2 between walls that touch and 0.19982 between opposite ones
    /// (J. R. Howell, "A catalog of radiation configuration factors", C-11 and C-14).
    #[test]
    fn walls_of_a_cube_have_their_form_factors() {
        let scene = furnace_box(glam::DVec3::ONE, Surface::grey(0.5, 1.0));
        let world = World::new(&scene);
        let patches = world.mesh(PatchSize::Whole).expect("six patches");
        let rows = |replicate| {
            let config = RayCastRowsConfig {
                rays: 16_384,
                seed: 1,
                replicate,
            };
            ray_cast_rows(&world, &patches, &config)
        };
        let first = rows(0);
        let factors = first.to_dense();
        for i in 0..6 {
            for j in 0..6 {
                let opposite = i != j && i / 2 == j / 2;
                let exact = match (i == j, opposite) {
                    (true, _) => 0.0,
                    (_, true) => 0.199_825,
                    _ => 0.200_044,
                };
                // Five standard errors of independent rays; even points do better.
                assert!((factors[(i, j)] - exact).abs() < 5.0 * (0.16 / 16_384_f64).sqrt());
            }
        }
        assert!(closure(&first).largest_defect < 1e-12, "the box is closed");
        assert_ne!(factors, rows(1).to_dense(), "replicates are independent");
        assert_eq!(factors, rows(0).to_dense(), "and each is always the same");
    }
}
