//! `luxel converge`: every method against one reference, as a page.

use super::exit::{ExitCode, Failure};
use super::footprint::Footprint;
use super::memory;
use super::scene;
use super::{Context, Session};
use crate::files::Output;
use crate::image::exr;
use crate::points::PointTable;
use crate::report::budget::Budget;
use crate::report::family::Family;
use crate::report::reference::{self, Given, ReferenceError};
use crate::report::study::{self, Setup, Study};
use crate::report::{page, table};
use luxel_scenes::Camera;
use luxel_solver::world::World;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Seconds that a report takes when neither a time nor the number of sizes is given.
const SECONDS: f64 = 60.0;

/// Memory of a receiver in bytes: the reference, and values of each family that are kept for pictures and rows.
const RECEIVER: usize = 2000;

/// Measure every method against one reference and write a report
///
/// The report is one HTML page without external parts: error against time, patches and rays, orders of
/// convergence, stated against true error, solvers, energy, pictures of the error. The reference is the
/// one given, the exact answer of a furnace, or luxel's own best with an independent seed. The report
/// takes about a minute, or the --time given; how many sizes of each method fit in depends on the
/// machine, unless --steps gives their number.
#[derive(clap::Args)]
pub(super) struct Converge {
    /// Scene file (.toml), or geometry (.obj, .gltf, .glb)
    scene: PathBuf,

    /// Page to write
    #[arg(short, long, value_name = "REPORT.html", value_parser = html_path)]
    output: PathBuf,

    /// What to compare with: a table of points as probe writes it (x,y,z,nx,ny,nz,e_r,e_g,e_b, standard
    /// errors se_r,se_g,se_b where known), or a picture of linear radiance of the camera
    #[arg(long, value_name = "R.csv|R.exr", value_parser = reference_path)]
    reference: Option<PathBuf>,

    /// Camera of the picture, or from which errors are shown [default: the first]
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,

    /// Sizes of each method, however long they take: the same rows on every machine
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=12))]
    steps: Option<u32>,

    /// Write the measurements beside the page, too (REPORT.csv)
    #[arg(long)]
    csv: bool,
}

impl From<ReferenceError> for Failure {
    fn from(error: ReferenceError) -> Self {
        let exit = match error {
            ReferenceError::NoReceivers | ReferenceError::Dark => ExitCode::NothingToDo,
            _ => ExitCode::InvalidInput,
        };
        Self::new(exit, error)
    }
}

impl Converge {
    pub(super) fn run(self, session: &mut Session<'_>) -> Result<ExitCode, Failure> {
        let started = Instant::now();
        let output = Output::prepare(&self.output)?;
        let csv_path = self.output.with_extension("csv");
        let csv = self.csv.then(|| Output::prepare(&csv_path)).transpose()?;
        let given = self.reference.as_deref().map(read_reference).transpose()?;
        let scene = scene::read(&self.scene, &session.context)?;
        let camera = match (&given, &self.camera, scene.cameras.first()) {
            // Points need no camera; pictures of the error are left out without one.
            (None | Some(Given::Points { .. }), None, first) => first,
            (_, name, _) => Some(scene::camera(&scene, name.as_deref())?),
        };
        let context = &session.context;
        Footprint::to_prepare(&scene).require(context, || None)?;
        let study = context
            .common
            .install(|| self.measure(&World::new(&scene), camera, given, started, context))??;
        output.write(page::render(&study).as_bytes())?;
        if let Some(csv) = &csv {
            csv.write(&table::to_csv(&study)?)?;
        }
        self.report(&study, csv.is_some().then_some(&csv_path), session)?;
        Ok(ExitCode::Ok)
    }

    fn measure(
        &self,
        world: &World<'_>,
        camera: Option<&Camera>,
        given: Option<Given>,
        started: Instant,
        context: &Context<'_>,
    ) -> Result<Study, Failure> {
        scene::require_light(world)?;
        let receivers = match &given {
            None => reference::POINTS,
            Some(Given::Points { points, .. }) => points.len(),
            Some(Given::Picture { picture, .. }) => picture.image.pixels.len(),
        };
        let held = Footprint::of(world).with("reference", RECEIVER * receivers);
        let first = |family: &Family| family.bytes(0, receivers, world.scene());
        let largest = Family::ALL.iter().map(first).max().unwrap_or(0);
        held.with("the first size of a method", largest)
            .require(context, || None)?;
        let limit = context.common.max_memory;
        let memory = limit.map(|limit| limit.0.get().saturating_sub(held.total()));
        let seed = context.common.seed;
        let time = context.common.time;
        let seconds = time.map_or(SECONDS, |time| time.as_secs_f64());
        let budget = self.steps.map_or(Budget::Seconds(seconds), Budget::Steps);
        let effort = budget.reference();
        let (target, reference) = reference::choose(world, camera, given, effort, seed)?;
        let setup = Setup {
            world,
            target,
            reference,
            camera,
            budget,
            memory,
            seed,
            started,
        };
        Ok(study::run(setup, &context.reporter)?)
    }

    /// Says what was found and where it is.
    fn report(
        &self,
        study: &Study,
        csv: Option<&PathBuf>,
        session: &mut Session<'_>,
    ) -> Result<(), Failure> {
        for family in &study.families {
            let best = family.rows.iter().map(|row| row.error.nrmse);
            let Some(best) = best.min_by(f64::total_cmp) else {
                let (title, reason) = (family.family.title(), &family.stopped);
                session
                    .context
                    .reporter
                    .note(format_args!("{title}: {reason}"));
                continue;
            };
            let sizes = family.rows.last().map_or(0, |row| row.step + 1);
            session.context.reporter.detail(format_args!(
                "{}: {sizes} sizes, best nRMSE {:.3} %. {}",
                family.family.title(),
                100.0 * best,
                family.stopped
            ));
        }
        let rows = table::rows(study).count();
        session.context.reporter.note(format_args!(
            "{rows} measurements in {:.1} s{}",
            study.seconds,
            memory::peak_in_words()
        ));
        let mut paths = vec![self.output.display().to_string()];
        paths.extend(csv.map(|path| path.display().to_string()));
        let text = if session.context.common.json {
            let mut json = table::to_json(study)?;
            json["output"] = paths.into();
            memory::add_peak(&mut json);
            serde_json::to_string_pretty(&json)?
        } else {
            paths.join("\n")
        };
        session.print(&text)
    }
}

/// Reads a reference by what its name ends in.
fn read_reference(path: &Path) -> Result<Given, Failure> {
    if has_extension(path, "exr") {
        return Ok(Given::Picture {
            picture: exr::read(path)?,
            path: path.to_path_buf(),
        });
    }
    let table = PointTable::read(path)?;
    let (estimates, states_error) = table.estimates(path)?;
    Ok(Given::Points {
        points: table.points().to_vec(),
        path: path.to_path_buf(),
        estimates,
        states_error,
    })
}

fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension()
        .is_some_and(|found| found.eq_ignore_ascii_case(extension))
}

/// A path that ends in `.html`.
fn html_path(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if has_extension(&path, "html") || has_extension(&path, "htm") {
        Ok(path)
    } else {
        Err("the report is an HTML page: end its name in .html".into())
    }
}

/// A path that ends in `.csv` or `.exr`.
fn reference_path(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if has_extension(&path, "csv") || has_extension(&path, "exr") {
        Ok(path)
    } else {
        Err("a reference is a table of points (.csv) or a picture (.exr)".into())
    }
}
