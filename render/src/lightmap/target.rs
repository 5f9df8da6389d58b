//! What the consumers of lightmaps want: the quantity that their shaders expect in a texel, the files that they load, and how they
//! are told to show it.
//!
//! | consumer | its shader | so a texel holds | loads, the default first |
//! |---|---|---|---|
//! | raw | | E | all |
//! | three.js (since r155) | irradiance += texel · lightMapIntensity, × albedo / π | E | exr, hdr, ktx2 |
//! | Bevy | diffuse += texel · lightmap_exposure · albedo, × exposure of the view | E/π | ktx2, bc6h, hdr, exr |
//! | Godot 4 | ambient += texel, × albedo | E/π | exr, hdr, rgbm |
//! | Blender | emission of texel · albedo | E/π | exr, hdr, rgbm |
//! | Unity | texel · albedo | E/π | exr, hdr |
//!
//! Sources: three.js `lights_fragment_maps.glsl.js`, Bevy `lightmap.wesl` and `pbr_functions.wesl`. three.js was held against luxel's
//! own pictures, Blender against a furnace, and Bevy's loaders against the masters (`tests/consumers`); what is said of Godot and Unity is their common use
//! and was not tried there.
//!
//! Of files: Bevy 0.19 has `ktx2`, `zstd_rust` and `hdr` among its default features and `exr` not (`bevy/Cargo.toml`), and makes 32-bit
//! textures of HDR and EXR, which many graphics processors do not filter (`bevy_image`, `hdr_texture_loader.rs`); half floats
//! in KTX2 stay such. three.js r187 knows no BC6H in KTX2 (`KTX2Loader.js`, `FORMAT_MAP`), and reads HDR files 256/255 too bright
//! (`HDRLoader.js`). Godot and Unity import EXR and HDR (their manuals, "Importing images" and "Texture file formats"). Programs
//! that have no loader for RGBM can be given it where the snippet decodes it.

use super::encoding::Format;
use std::f64::consts::FRAC_1_PI;

/// A consumer.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum Target {
    /// Irradiance E as it is
    Raw,
    /// three.js
    Three,
    /// Bevy
    Bevy,
    /// Godot 4
    Godot,
    /// Blender
    Blender,
    /// Unity
    Unity,
}

/// What a texel holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quantity {
    /// Irradiance E.
    Irradiance,
    /// E/π: the radiance of a white wall.
    WhiteRadiance,
}

impl Quantity {
    /// What irradiance is multiplied with.
    pub fn factor(self) -> f64 {
        match self {
            Self::Irradiance => 1.0,
            Self::WhiteRadiance => FRAC_1_PI,
        }
    }
}

impl Target {
    /// What its texels hold.
    pub fn quantity(self) -> Quantity {
        match self {
            Self::Raw | Self::Three => Quantity::Irradiance,
            Self::Bevy | Self::Godot | Self::Blender | Self::Unity => Quantity::WhiteRadiance,
        }
    }

    /// The files that it loads, the one that suits it best first.
    pub fn formats(self) -> &'static [Format] {
        use Format::{Bc6h, Exr, Hdr, Ktx2, Rgbm};
        match self {
            Self::Raw => &[Exr, Hdr, Ktx2, Bc6h, Rgbm],
            Self::Three => &[Exr, Hdr, Ktx2],
            Self::Bevy => &[Ktx2, Bc6h, Hdr, Exr],
            Self::Godot | Self::Blender => &[Exr, Hdr, Rgbm],
            Self::Unity => &[Exr, Hdr],
        }
    }

    /// A file that shows how the maps are loaded there: its name and its text.
    pub fn snippet(self) -> Option<(&'static str, &'static str)> {
        match self {
            Self::Raw => None,
            Self::Three => Some(("three.js", include_str!("snippets/three.js"))),
            Self::Bevy => Some(("bevy.rs", include_str!("snippets/bevy.rs"))),
            Self::Godot => Some(("godot.gd", include_str!("snippets/godot.gd"))),
            Self::Blender => Some(("blender.py", include_str!("snippets/blender.py"))),
            Self::Unity => Some(("unity.cs", include_str!("snippets/unity.cs"))),
        }
    }
}
