//! Solvers against their theory, on a closed room of uniform reflectance ρ.
//!
//! Jacobi's residual shrinks by ρ a sweep, Gauss–Seidel's by ρ² when ρ is near 1 (by a power of ρ
//! between 1.85 and 2 in this ordering else); the error of conjugate gradient is bounded by Chebyshev's
//! polynomials, in O(1) iterations when all eigenvalues but one lie well below 1.

use crate::closed_box::ClosedBox;
use luxel_solver::solvers::{
    Config, Outcome, Tolerance, conjugate_gradient, gauss_seidel, jacobi, no_progress,
};

/// Residual to which conjugate gradient is to come, relative to that of the start.
pub const RESIDUAL: f64 = 1e-10;

/// Patches along the sides of each face.
const ACROSS: usize = 8;

/// Sweeps after which rates are taken: all but the first eigenvector have died out by 2^-20.
const SWEEPS: usize = 40;

/// What was measured at a reflectance.
#[derive(Clone, Copy, Debug)]
pub struct Rates {
    /// ρ
    pub rho: f64,
    /// Iterations of conjugate gradient to [`RESIDUAL`].
    pub iterations: usize,
    /// Jacobi's factor a sweep over ρ: 1 in theory.
    pub jacobi: f64,
    /// Logarithm of Gauss–Seidel's factor a sweep over that of ρ: 2 in theory, near 1.
    pub gauss_seidel: f64,
}

/// Measures at each of some reflectances.
///
/// # Panics
/// When a reflectance is not below 1, or conjugate gradient does not converge.
pub fn rates(reflectances: &[f64]) -> Vec<Rates> {
    let room = ClosedBox::new(ACROSS);
    let config = Config {
        tolerance: Tolerance::Residual(RESIDUAL),
        max_iterations: 1000,
    };
    let at = |&rho: &f64| {
        let solution = room.solve(rho, |system| {
            conjugate_gradient(system, &config, no_progress).expect("reciprocal")
        });
        assert_eq!(solution.outcome, Outcome::Converged, "ρ = {rho}");
        let sweeps = if rho < 0.9 { SWEEPS / 2 } else { SWEEPS };
        let slow = room.rate(rho, sweeps, |system, config| {
            jacobi(system, config, no_progress)
        });
        let fast = room.rate(rho, sweeps, |system, config| {
            gauss_seidel(system, config, no_progress)
        });
        Rates {
            rho,
            iterations: solution.iterations,
            jacobi: slow / rho,
            gauss_seidel: fast.ln() / rho.ln(),
        }
    };
    reflectances.iter().map(at).collect()
}
