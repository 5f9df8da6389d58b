//! `[scene]`.

use super::document::Table;
use super::error::SceneFileError;
use crate::scene::UnitSystem;
use glam::DVec3;

const KEYS: &[&str] = &["name", "scale", "up", "units"];

/// What holds for the whole file.
#[derive(Clone, Debug)]
pub(super) struct Settings {
    pub(super) name: Option<String>,
    /// Metres per unit of length of the geometry and of this file.
    pub(super) scale: f64,
    /// The default upward direction. Coordinates stay as they are.
    pub(super) up: DVec3,
    /// What `Ke` and `emission` are counted in, if said.
    pub(super) units: Option<UnitSystem>,
}

impl Settings {
    pub(super) fn read(root: &Table) -> Result<Self, SceneFileError> {
        let mut settings = Self {
            name: None,
            scale: 1.0,
            up: DVec3::Y,
            units: None,
        };
        let Some(value) = root.get("scene") else {
            return Ok(settings);
        };
        let table = value.table("[scene]".to_owned(), KEYS)?;
        if let Some(name) = table.get("name") {
            settings.name = Some(name.string()?.to_owned());
        }
        if let Some(scale) = table.get("scale") {
            settings.scale = scale.number_in("metres per unit, above 0 and at most 1e30", |x| {
                x > 0.0 && x <= 1e30
            })?;
        }
        if let Some(up) = table.get("up")
            && up.choice(&["y", "z"])? == "z"
        {
            settings.up = DVec3::Z;
        }
        if let Some(units) = table.get("units") {
            settings.units = Some(match units.choice(&["radiometric", "photometric"])? {
                "photometric" => UnitSystem::Photometric,
                _ => UnitSystem::Radiometric,
            });
        }
        Ok(settings)
    }
}
