//! `luxel render --integrator gather` at 256 × 256 pixels.

use super::measured;
use crate::picture::{example, render};
use crate::references::folder;
use luxel::diff::{Difference, difference};
use luxel::image::exr;

/// The scenes; those with a path-traced picture are held against it.
pub const SCENES: [&str; 3] = ["cornell", "corridor", "office"];

/// A picture and what it took.
#[derive(Clone, Copy, Debug)]
pub struct Rendering {
    /// Seconds, the median.
    pub seconds: f64,
    /// Peak memory in bytes.
    pub peak: Option<u64>,
    /// How far the last picture is from the reference, the noise of the reference included.
    pub difference: Option<Difference>,
}

/// Renders a scene `runs` times for an error of `percent`.
///
/// # Panics
/// When the command fails or a reference cannot be read.
pub fn picture(scene: &str, percent: f64, runs: u64) -> Rendering {
    let file = example(scene);
    let error = format!("{percent}%");
    let (seconds, peak, picture) = measured(runs, |seed| {
        let seed = seed.to_string();
        let options = ["--integrator", "gather", "--size", "256x256"];
        let goal = ["--error", error.as_str(), "--seed", seed.as_str()];
        render(&file, &[options.as_slice(), goal.as_slice()].concat())
    });
    let reference = folder().join(scene).join("image.exr");
    let difference = reference.exists().then(|| {
        let reference = exr::read(&reference).expect("a reference picture");
        difference(&picture.image, &reference.image).expect("pictures of one size")
    });
    Rendering {
        seconds,
        peak,
        difference,
    }
}
