//! The solvers of the study, in one place.

use super::rates;
use luxel_solver::solvers::{
    Ambient, Config, DirectError, NotReciprocal, Solution, System, SystemError, conjugate_gradient,
    direct, gauss_seidel, jacobi, no_progress, southwell,
};
use luxel_solver::transport::Symmetrised;
use serde::Serialize;

/// What solves the system B = S + ρFB.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Solver {
    /// Simultaneous sweeps.
    Jacobi,
    /// Sweeps that use each new value at once.
    GaussSeidel,
    /// Progressive shooting, without the ambient estimate.
    Southwell,
    /// Conjugate gradient; on the mean of an operator and its transpose where it is not reciprocal.
    ConjugateGradient,
    /// LU factors.
    Direct,
}

/// Why a solver has no solution.
#[derive(Debug, thiserror::Error)]
pub enum SolveError {
    /// LU factors met a zero pivot.
    #[error(transparent)]
    Direct(#[from] DirectError),
    /// The operator is not reciprocal, though it was made so.
    #[error(transparent)]
    NotReciprocal(#[from] NotReciprocal),
    /// The operator that was made reciprocal gives light back without end.
    #[error(transparent)]
    System(#[from] SystemError),
}

/// What theory says of how the residual falls.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rate {
    /// Factor by which the residual falls in the long run, each iteration, or a bound on it.
    pub factor: f64,
    /// What the factor is.
    #[serde(skip)]
    pub meaning: &'static str,
}

/// Patches up to which LU factors are worth their n³: 0.2 s a channel at this size.
const MAX_DIRECT: usize = 800;

/// Patches up to which shooting is tried, whose search for the brightest costs n² a sweep, and up to which
/// sparse rows are made reciprocal, which stores each entry twice.
const MAX_MODERATE: usize = 6000;

impl Solver {
    /// All solvers.
    pub const ALL: [Self; 5] = [
        Self::Jacobi,
        Self::GaussSeidel,
        Self::Southwell,
        Self::ConjugateGradient,
        Self::Direct,
    ];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Jacobi => "jacobi",
            Self::GaussSeidel => "gauss-seidel",
            Self::Southwell => "southwell",
            Self::ConjugateGradient => "cg",
            Self::Direct => "direct",
        }
    }

    /// Its name in text.
    pub fn title(self) -> &'static str {
        match self {
            Self::Jacobi => "Jacobi",
            Self::GaussSeidel => "Gauss–Seidel",
            Self::Southwell => "Southwell",
            Self::ConjugateGradient => "conjugate gradient",
            Self::Direct => "LU",
        }
    }

    /// The largest number of patches that it is tried on.
    pub fn max_patches(self) -> usize {
        match self {
            Self::Direct => MAX_DIRECT,
            Self::Southwell | Self::ConjugateGradient => MAX_MODERATE,
            Self::Jacobi | Self::GaussSeidel => usize::MAX,
        }
    }

    /// Solves a system.
    ///
    /// # Errors
    /// As [`SolveError`] says; none of them happens while ‖ρF‖∞ is well below 1.
    pub fn solve(self, system: &System, config: &Config) -> Result<Solution, SolveError> {
        match self {
            Self::Jacobi => Ok(jacobi(system, config, no_progress)),
            Self::GaussSeidel => Ok(gauss_seidel(system, config, no_progress)),
            Self::Southwell => Ok(southwell(system, Ambient::None, config, no_progress)),
            Self::ConjugateGradient => {
                if let Ok(solution) = conjugate_gradient(system, config, no_progress) {
                    return Ok(solution);
                }
                let mean = Symmetrised::new(system.transport(), system.areas());
                let (rho, source) = (system.reflectance(), system.source());
                let system = System::new(&mean, system.areas(), rho, source)?;
                Ok(conjugate_gradient(&system, config, no_progress)?)
            }
            Self::Direct => Ok(direct(system)?),
        }
    }

    /// The theoretical rate in a channel (0 red, 1 green, 2 blue); `None` for a solver that does
    /// not iterate. Costs some hundred sweeps.
    pub fn rate(self, system: &System, channel: usize) -> Option<Rate> {
        match self {
            Self::Jacobi => Some(Rate {
                factor: rates::jacobi(system, channel),
                meaning: "spectral radius of ρF",
            }),
            Self::GaussSeidel => Some(Rate {
                factor: rates::gauss_seidel(system, channel),
                meaning: "spectral radius of (I − ρL)⁻¹ρU",
            }),
            Self::Southwell => Some(Rate {
                factor: (system.gain()[channel] - 1.0).exp(),
                meaning: "bound e^−(1 − ‖ρF‖∞) on unshot flux a sweep",
            }),
            Self::ConjugateGradient => {
                let lambda = rates::jacobi(system, channel);
                let root = ((1.0 + lambda) / (1.0 - lambda)).sqrt();
                Some(Rate {
                    factor: (root - 1.0) / (root + 1.0),
                    meaning: "bound (√κ − 1)/(√κ + 1), κ = (1 + λ)/(1 − λ)",
                })
            }
            Self::Direct => None,
        }
    }
}
