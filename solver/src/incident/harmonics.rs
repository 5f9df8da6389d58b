//! Real spherical harmonics up to degree two, and the irradiance of radiance that they describe.
//!
//! Radiance L(ω) has the coefficients L_lm = ∫ L Y_lm dω. A surface that looks along n receives
//!
//!   E(n) = ∫ L max(n·ω, 0) dω = Σ A_l L_lm Y_lm(n),   A_0 = π, A_1 = 2π/3, A_2 = π/4,
//!
//! and of higher degrees only the even ones count, A_4 = −π/24 being the largest. Basis, in the axes of the scene:
//!
//! | k | Y | | k | Y |
//! |---|---|---|---|---|
//! | 0 | 1/(2√π) | | 5 | √(15/4π) y z |
//! | 1, 2, 3 | √(3/4π) (y, z, x) | | 6 | √(5/16π) (3 z² − 1) |
//! | 4 | √(15/4π) x y | | 7, 8 | √(15/4π) x z, √(15/16π) (x² − y²) |
//!
//! What is left out: light from one direction with fluence rate φ = ∫ L dω leaves at most 3/32 φ of E(n) at any n and 0.0361 φ
//! root mean square over all n (of max(c, 0) less 1/4 + c/2 + 5/32 (3c² − 1), c = cos θ); with degree one alone, 1/4 φ and
//! 0.144 φ. Positive radiance is a sum of such lights, so that these bound it too; the mean of E over all n is φ/4.
//!
//! Source: R. Ramamoorthi, P. Hanrahan, "An efficient representation for irradiance environment maps", SIGGRAPH 2001. Cost: some
//! twenty multiplications a direction.

use glam::DVec3;
use luxel_scenes::{Irradiance, Rgb};
use std::f64::consts::PI;

/// Coefficients of degree two and less.
pub const MOST: usize = 9;

/// What degrees above `degree` leave of E(n) over its mean over all n, φ/4: root mean square over n and the largest, under light from a single
/// direction.
///
/// # Panics
/// For degrees other than one and two.
pub fn rest(degree: usize) -> [f64; 2] {
    match degree {
        // √(1/6 − 1/16 − 1/12) and 1/4.
        1 => [4.0 * (1.0_f64 / 48.0).sqrt(), 1.0],
        // Less 5/256.
        2 => [4.0 * (1.0_f64 / 768.0).sqrt(), 3.0 / 8.0],
        _ => panic!("degree {degree} is not used"),
    }
}

/// A_l.
const TRANSFER: [f64; 3] = [PI, 2.0 * PI / 3.0, PI / 4.0];

/// 1/(2√π).
pub const BAND_0: f64 = 0.282_094_791_773_878_14;
/// √(3/4π).
pub const BAND_1: f64 = 0.488_602_511_902_919_9;
/// √(15/4π) and √(5/16π).
const BAND_2: f64 = 1.092_548_430_592_079_2;
const ZONAL_2: f64 = 0.315_391_565_252_520_05;

/// Values of the basis in a unit direction.
///
/// # Panics
/// When more than [`MOST`] are asked for.
#[inline]
pub fn basis<const N: usize>(direction: DVec3) -> [f64; N] {
    let second = [
        direction.x * direction.x,
        direction.y * direction.y,
        direction.z * direction.z,
        direction.x * direction.y,
        direction.y * direction.z,
        direction.x * direction.z,
    ];
    of_moments(1.0, direction, second)
}

/// Coefficients of a function from its moments ∫ f, ∫ f ω and ∫ f ωω (xx, yy, zz, xy, yz, xz).
#[inline]
pub(super) fn of_moments<const N: usize>(
    zeroth: f64,
    first: DVec3,
    [xx, yy, zz, xy, yz, xz]: [f64; 6],
) -> [f64; N] {
    const { assert!(N <= MOST, "degree two at most") };
    let all = [
        BAND_0 * zeroth,
        BAND_1 * first.y,
        BAND_1 * first.z,
        BAND_1 * first.x,
        BAND_2 * xy,
        BAND_2 * yz,
        ZONAL_2 * (3.0 * zz - zeroth),
        BAND_2 * xz,
        0.5 * BAND_2 * (xx - yy),
    ];
    std::array::from_fn(|k| all[k])
}

/// A_l of the coefficient with index `k`, below [`MOST`].
pub fn transfer(k: usize) -> f64 {
    TRANSFER[k.isqrt()]
}

/// E(n) in W/m² of radiance with these coefficients, in W/m² sr^−½ each, on a surface that looks along the unit vector `normal`.
pub fn irradiance<const N: usize>(coefficients: &[Rgb; N], normal: DVec3) -> Irradiance {
    let values = basis::<N>(normal);
    let terms = coefficients.iter().zip(values).enumerate();
    Irradiance(terms.map(|(k, (c, y))| *c * (transfer(k) * y)).sum())
}

