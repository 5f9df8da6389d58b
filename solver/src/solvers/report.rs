//! What a solver is asked for and what it answers.

use super::System;
use luxel_scenes::{Irradiance, Radiosity, Rgb};
use std::ops::ControlFlow;

/// When an iteration may stop. Each of the three channels must satisfy it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance {
    /// ‖r‖∞ ≤ t ‖r₀‖∞, relative to the residual r₀ = ρFS of the start B = S: the share of the first
    /// bounce that is not yet accounted for. Says how far the iteration has come, not how large
    /// the error is.
    Residual(f64),
    /// ‖r‖∞ / (1 − ‖ρF‖∞) ≤ t max|B|: the rigorous bound on the largest error, relative to the
    /// largest radiosity of the channel. What results should be asked for with.
    Error(f64),
}

/// How an iterative solver runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// When to stop.
    pub tolerance: Tolerance,
    /// Sweeps after which to give up with [`Outcome::IterationLimit`].
    pub max_iterations: usize,
}

/// How a solver ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The tolerance is met.
    Converged,
    /// The iteration limit came first. The solution is the best so far and its bound is valid.
    IterationLimit,
    /// The progress callback asked to stop. The solution is the best so far and its bound is valid.
    Interrupted,
}

/// What a progress callback sees after each sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Sweeps done.
    pub iteration: usize,
    /// Upper bound on ‖r‖∞ in W/m² per channel.
    pub residual: Rgb,
}

/// A progress callback that never stops a solver.
pub fn no_progress(_: Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// A solved system.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// B in W/m² of each unknown.
    pub radiosity: Vec<Radiosity>,
    /// E = F B in W/m² of each unknown, without light from lights that are not patches.
    pub irradiance: Vec<Irradiance>,
    /// How the solver ended.
    pub outcome: Outcome,
    /// Sweeps done; refinements for a direct solver.
    pub iterations: usize,
    /// ‖r‖∞ in W/m² per channel of the radiosity returned.
    pub residual: Rgb,
    /// Bound on the largest error in W/m² per channel: ‖r‖∞ / (1 − ‖ρF‖∞).
    pub error_bound: Rgb,
    /// ‖r‖∞ in W/m² per channel, first of the start B = S, then after each sweep. Jacobi's values
    /// are exact; Gauss–Seidel's are upper bounds except near the end.
    pub residual_history: Vec<Rgb>,
}

impl Tolerance {
    /// The largest ‖r‖∞ in W/m² per channel that satisfies it; `first` is ‖r₀‖∞.
    pub(super) fn residual_limit(
        self,
        system: &System,
        first: Rgb,
        radiosity: &[Radiosity],
    ) -> Rgb {
        match self {
            Self::Residual(t) => first * t,
            Self::Error(t) => {
                let largest = radiosity
                    .iter()
                    .fold(Rgb::ZERO, |largest, b| largest.max(b.0.abs()));
                largest * (Rgb::ONE - system.gain()) * t
            }
        }
    }
}
