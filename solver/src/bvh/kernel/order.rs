//! Orders of eight lanes: sorted, and packed by a mask.

use std::arch::x86_64::*;

/// For each mask of eight lanes, the numbers of the lanes that are set, in order, and then that of a
/// lane that is not.
pub(super) struct Compaction([[u8; 8]; 256]);

pub(super) static COMPACTION: Compaction = Compaction::new();

impl Compaction {
    const fn new() -> Self {
        let mut table = [[0u8; 8]; 256];
        let mut mask = 0usize;
        while mask < 256 {
            let filler = (!mask & 0xff).trailing_zeros() as u8 % 8;
            let mut lanes = [filler; 8];
            let (mut lane, mut count) = (0, 0);
            while lane < 8 {
                if mask & (1 << lane) != 0 {
                    lanes[count] = lane;
                    count += 1;
                }
                lane += 1;
            }
            table[mask] = lanes;
            mask += 1;
        }
        Self(table)
    }

    /// The lanes of a mask below 256 as indices of a permutation.
    #[inline]
    #[target_feature(enable = "avx2")]
    pub(super) fn order(&self, mask: usize) -> __m256i {
        let lanes = i64::from_le_bytes(self.0[mask % 256]);
        _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(lanes))
    }
}

/// Eight signed integers in descending order, by a bitonic network.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn sorted_descending(v: __m256i) -> __m256i {
    // Each stage compares every lane with a partner and keeps the larger one where the mask is 0.
    let v = keep_larger::<0b1010_1010>(v, _mm256_shuffle_epi32::<0b10_11_00_01>(v));
    let v = keep_larger::<0b1100_1100>(v, _mm256_shuffle_epi32::<0b00_01_10_11>(v));
    let v = keep_larger::<0b1010_1010>(v, _mm256_shuffle_epi32::<0b10_11_00_01>(v));
    let reversed = _mm256_permutevar8x32_epi32(v, _mm256_setr_epi32(7, 6, 5, 4, 3, 2, 1, 0));
    let v = keep_larger::<0b1111_0000>(v, reversed);
    let v = keep_larger::<0b1100_1100>(v, _mm256_shuffle_epi32::<0b01_00_11_10>(v));
    keep_larger::<0b1010_1010>(v, _mm256_shuffle_epi32::<0b10_11_00_01>(v))
}

#[inline]
#[target_feature(enable = "avx2")]
fn keep_larger<const SMALLER: i32>(v: __m256i, partner: __m256i) -> __m256i {
    _mm256_blend_epi32::<SMALLER>(_mm256_max_epi32(v, partner), _mm256_min_epi32(v, partner))
}

/// Four signed integers in descending order, by the first stages of the same network.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn four_descending(v: __m128i) -> __m128i {
    let v = keep_larger_of_four::<0b1010>(v, _mm_shuffle_epi32::<0b10_11_00_01>(v));
    let v = keep_larger_of_four::<0b1100>(v, _mm_shuffle_epi32::<0b00_01_10_11>(v));
    keep_larger_of_four::<0b1010>(v, _mm_shuffle_epi32::<0b10_11_00_01>(v))
}

#[inline]
#[target_feature(enable = "avx2")]
fn keep_larger_of_four<const SMALLER: i32>(v: __m128i, partner: __m128i) -> __m128i {
    _mm_blend_epi32::<SMALLER>(_mm_max_epi32(v, partner), _mm_min_epi32(v, partner))
}
