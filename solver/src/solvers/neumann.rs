//! Partial sums of Neumann's series: light that was reflected at most k times.
//!
//! With M what surfaces emit and S = M + ρ E^direct,
//!
//!   B⁽⁰⁾ = M,   B⁽ᵏ⁺¹⁾ = S + ρ F B⁽ᵏ⁾,
//!
//! so that B⁽ᵏ⁾ is the light that leaves after at most k reflections and E^direct + F B⁽ᵏ⁾ what then arrives: k sweeps of Jacobi's
//! iteration, begun from the emission and not from S, which has been reflected once. For M = 0 they begin from darkness.
//!
//! Source: J. T. Kajiya, "The rendering equation", SIGGRAPH 1986, section 2 (the series by the number of scatterings). Exact for any F;
//! the residual of B⁽ᵏ⁾ is the light of the next reflection, which the partial sum leaves out. Cost: a gather a sweep; sweeps end
//! early when they change nothing any more.

use super::{Outcome, Solution, System};
use luxel_scenes::{Exitance, Irradiance, Radiosity, Rgb};

/// Light after at most `reflections` reflections of what is emitted and of direct light. `visit` is called with F B⁽ᵏ⁾ for k = 0, 1,
/// … `reflections`, or fewer where all further ones are the same to rounding.
///
/// The outcome is [`Outcome::Converged`] where the series has ended, [`Outcome::IterationLimit`] where light is left out; residual
/// and error bound of the solution tell how much, in W/m².
///
/// # Panics
/// When there is not one emission for each unknown.
pub fn neumann(
    system: &System,
    emission: &[Exitance],
    reflections: u32,
    mut visit: impl FnMut(&[Irradiance]),
) -> Solution {
    assert_eq!(
        emission.len(),
        system.len(),
        "one emission for each unknown"
    );
    let mut radiosity: Vec<Radiosity> = emission.iter().map(|m| Radiosity(m.0)).collect();
    let mut irradiance = vec![Irradiance::ZERO; system.len()];
    let mut history: Vec<Rgb> = Vec::new();
    let outcome = loop {
        system.transport().gather(&radiosity, &mut irradiance);
        visit(&irradiance);
        let residual = system.residual(&radiosity, &irradiance).largest;
        history.push(residual);
        let brightest = radiosity
            .iter()
            .fold(Rgb::ZERO, |largest, b| largest.max(b.0));
        if residual.cmple(brightest * f64::EPSILON).all() {
            break Outcome::Converged;
        }
        if history.len() as u64 > u64::from(reflections) {
            break Outcome::IterationLimit;
        }
        let next = system.source().iter().zip(system.reflectance());
        for ((b, (&s, &rho)), &e) in radiosity.iter_mut().zip(next).zip(&irradiance) {
            *b = s + rho * e;
        }
    };
    let residual = history.last().copied().unwrap_or(Rgb::ZERO);
    Solution {
        radiosity,
        irradiance,
        outcome,
        iterations: history.len() - 1,
        residual,
        error_bound: system.error_bound(residual),
        residual_history: history,
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Ledger, source};
    use super::*;
    use crate::transport::Dense;
    use luxel_scenes::Reflectance;

    const RHO: f64 = 0.5;

    /// Five patches that each see the others equally, of emission 1 and as much direct light.
    fn sums(reflections: u32, direct: f64) -> (Vec<f64>, Solution, Ledger) {
        let entries = (0..25)
            .map(|k| if k % 6 == 0 { 0.0 } else { 0.25 })
            .collect();
        let dense = Dense::new(5, entries).expect("a valid matrix");
        let rho = [Reflectance::splat(RHO); 5];
        let emission = [Exitance::splat(1.0); 5];
        let direct = [Irradiance::splat(direct); 5];
        let s = source(&emission, &rho, &direct);
        let system = System::new(&dense, &[1.0; 5], &rho, &s).expect("a valid system");
        let mut visited = Vec::new();
        let solution = neumann(&system, &emission, reflections, |e| visited.push(e[3].0.x));
        let ledger = Ledger::new(&system, &solution, &emission, &direct);
        (visited, solution, ledger)
    }

    /// In the furnace F B⁽ᵏ⁾ = Σ_{j ≤ k} ρ^j, exact in binary for ρ = 1/2. With direct light D besides, each reflection adds ρ^j D.
    #[test]
    fn each_sweep_adds_a_reflection() {
        let (plain, ..) = sums(4, 0.0);
        assert_eq!(plain, [1.0, 1.5, 1.75, 1.875, 1.9375]);
        let (lit, solution, ledger) = sums(3, 2.0);
        assert_eq!(lit, [1.0, 2.5, 3.25, 3.625]);
        assert_eq!(solution.outcome, Outcome::IterationLimit);
        // The fourth reflection of 3 W/m² that arrive first, over five m²: what the ledger has left.
        let left = Rgb::splat(3.0 * RHO.powi(4));
        assert_eq!(solution.residual, left);
        assert_eq!(ledger.residual.0, 5.0 * left);
        assert_eq!(ledger.imbalance(), Rgb::ZERO);
    }

    #[test]
    fn it_ends_with_the_series() {
        let (visited, solution, _) = sums(u32::MAX, 0.0);
        assert_eq!(solution.outcome, Outcome::Converged);
        assert!(visited.len() < 60, "ρ^53 is below rounding");
        assert!((visited.last().expect("sums") - 2.0).abs() < 1e-15);
    }
}
