//! Orders of convergence and Richardson's extrapolate.
//!
//! *Fit.* For an error e = C x^(−p) the order p is the slope of log e against log x, by least squares.
//!
//! *Richardson.* From a quantity Q on three meshes of sizes h₁ < h₂ < h₃ (fine to coarse), with
//! ε₂₁ = Q₂ − Q₁, ε₃₂ = Q₃ − Q₂, r₂₁ = h₂/h₁, r₃₂ = h₃/h₂, the observed order solves
//!
//! p = |ln|ε₃₂/ε₂₁| + q(p)| / ln r₂₁, q(p) = ln((r₂₁^p − s)/(r₃₂^p − s)), s = sign(ε₃₂/ε₂₁),
//!
//! the extrapolate is Q* = Q₁ + (Q₁ − Q₂)/(r₂₁^p − 1), and the grid convergence index
//! 1.25 |ε₂₁| / (r₂₁^p − 1) is a cautious bound on |Q* − Q₁|.
//!
//! Source: I. B. Celik, U. Ghia, P. J. Roache, C. J. Freitas, H. Coleman, P. E. Raad, "Procedure for
//! estimation and reporting of uncertainty due to discretization in CFD applications", ASME Journal of
//! Fluids Engineering 130(7), 2008. Valid in the asymptotic range: where the differences change sign or
//! grow, or the order is far from that of any method, there is no extrapolate. Cost: nothing.

use serde::Serialize;

/// An order fitted to several errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Fit {
    /// p in e = C x^(−p).
    pub order: f64,
    /// Its standard error from the scatter about the line; `None` for two points.
    pub standard_error: Option<f64>,
    /// Points fitted.
    pub points: usize,
}

/// Least sum of squared distances of ln x from their mean: two sizes a fifth apart. Sizes nearer than that show
/// their scatter and no slope.
const MIN_SPREAD: f64 = 0.02;

/// The order at which errors fall as x grows, from pairs (x, e); pairs that are not positive are left
/// out. `None` for fewer than two different x.
pub fn fit(pairs: impl IntoIterator<Item = (f64, f64)>) -> Option<Fit> {
    let logs: Vec<(f64, f64)> = pairs
        .into_iter()
        .filter(|&(x, e)| x > 0.0 && e > 0.0)
        .map(|(x, e)| (x.ln(), e.ln()))
        .collect();
    let count = logs.len() as f64;
    let mean_x = logs.iter().map(|(x, _)| x).sum::<f64>() / count;
    let mean_y = logs.iter().map(|(_, y)| y).sum::<f64>() / count;
    let spread: f64 = logs.iter().map(|(x, _)| (x - mean_x).powi(2)).sum();
    if logs.len() < 2 || spread < MIN_SPREAD {
        return None;
    }
    let along: f64 = logs.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    let slope = along / spread;
    let scatter: f64 = logs
        .iter()
        .map(|(x, y)| (y - mean_y - slope * (x - mean_x)).powi(2))
        .sum();
    let degrees = logs.len() - 2;
    Some(Fit {
        order: -slope,
        standard_error: (degrees > 0).then(|| (scatter / degrees as f64 / spread).sqrt()),
        points: logs.len(),
    })
}

/// What three meshes say of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Richardson {
    /// Observed order in the mesh size.
    pub order: f64,
    /// The quantity at a mesh size of zero.
    pub extrapolated: f64,
    /// The grid convergence index of the finest mesh, in the unit of the quantity.
    pub uncertainty: f64,
}

/// Why three meshes have no extrapolate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum NotAsymptotic {
    /// The method has no mesh of its own.
    #[error("there is no mesh to refine")]
    NoMesh,
    /// Fewer than three meshes.
    #[error("needs three sizes")]
    TooFew,
    /// The differences change sign.
    #[error("the last three values oscillate")]
    Oscillating,
    /// The differences grow.
    #[error("the last differences grow")]
    Diverging,
    /// The order is not that of a method.
    #[error("the apparent order lies outside 0.3 to 6")]
    Order,
}

/// Orders that a mesh may show: lower, and the extrapolate is further from the finest mesh than all three
/// are from each other; higher, and two meshes agree by chance.
const ORDERS: std::ops::RangeInclusive<f64> = 0.3..=6.0;

