//! `[[light]]`: the unit of its strength is the name of the key.
//!
//! | kind | keys of its strength |
//! |---|---|
//! | point, spot | `candela`, `lumens`, `watts_per_steradian`, `watts` |
//! | directional | `lux`, `watts_per_square_metre`, on a surface that faces the light |
//! | sky | `radiance`, `nits` (everywhere, or at the zenith), or `lux`, `watts_per_square_metre` on the level ground |
//! | environment | `radiance`, `nits` of an image value of one |
//!
//! A point source of flux Φ has the intensity Φ/4π, or Φ/π in the direction of one whose distribution is
//! Lambert's. A spot's falloff is that of
//! `KHR_lights_punctual`, t² with t rising linearly in the cosine from the outer to the inner angle,
//! so that its flux is 2π (1 − cos inner + (cos inner − cos outer)/3) times its intensity.

use super::document::Table;
use super::error::SceneFileError;
use super::settings::Settings;
use super::sky::{Horizon, refuse_unless, sky};
use super::value::Value;
use crate::light::{Light, LightKind};
use crate::load::{LoadError, unique_name};
use crate::material::Wrap;
use crate::radiometry::{Intensity, Irradiance, Radiance, Rgb};
use crate::scene::{Scene, UnitSystem};
use crate::texture_file::TextureFiles;
use glam::DVec3;
use std::f64::consts::PI;

const KINDS: &[&str] = &["point", "spot", "directional", "sky", "environment"];
const POINT_KEYS: &[&str] = &[
    "kind",
    "name",
    "color",
    "position",
    "distribution",
    "direction",
    "candela",
    "lumens",
    "watts_per_steradian",
    "watts",
];
const SPOT_KEYS: &[&str] = &[
    "kind",
    "name",
    "color",
    "position",
    "direction",
    "inner_angle",
    "outer_angle",
    "candela",
    "lumens",
    "watts_per_steradian",
    "watts",
];
const DIRECTIONAL_KEYS: &[&str] = &[
    "kind",
    "name",
    "color",
    "direction",
    "elevation",
    "azimuth",
    "up",
    "north",
    "lux",
    "watts_per_square_metre",
];
const SKY_KEYS: &[&str] = &[
    "kind",
    "name",
    "color",
    "model",
    "type",
    "sun_elevation",
    "sun_azimuth",
    "ground_reflectance",
    "up",
    "north",
    "radiance",
    "nits",
    "lux",
    "watts_per_square_metre",
];
const ENVIRONMENT_KEYS: &[&str] = &[
    "kind", "name", "color", "image", "up", "rotation", "radiance", "nits",
];
const ALL_KEYS: &[&str] = &[
    "kind",
    "name",
    "color",
    "position",
    "distribution",
    "direction",
    "elevation",
    "azimuth",
    "inner_angle",
    "outer_angle",
    "model",
    "type",
    "sun_elevation",
    "sun_azimuth",
    "ground_reflectance",
    "image",
    "up",
    "north",
    "rotation",
    "candela",
    "lumens",
    "watts_per_steradian",
    "watts",
    "lux",
    "watts_per_square_metre",
    "radiance",
    "nits",
];
const SOURCE_UNITS: &[&str] = &["candela", "lumens", "watts_per_steradian", "watts"];
const IRRADIANCE_UNITS: &[&str] = &["lux", "watts_per_square_metre"];
const RADIANCE_UNITS: &[&str] = &["radiance", "nits"];

/// Reads a light and what it is counted in. An environment's image goes into `scene`.
pub(super) fn read(
    value: &Value,
    settings: &Settings,
    scene: &mut Scene,
    textures: &mut TextureFiles,
) -> Result<(Light, UnitSystem), LoadError> {
    let any = value.table("[[light]]".to_owned(), ALL_KEYS)?;
    let kind = any.require("kind", "`kind = \"point\"`")?.choice(KINDS)?;
    let keys = match kind {
        "point" => POINT_KEYS,
        "spot" => SPOT_KEYS,
        "directional" => DIRECTIONAL_KEYS,
        "sky" => SKY_KEYS,
        _ => ENVIRONMENT_KEYS,
    };
    let table = value.table(format!("[[light]] of kind {kind}"), keys)?;
    let (kind, units) = match kind {
        "point" => point(&table, settings)?,
        "spot" => spot(&table, settings)?,
        "directional" => directional(&table, settings)?,
        "sky" => sky(&table, settings)?,
        _ => environment(&table, settings, scene, textures)?,
    };
    let name = match table.get("name") {
        Some(name) => name.string()?.to_owned(),
        None => any.require("kind", "")?.string()?.to_owned(),
    };
    let name = unique_name(&name, |name| {
        scene.lights.iter().any(|light| light.name == name)
    });
    Ok((Light { name, kind }, units))
}

/// The strength of a light in the unit of its key, coloured.
pub(super) struct Strength {
    pub(super) key: &'static str,
    pub(super) value: Rgb,
    pub(super) units: UnitSystem,
}

