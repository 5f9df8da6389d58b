//! Prints, as Markdown tables, the error and the time of the final gather at the points of the
//! reference scenes, for a sweep of its budgets: patches n, rays K of a row in each of four
//! solutions, gather rays M and shadow rays S of a point. Where the defaults of the command come
//! from, and where a change of the gather shows first.
//!
//! Usage: `cargo run --release -p luxel-tests --bin sweep -- [SCENE[@SEED]] [n,K,M ...]`: all scenes
//! with budgets of their own, one scene, or one scene with the given budgets.
//!
//! Errors are those of [`luxel_tests::metrics`], the reference's own variance subtracted. The next
//! columns are the root mean squares of the errors that the gather states, over the mean: direct
//! light, gather rays, solution, mesh, and all together; then the share of the values that are within
//! two of the stated errors. Times are of this machine, now.

use luxel_scenes::{Irradiance, Rgb};
use luxel_solver::gather::{
    Components, GatherConfig, Gathered, Key, Lookup, MAX_REPLICATES, SkyRays, Solutions, finish,
    gather,
};
use luxel_solver::patches::{PatchSize, Patches};
use luxel_solver::radiosity::{RadiosityConfig, RadiositySolution, solve};
use luxel_solver::solvers::{Config, Tolerance};
use luxel_solver::world::World;
use luxel_tests::metrics::Errors;
use luxel_tests::picture::example;
use luxel_tests::references::IrradianceReference;
use std::time::Instant;

/// What is spent.
#[derive(Clone, Copy)]
struct Budget {
    patches: usize,
    row_rays: usize,
    rays: usize,
}

const fn budget(patches: usize, row_rays: usize, rays: usize) -> Budget {
    Budget {
        patches,
        row_rays,
        rays,
    }
}

/// Rising budgets for each scene; the one before the last is the command's default.
const SWEEPS: [(&str, &[Budget]); 4] = [
    ("furnace", &[budget(200, 8, 64), budget(1000, 16, 256)]),
    (
        "cornell",
        &[
            budget(800, 16, 64),
            budget(1500, 16, 256),
            budget(6000, 32, 1024),
            budget(16_000, 32, 8192),
        ],
    ),
    (
        "corridor",
        &[
            budget(1000, 32, 64),
            budget(2500, 32, 256),
            budget(6000, 32, 1024),
            budget(16_000, 32, 8192),
        ],
    ),
    (
        "office",
        &[
            budget(1500, 32, 64),
            budget(2500, 32, 256),
            budget(6000, 32, 1024),
            budget(16_000, 32, 8192),
        ],
    ),
];

fn main() -> Result<(), String> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some((wanted, budgets)) = arguments.split_first() else {
        for (scene, budgets) in SWEEPS {
            sweep(scene, 0, budgets);
        }
        return Ok(());
    };
    let (wanted, seed) = match wanted.split_once('@') {
        Some((wanted, seed)) => (
            wanted,
            seed.parse().map_err(|_| format!("{seed:?} is no seed"))?,
        ),
        None => (wanted.as_str(), 0),
    };
    let known = SWEEPS.iter().find(|(scene, _)| *scene == wanted);
    let (scene, own) = known.ok_or_else(|| format!("there is no scene {wanted:?}"))?;
    let given = budgets
        .iter()
        .map(|text| parse(text).ok_or_else(|| format!("{text:?} is not n,K,M")))
        .collect::<Result<Vec<Budget>, String>>()?;
    sweep(scene, seed, if given.is_empty() { own } else { &given });
    Ok(())
}

fn parse(text: &str) -> Option<Budget> {
    let numbers: Vec<usize> = text
        .split(',')
        .map(|n| n.parse().ok())
        .collect::<Option<_>>()?;
    match numbers[..] {
        [patches, row_rays, rays] => Some(budget(patches, row_rays, rays)),
        _ => None,
    }
}

