//! The unit disk, uniformly, by the concentric map.
//!
//! Equation: in the quadrant where |a| > |b|, r = a and φ = (π/4)(b/a); else r = b and
//! φ = π/2 − (π/4)(a/b), for (a, b) = 2u − 1. p = 1/π per area.
//!
//! Source: P. Shirley, K. Chiu, "A low distortion map between disk and square", Journal of
//! Graphics Tools 2(3), 1997; without branches on the four quadrants as D. Cline there.
//!
//! Validity: u in [0, 1)²; error of a coordinate below 2e-7. Sine and cosine are Taylor sums
//! over [−π/4, π/4], so that results are the same on every machine. Cost: one division, no call.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_4};

/// The point of the disk for `u` in the unit square. Areas and neighbourhoods are kept.
#[inline]
pub fn sample(u: [f32; 2]) -> [f32; 2] {
    let a = 2.0 * u[0] - 1.0;
    let b = 2.0 * u[1] - 1.0;
    let flat = a.abs() > b.abs();
    let r = std::hint::select_unpredictable(flat, a, b);
    let minor = std::hint::select_unpredictable(flat, b, a);
    // The centre of the square is the only place where r is zero.
    let ratio = if r == 0.0 { 0.0 } else { minor / r };
    let (sin, cos) = sin_cos_octant(ratio * FRAC_PI_4);
    let (along, across) = (r * cos, r * sin);
    // Selected, not branched for: half of the branches would be mispredicted.
    [
        std::hint::select_unpredictable(flat, along, across),
        std::hint::select_unpredictable(flat, across, along),
    ]
}

/// Density per area of the unit disk: 1/π.
#[inline]
pub fn pdf() -> f32 {
    FRAC_1_PI
}

/// The point of the unit square that [`sample`] maps to `point`, which lies in the unit disk.
pub fn invert(point: [f32; 2]) -> [f32; 2] {
    let [x, y] = point;
    let radius = x.hypot(y);
    let (a, b) = if x.abs() > y.abs() {
        let a = radius.copysign(x);
        (a, a * (y / x).atan() / FRAC_PI_4)
    } else if y == 0.0 {
        (0.0, 0.0)
    } else {
        let b = radius.copysign(y);
        (b * (x / y).atan() / FRAC_PI_4, b)
    };
    [0.5 * (a + 1.0), 0.5 * (b + 1.0)]
}

/// Sine and cosine of an angle in [−π/4, π/4] radians by Taylor sums, whose first missing terms
/// are below 2e-9 and 3e-9: less than a tenth of the rounding of f32.
#[inline]
fn sin_cos_octant(angle: f32) -> (f32, f32) {
    let s = angle * angle;
    let sin = 1.0
        - s * (1.0 / 6.0)
            * (1.0 - s * (1.0 / 20.0) * (1.0 - s * (1.0 / 42.0) * (1.0 - s * (1.0 / 72.0))));
    let cos = 1.0
        - s * 0.5
            * (1.0
                - s * (1.0 / 12.0)
                    * (1.0
                        - s * (1.0 / 30.0) * (1.0 - s * (1.0 / 56.0) * (1.0 - s * (1.0 / 90.0)))));
    (angle * sin, cos)
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "these values are exact by construction")]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_match_double_precision() {
        for i in -1000..=1000 {
            let angle = FRAC_PI_4 * i as f32 / 1000.0;
            let (sin, cos) = sin_cos_octant(angle);
            let exact = f64::from(angle);
            // Two roundings of f32 near 1.
            assert!((f64::from(sin) - exact.sin()).abs() < 1.2e-7, "sin {angle}");
            assert!((f64::from(cos) - exact.cos()).abs() < 1.2e-7, "cos {angle}");
        }
    }

    #[test]
    fn corners_and_centre() {
        assert_eq!(sample([0.5, 0.5]), [0.0, 0.0]);
        let h = std::f32::consts::FRAC_1_SQRT_2;
        for (u, p) in [
            ([0.0, 0.0], [-h, -h]),
            ([1.0, 0.0], [h, -h]),
            ([0.0, 1.0], [-h, h]),
            ([0.0, 0.5], [-1.0, 0.0]),
            ([0.5, 1.0], [0.0, 1.0]),
        ] {
            let q = sample(u);
            assert!(
                (q[0] - p[0]).abs() < 2e-7 && (q[1] - p[1]).abs() < 2e-7,
                "{u:?} gives {q:?}"
            );
        }
    }
}
