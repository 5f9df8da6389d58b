//! Lights that are not surfaces: point, spot, directional, sky and environment.
//!
//! Emissive faces are not listed here: their emission is a property of their material.

use crate::id::TextureId;
use crate::radiometry::{Intensity, Irradiance, Radiance};
use crate::sky::Sky;
use glam::DVec3;

/// A named light.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Its name in the file, or its kind and number.
    pub name: String,
    /// What it is.
    pub kind: LightKind,
}

/// The kinds of light.
#[derive(Clone, Debug, PartialEq)]
pub enum LightKind {
    /// An isotropic point source.
    Point {
        /// Position in metres.
        position: DVec3,
        /// Intensity in W/sr, the same in all directions.
        intensity: Intensity,
    },
    /// A point source with Lambert's distribution, that of a small diffuse luminaire: I cos θ at the
    /// angle θ from its direction, nothing behind it.
    Lambertian {
        /// Position in metres.
        position: DVec3,
        /// Unit vector in which it shines.
        direction: DVec3,
        /// Intensity in that direction in W/sr.
        intensity: Intensity,
    },
    /// A point source that shines into a cone, as `KHR_lights_punctual` defines it: full intensity
    /// inside `inner_angle`, smooth to zero at `outer_angle`.
    Spot {
        /// Position in metres.
        position: DVec3,
        /// Unit vector in which the spot shines.
        direction: DVec3,
        /// Intensity on the axis in W/sr.
        intensity: Intensity,
        /// Angle from the axis, in radians, up to which the intensity is full.
        inner_angle: f64,
        /// Angle from the axis, in radians, from which it is zero.
        outer_angle: f64,
    },
    /// Parallel light from infinitely far away.
    Directional {
        /// Unit vector in which the light travels.
        direction: DVec3,
        /// Irradiance in W/m² on a surface that faces the light.
        irradiance: Irradiance,
    },
    /// Radiance of the sky by formula.
    Sky {
        /// The formula.
        sky: Sky,
        /// Unit vector to the zenith.
        up: DVec3,
        /// Radiance in W/(m² sr) from below the horizon: that of a level ground far away.
        ground: Radiance,
    },
    /// Radiance from an image of all directions (latitude–longitude, top row at the zenith).
    Environment {
        /// The image.
        texture: TextureId,
        /// Radiance in W/(m² sr) of an image value of one.
        scale: Radiance,
        /// Rotation about `up`, in radians.
        rotation: f64,
        /// Unit vector to the top of the image.
        up: DVec3,
    },
}