/// Prints the table of a scene.
fn sweep(scene: &str, seed: u64, budgets: &[Budget]) {
    println!("\n{scene}\n");
    println!(
        "| n | K | M | S | nRMSE % | relRMSE % | bias % | direct % | gather % | solution % | mesh % \
         | all % | within % | load s | mesh s | solve s | gather s |"
    );
    println!("|{}", "--:|".repeat(17));
    let reference = IrradianceReference::load(scene);
    for budget in budgets {
        println!("{}", row(scene, seed, &reference, *budget));
    }
}

/// Computes one row.
fn row(name: &str, seed: u64, reference: &IrradianceReference, budget: Budget) -> String {
    let mut started = Instant::now();
    let mut lap = || {
        let seconds = started.elapsed().as_secs_f64();
        started = Instant::now();
        seconds
    };
    let scene = luxel_scenes::load(example(name)).expect("an example scene");
    let world = World::new(&scene.scene);
    let load = lap();
    let mesh_of = |count: usize| world.mesh(PatchSize::Count(count)).expect("few patches");
    let patches = mesh_of(budget.patches);
    let coarse = mesh_of(budget.patches / 4);
    let mesh = lap();
    let solutions_on = |patches: &Patches| -> Vec<RadiositySolution> {
        (0..MAX_REPLICATES as u64)
            .map(|replicate| {
                let config = RadiosityConfig {
                    rays: budget.row_rays,
                    shadow_rays: 1,
                    solver: Config {
                        tolerance: Tolerance::Error(1e-7),
                        max_iterations: 20_000,
                    },
                    seed,
                    replicate,
                };
                solve(&world, patches, &config).expect("reflectances below 1")
            })
            .collect()
    };
    let count = patches.len();
    let (fine, beside) = (solutions_on(&patches), solutions_on(&coarse));
    let lookup = Lookup::new(patches, &fine).with_coarse(coarse, &beside);
    let solution = lap();
    let receivers = world.receivers(&reference.position, &reference.normal);
    let keys: Vec<Key> = (0..receivers.len() as u64).map(Key::of).collect();
    let config = GatherConfig {
        rays: budget.rays,
        rays_before: 0,
        shadow_rays: (3 * budget.rays / 4).min(1024),
        sky: SkyRays::Gather,
        gathers: MAX_REPLICATES,
        solutions: Solutions::All,
        components: Components::All,
        seed,
    };
    let gathered = finish(&gather(&world, Some(&lookup), &receivers, &keys, &config));
    let gathering = lap();

    let values: Vec<Rgb> = gathered.iter().map(|g| g.irradiance().0).collect();
    let errors = Errors::new(&values, &reference.irradiance, &reference.standard_error);
    let level =
        values.iter().map(|value| value.element_sum()).sum::<f64>() / values.len() as f64 / 3.0;
    let rms = |part: fn(&Gathered) -> Irradiance| {
        let squares: f64 = gathered.iter().map(|g| part(g).0.length_squared()).sum();
        100.0 * (squares / (3.0 * gathered.len() as f64)).sqrt() / level
    };
    let within = gathered
        .iter()
        .zip(reference.irradiance.iter().zip(&reference.standard_error))
        .flat_map(|(g, (expected, own))| {
            let error = g.standard_error().0;
            let allowed = 2.0 * (error * error + *own * *own).map(f64::sqrt);
            let off = (g.irradiance().0 - *expected).abs();
            (0..3).map(move |c| off[c] <= allowed[c])
        });
    let within: Vec<bool> = within.collect();
    let share = within.iter().filter(|&&is| is).count() as f64 / within.len() as f64;
    let percent = [errors.nrmse, errors.rel_rmse, errors.bias, share].map(|x| 100.0 * x);
    let [nrmse, relative, bias, within] = percent;
    format!(
        "| {count} | {} | {} | {} | {nrmse:.3} | {relative:.2} | {bias:+.3} | {:.3} | {:.3} | {:.3} | {:.3} \
         | {:.3} | {within:.1} | {load:.3} | {mesh:.3} | {solution:.3} | {gathering:.3} |",
        budget.row_rays,
        budget.rays,
        config.shadow_rays,
        rms(|g| g.direct_noise),
        rms(|g| g.gather_noise),
        rms(|g| g.solution_noise),
        rms(|g| g.discretisation),
        rms(Gathered::standard_error),
    )
}
