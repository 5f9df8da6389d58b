//! Prints error against time of the final gather on the reference scenes, for a sweep of patches
//! n, rays a row K and gather rays M.
//!
//! Usage: `cargo run --release -p luxel-tests --bin sweep -- [SCENE ...]`

use glam::DVec3;
use luxel_scenes::{Irradiance, Rgb};
use luxel_solver::gather::{Components, GatherConfig, Key, gather};
use luxel_solver::patches::PatchSize;
use luxel_solver::radiosity::{RadiosityConfig, solve};
use luxel_solver::solvers::{Config, Tolerance};
use luxel_solver::world::World;
use serde::Deserialize;
use std::path::Path;
use std::time::Instant;

#[derive(Deserialize)]
struct Reference {
    #[serde(rename = "E")]
    irradiance: Vec<[f64; 3]>,
    #[serde(alias = "uncertainty")]
    stderr: Vec<[f64; 3]>,
    #[serde(rename = "E_direct")]
    direct: Vec<[f64; 3]>,
    position: Vec<[f64; 3]>,
    normal: Vec<[f64; 3]>,
}

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    for (name, sweep) in [
        ("furnace", &[(200, 32, 64), (1000, 64, 256)][..]),
        (
            "cornell",
            &[
                (172, 32, 32),
                (820, 32, 128),
                (1461, 64, 448),
                (2977, 64, 1024),
                (3000, 256, 4096),
            ],
        ),
        ("corridor", &[(1003, 64, 64), (1003, 64, 448)]),
        ("office", &[(2335, 64, 64), (2418, 64, 1024)]),
    ] {
        if wanted.is_empty() || wanted.iter().any(|w| w == name) {
            run(name, sweep);
        }
    }
}

fn run(name: &str, sweep: &[(usize, usize, usize)]) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let file = root.join(format!("references/{name}/irradiance.json"));
    let reference: Reference =
        serde_json::from_slice(&std::fs::read(&file).expect("reference is readable"))
            .expect("valid");
    let path = root.join(format!("../scenes/data/{name}/{name}.toml"));
    let positions: Vec<DVec3> = reference.position.iter().map(|&p| p.into()).collect();
    let normals: Vec<DVec3> = reference.normal.iter().map(|&p| p.into()).collect();
    let keys: Vec<Key> = (0..positions.len() as u64).map(Key::of).collect();
    println!(
        "{name}:     n     K     M    S | load   mesh  solve gather  total s | nRMSE %  relRMSE %  bias %  direct nRMSE %, bias % | stated SE %"
    );
    for &(n, k, m) in sweep {
        let start = Instant::now();
        let scene = luxel_scenes::load(&path).expect("scene loads").scene;
        let world = World::new(&scene);
        let loaded = start.elapsed().as_secs_f64();
        let patches = world.mesh(PatchSize::Count(n)).expect("meshes");
        let meshed = start.elapsed().as_secs_f64();
        let replicates = 4;
        let shadow = (3 * m / 4).clamp(16, 1024);
        let solutions: Vec<_> = (0..replicates)
            .map(|replicate| {
                let config = RadiosityConfig {
                    rays: k / replicates,
                    shadow_rays: 1,
                    solver: Config {
                        tolerance: Tolerance::Error(1e-5),
                        max_iterations: 1000,
                    },
                    seed: 0,
                    replicate: replicate as u64,
                };
                solve(&world, &patches, &config).expect("solves")
            })
            .collect();
        let solved = start.elapsed().as_secs_f64();
        let receivers = world.receivers(&positions, &normals);
        let config = GatherConfig {
            rays: m,
            shadow_rays: shadow,
            replicates,
            components: Components::All,
            seed: 0,
        };
        let result = gather(&world, &patches, &solutions, &receivers, &keys, &config);
        let total = start.elapsed().as_secs_f64();
        let values: Vec<Irradiance> = result
            .iter()
            .map(luxel_solver::gather::Gathered::irradiance)
            .collect();
        let direct: Vec<Irradiance> = result.iter().map(|g| g.direct).collect();
        let error = Errors::new(&values, &reference.irradiance, &reference.stderr);
        let direct = Errors::new(&direct, &reference.direct, &vec![[0.0; 3]; direct.len()]);
        let se = (result
            .iter()
            .map(|g| g.standard_error.0.length_squared())
            .sum::<f64>()
            / (3 * result.len()) as f64)
            .sqrt()
            / error.mean;
        println!(
            "{:>14} {k:>5} {m:>5} {shadow:>4} | {:.3} {:.3} {:.3} {:.3} {:.3} | {:.3} {:.2} {:+.3} {:.3} {:+.3} | {:.3} iterations {} {}",
            patches.len(),
            loaded,
            meshed - loaded,
            solved - meshed,
            total - solved,
            total,
            100.0 * error.nrmse,
            100.0 * error.relative,
            100.0 * error.bias,
            100.0 * direct.nrmse,
            100.0 * direct.bias,
            100.0 * se,
            solutions[0].iterations,
            solutions[0].buried_points,
        );
    }
}

struct Errors {
    mean: f64,
    nrmse: f64,
    relative: f64,
    bias: f64,
}

impl Errors {
    fn new(values: &[Irradiance], reference: &[[f64; 3]], stderr: &[[f64; 3]]) -> Self {
        let count = (3 * values.len()) as f64;
        let mean = reference.iter().flatten().sum::<f64>() / count;
        let floor = 0.01 * mean;
        let (mut square, mut relative, mut signed) = (0.0, 0.0, 0.0);
        for ((value, reference), stderr) in values.iter().zip(reference).zip(stderr) {
            let difference = value.0 - Rgb::from(*reference);
            for c in 0..3 {
                let variance = stderr[c] * stderr[c];
                square += difference[c].powi(2) - variance;
                relative +=
                    (difference[c].powi(2) - variance) / (reference[c].powi(2) + floor * floor);
                signed += difference[c];
            }
        }
        Self {
            mean,
            nrmse: (square / count).max(0.0).sqrt() / mean,
            relative: (relative / count).max(0.0).sqrt(),
            bias: signed / count / mean,
        }
    }
}
