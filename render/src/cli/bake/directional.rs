//! `--directional`: where the light of luxels comes from.

use super::{Bake, Layer};
use crate::cli::Context;
use crate::cli::exit::Failure;
use crate::cli::footprint::Footprint;
use crate::cli::goal::Goal;
use crate::cli::stated::StatedError;
use crate::cli::steering::{Steering, first_error};
use crate::files::OutputFolder;
use crate::image::exr::{self, Picture};
use crate::lightmap::atlas::Atlas;
use crate::lightmap::bake::Luxels;
use crate::lightmap::directional::{self, Directions};
use crate::lightmap::manifest;
use crate::lightmap::map::Lightmap;
use clap::ValueEnum;
use luxel_scenes::Rgb;
use luxel_solver::bounces::Bounces;
use luxel_solver::gather::Components;
use luxel_solver::incident::Aim;
use luxel_solver::world::World;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What maps of light say of its directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Directional {
    /// Nothing
    None,
    /// Spherical harmonics of degree one, four maps, in the axes of the scene
    Sh1,
    /// The dominant direction and how much of the light comes from it, one map
    Dominant,
}

/// Maps of directions with their error.
#[derive(Serialize, Deserialize)]
pub(super) struct DirectionalMaps {
    kind: Directional,
    maps: Directions,
    pub(super) stated: StatedError,
}

/// The maps of [`Directional::Sh1`]: a₀ and a along each axis.
const OF_SH1: [&str; directional::COEFFICIENTS] = ["sh1_0", "sh1_x", "sh1_y", "sh1_z"];

/// What a pass over incident radiance works with.
#[derive(Clone, Copy)]
pub(super) struct Pass<'a, 's, 'r> {
    pub(super) world: &'a World<'s>,
    /// What else is held.
    pub(super) held: &'a Footprint,
    /// When it ends.
    pub(super) goal: &'a Goal,
    pub(super) context: &'a Context<'r>,
    /// Which light.
    pub(super) components: Components,
    pub(super) bounces: Bounces,
    /// Patches that are begun with.
    pub(super) patches: usize,
}

impl Pass<'_, '_, '_> {
    /// What is asked of incident radiance.
    pub(super) fn aim(&self) -> Aim {
        let scene = self.world.scene();
        let (first, bounces) = (self.patches, self.bounces);
        let most = self.held.most_patches(scene, first, bounces, self.context);
        Aim {
            error: first_error(Some(self.goal)),
            components: self.components,
            bounces: self.bounces,
            first_rays: 1,
            patches: [self.patches, most],
            seed: self.context.common.seed,
        }
    }
}

impl Bake {
    /// Directions of the light of a layer; `Ok(None)` when it was stopped before there were any.
    pub(super) fn directions(
        &self,
        pass: &Pass<'_, '_, '_>,
        atlas: &Atlas,
        luxels: &Luxels,
        layer: &Layer,
    ) -> Result<Option<DirectionalMaps>, Failure> {
        let mut steering = Steering::new(pass.context, Some(pass.goal));
        let found = directional::gather(pass.world, luxels, &pass.aim(), &mut steering)?;
        let Some(found) = found else {
            return Ok(None);
        };
        pass.context.reporter.detail(format_args!(
            "directions: {} gather and {} shadow rays a luxel",
            found.rays[0], found.rays[1]
        ));
        Ok(Some(DirectionalMaps {
            kind: self.directional,
            maps: directional::maps(atlas, luxels, &found.estimates, &layer.maps.map),
            stated: StatedError::of_gather(&found.parts, 0.0),
        }))
    }
}

