//! `luxel form-factors`: how much of what one object sends another receives.

use super::dense::{self, Factors};
use super::exit::{ExitCode, Failure};
use super::footprint::Footprint;
use super::memory;
use super::{Context, Session, scene};
use crate::files::Output;
use crate::matrix::NamedMatrix;
use clap::ValueEnum;
use luxel_scenes::Scene;
use luxel_solver::form_factors::{
    ObjectFactors, RayCastConfig, between_objects, ray_cast_between_objects,
    reciprocity_defect_of_largest,
};
use luxel_solver::patches::{PatchSize, Patches};
use luxel_solver::transport::{Dense, Transport};
use luxel_solver::world::World;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Rays of an object whose form factors are ray-cast.
const RAYS: usize = 1 << 20;

/// Compute form factors between the objects of a scene
///
/// F from one object to another is the fraction of the diffuse flux leaving the fronts of its
/// faces that arrives at fronts of the other. `reciprocity` is max |A_i F_ij - A_j F_ji| over the
/// largest A_i F_ij.
#[derive(clap::Args)]
pub(super) struct FormFactors {
    /// Scene file (.toml), or geometry (.obj, .gltf, .glb)
    scene: PathBuf,

    /// How factors are computed
    #[arg(long, value_enum, default_value = "analytic", value_name = "HOW")]
    method: Method,

    /// raycast: rays of each object [default: 1048576]; analytic: points for each pair of faces that
    /// something may occlude [default: 400]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 30))]
    rays: Option<u32>,

    /// hemicube: pixels along an edge, an even number [default: 128]
    #[arg(long, value_name = "N", value_parser = parse_resolution)]
    resolution: Option<usize>,

    /// Matrix to write
    #[arg(short, long, value_name = "F.csv|F.npy", value_parser = matrix_path)]
    output: Option<PathBuf>,
}

/// How form factors are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Method {
    /// Exact; pairs that something occludes have a small standard error
    Analytic,
    /// The fraction of rays that arrive
    Raycast,
    /// Rasterised onto half a cube; biased by its resolution
    Hemicube,
}

impl Method {
    /// The method with its fineness, or the default one; `rays` is the default of ray-casting.
    pub(super) fn factors(
        self,
        fineness: Option<u32>,
        resolution: Option<usize>,
        rays: usize,
    ) -> Factors {
        let or = |default: usize| fineness.map_or(default, |n| n as usize);
        match self {
            Self::Analytic => Factors::Analytic(or(dense::ANALYTIC_POINTS)),
            Self::Raycast => Factors::RayCast(or(rays)),
            Self::Hemicube => Factors::Hemicube(resolution.unwrap_or(dense::HEMICUBE_RESOLUTION)),
        }
    }

    /// Refuses options that would have no effect on a method.
    pub(super) fn check_options(
        method: Option<Self>,
        rays: Option<u32>,
        resolution: Option<usize>,
    ) -> Result<(), Failure> {
        let problem = match method {
            Some(Self::Hemicube) if rays.is_some() => "hemicubes have --resolution, not --rays",
            Some(Self::Hemicube) => return Ok(()),
            _ if resolution.is_some() => "--resolution belongs to the method hemicube",
            _ => return Ok(()),
        };
        Err(Failure::new(ExitCode::Usage, problem))
    }
}

