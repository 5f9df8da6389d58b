//! The system B = S + ρ F B and the bound on what its residual hides.
//!
//! With e the error of an approximation B and r = S + ρFB − B its residual, (I − ρF) e = r, so
//! ‖e‖∞ ≤ ‖r‖∞ / (1 − ‖ρF‖∞) in each channel, where ‖ρF‖∞ = max_i ρ_i Σ_j F_ij because F ≥ 0.
//! Source: M. F. Cohen, J. R. Wallace, "Radiosity and Realistic Image Synthesis", 1993, chapter 5;
//! the bound is the standard one of a Neumann series. Valid for ‖ρF‖∞ < 1. It does not count the
//! rounding of r itself, about n ε max|B|.

use super::reciprocity::{self, NotReciprocal};
use super::report::{Residual, Solution};
use crate::transport::Transport;
use luxel_scenes::{Exitance, Irradiance, Radiosity, Reflectance, Rgb};
use thiserror::Error;

/// Why a system cannot be solved.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum SystemError {
    /// The arrays do not have one element per unknown.
    #[error(
        "the transport has {unknowns} unknowns, but there are {areas} areas, {reflectances} \
         reflectances and {sources} sources"
    )]
    Length {
        /// Unknowns of the operator.
        unknowns: usize,
        /// Areas given.
        areas: usize,
        /// Reflectances given.
        reflectances: usize,
        /// Sources given.
        sources: usize,
    },
    /// An area that is not finite or is negative.
    #[error("area {value} of unknown {unknown} is not finite and non-negative")]
    Area {
        /// The unknown.
        unknown: usize,
        /// Its area.
        value: f64,
    },
    /// A reflectance outside [0, 1).
    #[error("reflectance {value} of unknown {unknown} lies outside [0, 1)")]
    Reflectance {
        /// The unknown.
        unknown: usize,
        /// Its reflectance.
        value: Rgb,
    },
    /// A source that is not finite or is negative.
    #[error("source radiosity {value} of unknown {unknown} is not finite and non-negative")]
    Source {
        /// The unknown.
        unknown: usize,
        /// Its source radiosity in W/m².
        value: Rgb,
    },
    /// More light is reflected than arrives: the series does not converge.
    #[error(
        "reflected light grows in channel {channel}: unknown {unknown} reflects {gain} times what \
         its surroundings send; form-factor rows must sum to at most 1 and reflectances be below 1"
    )]
    NotContracting {
        /// 0 red, 1 green, 2 blue.
        channel: usize,
        /// The unknown whose row is the largest.
        unknown: usize,
        /// ρ_i Σ_j F_ij of that row.
        gain: f64,
    },
}

/// S = M + ρ E^direct in W/m²: emission, and the first reflection of light from lights that are not
/// patches.
///
/// # Panics
/// When the slices differ in length.
pub fn source(
    emission: &[Exitance],
    reflectance: &[Reflectance],
    direct: &[Irradiance],
) -> Vec<Radiosity> {
    assert_eq!(
        emission.len(),
        reflectance.len(),
        "one reflectance per patch"
    );
    assert_eq!(emission.len(), direct.len(), "one irradiance per patch");
    emission
        .iter()
        .zip(reflectance)
        .zip(direct)
        .map(|((&emitted, &rho), &e)| emitted + rho * e)
        .collect()
}

/// A validated radiosity system, B = S + ρ F B.
#[derive(Clone, Copy)]
pub struct System<'a> {
    transport: &'a dyn Transport,
    areas: &'a [f64],
    reflectance: &'a [Reflectance],
    source: &'a [Radiosity],
    gain: Rgb,
}

