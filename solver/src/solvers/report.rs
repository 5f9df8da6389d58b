//! What a solver is asked for and what it answers.

use super::System;
use luxel_scenes::{Irradiance, Radiosity, Rgb};
use std::ops::ControlFlow;

/// When an iteration may stop. Each of the three channels must satisfy it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance {
    /// ‖r‖₁ ≤ t ‖r₀‖₁, relative to the residual r₀ = ρFS of the start B = S: the share of the first
    /// bounce that is not yet accounted for. Says how far the iteration has come, not how large
    /// the error is. It takes ln t / ln λ sweeps, λ the spectral radius of the iteration.
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

/// The size of a residual in W/m² per channel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Residual {
    /// ‖r‖∞, which the error bound is made of.
    pub(super) largest: Rgb,
    /// ‖r‖₁/n.
    pub(super) mean: Rgb,
}

impl Residual {
    /// The size of a residual from its elements.
    pub(super) fn of(elements: impl Iterator<Item = Rgb>) -> Self {
        let (mut largest, mut sum, mut count) = (Rgb::ZERO, Rgb::ZERO, 0_usize);
        for r in elements {
            largest = largest.max(r.abs());
            sum += r.abs();
            count += 1;
        }
        Self {
            largest,
            mean: sum / count.max(1) as f64,
        }
    }

    /// True when no channel is above `limit` times `factor`.
    pub(super) fn is_within(&self, limit: &Self, factor: f64) -> bool {
        self.largest.cmple(limit.largest * factor).all()
            && self.mean.cmple(limit.mean * factor).all()
    }
}

impl Tolerance {
    /// The largest residual that satisfies it, given that of the start and the radiosity so far.
    pub(super) fn limit(
        self,
        system: &System,
        first: &Residual,
        radiosity: &[Radiosity],
    ) -> Residual {
        let any = Rgb::INFINITY;
        match self {
            Self::Residual(t) => Residual {
                largest: any,
                mean: first.mean * t,
            },
            Self::Error(t) => {
                let brightest = radiosity
                    .iter()
                    .fold(Rgb::ZERO, |largest, b| largest.max(b.0.abs()));
                Residual {
                    largest: brightest * (Rgb::ONE - system.gain()) * t,
                    mean: any,
                }
            }
        }
    }
}
