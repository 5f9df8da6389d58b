//! `OpenEXR` files: linear 32-bit RGB, further RGB layers, and where the picture came from.
//!
//! Layers follow the EXR naming rule: the picture is `R`, `G`, `B`; a layer called `x` is `x.R`,
//! `x.G`, `x.B` in the same part. Compression is lossless (ZIP). The bytes depend on the
//! arguments alone: nothing is written about time, machine or threads, and there is one custom
//! attribute (`luxel`, a JSON text), because the order of several is not fixed by the writer.

use super::Image;
use crate::film::SampleCounts;
use exr::image::FlatImage;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Layer, LayerAttributes,
    ReadChannels, ReadLayers, SmallVec, Text, Vec2, WritableImage,
};
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// Where a picture came from.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(untagged)]
pub enum Origin {
    /// A camera looked at a scene.
    Rendered(Rendered),
    /// A page of a lightmap.
    Baked(Baked),
}

/// How a picture was rendered.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Rendered {
    /// The program and its version.
    pub software: String,
    /// Name of the scene.
    pub scene: String,
    /// Name of the camera.
    pub camera: String,
    /// Name of the integrator.
    pub integrator: String,
    /// Unit of the values, for example `W/(m2 sr)`.
    pub unit: String,
    /// Samples per pixel.
    pub samples: SampleCounts,
    /// Seed of all randomness.
    pub seed: u64,
}

/// What a page of a lightmap holds.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Baked {
    /// The program and its version.
    pub software: String,
    /// Name of the scene.
    pub scene: String,
    /// Which light: `all`, `direct` or `indirect`, or `ao`.
    pub include: String,
    /// What the values are, such as `irradiance`.
    pub quantity: String,
    /// Unit of the values, such as `W/m2`.
    pub unit: String,
    /// Error of the light at luxels relative to their mean over all pages, one standard deviation.
    pub error: f64,
    /// The page, from zero.
    pub page: usize,
    /// Seed of all randomness.
    pub seed: u64,
}

impl Origin {
    fn software(&self) -> &str {
        match self {
            Self::Rendered(origin) => &origin.software,
            Self::Baked(origin) => &origin.software,
        }
    }

    /// A line for those who look at the file's attributes.
    fn comment(&self) -> String {
        match self {
            Self::Rendered(origin) => format!(
                "linear RGB (Rec. 709 primaries), {}; scene {}, camera {}, integrator {}, {:.1} samples a pixel, seed {}",
                origin.unit,
                origin.scene,
                origin.camera,
                origin.integrator,
                origin.samples.mean,
                origin.seed
            ),
            Self::Baked(origin) => format!(
                "linear RGB (Rec. 709 primaries), {} in {}; scene {}, lightmap of {}, page {}, relative error {:.2e}, seed {}",
                origin.quantity,
                origin.unit,
                origin.scene,
                origin.include,
                origin.page,
                origin.error,
                origin.seed
            ),
        }
    }
}

/// An EXR file's content.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// The main layer (`R`, `G`, `B`).
    pub image: Image,
    /// Further layers by name, of the same size.
    pub layers: Vec<(String, Image)>,
    /// Where it came from, when the file says so.
    pub origin: Option<Origin>,
}

impl Picture {
    /// Memory of a picture of so many pixels and so many layers besides, in bytes, while it is encoded: its values, as
    /// channels again, and as the file, which compression makes no larger.
    pub fn bytes_for(pixels: usize, layers: usize) -> usize {
        3 * pixels * (1 + layers) * size_of::<[f32; 3]>()
    }
}

/// Why an EXR file cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadExrError {
    /// Not a readable EXR file.
    #[error("cannot read {} as an EXR image", .0.display())]
    Unreadable(PathBuf, #[source] exr::error::Error),
    /// No RGB channels.
    #[error("{} has no R, G and B channels; luxel reads RGB images only", .0.display())]
    NoRgb(PathBuf),
    /// No channel of a name.
    #[error("{} has no channel {}", .0.display(), .1)]
    NoChannel(PathBuf, String),
}

