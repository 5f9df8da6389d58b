//! Gauss–Legendre rules on [0, 1].
//!
//! Nodes are the zeros of the Legendre polynomial P_n, found by Newton's iteration from
//! cos(π (k + ¾)/(n + ½)). Source: P. J. Davis, P. Rabinowitz, "Methods of Numerical Integration",
//! 2nd edition, 1984, section 2.7. Exact for polynomials of degree 2n − 1; nodes and weights are right
//! to a unit of rounding. Computed once, on first use.

use std::f64::consts::PI;
use std::sync::LazyLock;

/// The largest order kept.
pub(super) const MAX_ORDER: usize = 20;

/// Node and weight.
pub(super) type Node = (f64, f64);

static RULES: LazyLock<Vec<Vec<Node>>> = LazyLock::new(|| (0..=MAX_ORDER).map(rule).collect());

/// The rule of `order` points on [0, 1], by ascending node; its weights sum to 1.
///
/// # Panics
/// When the order is above [`MAX_ORDER`].
pub(super) fn gauss(order: usize) -> &'static [Node] {
    &RULES[order]
}

fn rule(order: usize) -> Vec<Node> {
    let n = order as f64;
    let mut nodes: Vec<Node> = (0..order)
        .map(|k| {
            let mut x = (PI * (k as f64 + 0.75) / (n + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..8 {
                let (value, derivative) = legendre(order, x);
                slope = derivative;
                x -= value / derivative;
            }
            (f64::midpoint(1.0, x), 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect();
    nodes.reverse();
    nodes
}

/// P_n and its derivative.
fn legendre(order: usize, x: f64) -> (f64, f64) {
    let (mut previous, mut value) = (1.0, x);
    for k in 2..=order {
        let k = k as f64;
        (previous, value) = (
            value,
            ((2.0 * k - 1.0) * x * value - (k - 1.0) * previous) / k,
        );
    }
    let n = order as f64;
    (value, n * (previous - x * value) / (1.0 - x * x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_rule_integrates_its_polynomials_exactly() {
        for order in 1..=MAX_ORDER {
            for degree in 0..2 * i32::try_from(order).expect("a small order") {
                let integral: f64 = gauss(order).iter().map(|(x, w)| w * x.powi(degree)).sum();
                let exact = 1.0 / f64::from(degree + 1);
                // Nodes right to a unit, degree times as much in the power.
                let tolerance = f64::EPSILON * f64::from(degree + 8);
                assert!(
                    (integral - exact).abs() <= tolerance,
                    "order {order}, degree {degree}: {integral} against {exact}"
                );
            }
        }
    }
}
