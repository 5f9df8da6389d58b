//! Conjugate gradient on the symmetrised system (A/ρ − AF) B = (A/ρ) S.
//!
//! Reciprocity makes AF symmetric, and ‖ρF‖∞ < 1 makes A/ρ − AF positive definite. With B = S + ρH the
//! unknown is the irradiance H instead: multiplied by ρ from both sides the system is
//!
//! Aρ (I − Fρ) H = Aρ F S, symmetric, preconditioned by its diagonal Aρ,
//!
//! so that the iteration runs on I − Fρ in the inner product ⟨u, v⟩ = Σ A_i ρ_i u_i v_i. Nothing is
//! divided by ρ: unknowns with ρ_i = 0 have the weight zero, which eliminates them, and keep B_i = S_i
//! to the bit. Each channel has its own ρ and so its own coefficients; the three share one gather.
//!
//! Sources: M. R. Hestenes, E. Stiefel, "Methods of conjugate gradients for solving linear systems",
//! 1952; L. Neumann, A. Neumann, "Radiosity and hybrid methods", ACM Transactions on Graphics 14, 1995 (the
//! symmetric form of radiosity). Valid for reciprocal operators with ‖ρF‖∞ < 1; others are refused.
//! Rate: the error shrinks by (√κ − 1)/(√κ + 1) or better an iteration, κ ≤ (1 + λ)/(1 − λ) for a spectral
//! radius λ of ρF; in a closed room one eigenvalue stands apart and costs one iteration, whatever ρ.
//! Cost: a gather an iteration, parallel, and two to test reciprocity.
//!
//! The residual of the recurrence, r = ρs, drifts from the true one by rounding. When it meets the
//! tolerance the true one is evaluated, and if that does not meet it, the iteration starts anew from it.

use super::reciprocity::{self, NotReciprocal};
use super::report::Residual;
use super::{Config, Outcome, Progress, Solution, System};
use luxel_scenes::{Irradiance, Radiosity, Rgb};
use std::ops::ControlFlow;

/// Solves a system by conjugate gradient from B = S.
///
/// `progress` is called after each iteration and may stop the solver.
///
/// # Errors
/// When the operator is not reciprocal; [`crate::transport::Symmetrised`] makes one that is.
pub fn conjugate_gradient(
    system: &System,
    config: &Config,
    mut progress: impl FnMut(Progress) -> ControlFlow<()>,
) -> Result<Solution, NotReciprocal> {
    reciprocity::check(system)?;
    let transport = system.transport();
    let mut radiosity = system.source().to_vec();
    let mut irradiance = vec![Irradiance::ZERO; system.len()];
    transport.gather(&radiosity, &mut irradiance);
    let first = system.residual(&radiosity, &irradiance);
    let mut residual = first;
    let mut is_exact = true;
    let mut state = State::new(system, &irradiance);
    let mut history = vec![first.largest];
    let outcome = loop {
        let limit = config.tolerance.limit(system, &first, &radiosity);
        if !is_exact && residual.is_within(&limit, 1.0) {
            transport.gather(&radiosity, &mut irradiance);
            residual = system.residual(&radiosity, &irradiance);
            state.restart(system, &irradiance);
            is_exact = true;
        }
        let iteration = history.len() - 1;
        history[iteration] = residual.largest;
        if is_exact && residual.is_within(&limit, 1.0) {
            break Outcome::Converged;
        }
        if iteration >= config.max_iterations {
            break Outcome::IterationLimit;
        }
        if iteration > 0
            && progress(Progress {
                iteration,
                residual: residual.largest,
            })
            .is_break()
        {
            break Outcome::Interrupted;
        }
        state.step(system);
        state.radiosity(system, &mut radiosity);
        residual = state.residual(system);
        is_exact = false;
        history.push(residual.largest);
    };
    if !is_exact {
        transport.gather(&radiosity, &mut irradiance);
        residual = system.residual(&radiosity, &irradiance);
        history.pop();
        history.push(residual.largest);
    }
    Ok(Solution {
        radiosity,
        irradiance,
        outcome,
        iterations: history.len() - 1,
        residual: residual.largest,
        error_bound: system.error_bound(residual.largest),
        residual_history: history,
    })
}