/// The mean over all normals of the square of E(n), from the squares of the coefficients: (1/4π) Σ A_l² L_lm², because the basis
/// is orthonormal. With variances in the place of squares, the mean variance of E(n), however they are correlated.
pub fn mean_square<const N: usize>(squares: &[Rgb; N]) -> Rgb {
    let terms = squares.iter().enumerate();
    terms
        .map(|(k, square)| *square * transfer(k).powi(2))
        .sum::<Rgb>()
        / (4.0 * PI)
}

/// The mean of E(n) over all normals, φ/4.
pub fn mean_irradiance<const N: usize>(coefficients: &[Rgb; N]) -> Irradiance {
    Irradiance(coefficients[0] * (0.25 / BAND_0))
}

/// ∫ L dω in W/m², the fluence rate φ.
pub fn fluence_rate<const N: usize>(coefficients: &[Rgb; N]) -> Rgb {
    coefficients[0] / BAND_0
}

/// ∫ L ω dω in W/m², the vector irradiance: what arrives at a unit area less what arrives at its back, by axis.
///
/// # Panics
/// Without coefficients of degree one.
pub fn vector_irradiance<const N: usize>(coefficients: &[Rgb; N]) -> [Rgb; 3] {
    [3, 1, 2].map(|k| coefficients[k] / BAND_1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Sequence, Stage, sphere};

    /// Directions spread evenly.
    fn directions(count: u32) -> impl Iterator<Item = DVec3> {
        let sequence = Sequence::new(7, Stage::INCIDENT, 0);
        (0..count).map(move |i| sphere::sample_sphere(sequence.point2_f32(i)).as_dvec3())
    }

    #[test]
    fn the_basis_is_orthonormal() {
        const COUNT: u32 = 1 << 16;
        let mut products = [[0.0; MOST]; MOST];
        for direction in directions(COUNT) {
            let y = basis::<MOST>(direction);
            for (row, a) in products.iter_mut().zip(y) {
                for (sum, b) in row.iter_mut().zip(y) {
                    *sum += a * b * 4.0 * PI / f64::from(COUNT);
                }
            }
        }
        for (i, row) in products.iter().enumerate() {
            for (j, product) in row.iter().enumerate() {
                let expected = f64::from(u8::from(i == j));
                // Even points of smooth functions err by their number to the power of −1 and below, times the largest
                // product, 4π · 1.2.
                let allowed = 15.0 / f64::from(COUNT).powf(0.9);
                assert!((product - expected).abs() < allowed, "{i} {j}: {product}");
            }
        }
    }

    /// Of light from one direction the rest is bounded as the head of the file says, and its mean square is that of its
    /// coefficients.
    #[test]
    fn light_from_one_direction_is_known_to_the_stated_rest() {
        const COUNT: u32 = 1 << 14;
        let towards = DVec3::new(0.48, -0.6, 0.64);
        let coefficients = basis::<MOST>(towards).map(Rgb::splat);
        let (mut largest, mut squares, mut own) = (0.0_f64, 0.0, 0.0);
        for normal in directions(COUNT) {
            let found = irradiance(&coefficients, normal).0.x;
            let rest = towards.dot(normal).max(0.0) - found;
            largest = largest.max(rest.abs());
            squares += rest * rest / f64::from(COUNT);
            own += found * found / f64::from(COUNT);
        }
        // The largest is reached in a band of normals, of which some are near enough: it is quadratic there.
        let [usual, worst] = rest(2).map(|rest| rest / 4.0);
        assert!((largest / worst - 1.0).abs() < 1e-3, "{largest}");
        // Even points of smooth functions: 1e-4 relative here.
        assert!((squares.sqrt() / usual - 1.0).abs() < 1e-3);
        let stated = mean_square(&coefficients.map(|c| c * c)).x;
        assert!((own / stated - 1.0).abs() < 1e-3, "{own} {stated}");
    }

    #[test]
    fn even_radiance_has_one_coefficient_and_the_irradiance_pi() {
        let mut coefficients = [Rgb::ZERO; MOST];
        // ∫ Y_00 = 2√π for L = 1.
        coefficients[0] = Rgb::splat(2.0 * PI.sqrt());
        for normal in directions(16) {
            let found = irradiance(&coefficients, normal).0;
            assert!((found - Rgb::splat(PI)).abs().max_element() < 1e-14);
        }
        assert!((mean_irradiance(&coefficients).0.x - PI).abs() < 1e-14);
        assert!((fluence_rate(&coefficients).x - 4.0 * PI).abs() < 1e-13);
        assert_eq!(vector_irradiance(&coefficients), [Rgb::ZERO; 3]);
    }
}
