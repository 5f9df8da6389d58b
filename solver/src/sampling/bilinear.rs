//! The unit square with a bilinear density, given its values at the corners.
//!
//! Equation: p(x, y) ∝ lerp(y, lerp(x, w₀, w₁), lerp(x, w₂, w₃)). The marginal in y is linear,
//! p(y) ∝ lerp(y, w₀ + w₁, w₂ + w₃), and so is p(x | y). A linear density a → b on [0, 1] is
//! inverted as x = u (a + b) / (a + √lerp(u, a², b²)).
//!
//! Source: M. Pharr, W. Jakob, G. Humphreys, "Physically Based Rendering", 4th edition, MIT
//! Press, 2023, §2.3.2 (linear) and §A.5.2 (bilinear).
//!
//! Validity: corner values finite and not negative, not all zero. Cost: two square roots.

/// A point of the unit square for `u`, with density proportional to the bilinear interpolation of
/// `corners`: the values at (0, 0), (1, 0), (0, 1), (1, 1).
#[inline]
pub fn sample(u: [f64; 2], corners: [f64; 4]) -> [f64; 2] {
    let [w0, w1, w2, w3] = corners;
    let y = sample_linear(u[1], w0 + w1, w2 + w3);
    let x = sample_linear(u[0], lerp(y, w0, w2), lerp(y, w1, w3));
    [x, y]
}

/// Density of [`sample`] per unit area of the square, at `point`.
#[inline]
pub fn pdf(point: [f64; 2], corners: [f64; 4]) -> f64 {
    let [w0, w1, w2, w3] = corners;
    let value = lerp(point[1], lerp(point[0], w0, w1), lerp(point[0], w2, w3));
    4.0 * value / (w0 + w1 + w2 + w3)
}

/// The `u` that [`sample`] maps to `point`.
pub fn invert(point: [f64; 2], corners: [f64; 4]) -> [f64; 2] {
    let [w0, w1, w2, w3] = corners;
    [
        invert_linear(point[0], lerp(point[1], w0, w2), lerp(point[1], w1, w3)),
        invert_linear(point[1], w0 + w1, w2 + w3),
    ]
}

/// A number in [0, 1] with density proportional to a (1 − x) + b x.
#[inline]
fn sample_linear(u: f64, a: f64, b: f64) -> f64 {
    if u <= 0.0 {
        // Also the only u at which the quotient below is 0/0, for a = 0.
        return 0.0;
    }
    (u * (a + b) / (a + lerp(u, a * a, b * b).sqrt())).min(1.0)
}

/// The distribution function of the linear density at `x`.
fn invert_linear(x: f64, a: f64, b: f64) -> f64 {
    x * (a * (2.0 - x) + b * x) / (a + b)
}

#[inline]
fn lerp(t: f64, a: f64, b: f64) -> f64 {
    (1.0 - t) * a + t * b
}