/// Why a picture cannot be encoded.
#[derive(Debug, thiserror::Error)]
pub enum EncodeExrError {
    /// A layer differs from the main image in size.
    #[error("layer {0:?} has another size than the picture")]
    LayerSize(String),
    /// The origin cannot be written as JSON.
    #[error("the origin of the picture cannot be written")]
    Origin(#[from] serde_json::Error),
    /// The encoder refused.
    #[error("the EXR encoder failed")]
    Encoder(#[from] exr::error::Error),
}

/// The name of the custom attribute.
const ATTRIBUTE: &str = "luxel";

/// The bytes of an EXR file with the given content.
///
/// # Errors
/// When a layer has another size than the main image.
pub fn encode(picture: &Picture) -> Result<Vec<u8>, EncodeExrError> {
    let size = (picture.image.width, picture.image.height);
    let mut channels = SmallVec::new();
    push_channels(&mut channels, "", &picture.image);
    for (name, image) in &picture.layers {
        if (image.width, image.height) != size {
            return Err(EncodeExrError::LayerSize(name.clone()));
        }
        push_channels(&mut channels, &format!("{name}."), image);
    }
    let mut attributes = LayerAttributes::default();
    if let Some(origin) = &picture.origin {
        attributes.software_name = Some(text(origin.software()));
        attributes.comments = Some(text(&origin.comment()));
        let json = AttributeValue::Text(text(&serde_json::to_string(origin)?));
        attributes.other.insert(text(ATTRIBUTE), json);
    }
    file(size, attributes, channels)
}

/// The bytes of an EXR file of channels of any names, each with its samples row by row.
///
/// # Errors
/// When the encoder refuses.
///
/// # Panics
/// When a channel has not one sample for each pixel.
pub fn encode_channels(
    size: [usize; 2],
    channels: impl IntoIterator<Item = (String, Vec<f32>)>,
) -> Result<Vec<u8>, EncodeExrError> {
    let channels = channels.into_iter().map(|(name, samples)| {
        assert_eq!(samples.len(), size[0] * size[1], "a sample a pixel");
        AnyChannel::new(text(&name), FlatSamples::F32(samples))
    });
    let attributes = LayerAttributes::default();
    file((size[0], size[1]), attributes, channels.collect())
}

/// The bytes of a file of one layer.
fn file(
    size: (usize, usize),
    attributes: LayerAttributes,
    channels: SmallVec<[AnyChannel<FlatSamples>; 4]>,
) -> Result<Vec<u8>, EncodeExrError> {
    let layer = Layer::new(
        Vec2(size.0, size.1),
        attributes,
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels),
    );
    let image = exr::prelude::Image::from_layer(layer);
    let mut bytes = Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut bytes)?;
    Ok(bytes.into_inner())
}

/// The samples of a channel of any name of the first layer that has it.
///
/// # Errors
/// When the file is missing, damaged, or has no such channel.
pub fn read_channel(path: &Path, name: &str) -> Result<Vec<f32>, ReadExrError> {
    let file = open(path)?;
    let layers = file.layer_data.iter();
    let mut channels = layers.flat_map(|layer| &layer.channel_data.list);
    let channel = channels
        .find(|channel| channel.name == text(name))
        .ok_or_else(|| ReadExrError::NoChannel(path.to_path_buf(), name.into()))?;
    Ok(channel.sample_data.values_as_f32().collect())
}

/// All that a file holds.
fn open(path: &Path) -> Result<FlatImage, ReadExrError> {
    exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_file(path)
        .map_err(|error| ReadExrError::Unreadable(path.to_path_buf(), error))
}

/// Reads an EXR file: the first layer that has R, G and B, with its prefixed layers.
///
/// # Errors
/// When the file is missing, damaged, or has no RGB channels.
pub fn read(path: &Path) -> Result<Picture, ReadExrError> {
    let file = open(path)?;
    for layer in &file.layer_data {
        let Some(image) = rgb(layer, "") else {
            continue;
        };
        let names = layer.channel_data.list.iter();
        let layers = names
            .filter_map(|channel| Some(channel.name.to_string().strip_suffix(".R")?.to_owned()))
            .filter_map(|name| Some((name.clone(), rgb(layer, &format!("{name}."))?)));
        let origin = match layer.attributes.other.get(&text(ATTRIBUTE)) {
            Some(AttributeValue::Text(json)) => serde_json::from_str(&json.to_string()).ok(),
            _ => None,
        };
        return Ok(Picture {
            layers: layers.collect(),
            image,
            origin,
        });
    }
    Err(ReadExrError::NoRgb(path.to_path_buf()))
}

/// Adds the three channels of an image, their names prefixed.
fn push_channels(
    channels: &mut SmallVec<[AnyChannel<FlatSamples>; 4]>,
    prefix: &str,
    image: &Image,
) {
    for (index, name) in ["R", "G", "B"].into_iter().enumerate() {
        let samples = image.pixels.iter().map(|pixel| pixel[index]).collect();
        let name = text(&format!("{prefix}{name}"));
        channels.push(AnyChannel::new(name, FlatSamples::F32(samples)));
    }
}

