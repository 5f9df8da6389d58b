//! ∫∫ ln r over two straight edges: what contour integration of a form factor is made of.
//!
//! For edges x(s) = p + s a, 0 ≤ s ≤ l, and y(t) = q + t b, 0 ≤ t ≤ m, with unit directions,
//! J = ∫₀ˡ∫₀ᵐ ln|x(s) − y(t)| dt ds. Three ways, by position:
//!
//! * **Parallel** lines at distance h: with W'' = ½ ln(u² + h²),
//!   W(u) = ¼(u² − h²) ln(u² + h²) + u h atan(u/h) − ¾u², J is the sum of ±W at the four differences of
//!   ends. Edges of rectangles, and shared edges (h = 0).
//! * Edges from a **common vertex**: ln r is homogeneous up to a logarithm, so that with t = s v
//!   J = lm/2 (ln l + ln m − 1) + ½ l² Φ(m/l) + ½ m² Φ(l/m), Φ(x) = ½∫₀ˣ ln(1 − 2v a·b + v²) dv,
//!   which is elementary. No singularity is left.
//! * **Otherwise** the inner integral is elementary, Σ ± [½ t ln(t² + d²) + d atan(t/d)] over the ends of
//!   y, and the outer one is done by Gauss–Legendre rules on panels. As a function of s it is analytic
//!   except at the two ends of y and where d(s)², the squared distance to the line of y, vanishes: at
//!   s* ± i h/sin α, with s* the place of closest approach of the lines, h their distance and α their
//!   angle. Panels halve until each is at least its own length away from these four points, which
//!   takes a logarithmic number of them however closely the edges run.
//!
//! Source: E. M. Sparrow, "A new and simpler formulation for radiative angle factors", Journal of Heat
//! Transfer 85(2), 1963 (the contour integral); P. Schröder, P. Hanrahan, "On the form factor between
//! two polygons", SIGGRAPH 1993 (why the general case needs dilogarithms, which are avoided here). The
//! three reductions are elementary. Valid for edges in any position; error about 1e-15 of the
//! magnitude returned. Cost: 4 logarithms and arc tangents; 2; or about 15 times 3 per panel.

use super::gauss::{MAX_ORDER, gauss};
use glam::DVec3;

/// Sine of the angle below which directions count as parallel: a few times the rounding of a
/// direction. Larger, the tilt that is ignored shows; smaller, parallel edges are integrated
/// numerically, which only costs time.
const PARALLEL: f64 = 4.0e-15;

/// Panels halve at most this often: a factor 2⁻⁶⁰ in length, below the rounding of an end.
const MAX_DEPTH: u32 = 60;

/// A straight edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    from: DVec3,
    to: DVec3,
    direction: DVec3,
    length: f64,
}

/// An integral and the magnitude of the terms it was summed from, of which it carries the rounding.
#[derive(Clone, Copy, Debug)]
pub(super) struct Estimate {
    pub(super) value: f64,
    pub(super) magnitude: f64,
}

impl Edge {
    /// The edge between two vertices, if they differ.
    pub(super) fn new(from: DVec3, to: DVec3) -> Option<Self> {
        let along = to - from;
        let length = along.length();
        (length > 0.0).then(|| Self {
            from,
            to,
            direction: along / length,
            length,
        })
    }

    /// ∫∫ ln r dx·dy over two edges: the cosine between them times J.
    pub(super) fn exchange(&self, other: &Self) -> Estimate {
        let cosine = self.direction.dot(other.direction);
        if cosine.abs() <= f64::EPSILON {
            return Estimate {
                value: 0.0,
                magnitude: 0.0,
            };
        }
        let sine = self.direction.cross(other.direction).length();
        let j = if sine <= PARALLEL {
            parallel(self, other)
        } else {
            common_vertex(self, other, cosine, sine)
                .unwrap_or_else(|| Outer::new(self, other).integrate(0.0, self.length, 0))
        };
        Estimate {
            value: cosine * j.value,
            magnitude: cosine.abs() * j.magnitude,
        }
    }
}

