//! `[material.NAME]`: overrides what the geometry files say about a material, or makes a new one.

use super::document::Table;
use super::error::SceneFileError;
use super::settings::Settings;
use super::value::Value;
use crate::load::LoadError;
use crate::material::{Material, Sidedness, Specular, Wrap};
use crate::radiometry::{Radiance, Reflectance, Rgb};
use crate::scene::{Scene, UnitSystem};
use crate::texture_file::TextureFiles;

const KEYS: &[&str] = &[
    "reflectance",
    "reflectance_texture",
    "emission",
    "nits",
    "emission_texture",
    "two_sided",
    "mirror",
    "glass",
    "transmittance",
    "glossy",
    "exponent",
];

const REFLECTANCE: &str = "at least 0 and below 1 (a surface that absorbs nothing has no solution \
                           in a closed room; write at most 0.98)";
const FRACTION: &str = "at least 0 and at most 1";
/// Phong exponent of a highlight that gives none.
const EXPONENT: f64 = 10.0;

/// What a section says; nothing where it is silent.
#[derive(Clone, Debug, Default)]
pub(super) struct Override {
    reflectance: Option<Reflectance>,
    reflectance_texture: Option<crate::id::TextureId>,
    emission: Option<(Radiance, UnitSystem)>,
    emission_texture: Option<crate::id::TextureId>,
    sidedness: Option<Sidedness>,
    specular: Option<Specular>,
}

impl Override {
    /// Reads a section. Images go into `scene`.
    pub(super) fn read(
        value: &Value,
        settings: &Settings,
        scene: &mut Scene,
        textures: &mut TextureFiles,
    ) -> Result<Self, LoadError> {
        let table = value.table(format!("[material.{}]", value.key()), KEYS)?;
        let mut texture = |key: &str| -> Result<_, LoadError> {
            let Some(value) = table.get(key) else {
                return Ok(None);
            };
            let file = value.file()?;
            Ok(Some(textures.load(
                scene,
                &file,
                Wrap::Repeat,
                &value.place(),
            )?))
        };
        let reflectance_texture = texture("reflectance_texture")?;
        let emission_texture = texture("emission_texture")?;
        let fraction = |key: &str, range, is_allowed: fn(f64) -> bool| {
            let value = table.get(key);
            value
                .map(|value| value.rgb_in(range, is_allowed))
                .transpose()
        };
        let reflectance = fraction("reflectance", REFLECTANCE, |x| (0.0..1.0).contains(&x))?;
        let two_sided = table
            .get("two_sided")
            .map(|value| value.boolean())
            .transpose()?;
        Ok(Self {
            reflectance: reflectance.map(Reflectance),
            reflectance_texture,
            emission: emission(&table, settings)?,
            emission_texture,
            sidedness: two_sided.map(|two| {
                if two {
                    Sidedness::Both
                } else {
                    Sidedness::Front
                }
            }),
            specular: specular(&table)?,
        })
    }

    /// What the emission is counted in, where the section says it.
    pub(super) fn emission_units(&self) -> Option<UnitSystem> {
        self.emission.map(|(_, units)| units)
    }

    /// Changes what the section speaks of.
    pub(super) fn apply(&self, material: &mut Material) {
        if let Some(reflectance) = self.reflectance {
            material.reflectance = reflectance;
        }
        if let Some((emission, _)) = self.emission {
            material.emission = emission;
        }
        if let Some(sidedness) = self.sidedness {
            material.sidedness = sidedness;
        }
        if let Some(specular) = self.specular {
            material.specular = specular;
        }
        material.reflectance_texture = self.reflectance_texture.or(material.reflectance_texture);
        material.emission_texture = self.emission_texture.or(material.emission_texture);
    }
}

fn emission(
    table: &Table,
    settings: &Settings,
) -> Result<Option<(Radiance, UnitSystem)>, SceneFileError> {
    let keys: &[&str] = &["emission", "nits"];
    if keys.iter().all(|key| table.get(key).is_none()) {
        return Ok(None);
    }
    let (key, value) = table.one_of(&["emission", "nits"])?;
    let units = match key {
        "nits" => UnitSystem::Photometric,
        _ => settings.units.unwrap_or_default(),
    };
    Ok(Some((Radiance(value.light()?), units)))
}

/// `mirror`, `glass` or `glossy`, with what belongs to them.
fn specular(table: &Table) -> Result<Option<Specular>, SceneFileError> {
    for (key, needed) in [("transmittance", "glass"), ("exponent", "glossy")] {
        if let Some(value) = table.get(key)
            && table.get(needed).is_none()
        {
            let place = value.place();
            return Err(SceneFileError::Needs { place, key, needed });
        }
    }
    let keys: &[&str] = &["mirror", "glass", "glossy"];
    if keys.iter().all(|key| table.get(key).is_none()) {
        return Ok(None);
    }
    let (key, value) = table.one_of(&["mirror", "glass", "glossy"])?;
    let is_fraction = |x: f64| (0.0..=1.0).contains(&x);
    let specular = match key {
        "glass" => Specular::Glass {
            index_of_refraction: value
                .number_in("an index of refraction, above 0 (glass has 1.5)", |x| {
                    x > 0.0
                })?,
            transmittance: match table.get("transmittance") {
                Some(value) => value.rgb_in(FRACTION, is_fraction)?,
                None => Rgb::ONE,
            },
        },
        "mirror" => Specular::Mirror {
            reflectance: value.rgb_in(FRACTION, is_fraction)?,
        },
        _ => Specular::Glossy {
            reflectance: value.rgb_in(FRACTION, is_fraction)?,
            exponent: match table.get("exponent") {
                Some(value) => value.number_in("at least 0", |x| x >= 0.0)?,
                None => EXPONENT,
            },
        },
    };
    let is_nothing = matches!(
        specular,
        Specular::Mirror { reflectance } | Specular::Glossy { reflectance, .. }
            if reflectance == Rgb::ZERO
    );
    Ok(Some(if is_nothing { Specular::None } else { specular }))
}