/// The vectors of the recurrence, each in W/m².
struct State {
    /// H: the irradiance so far.
    solution: Vec<Rgb>,
    /// s = F(S + ρH) − H.
    residual: Vec<Rgb>,
    /// p: conjugate to all directions before.
    direction: Vec<Rgb>,
    /// ρp, what the operator is applied to.
    shot: Vec<Radiosity>,
    /// Fρp.
    image: Vec<Irradiance>,
    /// ⟨s, s⟩.
    square: Rgb,
}

impl State {
    /// The start H = 0, where s = F S.
    fn new(system: &System, irradiance: &[Irradiance]) -> Self {
        let n = system.len();
        let mut state = Self {
            solution: vec![Rgb::ZERO; n],
            residual: vec![Rgb::ZERO; n],
            direction: vec![Rgb::ZERO; n],
            shot: vec![Radiosity::ZERO; n],
            image: vec![Irradiance::ZERO; n],
            square: Rgb::ZERO,
        };
        state.restart(system, irradiance);
        state
    }

    /// Forgets all directions and goes on from the true residual of H, `irradiance` being F(S + ρH).
    fn restart(&mut self, system: &System, irradiance: &[Irradiance]) {
        for ((s, &e), &h) in self.residual.iter_mut().zip(irradiance).zip(&self.solution) {
            *s = e.0 - h;
        }
        self.direction.clone_from(&self.residual);
        self.square = inner(system, &self.residual, &self.residual);
    }

    /// One iteration.
    fn step(&mut self, system: &System) {
        for ((shot, &p), &rho) in self
            .shot
            .iter_mut()
            .zip(&self.direction)
            .zip(system.reflectance())
        {
            *shot = rho * Irradiance(p);
        }
        system.transport().gather(&self.shot, &mut self.image);
        // q = (I − Fρ) p, in the place of Fρp.
        for (q, &p) in self.image.iter_mut().zip(&self.direction) {
            q.0 = p - q.0;
        }
        let curvature: Rgb = (0..system.len())
            .map(|i| weight(system, i) * self.direction[i] * self.image[i].0)
            .sum();
        // A channel that has nothing left, to rounding, rests.
        let alpha = ratio(self.square, curvature);
        for (((h, s), &p), &q) in self
            .solution
            .iter_mut()
            .zip(&mut self.residual)
            .zip(&self.direction)
            .zip(&self.image)
        {
            *h += alpha * p;
            *s -= alpha * q.0;
        }
        let square = inner(system, &self.residual, &self.residual);
        let beta = ratio(square, self.square);
        self.square = square;
        for (p, &s) in self.direction.iter_mut().zip(&self.residual) {
            *p = s + beta * *p;
        }
    }

    /// B = S + ρH.
    fn radiosity(&self, system: &System, radiosity: &mut [Radiosity]) {
        for (((b, &s), &rho), &h) in radiosity
            .iter_mut()
            .zip(system.source())
            .zip(system.reflectance())
            .zip(&self.solution)
        {
            *b = s + rho * Irradiance(h);
        }
    }

    /// The size of r = ρs.
    fn residual(&self, system: &System) -> Residual {
        let pairs = system.reflectance().iter().zip(&self.residual);
        Residual::of(system.areas(), pairs.map(|(rho, &s)| rho.0 * s))
    }
}

/// A_i ρ_i.
fn weight(system: &System, unknown: usize) -> Rgb {
    system.reflectance()[unknown].0 * system.areas()[unknown]
}

