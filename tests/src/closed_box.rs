//! A closed room of uniform reflectance: what the rates of solvers are measured on.

use crate::builder::{parallelogram, room};
use glam::DVec3;
use luxel_scenes::{Radiosity, Reflectance};
use luxel_solver::form_factors::{Polygon, unoccluded_matrix};
use luxel_solver::solvers::{Config, Solution, System, Tolerance};
use luxel_solver::transport::Dense;

/// The inside of a room of 4 m × 3 m × 2.5 m with exact form factors, and one lamp.
#[derive(Clone, Debug)]
pub struct ClosedBox {
    /// Area of each patch, m².
    pub areas: Vec<f64>,
    matrix: Dense,
    source: Vec<Radiosity>,
}

impl ClosedBox {
    /// The room, each face cut into `across`² patches.
    ///
    /// # Panics
    /// When `across` is zero.
    pub fn new(across: usize) -> Self {
        let mut patches = Vec::new();
        for face in room(DVec3::ZERO, DVec3::new(4.0, 3.0, 2.5)) {
            let (side, other) = (face[1] - face[0], face[3] - face[0]);
            let step = 1.0 / across as f64;
            for cell in 0..across * across {
                let (u, v) = ((cell / across) as f64, (cell % across) as f64);
                let corner = face[0] + (side * u + other * v) * step;
                let patch = parallelogram(corner, side * step, other * step);
                patches.push(Polygon::new(&patch).expect("patches have an area"));
            }
        }
        // One lamp that is not in the middle of anything, in three colours.
        let mut source = vec![Radiosity::ZERO; patches.len()];
        source[1] = Radiosity::new(3.0, 1.0, 0.1);
        Self {
            areas: patches.iter().map(Polygon::area).collect(),
            matrix: unoccluded_matrix(&patches, 1e-12),
            source,
        }
    }

    /// Solves with one reflectance everywhere.
    ///
    /// # Panics
    /// When `rho` is no reflectance below 1.
    pub fn solve(&self, rho: f64, solve: impl Fn(&System) -> Solution) -> Solution {
        let reflectance = vec![Reflectance::splat(rho); self.areas.len()];
        let system = System::new(&self.matrix, &self.areas, &reflectance, &self.source);
        solve(&system.expect("a closed room"))
    }

    /// The factor by which the last of `sweeps` sweeps shrinks the largest residual.
    ///
    /// # Panics
    /// When `rho` is no reflectance below 1, or `sweeps` is zero.
    pub fn rate(&self, rho: f64, sweeps: usize, sweep: fn(&System, &Config) -> Solution) -> f64 {
        // Exact at the end of a run, whatever the solver reports on the way.
        let residual = |max_iterations| {
            let config = Config {
                tolerance: Tolerance::Residual(0.0),
                max_iterations,
            };
            let solution = self.solve(rho, |system| sweep(system, &config));
            solution.residual.x
        };
        residual(sweeps) / residual(sweeps - 1)
    }
}
