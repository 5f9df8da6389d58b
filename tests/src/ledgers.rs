//! The energy ledger of the example scenes after every solver.

use crate::picture::example;
use luxel_scenes::{Irradiance, load};
use luxel_solver::form_factors::{AnalyticConfig, RayCastConfig, analytic_factors, ray_cast};
use luxel_solver::patches::PatchSize;
use luxel_solver::solvers::{
    Ambient, Config, Ledger, Solution, System, Tolerance, conjugate_gradient, direct, gauss_seidel,
    jacobi, no_progress, source, southwell,
};
use luxel_solver::transport::{Dense, Symmetrised, Transport};
use luxel_solver::world::World;

/// What a solver's ledger leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// Name of the solver.
    pub solver: &'static str,
    /// The error that was asked for; `None` for a direct solver.
    pub tolerance: Option<f64>,
    /// |emitted − absorbed − escaped| / emitted, in the worst channel.
    pub unaccounted: f64,
}

/// Tolerances that iterative solvers are asked for.
const TOLERANCES: [f64; 2] = [1e-4, 1e-9];

/// Patches of the office, which has too many faces for one each.
const OFFICE_PATCHES: usize = 400;

/// The ledgers of all solvers on an example scene, its faces as patches.
///
/// # Panics
/// When there is no such scene.
pub fn ledgers(name: &str) -> Vec<Entry> {
    let office = name == "office";
    let size = if office {
        PatchSize::Count(OFFICE_PATCHES)
    } else {
        PatchSize::Whole
    };
    let loaded = load(example(name)).expect("an example scene");
    let world = World::new(&loaded.scene);
    let patches = world.mesh(size).expect("a mesh");
    let frame = world.surfaces().geometry().frame();
    let areas = patches.areas().iter().map(|&a| frame.area_to_world(a));
    let areas: Vec<f64> = areas.collect();
    // What is left must not depend on how exact the factors are, only on their being reciprocal.
    let transport: Box<dyn Transport> = if office {
        // Too many pairs for exact factors: rays, made reciprocal.
        let config = RayCastConfig {
            rays: 1024,
            seed: 1,
        };
        let cast = ray_cast(&world, &patches, &config);
        let factors = Dense::new(patches.len(), cast.factors).expect("factors");
        Box::new(Symmetrised::new(&factors, &areas))
    } else {
        let config = AnalyticConfig {
            accuracy: 1e-6,
            points: 40,
            seed: 1,
        };
        Box::new(analytic_factors(&world, &patches, &config).matrix)
    };
    let (reflectance, emission) = (patches.reflectances(), patches.emissions());
    let none = vec![Irradiance::ZERO; areas.len()];
    let source = source(emission, reflectance, &none);
    let system = System::new(&*transport, &areas, reflectance, &source).expect("a valid system");
    let entry = |solver, tolerance, solution: &Solution| {
        let ledger = Ledger::new(&system, solution, emission, &none);
        let open = ledger.emitted.0 - ledger.absorbed.0 - ledger.escaped.0;
        Entry {
            solver,
            tolerance,
            unaccounted: (open / ledger.emitted.0).abs().max_element(),
        }
    };
    let mut entries = vec![entry(
        "LU",
        None,
        &direct(&system).expect("a regular matrix"),
    )];
    for tolerance in TOLERANCES {
        let config = Config {
            tolerance: Tolerance::Error(tolerance),
            max_iterations: 10_000,
        };
        for (solver, solution) in [
            ("Jacobi", jacobi(&system, &config, no_progress)),
            ("Gauss–Seidel", gauss_seidel(&system, &config, no_progress)),
            (
                "Southwell",
                southwell(&system, Ambient::None, &config, no_progress),
            ),
            (
                "conjugate gradient",
                conjugate_gradient(&system, &config, no_progress).expect("reciprocal"),
            ),
        ] {
            entries.push(entry(solver, Some(tolerance), &solution));
        }
    }
    entries
}
