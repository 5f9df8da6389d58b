//! `luxel solve`: radiosity by object, convergence, and where the light goes.

mod budget;
mod footprint;
mod report;
mod rows;

use super::dense::{self, DenseSolution, Solver};
use super::exit::{ExitCode, Failure};
use super::footprint::Footprint;
use super::form_factors::Method;
use super::goal::Goal;
use super::memory;
use super::scene;
use super::{Context, Session};
use crate::accuracy::{Accuracy, Part};
use crate::files::Output;
use crate::solution::{PatchLight, emitted_flux};
use luxel_scenes::{Irradiance, Rgb};
use luxel_solver::patches::PatchSize;
use luxel_solver::radiosity::RadiositySolution;
use luxel_solver::solvers::Outcome;
use luxel_solver::world::World;
use report::{Energy, Report};
use rows::{Solved, Task};
use std::path::PathBuf;
use std::time::Instant;

/// Rays of a patch whose form factors are ray-cast.
const RAYS: usize = 65_536;

/// Rays of each patch's row when only the patch size is given.
const ROW_RAYS: usize = 256;

/// Patches of such a mesh when every pair has a form factor.
const DENSE_PATCHES: usize = 1000;

/// Solve for the radiosity of a scene
///
/// Prints area-weighted means by object (W/m², or lm/m² in a photometric scene), the energy ledger
/// (W) and the estimated error in its parts. Both sides of a two-sided object count. Patches and rays
/// are chosen such that --error is reached, relative root mean square over the patches; with --rays,
/// --form-factors, or --patch-size without --error and --time, the budget is fixed.
#[derive(clap::Args)]
pub(super) struct Solve {
    /// Scene file (.toml), or geometry (.obj, .gltf, .glb)
    scene: PathBuf,

    /// Side of a patch in metres, or `whole` for one patch per face [default: patches that follow the
    /// light, as many as the error asks for]
    #[arg(long, value_name = "S|whole", value_parser = parse_patch_size)]
    patch_size: Option<PatchSize>,

    /// Form factors of every pair of patches [default: sparse rows of rays with direct light apart,
    /// the fastest]
    #[arg(long, value_enum, value_name = "HOW")]
    form_factors: Option<Method>,

    /// With --form-factors: what solves the system [default: gauss-seidel]
    #[arg(long, value_enum, value_name = "NAME", requires = "form_factors")]
    solver: Option<Solver>,

    /// Rays of each patch [default: as the error asks for; raycast: 65536]; analytic: points for each pair of polygons
    /// that something may occlude [default: 400]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=1 << 24))]
    rays: Option<u32>,

    /// With --form-factors hemicube: pixels along an edge, an even number [default: 128]
    #[arg(long, value_name = "N", value_parser = super::form_factors::parse_resolution)]
    resolution: Option<usize>,

    /// Bound on the error that the iteration may leave, relative to the brightest patch
    #[arg(long, value_name = "T", default_value_t = 1e-7, value_parser = parse_tolerance)]
    tolerance: f64,

    /// Mesh with vertex colours to write
    #[arg(short, long, value_name = "OUT.ply")]
    output: Option<PathBuf>,
}

