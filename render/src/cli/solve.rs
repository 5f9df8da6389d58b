//! `luxel solve`: radiosity by object, convergence, and where the light goes.

use super::dense::{self, DenseSolution, Solver};
use super::exit::{ExitCode, Failure};
use super::form_factors::Method;
use super::scene;
use super::transport::{Purpose, Transport};
use super::{Context, Session};
use crate::files::Output;
use crate::solution::{ObjectLight, PatchLight, emitted_flux};
use luxel_scenes::{Irradiance, Radiosity, Rgb};
use luxel_solver::patches::PatchSize;
use luxel_solver::radiosity::RadiositySolution;
use luxel_solver::solvers::{Ledger, Outcome};
use luxel_solver::world::World;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;

/// Independent solutions, whose scatter is the sampling error.
const REPLICATES: u32 = 4;

/// Patches of a mesh whose size is not given.
const PATCHES: usize = 4000;

/// Rays of a patch whose form factors are ray-cast.
const RAYS: usize = 65_536;

/// Patches of such a mesh when every pair has a form factor.
const DENSE_PATCHES: usize = 1000;

/// Solve for the radiosity of a scene
///
/// Prints area-weighted means by object (W/m², or lm/m² in a photometric scene), the energy ledger
/// (W) and the estimated error. Both sides of a two-sided object count.
#[derive(clap::Args)]
pub(super) struct Solve {
    /// Scene file (.toml), or geometry (.obj, .gltf, .glb)
    scene: PathBuf,

    /// Side of a patch in metres, or `whole` for one patch per face [default: about 4000 patches]
    #[arg(long, value_name = "S|whole", value_parser = parse_patch_size)]
    patch_size: Option<PatchSize>,

    /// Form factors of every pair of patches [default: sparse rows of rays with direct light apart,
    /// the fastest]
    #[arg(long, value_enum, value_name = "HOW")]
    form_factors: Option<Method>,

    /// With --form-factors: what solves the system [default: gauss-seidel]
    #[arg(long, value_enum, value_name = "NAME", requires = "form_factors")]
    solver: Option<Solver>,

