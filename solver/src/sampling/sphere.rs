//! Directions of the sphere and of the hemisphere around +z with uniform density.
//!
//! Equation: z uniform (Archimedes), azimuth and radius by the concentric disk map:
//! z = 1 − r², (x, y) = d √(2 − r²) for d on the disk, |d| = r. p = 1/(2π) on the hemisphere;
//! the sphere folds the square into two hemispheres, p = 1/(4π), per solid angle.
//!
//! Source: P. Shirley, K. Chiu, "A low distortion map between disk and square", 1997, §3
//! (hemisphere).
//!
//! Validity: u in [0, 1)². Cost: a disk point and a square root.

use super::disk;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// The direction of the upper hemisphere for `u` in the unit square.
#[inline]
pub fn sample_hemisphere(u: [f32; 2]) -> Vec3 {
    let [x, y] = disk::sample(u);
    let r = (2.0 * u[0] - 1.0).abs().max((2.0 * u[1] - 1.0).abs());
    let scale = (2.0 - r * r).max(0.0).sqrt();
    Vec3::new(x * scale, y * scale, ((1.0 - r) * (1.0 + r)).max(0.0))
}

/// Density per solid angle (1/sr) on the hemisphere: 1/(2π).
#[inline]
pub fn pdf_hemisphere() -> f32 {
    0.5 * FRAC_1_PI
}

/// The point of the unit square that [`sample_hemisphere`] maps to `direction` (unit, z ≥ 0).
pub fn invert_hemisphere(direction: Vec3) -> [f32; 2] {
    // |d|/|(x, y)| = 1/√(2 − r²) = 1/√(1 + z).
    let scale = 1.0 / (1.0 + direction.z).sqrt();
    disk::invert([direction.x * scale, direction.y * scale])
}

/// The direction of the sphere for `u` in the unit square: the lower half of u₀ is the upper
/// hemisphere.
#[inline]
pub fn sample_sphere(u: [f32; 2]) -> Vec3 {
    if u[0] < 0.5 {
        sample_hemisphere([2.0 * u[0], u[1]])
    } else {
        // Mirrored, so that both halves meet at the horizon where u₀ = ½.
        let w = sample_hemisphere([2.0 - 2.0 * u[0], u[1]]);
        Vec3::new(w.x, w.y, -w.z)
    }
}

/// Density per solid angle (1/sr) on the sphere: 1/(4π).
#[inline]
pub fn pdf_sphere() -> f32 {
    0.25 * FRAC_1_PI
}

/// The point of the unit square that [`sample_sphere`] maps to `direction` (unit).
pub fn invert_sphere(direction: Vec3) -> [f32; 2] {
    let [u, v] = invert_hemisphere(Vec3::new(direction.x, direction.y, direction.z.abs()));
    if direction.z >= 0.0 {
        [0.5 * u, v]
    } else {
        [1.0 - 0.5 * u, v]
    }
}
