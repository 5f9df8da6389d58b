//! Sparse rows of rays in classes, direct light apart: by a fixed budget, or until an error or a time
//! is reached.

use super::budget::{Budget, MARGIN};
use crate::accuracy::{Accuracy, RelativeErrors};
use crate::cli::Context;
use crate::cli::exit::Failure;
use crate::cli::footprint::held_back;
use crate::cli::goal::Goal;
use crate::cli::steering::stage;
use crate::progress::Progress;
use luxel_scenes::{Irradiance, Rgb};
use luxel_solver::patches::{Density, PatchSize, Patches};
use luxel_solver::pilot;
use luxel_solver::radiosity::{RadiosityConfig, RadiositySolution, solve, solve_against};
use luxel_solver::solvers::{Config, Tolerance};
use luxel_solver::subdivision::follow_direct_light;
use luxel_solver::world::World;
use std::time::Instant;

/// Independent solutions, whose scatter is the sampling error.
pub(super) const REPLICATES: u64 = 4;

/// Patches of a mesh whose size is not given, by a fixed budget.
pub(super) const PATCHES: usize = 4000;

/// Shadow rays of each sample point of a patch; four measured no better.
const SHADOW_RAYS: usize = 1;

/// Sweeps after which the iteration gives up: enough for reflectances up to 0.999.
const MAX_ITERATIONS: usize = 20_000;

/// Patches that are added where direct light varies, relative to those that follow the light: shadow
/// boundaries of area lights are what is seen of a mesh. They make numbers neither better nor worse;
/// taken from the others, they made the office worse (discretisation 1.0, 1.3 and 2.4 % of the mean
/// irradiance with none, 30 and 60 % of 4000 patches; cornell 0.15, 0.15, 0.20, corridor 0.33, 0.35,
/// 0.22 %).
pub(super) const SUBDIVIDED: f64 = 0.25;

/// Patches to a parent.
pub(super) const COARSENING: usize = 4;

/// Patches of a given mesh below which its parents would often be its own patches.
pub(super) const FEWEST_WITH_PARENTS: usize = 2000;

/// Children that such a mesh is held against, and the rays of each.
pub(super) const FEWEST_CHILDREN: usize = 1000;
pub(super) const CHILD_RAYS: usize = 64;

/// From the difference that children make to what [`Accuracy`] takes for parents': it counts half of
/// that as the error, and all of this is.
const CHILDREN_TO_PARENTS: f64 = 2.0;

/// What to solve, and when to stop.
pub(super) struct Task<'t> {
    /// The mesh asked for; chosen when absent.
    pub(super) size: Option<PatchSize>,
    /// Rays of each row; chosen when absent.
    pub(super) rays: Option<usize>,
    /// Bound on the error that the iteration may leave, relative to the brightest patch.
    pub(super) tolerance: f64,
    /// When to stop.
    pub(super) goal: &'t Goal,
    /// Whether a mesh is made of the result.
    pub(super) writes: bool,
}

/// A solution with its errors.
pub(super) struct Solved {
    pub(super) patches: Patches,
    pub(super) solutions: Vec<RadiositySolution>,
    /// Mean irradiance by replicate and patch.
    pub(super) irradiance: Vec<Vec<Irradiance>>,
    /// What larger patches would have given less, by replicate and patch.
    pub(super) coarsening: Vec<Vec<Irradiance>>,
    pub(super) accuracy: Accuracy,
    pub(super) errors: RelativeErrors,
}

/// The mesh and another that tells what the size of its patches costs.
struct Meshes {
    mesh: Patches,
    other: Other,
}

/// What a mesh is held against.
enum Other {
    /// One of a quarter of its patches: parents.
    Coarse(Patches),
    /// One of more patches: children, where there are too few to have parents.
    Fine(Patches),
}

