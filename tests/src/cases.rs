//! Exact cases: values in closed form, read from `tests/cases` (see the README there).

use glam::DVec3;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::path::PathBuf;

/// A point of a scene at which a case has a value.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Receiver {
    /// Position in metres; absent where any position has the same value.
    p: Option<[f64; 3]>,
    /// Unit normal.
    n: Option<[f64; 3]>,
    /// Longest ray that counts, metres; absent for infinite rays.
    #[serde(rename = "L")]
    pub max_distance: Option<f64>,
    /// Depth of the pit, where each point has its own.
    pub depth: Option<f64>,
    /// Name of the scene, where each point has its own.
    pub scene: Option<String>,
    /// Distance from the centre of a light, metres.
    pub distance: Option<f64>,
    /// Angle between the normal and the direction to a light, degrees.
    pub angle_deg: Option<f64>,
}

impl Receiver {
    /// Position in metres; the origin where the case leaves it open.
    pub fn position(&self) -> DVec3 {
        self.p.map_or(DVec3::ZERO, DVec3::from_array)
    }

    /// Unit normal; +z where the case leaves it open.
    pub fn normal(&self) -> DVec3 {
        self.n.map_or(DVec3::Z, DVec3::from_array)
    }
}

/// An ambient-occlusion case: the cosine-weighted fraction of the hemisphere that is open.
#[derive(Clone, Debug, Deserialize)]
pub struct AmbientOcclusionCase {
    /// Its name.
    pub id: String,
    /// What is where, in words.
    pub title: String,
    /// The geometry; its keys differ from case to case.
    pub scene: serde_json::Value,
    /// Where.
    pub points: Vec<Receiver>,
    /// Exact values, one per point, in [0, 1].
    #[serde(rename = "value")]
    pub values: Vec<f64>,
}

/// A direct-light case: the irradiance (W/m² or lx) at points.
#[derive(Clone, Debug, Deserialize)]
pub struct IrradianceFieldCase {
    /// Its name.
    pub id: String,
    /// What is where, in words.
    pub title: String,
    /// Lights and geometry; the keys differ from case to case.
    pub setup: serde_json::Value,
    /// Where.
    pub receivers: Vec<Receiver>,
    /// Exact values, one per receiver.
    #[serde(rename = "value")]
    pub values: Vec<f64>,
}

/// All ambient-occlusion cases.
///
/// # Panics
/// When the file cannot be read or does not hold what it should.
pub fn ambient_occlusion() -> Vec<AmbientOcclusionCase> {
    #[derive(Deserialize)]
    struct File {
        cases: Vec<AmbientOcclusionCase>,
    }
    let cases = load::<File>("ao.json").cases;
    for case in &cases {
        assert_eq!(case.points.len(), case.values.len(), "{}", case.id);
    }
    cases
}

/// All direct-light cases.
///
/// # Panics
/// When the file cannot be read or does not hold what it should.
pub fn irradiance_fields() -> Vec<IrradianceFieldCase> {
    #[derive(Deserialize)]
    struct File {
        irradiance_fields: Vec<IrradianceFieldCase>,
    }
    let cases = load::<File>("enclosures.json").irradiance_fields;
    for case in &cases {
        assert_eq!(case.receivers.len(), case.values.len(), "{}", case.id);
    }
    cases
}

/// Reads a file of `tests/cases`.
///
/// # Panics
/// When the file cannot be read or does not hold a `T`.
pub fn load<T: DeserializeOwned>(file: &str) -> T {
    let path = folder().join(file);
    let text = std::fs::read_to_string(&path)
        .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Where the cases lie.
pub fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("cases")
}
