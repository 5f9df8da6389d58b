//! Scenes of extreme shape through the command: all work, and the light is what it would be without the extreme.
//!
//! A floor of 2 m × 2 m below a lamp of 1 m × 1 m in 2 m height is the scene throughout. Nothing sends light back to
//! the floor, so that its E in the middle is π L F, F the form factor from a point to a parallel square above it.

use glam::DVec3;
use luxel_tests::builder::{Part, Polygon, parallelogram, polygon, scene};
use luxel_tests::probe::Probe;

/// Radiance of the lamp in W/(m² sr).
const RADIANCE: f64 = 5.0;

/// E of the first channel in the middle of the floor below the lamp, in W/m²: four squares of side a = 1/2 that meet
/// above it in the height h = 2, F = 4/π · x/√(1 + x²) · atan(x/√(1 + x²)), x = a/h (J. R. Howell, "A Catalog of
/// Radiation Heat Transfer Configuration Factors", B-3 with equal sides).
fn expected() -> f64 {
    let x: f64 = 0.25;
    let t = x / x.hypot(1.0);
    RADIANCE * 4.0 * t * t.atan()
}

fn floor() -> Part {
    let corner = DVec3::new(-1.0, 0.0, -1.0);
    let face = parallelogram(corner, 2.0 * DVec3::Z, 2.0 * DVec3::X);
    Part::grey("floor", 0.5, vec![face])
}

/// A square in 2 m height that faces downwards.
fn square(x: f64, z: f64, side: f64) -> Polygon {
    parallelogram(DVec3::new(x, 2.0, z), DVec3::X * side, DVec3::Z * side)
}

fn lamp() -> Part {
    Part::lamp("lamp", RADIANCE, vec![square(-0.5, -0.5, 1.0)])
}

/// E of the first channel in the middle of the floor, in W/m².
fn light_on_the_floor(parts: impl IntoIterator<Item = Part>) -> f64 {
    let probe = Probe {
        scene: &scene("extreme", parts),
        toml: "",
        points: vec![(DVec3::ZERO, DVec3::Y)],
        arguments: ["--error", "1%", "-q"].map(str::to_owned).into(),
    };
    probe.run(0)[0].value.x
}

/// Floor and lamp beside an extreme part that leaves the middle of the floor alone. 1 % was asked for, which 19 of 20
/// runs are within: half of it more.
#[track_caller]
fn assert_unchanged_by(extreme: Part) {
    let found = light_on_the_floor([floor(), lamp(), extreme]);
    let expected = expected();
    assert!((found / expected - 1.0).abs() < 0.015, "{found} {expected}");
}

#[test]
fn one_huge_face_beside_very_many_tiny_ones() {
    let pebble = |i: i32| {
        let at = |k: i32| 0.9 + 1e-6 * f64::from(k);
        let (x, y, z) = (at(i % 300), 1e-3, at(i / 300));
        polygon(&[[x, y, z], [x, y, z + 8e-7], [x + 8e-7, y, z]])
    };
    let pebbles = (0..100_000).map(pebble).collect();
    assert_unchanged_by(Part::grey("gravel", 0.5, pebbles));
}

/// Copies are dropped; what rounding alone makes one face of is not, and rays test all of them.
#[test]
fn very_many_coincident_faces() {
    let triangle = |y: f64| polygon(&[[0.8, y, 0.8], [0.8, y, 0.9], [0.9, y, 0.8]]);
    let copies = vec![triangle(0.5); 100_000].into_iter();
    let nearly = (1..500).map(|i| triangle(0.5 + 1e-12 * f64::from(i)));
    assert_unchanged_by(Part::grey("copies", 0.5, copies.chain(nearly).collect()));
}

#[test]
fn a_triangle_a_million_times_longer_than_wide() {
    let sliver = polygon(&[[-1.0, 1.0, 0.3], [1.0, 1.0, 0.3], [1.0, 1.0, 0.3 + 2e-6]]);
    assert_unchanged_by(Part::grey("thread", 0.5, vec![sliver]));
}

/// One triangle, half of the lamp: by symmetry it gives half of the light, and nothing hides it. Lambert's formula in
/// f64, positions rounded to a few 1e-7.
#[test]
fn a_lamp_alone() {
    let half = square(-0.5, -0.5, 1.0)[..3].to_vec();
    let found = light_on_the_floor([Part::lamp("lamp", RADIANCE, vec![half])]);
    let expected = 0.5 * expected();
    assert!((found / expected - 1.0).abs() < 1e-5, "{found} {expected}");
}

/// Ten thousand lamps that together cover a quarter of what the one does. That light comes from spots shows in the
/// square of their distance over their height, 2.5e-5.
#[test]
fn ten_thousand_lamps() {
    const SIDE: i32 = 100;
    let pitch = 1.0 / f64::from(SIDE);
    let spot = |i: i32| {
        let at = |k: i32| pitch * (f64::from(k) + 0.25) - 0.5;
        square(at(i % SIDE), at(i / SIDE), 0.5 * pitch)
    };
    let spots = (0..SIDE * SIDE).map(spot).collect();
    let found = light_on_the_floor([floor(), Part::lamp("lamps", RADIANCE, spots)]);
    let expected = 0.25 * expected();
    assert!((found / expected - 1.0).abs() < 0.015, "{found} {expected}");
}
