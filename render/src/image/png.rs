//! PNG previews: 8 bits a channel, sRGB.

use super::Image;
use crate::tone_map::ToneMap;
use image::{ExtendedColorType, ImageEncoder, ImageError, codecs::png::PngEncoder};

/// Why a preview cannot be encoded.
#[derive(Debug, thiserror::Error)]
#[error("the PNG encoder failed")]
pub struct EncodePngError(#[from] ImageError);

/// The bytes of a PNG file that shows `image` under `tone_map`.
///
/// # Errors
/// When the image has no pixels or more than PNG can hold.
pub fn encode(image: &Image, tone_map: ToneMap) -> Result<Vec<u8>, EncodePngError> {
    let samples: Vec<u8> = image
        .pixels
        .iter()
        .flat_map(|&pixel| tone_map.apply(pixel))
        .collect();
    encode_rgb8(&samples, [image.width, image.height])
}

/// The bytes of a PNG file of `size` (width, height) pixels whose sRGB samples are given, row by row from
/// the top.
///
/// # Errors
/// When there are no pixels or more than PNG can hold.
///
/// # Panics
/// When there are not three samples per pixel.
pub fn encode_rgb8(samples: &[u8], size: [usize; 2]) -> Result<Vec<u8>, EncodePngError> {
    encode_samples(samples, size, ExtendedColorType::Rgb8)
}

/// The bytes of a PNG file of `size` (width, height) pixels with one sample each, row by row from the top.
///
/// # Errors
/// When there are no pixels or more than PNG can hold.
///
/// # Panics
/// When there is not one sample per pixel.
pub fn encode_grey8(samples: &[u8], size: [usize; 2]) -> Result<Vec<u8>, EncodePngError> {
    encode_samples(samples, size, ExtendedColorType::L8)
}

fn encode_samples(
    samples: &[u8],
    size: [usize; 2],
    colour: ExtendedColorType,
) -> Result<Vec<u8>, EncodePngError> {
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes).write_image(samples, size[0] as u32, size[1] as u32, colour)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_keep_their_places() {
        let image = Image {
            width: 2,
            height: 2,
            pixels: vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]],
        };
        let bytes = encode(&image, ToneMap { exposure: 1.0 }).expect("encodable");
        let decoded = image::load_from_memory(&bytes)
            .expect("a PNG image")
            .to_rgb8();
        assert_eq!(decoded.dimensions(), (2, 2));
        assert_eq!(
            decoded.into_raw(),
            [255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0]
        );
    }

    #[test]
    fn an_empty_image_is_refused() {
        let image = Image {
            width: 0,
            height: 0,
            pixels: vec![],
        };
        assert!(encode(&image, ToneMap { exposure: 1.0 }).is_err());
    }
}
