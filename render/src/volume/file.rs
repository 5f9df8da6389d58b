//! `volume.json` and the data beside it: an irradiance volume for programs that load it.
//!
//! Schema 1. `volume.bin` holds, little-endian and in single precision, for each probe (x fastest, then y, then z) for each coefficient red, green and
//! blue; `volume_error.bin` their standard errors in the same order; `volume_validity.bin` a byte a probe: 255 where light was
//! gathered, 128 inside solids, whose probes hold the mean of their neighbours. Like the manifest it says nothing of time, machine or threads.

use super::Volume;
use super::grid::Grid;
use luxel_scenes::{Rgb, UnitSystem};
use luxel_solver::incident::estimate::Estimate;
use luxel_solver::incident::harmonics::{rest, transfer};
use serde::{Deserialize, Serialize};

/// Version of the schema that is written.
pub const SCHEMA: u32 = 1;

/// Names of the files.
pub const HEADER: &str = "volume.json";
/// Coefficients.
pub const DATA: &str = "volume.bin";
/// Their standard errors.
pub const ERRORS: &str = "volume_error.bin";
/// What each probe is.
pub const VALIDITY: &str = "volume_validity.bin";

/// What the data are.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Header {
    /// Version of this schema.
    pub schema: u32,
    /// The program and its version.
    pub software: String,
    /// Name of the scene.
    pub scene: String,
    /// Which light: `all`, `direct` or `indirect`.
    pub include: String,
    /// Degree of the spherical harmonics: 1 or 2.
    pub order: usize,
    /// Where probes stand.
    pub grid: Placement,
    /// What a coefficient is, and how irradiance follows.
    pub coefficients: Coefficients,
    /// The files.
    pub files: Files,
    /// How right it is.
    pub error: Error,
    /// Probes at which light was gathered, and those that were filled.
    pub probes: Probes,
    /// Seed of all randomness.
    pub seed: u64,
}

/// Where probes stand: at lower + (i + ½) · spacing along each axis.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Placement {
    /// Axes and unit.
    pub axes: String,
    /// Corner of the box.
    pub lower: [f64; 3],
    /// The opposite corner.
    pub upper: [f64; 3],
    /// Probes along x, y and z.
    pub probes: [usize; 3],
    /// Metres between them.
    pub spacing: [f64; 3],
    /// Number of a probe.
    pub number: String,
    /// Coordinates in a three-dimensional texture with a probe a texel.
    pub texture: String,
}

/// What the numbers mean.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Coefficients {
    /// The equation.
    pub definition: String,
    /// Unit of a coefficient, and of E(n).
    pub unit: String,
    /// Always linear.
    pub colour_space: String,
    /// The basis in the order of the data, of a unit vector (x, y, z).
    pub basis: Vec<String>,
    /// Irradiance of a surface with the unit normal n.
    pub irradiance: String,
    /// What each term of the sum is multiplied with, in the order of the data.
    pub factors: Vec<f64>,
}

/// Files beside this one.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Files {
    /// Little-endian 32-bit floats: for each probe, for each coefficient, red, green, blue.
    pub data: String,
    /// Standard errors in the same order.
    pub errors: String,
    /// A byte a probe: 255 gathered, 128 filled.
    pub validity: String,
}

/// Errors of the irradiance E(n).
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Error {
    /// Of E(n) as far as the harmonics describe it: root mean square over valid probes, all normals and channels, over the mean. What `--error` asks for.
    pub irradiance: f64,
    /// Of that, the noise of shadow rays.
    pub direct: f64,
    /// The noise of gather rays and of the solutions.
    pub gather: f64,
    /// What patches of finite size leave.
    pub patches: f64,
    /// Mean of E(n) by channel, in W/m2 or lx.
    pub mean: [f64; 3],
    /// Besides, what the harmonics leave out of E(n) over the mean of it over all n: root mean square over normals under light from a single direction, which no
    /// light exceeds.
    pub truncation: f64,
    /// The same at the worst normal.
    pub largest_truncation: f64,
}