/// Extrapolates from the last three pairs (h, Q), coarse to fine.
///
/// # Errors
/// When there are fewer than three, or they are not in the asymptotic range.
pub fn richardson(pairs: &[(f64, f64)]) -> Result<Richardson, NotAsymptotic> {
    let [.., (h3, q3), (h2, q2), (h1, q1)] = *pairs else {
        return Err(NotAsymptotic::TooFew);
    };
    let (e21, e32) = (q2 - q1, q3 - q2);
    let (r21, r32) = ((h2 / h1).ln(), (h3 / h2).ln());
    if r21 <= 0.0 || r32 <= 0.0 {
        return Err(NotAsymptotic::TooFew);
    }
    let ratio = e32 / e21;
    if ratio.is_nan() || ratio <= 0.0 {
        return Err(NotAsymptotic::Oscillating);
    }
    // ln of (r21^p − 1)/(r32^p − 1) falls from ln(r21/r32) to −∞ or grows, slowly against ln r21: the
    // fixed point is found by plain iteration for ratios near each other.
    let mut order = ratio.ln() / r21;
    for _ in 0..200 {
        let grow = |r: f64| (r * order).exp_m1();
        let q = (grow(r21) / grow(r32)).ln();
        let next = if q.is_finite() {
            (ratio.ln() + q) / r21
        } else {
            ratio.ln() / r21
        };
        if (next - order).abs() < 1e-12 {
            break;
        }
        order = 0.5 * (order + next);
    }
    if order <= 0.0 {
        return Err(NotAsymptotic::Diverging);
    }
    if !ORDERS.contains(&order) {
        return Err(NotAsymptotic::Order);
    }
    let step = (q1 - q2) / (r21 * order).exp_m1();
    Ok(Richardson {
        order,
        extrapolated: q1 + step,
        uncertainty: 1.25 * step.abs(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_order_is_found() {
        for order in [0.5, 1.0, 2.0] {
            let pairs = (0..6).map(|k| (2_f64.powi(k), 3.0 * 2_f64.powi(k).powf(-order)));
            let fit = fit(pairs).expect("six points");
            // Exact data: rounding of logarithms.
            assert!((fit.order - order).abs() < 1e-12, "{fit:?}");
            assert!(fit.standard_error.is_some_and(|e| e < 1e-7), "{fit:?}");
        }
    }

    #[test]
    fn scatter_shows_as_a_standard_error() {
        let wobble = [1.1, 0.9, 1.1, 0.9, 1.1];
        let pairs = (0..5).map(|k| (4_f64.powi(k), wobble[k as usize] * 2_f64.powi(-k)));
        let fit = fit(pairs).expect("five points");
        let error = fit.standard_error.expect("five points");
        assert!(
            error > 0.01 && (fit.order - 0.5).abs() < 3.0 * error,
            "{fit:?}"
        );
    }

    #[test]
    fn what_has_no_slope_has_no_order() {
        assert_eq!(fit([(1.0, 1.0)]), None);
        assert_eq!(fit([(2.0, 1.0), (2.0, 0.5)]), None);
        assert_eq!(fit([(1.0, 0.0), (2.0, -1.0)]), None);
    }

    #[test]
    fn extrapolation_finds_limit_and_order_at_any_ratios() {
        for (order, sizes) in [
            (1.0, [4.0, 2.0, 1.0]),
            (2.0, [0.9, 0.6, 0.45]),
            (1.5, [3.0, 1.6, 1.1]),
        ] {
            let pairs = sizes.map(|h: f64| (h, 7.0 - 0.3 * h.powf(order)));
            let found = richardson(&pairs).expect("asymptotic");
            // The iteration ends at 1e-12.
            assert!((found.order - order).abs() < 1e-9, "{found:?}");
            assert!((found.extrapolated - 7.0).abs() < 1e-9, "{found:?}");
            assert!(found.uncertainty >= (7.0 - pairs[2].1).abs(), "{found:?}");
        }
    }

    #[test]
    fn what_is_not_asymptotic_has_no_extrapolate() {
        let at = |q: [f64; 3]| richardson(&[(4.0, q[0]), (2.0, q[1]), (1.0, q[2])]);
        assert_eq!(at([1.0, 2.0, 1.5]), Err(NotAsymptotic::Oscillating));
        assert_eq!(at([1.0, 1.1, 1.5]), Err(NotAsymptotic::Diverging));
        assert_eq!(at([1.0, 1.5, 1.500_01]), Err(NotAsymptotic::Order));
        assert_eq!(at([1.0, 1.0, 1.0]), Err(NotAsymptotic::Oscillating));
        assert_eq!(richardson(&[(1.0, 1.0)]), Err(NotAsymptotic::TooFew));
    }
}
