//! `luxel probe`: light or openness at given points.

use super::exit::{ExitCode, Failure};
use super::scene;
use super::transport::{Purpose, Transport};
use super::{Context, Session};
use crate::files::Output;
use crate::film::Moments;
use crate::integrators::ao::{AmbientOcclusion, Config, Falloff};
use crate::integrators::path::PathTracer;
use crate::points::{Estimate, PointTable};
use crate::progress::Progress;
use clap::ValueEnum;
use glam::DVec3;
use luxel_scenes::{Rgb, UnitSystem};
use luxel_solver::gather::{Components, GatherConfig, Key, gather};
use luxel_solver::patches::PatchSize;
use luxel_solver::world::{Receiver, World};
use std::path::PathBuf;
use std::time::Instant;

/// Independent randomisations of every estimate: what its standard error is made of.
const REPLICATES: u32 = 4;

/// Shadow rays of a point beyond which the noise of direct light is most often negligible; a light
/// of which little is seen gets more of a large budget.
const ENOUGH_SHADOW_RAYS: usize = 1024;

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

    /// With --quantity ao: metres beyond which nothing occludes
    #[arg(long, value_name = "D", value_parser = super::parse_length)]
    max_distance: Option<f64>,

    /// With --max-distance: how nearer blockers count
    #[arg(
        long,
        value_name = "HOW",
        requires = "max_distance",
        default_value = "sharp"
    )]
    falloff: Falloff,

    /// Rays for each point [default: 1024; path and ao: 4096]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(4..=1 << 28))]
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Method {
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
        let started = Instant::now();
        let output = self.output.as_deref().map(Output::prepare).transpose()?;
        let table = PointTable::read(&self.points)?;
        let scene = scene::read(&self.scene, &session.context)?;
        let context = &session.context;
        let estimates = context.common.install(|| {
            let world = World::new(&scene);
            let positions: Vec<DVec3> = table.points().iter().map(|p| p.position).collect();
            let normals: Vec<DVec3> = table.points().iter().map(|p| p.normal).collect();
            let receivers = world.receivers(&positions, &normals);
            self.estimate(&world, &receivers, context)
        })??;

        let (mean, noise) = summary(&estimates);
        let seconds = started.elapsed().as_secs_f64();
        context.reporter.note(format_args!(
            "{} points, {seconds:.2} s, noise {:.2} % (rms over mean)",
            estimates.len(),
            100.0 * noise
        ));
        let csv = table.to_csv(&estimates)?;
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
            serde_json::to_string_pretty(&serde_json::json!({
                "quantity": super::name(&self.quantity),
                "unit": self.unit(scene.units),
                "output": self.output.as_deref().map(|path| path.display().to_string()),
                "points": estimates.len(),
                "estimates": output.is_none().then(listed),
                "mean": mean.to_array(),
                "error": { "noise": noise },
                "seconds": seconds,
            }))?
        } else if let Some(path) = &self.output {
            path.display().to_string()
        } else {
            String::from_utf8_lossy(&csv).trim_end().to_owned()
        };
        session.print(&text)?;
        Ok(ExitCode::Ok)
    }

    /// Refuses options that would have no effect.
    fn check_options(&self) -> Result<(), Failure> {
        let ao = self.quantity == Quantity::Ao;
        let problem = if ao && self.components.is_some() {
            "--components belongs to --quantity irradiance"
        } else if ao && self.integrator.is_some() {
            "--integrator belongs to --quantity irradiance"
        } else if !ao && self.max_distance.is_some() {
            "--max-distance belongs to --quantity ao"
        } else {
            return Ok(());
        };
        Err(Failure::new(ExitCode::Usage, problem))
    }

    fn estimate(
        &self,
        world: &World<'_>,
        receivers: &[Receiver],
        context: &Context<'_>,
    ) -> Result<Vec<Estimate>, Failure> {
        let seed = context.common.seed;
        let progress = &context.reporter;
        let each = |default: u32| (self.rays.unwrap_or(default) / REPLICATES).max(1);
        if self.quantity == Quantity::Ao {
            let config = Config {
                rays: each(4096),
                max_distance: self.max_distance,
                falloff: self.falloff,
                seed,
            };
            let occlusion = AmbientOcclusion::new(world, config);
            return Ok(estimates(
                &occlusion.at_receivers(receivers, REPLICATES, progress),
            ));
        }
        scene::require_light(world)?;
        let components = self.components.unwrap_or(Component::All).into();
        match self.integrator.unwrap_or(Method::Gather) {
            Method::Path => {
                let tracer = PathTracer::new(world, seed);
                let paths = each(4096);
                let moments = tracer.irradiance(receivers, components, REPLICATES, paths, progress);
                Ok(estimates(&moments))
            }
            Method::Gather => {
                let rays = (each(1024) * REPLICATES) as usize;
                gather_irradiance(world, receivers, components, rays, context)
            }
        }
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

/// Irradiance by the final gather.
fn gather_irradiance(
    world: &World<'_>,
    receivers: &[Receiver],
    components: Components,
    rays: usize,
    context: &Context<'_>,
) -> Result<Vec<Estimate>, Failure> {
    let config = GatherConfig {
        rays,
        shadow_rays: (rays * 3 / 4).min(ENOUGH_SHADOW_RAYS.max(rays / 16)),
        replicates: REPLICATES as usize,
        components,
        seed: context.common.seed,
    };
    let transport = if components == Components::Direct {
        // Nothing is looked up: any mesh tells fronts from backs.
        let patches = world.mesh(PatchSize::Whole)?;
        let solutions = Vec::new();
        Transport { patches, solutions }
    } else {
        Transport::solve(world, Purpose::Gather(REPLICATES), context)?
    };
    let Transport { patches, solutions } = &transport;
    // In parts, so that progress shows; a receiver's value does not depend on its part.
    let part = (receivers.len() / 50).max(64);
    context.reporter.start("gathering", receivers.len() as u64);
    let mut gathered = Vec::with_capacity(receivers.len());
    for receivers in receivers.chunks(part) {
        let first = gathered.len() as u64;
        let last = first + receivers.len() as u64;
        let keys: Vec<Key> = (first..last).map(Key::of).collect();
        gathered.extend(gather(world, patches, solutions, receivers, &keys, &config));
        context.reporter.advance(receivers.len() as u64);
    }
    context.reporter.finish();
    let buried = gathered.iter().filter(|g| g.back_fraction > BURIED).count();
    if buried > 0 {
        context.reporter.warning(format_args!(
            "{buried} points lie inside a solid: most of their rays meet the backs of faces; \
             check the normals of points and faces"
        ));
    }
    Ok(gathered
        .iter()
        .map(|gathered| Estimate {
            value: gathered.irradiance().0,
            standard_error: gathered.standard_error.0,
        })
        .collect())
}

fn estimates(moments: &[Moments]) -> Vec<Estimate> {
    let estimate = |moments: &Moments| Estimate {
        value: moments.mean(),
        standard_error: moments.standard_error().unwrap_or_default(),
    };
    moments.iter().map(estimate).collect()
}

/// The mean, and the root mean square of the standard errors over it.
fn summary(estimates: &[Estimate]) -> (Rgb, f64) {
    let count = estimates.len() as f64;
    let mean = estimates.iter().map(|e| e.value).sum::<Rgb>() / count;
    let squares: f64 = estimates
        .iter()
        .map(|e| e.standard_error.length_squared())
        .sum();
    let rms = (squares / (3.0 * count)).sqrt();
    let level = mean.dot(Rgb::ONE) / 3.0;
    (mean, if level > 0.0 { rms / level } else { 0.0 })
}
