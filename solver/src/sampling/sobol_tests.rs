//! Nets before and after scrambling, integration error, bias over seeds, pinned values.

use super::*;
use crate::sampling::hash;

/// Unscrambled digits of point `index`, most significant first.
fn plain(index: u32) -> [u32; 4] {
    let upper = upper_dimensions(index);
    [index, pascal(index), upper as u32, (upper >> 32) as u32].map(u32::reverse_bits)
}

/// Counts the points in each elementary interval of 2^m points that is split `splits[d]` times in
/// dimension d, and asserts that each holds `expected`.
fn assert_net(points: impl Iterator<Item = [u32; 4]>, splits: [u32; 4], expected: usize) {
    let mut count = vec![0_usize; 1 << splits.iter().sum::<u32>()];
    for point in points {
        let cell = (0..4).fold(0, |cell, d| {
            let digits = u64::from(point[d]) >> (32 - splits[d]);
            cell << splits[d] | digits as usize
        });
        count[cell] += 1;
    }
    assert!(
        count.iter().all(|&c| c == expected),
        "splits {splits:?}: cells hold {:?} to {:?}, not {expected}",
        count.iter().min(),
        count.iter().max()
    );
}

#[test]
fn pascal_butterfly_is_the_second_sobol_matrix() {
    let columns = direction_numbers(1, 0, [1, 0, 0]);
    for index in (0..100_000).chain([u32::MAX, 1 << 31]) {
        let product = (0..32)
            .filter(|bit| index >> bit & 1 == 1)
            .fold(0, |sum, bit| sum ^ columns[bit as usize]);
        assert_eq!(pascal(index), product, "index {index}");
    }
}

#[test]
fn first_points_are_those_of_joe_and_kuo() {
    // Points 0..8 of the first four dimensions in natural (not Gray code) order, in eighths.
    let expected: [[u32; 4]; 8] = [
        [0, 0, 0, 0],
        [4, 4, 4, 4],
        [2, 6, 6, 6],
        [6, 2, 2, 2],
        [1, 5, 3, 1],
        [5, 1, 7, 5],
        [3, 3, 5, 7],
        [7, 7, 1, 3],
    ];
    for (index, point) in expected.into_iter().enumerate() {
        assert_eq!(
            plain(index as u32),
            point.map(|eighths| eighths << 29),
            "index {index}"
        );
    }
}

#[test]
fn dimensions_0_and_1_are_a_0_2_sequence() {
    let sequence = Sequence::new(3, Stage::ROWS, 5);
    for m in 0..=12_u32 {
        for k in 0..=m {
            let splits = [k, m - k, 0, 0];
            // The first run of 2^m points, and one that starts high in the 32-bit range.
            for start in [0, 0xfff0_0000] {
                let indices = start..=start + ((1 << m) - 1);
                assert_net(indices.clone().map(plain), splits, 1);
                assert_net(indices.map(|i| sequence.digits4(i)), splits, 1);
            }
        }
    }
}

#[test]
fn four_dimensions_are_a_3_4_sequence() {
    // t = Σ (deg pᵢ − 1) over the primitive polynomials of degrees 1, 2, 3 = 0 + 1 + 2.
    let (m, t) = (9, 3);
    let sequence = Sequence::new(8, Stage::PATH, 1);
    for a in 0..=m - t {
        for b in 0..=m - t - a {
            for c in 0..=m - t - a - b {
                let splits = [a, b, c, m - t - a - b - c];
                assert_net((0..1 << m).map(plain), splits, 1 << t);
                assert_net((0..1 << m).map(|i| sequence.digits4(i)), splits, 1 << t);
            }
        }
    }
}

#[test]
fn each_dimension_alone_is_stratified() {
    let sequence = Sequence::new(1, Stage::AO, 9).dimension_set(2);
    for d in 0..4 {
        let mut splits = [0; 4];
        splits[d] = 14;
        assert_net((0..1 << 14).map(|i| sequence.digits4(i)), splits, 1);
    }
}

#[test]
fn two_f32_coordinates_keep_their_strata() {
    // 2^20 points in 2^20 rows of f32: rounding must not push a point into its neighbour.
    let sequence = Sequence::new(2, Stage::GATHER, 0);
    let mut seen = vec![false; 1 << 20];
    let mut points = vec![[0.0_f32; 2]; 1 << 20];
    sequence.fill2(0, &mut points);
    for point in points {
        assert!(point.iter().all(|x| (0.0..1.0).contains(x)), "{point:?}");
        let row = (point[1] * (1 << 20) as f32) as usize;
        assert!(!seen[row], "row {row} twice");
        seen[row] = true;
    }
}

