//! `manifest.json`: what a folder of lightmaps holds, for programs that load it.
//!
//! Schema 2. Texture coordinates have v downwards from the first row of the image, as in glTF; `rectangles` are texels. It says
//! nothing of time, machine or threads: the same scene and options give the same bytes.
//!
//! Every page has a master, E (or openness) as it was found; what the engine loads is made of that ([`super::encoding`]), and
//! `luxel export` makes it again for others.

use super::atlas::{Atlas, Rectangle};
use super::encoding::Format;
use super::target::{Quantity, Target};
use luxel_scenes::{Scene, UnitSystem};
use luxel_solver::solvers::Ledger;
use serde::{Deserialize, Serialize};

/// Version of the schema that is written and read.
pub const SCHEMA: u32 = 2;

/// The folder's content.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of this schema.
    pub schema: u32,
    /// The program and its version.
    pub software: String,
    /// Name of the scene.
    pub scene: String,
    /// What a texel of light holds; occlusion is from 0 to 1 (open).
    pub units: Units,
    /// Factor from what is seen, L = ρE/π, to display values of 0 to 1, as in the preview.
    pub exposure: f64,
    /// The maps that the delivered scene names.
    pub lightmap: Layer,
    /// Further sets of maps, with the same coordinates.
    pub others: Vec<Layer>,
    /// Which share of each light reaches a texel, four lights a picture, with the same coordinates.
    #[serde(default)]
    pub masks: Vec<Masks>,
    /// Most reflections of the light; `None` where it was reflected as often as it is.
    #[serde(default)]
    pub bounces: Option<u32>,
    /// How the scene is sampled.
    pub atlas: Sampling,
    /// Every object with the place that it has.
    pub objects: Vec<Placed>,
    /// Files of the scene with its lightmap coordinates.
    pub files: Files,
    /// Numbers that Bevy wants.
    pub bevy: Option<Bevy>,
    /// Description of an irradiance volume ([`crate::volume::file`]).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub volume: Option<String>,
    /// Seed of all randomness.
    pub seed: u64,
}

/// A set of maps, a page each.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Layer {
    /// What they hold: `all`, `direct` or `indirect` light, `sky` (a part of direct light: what comes straight from sky and
    /// environment), or `ao`.
    pub include: String,
    /// The maps.
    pub pages: Vec<Page>,
    /// Errors relative to the mean of the luxels, one standard deviation.
    pub error: Error,
    /// Where the flux goes, in W (lm) by channel; `None` where no reflected light was asked for.
    pub energy: Option<Energy>,
    /// Patches of the radiosity solution.
    pub patches: usize,
    /// Maps of where the light comes from ([`super::directional`]).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub directional: Option<Directional>,
}

/// Maps of where the light of other maps comes from, with the same coordinates.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Directional {
    /// `sh1` or `dominant`.
    pub kind: String,
    /// In which axes.
    pub axes: String,
    /// The maps, by page.
    pub pages: Vec<DirectionalPage>,
    /// What their texels hold.
    pub texel: Vec<String>,
    /// How they are read, best first: `map` is a texel of the map of light, m the mapped normal, n the surface's own.
    pub decode: Vec<String>,
    /// Of `sh1`: what the linear formula gives at the surface's own normal over the map.
    pub ratio: Option<Ratio>,
    /// Error of what is read besides that of the map, one standard deviation: root mean square over luxels and all normals, over the mean.
    pub error: f64,
}

/// Maps of a page.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DirectionalPage {
    /// Of `sh1` a₀ and a along x, y and z; of `dominant` one.
    pub files: Vec<String>,
    /// Of `sh1`: standard error of a₀ + m·a by texel, root mean square over all m, besides that of the map.
    pub error: Option<String>,
}

/// Over all lit texels and channels.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Ratio {
    /// The mean: 1 where light is even, 3/4 from straight above, more at grazing incidence.
    pub mean: f64,
    /// How far a texel is from it, root mean square.
    pub spread: f64,
}

/// Shadow masks of up to four lights, a channel each: from 0 (hidden, or below the horizon) to 1 (wholly seen).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Masks {
    /// The lights, in the order of the channels. Channels without one hold 1.
    pub lights: Vec<Masked>,
    /// The pictures, one for each page of the lightmap, with channels R, G, B and A that are not premultiplied.
    pub pages: Vec<MaskPage>,
}

/// A light with its mask.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Masked {
    /// Its name in the scene; of emissive surfaces, that of the object.
    pub name: String,
    /// `point`, `spot`, `directional` or `surface`.
    pub kind: String,
    /// `R`, `G`, `B` or `A`.
    pub channel: String,
    /// Errors of the share, whose whole is 1; not relative to a mean.
    pub error: Error,
}

/// A picture of masks.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct MaskPage {
    /// What the engine loads.
    pub file: String,
    /// Standard error of its texels.
    pub error: String,
    /// What was found at luxels, before anything was filled or filtered, with its standard error in the layer `error`.
    pub luxels: String,
}

/// What a texel holds.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Units {
    /// `irradiance` E, or `white-radiance` E/π.
    pub quantity: Quantity,
    /// Unit of E: `W/m2` or `lx`.
    pub unit: String,
    /// Factor from E to the texel.
    pub factor: f64,
    /// Always linear.
    pub colour_space: String,
    /// Whom the maps are for.
    pub target: Target,
}