/// The outer integral over edge x, with what its panels must keep away from.
struct Outer<'a> {
    x: &'a Edge,
    y: &'a Edge,
    /// Place on x of the closest approach of the two lines, in metres from its start.
    approach: f64,
    /// h/sin α in metres.
    branch: f64,
    /// |cos α|, by which the result is multiplied: a small one asks for fewer digits.
    weight: f64,
}

impl<'a> Outer<'a> {
    fn new(x: &'a Edge, y: &'a Edge) -> Self {
        let across = x.direction.cross(y.direction);
        let sine_squared = across.length_squared();
        let offset = y.from - x.from;
        Self {
            x,
            y,
            approach: offset.cross(y.direction).dot(across) / sine_squared,
            branch: offset.dot(across) / sine_squared,
            weight: x.direction.dot(y.direction).abs(),
        }
    }

    /// J over the part of x from `low` to `high`.
    fn integrate(&self, low: f64, high: f64, depth: u32) -> Estimate {
        let half = (high - low) / 2.0;
        let place = low + half;
        let middle = self.x.from + self.x.direction * place;
        let distance = middle
            .distance(self.y.from)
            .min(middle.distance(self.y.to))
            .min((place - self.approach).hypot(self.branch));
        if distance < 2.0 * half && depth < MAX_DEPTH {
            let a = self.integrate(low, place, depth + 1);
            let b = self.integrate(place, high, depth + 1);
            return Estimate {
                value: a.value + b.value,
                magnitude: a.magnitude + b.magnitude,
            };
        }
        let ratio = (distance / half).max(2.0);
        let rho = ratio + (ratio * ratio - 1.0).sqrt();
        let digits = (f64::EPSILON / 8.0 / self.weight).ln() / (-2.0 * rho.ln());
        let order = (digits.ceil().max(1.0) as usize).min(MAX_ORDER);
        let mut sum = Estimate {
            value: 0.0,
            magnitude: 0.0,
        };
        for &(t, w) in gauss(order) {
            let point = self.x.from + self.x.direction * (low + t * (high - low));
            let inner = inner(point, self.y);
            let w = w * (high - low);
            sum.value += w * inner.value;
            sum.magnitude += w * inner.magnitude;
        }
        sum
    }
}

/// ∫₀ᵐ ln|x − y(t)| dt from a point to an edge.
fn inner(point: DVec3, edge: &Edge) -> Estimate {
    let (a, b) = (edge.from - point, edge.to - point);
    let (t0, t1) = (a.dot(edge.direction), b.dot(edge.direction));
    let h = a.cross(edge.direction).length();
    let log = |r: DVec3, t: f64| {
        let r2 = r.length_squared();
        if r2 > 0.0 { 0.5 * t * r2.ln() } else { 0.0 }
    };
    // atan(t1/h) - atan(t0/h), in one.
    let angle = (h * (t1 - t0)).atan2(h * h + t0 * t1);
    let (l0, l1) = (log(a, t0), log(b, t1));
    Estimate {
        value: l1 - l0 - edge.length + h * angle,
        magnitude: l0.abs() + l1.abs() + edge.length,
    }
}

/// J of edges on parallel lines.
fn parallel(p: &Edge, q: &Edge) -> Estimate {
    let axis = p.direction;
    let offset = q.from - p.from;
    let h = offset.cross(axis).length();
    let along = |v: DVec3| (v - p.from).dot(axis);
    let (t0, t1) = (along(q.from), along(q.to));
    // Differences of ends, each from the vertices themselves.
    let (u0, u1) = ((q.from - p.to).dot(axis), (q.to - p.to).dot(axis));
    // For q against p, t runs backwards; the sign of dt goes with it.
    let sign = if t1 >= t0 { 1.0 } else { -1.0 };
    let w = [
        second_antiderivative(t1, h),
        -second_antiderivative(u1, h),
        -second_antiderivative(t0, h),
        second_antiderivative(u0, h),
    ];
    Estimate {
        value: sign * ((w[0] + w[1]) + (w[2] + w[3])),
        magnitude: w.iter().map(|w| w.abs()).sum(),
    }
}

/// W(u) with W'' = ½ ln(u² + h²), h ≥ 0.
fn second_antiderivative(u: f64, h: f64) -> f64 {
    let r2 = u * u + h * h;
    if r2 > 0.0 {
        0.25 * (u - h) * (u + h) * r2.ln() + u * h * u.atan2(h) - 0.75 * u * u
    } else {
        0.0
    }
}

