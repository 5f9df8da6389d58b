//! `luxel probe`: light or openness at given points.

use super::exit::{ExitCode, Failure};
use super::footprint::{Footprint, held_back, larger_error, largest};
use super::goal::Goal;
use super::memory;
use super::occlusion::Reach;
use super::refine::{Refined, refine};
use super::reflections::{Reflected, Reflections};
use super::scene;
use super::stated::StatedError;
use super::steering::{Steering, first_error};
use super::{Context, Session};
use crate::files::Output;
use crate::film::{Alike, Film};
use crate::integrators::ao::AmbientOcclusion;
use crate::integrators::path::PathTracer;
use crate::points::{Estimate, PointTable};
use crate::progress::Progress;
use clap::ValueEnum;
use glam::DVec3;
use luxel_scenes::{Rgb, UnitSystem};
use luxel_solver::adaptive::{self, AdaptiveConfig, Budget, Ending, ROW_RAYS};
use luxel_solver::gather::{Components, MAX_REPLICATES, finish};
use luxel_solver::world::{Receiver, World};
use std::path::PathBuf;

/// Independent randomisations of every estimate: what its standard error is made of.
const REPLICATES: u32 = MAX_REPLICATES as u32;

/// Patches of the solution for a fixed number of rays, at 1024 rays a point; they grow with the root
/// of the rays, so that their error falls about as fast as the noise. Measured at 1000 points of
/// furnished and bare rooms: from 2500 to 8000 patches the error falls from 0.66 to 0.62 % (Cornell
/// box), 1.15 to 0.82 % (corridor), 1.38 to 1.27 % (office) at 1.4 times the time.
const PATCHES: f64 = 6000.0;

/// Rays of a sample of ambient occlusion.
const AO_RAYS: u32 = 4;

/// Samples of each replicate that a refinement begins with: enough for an estimate of the error.
const FIRST_SAMPLES: u32 = 16;

/// Memory of a point in a list of JSON values, in bytes: two nodes of a map, two lists, seven values and its text.
const LISTED: usize = 1600;

/// Fraction of back hits from which a point is reported as lying inside a solid.
const BURIED: f64 = 0.5;

/// Compute irradiance or ambient occlusion at points
///
/// Input: a CSV table with the columns x,y,z (metres) and nx,ny,nz. Output: the same table with
/// e_r,e_g,e_b and their standard errors se_r,se_g,se_b, in W/m² (lx in a photometric scene);
/// ambient occlusion (1 = open) is the same in the three channels.
#[derive(clap::Args)]
pub(super) struct Probe {
    /// Scene file (.toml), or geometry (.obj, .gltf, .glb)
    scene: PathBuf,

    /// Table of points
    #[arg(long, value_name = "P.csv")]
    points: PathBuf,

    /// Table to write [default: stdout]
    #[arg(short, long, value_name = "OUT.csv")]
    output: Option<PathBuf>,

    /// What to compute
    #[arg(long, value_enum, default_value = "irradiance", value_name = "WHAT")]
    quantity: Quantity,

    /// Which light to count [default: all]
    #[arg(long, value_enum, value_name = "WHICH")]
    components: Option<Component>,

    /// How irradiance is computed [default: gather]
    #[arg(long, value_enum, value_name = "HOW")]
    integrator: Option<Method>,

    #[command(flatten)]
    reach: Reach,

    #[command(flatten)]
    reflections: Reflections,

    /// Rays for each point, whatever the error [default: as many as the error asks for]
    #[arg(long, conflicts_with_all = ["error", "time"], value_name = "N", value_parser = clap::value_parser!(u32).range(4..=1 << 28))]
    rays: Option<u32>,
}

/// What to compute.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Quantity {
    /// Irradiance
    Irradiance,
    /// Ambient occlusion, 1 = open
    Ao,
}

/// Which light to count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Component {
    /// All
    All,
    /// Straight from a source
    Direct,
    /// After at least one reflection
    Indirect,
}