impl Solve {
    pub(super) fn run(self, session: &mut Session<'_>) -> Result<ExitCode, Failure> {
        if self.form_factors.is_some() || self.resolution.is_some() {
            Method::check_options(self.form_factors, self.rays, self.resolution)?;
        }
        let started = session.context.started;
        let output = self.output.as_deref().map(Output::prepare).transpose()?;
        let scene = scene::read(&self.scene, &session.context)?;
        let loaded = started.elapsed().as_secs_f64();
        let context = &session.context;
        let goal = context.common.goal(started);
        Footprint::to_prepare(&scene).require(context, || None)?;
        let mut report = context.common.install(|| {
            let world = World::new(&scene);
            scene::require_light(&world)?;
            match self.form_factors {
                None => self.solve_rows(&world, &goal, context),
                Some(method) => self.solve_dense(&world, method, context),
            }
        })??;
        report.seconds.insert(0, ("load", loaded));
        let total = started.elapsed().as_secs_f64();
        report.seconds.push(("total", total));

        if let (Some(output), Some(mesh)) = (&output, &report.mesh) {
            output.write(mesh)?;
        }
        if !report.converged {
            context.reporter.warning(
                "the iteration stopped at its limit before the tolerance; the error bound is valid",
            );
        }
        context.reporter.note(report.summary(total));
        let missed = report.reached() == Some(false);
        if missed && let Some(target) = report.target {
            context.reporter.warning(format_args!(
                "the error of {} % that was asked for was not reached",
                100.0 * target
            ));
        }
        let text = if session.context.common.json {
            let mut json = report.to_json(self.output.as_deref());
            memory::add_peak(&mut json);
            serde_json::to_string_pretty(&json)?
        } else {
            report.to_table()
        };
        session.print(&text)?;
        Ok(if session.context.interrupt.is_set() {
            ExitCode::Interrupted
        } else if missed {
            ExitCode::TargetMissed
        } else {
            ExitCode::Ok
        })
    }

    /// Sparse rows in classes, direct light apart.
    fn solve_rows(
        &self,
        world: &World<'_>,
        goal: &Goal,
        context: &Context<'_>,
    ) -> Result<Report, Failure> {
        let started = Instant::now();
        let asked = context.common.error.is_some() || context.common.time.is_some();
        let fixed = (self.patch_size.is_some() && !asked).then_some(ROW_RAYS);
        let rays = self.rays.map(|rays| rays as usize).or(fixed);
        let task = Task {
            size: self.patch_size,
            rays,
            tolerance: self.tolerance,
            goal,
            writes: self.output.is_some(),
        };
        task.require_memory(world, context)?;
        let solved = task.run(world, context)?;
        let solve_seconds = started.elapsed().as_secs_f64();
        let Solved {
            patches,
            solutions,
            accuracy,
            errors,
            irradiance,
            coarsening,
        } = &solved;

        let light = PatchLight::new(patches, accuracy.irradiance.clone());
        let errors_of_patches: Vec<Irradiance> = accuracy.standard_error().collect();
        let is_exposed = |patch| solutions.iter().any(|s| s.is_exposed(patch));
        let exposed: Vec<bool> = patches.ids().map(is_exposed).collect();
        let mesh = self
            .output
            .as_ref()
            .map(|_| light.mesh(world, patches, &errors_of_patches, &exposed));
        let largest = |value: fn(&RadiositySolution) -> Rgb| {
            solutions.iter().map(value).fold(Rgb::ZERO, Rgb::max)
        };
        let bound = largest(|solution| solution.error_bound);
        let objects = light.by_object_with_errors(world, patches, irradiance, coarsening, bound);
        let target = match rays {
            None => goal.error,
            Some(_) => context.common.error,
        };
        Ok(Report {
            patches: patches.len(),
            objects,
            mesh: mesh.map(|mesh| mesh.to_ply()).transpose()?,
            iterations: solutions.iter().map(|s| s.iterations).max().unwrap_or(0),
            residual: largest(|solution| solution.residual),
            energy: Energy::new(
                solutions,
                (world.scene().lights.is_empty()).then(|| emitted_flux(world, patches).0),
            ),
            errors: *errors,
            target: target.map(|error| error.0),
            solver_rms: None,
            converged: solutions.iter().all(|s| s.outcome == Outcome::Converged),
            seconds: vec![("solve", solve_seconds)],
            remedy: match (rays, errors.dominant()) {
                (None, _) => "a smaller --error",
                (Some(_), Part::Discretisation) => "a smaller --patch-size",
                (Some(_), _) => "more --rays",
            },
        })
    }
}

