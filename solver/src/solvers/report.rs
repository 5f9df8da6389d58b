//! What a solver is asked for and what it answers.

use super::System;
use luxel_scenes::{Irradiance, Radiosity, Rgb};
use std::ops::ControlFlow;

/// When an iteration may stop. Each of the three channels must satisfy it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tolerance {
    /// Σ A|r| ≤ t Σ A|r₀|, relative to the residual r₀ = ρFS of the start B = S: the share of the first
    /// bounce that is not yet accounted for. Says how far the iteration has come, not how large
    /// the error is. It takes ln t / ln λ sweeps, λ the spectral radius of the iteration.
    Residual(f64),
    /// ‖r‖∞ / (1 − ‖ρF‖∞) ≤ t max|B|, the rigorous bound on the largest error, relative to the
    /// largest radiosity of the channel, and Σ A|r| ≤ t Σ A S, so that the energy ledger closes to t
    /// where a small bright source lights large surfaces. What results should be asked for with.
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
    /// ‖r‖∞ in W/m² per channel, first of the start, then after each sweep. Jacobi's and Southwell's
    /// values are exact; Gauss–Seidel's are upper bounds except near the end, and conjugate
    /// gradient's come from its recurrence.
    pub residual_history: Vec<Rgb>,
}

/// The size of a residual per channel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Residual {
    /// ‖r‖∞ in W/m², which the error bound is made of.
    pub(super) largest: Rgb,
    /// Σ A|r| in W.
    pub(super) flux: Rgb,
}

impl Residual {
    /// The size of a residual from its elements, in the order of the areas.
    pub(super) fn of(areas: &[f64], elements: impl Iterator<Item = Rgb>) -> Self {
        let nothing = Self {
            largest: Rgb::ZERO,
            flux: Rgb::ZERO,
        };
        elements.zip(areas).fold(nothing, |size, (r, &area)| Self {
            largest: size.largest.max(r.abs()),
            flux: size.flux + r.abs() * area,
        })
    }

    /// True when no channel is above `limit` times `factor`.
    pub(super) fn is_within(&self, limit: &Self, factor: f64) -> bool {
        self.largest.cmple(limit.largest * factor).all()
            && self.flux.cmple(limit.flux * factor).all()
    }

    /// True when a channel is above `limit`.
    pub(super) fn exceeds(&self, limit: &Self) -> bool {
        !self.is_within(limit, 1.0)
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
                flux: first.flux * t,
            },
            Self::Error(t) => {
                let brightest = radiosity
                    .iter()
                    .fold(Rgb::ZERO, |largest, b| largest.max(b.0.abs()));
                Residual {
                    largest: brightest * (Rgb::ONE - system.gain()) * t,
                    flux: system.source_flux() * t,
                }
            }
        }
    }
}