/// Probes by what they are.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Probes {
    /// Light was gathered.
    pub valid: usize,
    /// Inside solids, filled from their neighbours.
    pub filled: usize,
}

/// The basis of degree two in words.
const BASIS: [&str; 9] = [
    "0.282094791773878",
    "0.488602511902920 y",
    "0.488602511902920 z",
    "0.488602511902920 x",
    "1.092548430592079 x y",
    "1.092548430592079 y z",
    "0.315391565252520 (3 z^2 - 1)",
    "1.092548430592079 x z",
    "0.546274215296040 (x^2 - y^2)",
];

/// What is to be said besides the volume.
#[derive(Clone, Copy, Debug)]
pub struct About<'a> {
    /// Name of the scene.
    pub scene: &'a str,
    /// Which light.
    pub include: &'a str,
    /// Unit of the scene's light.
    pub units: UnitSystem,
    /// Seed of all randomness.
    pub seed: u64,
}

/// The header of a volume.
pub fn header<const N: usize>(volume: &Volume<N>, about: &About<'_>) -> Header {
    let Grid {
        lower,
        upper,
        probes,
    } = volume.grid;
    let order = (N - 1).isqrt();
    let valid = volume.is_valid.iter().filter(|valid| **valid).count();
    let [truncation, largest_truncation] = rest(order);
    Header {
        schema: SCHEMA,
        software: concat!("luxel ", env!("CARGO_PKG_VERSION")).into(),
        scene: about.scene.into(),
        include: about.include.into(),
        order,
        grid: Placement {
            axes: "those of scene.glb, right-handed, in metres".into(),
            lower: lower.to_array(),
            upper: upper.to_array(),
            probes,
            spacing: volume.grid.spacing().to_array(),
            number: "i + probes[0] (j + probes[1] k), at lower + ((i, j, k) + 0.5) spacing".into(),
            texture: "(p - lower) / (upper - lower), clamped to the edge".into(),
        },
        coefficients: Coefficients {
            definition: "c[k] = integral over all directions w of L(w) basis[k](w); L is the radiance that arrives from w".into(),
            unit: match about.units {
                UnitSystem::Radiometric => "W m^-2 sr^-1/2; of E(n) W/m2".into(),
                UnitSystem::Photometric => "lm m^-2 sr^-1/2; of E(n) lx".into(),
            },
            colour_space: "linear Rec. 709".into(),
            basis: BASIS[..N].iter().map(|&text| text.into()).collect(),
            irradiance: "E(n) = max(0, sum over k of factors[k] c[k] basis[k](n)); matt surfaces of reflectance r show r E / pi".into(),
            factors: (0..N).map(transfer).collect(),
        },
        files: Files {
            data: DATA.into(),
            errors: ERRORS.into(),
            validity: VALIDITY.into(),
        },
        error: Error {
            irradiance: volume.parts.total(),
            direct: volume.parts.direct,
            gather: volume.parts.gather,
            patches: volume.parts.mesh,
            mean: volume.mean_irradiance().to_array(),
            truncation,
            largest_truncation,
        },
        probes: Probes {
            valid,
            filled: volume.is_valid.len() - valid,
        },
        seed: about.seed,
    }
}

/// The bytes of one array of all estimates.
pub fn bytes<const N: usize>(
    estimates: &[Estimate<N>],
    array: impl Fn(&Estimate<N>) -> &[Rgb; N],
) -> Vec<u8> {
    let values = estimates
        .iter()
        .flat_map(|estimate| array(estimate).iter().flat_map(Rgb::to_array));
    values
        .flat_map(|value| (value as f32).to_le_bytes())
        .collect()
}

/// The bytes that say what each probe is.
pub fn validity<const N: usize>(volume: &Volume<N>) -> Vec<u8> {
    let byte = |valid: &bool| if *valid { 255 } else { 128 };
    volume.is_valid.iter().map(byte).collect()
}