/// The image in the channels `{prefix}R`, `{prefix}G`, `{prefix}B`, if they are there.
fn rgb(layer: &Layer<AnyChannels<FlatSamples>>, prefix: &str) -> Option<Image> {
    let channel = |name: &str| {
        let name = text(&format!("{prefix}{name}"));
        let mut channels = layer.channel_data.list.iter();
        channels.find(|channel| channel.name == name)
    };
    let [red, green, blue] = [channel("R")?, channel("G")?, channel("B")?];
    let pixels = red
        .sample_data
        .values_as_f32()
        .zip(green.sample_data.values_as_f32())
        .zip(blue.sample_data.values_as_f32())
        .map(|((r, g), b)| [r, g, b]);
    Some(Image {
        width: layer.size.width(),
        height: layer.size.height(),
        pixels: pixels.collect(),
    })
}

/// An EXR text: characters that the format cannot hold become `?`.
fn text(value: &str) -> Text {
    Text::new_or_none(value).unwrap_or_else(|| {
        let ascii = |c: char| if c.is_ascii() { c } else { '?' };
        Text::new_or_panic(value.chars().map(ascii).collect::<String>())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> Picture {
        let image = |scale: f32| Image {
            width: 3,
            height: 2,
            pixels: (0..6)
                .map(|i| [i as f32 * scale, 1e-30 * scale, 65_000.5 + scale])
                .collect(),
        };
        Picture {
            image: image(1.0),
            layers: vec![("standard_error".into(), image(0.1))],
            origin: Some(Origin::Rendered(Rendered {
                software: "luxel 0".into(),
                scene: "Küche 台所".into(),
                camera: "main".into(),
                integrator: "path".into(),
                unit: "W/(m2 sr)".into(),
                samples: SampleCounts {
                    mean: 16.5,
                    min: 8,
                    max: 32,
                },
                seed: u64::MAX,
            })),
        }
    }

    #[test]
    fn what_is_written_is_read_bit_by_bit() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("image.exr");
        let mut written = picture();
        std::fs::write(&path, encode(&written).expect("encodable")).expect("writable");
        let read = read(&path).expect("readable");
        // Characters outside the format's alphabet are replaced, everything else is kept.
        if let (Some(Origin::Rendered(written)), Some(Origin::Rendered(read))) =
            (&mut written.origin, &read.origin)
        {
            written.scene.clone_from(&read.scene);
            assert!(read.scene.contains("che"));
        }
        assert_eq!(read, written);
    }

    #[test]
    fn a_page_says_what_it_holds() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("image.exr");
        let page = Baked {
            software: "luxel 0".into(),
            scene: "room".into(),
            include: "all".into(),
            quantity: "irradiance".into(),
            unit: "lx".into(),
            error: 0.1 + 0.2,
            page: 3,
            seed: 0,
        };
        let written = Picture {
            origin: Some(Origin::Baked(page)),
            ..picture()
        };
        let bytes = encode(&written).expect("encodable");
        let comment =
            b"irradiance in lx; scene room, lightmap of all, page 3, relative error 3.00e-1";
        assert!(bytes.windows(comment.len()).any(|own| own == comment));
        std::fs::write(&path, bytes).expect("writable");
        assert_eq!(read(&path).expect("readable").origin, written.origin);
    }

    #[test]
    fn the_bytes_are_the_same_every_time() {
        let first = encode(&picture()).expect("encodable");
        assert!((0..8).all(|_| encode(&picture()).is_ok_and(|bytes| bytes == first)));
    }

    #[test]
    fn a_layer_of_another_size_is_refused() {
        let mut picture = picture();
        picture.layers[0].1.width = 2;
        let error = encode(&picture).expect_err("another size").to_string();
        assert!(error.contains("standard_error"));
    }

    #[test]
    fn channels_are_read_by_name() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("mask.exr");
        let samples = |first: f32| vec![first, 0.25, 1.0, 0.5];
        let channels = ["R", "G", "B", "A"].map(str::to_owned);
        let channels = channels.into_iter().zip([0.0, 0.1, 0.2, 0.3].map(samples));
        let bytes = encode_channels([2, 2], channels).expect("encodable");
        std::fs::write(&path, bytes).expect("writable");
        assert_eq!(
            read_channel(&path, "A").expect("four channels"),
            samples(0.3)
        );
        assert_eq!(
            read(&path).expect("an image").image.pixels[0],
            [0.0, 0.1, 0.2]
        );
        let error = read_channel(&path, "Z").expect_err("no such").to_string();
        assert!(error.contains("mask.exr has no channel Z"), "{error}");
    }

    #[test]
    fn other_files_are_refused_by_name() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("not.exr");
        std::fs::write(&path, "text").expect("writable");
        let error = read(&path).expect_err("not an image").to_string();
        assert!(error.contains("not.exr"));
    }
}