impl Task<'_> {
    /// Solves once by the given budget, or in rounds until the goal is met.
    pub(super) fn run(&self, world: &World<'_>, context: &Context<'_>) -> Result<Solved, Failure> {
        let density = match self.size {
            None => Some(pilot::density(world, &[], context.common.seed)?),
            Some(_) => None,
        };
        if let Some(rays) = self.rays {
            let meshes = self.meshes(world, density.as_ref(), PATCHES, context)?;
            let solved = self.round(world, meshes, rays, 0, None, context)?;
            return solved.ok_or_else(Failure::interrupted);
        }
        let target = self.goal.error.map(|error| error.0);
        let mut budget = Budget::first(target.unwrap_or(FIRST_TIMED_ERROR));
        if self.size.is_some() {
            let meshes = self.meshes(world, density.as_ref(), budget.patches, context)?;
            budget.patches = meshes.mesh.len();
        }
        let mut best: Option<Solved> = None;
        let mut listening = None;
        for round in 0.. {
            let started = Instant::now();
            let meshes = self.meshes(world, density.as_ref(), budget.patches, context)?;
            let known = best.as_ref().map(|best| best.errors.total());
            let Some(solved) = self.round(world, meshes, budget.rays, round, known, context)?
            else {
                break;
            };
            // From now on there is something to keep.
            listening.get_or_insert_with(|| context.interrupt.listen());
            let errors = solved.errors;
            context.reporter.detail(format_args!(
                "{} patches, {} rays a row: estimated error {:.2} % (sampling {:.2} %, \
                 discretisation {:.2} %)",
                solved.patches.len(),
                budget.rays,
                100.0 * errors.total(),
                100.0 * errors.sampling.unwrap_or(0.0),
                100.0 * errors.discretisation,
            ));
            let is_better = best
                .as_ref()
                .is_none_or(|best| errors.total() <= best.errors.total());
            if is_better {
                best = Some(solved);
            }
            if self.goal.is_met_by(errors.total() / MARGIN) {
                break;
            }
            let fixed = self.size.is_some();
            let next = self.next(budget, &errors, target, fixed, started);
            let Some(next) = next.map(|next| self.within_memory(world, budget, next, context))
            else {
                break;
            };
            let Some(next) = next else {
                held_back(context);
                break;
            };
            budget = next;
        }
        best.ok_or_else(Failure::interrupted)
    }

    /// The budget of the next round; `None` when there is no more of it or of time.
    fn next(
        &self,
        budget: Budget,
        errors: &RelativeErrors,
        target: Option<f64>,
        fixed: bool,
        started: Instant,
    ) -> Option<Budget> {
        let took = started.elapsed();
        let next = match (target, self.goal.time_left()) {
            (Some(target), _) => budget.next(errors, target, fixed)?,
            (None, Some(left)) => {
                let room = SAFETY * left.as_secs_f64() / took.as_secs_f64().max(1e-6);
                if room < LEAST_TIMED_GROWTH {
                    return None;
                }
                budget.grown(errors, room.min(MOST_TIMED_GROWTH), fixed)?
            }
            (None, None) => return None,
        };
        let expected = took.mul_f64(next.work() / budget.work());
        let in_time = self.goal.time_left().is_none_or(|left| expected < left);
        in_time.then_some(next)
    }

    /// Meshes of the given size, or of `count` patches that follow the light.
    fn meshes(
        &self,
        world: &World<'_>,
        density: Option<&Density>,
        count: usize,
        context: &Context<'_>,
    ) -> Result<Meshes, Failure> {
        if let Some(density) = density {
            let seed = context.common.seed;
            let following = |count: usize| -> Result<Patches, Failure> {
                let patches = world.mesh_with_density(count, density)?;
                let wanted = (count as f64 * (1.0 + SUBDIVIDED)) as usize;
                Ok(follow_direct_light(world, patches, wanted, seed))
            };
            return Ok(Meshes {
                mesh: following(count)?,
                other: Other::Coarse(following(count / COARSENING)?),
            });
        }
        let size = self.size.unwrap_or(PatchSize::Count(count));
        let mesh = world.mesh(size)?;
        let other = match size {
            PatchSize::Length(length) if mesh.len() >= FEWEST_WITH_PARENTS => {
                Other::Coarse(world.mesh(PatchSize::Length(2.0 * length))?)
            }
            _ => {
                let count = (COARSENING * mesh.len()).max(FEWEST_CHILDREN);
                Other::Fine(world.mesh(PatchSize::Count(count))?)
            }
        };
        Ok(Meshes { mesh, other })
    }

    /// Solves all replicates of a round; `known` is the error of the best one so far. `None` after an
    /// interrupt.
    fn round(
        &self,
        world: &World<'_>,
        Meshes { mesh, other }: Meshes,
        rays: usize,
        round: u64,
        known: Option<f64>,
        context: &Context<'_>,
    ) -> Result<Option<Solved>, Failure> {
        let reporter = &context.reporter;
        let stage = stage("solving radiosity", known, Some(self.goal));
        reporter.start(&stage, REPLICATES);
        let mut solutions = Vec::new();
        let mut coarsening = Vec::new();
        for replicate in 0..REPLICATES {
            let replicate = round * REPLICATES + replicate;
            let config = config(rays, self.tolerance, context, replicate);
            match &other {
                Other::Coarse(coarse) => {
                    let solution = solve_against(world, &mesh, coarse, &config)?;
                    coarsening.push(mesh.ids().map(|p| solution.coarsening(p)).collect());
                    solutions.push(solution);
                }
                Other::Fine(fine) => {
                    solutions.push(solve(world, &mesh, &config)?);
                    coarsening.push(from_children(world, &mesh, fine, &config)?);
                }
            }
            reporter.advance(1);
            if context.interrupt.is_set() {
                reporter.finish();
                return Ok(None);
            }
        }
        reporter.finish();
        let irradiance: Vec<Vec<Irradiance>> = solutions
            .iter()
            .map(|s| mesh.ids().map(|patch| s.mean_irradiance(patch)).collect())
            .collect();
        let accuracy = Accuracy::of_patches(&irradiance, &coarsening);
        let areas: Vec<f64> = mesh
            .ids()
            .map(|patch| {
                let exposed = solutions.iter().any(|s| s.is_exposed(patch));
                if exposed {
                    mesh.areas()[patch.index()]
                } else {
                    0.0
                }
            })
            .collect();
        let bound = solutions
            .iter()
            .map(|s| s.error_bound)
            .fold(Rgb::ZERO, Rgb::max);
        let errors = accuracy.relative(&areas, bound);
        Ok(Some(Solved {
            patches: mesh,
            solutions,
            irradiance,
            coarsening,
            accuracy,
            errors,
        }))
    }
}

