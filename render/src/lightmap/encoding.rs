//! The files that maps are delivered in, and what each of them loses.
//!
//! A map is made from its master, irradiance E (or openness) in 32-bit floats, times the factor of what the consumer wants: the product is
//! taken in 64 bits and rounded once more, into the file. So a file's error is that of its own encoding; the master's, at most
//! 2⁻²⁴ of a value, is below all of them.
//!
//! | format | file | largest value | no channel changes by more than |
//! |---|---|---|---|
//! | exr | OpenEXR, 32-bit floats, ZIP | 3.4 · 10³⁸ | 2⁻²⁴ of itself |
//! | hdr | Radiance RGBE | 1.7 · 10³⁸, from 8 · 10⁻³¹ | 2⁻⁸/(1 − 2⁻⁹) of the pixel's largest channel |
//! | ktx2 | KTX2, half floats | 65 504 | 2⁻¹¹ of itself, below 2⁻¹⁴ 2⁻²⁵ |
//! | bc6h | KTX2, BC6H | 65 504 | (no bound) |
//! | rgbm | PNG, RGB and multiplier | the map's own | 1/255 of the pixel's largest channel, below R/255 R/130 050 |
//!
//! Derivations stand with the formats ([`crate::image`]). Besides the bound the loss is measured: every map is read back,
//! and [`Encoded::error`] is the root of the mean square of the differences over the mean, of all texels and channels of the page.
//! What is above a format's range is moved to its end and counted; what noise has brought below zero becomes zero, which only lessens
//! its error. Cost: linear in the texels.

use crate::image::exr::{self, EncodeExrError, Origin, Picture};
use crate::image::hdr::{self, EncodeHdrError};
use crate::image::rgbm::{self, EncodeRgbmError};
use crate::image::{Image, ktx2};
use serde::{Deserialize, Serialize};

/// A kind of file for maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// OpenEXR, 32-bit floats
    Exr,
    /// Radiance HDR (RGBE)
    Hdr,
    /// KTX2 with half floats
    Ktx2,
    /// KTX2 with blocks of BC6H
    Bc6h,
    /// PNG with a multiplier in alpha, for shaders that decode it
    Rgbm,
}

/// Why a map cannot be encoded.
#[derive(Debug, thiserror::Error)]
pub enum EncodeMapError {
    /// As OpenEXR.
    #[error(transparent)]
    Exr(#[from] EncodeExrError),
    /// As Radiance HDR.
    #[error(transparent)]
    Hdr(#[from] EncodeHdrError),
    /// As RGBM.
    #[error(transparent)]
    Rgbm(#[from] EncodeRgbmError),
    /// The origin cannot be written as JSON.
    #[error("the origin of a map cannot be written")]
    Origin(#[from] serde_json::Error),
    /// The program cannot make such files.
    #[error(transparent)]
    Missing(#[from] MissingFeature),
}

/// A format that was left out when the program was built.
#[derive(Debug, thiserror::Error)]
#[error(
    "this luxel was built without its default feature `bc6h`, which --format bc6h needs; build it with: cargo build --release --features bc6h"
)]
pub struct MissingFeature;

/// A map before it is encoded.
#[derive(Clone, Copy, Debug)]
pub struct Scaled<'a> {
    /// Irradiance or openness.
    pub master: &'a Image,
    /// What its values are multiplied with.
    pub factor: f64,
}

/// A map as a file.
#[derive(Clone, Debug)]
pub struct Encoded {
    /// The file.
    pub bytes: Vec<u8>,
    /// What decoded values are to be multiplied with: the range of RGBM, else 1.
    pub scale: f64,
    /// Measured loss: root mean square of the differences over the mean.
    pub error: f64,
    /// Channels of texels that were above the range and were moved to its end.
    pub clamped: usize,
}

impl Format {
    /// Extension of its files.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Exr => "exr",
            Self::Hdr => "hdr",
            Self::Ktx2 | Self::Bc6h => "ktx2",
            Self::Rgbm => "png",
        }
    }

    /// How a texel is got from a file, in the words of the manifest.
    pub fn formula(self) -> &'static str {
        match self {
            Self::Exr | Self::Hdr | Self::Ktx2 | Self::Bc6h => "texel = rgb",
            Self::Rgbm => "texel = rgb * a * scale",
        }
    }

    /// The largest value that its files hold; `None` where that is the map's own.
    pub fn largest(self) -> Option<f64> {
        match self {
            Self::Exr => Some(f64::from(f32::MAX)),
            Self::Hdr => Some(hdr::LARGEST),
            Self::Ktx2 | Self::Bc6h => Some(ktx2::LARGEST),
            Self::Rgbm => None,
        }
    }

    /// Whether this program can make its files.
    ///
    /// # Errors
    /// When it was built without the feature that they need.
    pub fn require(self) -> Result<(), MissingFeature> {
        if self == Self::Bc6h && cfg!(not(feature = "bc6h")) {
            return Err(MissingFeature);
        }
        Ok(())
    }
}

