//! Fields of which the truth is known.

use super::*;
use crate::sampling::Stage;
use crate::sampling::hash::uniform;
use glam::Vec3;
use std::f64::consts::TAU;

const REPLICATES: usize = 4;

/// A normal deviate (G. E. P. Box, M. E. Muller, 1958).
fn normal(seed: u64, item: u64, sample: u64) -> f64 {
    let u = |k| uniform(seed, Stage::GATHER, item, 2 * sample + k);
    (-2.0 * (1.0 - u(0)).ln()).sqrt() * (TAU * u(1)).cos()
}

/// Receivers at jittered places of a unit square.
fn square(side: usize) -> Vec<Receiver> {
    (0..side * side)
        .map(|i| {
            let u = |k| uniform(1, Stage::CAMERA, i as u64, k);
            let at = |i: usize, k| (i as f64 + u(k)) / side as f64 - 0.5;
            Receiver {
                position: DVec3::new(at(i % side, 0), at(i / side, 1), 0.125),
                normal: DVec3::Z,
                origin: Vec3::ZERO,
            }
        })
        .collect()
}

/// Errors of a field, all as sums of squares over the receivers.
struct Errors {
    /// Of the values before they are joined.
    raw: f64,
    /// Of the joined ones.
    made: f64,
    /// As the field states it.
    stated: f64,
    /// The largest of any receiver, not squared.
    largest: f64,
}

/// Joins `truth` with noise of `sigma` in the mean of four replicates.
fn join(receivers: &[Receiver], seed: u64, truth: impl Fn(DVec3) -> f64, sigma: f64) -> Errors {
    let noisy: Vec<[f64; REPLICATES]> = receivers
        .iter()
        .enumerate()
        .map(|(i, receiver)| {
            let deviation = sigma * (REPLICATES as f64).sqrt();
            std::array::from_fn(|k| {
                truth(receiver.position) + deviation * normal(seed, i as u64, k as u64)
            })
        })
        .collect();
    let count = REPLICATES as f64;
    let mean = |x: &[f64; REPLICATES]| x.iter().sum::<f64>() / count;
    let scatter = |x: &[f64; REPLICATES]| {
        let squares: f64 = x.iter().map(|x_k| (x_k - mean(x)).powi(2)).sum();
        squares / (count * (count - 1.0))
    };
    let values: Vec<Value> = noisy
        .iter()
        .map(|x| Value {
            value: mean(x),
            variance: scatter(x),
        })
        .collect();
    let cells = Cells::new(receivers, &values, None);
    let widening = cells.widening(REPLICATES as u32 - 1);
    let field = cells.join(REPLICATES, |i, row| row.copy_from_slice(&noisy[i]));
    let mut errors = Errors {
        raw: 0.0,
        made: 0.0,
        stated: 0.0,
        largest: 0.0,
    };
    for (receiver, raw) in receivers.iter().zip(&noisy) {
        let mut joined = [0.0; REPLICATES];
        let columns = 0..REPLICATES;
        let known = field.add_at(receiver.position, receiver.normal, columns, &mut joined);
        assert!(known.is_some_and(|shared| shared >= 1.0));
        let error = mean(&joined) - truth(receiver.position);
        errors.raw += (mean(raw) - truth(receiver.position)).powi(2);
        errors.made += error * error;
        errors.stated += scatter(&joined) * widening * widening;
        errors.largest = errors.largest.max(error.abs());
    }
    errors
}

fn wave(p: DVec3) -> f64 {
    2.0 + (3.0 * p.x).sin() + (4.0 * p.x * p.y).cos()
}

/// Light on one part of the square.
fn step(p: DVec3) -> f64 {
    if p.x < 0.13 { 1.0 } else { 0.0 }
}

/// Mean over some seeds: by what factor errors become smaller, and what is stated over what is made.
fn gain_and_honesty(truth: fn(DVec3) -> f64, sigma: f64) -> [f64; 2] {
    let receivers = square(64);
    let mut sums = [0.0; 3];
    for seed in 0..5 {
        let errors = join(&receivers, seed, truth, sigma);
        for (sum, square) in sums
            .iter_mut()
            .zip([errors.raw, errors.made, errors.stated])
        {
            *sum += square;
        }
    }
    let [raw, made, stated] = sums;
    [(raw / made).sqrt(), (stated / made).sqrt()]
}

