//! Maps as bytes that the page's script reads: half floats of light, and two bytes a texel about it.
//!
//! Light is stored as x / s with a power of two s for each page that brings its largest value to at most 2¹⁵: half floats end at
//! 65504, which daylight in lx exceeds, and have 11 bits from 2⁻¹⁴ up, nine decimal orders below that largest value. Rounding
//! changes a value by at most 2⁻¹² of itself in that range.
//!
//! The relative error e of a texel, the mean of the channels' standard errors over that of their values, is the byte
//! 1 + 254 (log₁₀ e + 4) / 4, rounded, for e from 10⁻⁴ to 1, which values beyond are moved to; 0 where a texel has no light or
//! states no error. A step is 3.7 % of e.

use crate::image::Image;
use exr::prelude::f16;

/// Ends of the scale of relative errors, as powers of ten; agrees with `surface.js`.
const ERROR_DECADES: [f64; 2] = [-4.0, 0.0];

/// Values of a page without light are stored as they are.
const UNIT: f32 = 1.0;

/// The scale of a page, and its values in that as little-endian half floats, three to a texel.
pub(super) fn light(map: &Image) -> (f32, Vec<u8>) {
    let finite = |value: f32| if value.is_finite() { value } else { 0.0 };
    let values = map.pixels.as_flattened();
    let largest = values
        .iter()
        .map(|value| finite(*value).abs())
        .fold(0.0, f32::max);
    let scale = if largest > 0.0 {
        // Beyond these no single float has a reciprocal.
        (largest.log2().ceil() - 15.0).clamp(-120.0, 120.0).exp2()
    } else {
        UNIT
    };
    let halves = values
        .iter()
        .flat_map(|value| f16::from_f32(finite(*value) / scale).to_le_bytes());
    (scale, halves.collect())
}

/// Two bytes a texel: its relative error, and what it is as [`Texel::sample`](crate::lightmap::map::Texel::sample) says.
///
/// # Panics
/// When there is not one of each for each texel.
pub(super) fn info(map: &Image, error: &Image, validity: &[u8]) -> Vec<u8> {
    assert_eq!(map.pixels.len(), error.pixels.len(), "an error each texel");
    assert_eq!(map.pixels.len(), validity.len(), "a validity each texel");
    let pixels = map.pixels.iter().zip(&error.pixels).zip(validity);
    pixels
        .flat_map(|((value, error), validity)| [relative(*value, *error), *validity])
        .collect()
}

/// The byte of a relative error.
fn relative(value: [f32; 3], error: [f32; 3]) -> u8 {
    let sum = |channels: [f32; 3]| channels.iter().map(|x| f64::from(*x)).sum::<f64>();
    let ratio = sum(error) / sum(value);
    if !(ratio > 0.0 && ratio.is_finite()) {
        return 0;
    }
    let [low, high] = ERROR_DECADES;
    let place = ((ratio.log10() - low) / (high - low)).clamp(0.0, 1.0);
    1 + (254.0 * place).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(pixels: Vec<[f32; 3]>) -> Image {
        Image {
            width: pixels.len(),
            height: 1,
            pixels,
        }
    }

    #[test]
    fn daylight_and_twilight_keep_eleven_bits() {
        let pixels = vec![[120_000.0, 3.3, 0.01], [0.0, 1.0, 99_999.0]];
        let (scale, bytes) = light(&image(pixels.clone()));
        let halves = bytes
            .chunks(2)
            .map(|pair| f16::from_le_bytes([pair[0], pair[1]]));
        for (half, value) in halves.zip(pixels.as_flattened()) {
            let read = half.to_f32() * scale;
            // Half a unit in the last of 11 bits.
            assert!(
                (read - value).abs() <= value * 2.0_f32.powi(-11),
                "{read} {value}"
            );
        }
    }

    #[test]
    fn what_is_no_number_is_dark() {
        let (scale, bytes) = light(&image(vec![[f32::NAN, f32::INFINITY, 0.0]]));
        assert_eq!((scale, bytes), (1.0, vec![0; 6]));
        let (scale, _) = light(&image(vec![[f32::MIN_POSITIVE, f32::MAX, 1.0]]));
        assert!(scale.is_finite() && scale > 0.0);
    }

    #[test]
    fn errors_are_on_a_scale_of_four_decades() {
        let byte = |error: f32| relative([2.0; 3], [2.0 * error; 3]);
        assert_eq!([0.0, 1e-5, 1.0, 7.0].map(byte), [0, 1, 255, 255]);
        assert_eq!(byte(0.01), 128);
        assert_eq!(relative([0.0; 3], [1.0; 3]), 0, "no light, no ratio");
        assert_eq!(relative([f32::NAN; 3], [1.0; 3]), 0);
        let image = image(vec![[1.0; 3]; 2]);
        assert_eq!(info(&image, &image, &[128, 255]), [255, 128, 255, 255]);
    }
}
