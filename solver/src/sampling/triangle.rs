//! A triangle, uniformly by area.
//!
//! Equation: the square is folded along its diagonal: for u₀ < u₁, (b₀, b₁) = (u₀/2, u₁ − u₀/2),
//! else (u₀ − u₁/2, u₁/2); b₂ = 1 − b₀ − b₁. p = 1/A per area.
//!
//! Source: E. Heitz, "A low-distortion map between triangle and square", technical report,
//! HAL 02073696, 2019.
//!
//! Validity: u in [0, 1)²; barycentrics are never negative. Cost: a few additions.

/// Barycentric coordinates for `u` in the unit square. Neighbourhoods are kept, so that strata of
/// the square are compact in the triangle.
#[inline]
pub fn sample(u: [f64; 2]) -> [f64; 3] {
    let (b0, b1) = if u[0] < u[1] {
        let b0 = 0.5 * u[0];
        (b0, u[1] - b0)
    } else {
        let b1 = 0.5 * u[1];
        (u[0] - b1, b1)
    };
    [b0, b1, (1.0 - b0 - b1).max(0.0)]
}

/// Density per area (1/m²) on a triangle of the given area (m²).
#[inline]
pub fn pdf(area: f64) -> f64 {
    1.0 / area
}

/// The point of the unit square that [`sample`] maps to `barycentric`.
pub fn invert(barycentric: [f64; 3]) -> [f64; 2] {
    let [b0, b1, _] = barycentric;
    if b0 < b1 {
        [2.0 * b0, b1 + b0]
    } else {
        [b0 + b1, 2.0 * b1]
    }
}