#[test]
fn batches_equal_single_points() {
    let sequence = Sequence::new(77, Stage::CAMERA, 123).dimension_set(1);
    let mut two = [[0.0; 2]; 37];
    let mut four = [[0.0; 4]; 37];
    for start in [0, 5, 1_000_003, u32::MAX - 10] {
        sequence.fill2(start, &mut two);
        sequence.fill4(start, &mut four);
        for offset in 0..37_u32 {
            let index = start.wrapping_add(offset);
            assert_eq!(two[offset as usize], sequence.point2_f32(index));
            assert_eq!(four[offset as usize], sequence.point4_f32(index));
            let exact = sequence.point4(index);
            assert_eq!(sequence.point2(index), [exact[0], exact[1]]);
            for d in 0..4 {
                let difference = exact[d] - f64::from(four[offset as usize][d]);
                assert!(
                    (0.0..6e-8).contains(&difference),
                    "dimension {d}: {difference}"
                );
            }
        }
    }
}

/// A smooth function whose integral over the unit square is 1.
fn smooth([x, y]: [f64; 2]) -> f64 {
    let factor = |t: f64| t.exp() / (std::f64::consts::E - 1.0);
    factor(x) * factor(y)
}

/// Root mean square over 64 seeds of the error of the mean of `n` samples of [`smooth`].
fn rms_error(n: u32, point: impl Fn(u64, u32) -> [f64; 2]) -> f64 {
    let squares = (0..64).map(|seed| {
        let sum: f64 = (0..n).map(|i| smooth(point(seed, i))).sum();
        (sum / f64::from(n) - 1.0).powi(2)
    });
    (squares.sum::<f64>() / 64.0).sqrt()
}

#[test]
fn integration_error_falls_faster_than_at_random() {
    let sobol = |seed, i| Sequence::new(seed, Stage::GATHER, 4).point2(i);
    let random =
        |seed, i: u32| [0, 1].map(|d| hash::uniform(seed, Stage::GATHER, 4, 2 * u64::from(i) + d));
    // Slope between n = 16 and n = 4096, a factor of 2^8. An rms over 64 seeds is known to
    // 1/√128 ≈ 9 %, so a slope to √2 · ln 1.09 / ln 256 = 0.022; bounds at five times that.
    let slope = |f: &dyn Fn(u64, u32) -> [f64; 2]| {
        (rms_error(4096, f) / rms_error(16, f)).ln() / 256_f64.ln()
    };
    let (s, r) = (slope(&sobol), slope(&random));
    // Owen 1997: n^-3/2 (log n)^((d-1)/2) for smooth integrands; the logarithm adds 0.1.
    assert!(s < -1.4 + 0.11, "scrambled Sobol': exponent {s}");
    assert!((r + 0.5).abs() < 0.11, "random: exponent {r}");
}

#[test]
fn single_points_are_uniform_over_seeds() {
    // The mean of 20000 uniform numbers has σ = 1/√(12·20000) = 0.00204, their mean square
    // σ = √(4/45/20000) = 0.00211; 32 means and 32 mean squares, 4.5σ each (p = 4e-4 in all).
    let n = 20_000;
    for index in [0, 1, 2, 1000, 65_537, 1 << 24, 3_000_000_000, u32::MAX] {
        let (mut mean, mut square) = ([0.0; 4], [0.0; 4]);
        for seed in 0..n {
            let point = Sequence::new(seed, Stage::DIRECT, 17).point4(index);
            for d in 0..4 {
                mean[d] += point[d] / n as f64;
                square[d] += point[d].powi(2) / n as f64;
            }
        }
        for d in 0..4 {
            assert!(
                (mean[d] - 0.5).abs() < 4.5 * 0.00204,
                "index {index}, {d}: {}",
                mean[d]
            );
            assert!(
                (square[d] - 1.0 / 3.0).abs() < 4.5 * 0.00211,
                "index {index}, {d}: {}",
                square[d]
            );
        }
    }
}

#[test]
fn dimensions_and_sets_are_uncorrelated() {
    // Over 4096 items at one index, correlation of two coordinates has σ = 1/64; 28 pairs, 4.5σ.
    let coordinates: Vec<[f64; 8]> = (0..4096)
        .map(|item| {
            let sequence = Sequence::new(0, Stage::PATH, item);
            let (a, b) = (sequence.point4(6), sequence.dimension_set(0).point4(6));
            [a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]]
        })
        .collect();
    for p in 0..8 {
        for q in 0..p {
            let correlation = coordinates
                .iter()
                .map(|x| (x[p] - 0.5) * (x[q] - 0.5) * 12.0 / 4096.0)
                .sum::<f64>();
            assert!(correlation.abs() < 4.5 / 64.0, "{p} {q}: {correlation}");
        }
    }
}

#[test]
fn values_do_not_change() {
    // Computed by a separate program straight from the definitions: matrices times index, digits
    // reversed one by one.
    let sequence = Sequence::new(1, Stage::GATHER, 42);
    assert_eq!(
        sequence.digits4(0),
        [1_541_223_190, 3_645_669_519, 3_943_345_570, 536_752_581]
    );
    assert_eq!(
        sequence.digits4(1_000_000),
        [4_212_945_760, 1_006_365_476, 3_672_770_517, 328_566_696]
    );
    assert_eq!(
        sequence.dimension_set(0).digits4(7),
        [4_120_455_253, 1_441_928_122, 2_047_609_889, 1_246_004_434]
    );
}
