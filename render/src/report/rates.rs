//! Theoretical rates of iterative solvers: spectral radii by power iteration.
//!
//! With F = L + D + U (strictly lower, diagonal, strictly upper), an iteration that maps an error e to Te
//! shrinks it in the long run by the spectral radius of T each time:
//!
//! Jacobi T = ρF; Gauss–Seidel T = (I − ρ(L + D))⁻¹ ρU.
//!
//! Both are non-negative, so that the radius is itself an eigenvalue (Perron, Frobenius) and power
//! iteration from a positive vector finds it. Jacobi's T may have −λ beside λ (two plates that see only each
//! other), but, being similar to a symmetric matrix, nothing else of that size: T² is iterated, whose largest
//! eigenvalue is λ². A shifted T would not do: where light dies out after a few bounces it converges like 1/k.
//!
//! Source: R. S. Varga, "Matrix Iterative Analysis", 1962, chapters 2 and 3. Bounds: the ratios of
//! successive iterates bracket the radius, so that the iteration knows when it may stop. Cost: one
//! gather each time.

use luxel_scenes::{Irradiance, Radiosity, Rgb};
use luxel_solver::solvers::System;

/// How near, relative, the two bounds must come: three digits are shown.
const ACCURACY: f64 = 1e-5;

/// Iterations after which the best estimate will do.
const MAX_ITERATIONS: usize = 2000;

/// Spectral radius of ρF in a channel.
pub(super) fn jacobi(system: &System, channel: usize) -> f64 {
    let transport = system.transport();
    let mut light = vec![Radiosity::ZERO; system.len()];
    let mut gathered = vec![Irradiance::ZERO; system.len()];
    let squared = power(system.len(), |x| {
        for _ in 0..2 {
            for (b, &x) in light.iter_mut().zip(x.iter()) {
                *b = Radiosity(Rgb::splat(x));
            }
            transport.gather(&light, &mut gathered);
            for ((x, rho), e) in x.iter_mut().zip(system.reflectance()).zip(&gathered) {
                *x = rho.0[channel] * e.0[channel];
            }
        }
    });
    squared.sqrt()
}

/// Spectral radius of Gauss–Seidel's iteration in a channel.
pub(super) fn gauss_seidel(system: &System, channel: usize) -> f64 {
    let transport = system.transport();
    power(system.len(), |x| {
        let mut light: Vec<Radiosity> = x.iter().map(|&x| Radiosity(Rgb::splat(x))).collect();
        for (i, x) in x.iter_mut().enumerate() {
            let rho = system.reflectance()[i].0[channel];
            let own = transport.coupling(i);
            let others = transport.gather_row(i, &light).0[channel] - own * *x;
            *x = (rho * others / (1.0 - rho * own)).max(0.0);
            light[i] = Radiosity(Rgb::splat(*x));
        }
    })
}

/// Largest eigenvalue of a non-negative operator that replaces a vector by its image.
fn power(len: usize, mut apply: impl FnMut(&mut [f64])) -> f64 {
    let mut x = vec![1.0; len];
    let mut radius = 0.0;
    for _ in 0..MAX_ITERATIONS {
        let before = x.clone();
        apply(&mut x);
        let norm = x.iter().copied().fold(0.0, f64::max);
        if norm <= 0.0 {
            return 0.0;
        }
        // Elements that have died out (black patches, patches that see nothing) bound nothing.
        let ratios = x.iter().zip(&before).filter(|&(&x, _)| x > 1e-9 * norm);
        let (low, high) = ratios
            .map(|(x, before)| x / before)
            .fold((f64::INFINITY, 0.0_f64), |(low, high), r| {
                (low.min(r), high.max(r))
            });
        radius = x.iter().sum::<f64>() / before.iter().sum::<f64>();
        if high - low <= ACCURACY * radius {
            break;
        }
        for x in &mut x {
            *x /= norm;
        }
    }
    radius
}

#[cfg(test)]
mod tests {
    use super::*;
    use luxel_scenes::Reflectance;
    use luxel_solver::transport::Dense;

    /// Asserts both rates of a matrix, reflectances (the same in all channels) and expectations.
    fn check(factors: &[f64], rho: &[f64], expected: [f64; 2]) {
        let n = rho.len();
        let dense = Dense::new(n, factors.to_vec()).expect("a matrix");
        let rho: Vec<_> = rho.iter().map(|&rho| Reflectance::splat(rho)).collect();
        let source = vec![Radiosity::ZERO; n];
        let areas = vec![1.0; n];
        let system = System::new(&dense, &areas, &rho, &source).expect("a system");
        let found = [jacobi(&system, 1), gauss_seidel(&system, 1)];
        for (found, expected) in found.iter().zip(expected) {
            // The two bounds are that near, relative to rates below 1.
            assert!((found - expected).abs() <= ACCURACY, "{found} {expected}");
        }
    }

    #[test]
    fn two_plates_halve_the_sweeps() {
        // λ = f √(ρ₁ρ₂), Gauss–Seidel λ².
        let f = 0.4;
        let lambda = f * (0.8_f64 * 0.5).sqrt();
        check(&[0.0, f, f, 0.0], &[0.8, 0.5], [lambda, lambda * lambda]);
    }

    #[test]
    fn a_closed_scene_of_one_reflectance_has_it_as_its_rate() {
        let n = 5;
        let factors: Vec<f64> = (0..n * n)
            .map(|k| if k % (n + 1) == 0 { 0.0 } else { 0.25 })
            .collect();
        let dense = Dense::new(n, factors.clone()).expect("a matrix");
        let rho = vec![Reflectance::splat(0.9); n];
        let source = vec![Radiosity::ZERO; n];
        let areas = vec![1.0; n];
        let system = System::new(&dense, &areas, &rho, &source).expect("a system");
        assert!((jacobi(&system, 0) - 0.9).abs() < ACCURACY);
        let sweeps = gauss_seidel(&system, 0);
        assert!((0.7..0.9).contains(&sweeps), "between λ² and λ: {sweeps}");
    }

    #[test]
    fn darkness_converges_at_once() {
        check(&[0.0, 0.5, 0.5, 0.0], &[0.0, 0.0], [0.0, 0.0]);
        check(&[0.0, 0.5, 0.5, 0.0], &[0.0, 0.7], [0.0, 0.0]);
    }
}