/// ⟨u, v⟩ = Σ A_i ρ_i u_i v_i.
fn inner(system: &System, u: &[Rgb], v: &[Rgb]) -> Rgb {
    let pairs = u.iter().zip(v).enumerate();
    pairs.map(|(i, (&u, &v))| weight(system, i) * u * v).sum()
}

/// a / b per channel, zero where b is not positive.
fn ratio(a: Rgb, b: Rgb) -> Rgb {
    Rgb::select(b.cmpgt(Rgb::ZERO), a / b, Rgb::ZERO)
}

#[cfg(test)]
mod tests {
    use super::super::{Tolerance, direct, no_progress};
    use super::*;
    use crate::transport::{Dense, Symmetrised};
    use luxel_scenes::Reflectance;

    const CONFIG: Config = Config {
        tolerance: Tolerance::Residual(1e-12),
        max_iterations: 100,
    };

    /// The inside of a sphere cut into patches of different areas: F_ij = A_j / Σ A.
    fn sphere(areas: &[f64]) -> Dense {
        let total: f64 = areas.iter().sum();
        let rows = areas.iter().flat_map(|_| areas.iter().map(|a| a / total));
        Dense::new(areas.len(), rows.collect()).expect("a valid matrix")
    }

    #[test]
    fn a_matrix_of_rank_one_takes_two_iterations() {
        // I − Fρ has two eigenvalues, 1 and 1 − ρ̄, and one iteration serves each.
        let areas: Vec<f64> = (1..=30).map(f64::from).collect();
        let rho: Vec<_> = (0..30)
            .map(|k| Reflectance::new(0.03 * f64::from(k), 0.9999, 0.0))
            .collect();
        let s: Vec<_> = (0..30)
            .map(|k| Radiosity::splat(f64::from(k % 4)))
            .collect();
        let dense = sphere(&areas);
        let system = System::new(&dense, &areas, &rho, &s).expect("a valid system");
        let solution = conjugate_gradient(&system, &CONFIG, no_progress).expect("reciprocal");
        assert_eq!(solution.outcome, Outcome::Converged);
        assert!(solution.iterations <= 2, "{}", solution.iterations);
        let exact = direct(&system).expect("a regular matrix");
        for (b, (exact, s)) in solution
            .radiosity
            .iter()
            .zip(exact.radiosity.iter().zip(&s))
        {
            let bound = solution.error_bound + exact_rounding(exact.0);
            assert!((b.0 - exact.0).abs().cmple(bound).all(), "{b:?} {exact:?}");
            assert_eq!(b.0.z.to_bits(), s.0.z.to_bits(), "a black channel");
        }
    }

    /// Thirty terms, amplified by 1/(1 − ρ) = 10⁴.
    fn exact_rounding(b: Rgb) -> Rgb {
        b.abs() * (30.0 * 1e4 * f64::EPSILON)
    }

    #[test]
    fn what_is_not_reciprocal_is_refused_until_it_is_made_so() {
        let areas = [1.0, 2.0, 4.0];
        let entries = vec![0.0, 0.3, 0.6, 0.16, 0.0, 0.5, 0.15, 0.25, 0.0];
        let dense = Dense::new(3, entries).expect("a valid matrix");
        let rho = [Reflectance::splat(0.8); 3];
        let s = [Radiosity::splat(1.0); 3];
        let system = System::new(&dense, &areas, &rho, &s).expect("a valid system");
        let refused = conjugate_gradient(&system, &CONFIG, no_progress).expect_err("refused");
        // Only the pair 0, 1 differs: by 0.02/sqrt(2) in G, twice in G − Gᵀ, times signs.
        assert!((0.005..0.1).contains(&refused.defect), "{refused}");
        let reciprocal = Symmetrised::new(&dense, &areas);
        let system = System::new(&reciprocal, &areas, &rho, &s).expect("a valid system");
        let solution = conjugate_gradient(&system, &CONFIG, no_progress).expect("reciprocal");
        assert_eq!(solution.outcome, Outcome::Converged);
    }
}
