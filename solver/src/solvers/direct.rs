//! Direct solution by LU factors with partial pivoting: (I − ρF) B = S.
//!
//! Source: G. H. Golub, C. F. Van Loan, "Matrix Computations", 4th edition, 2013, sections 3.4 and
//! 3.5.3 (refinement in fixed precision). The oracle for small n: 2n³/3 operations per channel with
//! its own reflectance, 8n² bytes per factorisation. One refinement step recovers what pivot growth
//! may have lost.

use super::{Outcome, Solution, System};
use luxel_scenes::{Irradiance, Radiosity};
use nalgebra::{DMatrix, DVector};
use thiserror::Error;

/// Why a system has no direct solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum DirectError {
    /// A pivot is zero in floating point; cannot happen while ‖ρF‖∞ is well below 1.
    #[error("the matrix I - rho F of channel {channel} is singular in floating point")]
    Singular {
        /// 0 red, 1 green, 2 blue.
        channel: usize,
    },
}

/// Solves a system by LU factors, one factorisation for each distinct channel.
///
/// # Errors
/// When a channel's matrix is singular in floating point.
pub fn direct(system: &System) -> Result<Solution, DirectError> {
    let n = system.len();
    let factors = system.transport().to_dense();
    let mut radiosity = vec![Radiosity::ZERO; n];
    let mut done: Vec<usize> = Vec::with_capacity(3);
    for channel in 0..3 {
        if n == 0 || done.contains(&channel) {
            continue;
        }
        let rho = |i: usize| system.reflectance()[i].0[channel];
        let shared: Vec<usize> = (channel..3)
            .filter(|&c| {
                system
                    .reflectance()
                    .iter()
                    .all(|r| r.0[c].to_bits() == r.0[channel].to_bits())
            })
            .collect();
        let matrix = DMatrix::from_fn(n, n, |i, j| {
            f64::from(u8::from(i == j)) - rho(i) * factors[(i, j)]
        });
        let lu = matrix.clone().lu();
        for &c in &shared {
            let s = DVector::from_fn(n, |i, _| system.source()[i].0[c]);
            let mut b = lu.solve(&s).ok_or(DirectError::Singular { channel: c })?;
            let r = &s - &matrix * &b;
            if let Some(correction) = lu.solve(&r) {
                b += correction;
            }
            for i in 0..n {
                radiosity[i].0[c] = b[i];
            }
        }
        done.extend(shared);
    }
    let mut irradiance = vec![Irradiance::ZERO; n];
    system.transport().gather(&radiosity, &mut irradiance);
    let residual = system.residual(&radiosity, &irradiance).largest;
    Ok(Solution {
        radiosity,
        irradiance,
        outcome: Outcome::Converged,
        iterations: 1,
        residual,
        error_bound: system.error_bound(residual),
        residual_history: vec![residual],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::Dense;
    use luxel_scenes::{Reflectance, Rgb};

    #[test]
    fn two_facing_plates_have_their_closed_form() {
        // B1 = S1 / (1 - rho1 rho2 f^2), B2 = rho2 f B1.
        let f = 0.3;
        let dense = Dense::new(2, vec![0.0, f, f, 0.0]).expect("a valid matrix");
        let rho = [Reflectance::new(0.5, 0.5, 0.0), Reflectance::splat(0.25)];
        let s = [Radiosity::splat(4.0), Radiosity::ZERO];
        let system = System::new(&dense, &[1.0; 2], &rho, &s).expect("a valid system");
        let solution = direct(&system).expect("a regular matrix");
        let b1 = 4.0 / (1.0 - 0.5 * 0.25 * f * f);
        let expected = [Rgb::new(b1, b1, 4.0), Rgb::new(b1, b1, 4.0) * 0.25 * f];
        for (b, e) in solution.radiosity.iter().zip(expected) {
            // A 2 x 2 elimination rounds a handful of times.
            assert!((b.0 - e).abs().max_element() < 1e-14, "{b:?} against {e}");
        }
        assert_eq!(
            solution.radiosity[0].0.z.to_bits(),
            4.0_f64.to_bits(),
            "a black channel keeps its source to the bit"
        );
    }

    #[test]
    fn an_empty_system_has_an_empty_solution() {
        let dense = Dense::new(0, Vec::new()).expect("an empty matrix");
        let system = System::new(&dense, &[], &[], &[]).expect("a valid system");
        let solution = direct(&system).expect("nothing to invert");
        assert!(solution.radiosity.is_empty(), "no unknowns");
    }
}
