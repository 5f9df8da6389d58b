//! Reads images into linear [`Texture`]s.
//!
//! Integer formats (PNG, JPEG, TGA) hold sRGB-encoded colour and are decoded (IEC 61966-2-1);
//! floating-point formats (Radiance HDR) are linear already.

use crate::id::TextureId;
use crate::load::{LoadError, Place, read_file};
use crate::material::{Texture, Wrap};
use crate::scene::Scene;
use image::DynamicImage;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why an image could not be used.
#[derive(Debug, Error)]
pub enum TextureError {
    /// The image does not exist.
    #[error("{place}: no such image: {}; check the name, which is relative to the file that names it", file.display())]
    Missing {
        /// The image.
        file: PathBuf,
        /// Where it is named.
        place: Place,
    },
    /// The image exists but cannot be read.
    #[error("{place}: cannot read {}: {source}; check its permissions", file.display())]
    Unreadable {
        /// The image.
        file: PathBuf,
        /// Where it is named.
        place: Place,
        /// What the system said.
        source: std::io::Error,
    },
    /// The image cannot be decoded.
    #[error(
        "{place}: {name} is not an image that can be read: {source}; convert it to PNG, JPEG, TGA or HDR"
    )]
    Decode {
        /// File name, or name in the file.
        name: String,
        /// Where it is named.
        place: Place,
        /// What the decoder said.
        source: Box<image::ImageError>,
    },
}

/// Loads each image file once.
#[derive(Debug, Default)]
pub(crate) struct TextureFiles {
    by_path: HashMap<(PathBuf, Wrap), TextureId>,
}

impl TextureFiles {
    /// The texture of a file in `scene`, loaded when it is not there yet. `place` is where the file
    /// is named.
    pub(crate) fn load(
        &mut self,
        scene: &mut Scene,
        file: &Path,
        wrap: Wrap,
        place: &Place,
    ) -> Result<TextureId, TextureError> {
        let key = (file.to_owned(), wrap);
        if let Some(&id) = self.by_path.get(&key) {
            return Ok(id);
        }
        let bytes = read_file(file, Some(place)).map_err(|error| match error {
            LoadError::Unreadable { file, source } => TextureError::Unreadable {
                file,
                place: place.clone(),
                source,
            },
            _ => TextureError::Missing {
                file: file.to_owned(),
                place: place.clone(),
            },
        })?;
        let name = file.display().to_string();
        let image = decode(&bytes, file).map_err(|source| TextureError::Decode {
            name: name.clone(),
            place: place.clone(),
            source: Box::new(source),
        })?;
        let id = push(scene, to_texture(name, &image, wrap));
        self.by_path.insert(key, id);
        Ok(id)
    }
}

/// Adds a texture to a scene.
pub(crate) fn push(scene: &mut Scene, texture: Texture) -> TextureId {
    scene.textures.push(texture);
    TextureId::new(scene.textures.len() - 1)
}

/// Decodes by content, and by extension where the content says nothing (TGA).
pub(crate) fn decode(bytes: &[u8], file: &Path) -> Result<DynamicImage, image::ImageError> {
    let mut reader = image::ImageReader::new(std::io::Cursor::new(bytes));
    if let Ok(format) = image::ImageFormat::from_path(file) {
        reader.set_format(format);
    }
    reader.with_guessed_format()?.decode()
}

/// Converts any image to linear RGB in f32.
pub(crate) fn to_texture(name: String, image: &DynamicImage, wrap: Wrap) -> Texture {
    let texels = match image {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            image.to_rgb32f().pixels().map(|p| p.0).collect()
        }
        DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_)
        | DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_) => image
            .to_rgb16()
            .pixels()
            .map(|p| p.0.map(|c| srgb_to_linear(f32::from(c) / 65535.0)))
            .collect(),
        _ => {
            let decoded: Vec<f32> = (0..=u8::MAX)
                .map(|c| srgb_to_linear(f32::from(c) / 255.0))
                .collect();
            image
                .to_rgb8()
                .pixels()
                .map(|p| p.0.map(|c| decoded[usize::from(c)]))
                .collect()
        }
    };
    Texture {
        name,
        width: image.width() as usize,
        height: image.height() as usize,
        texels,
        wrap,
    }
}

/// Linear value of an sRGB-encoded one, both in [0, 1].
fn srgb_to_linear(encoded: f32) -> f32 {
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_is_decoded() {
        assert_eq!(srgb_to_linear(0.0), 0.0);
        assert_eq!(srgb_to_linear(1.0), 1.0);
        // IEC 61966-2-1: the encoded middle 0.5 is 0.21404 linear.
        assert!((srgb_to_linear(0.5) - 0.214_041).abs() < 1e-6);
    }

    #[test]
    fn an_image_is_loaded_once() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let file = folder.path().join("a.png");
        image::RgbImage::from_pixel(2, 1, image::Rgb([255, 128, 0]))
            .save(&file)
            .expect("the image is written");
        let mut scene = Scene::default();
        let mut files = TextureFiles::default();
        let place = Place::file(Path::new("a.mtl"));
        let mut load = |scene: &mut Scene| files.load(scene, &file, Wrap::Repeat, &place);
        let first = load(&mut scene).expect("the image is read");
        let second = load(&mut scene).expect("the image is known");
        assert_eq!(first, second);
        assert_eq!(scene.textures.len(), 1);
        let texture = &scene.textures[0];
        assert_eq!((texture.width, texture.height), (2, 1));
        assert_eq!(texture.texels[0][0], 1.0);
        assert!((texture.texels[0][1] - 0.215_86).abs() < 1e-5);
    }

    #[test]
    fn missing_and_broken_images_are_named() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let broken = folder.path().join("b.png");
        std::fs::write(&broken, b"not an image").expect("the file is written");
        let place = Place::line(Path::new("a.mtl"), 3);
        let load = |file: &Path| {
            TextureFiles::default()
                .load(&mut Scene::default(), file, Wrap::Repeat, &place)
                .expect_err("not an image")
                .to_string()
        };
        assert!(load(&broken).starts_with("a.mtl:3: "));
        assert!(load(&folder.path().join("none.png")).contains("no such image"));
    }
}
