//! Radiometric quantities, linear RGB, one type each.
//!
//! | type | symbol | unit | meaning |
//! |---|---|---|---|
//! | [`Radiance`] | L | W/(m² sr) | along a ray |
//! | [`Radiosity`] | B | W/m² | leaving a surface, emitted and reflected |
//! | [`Exitance`] | M | W/m² | leaving a surface, emitted only |
//! | [`Irradiance`] | E | W/m² | arriving at a surface |
//! | [`Flux`] | Φ | W | |
//! | [`Intensity`] | I | W/sr | of a point source |
//! | [`Reflectance`] | ρ | 1 | diffuse, in [0, 1) |
//!
//! For a diffuse emitter or reflector B = πL: the factor π stands in this file and nowhere else.
//! In a scene that is written in photometric units ([`crate::UnitSystem::Photometric`]) the same
//! types carry lumens in the place of watts.

use glam::DVec3;
use std::f64::consts::PI;

/// A linear RGB triple without a unit of its own.
pub type Rgb = DVec3;

macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Default, serde::Serialize, serde::Deserialize)]
        pub struct $name(pub Rgb);

        impl $name {
            /// No light.
            pub const ZERO: Self = Self(Rgb::ZERO);

            /// The same value in the three channels.
            pub const fn splat(value: f64) -> Self {
                Self(Rgb::splat(value))
            }

            /// A value from red, green and blue.
            pub const fn new(red: f64, green: f64, blue: f64) -> Self {
                Self(Rgb::new(red, green, blue))
            }
        }

        impl std::ops::Add for $name {
            type Output = Self;
            fn add(self, other: Self) -> Self {
                Self(self.0 + other.0)
            }
        }

        impl std::ops::AddAssign for $name {
            fn add_assign(&mut self, other: Self) {
                self.0 += other.0;
            }
        }

        impl std::ops::Sub for $name {
            type Output = Self;
            fn sub(self, other: Self) -> Self {
                Self(self.0 - other.0)
            }
        }

        impl std::ops::Mul<f64> for $name {
            type Output = Self;
            fn mul(self, factor: f64) -> Self {
                Self(self.0 * factor)
            }
        }

        impl std::iter::Sum for $name {
            fn sum<I: Iterator<Item = Self>>(values: I) -> Self {
                values.fold(Self::ZERO, |sum, value| sum + value)
            }
        }
    };
}

quantity!(
    /// Radiance L in W/(m² sr).
    Radiance
);
quantity!(
    /// Radiosity B in W/m²: all the flux that leaves a surface, per area.
    Radiosity
);
quantity!(
    /// Emitted exitance M in W/m².
    Exitance
);
quantity!(
    /// Irradiance E in W/m².
    Irradiance
);
quantity!(
    /// Flux Φ in W.
    Flux
);
quantity!(
    /// Intensity I in W/sr.
    Intensity
);

/// Diffuse reflectance ρ, each channel in [0, 1).
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Reflectance(pub Rgb);

impl Reflectance {
    /// A black surface.
    pub const ZERO: Self = Self(Rgb::ZERO);

    /// The same value in the three channels.
    pub const fn splat(value: f64) -> Self {
        Self(Rgb::splat(value))
    }

    /// A value from red, green and blue.
    pub const fn new(red: f64, green: f64, blue: f64) -> Self {
        Self(Rgb::new(red, green, blue))
    }

    /// True when every channel lies in [0, 1), the range of a physical diffuse surface here.
    pub fn is_valid(self) -> bool {
        self.0.to_array().iter().all(|c| (0.0..1.0).contains(c))
    }
}

impl std::ops::Mul<Irradiance> for Reflectance {
    type Output = Radiosity;
    /// ρE: the radiosity that a diffuse surface reflects.
    fn mul(self, irradiance: Irradiance) -> Radiosity {
        Radiosity(self.0 * irradiance.0)
    }
}

impl Radiance {
    /// M = πL of a diffuse emitter.
    pub fn to_exitance(self) -> Exitance {
        Exitance(self.0 * PI)
    }

    /// B = πL of a diffuse surface.
    pub fn to_radiosity(self) -> Radiosity {
        Radiosity(self.0 * PI)
    }

    /// E = πL under a hemisphere of uniform radiance L.
    pub fn to_irradiance(self) -> Irradiance {
        Irradiance(self.0 * PI)
    }
}

impl Radiosity {
    /// L = B/π of a diffuse surface.
    pub fn to_radiance(self) -> Radiance {
        Radiance(self.0 / PI)
    }
}

impl Exitance {
    /// L = M/π of a diffuse emitter.
    pub fn to_radiance(self) -> Radiance {
        Radiance(self.0 / PI)
    }
}

impl std::ops::Add<Radiosity> for Exitance {
    type Output = Radiosity;
    /// B = M + ρE.
    fn add(self, reflected: Radiosity) -> Radiosity {
        Radiosity(self.0 + reflected.0)
    }
}
