//! What gather rays look up at their hits: the irradiance of patches.
//!
//! Several independent solutions stand side by side, so that one hit sees all of them: their mean is
//! the result, and their scatter over the *same* hits is the noise of the solution, free of the
//! gather's own. What coarser patches show may be looked up at the same hits, either those of a second mesh with solutions
//! of its own or the means over the patches of which each would be a part, from the same rows;
//! the difference of the two tells what finite patches leave out, again free of the gather's noise, and with the same rows
//! of most of the noise of the solutions, too.
//! Single precision: 6·10⁻⁸ relative, far below what rays can resolve. Cost: 12 bytes a class and
//! solution; the solutions of a class lie next to each other in memory. Where reflections are counted
//! ([`Bounces`]) each link of a chain looks up light that was reflected once less: as many times the memory.

use super::near_chain::MAX_LINKS;
use crate::bounces::Bounces;
use crate::geometry::TriangleId;
use crate::patches::{PatchId, Patches, Side};
use crate::radiosity::{Class, RadiositySolution, unknown};
use crate::solvers::Ledger;
use glam::{DVec3, Vec3};
use luxel_scenes::{Irradiance, Rgb, Scene};
use std::ops::Range;

/// Largest number of independent solutions (and of independent gathers).
pub const MAX_REPLICATES: usize = 4;

/// One value for each solution.
pub(crate) type PerSolution = [Rgb; MAX_REPLICATES];

/// Meshes with their solutions.
pub struct Lookup {
    fine: Table,
    coarse: Option<Coarse>,
    solutions: usize,
    /// Of the light that a gather from here finds: once more than of what is looked up.
    bounces: Bounces,
    solver_bound: f64,
    ledger: Ledger,
}

/// What coarser patches show.
enum Coarse {
    /// Those of another mesh.
    Mesh(Table),
    /// Those that the patches of the mesh would be parts of.
    Parents {
        /// As [`Table::irradiance`], of a whole series.
        irradiance: Vec<Vec3>,
        /// By patch, in units.
        sizes: Vec<f32>,
    },
}

/// Which of the solutions count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solutions {
    /// The mean of all.
    All,
    /// One alone, by its position.
    One(usize),
}

impl Lookup {
    /// The patches of a mesh with independent solutions on it, all of the same [`RadiositySolution::bounces`]: a gather finds
    /// light that was reflected once more.
    ///
    /// # Panics
    /// When there is no solution or there are more than [`MAX_REPLICATES`], or they are of different bounces.
    pub fn new(patches: Patches, solutions: &[RadiositySolution]) -> Self {
        assert!(
            (1..=MAX_REPLICATES).contains(&solutions.len()),
            "one to {MAX_REPLICATES} solutions"
        );
        let bounces = bounces_of(solutions);
        let ledgers: Vec<Ledger> = solutions.iter().map(|solution| solution.ledger).collect();
        Self {
            ledger: Ledger::mean(&ledgers),
            fine: Table::new(patches, solutions),
            coarse: None,
            solutions: solutions.len(),
            bounces: match bounces {
                Bounces::All => Bounces::All,
                Bounces::AtMost(most) => Bounces::AtMost(most + 1),
            },
            solver_bound: solutions
                .iter()
                .map(|solution| solution.error_bound.max_element())
                .fold(0.0, f64::max),
        }
    }

    /// Adds a coarser mesh of the same scene, for the error that patches make.
    ///
    /// # Panics
    /// When it does not have as many solutions, of the same bounces.
    #[must_use]
    pub fn with_coarse(mut self, patches: Patches, solutions: &[RadiositySolution]) -> Self {
        assert_eq!(solutions.len(), self.solutions, "as many solutions as fine");
        let reflected = Some(bounces_of(solutions));
        assert_eq!(
            reflected,
            self.bounces.before_reflection(),
            "the same light"
        );
        self.coarse = Some(Coarse::Mesh(Table::new(patches, solutions)));
        self
    }

    /// Adds what larger patches show, of `sizes` in units by patch of the mesh, for the error that patches make.
    ///
    /// # Panics
    /// When the solutions do not know ([`crate::radiosity::solve_beside`]), or there is not one size a patch.
    #[must_use]
    pub(crate) fn with_parents(mut self, sizes: Vec<f32>, solutions: &[RadiositySolution]) -> Self {
        let patches = self.fine.patches.len();
        assert_eq!(sizes.len(), patches, "one size a patch");
        let of = |solution: &RadiositySolution, unknown: usize| solution.coarse()[unknown];
        self.coarse = Some(Coarse::Parents {
            irradiance: side_by_side(patches, solutions, of),
            sizes,
        });
        self
    }

    /// Memory of so many solutions on so many patches, and of what coarser ones show, in bytes, for a gather of such bounces.
    pub fn bytes_for(patches: usize, solutions: usize, bounces: Bounces, scene: &Scene) -> usize {
        let table = |patches: usize| {
            Patches::bytes_for(patches, scene)
                + patches * Class::COUNT * solutions * orders(bounces) * size_of::<Vec3>()
        };
        let own = Class::COUNT * solutions * size_of::<Vec3>() + size_of::<f32>();
        table(patches)
            + match bounces {
                Bounces::All => patches * own,
                Bounces::AtMost(_) => table(patches / 4),
            }
    }

