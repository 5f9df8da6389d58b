//! What is made of a bake for one consumer: maps in the unit and the kind of file that it wants, their description, and a snippet.
//!
//! `luxel bake` and `luxel export` both end here and begin with the same: masters in 32-bit floats, E in W/m² or lx, or openness. So
//! exporting a bake for somebody gives the same bytes as baking it for them.

mod origin;

pub use origin::{Common, Of, Values};

use super::encoding::{EncodeMapError, Encoded, Format, MissingFeature, Scaled};
use super::manifest::{Bevy, Encoding, Manifest, Page, Units};
use super::target::Target;
use crate::image::Image;
use clap::ValueEnum;
use luxel_scenes::UnitSystem;

/// For whom maps are made, and as what.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Handover {
    target: Target,
    format: Format,
}

/// Why maps are not made for somebody in some kind of file.
#[derive(Debug, thiserror::Error)]
pub enum HandoverError {
    /// The consumer could not load them.
    #[error(
        "--format {}: --for {} loads {}; choose one of these, or --for raw", word(.format), word(.target), known(*.target)
    )]
    Unknown {
        /// For whom.
        target: Target,
        /// The kind of file.
        format: Format,
    },
    /// The program cannot make them.
    #[error(transparent)]
    Missing(#[from] MissingFeature),
}

/// A page as files with their names.
#[derive(Clone, Debug)]
pub struct Files {
    /// How texels are got from the first of the files.
    pub encoding: Encoding,
    /// What the engine loads.
    pub file: (String, Vec<u8>),
    /// The master where it is a file of its own.
    pub master: Option<(String, Vec<u8>)>,
}

impl Files {
    /// The name of the master.
    pub fn master_name(&self) -> &str {
        self.master.as_ref().map_or(&self.file.0, |(name, _)| name)
    }
}

impl Handover {
    /// Maps for somebody, in the kind of file that is asked for or else the one that suits the consumer best.
    ///
    /// # Errors
    /// When the consumer does not load that kind, or this program does not make it.
    pub fn new(target: Target, format: Option<Format>) -> Result<Self, HandoverError> {
        let format = format.unwrap_or(target.formats()[0]);
        if !target.formats().contains(&format) {
            return Err(HandoverError::Unknown { target, format });
        }
        format.require()?;
        Ok(Self { target, format })
    }

    /// The files of a page with a master. Openness is the same to everybody; light is what the consumer wants.
    ///
    /// # Errors
    /// When an encoder refuses.
    pub fn files(self, master: &Image, of: &Of, page: usize) -> Result<Files, EncodeMapError> {
        let quantity = self.target.quantity();
        let factor = if of.is_light() {
            quantity.factor()
        } else {
            1.0
        };
        let map = Scaled { master, factor };
        let origin = of.delivered(quantity, page);
        let Encoded {
            bytes,
            scale,
            error,
            clamped,
        } = map.encode(self.format, &origin)?;
        let stem = of.stem(page);
        let is_master = self.format == Format::Exr && origin == of.origin(Values::Master, page);
        let master = if is_master {
            None
        } else {
            let map = Scaled {
                master,
                factor: 1.0,
            };
            let file = map.encode(Format::Exr, &of.origin(Values::Master, page))?;
            Some((format!("{stem}_master.exr"), file.bytes))
        };
        Ok(Files {
            encoding: Encoding {
                format: self.format,
                formula: self.format.formula().to_owned(),
                scale,
                factor,
                loss: error,
                clamped,
            },
            file: (format!("{stem}.{}", self.format.extension()), bytes),
            master,
        })
    }

    /// What the manifest says of units.
    pub fn units(self, units: UnitSystem) -> Units {
        let quantity = self.target.quantity();
        Units {
            quantity,
            unit: match units {
                UnitSystem::Radiometric => "W/m2".into(),
                UnitSystem::Photometric => "lx".into(),
            },
            factor: quantity.factor(),
            colour_space: "linear Rec. 709".into(),
            target: self.target,
        }
    }

    /// The numbers that Bevy wants, for it alone.
    pub fn bevy(self, units: UnitSystem, exposure: f64) -> Option<Bevy> {
        (self.target == Target::Bevy).then(|| Bevy::new(units, exposure))
    }

