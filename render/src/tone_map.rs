//! From linear values to the 8 bits of a screen.
//!
//! v = ⌊255 · OETF(clip(k·x, 0, 1)) + ½⌋ with the exposure k and the sRGB transfer function
//!
//! OETF(c) = 12.92 c for c ≤ 0.0031308, else 1.055 c^(1/2.4) − 0.055
//!
//! (IEC 61966-2-1:1999). Channels are treated alike and clipped: highlights and light sources turn
//! white, hues below the clip are exact. The automatic exposure puts the median of the luminance
//! Y = 0.2126 R + 0.7152 G + 0.0722 B (Rec. 709) over the pixels with Y > 0 at [`AUTO_LEVEL`]; a
//! median ignores how bright visible lamps and how dark unlit corners are, which means, also of
//! logarithms, do not. It depends on the values alone, not on their order. Cost: one selection.

use crate::image::Image;

/// Linear level that the automatic exposure gives to the median: a middle grey, a little above the
/// photographic 18 %. A tuned value: higher, and lit walls around a lamp clip; lower, and rooms
/// look dim.
pub const AUTO_LEVEL: f32 = 0.22;

/// A tone curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToneMap {
    /// Factor from linear image values to display values of 0 to 1.
    pub exposure: f32,
}

impl ToneMap {
    /// The curve with the automatic exposure; exposure 1 for an image without light.
    pub fn automatic(image: &Image) -> Self {
        let mut luminances: Vec<f32> = image
            .pixels
            .iter()
            .map(|[r, g, b]| 0.2126 * r + 0.7152 * g + 0.0722 * b)
            .filter(|y| *y > 0.0 && y.is_finite())
            .collect();
        if luminances.is_empty() {
            return Self { exposure: 1.0 };
        }
        let middle = luminances.len() / 2;
        let (_, median, _) = luminances.select_nth_unstable_by(middle, f32::total_cmp);
        let exposure = AUTO_LEVEL / *median;
        // A denormal luminance would overflow the quotient.
        Self {
            exposure: if exposure.is_finite() { exposure } else { 1.0 },
        }
    }

    /// The 8-bit sRGB value of a linear pixel; values that are not numbers become black.
    pub fn apply(self, pixel: [f32; 3]) -> [u8; 3] {
        pixel.map(|value| {
            let clipped = (value * self.exposure).clamp(0.0, 1.0);
            // A cast from NaN gives 0.
            (255.0 * srgb_oetf(clipped) + 0.5) as u8
        })
    }
}

/// The sRGB opto-electronic transfer function on [0, 1].
fn srgb_oetf(linear: f32) -> f32 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_is_monotone_and_reaches_both_ends() {
        let map = ToneMap { exposure: 1.0 };
        let levels: Vec<u8> = (0..=4096)
            .map(|i| map.apply([i as f32 / 4096.0; 3])[0])
            .collect();
        assert!(levels.is_sorted(), "more light is never darker");
        assert_eq!((levels[0], levels[4096]), (0, 255));
        // Published sRGB value of 50 % linear light is 187.5.
        assert_eq!(map.apply([0.5; 3]), [188; 3]);
        assert_eq!(map.apply([-1.0, f32::NAN, 7.0]), [0, 0, 255]);
    }

    #[test]
    fn the_exposure_follows_the_scale_of_the_light_and_ignores_a_lamp() {
        let mut image = Image {
            width: 100,
            height: 1,
            pixels: (1..=100).map(|i| [i as f32; 3]).collect(),
        };
        let plain = ToneMap::automatic(&image).exposure;
        image.pixels[99] = [1e9; 3];
        assert!((ToneMap::automatic(&image).exposure / plain - 1.0).abs() < 1e-6);
        for pixel in &mut image.pixels {
            *pixel = pixel.map(|value| value * 8.0);
        }
        assert!((ToneMap::automatic(&image).exposure * 8.0 / plain - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_black_image_has_an_exposure_of_one() {
        let black = Image {
            width: 2,
            height: 1,
            pixels: vec![[0.0; 3]; 2],
        };
        assert!((ToneMap::automatic(&black).exposure - 1.0).abs() < f32::EPSILON);
    }
}