/// How irradiance is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Method {
    /// Direct light exact, indirect light gathered from a radiosity solution
    Gather,
    /// Unbiased path tracing: the reference
    Path,
}

impl From<Component> for Components {
    fn from(component: Component) -> Self {
        match component {
            Component::All => Self::All,
            Component::Direct => Self::Direct,
            Component::Indirect => Self::Indirect,
        }
    }
}

impl Probe {
    pub(super) fn run(self, session: &mut Session<'_>) -> Result<ExitCode, Failure> {
        self.check_options()?;
        let output = self.output.as_deref().map(Output::prepare).transpose()?;
        let table = PointTable::read(&self.points)?;
        let scene = scene::read(&self.scene, &session.context)?;
        let context = &session.context;
        let goal = context.common.goal(context.started);
        let goal = self.rays.is_none().then_some(&goal);
        Footprint::to_prepare(&scene).require(context, || None)?;
        let found = context.common.install(|| {
            let world = World::new(&scene);
            let held = self.require_memory(&world, table.points().len(), goal, context)?;
            let positions: Vec<DVec3> = table.points().iter().map(|p| p.position).collect();
            let normals: Vec<DVec3> = table.points().iter().map(|p| p.normal).collect();
            let receivers = world.receivers(&positions, &normals);
            self.estimate(&world, &receivers, &held, goal, context)
        })??;
        let Some(Found {
            estimates,
            error,
            budget,
        }) = found
        else {
            return Ok(ExitCode::Interrupted);
        };
        let seconds = context.started.elapsed().as_secs_f64();
        context.reporter.note(format_args!(
            "{} points, {seconds:.2} s{}; {}",
            estimates.len(),
            memory::peak_in_words(),
            error.summary(goal)
        ));
        let csv = context.common.install(|| table.to_csv(&estimates))??;
        if let Some(output) = &output {
            output.write(&csv)?;
        }
        let text = if context.common.json {
            let listed = || -> Vec<serde_json::Value> {
                let value = |e: &Estimate| {
                    serde_json::json!({
                        "e": e.value.to_array(),
                        "se": e.standard_error.to_array(),
                    })
                };
                estimates.iter().map(value).collect()
            };
            let mut json = serde_json::json!({
                "quantity": super::name(&self.quantity),
                "unit": self.unit(scene.units),
                "output": self.output.as_deref().map(|path| path.display().to_string()),
                "points": estimates.len(),
                "estimates": output.is_none().then(listed),
                "mean": mean(&estimates).to_array(),
                "error": error.to_json(goal),
                "budget": budget,
                "seconds": seconds,
            });
            memory::add_peak(&mut json);
            serde_json::to_string_pretty(&json)?
        } else if let Some(path) = &self.output {
            path.display().to_string()
        } else {
            String::from_utf8_lossy(&csv).trim_end().to_owned()
        };
        session.print(&text)?;
        Ok(if session.context.interrupt.is_set() {
            ExitCode::Interrupted
        } else {
            error.exit(goal)
        })
    }

    /// Refuses options that would have no effect.
    fn check_options(&self) -> Result<(), Failure> {
        let ao = self.quantity == Quantity::Ao;
        let problem = if ao && self.components.is_some() {
            "--components belongs to --quantity irradiance"
        } else if ao && self.integrator.is_some() {
            "--integrator belongs to --quantity irradiance"
        } else {
            self.reach.require(ao, "--quantity ao")?;
            return self.reflections.require(match self.components {
                _ if ao => Reflected::None("--quantity irradiance"),
                Some(Component::Direct) => Reflected::None("--components all or indirect"),
                Some(Component::Indirect) => Reflected::Alone,
                Some(Component::All) | None => Reflected::Some,
            });
        };
        Err(Failure::new(ExitCode::Usage, problem))
    }

    /// What the command holds with so many points, without a mesh; `listed` where they are printed as JSON.
    fn footprint(&self, world: &World<'_>, points: usize, listed: bool) -> Footprint {
        let gathered = if self.gathers() {
            adaptive::bytes_to_gather(points)
        } else {
            Film::bytes_to_refine(points)
        };
        let table = PointTable::bytes_for(points) + usize::from(listed) * points * LISTED;
        Footprint::of(world)
            .with("the table of points", table)
            .with("what is gathered at them", gathered)
    }

