//! `luxel render --integrator gather` at 256 × 256 pixels.

use super::measured;
use crate::command::{arg, luxel};
use crate::picture::example;
use crate::references::folder;
use luxel::cli::ExitCode;
use luxel::diff::{Difference, difference};
use luxel::image::exr;

/// What luxel's picture of a scene is held against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// A path-traced picture.
    PathTraced,
    /// Nothing: only the stated error is known.
    Nothing,
}

/// The scenes with their references. There is none of the corridor, whose camera sees the dark end alone.
pub const SCENES: [(&str, Reference); 3] = [
    ("cornell", Reference::PathTraced),
    ("corridor", Reference::Nothing),
    ("office", Reference::PathTraced),
];

/// A picture and what it took.
#[derive(Clone, Copy, Debug)]
pub struct Rendering {
    /// Seconds, the median.
    pub seconds: f64,
    /// Peak memory in bytes.
    pub peak: Option<u64>,
    /// Relative error that the last picture states.
    pub stated: f64,
    /// How far the last picture is from the reference, where there is one, its noise included.
    pub difference: Option<Difference>,
}

/// Renders a scene `runs` times for an error of `percent`.
///
/// # Panics
/// When the command fails, other than by missing the error, or a reference cannot be read.
pub fn picture(scene: &str, reference: Reference, percent: f64, runs: u64) -> Rendering {
    let folder_of_runs = tempfile::tempdir().expect("a temporary folder");
    let output = folder_of_runs.path().join("out.exr");
    let file = example(scene);
    let error = format!("{percent}%");
    let (seconds, peak, stated) = measured(runs, |seed| {
        let seed = seed.to_string();
        let mut arguments = vec!["render", arg(&file), "-o", arg(&output), "-q", "--json"];
        arguments.extend(["--integrator", "gather", "--size", "256x256"]);
        arguments.extend(["--error", error.as_str(), "--seed", seed.as_str()]);
        let outcome = luxel(&arguments);
        if outcome.exit != ExitCode::TargetMissed {
            outcome.assert_success();
        }
        outcome.json()["error"]["total"].as_f64()
    });
    let difference = (reference == Reference::PathTraced).then(|| {
        let picture = exr::read(&output).expect("a picture");
        let reference = folder().join(scene).join("image.exr");
        let reference = exr::read(&reference).expect("a reference picture");
        difference(&picture.image, &reference.image).expect("pictures of one size")
    });
    Rendering {
        seconds,
        peak,
        stated: stated.expect("a stated error"),
        difference,
    }
}
