//! What gather rays look up at their hits: the irradiance of patches.
//!
//! Several independent solutions stand side by side, so that one hit sees all of them: their mean is
//! the result, and their scatter over the *same* hits is the noise of the solution, free of the
//! gather's own. A second, coarser mesh with solutions of its own may be looked up at the same hits;
//! the difference of the two tells what finite patches leave out, again free of the gather's noise.
//! Single precision: 6·10⁻⁸ relative, far below what rays can resolve. Cost: 12 bytes a class and
//! solution; the solutions of a class lie next to each other in memory.

use crate::geometry::TriangleId;
use crate::patches::{PatchId, Patches, Side};
use crate::radiosity::{Class, RadiositySolution, unknown};
use crate::solvers::Ledger;
use glam::{DVec3, Vec3};
use luxel_scenes::{Rgb, Scene};
use std::ops::Range;

/// Largest number of independent solutions (and of independent gathers).
pub const MAX_REPLICATES: usize = 4;

/// One value for each solution.
pub(crate) type PerSolution = [Rgb; MAX_REPLICATES];

/// Meshes with their solutions.
pub struct Lookup {
    fine: Table,
    coarse: Option<Table>,
    solutions: usize,
    solver_bound: f64,
    ledger: Ledger,
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
    /// The patches of a mesh with independent solutions on it.
    ///
    /// # Panics
    /// When there is no solution or there are more than [`MAX_REPLICATES`].
    pub fn new(patches: Patches, solutions: &[RadiositySolution]) -> Self {
        assert!(
            (1..=MAX_REPLICATES).contains(&solutions.len()),
            "one to {MAX_REPLICATES} solutions"
        );
        let ledgers: Vec<Ledger> = solutions.iter().map(|solution| solution.ledger).collect();
        Self {
            ledger: Ledger::mean(&ledgers),
            fine: Table::new(patches, solutions),
            coarse: None,
            solutions: solutions.len(),
            solver_bound: solutions
                .iter()
                .map(|solution| solution.error_bound.max_element())
                .fold(0.0, f64::max),
        }
    }

    /// Adds a coarser mesh of the same scene, for the error that patches make.
    ///
    /// # Panics
    /// When it does not have as many solutions.
    #[must_use]
    pub fn with_coarse(mut self, patches: Patches, solutions: &[RadiositySolution]) -> Self {
        assert_eq!(solutions.len(), self.solutions, "as many solutions as fine");
        self.coarse = Some(Table::new(patches, solutions));
        self
    }

    /// Memory of so many solutions on so many patches, and on a quarter as many, in bytes.
    pub fn bytes_for(patches: usize, solutions: usize, scene: &Scene) -> usize {
        let table = |patches: usize| {
            Patches::bytes_for(patches, scene)
                + patches * Class::COUNT * solutions * size_of::<Vec3>()
        };
        table(patches) + table(patches / 4)
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

    /// Irradiance of a patch of the mesh in W/m² as seen from a distance (in units), by solution.
    pub(super) fn irradiance(&self, patch: PatchId, distance: f32) -> &[Vec3] {
        self.fine.irradiance(patch, distance, self.solutions)
    }

    /// The same at a position (unit frame) of a triangle, seen from `origin`, on the coarse mesh, with the size of its patch in units; `None` without
    /// one.
    pub(super) fn coarse_irradiance(
        &self,
        origin: DVec3,
        triangle: TriangleId,
        position: DVec3,
        side: Side,
        distance: f32,
    ) -> Option<(&[Vec3], f32)> {
        let coarse = self.coarse.as_ref()?;
        let patch = coarse
            .patches
            .seen_from(origin, triangle, || position, side)?;
        let irradiance = coarse.irradiance(patch, distance, self.solutions);
        Some((irradiance, coarse.patches.size(patch)))
    }
}

struct Table {
    patches: Patches,
    /// By unknown and, within it, by solution.
    irradiance: Vec<Vec3>,
}

impl Table {
    fn new(patches: Patches, solutions: &[RadiositySolution]) -> Self {
        let irradiance = patches
            .ids()
            .flat_map(|patch| Class::all().map(|class| (patch, class)))
            .flat_map(|(patch, class)| {
                solutions
                    .iter()
                    .map(move |solution| solution.irradiance(patch, class).0.as_vec3())
            })
            .collect();
        Self {
            patches,
            irradiance,
        }
    }

    fn irradiance(&self, patch: PatchId, distance: f32, solutions: usize) -> &[Vec3] {
        let class = Class::at(distance, self.patches.size(patch));
        let first = unknown(patch, class) * solutions;
        &self.irradiance[first..first + solutions]
    }
}