/// Two to six cells of five to ten coefficients hold the waves, the more the less noise there is: √(4096/p) is 20 to
/// 8, and the bias takes a quarter of it. About two hundred squares decide on what is made and stated here: their
/// ratio is known to a tenth, and how it should be to another.
#[test]
fn smooth_light_loses_its_noise_and_states_what_is_left() {
    for (sigma, least) in [(0.3, 10.0), (0.1, 9.0), (0.03, 8.0), (0.01, 6.0)] {
        let [gain, honesty] = gain_and_honesty(wave, sigma);
        assert!(gain > least, "{sigma}: {gain}");
        assert!((0.8..1.25).contains(&honesty), "{sigma}: {honesty}");
    }
}

/// Cells along the edge are as small as the 64 points along it: at least 64 of them on either side, so that the
/// gain is below √(4096/128).
#[test]
fn edges_stay_where_they_are() {
    for sigma in [0.1, 0.03, 0.01] {
        let [gain, honesty] = gain_and_honesty(step, sigma);
        assert!(gain > 5.0, "{sigma}: {gain}");
        assert!((0.8..1.25).contains(&honesty), "{sigma}: {honesty}");
    }
    // 4096 normal deviates of 0.01 stay below 4.5 of them, joined or not; a smeared edge would be off by a half.
    let errors = join(&square(64), 7, step, 0.01);
    assert!(errors.largest < 0.045, "{}", errors.largest);
}

/// Planes of values without noise are left alone.
#[test]
fn nothing_is_joined_that_is_exact() {
    let mut receivers = square(16);
    let mut above = square(16);
    for receiver in &mut above {
        receiver.position.z += 0.1;
    }
    receivers.extend(above);
    let values: Vec<Value> = receivers
        .iter()
        .map(|receiver| Value {
            value: wave(receiver.position),
            variance: if receiver.position.z < 0.2 { 0.0 } else { 0.01 },
        })
        .collect();
    let field = Cells::new(&receivers, &values, None).join(1, |_, row| row[0] = 1.0);
    for receiver in &receivers {
        let at = field.add_at(receiver.position, receiver.normal, 0..1, &mut [0.0]);
        assert_eq!(at.is_some(), receiver.position.z > 0.2);
    }
}

#[test]
fn places_apart_from_all_receivers_are_unknown() {
    let receivers = square(16);
    let values = vec![
        Value {
            value: 1.0,
            variance: 0.01
        };
        receivers.len()
    ];
    let field = Cells::new(&receivers, &values, None).join(1, |_, row| row[0] = 1.0);
    let at = |x: f64, y: f64, z: f64, normal| {
        let mut sum = [0.0];
        let shared = field.add_at(DVec3::new(x, y, z), normal, 0..1, &mut sum);
        shared.map(|_| sum[0])
    };
    let inside = at(0.1, 0.2, 0.125, DVec3::Z);
    assert!(inside.is_some_and(|value| (value - 1.0).abs() < 1e-12));
    // Half a distance between receivers beyond the last one.
    assert!(at(0.53, 0.2, 0.125, DVec3::Z).is_some());
    assert_eq!(at(0.9, 0.2, 0.125, DVec3::Z), None);
    assert_eq!(at(0.1, 0.2, 0.126, DVec3::Z), None);
    assert_eq!(at(0.1, 0.2, 0.125, DVec3::NEG_Z), None);
}

/// Receivers at one place, on a line, and too few of them.
#[test]
fn degenerate_receivers_have_a_field_too() {
    let at = |positions: &[[f64; 2]]| -> Vec<Receiver> {
        let receiver = |&[x, y]: &[f64; 2]| Receiver {
            position: DVec3::new(x, y, 0.0),
            normal: DVec3::Z,
            origin: Vec3::ZERO,
        };
        positions.iter().map(receiver).collect()
    };
    let one_place = at(&[[0.25, 0.25]; 20]);
    let line: Vec<[f64; 2]> = (0..20).map(|i| [0.01 * f64::from(i), 0.1]).collect();
    for receivers in [one_place, at(&line)] {
        let errors = join(&receivers, 3, |_| 5.0, 0.1);
        assert!(errors.made < errors.raw);
    }
    let few = at(&line[..FEWEST - 1]);
    let values = vec![
        Value {
            value: 1.0,
            variance: 0.0
        };
        few.len()
    ];
    let field = Cells::new(&few, &values, None).join(1, |_, row| row[0] = 1.0);
    let known = field.add_at(few[3].position, DVec3::Z, 0..1, &mut [0.0]);
    assert_eq!(known, None);
}