    /// Rays of each patch [default: 256; raycast: 65536]; analytic: points for each pair of polygons
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

/// What is reported.
struct Report {
    patches: usize,
    objects: Vec<ObjectLight>,
    mesh: Option<Vec<u8>>,
    iterations: usize,
    residual: Rgb,
    energy: Energy,
    error: Error,
    converged: bool,
    seconds: Vec<(&'static str, f64)>,
}

/// Where the flux goes, in W: emitted = absorbed + escaped + residual.
struct Energy {
    emitted: Rgb,
    absorbed: Rgb,
    escaped: Rgb,
    residual: Rgb,
}

/// Estimated relative errors.
struct Error {
    /// Bound on what the iteration leaves, over the brightest patch.
    solver: f64,
    /// Bound on the root mean square of the same, over the mean radiosity; `None` where form factors
    /// are not reciprocal.
    solver_rms: Option<f64>,
    /// Standard error of the irradiance, root mean square over mean; `None` for hemicubes, whose
    /// error is a bias.
    sampling: Option<f64>,
}

impl Solve {
    pub(super) fn run(self, session: &mut Session<'_>) -> Result<ExitCode, Failure> {
        if self.form_factors.is_some() || self.resolution.is_some() {
            Method::check_options(self.form_factors, self.rays, self.resolution)?;
        }
        let started = Instant::now();
        let output = self.output.as_deref().map(Output::prepare).transpose()?;
        let scene = scene::read(&self.scene, &session.context)?;
        let loaded = started.elapsed().as_secs_f64();
        let context = &session.context;
        let mut report = context.common.install(|| {
            let world = World::new(&scene);
            scene::require_light(&world)?;
            match self.form_factors {
                None => self.solve_rows(&world, context),
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
        let sampling = report.error.sampling.map_or(String::new(), |sampling| {
            format!(
                ", sampling error {:.2} % of the mean irradiance",
                100.0 * sampling
            )
        });
        context.reporter.note(format_args!(
            "{} patches, {} sweeps, {total:.2} s; solver error below {:.1e}{sampling}",
            report.patches, report.iterations, report.error.solver
        ));
        let text = if session.context.common.json {
            serde_json::to_string_pretty(&report.to_json(self.output.as_deref()))?
        } else {
            report.to_table()
        };
        session.print(&text)?;
        Ok(ExitCode::Ok)
    }

    /// Sparse rows in classes, direct light apart.
    fn solve_rows(&self, world: &World<'_>, context: &Context<'_>) -> Result<Report, Failure> {
        let started = Instant::now();
        let purpose = Purpose::Solve {
            size: self.patch_size.unwrap_or(PatchSize::Count(PATCHES)),
            rays: self.rays.unwrap_or(256) as usize,
            tolerance: self.tolerance,
            replicates: REPLICATES,
        };
        let Transport { patches, solutions } = Transport::solve(world, purpose, context)?;
        let solved = started.elapsed().as_secs_f64();

        let mean = |values: Vec<Irradiance>| {
            let count = values.len() as f64;
            values.into_iter().sum::<Irradiance>() * (1.0 / count)
        };
        let irradiance = patches
            .ids()
            .map(|patch| mean(solutions.iter().map(|s| s.mean_irradiance(patch)).collect()))
            .collect();
        let light = PatchLight::new(&patches, irradiance);
        let each: Vec<Vec<ObjectLight>> = solutions
            .iter()
            .map(|solution| {
                let irradiance = patches.ids().map(|p| solution.mean_irradiance(p)).collect();
                PatchLight::new(&patches, irradiance).by_object(world, &patches)
            })
            .collect();
        let largest = |value: fn(&RadiositySolution) -> Rgb| {
            solutions.iter().map(value).fold(Rgb::ZERO, Rgb::max)
        };
        let mesh = self.output.as_ref().map(|_| light.mesh(world, &patches));
        Ok(Report {
            patches: patches.len(),
            objects: light.by_object(world, &patches),
            mesh: mesh.map(|mesh| mesh.to_ply()).transpose()?,
            iterations: solutions.iter().map(|s| s.iterations).max().unwrap_or(0),
            residual: largest(|solution| solution.residual),
            energy: Energy::new(
                &solutions,
                (world.scene().lights.is_empty()).then(|| emitted_flux(world, &patches).0),
            ),
            error: Error {
                solver: largest(|solution| solution.error_bound).max_element() / light.brightest(),
                solver_rms: None,
                sampling: Some(sampling_error(&each)),
            },
            converged: solutions.iter().all(|s| s.outcome == Outcome::Converged),
            seconds: vec![("solve", solved)],
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
        let light = PatchLight::new(&patches, solution.irradiance);
        let mesh = self.output.as_ref().map(|_| light.mesh(world, &patches));
        let squares: f64 = patches
            .areas()
            .iter()
            .zip(&standard_error)
            .map(|(area, error)| area * error.0.length_squared() / 3.0)
            .sum();
        let level: f64 = patches
            .areas()
            .iter()
            .zip(&light.irradiance)
            .map(|(area, irradiance)| area * irradiance.0.element_sum() / 3.0)
            .sum();
        let area: f64 = patches.areas().iter().sum();
        let sampling = (squares / area).sqrt() / (level / area);
        let leaving: f64 = (patches.areas().iter().zip(&light.radiosity))
            .map(|(area, radiosity)| area * radiosity.0.element_sum() / 3.0)
            .sum();
        let solver_rms = mean_error_bound.map(|bound| bound.max_element() / (leaving / area));
        Ok(Report {
            patches: patches.len(),
            objects: light.by_object(world, &patches),
            mesh: mesh.map(|mesh| mesh.to_ply()).transpose()?,
            iterations: solution.iterations,
            residual: solution.residual,
            energy: Energy {
                emitted: ledger.emitted.0,
                absorbed: ledger.absorbed.0,
                escaped: ledger.escaped.0,
                residual: ledger.residual.0 + ledger.defect.0,
            },
            error: Error {
                solver: solution.error_bound.max_element() / light.brightest(),
                solver_rms,
                sampling: (method != Method::Hemicube && level > 0.0).then_some(sampling),
            },
            converged: solution.outcome == Outcome::Converged,
            seconds: vec![("solve", seconds)],
        })
    }
}

impl Energy {
    /// The mean ledger of the solutions. `emitted` is the flux of all surfaces when these are the
    /// only lights: what of it meets no surface has escaped. Of other lights, only what arrives is
    /// known to be theirs, so that it counts as emitted.
    fn new(solutions: &[RadiositySolution], emitted: Option<Rgb>) -> Self {
        let mean = |value: fn(&Ledger) -> Rgb| {
            let sum: Rgb = solutions.iter().map(|s| value(&s.ledger)).sum();
            sum / solutions.len() as f64
        };
        let arrived = mean(|ledger| ledger.emitted.0 + ledger.direct.0);
        let emitted = emitted.unwrap_or(arrived);
        Self {
            emitted,
            absorbed: mean(|ledger| ledger.absorbed.0),
            escaped: mean(|ledger| ledger.escaped.0) + (emitted - arrived),
            residual: mean(|ledger| ledger.residual.0 + ledger.defect.0),
        }
    }
}

/// Root mean square over objects of the standard error of the mean irradiance, over the mean.
fn sampling_error(replicates: &[Vec<ObjectLight>]) -> f64 {
    let objects = replicates.first().map_or(0, Vec::len);
    let (mut squares, mut level, mut area) = (0.0, 0.0, 0.0);
    for object in 0..objects {
        let mut moments = crate::film::Moments::default();
        for replicate in replicates {
            moments.add(replicate[object].irradiance.0);
        }
        let own = replicates[0][object].area;
        let error = moments.standard_error().unwrap_or_default();
        squares += own * error.length_squared() / 3.0;
        level += own * moments.mean().element_sum() / 3.0;
        area += own;
    }
    if level > 0.0 {
        (squares / area).sqrt() / (level / area)
    } else {
        0.0
    }
}

impl Report {
    fn to_json(&self, output: Option<&std::path::Path>) -> serde_json::Value {
        let objects: serde_json::Map<_, _> = self
            .objects
            .iter()
            .map(|object| {
                let Radiosity(radiosity) = object.radiosity;
                let value = serde_json::json!({
                    "area": object.area,
                    "radiosity": radiosity.to_array(),
                    "irradiance": object.irradiance.0.to_array(),
                });
                (object.name.clone(), value)
            })
            .collect();
        let seconds: serde_json::Map<_, _> = self
            .seconds
            .iter()
            .map(|&(stage, seconds)| (stage.to_owned(), seconds.into()))
            .collect();
        serde_json::json!({
            "patches": self.patches,
            "objects": objects,
            "iterations": self.iterations,
            "residual": self.residual.to_array(),
            "energy": {
                "emitted": self.energy.emitted.to_array(),
                "absorbed": self.energy.absorbed.to_array(),
                "escaped": self.energy.escaped.to_array(),
                "residual": self.energy.residual.to_array(),
            },
            "error": {
                "solver": self.error.solver,
                "solver_rms": self.error.solver_rms,
                "sampling": self.error.sampling,
            },
            "output": output.map(|path| path.display().to_string()),
            "seconds": seconds,
        })
    }

    fn to_table(&self) -> String {
        let rgb = |value: Rgb| format!("{:>11.4e} {:>11.4e} {:>11.4e}", value.x, value.y, value.z);
        let width = self.objects.iter().map(|o| o.name.chars().count()).max();
        let width = width.unwrap_or(0).max(9);
        // Writing to a string does not fail.
        let mut text = format!(
            "{:width$} {:>10}  {:>35}  {:>35}\n",
            "object", "area m2", "radiosity W/m2", "irradiance W/m2"
        );
        for object in &self.objects {
            let _ = writeln!(
                text,
                "{:width$} {:>10.4}  {}  {}",
                object.name,
                object.area,
                rgb(object.radiosity.0),
                rgb(object.irradiance.0)
            );
        }
        let lines = [
            ("emitted", self.energy.emitted),
            ("absorbed", self.energy.absorbed),
            ("escaped", self.energy.escaped),
            ("residual", self.energy.residual),
        ];
        for (index, (name, flux)) in lines.into_iter().enumerate() {
            let line = if index == 0 { "\n" } else { "" };
            let _ = writeln!(text, "{line}{name:width$} {:>10}  {}", "W", rgb(flux));
        }
        text.trim_end().to_owned()
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