/// J of edges that share a vertex, exactly.
fn common_vertex(p: &Edge, q: &Edge, cosine: f64, sine: f64) -> Option<Estimate> {
    // Turned so that both start at the shared vertex; J does not know directions, the angle does.
    let cosine = if p.from == q.from || p.to == q.to {
        cosine
    } else if p.from == q.to || p.to == q.from {
        -cosine
    } else {
        return None;
    };
    let (l, m) = (p.length, q.length);
    let terms = [
        0.5 * l * m * (l.ln() + m.ln() - 1.0),
        0.5 * l * l * vertex_integral(m / l, cosine, sine),
        0.5 * m * m * vertex_integral(l / m, cosine, sine),
    ];
    Some(Estimate {
        value: terms.iter().sum(),
        magnitude: terms.iter().map(|t| t.abs()).sum::<f64>() + l * l + m * m,
    })
}

/// Φ(x) = ½∫₀ˣ ln(1 − 2vc + v²) dv with c² + s² = 1, s > 0.
fn vertex_integral(x: f64, c: f64, s: f64) -> f64 {
    let w = x - c;
    let r2 = w * w + s * s;
    0.5 * w * r2.ln() - x + s * (w.atan2(s) + c.atan2(s))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edge(from: [f64; 3], to: [f64; 3]) -> Edge {
        Edge::new(DVec3::from(from), DVec3::from(to)).expect("an edge")
    }

    /// J by panels whatever the position.
    fn by_panels(p: &Edge, q: &Edge) -> f64 {
        Outer::new(p, q).integrate(0.0, p.length, 0).value
    }

    #[test]
    fn closed_forms_agree_with_panels() {
        let p = edge([0.0, 0.0, 0.0], [1.3, 0.0, 0.0]);
        for q in [
            // Parallel: beside, collinear beyond, on itself, against.
            edge([0.2, 0.3, 0.1], [0.9, 0.3, 0.1]),
            edge([0.2, 1e-7, 0.0], [0.9, 1e-7, 0.0]),
            edge([2.0, 0.0, 0.0], [3.5, 0.0, 0.0]),
            edge([0.0, 0.0, 0.0], [1.3, 0.0, 0.0]),
            edge([1.3, 0.0, 0.0], [0.0, 0.0, 0.0]),
            edge([1.0, 2.0, 0.0], [-1.0, 2.0, 0.0]),
            // A common vertex at each end, blunt, sharp and of very different length.
            edge([0.0, 0.0, 0.0], [0.5, 0.7, 0.0]),
            edge([0.5, 0.7, 0.2], [0.0, 0.0, 0.0]),
            edge([1.3, 0.0, 0.0], [2.0, 1e-3, 0.0]),
            edge([0.3, 1e-4, 0.0], [1.3, 0.0, 0.0]),
            edge([1.3, 0.0, 0.0], [900.0, 400.0, 5.0]),
        ] {
            let exact = p.exchange(&q);
            let cosine = p.direction.dot(q.direction);
            let panels = cosine * by_panels(&p, &q);
            // Both carry the rounding of their terms; the closed one states its magnitude.
            let tolerance = 8.0 * f64::EPSILON * (exact.magnitude + 1.0);
            assert!(
                (exact.value - panels).abs() <= tolerance,
                "{q:?}: {} against {panels}",
                exact.value
            );
        }
    }

    #[test]
    fn the_order_of_two_edges_does_not_matter() {
        let p = edge([0.0, 0.0, 0.0], [1.0, 0.2, 0.3]);
        for gap in [1.0, 1e-2, 1e-5, 1e-9, 0.0] {
            // Skew, crossing over the middle of p at a distance.
            let middle = DVec3::new(0.4, 0.08, 0.12) + DVec3::Z * gap;
            let q = Edge::new(
                middle - DVec3::new(0.3, -0.5, 0.1),
                middle + DVec3::new(0.6, -1.0, 0.2),
            )
            .expect("an edge");
            let (a, b) = (p.exchange(&q).value, q.exchange(&p).value);
            assert!((a - b).abs() < 1e-14, "gap {gap}: {a} against {b}");
        }
    }
}
