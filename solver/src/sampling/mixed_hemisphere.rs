//! Directions of the hemisphere around +z, half of them by the cosine and half evenly.
//!
//! Equation: p = (1 + 2 cos θ)/(4π) per solid angle, the mean of cos θ/π and 1/(2π). The height z has the density z + ½ and the
//! distribution (z² + z)/2, so that z = 2v / (½ + √(¼ + 2v)) for v = 1 − r², with r and the azimuth those of the concentric disk.
//!
//! What for: integrals of L and of L cos θ by the same rays. A cosine's weights for the first are π/cos θ, whose square has no
//! finite mean; an even distribution's for the second are noisier than they need be. Here the first are at most 4π, the
//! second at most 4π/3.
//!
//! Source: the mixture after E. Veach, "Robust Monte Carlo methods for light transport simulation", dissertation, Stanford, 1997,
//! §9.2 (the balance heuristic), as one warp so that points stay as even as they are. Validity: u in [0, 1)². Cost: a disk point and two square
//! roots.

use super::disk;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// The direction for `u` in the unit square, in a frame whose z is the normal.
#[inline]
pub fn sample(u: [f32; 2]) -> Vec3 {
    let [x, y] = disk::sample(u);
    let r = (2.0 * u[0] - 1.0).abs().max((2.0 * u[1] - 1.0).abs());
    let v = ((1.0 - r) * (1.0 + r)).max(0.0);
    let z = (2.0 * v / (0.5 + (0.25 + 2.0 * v).sqrt())).min(1.0);
    // sin θ / r with r² = (1 − z)(2 + z)/2 and sin² θ = (1 − z)(1 + z): no cancellation near the normal.
    let scale = (2.0 * (1.0 + z) / (2.0 + z)).sqrt();
    Vec3::new(x * scale, y * scale, z)
}

/// Density per solid angle (1/sr) of a direction whose cosine with the normal is `cos_theta`; zero below the horizon.
#[inline]
pub fn pdf(cos_theta: f32) -> f32 {
    if cos_theta < 0.0 {
        0.0
    } else {
        0.25 * FRAC_1_PI * (1.0 + 2.0 * cos_theta)
    }
}

/// The point of the unit square that [`sample`] maps to `direction` (unit, z ≥ 0).
pub fn invert(direction: Vec3) -> [f32; 2] {
    let z = direction.z;
    let scale = (0.5 * (2.0 + z) / (1.0 + z)).sqrt();
    disk::invert([direction.x * scale, direction.y * scale])
}
