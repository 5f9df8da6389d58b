//! Prints, as Markdown tables, the error and the time of the final gather at the points of the
//! reference scenes, for a sweep of its budgets: patches n, rays K of a row in each of four
//! solutions, gather rays M and shadow rays S of a point. Where the defaults of the command come
//! from, and where a change of the gather shows first.
//!
//! Usage: `cargo run --release -p luxel-tests --bin sweep -- [SCENE] [n,K,M ...]`: all scenes with
//! budgets of their own, one scene, or one scene with the given budgets.
//!
//! Errors are those of [`luxel_tests::metrics`], the reference's own variance subtracted; `stated`
//! is the root mean square of the standard errors that the gather states, over the mean: what of the
//! error is noise. Times are of this machine, now.

use luxel_scenes::Rgb;
use luxel_solver::gather::{Components, GatherConfig, Key, gather};
use luxel_solver::patches::PatchSize;
use luxel_solver::radiosity::{RadiosityConfig, solve};
use luxel_solver::solvers::{Config, Tolerance};
use luxel_solver::world::World;
use luxel_tests::metrics::Errors;
use luxel_tests::picture::example;
use luxel_tests::references::IrradianceReference;
use std::time::Instant;

/// Independent solutions and sets of gather rays, as in the command.
const REPLICATES: usize = 4;

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
            sweep(scene, budgets);
        }
        return Ok(());
    };
    let known = SWEEPS.iter().find(|(scene, _)| scene == wanted);
    let (scene, own) = known.ok_or_else(|| format!("there is no scene {wanted:?}"))?;
    let given = budgets
        .iter()
        .map(|text| parse(text).ok_or_else(|| format!("{text:?} is not n,K,M")))
        .collect::<Result<Vec<Budget>, String>>()?;
    sweep(scene, if given.is_empty() { own } else { &given });
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
fn sweep(scene: &str, budgets: &[Budget]) {
    println!("\n{scene}\n");
    println!(
        "| n | K | M | S | nRMSE % | relRMSE % | bias % | stated % | load s | mesh s | solve s | gather s |"
    );
    println!("|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
    let reference = IrradianceReference::load(scene);
    for budget in budgets {
        println!("{}", row(scene, &reference, *budget));
    }
}

/// Computes one row.
fn row(name: &str, reference: &IrradianceReference, budget: Budget) -> String {
    let mut started = Instant::now();
    let mut lap = || {
        let seconds = started.elapsed().as_secs_f64();
        started = Instant::now();
        seconds
    };
    let scene = luxel_scenes::load(example(name)).expect("an example scene");
    let world = World::new(&scene.scene);
    let load = lap();
    let size = PatchSize::Count(budget.patches);
    let patches = world.mesh(size).expect("few patches");
    let mesh = lap();
    let solutions: Vec<_> = (0..REPLICATES as u64)
        .map(|replicate| {
            let config = RadiosityConfig {
                rays: budget.row_rays,
                shadow_rays: 1,
                solver: Config {
                    tolerance: Tolerance::Error(1e-7),
                    max_iterations: 20_000,
                },
                seed: 0,
                replicate,
            };
            solve(&world, &patches, &config).expect("reflectances below 1")
        })
        .collect();
    let solution = lap();
    let receivers = world.receivers(&reference.position, &reference.normal);
    let keys: Vec<Key> = (0..receivers.len() as u64).map(Key::of).collect();
    let config = GatherConfig {
        rays: budget.rays,
        shadow_rays: (3 * budget.rays / 4).min(1024),
        replicates: REPLICATES,
        components: Components::All,
        seed: 0,
    };
    let gathered = gather(&world, &patches, &solutions, &receivers, &keys, &config);
    let gathering = lap();

    let values: Vec<Rgb> = gathered.iter().map(|g| g.irradiance().0).collect();
    let errors = Errors::new(&values, &reference.irradiance, &reference.standard_error);
    let squares: f64 = gathered
        .iter()
        .map(|g| g.standard_error.0.length_squared())
        .sum();
    let total: f64 = values.iter().map(|value| value.element_sum()).sum();
    let count = 3.0 * values.len() as f64;
    let stated = (squares / count).sqrt() / (total / count);
    let percent = [errors.nrmse, errors.rel_rmse, errors.bias, stated].map(|x| 100.0 * x);
    let [nrmse, relative, bias, stated] = percent;
    format!(
        "| {} | {} | {} | {} | {nrmse:.3} | {relative:.2} | {bias:+.3} | {stated:.3} | {load:.3} | {mesh:.3} \
         | {solution:.3} | {gathering:.3} |",
        patches.len(),
        budget.row_rays,
        budget.rays,
        config.shadow_rays,
    )
}
