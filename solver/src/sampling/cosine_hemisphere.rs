//! Directions of the hemisphere around +z with density cos θ / π.
//!
//! Equation: (x, y) uniform on the unit disk, z = √(1 − x² − y²); p = cos θ / π per solid angle.
//!
//! Source: N. Malley's method, in P. Shirley, "Nonuniform random point sets via warping", Graphics
//! Gems III, 1992; the disk by the concentric map ([`super::disk`]).
//!
//! Validity: u in [0, 1)²; directions have unit length to 1e-7. z is computed as
//! √((1 − r)(1 + r)) and is never negative, but it is exactly 0 on the border of the square.
//! Cost: a disk point and a square root.

use super::disk;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// The direction for `u` in the unit square, in a frame whose z is the normal.
#[inline]
pub fn sample(u: [f32; 2]) -> Vec3 {
    let [x, y] = disk::sample(u);
    // The radius on the disk is that of the square in the maximum norm: no cancellation.
    let r = (2.0 * u[0] - 1.0).abs().max((2.0 * u[1] - 1.0).abs());
    Vec3::new(x, y, ((1.0 - r) * (1.0 + r)).max(0.0).sqrt())
}

/// Density per solid angle (1/sr) of a direction whose cosine with the normal is `cos_theta`;
/// zero below the horizon.
#[inline]
pub fn pdf(cos_theta: f32) -> f32 {
    cos_theta.max(0.0) * FRAC_1_PI
}

/// The point of the unit square that [`sample`] maps to `direction` (unit, z ≥ 0).
pub fn invert(direction: Vec3) -> [f32; 2] {
    disk::invert([direction.x, direction.y])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_unit_and_above_the_horizon() {
        for i in 0..=64 {
            for j in 0..=64 {
                let w = sample([i as f32 / 64.0, j as f32 / 64.0]);
                assert!((w.length() - 1.0).abs() < 3e-7, "length {}", w.length());
                assert!(w.z >= 0.0, "below the horizon: {w}");
            }
        }
    }
}