impl Solve {
    /// A dense matrix of form factors.
    fn solve_dense(
        &self,
        world: &World<'_>,
        method: Method,
        context: &Context<'_>,
    ) -> Result<Report, Failure> {
        let started = Instant::now();
        let factors = method.factors(self.rays, self.resolution, RAYS);
        let size = self.patch_size.unwrap_or(PatchSize::Count(DENSE_PATCHES));
        self.require_dense_memory(world, size, method, context)?;
        let patches = world.mesh(size)?;
        let solver = self.solver.unwrap_or(Solver::GaussSeidel);
        let config = dense::config(self.tolerance);
        let solved = dense::solve(world, &patches, factors, solver, &config, context)?;
        let seconds = started.elapsed().as_secs_f64();

        let DenseSolution {
            solution,
            ledger,
            mean_error_bound,
            standard_error,
        } = solved;
        // Noise of the rows is amplified by the light that goes on from patch to patch.
        let area: f64 = patches.areas().iter().sum();
        let reflected: f64 = patches
            .areas()
            .iter()
            .zip(patches.reflectances())
            .map(|(area, rho)| area * rho.0.max_element())
            .sum();
        let amplification = 1.0 / (1.0 - reflected / area);
        let sampling: Vec<Rgb> = standard_error
            .iter()
            .map(|e| e.0 * e.0 * (amplification * amplification))
            .collect();
        let coarsening = rows::against_children(world, &patches, self.tolerance, context)?;
        let replicates = vec![solution.irradiance.clone(); coarsening.len()];
        let accuracy = Accuracy::of_patches(&replicates, &coarsening);
        let accuracy = Accuracy {
            sampling,
            ..accuracy
        };
        let mut errors = accuracy.relative(patches.areas(), solution.error_bound);
        if method == Method::Hemicube {
            errors.sampling = None;
        }
        let light = PatchLight::new(&patches, solution.irradiance);
        let of_patches: Vec<Irradiance> = accuracy.standard_error().collect();
        let everywhere = vec![true; patches.len()];
        let mesh = self
            .output
            .as_ref()
            .map(|_| light.mesh(world, &patches, &of_patches, &everywhere));
        let bound = solution.error_bound;
        let mut objects =
            light.by_object_with_errors(world, &patches, &replicates, &coarsening, bound);
        // Rows are independent, so that the mean over an object has less noise than its patches: at
        // most the root mean square of all, which is what is stated.
        let noise = accuracy
            .sampling
            .iter()
            .zip(patches.reflectances())
            .zip(patches.areas())
            .map(|((square, rho), share)| *square * rho.0 * rho.0 * (share / area))
            .sum::<Rgb>();
        for error in objects
            .iter_mut()
            .filter_map(|object| object.standard_error.as_mut())
        {
            error.0 = (error.0 * error.0 + noise).map(f64::sqrt);
        }
        let brightness: Rgb = patches
            .areas()
            .iter()
            .zip(&light.radiosity)
            .map(|(share, radiosity)| radiosity.0 * (share / area))
            .sum();
        let solver_rms = mean_error_bound
            .filter(|_| brightness.max_element() > 0.0)
            .map(|bound| bound.max_element() / brightness.max_element());
        Ok(Report {
            patches: patches.len(),
            objects,
            mesh: mesh.map(|mesh| mesh.to_ply()).transpose()?,
            iterations: solution.iterations,
            residual: solution.residual,
            energy: Energy {
                emitted: ledger.emitted.0,
                absorbed: ledger.absorbed.0,
                escaped: ledger.escaped.0,
                residual: ledger.residual.0 + ledger.defect.0,
            },
            solver_rms,
            errors,
            target: context.common.error.map(|error| error.0),
            remedy: match (errors.dominant(), method) {
                (Part::Discretisation, _) => "a smaller --patch-size",
                (_, Method::Hemicube) => "a larger --resolution",
                _ => "more --rays",
            },
            converged: solution.outcome == Outcome::Converged,
            seconds: vec![("solve", seconds)],
        })
    }
}

/// A length in metres, or `whole`.
fn parse_patch_size(text: &str) -> Result<PatchSize, String> {
    if text == "whole" {
        Ok(PatchSize::Whole)
    } else {
        super::parse_length(text)
            .map(PatchSize::Length)
            .map_err(|_| "a length in metres such as 0.1 is needed, or `whole`".into())
    }
}

/// A number in (0, 1).
fn parse_tolerance(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(tolerance) if tolerance > 0.0 && tolerance < 1.0 => Ok(tolerance),
        _ => Err("a number between 0 and 1 is needed, such as 1e-6".into()),
    }
}
