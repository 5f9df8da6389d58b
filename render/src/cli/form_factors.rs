//! `luxel form-factors`: how much of what one object sends another receives.

use super::exit::{ExitCode, Failure};
use super::{Context, Session, scene};
use crate::files::Output;
use crate::matrix::NamedMatrix;
use clap::ValueEnum;
use luxel_scenes::Scene;
use luxel_solver::form_factors::{
    ObjectFactors, RayCastConfig, analytic_between_objects, ray_cast_between_objects,
    reciprocity_defect_of_largest,
};
use luxel_solver::transport::{Dense, Transport};
use luxel_solver::world::World;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Faces up to which pairs of them are integrated exactly: 8 million pairs. More take hours, and
/// rays give the objects' factors in seconds.
const MAX_ANALYTIC_FACES: usize = 4096;

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

    /// raycast: rays of each object [default: 1048576]; analytic: visibility rays of each pair of
    /// faces [default: 512]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 30))]
    rays: Option<u32>,

    /// Matrix to write
    #[arg(short, long, value_name = "F.csv|F.npy", value_parser = matrix_path)]
    output: Option<PathBuf>,
}

/// How factors are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Method {
    /// Exact, times a visibility that rays sample where something stands between
    Analytic,
    /// The fraction of rays that arrive
    Raycast,
}

impl FormFactors {
    pub(super) fn run(self, session: &mut Session<'_>) -> Result<ExitCode, Failure> {
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
        let largest = factors.standard_error.iter().copied().fold(0.0, f64::max);
        context.reporter.note(format_args!(
            "{n} objects, {seconds:.2} s; largest standard error {largest:.1e}, reciprocity defect \
             {reciprocity:.1e}"
        ));
        let text = if context.common.json {
            let sums: Vec<f64> = (0..n).map(|row| matrix.row_sum(row)).collect();
            serde_json::to_string_pretty(&serde_json::json!({
                "objects": named.names,
                "areas": factors.areas,
                "F": named.rows,
                "standard_error": rows(&factors.standard_error),
                "row_sums": sums,
                "reciprocity": reciprocity,
                "method": super::name(&self.method),
                "output": self.output.as_deref().map(|path| path.display().to_string()),
                "seconds": seconds,
            }))?
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
        let world = World::new(scene);
        let config = |default: usize| RayCastConfig {
            rays: self.rays.map_or(default, |rays| rays as usize),
            seed: context.common.seed,
        };
        match self.method {
            Method::Raycast => Ok(ray_cast_between_objects(&world, &config(1 << 20))),
            Method::Analytic if scene.faces.len() > MAX_ANALYTIC_FACES => Err(Failure::new(
                ExitCode::Usage,
                format!(
                    "{} faces are too many for --method analytic, which takes every pair of them \
                     (at most {MAX_ANALYTIC_FACES} faces); use --method raycast",
                    scene.faces.len()
                ),
            )),
            Method::Analytic => Ok(analytic_between_objects(&world, &config(512))),
        }
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
