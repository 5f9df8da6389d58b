//! What the consumers of lightmaps want: the quantity that their shaders expect in a texel, and how they are told to show it.
//!
//! | consumer | its shader | so a texel holds |
//! |---|---|---|
//! | raw | | E |
//! | three.js (since r155) | irradiance += texel · lightMapIntensity, × albedo / π | E |
//! | Bevy | diffuse += texel · lightmap_exposure · albedo, × exposure of the view | E/π |
//! | Godot 4 | ambient += texel, × albedo | E/π |
//! | Blender | emission of texel · albedo | E/π |
//! | Unity | texel · albedo | E/π |
//!
//! Sources: three.js `lights_fragment_maps.glsl.js`, Bevy `lightmap.wesl` and `pbr_functions.wesl`. three.js was held against luxel's own
//! pictures (`tests/consumers/three`); what is said of Godot, Blender and Unity is their common use and was not tried there.

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
