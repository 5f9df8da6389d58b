//! Converged references: irradiance at points of the scenes with references.

use glam::DVec3;
use luxel_scenes::Rgb;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// The file: columns of equal length.
#[derive(Deserialize)]
struct Columns {
    scene: String,
    position: Vec<[f64; 3]>,
    normal: Vec<[f64; 3]>,
    object: Vec<String>,
    #[serde(rename = "E")]
    irradiance: Vec<[f64; 3]>,
    #[serde(rename = "E_direct")]
    direct: Vec<[f64; 3]>,
    #[serde(rename = "stderr", alias = "uncertainty")]
    standard_error: Vec<[f64; 3]>,
    /// A second, independent estimate.
    #[serde(rename = "E_path", default)]
    path: Vec<[f64; 3]>,
    #[serde(rename = "stderr_path", default)]
    path_error: Vec<[f64; 3]>,
}

/// A further estimate at some of the points: `path.json`.
#[derive(Deserialize)]
struct Further {
    index: Vec<usize>,
    #[serde(rename = "E")]
    irradiance: Vec<[f64; 3]>,
    #[serde(rename = "stderr")]
    standard_error: Vec<[f64; 3]>,
}

impl Columns {
    /// Weighs a second estimate of a point with what there is: each by the inverse of its variance.
    fn combine(&mut self, point: usize, irradiance: [f64; 3], standard_error: [f64; 3]) {
        let (e, error) = (&mut self.irradiance[point], &mut self.standard_error[point]);
        for channel in 0..3 {
            let [own, other] = [error[channel], standard_error[channel]].map(|x| x * x);
            if own + other > 0.0 {
                e[channel] += (irradiance[channel] - e[channel]) * own / (own + other);
                error[channel] = (own * other / (own + other)).sqrt();
            }
        }
    }

    /// Weighs all estimates that there are.
    fn combine_all(&mut self, further: Option<Further>) {
        let path = std::mem::take(&mut self.path);
        let errors = std::mem::take(&mut self.path_error);
        for (point, (irradiance, error)) in path.into_iter().zip(errors).enumerate() {
            self.combine(point, irradiance, error);
        }
        if let Some(further) = further {
            let values = further.irradiance.into_iter().zip(further.standard_error);
            for (point, (irradiance, error)) in further.index.into_iter().zip(values) {
                self.combine(point, irradiance, error);
            }
        }
    }
}

/// Irradiance at the points of a scene, in W/m² on the front side.
#[derive(Clone, Debug)]
pub struct IrradianceReference {
    /// Name of the scene.
    pub scene: String,
    /// Positions on the surfaces, metres.
    pub position: Vec<DVec3>,
    /// Unit normals of the fronts.
    pub normal: Vec<DVec3>,
    /// Names of the objects that the points lie on.
    pub object: Vec<String>,
    /// All light.
    pub irradiance: Vec<Rgb>,
    /// Light straight from emitters.
    pub direct: Vec<Rgb>,
    /// Standard error of `irradiance`, or its uncertainty where it was not sampled.
    pub standard_error: Vec<Rgb>,
}

impl IrradianceReference {
    /// The reference of a scene by name (`cornell`, `furnace`, `corridor`, `office`).
    ///
    /// # Panics
    /// When the file is missing or does not hold what it should.
    pub fn load(scene: &str) -> Self {
        let folder = folder().join(scene);
        let path = folder.join("irradiance.json");
        let mut columns: Columns = read(&path);
        let further = folder.join("path.json");
        columns.combine_all(further.exists().then(|| read(&further)));
        let n = columns.position.len();
        let lengths = [
            columns.normal.len(),
            columns.object.len(),
            columns.irradiance.len(),
            columns.direct.len(),
            columns.standard_error.len(),
        ];
        assert_eq!(
            lengths,
            [n; 5],
            "{}: columns differ in length",
            path.display()
        );
        let vectors = |column: Vec<[f64; 3]>| column.into_iter().map(DVec3::from_array).collect();
        Self {
            scene: columns.scene,
            position: vectors(columns.position),
            normal: vectors(columns.normal),
            object: columns.object,
            irradiance: vectors(columns.irradiance),
            direct: vectors(columns.direct),
            standard_error: vectors(columns.standard_error),
        }
    }

    /// The points as the CSV table that `luxel probe` reads.
    pub fn points_csv(&self) -> String {
        points_csv(
            self.position
                .iter()
                .copied()
                .zip(self.normal.iter().copied()),
        )
    }
}

/// Points and normals as the CSV table that `luxel probe` reads.
pub fn points_csv(points: impl IntoIterator<Item = (DVec3, DVec3)>) -> String {
    let mut csv = String::from("x,y,z,nx,ny,nz\n");
    for (p, n) in points {
        let fields = [p.x, p.y, p.z, n.x, n.y, n.z].map(|field| field.to_string());
        csv.push_str(&fields.join(","));
        csv.push('\n');
    }
    csv
}

fn read<T: serde::de::DeserializeOwned>(path: &Path) -> T {
    let text =
        std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Where the references lie.
pub fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("references")
}
