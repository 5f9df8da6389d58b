//! Counter-based random numbers: a hash of (seed, stage, item, sample).
//!
//! Equation: z ← z + γ; z ← (z ⊕ z≫30)·m₁; z ← (z ⊕ z≫27)·m₂; z ← z ⊕ z≫31, a bijection of 64
//! bits, applied once per word of the key.
//!
//! Sources: G. L. Steele, D. Lea, C. H. Flood, "Fast splittable pseudorandom number generators",
//! OOPSLA 2014 (the increment γ and the use of a finaliser on a counter); D. Stafford, "Better
//! bit mixing", 2011, variant 13 (the multipliers). The 32-bit finaliser is that of
//! `MurmurHash3` (A. Appleby, 2011).
//!
//! Validity: statistical use; not cryptographic. Cost: about 1 ns per word of the key.

use super::stage::Stage;

/// The golden ratio's fraction in 64 bits, odd: Weyl increment of `SplitMix`.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// Mixes 64 bits; bijective. Unlike a bare finaliser it does not map 0 to 0.
pub const fn mix64(word: u64) -> u64 {
    let z = word.wrapping_add(GOLDEN);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Mixes 32 bits; bijective; maps 0 to 0.
pub const fn mix32(word: u32) -> u32 {
    let h = (word ^ (word >> 16)).wrapping_mul(0x85eb_ca6b);
    let h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    h ^ (h >> 16)
}

/// A key for all the samples of one item in one stage.
pub const fn key(seed: u64, stage: Stage, item: u64) -> u64 {
    mix64(mix64(mix64(seed) ^ stage.0 as u64) ^ item)
}

/// 64 random bits for a sample of an item.
pub const fn bits(seed: u64, stage: Stage, item: u64, sample: u64) -> u64 {
    mix64(key(seed, stage, item) ^ sample)
}

/// A uniform number in [0, 1) with 53 random bits.
pub fn uniform(seed: u64, stage: Stage, item: u64, sample: u64) -> f64 {
    unit_f64(bits(seed, stage, item, sample))
}

/// The upper 53 bits as a number in [0, 1).
pub const fn unit_f64(bits: u64) -> f64 {
    (bits >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
}

/// The upper 24 bits as a number in [0, 1): f32 holds every such fraction exactly, so the result
/// is never rounded up to 1.
pub const fn unit_f32(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / (1_u32 << 24) as f32)
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "these values are exact by construction")]
mod tests {
    use super::*;

    #[test]
    fn known_values_do_not_change() {
        // The first is the published first output of SplitMix64 with state 0.
        assert_eq!(mix64(0), 0xe220_a839_7b1d_cdaf);
        assert_eq!(mix32(1), 0x514e_28b7);
        assert_eq!(bits(7, Stage::GATHER, 11, 13), 9_863_401_942_665_754_577);
    }

    #[test]
    fn unit_intervals_are_half_open() {
        assert_eq!(unit_f64(0), 0.0);
        assert_eq!(unit_f64(u64::MAX), 1.0 - f64::EPSILON / 2.0);
        assert_eq!(unit_f32(0), 0.0);
        assert_eq!(unit_f32(u32::MAX), 1.0 - f32::EPSILON / 2.0);
    }

    #[test]
    fn each_part_of_the_key_decorrelates() {
        // Sample correlation of 4096 pairs has σ = 1/64 under independence; 5σ with fixed seeds.
        let n = 4096_u64;
        let base = |i: u64| bits(1, Stage::ROWS, i, 0);
        let others: [fn(u64) -> u64; 4] = [
            |i| bits(2, Stage::ROWS, i, 0),
            |i| bits(1, Stage::DIRECT, i, 0),
            |i| bits(1, Stage::ROWS, i + 1, 0),
            |i| bits(1, Stage::ROWS, i, 1),
        ];
        for other in others {
            let correlation = (0..n)
                .map(|i| (unit_f64(base(i)) - 0.5) * (unit_f64(other(i)) - 0.5) * 12.0)
                .sum::<f64>()
                / n as f64;
            assert!(correlation.abs() < 5.0 / 64.0, "correlation {correlation}");
        }
    }

    #[test]
    fn one_flipped_bit_flips_half_of_the_result() {
        // Mean of 64·256 binomial(64, ½) counts: σ of the mean = 4/√16384 = 1/32; 5σ.
        let mut flips = 0_u32;
        for word in 0..256_u64 {
            for bit in 0..64 {
                flips += (mix64(word) ^ mix64(word ^ (1 << bit))).count_ones();
            }
        }
        let mean = f64::from(flips) / (64.0 * 256.0);
        assert!((mean - 32.0).abs() < 5.0 / 32.0, "mean {mean}");
    }
}
