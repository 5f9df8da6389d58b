//! RGBM in PNG files: eight bits a channel and a common multiplier in alpha, all linear.
//!
//!   a = ⌈255 · max(r, g, b) / R⌉ / 255,   c̃ = round(255 · c / (R · a)) / 255,   c' = c̃ · a · R.
//!
//! Source: B. Karis, "RGBM color encoding", 2009, with linear colours instead of their square roots. The range R is the largest value
//! of the picture: nothing is clamped, and the file alone does not tell it. It is to be read without colour management and
//! without premultiplied alpha, which the file's type does not ask for either. Filtering such textures is not exact: what is
//! filtered are c̃ and a apart.
//!
//! No channel changes by more than R · a / 510. As a is at most one step of 1/255 too large, that is 1/255 of the pixel's
//! largest channel where that is at least R/255, and R / 130 050 where it is not. Cost: linear, at most 4 bytes a pixel.

use image::{ExtendedColorType, ImageEncoder, ImageError, codecs::png::PngEncoder};

/// Why a file cannot be encoded.
#[derive(Debug, thiserror::Error)]
#[error("the PNG encoder failed")]
pub struct EncodeRgbmError(#[from] ImageError);

/// The samples of a pixel of finite values; those below zero become zero. The range is positive and no smaller than any value.
pub fn samples(pixel: [f64; 3], range: f64) -> [u8; 4] {
    let pixel = pixel.map(|value| (value / range).clamp(0.0, 1.0));
    let largest = pixel.into_iter().fold(0.0, f64::max);
    let multiplier = (255.0 * largest).ceil();
    if multiplier == 0.0 {
        return [0; 4];
    }
    // Of 255 steps each: c / (a/255) · 255.
    let [r, g, b] = pixel.map(|value| (255.0 * 255.0 * value / multiplier).round() as u8);
    [r, g, b, multiplier as u8]
}

/// The values that samples stand for.
pub fn values([r, g, b, a]: [u8; 4], range: f64) -> [f64; 3] {
    let scale = range * f64::from(a) / (255.0 * 255.0);
    [r, g, b].map(|channel| f64::from(channel) * scale)
}

/// The bytes of a file of `size` (width, height) pixels, row by row from the top.
///
/// # Errors
/// When there are no pixels or more than PNG can hold.
///
/// # Panics
/// When there are not as many pixels as the size says.
pub fn encode(
    pixels: impl Iterator<Item = [f64; 3]>,
    size: [usize; 2],
    range: f64,
) -> Result<Vec<u8>, EncodeRgbmError> {
    let samples: Vec<u8> = pixels.flat_map(|pixel| samples(pixel, range)).collect();
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes).write_image(
        &samples,
        size[0] as u32,
        size[1] as u32,
        ExtendedColorType::Rgba8,
    )?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn ends_of_the_range_are_exact() {
        assert_eq!(samples([0.0, -1.0, 0.0], 1.0), [0; 4]);
        assert_eq!(samples([7.0, 0.0, 3.5], 7.0), [255, 0, 128, 255]);
        assert_eq!(values([255; 4], 7.0), [7.0; 3]);
        // The darkest that is not black: a is 1.
        let dark = 7.0 / 130_050.0;
        assert_eq!(samples([1.01 * dark; 3], 7.0), [1, 1, 1, 1]);
        assert_eq!(samples([0.99 * dark; 3], 7.0), [0, 0, 0, 1]);
    }

    proptest! {
        #[test]
        fn pixels_are_rounded_by_the_stated_bound(
            pixels in proptest::collection::vec(proptest::array::uniform3(-20.0..0.0_f64), 1..20), range in -9.0..9.0_f64
        ) {
            let range = range.exp();
            let pixels: Vec<[f64; 3]> = pixels.into_iter().map(|p| p.map(|x| range * x.exp2())).collect();
            let bytes = encode(pixels.iter().copied(), [1, pixels.len()], range).expect("encodable");
            let image = image::load_from_memory(&bytes).expect("a PNG file").into_rgba8();
            for (pixel, found) in pixels.iter().zip(image.pixels()) {
                let largest = pixel.iter().copied().fold(0.0, f64::max);
                let bound = if largest >= range / 255.0 { largest / 255.0 } else { range / 130_050.0 };
                // Arithmetic in f64 adds nothing that matters.
                let bound = bound * (1.0 + 1e-12);
                for (value, found) in pixel.iter().zip(values(found.0, range)) {
                    prop_assert!((value - found).abs() <= bound, "{value} {found} of {range}");
                }
            }
        }
    }
}