/// What the patches of a mesh with a form factor for every pair receive less than smaller ones would,
/// by replicate and patch, as if from parents.
pub(super) fn against_children(
    world: &World<'_>,
    mesh: &Patches,
    tolerance: f64,
    context: &Context<'_>,
) -> Result<Vec<Vec<Irradiance>>, Failure> {
    let count = (COARSENING * mesh.len()).max(FEWEST_CHILDREN);
    let fine = world.mesh(PatchSize::Count(count))?;
    (0..REPLICATES)
        .map(|replicate| {
            let config = config(CHILD_RAYS, tolerance, context, replicate);
            from_children(world, mesh, &fine, &config)
        })
        .collect()
}

/// How one replicate is solved.
fn config(rays: usize, tolerance: f64, context: &Context<'_>, replicate: u64) -> RadiosityConfig {
    RadiosityConfig {
        rays,
        shadow_rays: SHADOW_RAYS,
        solver: Config {
            tolerance: Tolerance::Error(tolerance),
            max_iterations: MAX_ITERATIONS,
        },
        seed: context.common.seed,
        replicate,
    }
}

/// What the patches of `mesh` receive less than their children in `fine` do, as if from parents.
fn from_children(
    world: &World<'_>,
    mesh: &Patches,
    fine: &Patches,
    config: &RadiosityConfig,
) -> Result<Vec<Irradiance>, Failure> {
    let config = RadiosityConfig {
        rays: CHILD_RAYS,
        ..*config
    };
    let solution = solve_against(world, fine, mesh, &config)?;
    let parents = luxel_solver::error::parents(world.surfaces(), fine, mesh);
    let mut sums = vec![(Irradiance::ZERO, 0.0); mesh.len()];
    for (child, parent) in fine.ids().zip(parents) {
        let sum = &mut sums[parent.index()];
        sum.0 += solution.coarsening(child) * fine.areas()[child.index()];
        sum.1 += fine.areas()[child.index()];
    }
    let mean = |(sum, area): (Irradiance, f64)| {
        // A face smaller than a child may be in none of their middles.
        if area > 0.0 {
            sum * (CHILDREN_TO_PARENTS / area)
        } else {
            Irradiance::ZERO
        }
    };
    Ok(sums.into_iter().map(mean).collect())
}

/// The first round of a run that only time ends.
pub(super) const FIRST_TIMED_ERROR: f64 = 0.02;

/// The share of the time left that a round is expected to take.
const SAFETY: f64 = 0.7;

/// Bounds of how much larger the next timed round is; below the least it would tell nothing new.
const LEAST_TIMED_GROWTH: f64 = 1.5;
const MOST_TIMED_GROWTH: f64 = 8.0;
