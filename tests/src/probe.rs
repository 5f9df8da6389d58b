//! `luxel probe` on scenes made in code.

use crate::command::{arg, luxel};
use crate::hypothesis::t_test;
use crate::references::points_csv;
use crate::scene_files;
use glam::DVec3;
use luxel::points::Estimate;
use luxel_scenes::{Rgb, Scene};
use std::path::Path;

/// A scene and the points at which it is probed.
#[derive(Clone, Debug)]
pub struct Probe<'a> {
    /// The scene: geometry, reflectances, emission.
    pub scene: &'a Scene,
    /// The rest of its scene file: lights.
    pub toml: &'a str,
    /// Positions (metres) and unit normals.
    pub points: Vec<(DVec3, DVec3)>,
    /// Further arguments of the command.
    pub arguments: Vec<String>,
}

impl Probe<'_> {
    /// The estimates at the points for a seed.
    ///
    /// # Panics
    /// When the command fails.
    #[track_caller]
    pub fn run(&self, seed: u64) -> Vec<Estimate> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scene = scene_files::write(self.scene, folder.path(), self.toml);
        let points = folder.path().join("points.csv");
        std::fs::write(&points, points_csv(self.points.iter().copied()))
            .expect("a writable folder");
        let output = folder.path().join("result.csv");
        let seed = seed.to_string();
        let mut arguments = vec![
            "probe",
            arg(&scene),
            "--points",
            arg(&points),
            "--seed",
            &seed,
        ];
        arguments.extend(["-o", arg(&output)]);
        arguments.extend(self.arguments.iter().map(String::as_str));
        luxel(&arguments).assert_success();
        estimates(&output)
    }

    /// Tests the estimates' means over `seeds` seeds: each point's mean in the red channel must
    /// agree with `expected`, give or take `tolerance` for what is known to be inexact in the
    /// scene. `tests` is the number of points that share the level of significance. The
    /// command's own standard errors play no part.
    ///
    /// # Errors
    /// With the point, when a mean does not agree.
    #[track_caller]
    pub fn agree(
        &self,
        expected: &[f64],
        tolerance: f64,
        seeds: u64,
        tests: usize,
    ) -> Result<(), String> {
        let runs: Vec<Vec<Estimate>> = (0..seeds).map(|seed| self.run(seed)).collect();
        for (index, &exact) in expected.iter().enumerate() {
            let values: Vec<f64> = runs.iter().map(|run| run[index].value.x).collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let nearest = mean.clamp(exact - tolerance, exact + tolerance);
            t_test(&values, nearest, tests)
                .map_err(|error| format!("point {index}: exact {exact}, mean {mean}: {error}"))?;
        }
        Ok(())
    }
}

/// Reads the last six columns of a table of results.
///
/// # Panics
/// When the file is no such table.
pub fn estimates(path: &Path) -> Vec<Estimate> {
    let text = std::fs::read_to_string(path).expect("a table of results");
    let mut lines = text.lines();
    let header = lines.next().expect("a header");
    assert!(header.ends_with("e_r,e_g,e_b,se_r,se_g,se_b"), "{header}");
    let estimate = |line: &str| {
        let fields: Vec<f64> = line
            .rsplit(',')
            .take(6)
            .map(|field| field.parse().expect("a number"))
            .collect();
        Estimate {
            value: Rgb::new(fields[5], fields[4], fields[3]),
            standard_error: Rgb::new(fields[2], fields[1], fields[0]),
        }
    };
    lines.map(estimate).collect()
}
