//! Rays grouped by the longest components of their directions, and eight rays as columns of lanes.

use super::memory;
use super::order::COMPACTION;
use crate::bvh::ray::Ray;
use std::arch::x86_64::*;

/// Rays of one test.
pub(super) const LANES: usize = 8;

/// Rays that are grouped at a time: enough that groups which are not full are few, and little enough
/// to stay in the nearest cache.
pub(super) const CHUNK: usize = 512;

/// The numbers of a chunk's rays by the axis of the longest component.
pub(super) struct Groups {
    pub(super) rays: [[u32; CHUNK + LANES]; 3],
    pub(super) counts: [usize; 3],
}

impl Groups {
    pub(super) const EMPTY: Self = Self {
        rays: [[0; CHUNK + LANES]; 3],
        counts: [0; 3],
    };

    /// Groups the rays of a chunk. Behind the last of a group stand numbers of other rays.
    #[inline]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    pub(super) fn sort(&mut self, rays: &[Ray]) {
        self.counts = [0; 3];
        let sign = _mm256_set1_ps(-0.0);
        for first in (0..rays.len()).step_by(LANES) {
            let count = (rays.len() - first).min(LANES);
            let [_, _, _, _, x, y, z, _] = columns(std::array::from_fn(|lane| {
                &rays[first + lane.min(count - 1)]
            }));
            let [x, y, z] = [
                _mm256_andnot_ps(sign, x),
                _mm256_andnot_ps(sign, y),
                _mm256_andnot_ps(sign, z),
            ];
            let x_is_longest = _mm256_and_ps(
                _mm256_cmp_ps::<_CMP_GE_OQ>(x, y),
                _mm256_cmp_ps::<_CMP_GE_OQ>(x, z),
            );
            let y_is_longer = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_GE_OQ>(y, z)) as usize;
            let valid = (1 << count) - 1;
            let x_mask = _mm256_movemask_ps(x_is_longest) as usize & valid;
            let y_mask = y_is_longer & !x_mask & valid;
            let z_mask = !(x_mask | y_mask) & valid;
            let numbers = _mm256_add_epi32(
                _mm256_set1_epi32((first as u32).cast_signed()),
                _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7),
            );
            for (axis, mask) in [x_mask, y_mask, z_mask].into_iter().enumerate() {
                let sorted = _mm256_permutevar8x32_epi32(numbers, COMPACTION.order(mask));
                let group = &mut self.rays[axis][self.counts[axis]..];
                memory::store_eight(group, sorted);
                self.counts[axis] += mask.count_ones() as usize;
            }
        }
    }
}

/// The components of eight rays: origin, tmin, direction, tmax.
#[inline]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
pub(super) fn columns(rays: [&Ray; LANES]) -> [__m256; LANES] {
    let [a, b, c, d] = [
        memory::load_ray(rays[0]),
        memory::load_ray(rays[1]),
        memory::load_ray(rays[2]),
        memory::load_ray(rays[3]),
    ];
    let [e, f, g, h] = [
        memory::load_ray(rays[4]),
        memory::load_ray(rays[5]),
        memory::load_ray(rays[6]),
        memory::load_ray(rays[7]),
    ];
    let [front, back] = [four_columns([a, b, c, d]), four_columns([e, f, g, h])];
    [
        _mm256_permute2f128_ps::<0x20>(front[0], back[0]),
        _mm256_permute2f128_ps::<0x20>(front[1], back[1]),
        _mm256_permute2f128_ps::<0x20>(front[2], back[2]),
        _mm256_permute2f128_ps::<0x20>(front[3], back[3]),
        _mm256_permute2f128_ps::<0x31>(front[0], back[0]),
        _mm256_permute2f128_ps::<0x31>(front[1], back[1]),
        _mm256_permute2f128_ps::<0x31>(front[2], back[2]),
        _mm256_permute2f128_ps::<0x31>(front[3], back[3]),
    ]
}

/// The transposes of the lower and of the upper halves.
#[inline]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn four_columns([a, b, c, d]: [__m256; 4]) -> [__m256; 4] {
    let [ab, cd] = [_mm256_unpacklo_ps(a, b), _mm256_unpacklo_ps(c, d)];
    let [ab_high, cd_high] = [_mm256_unpackhi_ps(a, b), _mm256_unpackhi_ps(c, d)];
    [
        _mm256_shuffle_ps::<0b01_00_01_00>(ab, cd),
        _mm256_shuffle_ps::<0b11_10_11_10>(ab, cd),
        _mm256_shuffle_ps::<0b01_00_01_00>(ab_high, cd_high),
        _mm256_shuffle_ps::<0b11_10_11_10>(ab_high, cd_high),
    ]
}