impl<'a> System<'a> {
    /// A system from its operator, and the area A (m²), reflectance ρ and source radiosity S (W/m²)
    /// of each unknown. Areas weigh fluxes and means, and the solution does not depend on them; they
    /// are zero for unknowns that stand for no surface.
    ///
    /// # Errors
    /// When lengths differ, a value is out of range, or ‖ρF‖∞ ≥ 1 in a channel.
    pub fn new(
        transport: &'a dyn Transport,
        areas: &'a [f64],
        reflectance: &'a [Reflectance],
        source: &'a [Radiosity],
    ) -> Result<Self, SystemError> {
        let unknowns = transport.len();
        let lengths = [areas.len(), reflectance.len(), source.len()];
        if lengths != [unknowns; 3] {
            return Err(SystemError::Length {
                unknowns,
                areas: areas.len(),
                reflectances: reflectance.len(),
                sources: source.len(),
            });
        }
        if let Some(unknown) = areas.iter().position(|a| !(a.is_finite() && *a >= 0.0)) {
            return Err(SystemError::Area {
                unknown,
                value: areas[unknown],
            });
        }
        let mut gain = Rgb::ZERO;
        for (unknown, (rho, s)) in reflectance.iter().zip(source).enumerate() {
            if !rho.is_valid() {
                return Err(SystemError::Reflectance {
                    unknown,
                    value: rho.0,
                });
            }
            if !(s.0.is_finite() && s.0.min_element() >= 0.0) {
                return Err(SystemError::Source {
                    unknown,
                    value: s.0,
                });
            }
            let row = rho.0 * transport.row_sum(unknown);
            if let Some(channel) = (0..3).find(|&c| row[c].is_nan() || row[c] >= 1.0) {
                return Err(SystemError::NotContracting {
                    channel,
                    unknown,
                    gain: row[channel],
                });
            }
            gain = gain.max(row);
        }
        Ok(Self {
            transport,
            areas,
            reflectance,
            source,
            gain,
        })
    }

    /// Number of unknowns.
    pub fn len(&self) -> usize {
        self.source.len()
    }

    /// True without unknowns.
    pub fn is_empty(&self) -> bool {
        self.source.is_empty()
    }

    /// The operator F.
    pub fn transport(&self) -> &'a dyn Transport {
        self.transport
    }

    /// A of each unknown in m².
    pub fn areas(&self) -> &'a [f64] {
        self.areas
    }

    /// ρ of each unknown.
    pub fn reflectance(&self) -> &'a [Reflectance] {
        self.reflectance
    }

    /// S of each unknown in W/m².
    pub fn source(&self) -> &'a [Radiosity] {
        self.source
    }

    /// Σ A S in W per channel.
    pub(super) fn source_flux(&self) -> Rgb {
        let pairs = self.source.iter().zip(self.areas);
        pairs.map(|(s, &area)| s.0 * area).sum()
    }

    /// ‖ρF‖∞ per channel, below 1.
    pub fn gain(&self) -> Rgb {
        self.gain
    }

    /// The bound on the largest error, in W/m² per channel, that a largest residual in W/m² implies.
    pub fn error_bound(&self, residual: Rgb) -> Rgb {
        residual / (Rgb::ONE - self.gain)
    }

    /// A bound on the root mean square of a solution's error, weighted by area, in W/m² per channel:
    /// √(Σ A e² / Σ A). At most [`Solution::error_bound`], and far below it where few unknowns have a
    /// large residual or bright surfaces face dark ones. See the module `reciprocity` for its
    /// derivation. Costs ten gathers.
    ///
    /// # Errors
    /// When the operator is not reciprocal, as the bound asks.
    pub fn mean_error_bound(&self, solution: &Solution) -> Result<Rgb, NotReciprocal> {
        reciprocity::mean_error_bound(self, &solution.radiosity, &solution.irradiance)
    }

    /// The size of S + ρE − B, where E = F B.
    pub(super) fn residual(&self, radiosity: &[Radiosity], irradiance: &[Irradiance]) -> Residual {
        Residual::of(self.areas, self.residuals(radiosity, irradiance))
    }

    /// r_i = S_i + ρ_i E_i − B_i in W/m² of each unknown, where E = F B.
    pub(super) fn residuals<'b>(
        &'b self,
        radiosity: &'b [Radiosity],
        irradiance: &'b [Irradiance],
    ) -> impl Iterator<Item = Rgb> + 'b {
        self.source
            .iter()
            .zip(self.reflectance)
            .zip(irradiance)
            .zip(radiosity)
            .map(|(((&s, &rho), &e), &b)| (s + rho * e - b).0)
    }
}
