//! `[[light]]` of kind sky, and where the sun stands.
//!
//! | model | keys besides the strength |
//! |---|---|
//! | uniform | |
//! | cie-overcast | |
//! | cie-clear | `sun_elevation`, `sun_azimuth` |
//! | cie-general | the same and `type`, from 1 to 15; types 1, 3 and 5 need no sun |
//!
//! With `ground_reflectance` ρ the directions below the horizon have the radiance ρE/π of a level
//! ground far away that the sky, without its sun, lights by E. Elevation is counted from the horizon,
//! azimuth from north over east, clockwise seen from above, both in degrees. North is +y where z is up,
//! else −z, unless `north` says otherwise. The sun itself is a light of its own, of kind directional.

use super::document::Table;
use super::error::SceneFileError;
use super::light::{Read, strength, unit, up};
use super::settings::Settings;
use crate::light::LightKind;
use crate::radiometry::{Radiance, Reflectance, Rgb};
use crate::sky::{GeneralSky, Sky};
use glam::DVec3;

const SKY_UNITS: &[&str] = &["radiance", "nits", "lux", "watts_per_square_metre"];

const SKY_MODELS: &[&str] = &["uniform", "cie-overcast", "cie-clear", "cie-general"];

/// Which way is up, and the points of the compass.
pub(super) struct Horizon {
    up: DVec3,
    north: DVec3,
    east: DVec3,
}

impl Horizon {
    pub(super) fn read(table: &Table, settings: &Settings) -> Result<Self, SceneFileError> {
        let up = up(table, settings)?;
        let (place, north) = match table.get("north") {
            Some(value) => (value.place(), unit(&value, "`north`")?),
            // Neither is ever vertical.
            None if up.z.abs() > up.y.abs() => (table.place(), DVec3::Y),
            None => (table.place(), DVec3::NEG_Z),
        };
        let north = (north - up * north.dot(up)).try_normalize();
        let north = north.ok_or(SceneFileError::NoDirection {
            place,
            key: "`north`",
            remedy: "write a vector along the horizon, not along `up`",
        })?;
        let east = north.cross(up);
        Ok(Self { up, north, east })
    }

    /// Unit vector to a sun whose angles stand in the given keys.
    pub(super) fn sun(
        &self,
        table: &Table,
        elevation: &'static str,
        azimuth: &'static str,
    ) -> Result<DVec3, SceneFileError> {
        let altitude = table
            .require(elevation, "the sun's angle above the horizon, in degrees")?
            .number_in("from 0 to 90 degrees", |x| (0.0..=90.0).contains(&x))?;
        let azimuth = table
            .require(azimuth, "the sun's angle from north over east, in degrees")?
            .number()?;
        let (sin, cos) = altitude.to_radians().sin_cos();
        let (east, north) = azimuth.to_radians().sin_cos();
        Ok(self.up * sin + (self.north * north + self.east * east) * cos)
    }
}

pub(super) fn sky(table: &Table, settings: &Settings) -> Result<Read, SceneFileError> {
    let example = "`model = \"uniform\"`, \"cie-overcast\", \"cie-clear\" or \"cie-general\"";
    let model = table.require("model", example)?.choice(SKY_MODELS)?;
    let strength = strength(table, SKY_UNITS)?;
    let horizon = Horizon::read(table, settings)?;
    let number = match model {
        "cie-clear" => Some(GeneralSky::CLEAR),
        "cie-general" => Some(
            table
                .require("type", "`type = 12`, a CIE general sky from 1 to 15")?
                .number_in("a whole number from 1 to 15", |x| {
                    (1.0..=15.0).contains(&x) && x.fract() == 0.0
                })? as u8,
        ),
        _ => None,
    };
    refuse_unless(
        table,
        "type",
        model == "cie-general",
        "model = \"cie-general\"",
    )?;
    for key in ["sun_elevation", "sun_azimuth"] {
        let needed = "model = \"cie-clear\" or \"cie-general\"";
        refuse_unless(table, key, number.is_some(), needed)?;
    }
    // The radiance of a zenith of one, to begin with.
    let one = Radiance::splat(1.0);
    let relative = match number {
        None if model == "uniform" => Sky::Uniform { radiance: one },
        None => Sky::CieOvercast { zenith: one },
        Some(number) => {
            let is_symmetric = GeneralSky::is_rotationally_symmetric(number);
            let sun = if is_symmetric && table.get("sun_elevation").is_none() {
                horizon.up
            } else {
                horizon.sun(table, "sun_elevation", "sun_azimuth")?
            };
            let distribution = GeneralSky::new(number, sun, horizon.up)
                .expect("number and elevation are in range");
            Sky::CieGeneral {
                zenith: one,
                distribution,
            }
        }
    };
    let on_ground = relative.ground_irradiance().0.x;
    let zenith = Radiance(match strength.key {
        "lux" | "watts_per_square_metre" => strength.value / on_ground,
        _ => strength.value,
    });
    let sky = match relative {
        Sky::Uniform { .. } => Sky::Uniform { radiance: zenith },
        Sky::CieOvercast { .. } => Sky::CieOvercast { zenith },
        Sky::CieGeneral { distribution, .. } => Sky::CieGeneral {
            zenith,
            distribution,
        },
    };
    let reflectance = match table.get("ground_reflectance") {
        Some(value) => value.rgb_in("at least 0 and below 1", |x| (0.0..1.0).contains(&x))?,
        None => Rgb::ZERO,
    };
    let ground = (Reflectance(reflectance) * sky.ground_irradiance()).to_radiance();
    let up = horizon.up;
    Ok((LightKind::Sky { sky, up, ground }, strength.units))
}

/// Refuses a key that would have no effect.
pub(super) fn refuse_unless(
    table: &Table,
    key: &'static str,
    is_used: bool,
    needed: &'static str,
) -> Result<(), SceneFileError> {
    match table.get(key) {
        Some(value) if !is_used => Err(SceneFileError::Needs {
            place: value.place(),
            key,
            needed,
        }),
        _ => Ok(()),
    }
}
