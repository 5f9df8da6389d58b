//! `luxel probe --error` at very many points of the reference scenes.

use super::measured;
use crate::accuracy::scenes::reference;
use crate::command::{arg, luxel};
use crate::metrics::Errors;
use crate::picture::example;
use crate::probe::estimates;
use crate::references::{IrradianceReference, points_csv};
use glam::DVec3;
use luxel::cli::ExitCode;
use luxel_scenes::Rgb;
use luxel_solver::geometry::{Geometry, TriangleId};
use luxel_solver::sampling::{Discrete, Stage, hash, triangle};

/// The scenes with numbers of points, those of the reference among them.
pub const FIELDS: [(&str, usize); 5] = [
    ("cornell", 100_000),
    ("corridor", 100_000),
    ("office", 100_000),
    ("cornell", 1_000_000),
    ("corridor", 1_000_000),
];

/// Many points and what they took.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// Seconds, the median.
    pub seconds: f64,
    /// Peak memory in bytes.
    pub peak: Option<u64>,
    /// True errors of the last run at the points of the reference.
    pub errors: Errors,
    /// What it states there, relative, rms over mean.
    pub stated: f64,
}

/// Probes a scene `runs` times at `count` points, those of its reference first, for an error of `percent`.
///
/// # Panics
/// When the command fails, other than by missing the error, or there are fewer points than in the reference.
pub fn field(scene: &str, count: usize, percent: f64, runs: u64) -> Field {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [points, out] = ["points.csv", "out.csv"].map(|name| folder.path().join(name));
    let reference = reference(scene);
    std::fs::write(&points, points_csv(points_of(&reference, count))).expect("a table of points");
    let file = example(scene);
    let error = format!("{percent}%");
    let (seconds, peak, ()) = measured(runs, |seed| {
        let seed = seed.to_string();
        let mut arguments = vec!["probe", arg(&file), "--points", arg(&points), "-q"];
        arguments.extend(["--error", &error, "--seed", &seed, "-o", arg(&out)]);
        let outcome = luxel(&arguments);
        if outcome.exit != ExitCode::TargetMissed {
            outcome.assert_success();
        }
    });
    let known = reference.position.len();
    let found = estimates(&out);
    let (values, errors): (Vec<Rgb>, Vec<Rgb>) = found
        .iter()
        .take(known)
        .map(|estimate| (estimate.value, estimate.standard_error))
        .unzip();
    let square: f64 = errors.iter().map(|error| error.length_squared()).sum();
    let level: f64 = values.iter().map(|value| value.element_sum()).sum();
    let channels = 3.0 * known as f64;
    Field {
        seconds,
        peak,
        errors: Errors::new(&values, &reference.irradiance, &reference.standard_error),
        stated: (square / channels).sqrt() / (level / channels),
    }
}

/// The points of a reference, then others on the faces of its scene, evenly by area.
fn points_of(reference: &IrradianceReference, count: usize) -> Vec<(DVec3, DVec3)> {
    let loaded = luxel_scenes::load(example(&reference.scene)).expect("an example scene");
    let geometry = Geometry::new(&loaded.scene);
    let area = |index: usize| {
        let [a, b, c] = geometry.triangle(TriangleId(index as u32));
        0.5 * (b - a).cross(c - a).length()
    };
    let areas = Discrete::new((0..geometry.len()).map(area)).expect("a scene with faces");
    let on_a_face = |index: u64| {
        let u = |k| hash::uniform(0, Stage::CAMERA, index, k);
        let id = TriangleId(areas.sample(u(0)).index as u32);
        let [a, b, c] = geometry.triangle(id);
        let [x, y, z] = triangle::sample([u(1), u(2)]);
        let position = geometry.frame().to_world(a * x + b * y + c * z);
        (position, geometry.normal(geometry.face(id)))
    };
    let own = reference.position.iter().zip(&reference.normal);
    let own = own.map(|(&position, &normal)| (position, normal));
    let further = count - reference.position.len();
    own.chain((0..further as u64).map(on_a_face)).collect()
}