    /// The mesh that is looked up.
    pub fn patches(&self) -> &Patches {
        &self.fine.patches
    }

    /// Bound on the error that the iteration left in any solution of the mesh, in W/m²: of what is
    /// looked up, and of what is gathered from it.
    pub fn solver_bound(&self) -> f64 {
        self.solver_bound
    }

    /// Where the flux goes, the mean over the solutions of the mesh.
    pub fn ledger(&self) -> Ledger {
        self.ledger
    }

    /// Number of independent solutions.
    pub fn solutions(&self) -> usize {
        self.solutions
    }

    /// The positions of the solutions that count.
    pub(crate) fn range(&self, which: Solutions) -> Range<usize> {
        match which {
            Solutions::All => 0..self.solutions,
            Solutions::One(index) => index..index + 1,
        }
    }

    /// Whether light counts that the hit at the end of a link of a chain reflects.
    pub(super) fn reflects(&self, link: u32) -> bool {
        self.bounces.include(link + 1)
    }

    /// Irradiance of a patch of the mesh in W/m² as seen from a distance (in units), by solution: what counts at the end of a link
    /// at which the mesh [reflects](Self::reflects).
    pub(super) fn irradiance(&self, link: u32, patch: PatchId, distance: f32) -> &[Vec3] {
        self.fine.irradiance(link, patch, distance, self.solutions)
    }

    /// The same as coarser patches show it, with the size of that in the place of `patch`, in units: at a position (unit frame)
    /// of a triangle, seen from `origin`. `None` without such.
    pub(super) fn coarse_irradiance(&self, link: u32, hit: &Seen) -> Option<(&[Vec3], f32)> {
        match self.coarse.as_ref()? {
            Coarse::Mesh(table) => {
                let patches = &table.patches;
                let patch =
                    patches.seen_from(hit.origin, hit.triangle, || hit.position, hit.side)?;
                let irradiance = table.irradiance(link, patch, hit.distance, self.solutions);
                Some((irradiance, patches.size(patch)))
            }
            Coarse::Parents { irradiance, sizes } => {
                let class = Class::at(hit.distance, self.fine.patches.size(hit.patch));
                let first = unknown(hit.patch, class) * self.solutions;
                let irradiance = &irradiance[first..first + self.solutions];
                Some((irradiance, sizes[hit.patch.index()]))
            }
        }
    }
}

/// A hit of a ray from `origin`, in the unit frame.
pub(super) struct Seen {
    pub(super) origin: DVec3,
    pub(super) triangle: TriangleId,
    pub(super) position: DVec3,
    pub(super) side: Side,
    pub(super) distance: f32,
    /// Of the mesh.
    pub(super) patch: PatchId,
}

/// The values of all solutions by unknown and, within it, by solution.
fn side_by_side(
    patches: usize,
    solutions: &[RadiositySolution],
    of: impl Fn(&RadiositySolution, usize) -> Irradiance,
) -> Vec<Vec3> {
    (0..patches * Class::COUNT)
        .flat_map(|unknown| {
            let of = &of;
            solutions
                .iter()
                .map(move |solution| of(solution, unknown).0.as_vec3())
        })
        .collect()
}

/// Tables that a gather of such bounces looks up: one for each link of its chains.
pub(crate) fn orders(bounces: Bounces) -> usize {
    match bounces {
        Bounces::All => 1,
        Bounces::AtMost(most) => most.min(MAX_LINKS + 1) as usize,
    }
}

/// The bounces that solutions have in common.
fn bounces_of(solutions: &[RadiositySolution]) -> Bounces {
    let bounces = solutions[0].bounces();
    assert!(
        solutions.iter().all(|other| other.bounces() == bounces),
        "all solutions hold light of the same bounces"
    );
    bounces
}

struct Table {
    patches: Patches,
    /// By order and, within it, by unknown and by solution.
    irradiance: Vec<Vec<Vec3>>,
}

impl Table {
    fn new(patches: Patches, solutions: &[RadiositySolution]) -> Self {
        let orders = solutions[0].orders().len();
        let of_order = |order: usize| {
            let of =
                |solution: &RadiositySolution, unknown: usize| solution.orders()[order][unknown];
            side_by_side(patches.len(), solutions, of)
        };
        Self {
            irradiance: (0..orders).map(of_order).collect(),
            patches,
        }
    }

    fn irradiance(&self, link: u32, patch: PatchId, distance: f32, solutions: usize) -> &[Vec3] {
        // A whole series is the same at every link.
        let order = (link as usize).min(self.irradiance.len() - 1);
        let class = Class::at(distance, self.patches.size(patch));
        let first = unknown(patch, class) * solutions;
        &self.irradiance[order][first..first + solutions]
    }
}