impl FormFactors {
    pub(super) fn run(self, session: &mut Session<'_>) -> Result<ExitCode, Failure> {
        Method::check_options(Some(self.method), self.rays, self.resolution)?;
        let started = Instant::now();
        let output = self.output.as_deref().map(Output::prepare).transpose()?;
        let scene = scene::read(&self.scene, &session.context)?;
        let context = &session.context;
        let factors = context.common.install(|| self.compute(&scene, context))??;
        let n = factors.objects.len();
        let matrix = Dense::new(n, factors.factors.clone())?;
        let rows = |values: &[f64]| -> Vec<Vec<f64>> {
            values.chunks(n.max(1)).map(<[f64]>::to_vec).collect()
        };
        let named = NamedMatrix {
            names: names(&scene, &factors),
            rows: rows(&factors.factors),
        };
        if let Some(output) = &output {
            let is_npy = has_extension(output.path(), "npy");
            let bytes = if is_npy {
                named.to_npy()?
            } else {
                named.to_csv()?
            };
            output.write(&bytes)?;
        }
        let seconds = started.elapsed().as_secs_f64();
        let reciprocity = reciprocity_defect_of_largest(&matrix, &factors.areas);
        let sampled = self.method != Method::Hemicube;
        let largest = factors.standard_error.iter().copied().fold(0.0, f64::max);
        let error = if sampled {
            format!("largest standard error {largest:.1e}, ")
        } else {
            String::new()
        };
        context.reporter.note(format_args!(
            "{n} objects, {seconds:.2} s{}; {error}reciprocity defect {reciprocity:.1e}",
            memory::peak_in_words()
        ));
        let text = if context.common.json {
            let sums: Vec<f64> = (0..n).map(|row| matrix.row_sum(row)).collect();
            let mut json = serde_json::json!({
                "objects": named.names,
                "areas": factors.areas,
                "F": named.rows,
                // What hemicubes get wrong is a bias, which does not show as scatter.
                "standard_error": sampled.then(|| rows(&factors.standard_error)),
                "row_sums": sums,
                "reciprocity": reciprocity,
                "method": super::name(&self.method),
                "output": self.output.as_deref().map(|path| path.display().to_string()),
                "seconds": seconds,
            });
            memory::add_peak(&mut json);
            serde_json::to_string_pretty(&json)?
        } else if let Some(path) = &self.output {
            path.display().to_string()
        } else {
            String::from_utf8_lossy(&named.to_csv()?)
                .trim_end()
                .to_owned()
        };
        session.print(&text)?;
        Ok(ExitCode::Ok)
    }

    fn compute(&self, scene: &Scene, context: &Context<'_>) -> Result<ObjectFactors, Failure> {
        Footprint::to_prepare(scene).require(context, || None)?;
        let world = World::new(scene);
        self.require_memory(&world, context)?;
        let factors = self.method.factors(self.rays, self.resolution, RAYS);
        if let Factors::RayCast(rays) = factors {
            let seed = context.common.seed;
            return Ok(ray_cast_between_objects(
                &world,
                &RayCastConfig { rays, seed },
            ));
        }
        let patches = world.mesh(PatchSize::Whole)?;
        let (matrix, errors) = dense::compute(&world, &patches, factors, context)?;
        Ok(between_objects(&world, &patches, &matrix, &errors))
    }
}

impl FormFactors {
    /// Refuses what would not fit into memory, and says what would.
    fn require_memory(&self, world: &World<'_>, context: &Context<'_>) -> Result<(), Failure> {
        let scene = world.scene();
        let rays_alone = |method: Method| matches!(method, Method::Raycast);
        let footprint = |method: Method| -> Result<Footprint, Failure> {
            let size = if rays_alone(method) {
                PatchSize::Objects
            } else {
                PatchSize::Whole
            };
            let patches = Patches::count(world.surfaces(), world.bvh(), size, usize::MAX)?;
            let factors = method.factors(self.rays, self.resolution, RAYS);
            // Values and their errors are printed in rows.
            let printed = 4 * Dense::bytes_for(scene.objects.len());
            Ok(Footprint::of(world)
                .with("form factors", dense::bytes_for(patches, factors, None))
                .with("the result", printed)
                .with("patches", Patches::bytes_for(patches, scene)))
        };
        footprint(self.method)?.require(context, || {
            let limit = context.common.max_memory;
            let smaller = footprint(Method::Raycast).is_ok_and(|rays| rays.fits(limit));
            (smaller && !rays_alone(self.method)).then(|| "--method raycast".to_owned())
        })
    }
}

/// The names of the objects that have factors.
fn names(scene: &Scene, factors: &ObjectFactors) -> Vec<String> {
    let objects = factors.objects.iter();
    objects
        .map(|object| scene.objects[object.index()].name.clone())
        .collect()
}

fn has_extension(path: &Path, extension: &str) -> bool {
    let own = path.extension().unwrap_or_default();
    own.eq_ignore_ascii_case(extension)
}

/// A path that ends in `.csv` or `.npy`.
fn matrix_path(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if has_extension(&path, "csv") || has_extension(&path, "npy") {
        Ok(path)
    } else {
        Err("the matrix is written as CSV or NPY: end its name in .csv or .npy".into())
    }
}

/// An even number of pixels.
pub(super) fn parse_resolution(text: &str) -> Result<usize, String> {
    /// Largest resolution: three gigabytes of pixels for each thread lie above it.
    const MAX: usize = 8192;
    match text.parse() {
        Ok(n) if (2..=MAX).contains(&n) && n % 2 == 0 => Ok(n),
        _ => Err(format!(
            "an even number of pixels from 2 to {MAX} is needed"
        )),
    }
}
