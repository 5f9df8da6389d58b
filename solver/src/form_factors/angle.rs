//! The angle between two vectors over its sine, without inverse functions.
//!
//! Γ/sin Γ = arccos(c)/√(1 − c²) with c = cos Γ has no singularity but at c = −1: on 0 ≤ c ≤ 1 a rational
//! function of degrees 5 and 6, fitted by the exchange algorithm (E. Y. Remez, 1934; of rational functions: W. J. Cody,
//! "A survey of practical rational and polynomial approximation of functions", SIAM Review 12, 1970), has a
//! relative error of 1.4e-16. All its coefficients are positive, so that rounding adds no more than 5e-16.
//! That such a function serves area lights: E. Heitz, J. Dupuy, S. Hill, D. Neubelt, "Real-time
//! polygonal-light shading with linearly transformed cosines", SIGGRAPH 2016. Cost: a division; a third of an
//! arc tangent.

/// Coefficients of c⁰, c¹, ….
const NUMERATOR: [f64; 6] = [
    1.570_796_326_794_896_4,
    3.476_745_514_948_734_5,
    2.684_588_277_252_139_5,
    0.856_064_929_892_186_2,
    0.102_298_486_638_453_98,
    0.002_957_363_979_254_184_3,
];
const DENOMINATOR: [f64; 7] = [
    1.0,
    2.849_984_710_674_198_6,
    3.023_418_595_729_167_9,
    1.469_176_745_127_612_6,
    0.323_293_986_329_777_7,
    0.027_074_660_622_148_143,
    0.000_502_201_022_760_789_5,
];

/// Γ/sin Γ for a `cosine` of Γ between 0 and 1.
#[inline]
pub(super) fn angle_over_sine(cosine: f64) -> f64 {
    let [p0, p1, p2, p3, p4, p5] = NUMERATOR;
    let [q0, q1, q2, q3, q4, q5, q6] = DENOMINATOR;
    // Pairs of terms shorten the chain of operations that wait for each other.
    let c2 = cosine * cosine;
    let numerator = (p0 + p1 * cosine) + c2 * ((p2 + p3 * cosine) + c2 * (p4 + p5 * cosine));
    let denominator =
        (q0 + q1 * cosine) + c2 * ((q2 + q3 * cosine) + c2 * ((q4 + q5 * cosine) + c2 * q6));
    numerator / denominator
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_arc_over_the_sine() {
        for k in 0..=10_000 {
            let angle = f64::from(k) / 10_000.0 * std::f64::consts::FRAC_PI_2;
            let (sine, cosine) = angle.sin_cos();
            let exact = if k == 0 { 1.0 } else { angle / sine };
            // 5e-16 of its own, rounding of the cosine (1e-16, slope at most one third) and of the quotient.
            let error = angle_over_sine(cosine.max(0.0)) / exact - 1.0;
            assert!(error.abs() < 1e-15, "{angle}: {error}");
        }
    }
}
