//! How much of the scatter between solutions is theirs, and how much gather rays would lessen.
//!
//! Each ray of a receiver meets patches of which every solution has its own noise. With n rays the means over them scatter
//! between solutions by
//!
//!   Var = σ_s² + σ_gs²/n,
//!
//! where σ_s² is the variance of the light that solutions show on average over all directions, and σ_gs² that of single patches about
//! it, the interaction. The first falls with the patches and their rays, the second with n: fine meshes looked up by few rays
//! have hardly anything else. The rays of two halves meet different patches, so that the deviations of a solution
//! in both multiply to σ_s² on average.
//!
//! Source: S. R. Searle, G. Casella, C. E. McCulloch, "Variance Components", 1992 (crossed effects). Unbiased but for
//! what the halves of one Sobol' sequence have in common. Cost: O(receivers).

use super::tally::Tally;
use luxel_scenes::Rgb;

/// The share of σ_s² in the variance between solutions of all receivers together, from 0 to 1, from their first rays and from all
/// rays, the first among them; 1 where nothing scatters, or no further rays tell.
///
/// # Panics
/// When they are not as many receivers, or have fewer rays than at first.
pub(crate) fn share_of_solutions(first: &[Tally], all: &[Tally]) -> f64 {
    assert_eq!(first.len(), all.len(), "the same receivers");
    let (mut products, mut squares) = (0.0, 0.0);
    for (first, all) in first.iter().zip(all) {
        let solutions = usize::from(all.solutions);
        let further = f64::from(all.rays - first.rays);
        if further == 0.0 {
            continue;
        }
        let of_first = deviations(&first.by_solution[..solutions]);
        let of_all = deviations(&all.by_solution[..solutions]);
        for (sum, of_all) in of_first.zip(of_all) {
            let mean = sum / f64::from(first.rays);
            let of_further = (of_all - sum) / further;
            let of_all = of_all / f64::from(all.rays);
            products += (mean * of_further).element_sum();
            squares += (of_all * of_all).element_sum();
        }
    }
    if squares > 0.0 {
        (products / squares).clamp(0.0, 1.0)
    } else {
        1.0
    }
}

/// How values differ from their mean.
fn deviations(values: &[Rgb]) -> impl Iterator<Item = Rgb> {
    let mean = values.iter().sum::<Rgb>() / values.len().max(1) as f64;
    values.iter().map(move |&value| value - mean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gather::MAX_REPLICATES;
    use crate::sampling::Stage;
    use crate::sampling::hash::uniform;

    /// Tallies whose solutions differ by `own` everywhere and by `single` in each half of the rays.
    fn share(own: f64, single: f64) -> f64 {
        const RECEIVERS: u64 = 4000;
        let noise = |receiver, k| uniform(7, Stage::CHOICE, receiver, k) - 0.5;
        let (mut first, mut all) = (Vec::new(), Vec::new());
        for receiver in 0..RECEIVERS {
            let half = |which: u64| {
                std::array::from_fn(|s| {
                    let s = s as u64;
                    Rgb::splat(
                        1.0 + own * noise(receiver, s)
                            + single * noise(receiver, 8 + 4 * which + s),
                    )
                })
            };
            let [a, b]: [[Rgb; MAX_REPLICATES]; 2] = [half(0), half(1)];
            let tally = |rays, by_solution| Tally {
                by_solution,
                rays,
                solutions: MAX_REPLICATES as u8,
                ..Tally::default()
            };
            first.push(tally(1, a));
            all.push(tally(2, std::array::from_fn(|s| a[s] + b[s])));
        }
        share_of_solutions(&first, &all)
    }

    /// Half of the variance of single rays is left in the mean of two halves: the shares are own²/(own² + single²/2).
    /// Each receiver adds 3 degrees of freedom to the products, whose relative standard deviation is at most
    /// √(2 · 3 · 4000)/(3 · 4000) = 1.3 % of the squares: four of these.
    #[test]
    fn the_noise_of_solutions_is_told_from_that_of_rays() {
        let expected = |own: f64, single: f64| own * own / (own * own + 0.5 * single * single);
        for (own, single) in [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (0.3, 1.0)] {
            let share = share(own, single);
            let expected = expected(own, single);
            assert!(
                (share - expected).abs() < 0.052,
                "{own} {single}: {share} for {expected}"
            );
        }
    }

    #[test]
    fn without_scatter_all_is_that_of_solutions() {
        assert_eq!(share_of_solutions(&[], &[]).to_bits(), 1.0_f64.to_bits());
        assert_eq!(share(0.0, 0.0).to_bits(), 1.0_f64.to_bits());
    }
}
