//! How far one image is from another.
//!
//! With x the image, x* the reference, d = x − x* and the mean over all pixels and the three
//! channels:
//!
//! - RMSE = √mean(d²), nRMSE = RMSE / mean(x*), bias = mean(d);
//! - relRMSE = √mean(d² / (x*² + (0.01 mean x*)²)), which the dark parts decide;
//! - max and 95th percentile of |d|, the latter by nearest rank.
//!
//! Source: luxel's design, "Error"; the relative form is that of F. Rousselle, C. Knaus,
//! M. Zwicker, "Adaptive sampling and reconstruction using greedy error minimization", ACM TOG
//! 30(6), 2011, eq. 17, with a regulariser that follows the brightness of the image instead of a
//! constant. For a black reference the two ratios are 0 when the images agree and infinite
//! otherwise. Cost: one sort.

use crate::image::Image;

/// Differences of two images, in the unit of their values unless said otherwise.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Difference {
    /// Root of the mean squared difference.
    pub rmse: f64,
    /// RMSE over the mean of the reference (a ratio).
    pub nrmse: f64,
    /// Root of the mean squared relative difference (a ratio).
    pub rel_rmse: f64,
    /// Mean signed difference, image less reference.
    pub bias: f64,
    /// Bias over the mean of the reference (a ratio).
    pub rel_bias: f64,
    /// Largest absolute difference.
    pub max: f64,
    /// 95th percentile of the absolute difference.
    pub p95: f64,
    /// Mean of the reference.
    pub mean_reference: f64,
}

/// Why two images cannot be compared.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DiffError {
    /// They have different sizes.
    #[error(
        "the images differ in size: {}x{} against {}x{}; render both with the same --size",
        .image[0], .image[1], .reference[0], .reference[1]
    )]
    Size {
        /// Width and height of the image.
        image: [usize; 2],
        /// Width and height of the reference.
        reference: [usize; 2],
    },
    /// There are no pixels.
    #[error("the images have no pixels")]
    Empty,
    /// A value is infinite or not a number.
    #[error(
        "the {which} holds a value that is not finite at pixel x = {x}, y = {y} (from the top)"
    )]
    NotFinite {
        /// `image` or `reference`.
        which: &'static str,
        /// Column.
        x: usize,
        /// Row from the top.
        y: usize,
    },
}

/// Compares `image` with `reference`, all channels together.
///
/// # Errors
/// When they differ in size, are empty, or hold values that are not finite.
pub fn difference(image: &Image, reference: &Image) -> Result<Difference, DiffError> {
    let size = |image: &Image| [image.width, image.height];
    if size(image) != size(reference) {
        return Err(DiffError::Size {
            image: size(image),
            reference: size(reference),
        });
    }
    if image.pixels.is_empty() {
        return Err(DiffError::Empty);
    }
    check_finite(image, "image")?;
    check_finite(reference, "reference")?;

    let values = |image: &Image| -> Vec<f64> {
        let values = image.pixels.iter().flatten();
        values.map(|&value| f64::from(value)).collect()
    };
    Ok(difference_of_values(&values(image), &values(reference)))
}

/// The metrics of two equally long, not empty, finite sequences.
fn difference_of_values(values: &[f64], reference: &[f64]) -> Difference {
    let count = values.len() as f64;
    let mean_reference = reference.iter().sum::<f64>() / count;
    let floor = (0.01 * mean_reference).powi(2);
    let (mut squares, mut relative, mut bias) = (0.0, 0.0, 0.0);
    let mut distances = Vec::with_capacity(values.len());
    for (x, x_star) in values.iter().zip(reference) {
        let d = x - x_star;
        bias += d;
        squares += d * d;
        relative += ratio(d * d, x_star * x_star + floor);
        distances.push(d.abs());
    }
    distances.sort_unstable_by(f64::total_cmp);
    let rank = (0.95 * count).ceil() as usize;
    let rmse = (squares / count).sqrt();
    Difference {
        rmse,
        nrmse: ratio(rmse, mean_reference),
        rel_rmse: (relative / count).sqrt(),
        bias: bias / count,
        rel_bias: ratio(bias / count, mean_reference),
        max: distances[distances.len() - 1],
        p95: distances[rank - 1],
        mean_reference,
    }
}

/// a/b, and 0 for 0/0.
fn ratio(a: f64, b: f64) -> f64 {
    if a == 0.0 { 0.0 } else { a / b }
}

fn check_finite(image: &Image, which: &'static str) -> Result<(), DiffError> {
    let bad = |pixel: &[f32; 3]| pixel.iter().any(|value| !value.is_finite());
    match image.pixels.iter().position(bad) {
        None => Ok(()),
        Some(index) => Err(DiffError::NotFinite {
            which,
            x: index % image.width,
            y: index / image.width,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(values: &[f32]) -> Image {
        Image {
            width: values.len(),
            height: 1,
            pixels: values.iter().map(|&value| [value; 3]).collect(),
        }
    }

    #[test]
    fn metrics_of_a_hand_made_pair() {
        // d = (1, -1, 0, 2), x* = (1, 3, 2, 2), mean x* = 2, regulariser 0.02².
        let result = difference(&row(&[2.0, 2.0, 2.0, 4.0]), &row(&[1.0, 3.0, 2.0, 2.0]))
            .expect("same size");
        let expect = |value: f64, expected: f64| {
            assert!((value - expected).abs() < 1e-12, "{value} != {expected}");
        };
        expect(result.rmse, 1.5_f64.sqrt());
        expect(result.nrmse, 1.5_f64.sqrt() / 2.0);
        let floor = 0.0004;
        let relative: f64 = (1.0 / (1.0 + floor) + 1.0 / (9.0 + floor) + 4.0 / (4.0 + floor)) / 4.0;
        expect(result.rel_rmse, relative.sqrt());
        expect(result.bias, 0.5);
        expect(result.rel_bias, 0.25);
        expect(result.max, 2.0);
        expect(result.p95, 2.0);
        expect(result.mean_reference, 2.0);
    }

    #[test]
    fn the_percentile_leaves_out_the_largest_twentieth() {
        let mut values = vec![0.0; 100];
        values[..5].fill(9.0);
        values[5] = 1.0;
        let result = difference(&row(&values), &row(&[0.0; 100])).expect("same size");
        assert!((result.p95 - 1.0).abs() < 1e-12 && (result.max - 9.0).abs() < 1e-12);
    }

    #[test]
    fn equal_images_differ_by_nothing_even_when_black() {
        let result = difference(&row(&[0.0; 3]), &row(&[0.0; 3])).expect("same size");
        assert!(result.rmse == 0.0 && result.nrmse == 0.0 && result.rel_rmse == 0.0);
        let result = difference(&row(&[1.0]), &row(&[0.0])).expect("same size");
        assert!(result.nrmse.is_infinite() && result.rel_rmse.is_infinite());
    }

    #[test]
    fn what_cannot_be_compared_is_refused() {
        let error = difference(&row(&[1.0]), &row(&[1.0, 2.0])).expect_err("sizes");
        assert!(error.to_string().contains("1x1 against 2x1"));
        assert_eq!(difference(&row(&[]), &row(&[])), Err(DiffError::Empty));
        let error = difference(&row(&[1.0, f32::NAN]), &row(&[1.0, 2.0])).expect_err("NaN");
        assert!(error.to_string().contains("image") && error.to_string().contains("x = 1"));
    }
}
