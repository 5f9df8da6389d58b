//! Irradiance volumes as an engine reads them: from their files alone.

use glam::DVec3;
use luxel_scenes::Rgb;
use std::path::Path;

/// A volume that was read.
#[derive(Clone, Debug)]
pub struct ReadVolume {
    /// The header as it is written.
    pub header: serde_json::Value,
    /// Coefficients by probe.
    pub coefficients: Vec<Vec<Rgb>>,
    /// Their standard errors.
    pub errors: Vec<Vec<Rgb>>,
    /// 255 where light was gathered, 128 where it was filled.
    pub validity: Vec<u8>,
}

impl ReadVolume {
    /// Reads the volume of a bake.
    ///
    /// # Panics
    /// When something is missing or is not as long as the header says.
    pub fn load(folder: &Path) -> Self {
        let read = |name: &serde_json::Value| {
            let name = name.as_str().expect("the name of a file");
            std::fs::read(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
        };
        let manifest: serde_json::Value =
            serde_json::from_slice(&read(&"manifest.json".into())).expect("a manifest");
        let header: serde_json::Value =
            serde_json::from_slice(&read(&manifest["volume"])).expect("a header");
        let order = header["order"].as_u64().expect("a degree") as usize;
        let per_probe = 3 * (order + 1).pow(2);
        let probes = header["grid"]["probes"].as_array().expect("three numbers");
        let count: u64 = probes
            .iter()
            .map(|n| n.as_u64().expect("a number"))
            .product();
        let rows = |name: &serde_json::Value| -> Vec<Vec<Rgb>> {
            let bytes = read(name);
            assert_eq!(bytes.len(), 4 * per_probe * count as usize, "{name}");
            let (words, _) = bytes.as_chunks::<4>();
            let values: Vec<f64> = words
                .iter()
                .map(|word| f64::from(f32::from_le_bytes(*word)))
                .collect();
            let rows = values.chunks_exact(per_probe);
            rows.map(|row| row.chunks_exact(3).map(Rgb::from_slice).collect())
                .collect()
        };
        let files = &header["files"];
        let validity = read(&files["validity"]);
        assert_eq!(validity.len(), count as usize, "a byte a probe");
        Self {
            coefficients: rows(&files["data"]),
            errors: rows(&files["errors"]),
            validity,
            header,
        }
    }

    /// Position of a probe in metres, as the header says.
    ///
    /// # Panics
    /// When the header does not say it.
    pub fn position(&self, index: usize) -> DVec3 {
        let grid = &self.header["grid"];
        let three = |name: &str| {
            let list = grid[name].as_array().expect("three numbers");
            DVec3::from_array([0, 1, 2].map(|axis| list[axis].as_f64().expect("a number")))
        };
        let probes = three("probes").to_array().map(|n| n as usize);
        let cell = [
            index % probes[0],
            index / probes[0] % probes[1],
            index / (probes[0] * probes[1]),
        ];
        let cell = DVec3::from_array(cell.map(|c| c as f64 + 0.5));
        three("lower") + cell * three("spacing")
    }

    /// E(n) at a probe with the basis and the factors written out anew, as a shader has them; and its standard error as if the errors of
    /// coefficients were independent.
    ///
    /// # Panics
    /// Without factors in the header.
    pub fn irradiance(&self, probe: usize, n: DVec3) -> [Rgb; 2] {
        let basis = [
            0.282_095,
            0.488_603 * n.y,
            0.488_603 * n.z,
            0.488_603 * n.x,
            1.092_548 * n.x * n.y,
            1.092_548 * n.y * n.z,
            0.315_392 * (3.0 * n.z * n.z - 1.0),
            1.092_548 * n.x * n.z,
            0.546_274 * (n.x * n.x - n.y * n.y),
        ];
        let factors = &self.header["coefficients"]["factors"];
        let terms = self.coefficients[probe].iter().zip(&self.errors[probe]);
        let (mut sum, mut square) = (Rgb::ZERO, Rgb::ZERO);
        for (k, (coefficient, error)) in terms.enumerate() {
            let factor = factors[k].as_f64().expect("a factor") * basis[k];
            sum += *coefficient * factor;
            square += *error * *error * (factor * factor);
        }
        [sum, square.map(f64::sqrt)]
    }
}
