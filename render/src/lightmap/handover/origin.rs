//! What files say of themselves: quantity, unit, error and where they came from.

use crate::image::exr::{Baked, Origin};
use crate::lightmap::target::Quantity;
use luxel_scenes::UnitSystem;

/// What is known of all maps of a bake.
#[derive(Clone, Copy, Debug)]
pub struct Common<'a> {
    /// The program and its version.
    pub software: &'a str,
    /// Name of the scene.
    pub scene: &'a str,
    /// What its light is counted in.
    pub units: UnitSystem,
    /// Seed of all randomness.
    pub seed: u64,
}

/// What is known of all pages of a set of maps.
#[derive(Clone, Copy, Debug)]
pub struct Of<'a> {
    /// The bake.
    pub common: Common<'a>,
    /// What they hold: `all`, `direct` or `indirect` light, or `ao`.
    pub include: &'a str,
    /// Whether they are the maps that the delivered scene names.
    pub is_first: bool,
    /// Relative error of the light at luxels.
    pub error: f64,
}

/// What a map holds beside what is delivered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Values {
    /// Light or openness, filled and filtered.
    Master,
    /// Its standard error.
    Error,
    /// What was gathered.
    Luxels,
}

impl Of<'_> {
    /// The first part of the names of its files.
    pub fn stem(&self, page: usize) -> String {
        format!("{}_{page:03}", self.layer())
    }

    /// What the names of the files of all its pages begin with.
    pub fn layer(&self) -> &str {
        if self.is_first {
            "lightmap"
        } else {
            self.include
        }
    }

    /// Whether it is light, and not openness.
    pub(super) fn is_light(&self) -> bool {
        self.include != "ao"
    }

    /// What a file says of a page that is not delivered to a consumer.
    pub fn origin(&self, values: Values, page: usize) -> Origin {
        let what = if self.is_light() {
            "irradiance"
        } else {
            "openness"
        };
        let quantity = match values {
            Values::Master => what.to_owned(),
            Values::Error => format!("standard error of {what}"),
            Values::Luxels => format!("{what} at luxels"),
        };
        let unit = match self.common.units {
            _ if !self.is_light() => "1",
            UnitSystem::Radiometric => "W/m2",
            UnitSystem::Photometric => "lx",
        };
        self.described(quantity, unit, page)
    }

    /// What a file says of a page that is.
    pub(super) fn delivered(&self, quantity: Quantity, page: usize) -> Origin {
        if quantity == Quantity::Irradiance || !self.is_light() {
            return self.origin(Values::Master, page);
        }
        let unit = match self.common.units {
            UnitSystem::Radiometric => "W/(m2 sr)",
            UnitSystem::Photometric => "cd/m2",
        };
        self.described("white radiance".into(), unit, page)
    }

    fn described(&self, quantity: String, unit: &str, page: usize) -> Origin {
        let Common {
            software,
            scene,
            seed,
            ..
        } = self.common;
        Origin::Baked(Baked {
            software: software.to_owned(),
            scene: scene.to_owned(),
            include: self.include.to_owned(),
            quantity,
            unit: unit.to_owned(),
            error: self.error,
            page,
            seed,
        })
    }
}
