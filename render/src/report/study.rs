//! The study: every family of methods over growing sizes, against one reference.
//!
//! A family is run at sizes that grow geometrically until the next one would not fit into its share of
//! the time, or until as many sizes are done as were asked for. Every size becomes one row per
//! solver. What a row holds besides seconds depends on the input and the seed alone.

use super::budget::{Budget, Clock};
use super::checks::Check;
use super::false_colour::{self, Gallery, Picture};
use super::family::Family;
use super::machine::Machine;
use super::measure::{Kept, measure};
use super::metrics::Errors;
use super::reference::{Reference, ReferenceError};
use super::solver::Solver;
use super::solver_study::{self, SolverStudy};
use super::target::{Kind, Target};
use crate::progress::Progress;
use luxel_scenes::Camera;
use luxel_solver::world::World;
use serde::Serialize;
use std::time::Instant;

/// The estimated parts of an error, as ratios to the mean of the reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Parts {
    /// Bound on what the iteration leaves.
    pub solver: f64,
    /// Standard error, root mean square; `None` where the method states none.
    pub sampling: Option<f64>,
    /// Estimated error of the mesh, root mean square; `None` where there is no estimate.
    pub discretisation: Option<f64>,
}

/// One measurement.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// The method.
    pub family: Family,
    /// The solver of classical radiosity.
    pub solver: Option<Solver>,
    /// Number of the size, from 0.
    pub step: u32,
    /// Patches of the mesh.
    pub patches: Option<usize>,
    /// Rays cast, or paths of the path tracer, all together.
    pub rays: Option<u64>,
    /// Iterations of the solver.
    pub iterations: Option<usize>,
    /// Time of everything but reading the scene and building its ray tree.
    pub seconds: f64,
    /// Time of the solver alone.
    pub solver_seconds: Option<f64>,
    /// Against the reference.
    pub error: Errors,
    /// As the method states it.
    pub stated: Parts,
    /// Share of values within two standard errors (and the stated discretisation) of the reference.
    pub within_two: Option<f64>,
    /// Mean over receivers and channels, in the unit of the values.
    pub mean: f64,
}

impl Row {
    /// All stated parts together. `None` when the method does not state what matters: sampling where
    /// it samples receivers, discretisation where it looks up a mesh.
    pub fn stated_total(&self) -> Option<f64> {
        let Parts {
            solver,
            sampling,
            discretisation,
        } = self.stated;
        let matters = match self.family {
            Family::Gather | Family::Path => sampling,
            _ => discretisation,
        };
        matters?;
        let squares = |part: Option<f64>| part.map_or(0.0, |part| part * part);
        Some((solver * solver + squares(sampling) + squares(discretisation)).sqrt())
    }
}

/// What became of a family.
#[derive(Clone, Debug, Serialize)]
pub struct FamilyResult {
    /// The family.
    pub family: Family,
    /// Its measurements, size by size.
    pub rows: Vec<Row>,
    /// Why there are no more.
    pub stopped: String,
    /// Of the largest size.
    pub check: Option<Check>,
}

/// Everything that was measured.
pub struct Study {
    /// Name of the scene.
    pub scene: String,
    /// Faces of the scene.
    pub faces: usize,
    /// The seed.
    pub seed: u64,
    /// Where it ran.
    pub machine: Machine,
    /// What was compared with.
    pub reference: Reference,
    /// What a value is.
    pub quantity: Quantity,
    /// Receivers, and those of them that a mesh can be looked up at.
    pub receivers: [usize; 2],
    /// The families.
    pub families: Vec<FamilyResult>,
    /// The solvers on one system; `None` when there is no mesh.
    pub solvers: Option<SolverStudy>,
    /// False-colour pictures of errors.
    pub pictures: Gallery,
    /// Time of everything.
    pub seconds: f64,
}

/// What is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Irradiance at points.
    Irradiance,
    /// Radiance of pixels.
    Radiance {
        /// Width and height of the picture.
        size: [usize; 2],
    },
}

/// What a study is made of.
pub struct Setup<'a, 'w> {
    /// The scene.
    pub world: &'a World<'w>,
    /// Where methods are compared.
    pub target: Target,
    /// What with.
    pub reference: Reference,
    /// From where errors are shown, if from anywhere.
    pub camera: Option<&'a Camera>,
    /// How much is measured.
    pub budget: Budget,
    /// Memory that a size may take, in bytes, if there is a limit.
    pub memory: Option<usize>,
    /// Seed of all randomness.
    pub seed: u64,
    /// When the work began.
    pub started: Instant,
}

/// Runs a study.
///
/// # Errors
/// When no light reaches what the camera sees.
pub fn run(setup: Setup<'_, '_>, progress: &dyn Progress) -> Result<Study, ReferenceError> {
    let world = setup.world;
    let scene = world.scene();
    let mut families = Vec::new();
    let mut kept = Vec::new();
    for (index, &family) in Family::ALL.iter().enumerate() {
        let elapsed = setup.started.elapsed().as_secs_f64();
        let clock = Clock::new(setup.budget, elapsed, index);
        progress.start(family.title(), u64::from(clock.max_steps(family)));
        let (result, keep) = measure(&setup, family, &clock, progress);
        progress.finish();
        families.push(result);
        kept.push(keep);
    }
    progress.start("comparing solvers", 1);
    let system = kept
        .iter_mut()
        .find_map(|kept: &mut Kept| kept.system.take());
    let solvers = solver_study::compare(world, system, setup.seed);
    progress.finish();
    progress.start("pictures of errors", 1);
    let pictures = pictures(&setup, &kept)?;
    progress.finish();
    let on_surface = setup.target.on_surface().iter().filter(|&&on| on).count();
    Ok(Study {
        scene: scene.name.clone(),
        faces: scene.faces.len(),
        seed: setup.seed,
        machine: Machine::this(),
        quantity: match setup.target.kind() {
            Kind::Points(_) => Quantity::Irradiance,
            Kind::Pixels(frame) => Quantity::Radiance { size: frame.size() },
        },
        receivers: [setup.target.len(), on_surface],
        reference: setup.reference,
        families,
        solvers,
        pictures,
        seconds: setup.started.elapsed().as_secs_f64(),
    })
}

/// False-colour pictures of each family's error.
fn pictures(setup: &Setup<'_, '_>, kept: &[Kept]) -> Result<Gallery, ReferenceError> {
    if let Kind::Pixels(frame) = setup.target.kind() {
        let shown: Vec<Picture> = Family::ALL
            .iter()
            .zip(kept)
            .filter_map(|(&family, kept)| {
                let estimates = kept.estimates.as_ref()?;
                Some(Picture::new(family, "the largest size".into(), estimates))
            })
            .collect();
        let reference = &setup.reference;
        return Ok(false_colour::gallery(frame.size(), None, reference, shown));
    }
    let Some(camera) = setup.camera else {
        return Ok(Gallery::none("The scene has no camera."));
    };
    let fields = kept.iter().filter_map(|kept| kept.field.as_ref());
    false_colour::from_camera(setup, camera, fields, setup.budget.pictures())
}
