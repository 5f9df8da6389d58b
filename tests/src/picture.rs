//! `luxel render` and what is in its pictures.

use crate::command::{arg, luxel};
use luxel::image::exr::{self, Picture};
use luxel_scenes::Rgb;
use std::path::{Path, PathBuf};

/// The file of an example scene.
pub fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../scenes/data/{name}/{name}.toml"))
}

/// Renders a scene file.
///
/// # Panics
/// When the command fails; the message is its own.
#[track_caller]
pub fn render(scene: &Path, options: &[&str]) -> Picture {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out.exr");
    let mut args = vec!["render", arg(scene), "-o", arg(&out), "-q"];
    args.extend(options);
    luxel(&args).assert_success();
    exr::read(&out).expect("a picture")
}

/// Value and standard error of each pixel, in the picture's unit.
///
/// # Panics
/// When the picture has no layer of standard errors.
#[track_caller]
pub fn pixels(picture: &Picture) -> Vec<(Rgb, Rgb)> {
    let errors = picture.layers.iter().find(|(name, _)| name == "error");
    let (_, errors) = errors.expect("pictures carry their standard error");
    let vector = |pixel: &[f32; 3]| Rgb::from_array(pixel.map(f64::from));
    let values = picture.image.pixels.iter().map(vector);
    values.zip(errors.pixels.iter().map(vector)).collect()
}
