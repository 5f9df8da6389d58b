//! Solvers of the radiosity system B = S + ρ F B.
//!
//! The three channels share one F and are solved side by side; each has its own reflectance, its own
//! residual and its own error bound. Convergence is judged on the residual r = S + ρFB − B, never on
//! the size of a step: a step of 10⁻⁶ at ρ = 0.9999 leaves an error of 1 %.

#[cfg(test)]
mod conformance;
mod conjugate_gradient;
mod direct;
mod gauss_seidel;
mod jacobi;
mod ledger;
mod neumann;
mod reciprocity;
mod report;
mod southwell;
mod system;

pub use conjugate_gradient::conjugate_gradient;
pub use direct::{DirectError, direct};
pub use gauss_seidel::gauss_seidel;
pub use jacobi::jacobi;
pub use ledger::Ledger;
pub use neumann::neumann;
pub use reciprocity::NotReciprocal;
pub use report::{Config, Outcome, Progress, Solution, Tolerance, no_progress};
pub use southwell::{Ambient, southwell};
pub use system::{System, SystemError, source};
