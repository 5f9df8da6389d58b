//! Writes shadow masks: four lights a picture, as engines look them up.

use super::masks::Masked;
use crate::cli::exit::Failure;
use crate::files::OutputFolder;
use crate::image::exr;
use crate::lightmap::atlas::Atlas;
use crate::lightmap::manifest::{self, MaskPage, Masks};
use crate::lightmap::masks::{LIGHTS_OF_PICTURE, Mask};
use luxel_solver::direct::NamedKind;

/// Channels in the order in which lights take them.
const CHANNELS: [&str; LIGHTS_OF_PICTURE] = ["R", "G", "B", "A"];

/// Writes the masks. Returns what the manifest says of them.
pub(super) fn write(
    folder: &OutputFolder,
    atlas: &Atlas,
    masks: &[Masked],
) -> Result<Vec<Masks>, Failure> {
    let mut described = Vec::new();
    for (set, masks) in masks.chunks(LIGHTS_OF_PICTURE).enumerate() {
        let mut pages = Vec::new();
        for page in 0..atlas.pages {
            let name = |kind: &str| format!("masks{set}_{page:03}{kind}.exr");
            let files = MaskPage {
                file: name(""),
                error: name("_error"),
                luxels: name("_luxels"),
            };
            let values = channels(atlas, page, masks, "", 1.0, |mask| &mask.values);
            let errors = channels(atlas, page, masks, "", 0.0, |mask| &mask.errors);
            let found = channels(atlas, page, masks, "", 1.0, |mask| &mask.luxels);
            let noise = channels(atlas, page, masks, "error.", 0.0, |mask| &mask.luxel_errors);
            let luxels = found.into_iter().chain(noise).collect();
            for (file, channels) in [
                (&files.file, values),
                (&files.error, errors),
                (&files.luxels, luxels),
            ] {
                folder.write(file, &exr::encode_channels(atlas.size, channels)?)?;
            }
            pages.push(files);
        }
        let lights = masks.iter().zip(CHANNELS).map(|(masked, channel)| {
            let kind = match masked.light.kind {
                NamedKind::Point => "point",
                NamedKind::Spot => "spot",
                NamedKind::Directional => "directional",
                NamedKind::Surface => "surface",
            };
            manifest::Masked {
                name: masked.light.name.clone(),
                kind: kind.into(),
                channel: channel.into(),
                error: masked.error,
            }
        });
        described.push(Masks {
            lights: lights.collect(),
            pages,
        });
    }
    Ok(described)
}

/// The four channels of a page, their names prefixed; those without a light are `unused`.
fn channels(
    atlas: &Atlas,
    page: usize,
    masks: &[Masked],
    prefix: &str,
    unused: f32,
    values: impl Fn(&Mask) -> &Vec<f32>,
) -> Vec<(String, Vec<f32>)> {
    let texels = atlas.size[0] * atlas.size[1];
    let of_page = page * texels..(page + 1) * texels;
    let channel = |(index, name): (usize, &str)| {
        let samples = match masks.get(index) {
            Some(masked) => values(&masked.mask)[of_page.clone()].to_vec(),
            None => vec![unused; texels],
        };
        (format!("{prefix}{name}"), samples)
    };
    CHANNELS.into_iter().enumerate().map(channel).collect()
}