    /// Whether a solution is gathered from, or direct light alone.
    fn gathers(&self) -> bool {
        self.quantity == Quantity::Irradiance && self.integrator != Some(Method::Path)
    }

    /// Patches of the mesh that is begun with, for an error or the fixed number of rays.
    fn first_patches(&self, error: f64, rays: Option<u32>) -> usize {
        match rays {
            _ if !self.gathers() || self.components == Some(Component::Direct) => 0,
            _ if !self.reflections.bounces().reflect() => 0,
            Some(rays) => patches_for(rays),
            None => adaptive::first_patches(error),
        }
    }

    /// Refuses what would not fit into memory and says what would. Returns what else is held when patches are solved.
    fn require_memory(
        &self,
        world: &World<'_>,
        points: usize,
        goal: Option<&Goal>,
        context: &Context<'_>,
    ) -> Result<Footprint, Failure> {
        let listed = context.common.json && self.output.is_none();
        let with_mesh = |points: usize, patches: usize| {
            let solving =
                adaptive::bytes_to_solve(patches, self.reflections.bounces(), world.scene());
            let solving = if patches > 0 { solving } else { 0 };
            self.footprint(world, points, listed)
                .with("patches and their solutions", solving)
        };
        let fits = |points, patches| with_mesh(points, patches).fits(context.common.max_memory);
        let error = first_error(goal);
        let first = self.first_patches(error, self.rays);
        with_mesh(points, first).require(context, || {
            if let Some(fewer) = largest(1, points - 1, |points| fits(points, first)) {
                return Some(format!("a table of {fewer} points"));
            }
            if let Some(rays) = self.rays {
                let patches = |rays: usize| self.first_patches(error, Some(rays as u32));
                let rays = largest(4, rays as usize, |rays| fits(points, patches(rays)))?;
                return Some(format!("--rays {rays}"));
            }
            larger_error(error, |error| fits(points, self.first_patches(error, None)))
        })?;
        Ok(self.footprint(world, points, listed))
    }

    fn estimate(
        &self,
        world: &World<'_>,
        receivers: &[Receiver],
        held: &Footprint,
        goal: Option<&Goal>,
        context: &Context<'_>,
    ) -> Result<Option<Found>, Failure> {
        let seed = context.common.seed;
        if self.quantity == Quantity::Ao {
            let config = self.reach.config(AO_RAYS, seed);
            let occlusion = AmbientOcclusion::new(world, config);
            let add = |film: &mut Film, samples: &[u32], progress: &dyn Progress| {
                occlusion.at_receivers(film, receivers, samples, progress);
            };
            return Ok(self.sample(receivers.len(), AO_RAYS, goal, context, add));
        }
        scene::require_light(world)?;
        let components = self.components.unwrap_or(Component::All).into();
        match self.integrator.unwrap_or(Method::Gather) {
            Method::Path => {
                let tracer = PathTracer::new(world, seed).with_bounces(self.reflections.bounces());
                let add = |film: &mut Film, samples: &[u32], progress: &dyn Progress| {
                    tracer.irradiance(film, receivers, components, samples, progress);
                };
                Ok(self.sample(receivers.len(), 1, goal, context, add))
            }
            Method::Gather => self.gather(world, receivers, components, held, goal, context),
        }
    }