/// A map.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Page {
    /// What the engine loads.
    pub file: String,
    /// How texels are got from it.
    pub encoding: Encoding,
    /// What it was made of: E in 32-bit floats, filled and filtered; openness of ambient occlusion. The same file where that is what
    /// the engine loads.
    pub master: String,
    /// Standard error of the master's texels, in their unit.
    pub error: String,
    /// What was gathered (E), before anything was filled or filtered, black where nothing was, with its standard error in
    /// the layer `error`.
    pub luxels: String,
    /// A grey picture of its texels: 255 where light was gathered, 128 inside solids, 0 where no surface is.
    pub validity: String,
    /// A picture of its charts.
    pub charts: String,
    /// Width in texels.
    pub width: usize,
    /// Height in texels.
    pub height: usize,
}

/// How texels are got from a file, and light from texels.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Encoding {
    /// Kind of file.
    pub format: Format,
    /// What a texel is, with `rgb` and `a` as the file's kind defines them, from 0 to 1 in a PNG file: all linear.
    pub formula: String,
    /// `scale` of the formula.
    pub scale: f64,
    /// Factor from the master to the texel: E is texel / factor.
    pub factor: f64,
    /// What the encoding alone changed: root mean square of the differences over the mean of the page.
    pub loss: f64,
    /// Values above what the format holds, which were moved to its end.
    pub clamped: usize,
}

/// How the scene is sampled.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Sampling {
    /// Width of a page in texels.
    pub width: usize,
    /// Height of a page in texels.
    pub height: usize,
    /// Texels a metre, the root mean square over all surfaces.
    pub texels_per_metre: f64,
    /// Share of the texels that surfaces lie on.
    pub utilisation: f64,
    /// Number of charts.
    pub charts: usize,
    /// Texels around each.
    pub padding: usize,
    /// Texels whose light was gathered.
    pub lit: usize,
    /// Texels of surfaces that lie inside solids.
    pub buried: usize,
}

/// An object's place.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Placed {
    /// Its name in the scene.
    pub name: String,
    /// Its area in m².
    pub area: f64,
    /// Texels a metre.
    pub texels_per_metre: f64,
    /// The texels that it lies on, a rectangle a page.
    pub rectangles: Vec<Rectangle>,
}

/// Files beside the maps.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Files {
    /// The scene as binary glTF with the lightmap's coordinates in `TEXCOORD_1`.
    pub glb: String,
    /// The scene as OBJ, whose `vt` are the lightmap's.
    pub obj: String,
    /// The scene as it looks with the maps.
    pub preview: String,
}

/// Numbers that Bevy wants.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Bevy {
    /// `StandardMaterial::lightmap_exposure`.
    pub lightmap_exposure: f64,
}

/// Relative errors.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Error {
    /// Of the light at luxels: what `--error` asks for.
    pub luxels: f64,
    /// What filtering leaves between them.
    pub filtering: f64,
    /// Both.
    pub total: f64,
}

/// Where the flux goes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Energy {
    /// Sent out by surfaces and lights, as far as it arrives.
    pub emitted: [f64; 3],
    /// Absorbed by surfaces.
    pub absorbed: [f64; 3],
    /// Left the scene.
    pub escaped: [f64; 3],
    /// What solver and form factors leave.
    pub residual: [f64; 3],
}

impl From<Ledger> for Energy {
    fn from(ledger: Ledger) -> Self {
        Self {
            emitted: (ledger.emitted.0 + ledger.direct.0).to_array(),
            absorbed: ledger.absorbed.0.to_array(),
            escaped: ledger.escaped.0.to_array(),
            residual: (ledger.residual.0 + ledger.defect.0).to_array(),
        }
    }
}

/// Exposure of Bevy's default camera: 2^−EV100 / 1.2 with EV100 = 9.7 (`bevy_camera`, `Exposure::EV100_BLENDER`).
fn bevy_view_exposure() -> f64 {
    (-9.7_f64).exp2() / 1.2
}

impl Bevy {
    /// With light in lx, texels of E/π are cd/m² as Bevy's lights are. Light in W/m² has no brightness to an eye: it is shown as
    /// the preview shows it.
    pub fn new(units: UnitSystem, exposure: f64) -> Self {
        Self {
            lightmap_exposure: match units {
                UnitSystem::Photometric => 1.0,
                UnitSystem::Radiometric => exposure / bevy_view_exposure(),
            },
        }
    }
}

/// The places of all objects that have faces.
pub fn objects(scene: &Scene, atlas: &Atlas) -> Vec<Placed> {
    let mut areas = vec![0.0; scene.objects.len()];
    for face in scene.face_ids() {
        areas[scene.faces[face.index()].object.index()] += scene.area(face);
    }
    let texels = atlas.object_texels(scene);
    let rectangles = atlas.rectangles(scene);
    let objects = scene.objects.iter().zip(&areas).zip(texels).zip(rectangles);
    objects
        .filter(|(((_, area), _), _)| **area > 0.0)
        .map(|(((object, &area), texels), rectangles)| Placed {
            name: object.name.clone(),
            area,
            texels_per_metre: (texels / area).sqrt(),
            rectangles,
        })
        .collect()
}