pub(super) fn strength(
    table: &Table,
    keys: &'static [&'static str],
) -> Result<Strength, SceneFileError> {
    let (key, value) = table.one_of(keys)?;
    let color = match table.get("color") {
        Some(color) => color.light()?,
        None => Rgb::ONE,
    };
    let units = match key {
        "candela" | "lumens" | "lux" | "nits" => UnitSystem::Photometric,
        _ => UnitSystem::Radiometric,
    };
    Ok(Strength {
        key,
        value: value.light()? * color,
        units,
    })
}

fn position(table: &Table, settings: &Settings) -> Result<DVec3, SceneFileError> {
    let position = table.require("position", "`position = [x, y, z]`")?;
    Ok(position.vector()? * settings.scale)
}

pub(super) fn unit(value: &Value, key: &'static str) -> Result<DVec3, SceneFileError> {
    value
        .vector()?
        .try_normalize()
        .ok_or_else(|| SceneFileError::NoDirection {
            place: value.place(),
            key,
            remedy: "write a vector other than zero",
        })
}

fn direction(table: &Table) -> Result<DVec3, SceneFileError> {
    let example = "`direction = [x, y, z]`, in which the light travels";
    unit(&table.require("direction", example)?, "`direction`")
}

pub(super) fn up(table: &Table, settings: &Settings) -> Result<DVec3, SceneFileError> {
    table
        .get("up")
        .map_or(Ok(settings.up), |value| unit(&value, "`up`"))
}

/// Intensity of a source whose flux is `solid_angle` times its intensity.
fn intensity(strength: &Strength, solid_angle: f64) -> Intensity {
    Intensity(match strength.key {
        "lumens" | "watts" => strength.value / solid_angle,
        _ => strength.value,
    })
}

pub(super) type Read = (LightKind, UnitSystem);

fn point(table: &Table, settings: &Settings) -> Result<Read, SceneFileError> {
    let strength = strength(table, SOURCE_UNITS)?;
    let position = position(table, settings)?;
    let distribution = match table.get("distribution") {
        Some(value) => value.choice(&["isotropic", "lambertian"])?,
        None => "isotropic",
    };
    let kind = if distribution == "lambertian" {
        LightKind::Lambertian {
            position,
            direction: direction(table)?,
            // ∫ cos θ dω over the hemisphere.
            intensity: intensity(&strength, PI),
        }
    } else {
        if let Some(direction) = table.get("direction") {
            return Err(SceneFileError::Needs {
                place: direction.place(),
                key: "direction",
                needed: "distribution = \"lambertian\"",
            });
        }
        LightKind::Point {
            position,
            intensity: intensity(&strength, 4.0 * PI),
        }
    };
    Ok((kind, strength.units))
}

fn spot(table: &Table, settings: &Settings) -> Result<Read, SceneFileError> {
    let outer = table
        .require("outer_angle", "`outer_angle = 30`, degrees from the axis")?
        .number_in("above 0 and at most 90 degrees", |x| x > 0.0 && x <= 90.0)?;
    let inner = match table.get("inner_angle") {
        Some(value) => value.number_in("at least 0 degrees and below `outer_angle`", |x| {
            x >= 0.0 && x < outer
        })?,
        None => 0.0,
    };
    let (inner_angle, outer_angle) = (inner.to_radians(), outer.to_radians());
    let (inner_cosine, outer_cosine) = (inner_angle.cos(), outer_angle.cos());
    let solid_angle = 2.0 * PI * (1.0 - inner_cosine + (inner_cosine - outer_cosine) / 3.0);
    let strength = strength(table, SOURCE_UNITS)?;
    let kind = LightKind::Spot {
        position: position(table, settings)?,
        direction: direction(table)?,
        intensity: intensity(&strength, solid_angle),
        inner_angle,
        outer_angle,
    };
    Ok((kind, strength.units))
}

fn directional(table: &Table, settings: &Settings) -> Result<Read, SceneFileError> {
    let strength = strength(table, IRRADIANCE_UNITS)?;
    let direction = match (table.get("direction"), table.get("elevation")) {
        (Some(direction), Some(_)) => {
            return Err(SceneFileError::Excludes {
                place: direction.place(),
                key: "direction",
                other: "elevation",
            });
        }
        (None, Some(_)) => {
            let horizon = Horizon::read(table, settings)?;
            -horizon.sun(table, "elevation", "azimuth")?
        }
        _ => {
            for key in ["azimuth", "north"] {
                refuse_unless(table, key, false, "elevation")?;
            }
            direction(table)?
        }
    };
    let kind = LightKind::Directional {
        direction,
        irradiance: Irradiance(strength.value),
    };
    Ok((kind, strength.units))
}

fn environment(
    table: &Table,
    settings: &Settings,
    scene: &mut Scene,
    textures: &mut TextureFiles,
) -> Result<Read, LoadError> {
    let strength = strength(table, RADIANCE_UNITS)?;
    let image = table.require("image", "`image = \"sky.hdr\"`")?;
    let rotation = table
        .get("rotation")
        .map_or(Ok(0.0), |value| value.number())?;
    let up = up(table, settings)?;
    let file = image.file()?;
    let kind = LightKind::Environment {
        texture: textures.load(scene, &file, Wrap::Repeat, &image.place())?,
        scale: Radiance(strength.value),
        rotation: rotation.to_radians(),
        up,
    };
    Ok((kind, strength.units))
}