impl DirectionalMaps {
    /// Writes the files of all pages, whose names begin with `stem`, and says what they are.
    pub(super) fn write(
        &self,
        folder: &OutputFolder,
        stem: &str,
        map: &Lightmap,
    ) -> Result<manifest::Directional, Failure> {
        let sets: Vec<(&str, &[Rgb])> = match self.kind {
            Directional::Sh1 => {
                let values = self.maps.coefficients.iter().map(Vec::as_slice);
                let mut sets: Vec<_> = OF_SH1.into_iter().zip(values).collect();
                sets.push(("sh1_error", self.maps.errors.as_slice()));
                sets
            }
            Directional::Dominant | Directional::None => Vec::new(),
        };
        let name = |page: usize, what: &str| format!("{stem}_{page:03}_{what}.exr");
        let files: Vec<(String, usize, &[Rgb])> = sets
            .iter()
            .flat_map(|(what, values)| (0..map.pages).map(|page| (name(page, what), page, *values)))
            .collect();
        files.par_iter().try_for_each(|(file, page, values)| {
            let picture = Picture {
                image: map.page(*page, values),
                layers: vec![],
                origin: None,
            };
            folder.write(file, &exr::encode(&picture)?)?;
            Ok::<_, Failure>(())
        })?;
        if self.kind == Directional::Dominant {
            let texels = self.maps.dominant(map);
            for (page, own) in texels.chunks_exact(map.page_texels()).enumerate() {
                let channels = ["R", "G", "B", "A"].into_iter().enumerate();
                let channels = channels.map(|(index, channel)| {
                    let samples = own.iter().map(|texel| texel[index]).collect();
                    (channel.to_owned(), samples)
                });
                let bytes = exr::encode_channels(map.size, channels)?;
                folder.write(&name(page, "dominant"), &bytes)?;
            }
        }
        let pages = (0..map.pages).map(|page| match self.kind {
            Directional::Sh1 => manifest::DirectionalPage {
                files: OF_SH1.map(|what| name(page, what)).to_vec(),
                error: Some(name(page, "sh1_error")),
            },
            Directional::Dominant | Directional::None => manifest::DirectionalPage {
                files: vec![name(page, "dominant")],
                error: None,
            },
        });
        let [mean, spread] = self.maps.ratio;
        Ok(manifest::Directional {
            kind: crate::cli::name(&self.kind),
            axes: "those of scene.glb; normals are unit vectors in them".into(),
            pages: pages.collect(),
            texel: match self.kind {
                Directional::Sh1 => SH1_TEXEL.map(String::from).to_vec(),
                Directional::Dominant | Directional::None => {
                    DOMINANT_TEXEL.map(String::from).to_vec()
                }
            },
            decode: match self.kind {
                Directional::Sh1 => SH1_DECODE.map(String::from).to_vec(),
                Directional::Dominant | Directional::None => {
                    DOMINANT_DECODE.map(String::from).to_vec()
                }
            },
            ratio: (self.kind == Directional::Sh1).then_some(manifest::Ratio { mean, spread }),
            error: self.stated.total(),
        })
    }
}

/// What the texels of the manifest's files hold.
const SH1_TEXEL: [&str; 4] = [
    "files[0]: a0 = integral of L dw / 4 over the hemisphere above the texel, by channel, in the unit of E whatever units.factor is",
    "files[1..4]: a = (ax, ay, az) = integral of L w dw / 2, by channel, signed, in the unit of E",
    "spherical harmonics of L: c00 = a0 / 0.886226925, (c1-1, c10, c11) = (ay, az, ax) / 1.023326708",
    "encoded: Bakery's L0 is a0 and its L1 textures 0.5 + a / (4 a0); Godot's layers are a0 and 0.5 + a / (8 a0) for y, z, x; both want a0 / pi",
];
const DOMINANT_TEXEL: [&str; 2] = [
    "RGB: 0.5 + 0.5 D, with D = integral of L w dw / integral of L dw, L in luminance (0.2126, 0.7152, 0.0722): direction D/|D|, directionality |D|",
    "A: w = 0.5 + 0.5 dot(n, D), n being the normal that the map was gathered at",
];

/// How they are read: E is the texel of the map, m the mapped normal.
const SH1_DECODE: [&str; 3] = [
    "exact at the surface normal n: texel(m) = map max(0, a0 + dot(m, a)) / (a0 + dot(n, a)); dot(n, a) = map / 2",
    "linear: E(m) = max(0, a0 + dot(m, a)), which is that of the map times ratio at n",
    "Geomerics: R0 = a0, R1 = |a| / 2, q = (1 + dot(m, a) / |a|) / 2, p = 1 + 2 R1 / R0, k = (1 - R1 / R0) / (1 + R1 / R0), E(m) = R0 (k + (1 - k) (p + 1) q^p)",
];
const DOMINANT_DECODE: [&str; 1] = [
    "texel(m) = map (dot(m, RGB - 0.5) + 0.5) / max(A, 0.0001), which is map at the surface normal (Unity's directional mode)",
];
