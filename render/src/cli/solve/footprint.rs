//! What a solution holds in memory.

use super::budget::Budget;
use super::rows::{
    CHILD_RAYS, COARSENING, FEWEST_CHILDREN, FEWEST_WITH_PARENTS, FIRST_TIMED_ERROR, PATCHES,
    REPLICATES, SUBDIVIDED, Task,
};
use super::{RAYS, Solve, Solver};
use crate::accuracy::Accuracy;
use crate::cli::Context;
use crate::cli::dense;
use crate::cli::exit::Failure;
use crate::cli::footprint::{Footprint, larger_error, largest};
use crate::cli::form_factors::Method;
use crate::solution::PatchLight;
use luxel_scenes::Irradiance;
use luxel_solver::patches::{PatchSize, Patches};
use luxel_solver::radiosity::{RadiositySolution, bytes_to_solve};
use luxel_solver::world::World;

/// Patches that balance and walls add to those that are asked for.
const ADDED: f64 = 0.1;

/// Steps of a factor of two in which a larger patch size is looked for.
const STEPS: usize = 10;

/// Factors of two that are tried: the longest scene has no longer side than its shortest patch times that.
const DOUBLINGS: usize = 30;

impl Task<'_> {
    /// Refuses what would not fit into memory, and says what would.
    pub(super) fn require_memory(
        &self,
        world: &World<'_>,
        context: &Context<'_>,
    ) -> Result<(), Failure> {
        let limit = context.common.max_memory;
        let error = self.goal.error.map_or(FIRST_TIMED_ERROR, |error| error.0);
        let first = Budget::first(error);
        let rays = self.rays.unwrap_or(first.rays);
        let enough = limit.map_or(usize::MAX, |limit| limit.0.get() / LEAST);
        let of_size = |size: PatchSize, rays: usize| -> Result<Footprint, Failure> {
            let patches = Patches::count(world.surfaces(), world.bvh(), size, enough)?;
            Ok(self.footprint(world, Budget { patches, rays }, None))
        };
        let of_count =
            |patches: usize, rays: usize| self.footprint(world, Budget { patches, rays }, None);
        let patches = if self.rays.is_some() {
            PATCHES
        } else {
            first.patches
        };
        let expected = match self.size {
            Some(size) => of_size(size, rays)?,
            None => of_count(patches, rays),
        };
        let with_rays = |rays: usize| match self.size {
            Some(size) => of_size(size, rays).is_ok_and(|footprint| footprint.fits(limit)),
            None => of_count(patches, rays).fits(limit),
        };
        expected.require(context, || {
            if let Some(fewer) = self.rays.and_then(|rays| largest(2, rays, with_rays)) {
                return Some(format!("--rays {fewer}"));
            }
            match self.size {
                Some(PatchSize::Length(length)) => larger_patches(length, |size| {
                    of_size(size, rays).is_ok_and(|footprint| footprint.fits(limit))
                }),
                Some(_) => None,
                None => larger_error(error, |error| {
                    let Budget { patches, rays } = Budget::first(error);
                    of_count(patches, rays).fits(limit)
                }),
            }
        })
    }

    /// As much of the `next` round after `last` as fits into memory: rays are left out where patches leave no room
    /// for all. `None` where what fits is no more than there was.
    pub(super) fn within_memory(
        &self,
        world: &World<'_>,
        last: Budget,
        next: Budget,
        context: &Context<'_>,
    ) -> Option<Budget> {
        let fits = |budget: Budget| {
            let footprint = self.footprint(world, budget, Some(last.patches));
            footprint.fits(context.common.max_memory)
        };
        let with = |patches: usize| {
            let rays = largest(1, next.rays / 2, |pairs| {
                fits(Budget {
                    patches,
                    rays: 2 * pairs,
                })
            })?;
            let budget = Budget {
                patches,
                rays: 2 * rays,
            };
            (budget == next || budget.work() >= WORTHWHILE * last.work()).then_some(budget)
        };
        with(next.patches).or_else(|| with(last.patches))
    }

    /// What is held while a round is solved; a round of `kept` patches is kept until it is known to be better.
    fn footprint(&self, world: &World<'_>, budget: Budget, kept: Option<usize>) -> Footprint {
        let scene = world.scene();
        let chosen = self.size.is_none();
        let enlarged = |patches: usize| match self.size {
            None => (patches as f64 * (1.0 + SUBDIVIDED) * (1.0 + ADDED)) as usize,
            Some(_) => patches,
        };
        let own = enlarged(budget.patches);
        let has_parents =
            chosen || own >= FEWEST_WITH_PARENTS && matches!(self.size, Some(PatchSize::Length(_)));
        let (other, solving) = if has_parents {
            (own / COARSENING, bytes_to_solve(own, budget.rays, true))
        } else {
            let children = (COARSENING * own).max(FEWEST_CHILDREN);
            let solving = bytes_to_solve(own, budget.rays, false);
            (
                children,
                solving.max(bytes_to_solve(children, CHILD_RAYS, true)),
            )
        };
        let solved = |patches: usize| {
            let replicates = REPLICATES as usize;
            Patches::bytes_for(patches, scene)
                + replicates * RadiositySolution::bytes_for(patches, has_parents)
                + 2 * replicates * patches * size_of::<Irradiance>()
                + Accuracy::bytes_for(patches, 0)
        };
        let judging = Accuracy::bytes_for(own, REPLICATES as usize)
            + usize::from(self.writes) * PatchLight::bytes_of_mesh(own);
        let held = Footprint::of(world)
            .with(
                "patches with their solutions",
                solved(own) + Patches::bytes_for(other, scene),
            )
            .with("rows and what solves them", solving.max(judging));
        match kept {
            Some(patches) => held.with("the last solutions", solved(enlarged(patches))),
            None => held,
        }
    }
}

