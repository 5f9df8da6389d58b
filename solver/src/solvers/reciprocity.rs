//! Whether an operator is reciprocal, and the error bound that follows when it is.
//!
//! **The test.** With G = A^½ F A^-½, reciprocity A_i F_ij = A_j F_ji is the symmetry of G. For signs x, y
//! drawn at random, xᵀ(G − Gᵀ)y has mean zero and the standard deviation ‖G − Gᵀ‖_F, which bounds the
//! spectral norm, so that the largest of three such products tells how far G is from symmetric: it is
//! below a thousandth of ‖G − Gᵀ‖_F once in 10⁹ times. Two gathers, any operator. Source: in the
//! manner of M. F. Hutchinson, "A stochastic estimator of the trace of the influence matrix", 1990.
//!
//! **The bound.** In the inner product ⟨u, v⟩ = Σ (A_i/ρ_i) u_i v_i the matrix ρF is symmetric, because
//! (A/ρ) ρF = AF, so that its norm is its spectral radius λ. From (I − ρF) e = r follows ‖e‖ ≤ ‖r‖/(1 − λ)
//! in the norm of this product, and, because ρ_i ≤ ρ_max,
//!
//! √(Σ A_i e_i²) ≤ √ρ_max √(Σ A_i r_i²/ρ_i) / (1 − λ).
//!
//! Unknowns with ρ_i = 0 have r_i = 0 = e_i in a solution that kept B_i = S_i, and drop out of both sums.
//! λ itself is bounded by the quotients of L. Collatz, "Einschliessungssatz für die charakteristischen
//! Zahlen von Matrizen", 1942: for any x > 0, λ ≤ max_i (ρFx)_i / x_i. With x = (ρF)^k 1 the bound does not
//! grow in k; k = 0 is ‖ρF‖∞ = max_i ρ_i Σ_j F_ij, and a few steps come near λ, which lies far below it where
//! bright and dark surfaces face each other. (Where x_i becomes 0 no light that returns passes i.)
//! λ is raised by the asymmetry that the test finds. Cost: k + 2 gathers.

use super::System;
use crate::sampling::Stage;
use crate::sampling::hash::bits;
use luxel_scenes::{Irradiance, Radiosity, Rgb};
use thiserror::Error;

/// ‖G − Gᵀ‖ above which an operator does not count as reciprocal. Rounding alone makes n ε, 10⁻¹² for
/// 8000 unknowns. A larger limit comes near 1 − λ, on which conjugate gradient and bound rely: 10⁻⁴ at
/// ρ = 0.9999.
const MAX_DEFECT: f64 = 1e-9;

/// Steps k of the bound on λ. Each costs a gather; the quotients change little after some, because
/// the second eigenvalue of a room is below half of the first.
const STEPS: usize = 8;

/// A form-factor operator does not obey A_i F_ij = A_j F_ji.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error(
    "form factors are not reciprocal: A_i F_ij and A_j F_ji differ by {defect:.1e} (root of the \
     summed squares over sqrt(A_i A_j)), as those of rays and hemicubes do; use analytic form factors, \
     make these reciprocal, or choose another solver"
)]
pub struct NotReciprocal {
    /// An estimate of ‖G − Gᵀ‖_F, G_ij = A_i F_ij / √(A_i A_j).
    pub defect: f64,
}

/// How far an operator is from reciprocal: an estimate of ‖G − Gᵀ‖_F.
///
/// # Errors
/// When it is further than rounding explains.
pub(super) fn check(system: &System) -> Result<f64, NotReciprocal> {
    let n = system.len();
    let sign = |vector: u64, unknown: usize| {
        let word = bits(0, Stage::RECIPROCITY, vector, unknown as u64);
        Rgb::new(
            if word & 1 == 0 { 1.0 } else { -1.0 },
            if word & 2 == 0 { 1.0 } else { -1.0 },
            if word & 4 == 0 { 1.0 } else { -1.0 },
        )
    };
    // An unknown without area that others see breaks reciprocity, and shows.
    let root = |unknown: usize| system.areas()[unknown].max(f64::MIN_POSITIVE).sqrt();
    let mut image = vec![Irradiance::ZERO; n];
    let mut product = |left: u64, right: u64| -> Rgb {
        let vector: Vec<_> = (0..n)
            .map(|i| Radiosity(sign(right, i) / root(i)))
            .collect();
        system.transport().gather(&vector, &mut image);
        let terms = image.iter().enumerate();
        terms.map(|(i, e)| e.0 * sign(left, i) * root(i)).sum()
    };
    let defect = (product(0, 1) - product(1, 0)).abs().max_element();
    if defect <= MAX_DEFECT {
        Ok(defect)
    } else {
        Err(NotReciprocal { defect })
    }
}

/// The bound on the area-weighted root mean square of the error, in W/m² per channel.
pub(super) fn mean_error_bound(
    system: &System,
    radiosity: &[Radiosity],
    irradiance: &[Irradiance],
) -> Result<Rgb, NotReciprocal> {
    let defect = check(system)?;
    let area: f64 = system.areas().iter().sum();
    if area == 0.0 {
        return Ok(Rgb::ZERO);
    }
    let weighted: Rgb = system
        .residuals(radiosity, irradiance)
        .zip(system.reflectance())
        .zip(system.areas())
        .map(|((r, rho), &area)| {
            // A residual where nothing is reflected has an infinite weight: the bound is then that of
            // the largest error.
            Rgb::select(r.cmpeq(Rgb::ZERO), Rgb::ZERO, r * r * area / rho.0)
        })
        .sum();
    let brightest = system
        .reflectance()
        .iter()
        .fold(Rgb::ZERO, |largest, rho| largest.max(rho.0));
    let room = Rgb::ONE - (spectral_radius_bound(system) + brightest * defect);
    let largest = system.residual(radiosity, irradiance).largest;
    let mean = (brightest * weighted / area).map(f64::sqrt) / room.max(Rgb::ZERO);
    let mean = Rgb::select(weighted.cmpeq(Rgb::ZERO), Rgb::ZERO, mean);
    Ok(mean.min(system.error_bound(largest)))
}

/// max_i (ρFx)_i / x_i for x = (ρF)^k 1, per channel, raised by its rounding.
fn spectral_radius_bound(system: &System) -> Rgb {
    let n = system.len();
    let mut vector = vec![Radiosity::splat(1.0); n];
    let mut image = vec![Irradiance::ZERO; n];
    let mut bound = system.gain();
    for _ in 0..=STEPS {
        system.transport().gather(&vector, &mut image);
        let mut largest = Rgb::ZERO;
        for ((x, &e), &rho) in vector.iter_mut().zip(&image).zip(system.reflectance()) {
            let next = rho * e;
            let quotient = Rgb::select(x.0.cmpeq(Rgb::ZERO), Rgb::ZERO, next.0 / x.0);
            largest = largest.max(quotient);
            *x = next;
        }
        bound = bound.min(largest);
        // Powers of tiny reflectances would underflow; quotients do not know the scale.
        let scale = vector.iter().fold(Rgb::ZERO, |m, x| m.max(x.0));
        for x in &mut vector {
            x.0 = Rgb::select(scale.cmpeq(Rgb::ZERO), Rgb::ZERO, x.0 / scale);
        }
    }
    bound * (1.0 + n as f64 * f64::EPSILON)
}