    /// A file that shows how the maps are loaded, with what differs between bakes filled in: its name and its text.
    pub fn snippet(self, manifest: &Manifest) -> Option<(&'static str, String)> {
        let (name, text) = self.target.snippet()?;
        let exposure = manifest.bevy.map_or(1.0, |bevy| bevy.lightmap_exposure);
        let scale = |page: &Page| format!("{:?}", page.encoding.scale);
        let scales: Vec<String> = manifest.lightmap.pages.iter().map(scale).collect();
        let multiplier = match self.format {
            Format::Rgbm => "texel.a * scale",
            Format::Exr | Format::Hdr | Format::Ktx2 | Format::Bc6h => "1.0",
        };
        let text = text
            .replace("{lightmap_exposure}", &format!("{exposure:?}"))
            .replace("{exposure}", &format!("{:?}", manifest.exposure))
            .replace("{scales}", &scales.join(", "))
            .replace("{multiplier}", multiplier);
        Some((name, text))
    }
}

/// A sentence for each map that has values above the range of its kind of file.
pub fn warnings(manifest: &Manifest) -> impl Iterator<Item = String> {
    let all = pages(manifest).filter(|page| page.encoding.clamped > 0);
    all.map(|page| {
        let Encoding {
            format, clamped, ..
        } = page.encoding;
        let most = format.largest().unwrap_or(f64::INFINITY);
        format!(
            "{}: {clamped} values lie above {most}, the largest that {} holds, and were moved there; --format exr or hdr keeps them",
            page.file,
            word(&format)
        )
    })
}

/// What the maps' kind of file changes of them, where that is more than the rounding of 32-bit floats.
pub fn loss(manifest: &Manifest) -> Option<String> {
    let most = pages(manifest).max_by(|a, b| a.encoding.loss.total_cmp(&b.encoding.loss))?;
    let Encoding { format, loss, .. } = most.encoding;
    (format != Format::Exr).then(|| {
        format!(
            "{} changes maps by at most {:.2e} (root mean square over the mean of a page)",
            word(&format),
            loss
        )
    })
}

/// The pages of all sets of maps.
fn pages(manifest: &Manifest) -> impl Iterator<Item = &Page> {
    let layers = std::iter::once(&manifest.lightmap).chain(&manifest.others);
    layers.flat_map(|layer| &layer.pages)
}

/// A value as the command line calls it.
fn word(value: &impl ValueEnum) -> String {
    value
        .to_possible_value()
        .map(|value| value.get_name().to_owned())
        .unwrap_or_default()
}

/// The kinds of file that somebody loads, as a list.
fn known(target: Target) -> String {
    let names: Vec<String> = target.formats().iter().map(word).collect();
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everybody_gets_what_is_loaded_there() {
        for target in Target::value_variants() {
            for format in Format::value_variants() {
                let found = Handover::new(*target, Some(*format));
                if !target.formats().contains(format) {
                    let error = found.expect_err("not loaded").to_string();
                    assert!(error.contains("--for raw"), "{error}");
                } else if format.require().is_ok() {
                    assert!(found.is_ok());
                } else {
                    let error = found.expect_err("not built").to_string();
                    assert!(error.contains("--features bc6h"), "{error}");
                }
            }
            assert!(Handover::new(*target, None).is_ok(), "{target:?}");
        }
    }

    #[test]
    fn masters_are_told_from_what_is_delivered() {
        let master = Image {
            width: 4,
            height: 4,
            pixels: vec![[2.0, 70_000.0, 0.5]; 16],
        };
        let of = Of {
            common: Common {
                software: "luxel",
                scene: "room",
                units: UnitSystem::Photometric,
                seed: 1,
            },
            include: "all",
            is_first: true,
            error: 0.01,
        };
        let openness = Of {
            include: "ao",
            is_first: false,
            ..of
        };
        let files = |target, format, of: &Of| {
            let handover = Handover::new(target, Some(format)).expect("loaded");
            handover.files(&master, of, 2).expect("encodable")
        };
        let raw = files(Target::Raw, Format::Exr, &of);
        assert_eq!(raw.file.0, "lightmap_002.exr");
        assert_eq!(raw.master_name(), "lightmap_002.exr");
        assert!(raw.master.is_none() && raw.encoding.clamped == 0);

        let bevy = files(Target::Bevy, Format::Ktx2, &of);
        assert_eq!(bevy.file.0, "lightmap_002.ktx2");
        let (name, bytes) = bevy.master.as_ref().expect("another file");
        assert_eq!(name, "lightmap_002_master.exr");
        assert!(*bytes == raw.file.1, "the master is the same to all");
        assert_eq!(bevy.encoding.clamped, 0, "70 klx are 22 kcd/m²");
        let three = files(Target::Three, Format::Ktx2, &of);
        assert_eq!(three.encoding.clamped, 16, "70 klx are too much");

        let openness = files(Target::Godot, Format::Exr, &openness);
        assert_eq!(openness.file.0, "ao_002.exr");
        assert!(openness.master.is_none(), "openness is divided by nothing");
        assert!((openness.encoding.factor - 1.0).abs() < f64::EPSILON);
    }
}
