//! What of a ray the steps need, computed once: the values of `Slabs` and `Shear`, by vector
//! instructions.

use super::memory::{self, PLANE};
use crate::bvh::ray::Ray;
use crate::bvh::slabs::{LEAST_COMPONENT, RECIPROCAL_OF_LESS};
use std::arch::x86_64::*;

/// A ray for the node step and the leaf step. Of all arrays the fourth component is unused.
#[derive(Clone, Copy, Default)]
#[repr(C, align(32))]
pub(super) struct Setup {
    /// Origin and direction in f64.
    pub(super) exact_origin: [f64; 4],
    pub(super) exact_direction: [f64; 4],
    pub(super) origin: [f32; 4],
    /// The reciprocals of the direction's components, negated: (o − p) · −1/d is (p − o) · 1/d to the bit,
    /// and the processor subtracts from a register what it reads.
    pub(super) minus_reciprocal: [f32; 4],
    /// Origin in the sheared order of axes.
    pub(super) shear_origin: [f32; 4],
    /// The shear of x and of y.
    pub(super) scale: [f32; 4],
    /// Byte offsets of the planes that the ray enters through, and of those that it leaves through.
    pub(super) near: [u32; 4],
    pub(super) far: [u32; 4],
    /// The sheared order of axes, each below 3.
    pub(super) axes: [u32; 4],
    /// Nearest distance that counts, not −0.
    pub(super) tmin: f32,
}

/// Orders of axes by the longest one; from 3 on for rays that run against it.
const AXES: [[u32; 4]; 6] = [
    [1, 2, 0, 3],
    [2, 0, 1, 3],
    [0, 1, 2, 3],
    [2, 1, 0, 3],
    [0, 2, 1, 3],
    [1, 0, 2, 3],
];

impl Setup {
    #[inline]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    pub(super) fn new(ray: &Ray) -> Self {
        let [ox, oy, oz] = ray.origin.to_array();
        let [dx, dy, dz] = ray.direction.to_array();
        let origin = _mm_setr_ps(ox, oy, oz, 0.0);
        let direction = _mm_setr_ps(dx, dy, dz, 1.0);
        let sign = _mm_set1_ps(-0.0);
        let magnitude = _mm_andnot_ps(sign, direction);
        let small = _mm_cmplt_ps(magnitude, _mm_set1_ps(LEAST_COMPONENT));
        let large = _mm_or_ps(_mm_set1_ps(RECIPROCAL_OF_LESS), _mm_and_ps(sign, direction));
        let reciprocal = _mm_div_ps(_mm_set1_ps(1.0), direction);
        let reciprocal = _mm_blendv_ps(reciprocal, large, small);
        let negative = _mm_srli_epi32::<31>(_mm_castps_si128(reciprocal));
        let plane = (PLANE as u32).cast_signed();
        let near = _mm_add_epi32(
            _mm_setr_epi32(0, 2 * plane, 4 * plane, 0),
            _mm_mullo_epi32(negative, _mm_set1_epi32(plane)),
        );

        let [mx, my, mz] = ray.direction.abs().to_array();
        let x_is_longest = mx >= my && mx >= mz;
        let longest = if x_is_longest {
            0
        } else {
            2 - usize::from(my >= mz)
        };
        let backwards = [dx, dy, dz][longest] < 0.0;
        let axes = &AXES[longest + 3 * usize::from(backwards)];
        let order = memory::load_axes(axes);
        let sheared_direction = _mm_permutevar_ps(direction, order);
        let shear_origin = _mm_permutevar_ps(origin, order);
        let along = _mm_shuffle_ps::<0b10_10_10_10>(sheared_direction, sheared_direction);
        let scale = _mm_div_ps(sheared_direction, along);

        let mut setup = Self {
            exact_origin: [0.0; 4],
            exact_direction: [0.0; 4],
            origin: [ox, oy, oz, 0.0],
            minus_reciprocal: [0.0; 4],
            shear_origin: [0.0; 4],
            scale: [0.0; 4],
            near: [0; 4],
            far: [0; 4],
            axes: *axes,
            tmin: ray.tmin + 0.0,
        };
        memory::store_f64(&mut setup.exact_origin, _mm256_cvtps_pd(origin));
        memory::store_f64(&mut setup.exact_direction, _mm256_cvtps_pd(direction));
        memory::store(&mut setup.minus_reciprocal, _mm_xor_ps(sign, reciprocal));
        memory::store(&mut setup.shear_origin, shear_origin);
        memory::store(&mut setup.scale, scale);
        memory::store_u32(&mut setup.near, near);
        // The two planes of an axis differ in one bit.
        memory::store_u32(&mut setup.far, _mm_xor_si128(near, _mm_set1_epi32(plane)));
        setup
    }
}
