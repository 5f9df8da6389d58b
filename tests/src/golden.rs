//! Golden images: what the program draws today, to notice when it changes.
//!
//! A golden image is no proof of being right; the exact cases are. It holds everything else in
//! place. `tests/golden/NAME.exr` holds the image as linear radiance. Where an image differs, the
//! test fails and writes `NAME.png` with expected | difference | actual side by side into
//! `target/golden`. `LUXEL_BLESS=1 cargo test` replaces the golden images and still fails that
//! run, so that blessing never passes for testing.

use luxel::diff::difference;
use luxel::image::{Image, exr, png};
use luxel::tone_map::ToneMap;
use std::path::{Path, PathBuf};

/// Compares `image` with the golden image `name`; `max_nrmse` is the largest allowed root mean
/// squared difference over the mean of the golden image.
///
/// # Panics
/// When they differ by more, when the golden image is missing, and after blessing.
#[track_caller]
pub fn assert_golden(name: &str, image: &Image, max_nrmse: f64) {
    let golden = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("golden/{name}.exr"));
    if std::env::var_os("LUXEL_BLESS").is_some() {
        let picture = exr::Picture {
            image: image.clone(),
            layers: Vec::new(),
            origin: None,
        };
        write(
            &golden,
            &exr::encode(&picture).expect("a picture of one layer"),
        );
        panic!(
            "blessed {}; look at it, then run again without LUXEL_BLESS",
            golden.display()
        );
    }
    assert!(
        golden.exists(),
        "{} is missing; look at the image and bless it with LUXEL_BLESS=1",
        golden.display()
    );
    let expected = exr::read(&golden).expect("a golden image").image;
    let complaint = match difference(image, &expected) {
        Ok(difference) if difference.nrmse <= max_nrmse => return,
        Ok(difference) => format!("differs: {difference:?}, allowed nRMSE {max_nrmse}"),
        Err(error) => error.to_string(),
    };
    let panel = output_folder().join(format!("{name}.png"));
    let bytes = png::encode(&side_by_side(&expected, image), ToneMap { exposure: 1.0 });
    write(&panel, &bytes.expect("a picture of some size"));
    panic!("{name} {complaint}; see {}", panel.display());
}

/// Expected, absolute difference and actual image in a row; the difference is brightened four
/// times, and black where only one image has a pixel.
pub fn side_by_side(expected: &Image, actual: &Image) -> Image {
    let width = expected.width.max(actual.width);
    let height = expected.height.max(actual.height);
    let at = |image: &Image, x: usize, y: usize| {
        (x < image.width && y < image.height).then(|| image.pixels[y * image.width + x])
    };
    let mut pixels = Vec::with_capacity(3 * width * height);
    for y in 0..height {
        for panel in 0..3 {
            for x in 0..width {
                let (e, a) = (at(expected, x, y), at(actual, x, y));
                let pixel = match (panel, e, a) {
                    (0, e, _) => e,
                    (1, Some(e), Some(a)) => Some([0, 1, 2].map(|c| 4.0 * (e[c] - a[c]).abs())),
                    (1, ..) => None,
                    (_, _, a) => a,
                };
                pixels.push(pixel.unwrap_or_default());
            }
        }
    }
    Image {
        width: 3 * width,
        height,
        pixels,
    }
}

/// `golden` in the build folder, which the running test lies in.
fn output_folder() -> PathBuf {
    let executable = std::env::current_exe().expect("a running test has a path");
    let build = executable
        .ancestors()
        .nth(3)
        .expect("tests lie in target/PROFILE/deps");
    build.join("golden")
}

fn write(path: &Path, bytes: &[u8]) {
    let folder = path.parent().expect("a file lies in a folder");
    std::fs::create_dir_all(folder)
        .and_then(|()| std::fs::write(path, bytes))
        .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panels_stand_side_by_side() {
        let image = |width, value: f32| Image {
            width,
            height: 1,
            pixels: vec![[value; 3]; width],
        };
        let panel = side_by_side(&image(2, 1.0), &image(1, 0.5));
        assert_eq!((panel.width, panel.height), (6, 1));
        let red: Vec<f32> = panel.pixels.iter().map(|p| p[0]).collect();
        assert_eq!(format!("{red:?}"), "[1.0, 1.0, 2.0, 0.0, 0.5, 0.0]");
    }
}
