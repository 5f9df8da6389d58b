//! Exchange area by the double contour integral, for polygons that touch or nearly do.
//!
//! S = A₁F₁₂ = 1/(2π) ∮∮ ln r dx·dy over both boundaries: two Stokes transformations of the area
//! integral. Sources: P. Moon, "The Scientific Basis of Illuminating Engineering", 1936;
//! E. M. Sparrow, "A new and simpler formulation for radiative angle factors", Journal of Heat Transfer
//! 85(2), 1963. Valid for planar polygons of any shape that lie entirely in front of each other,
//! touching or not. The integral over each pair of edges is exact (see `edges`), but of order
//! (length)², while S may be much smaller: the error is absolute, about ε times the magnitude that is
//! returned with it. Cost: about 0.1 µs per parallel pair of edges, 1 to 10 µs per skew one.

use super::edges::{Edge, Estimate};
use super::polygon::Polygon;
use std::f64::consts::TAU;

/// S in m² and the magnitude of the terms it was summed from.
pub(super) fn exchange_area(p: &Polygon, q: &Polygon) -> Estimate {
    let edges: Vec<Edge> = q.edges().filter_map(|(a, b)| Edge::new(a, b)).collect();
    let mut sum = Estimate {
        value: 0.0,
        magnitude: 0.0,
    };
    for (a, b) in p.edges() {
        let Some(edge) = Edge::new(a, b) else {
            continue;
        };
        for other in &edges {
            let term = edge.exchange(other);
            sum.value += term.value;
            sum.magnitude += term.magnitude;
        }
    }
    Estimate {
        value: sum.value / TAU,
        magnitude: sum.magnitude / TAU,
    }
}