/// Memory that a patch takes at the least, in bytes: what has more of them than this allows is not meshed.
const LEAST: usize = 100;

/// Least growth of the work in a round for want of memory.
const WORTHWHILE: f64 = 1.5;

/// The smallest patch size above `length` that `fits`, as an option.
fn larger_patches(length: f64, fits: impl Fn(PatchSize) -> bool) -> Option<String> {
    // As it is written, so that it is the same when it is read.
    let of = |step: usize| -> f64 {
        let length = length * 2f64.powf(step as f64 / STEPS as f64);
        format!("{length:.3e}").parse().unwrap_or(length)
    };
    let last = STEPS * DOUBLINGS;
    // Sizes of small faces are no monotonic matter: the one that is named must fit itself.
    let smaller = largest(0, last - 1, |smaller| {
        fits(PatchSize::Length(of(last - smaller)))
    })?;
    Some(format!("--patch-size {}", of(last - smaller)))
}

impl Solve {
    /// Refuses form factors of all pairs that would not fit into memory, and says what would.
    pub(super) fn require_dense_memory(
        &self,
        world: &World<'_>,
        size: PatchSize,
        method: Method,
        context: &Context<'_>,
    ) -> Result<(), Failure> {
        let limit = context.common.max_memory;
        let factors = method.factors(self.rays, self.resolution, RAYS);
        let solver = self.solver.unwrap_or(Solver::GaussSeidel);
        let enough = limit.map_or(usize::MAX, |limit| limit.0.get() / LEAST);
        let footprint = |size: PatchSize| -> Result<Footprint, Failure> {
            let patches = Patches::count(world.surfaces(), world.bvh(), size, enough)?;
            let children = (COARSENING * patches).max(FEWEST_CHILDREN);
            let scene = world.scene();
            let solving =
                Patches::bytes_for(children, scene) + bytes_to_solve(children, CHILD_RAYS, true);
            Ok(Footprint::of(world)
                .with(
                    "form factors of all pairs",
                    dense::bytes_for(patches, factors, Some(solver)),
                )
                .with(
                    "patches and their errors",
                    Patches::bytes_for(patches, scene) + solving,
                ))
        };
        footprint(size)?.require(context, || {
            let fits = |size| footprint(size).is_ok_and(|footprint| footprint.fits(limit));
            let length = match size {
                PatchSize::Length(length) => length,
                PatchSize::Count(_) => default_length(world, super::DENSE_PATCHES),
                _ => return None,
            };
            larger_patches(length, fits)
        })
    }
}

/// The side of a patch in metres where the scene has so many, all equal.
fn default_length(world: &World<'_>, patches: usize) -> f64 {
    let scene = world.scene();
    let area: f64 = scene.face_ids().map(|face| scene.area(face)).sum();
    (area / patches as f64).sqrt()
}
