//! Radiance HDR files: three mantissas of eight bits with a common exponent (RGBE).
//!
//!   2^(e − 1) ≤ max(r, g, b) < 2^e,   m_c = round(256 · c / 2^e),   c' = m_c · 2^(e − 8),   stored with e + 128.
//!
//! Source: G. Ward, "Real Pixels", Graphics Gems II, 1991; file format of the Radiance reference manual. Ward's own code truncates and
//! adds half a step when it reads, later readers (stb_image, the `image` crate, Bevy, Godot) add nothing: for them mantissas are
//! rounded here, where truncation would take 0.3 % of the light. three.js (`HDRLoader` of r187) reads all values 256/255 times as large.
//!
//! Valid from 2⁻¹⁰⁰, below which pixels become black, to 255 · 2¹¹⁹. No channel changes by more than 2⁻⁸/(1 − 2⁻⁹) of the largest of
//! its pixel: half a step, of which 128 make the power of two that the largest is not below, or 2⁻⁹ of it below and rounded up to it. Cost: linear, at most 4 bytes a pixel.

use image::codecs::hdr::HdrEncoder;
use image::{ImageError, Rgb};

/// The largest value that is kept.
pub const LARGEST: f64 = 255.0 * (1_u128 << 119) as f64;

/// The smallest largest channel that is not black.
const SMALLEST: f64 = 1.0 / (1_u128 << 100) as f64;

/// What a channel changes by at most, over the largest channel of its pixel: 2⁻⁸/(1 − 2⁻⁹).
pub const BOUND: f64 = 2.0 / 511.0;

/// Why a file cannot be encoded.
#[derive(Debug, thiserror::Error)]
#[error("the HDR encoder failed")]
pub struct EncodeHdrError(#[from] ImageError);

/// What a reader gets of a pixel of finite values; those below zero become zero, those above [`LARGEST`] that.
pub fn rounded(pixel: [f64; 3]) -> [f64; 3] {
    let pixel = pixel.map(|value| value.clamp(0.0, LARGEST));
    let largest = pixel.into_iter().fold(0.0, f64::max);
    if largest < SMALLEST {
        return [0.0; 3];
    }
    // The exponent field of a normal number is exact where a logarithm may not be.
    let exponent = (largest.to_bits() >> 52) as i32 - 1022;
    let fine = 2.0_f64.powi(exponent - 8);
    // Where the largest is rounded up to 256 steps, it has the next exponent, and the others its steps.
    let step = if largest / fine >= 255.5 {
        2.0 * fine
    } else {
        fine
    };
    pixel.map(|value| (value / step).round() * step)
}

/// The bytes of a file of `size` (width, height) pixels, row by row from the top.
///
/// # Errors
/// When the encoder refuses.
///
/// # Panics
/// When there are fewer pixels.
pub fn encode(
    pixels: impl Iterator<Item = [f64; 3]>,
    size: [usize; 2],
) -> Result<Vec<u8>, EncodeHdrError> {
    // The encoder truncates, which changes nothing of what is rounded.
    let pixels: Vec<Rgb<f32>> = pixels
        .map(|pixel| Rgb(rounded(pixel).map(|value| value as f32)))
        .collect();
    let mut bytes = Vec::new();
    HdrEncoder::new(&mut bytes).encode(&pixels, size[0], size[1])?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::ImageFormat;
    use proptest::prelude::*;

    fn decoded(bytes: &[u8]) -> Vec<[f32; 3]> {
        let image = image::load_from_memory_with_format(bytes, ImageFormat::Hdr);
        let pixels = image.expect("an HDR file").into_rgb32f();
        pixels.pixels().map(|pixel| pixel.0).collect()
    }

    #[test]
    fn extremes_stay_in_range() {
        let pixels = [
            [0.0; 3],
            [1e-40, 0.0, 0.0],
            [f64::MAX, 1.0, -1.0],
            [1.0, 0.996_2, 0.998_1],
        ];
        let bytes = encode(pixels.into_iter(), [4, 1]).expect("encodable");
        let found = decoded(&bytes);
        assert_eq!(found[..2], [[0.0; 3]; 2]);
        assert_eq!(found[2].map(f64::from), [LARGEST, 0.0, 0.0]);
        // In steps of 1/128.
        assert_eq!(found[3], [1.0, 1.0, 1.0]);
    }

    proptest! {
        /// Another reader gets what [`rounded`] says, and that is within the stated bound. Rows of eight are run-length encoded.
        #[test]
        fn pixels_are_rounded_by_the_stated_bound(
            pixels in proptest::collection::vec(proptest::array::uniform3(-60.0..60.0_f64), 8..17)
        ) {
            let pixels: Vec<[f64; 3]> = pixels.into_iter().map(|p| p.map(f64::exp2)).collect();
            let bytes = encode(pixels.iter().copied(), [pixels.len(), 1]).expect("encodable");
            for (pixel, found) in pixels.iter().zip(decoded(&bytes)) {
                prop_assert_eq!(found.map(f64::from), rounded(*pixel));
                let largest = pixel.iter().copied().fold(0.0, f64::max);
                for (value, found) in pixel.iter().zip(found) {
                    prop_assert!((value - f64::from(found)).abs() <= BOUND * largest);
                }
            }
        }

        /// Rounding is even-handed: a plane of any brightness keeps its light to a tenth of what truncation would take.
        #[test]
        fn nothing_is_lost_on_average(level in 1.0..2.0_f64) {
            let count = 4096;
            let value = |i: usize| level * (1.0 + 0.25 * i as f64 / f64::from(count as u32));
            let sum: f64 = (0..count).map(value).sum();
            let kept: f64 = (0..count).map(|i| rounded([value(i); 3])[0]).sum();
            // Only where a stretch of equal steps ends, at three places at most, does rounding not cancel: an eighth of a step of
            // 2⁻⁷ of the value each, of which the ramp has 16 at least.
            prop_assert!((kept / sum - 1.0).abs() < 3.0 / 8.0 / 128.0 / 16.0, "{}", kept / sum);
        }
    }
}