impl Scaled<'_> {
    /// The file of a map. `origin` says what it holds, for the formats that have a place for it.
    ///
    /// # Errors
    /// When an encoder refuses, or the program was built without it.
    ///
    /// # Panics
    /// When BC6H is asked for and a side of the map is no multiple of four.
    pub fn encode(&self, format: Format, origin: &Origin) -> Result<Encoded, EncodeMapError> {
        format.require()?;
        let size = [self.master.width, self.master.height];
        let (range, scale) = match format.largest() {
            Some(largest) => (largest, 1.0),
            None => self.own_range(),
        };
        let texels = || self.texels().map(|texel| texel.map(|x| within(x, range)));
        let (bytes, error) = match format {
            Format::Exr => {
                let pixels = texels().map(|texel| texel.map(|x| x as f32)).collect();
                let image = Image {
                    width: size[0],
                    height: size[1],
                    pixels,
                };
                let error = self.error(image.pixels.iter().map(|texel| texel.map(f64::from)));
                let picture = Picture {
                    image,
                    layers: Vec::new(),
                    origin: Some(origin.clone()),
                };
                (exr::encode(&picture)?, error)
            }
            Format::Hdr => {
                let error = self.error(texels().map(hdr::rounded));
                (hdr::encode(texels(), size)?, error)
            }
            Format::Ktx2 => {
                let level = ktx2::half_floats(texels());
                let note = serde_json::to_string(origin)?;
                let kind = ktx2::Texels::HalfFloat;
                let bytes = ktx2::encode(kind, size, &level, &[("luxel", &note)]);
                let halves = texels().map(|texel| texel.map(|x| ktx2::half(x).to_f64()));
                (bytes, self.error(halves))
            }
            Format::Bc6h => self.blocks(texels(), size, origin)?,
            Format::Rgbm => {
                let stored = texels().map(|texel| rgbm::samples(texel, scale));
                let error = self.error(stored.map(|samples| rgbm::values(samples, scale)));
                (rgbm::encode(texels(), size, scale)?, error)
            }
        };
        let values = self.texels().flatten();
        Ok(Encoded {
            bytes,
            scale,
            error,
            clamped: values.filter(|&x| x > range || x.is_nan()).count(),
        })
    }

    #[cfg(feature = "bc6h")]
    fn blocks(
        &self,
        texels: impl Iterator<Item = [f64; 3]>,
        size: [usize; 2],
        origin: &Origin,
    ) -> Result<(Vec<u8>, f64), EncodeMapError> {
        use crate::image::bc6h;
        let blocks = bc6h::encode(texels, size);
        let note = serde_json::to_string(origin)?;
        let bytes = ktx2::encode(ktx2::Texels::Bc6h, size, &blocks, &[("luxel", &note)]);
        let found = bc6h::decode(&blocks, size).into_iter();
        Ok((bytes, self.error(found.map(|texel| texel.map(f64::from)))))
    }

    #[cfg(not(feature = "bc6h"))]
    #[expect(
        clippy::unused_self,
        reason = "has the signature of what the feature brings"
    )]
    fn blocks(
        &self,
        _: impl Iterator<Item = [f64; 3]>,
        _: [usize; 2],
        _: &Origin,
    ) -> Result<(Vec<u8>, f64), EncodeMapError> {
        Err(MissingFeature.into())
    }

    /// What the texels are to be, row by row.
    fn texels(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        let pixels = self.master.pixels.iter();
        pixels.map(|pixel| pixel.map(|x| f64::from(x) * self.factor))
    }

    /// The largest value, twice; one for a map without light, which then has a range as well.
    fn own_range(&self) -> (f64, f64) {
        let finite = self.texels().flatten().filter(|x| x.is_finite());
        let largest = finite.fold(0.0, f64::max);
        let range = if largest > 0.0 { largest } else { 1.0 };
        (range, range)
    }

    /// Root mean square of what found values differ by, over the mean of what they are to be; zero of a map without light.
    fn error(&self, found: impl Iterator<Item = [f64; 3]>) -> f64 {
        let (mut squares, mut sum) = (0.0, 0.0);
        let pairs = self.texels().zip(found);
        let pairs = pairs.flat_map(|(a, b)| std::iter::zip(a, b));
        for (expected, found) in pairs.filter(|(expected, _)| expected.is_finite()) {
            squares += (expected - found).powi(2);
            sum += expected;
        }
        let count = 3.0 * self.master.pixels.len().max(1) as f64;
        if sum > 0.0 {
            (squares / count).sqrt() / (sum / count)
        } else {
            0.0
        }
    }
}

/// The nearest value from zero to the largest; what is no number is dark.
fn within(value: f64, largest: f64) -> f64 {
    if value.is_nan() {
        0.0
    } else {
        value.clamp(0.0, largest)
    }
}

#[cfg(test)]
mod tests;