    /// Independent samples, `rays` each, until the goal or the number of rays is reached.
    fn sample(
        &self,
        receivers: usize,
        rays: u32,
        goal: Option<&Goal>,
        context: &Context<'_>,
        add: impl FnMut(&mut Film, &[u32], &dyn Progress),
    ) -> Option<Found> {
        let mut steering = Steering::new(context, goal);
        let film = Film::new([receivers, 1], REPLICATES);
        let fewest = adaptive::fewest_rays(receivers) as u32;
        let each = |all: u32| (all / (REPLICATES * rays)).max(1);
        let first = self.rays.map_or(each(fewest).max(FIRST_SAMPLES), each);
        let start = Refined::first(film, first);
        let (film, error) = refine(start, Alike::Values, goal, &mut steering, add)?;
        let all_rays = film.sample_counts().max * rays;
        let alike = match self.quantity {
            Quantity::Ao => Alike::Fractions { rays: all_rays },
            Quantity::Irradiance => Alike::Values,
        };
        let errors = film.errors(alike)?;
        let estimates = film.values().zip(&errors);
        Some(Found {
            estimates: estimates
                .map(|(value, error)| Estimate {
                    value,
                    standard_error: error.total(),
                })
                .collect(),
            error: StatedError::of_samples(error.sampling, error.discretisation, 0.0),
            budget: serde_json::json!({ "rays": all_rays }),
        })
    }

    /// Irradiance by the final gather.
    fn gather(
        &self,
        world: &World<'_>,
        receivers: &[Receiver],
        components: Components,
        held: &Footprint,
        goal: Option<&Goal>,
        context: &Context<'_>,
    ) -> Result<Option<Found>, Failure> {
        let mut steering = Steering::new(context, goal);
        let error = first_error(goal);
        let first = self.first_patches(error, self.rays);
        let bounces = self.reflections.bounces();
        let config = AdaptiveConfig {
            error,
            components,
            bounces,
            most_patches: held.most_patches(world.scene(), first, bounces, context),
            seed: context.common.seed,
        };
        let found = match self.rays {
            None => adaptive::irradiance(world, receivers, &config, &mut steering)?,
            Some(rays) => {
                let has_sky = world.lights().has_sky();
                let budget = Budget::of_rays(patches_for(rays), rays as usize, has_sky);
                adaptive::irradiance_for(world, receivers, &budget, &config, &mut steering)?
            }
        };
        if found.tallies.is_empty() {
            return Ok(None);
        }
        let gathered = finish(&found.tallies);
        let buried = gathered.iter().filter(|g| g.back_fraction > BURIED).count();
        if buried > 0 {
            context.reporter.warning(format_args!(
                "{buried} points lie inside a solid: most of their rays meet the backs of faces; \
                 check the normals of points and faces"
            ));
        }
        let estimates: Vec<Estimate> = gathered
            .iter()
            .map(|gathered| Estimate {
                value: gathered.irradiance().0,
                standard_error: gathered.standard_error().0,
            })
            .collect();
        let level = mean(&estimates).element_sum() / 3.0;
        let solver = if level > 0.0 {
            found.solver_bound / level
        } else {
            0.0
        };
        let budget = found.budget;
        let error = StatedError::of_gather(&found.parts, solver);
        if found.ending == Ending::TooManyPatches && error.exit(goal) == ExitCode::TargetMissed {
            held_back(context);
        }
        Ok(Some(Found {
            estimates,
            error,
            budget: serde_json::json!({
                "patches": found.patches,
                "row_rays": ROW_RAYS * MAX_REPLICATES,
                "rays": budget.rays,
                "shadow_rays": budget.shadow_rays,
            }),
        }))
    }

    /// The unit of the values.
    fn unit(&self, units: UnitSystem) -> &'static str {
        match (self.quantity, units) {
            (Quantity::Ao, _) => "1",
            (Quantity::Irradiance, UnitSystem::Radiometric) => "W/m2",
            (Quantity::Irradiance, UnitSystem::Photometric) => "lx",
        }
    }
}

/// Patches of the solution for a fixed number of rays a point.
fn patches_for(rays: u32) -> usize {
    (PATCHES * (f64::from(rays) / 1024.0).sqrt()) as usize
}

/// What was found at the points.
struct Found {
    estimates: Vec<Estimate>,
    error: StatedError,
    /// What was spent on each point.
    budget: serde_json::Value,
}

fn mean(estimates: &[Estimate]) -> Rgb {
    estimates.iter().map(|e| e.value).sum::<Rgb>() / estimates.len() as f64
}
