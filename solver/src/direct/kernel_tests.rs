//! Points follow the kernel.

use super::*;
use crate::form_factors::point_to_polygon;
use crate::sampling::Stage;

/// The share of points in one half of a polygon is that half's share of the irradiance:
/// binomial, 5 σ.
fn check(position: DVec3, normal: DVec3, polygon: &[DVec3], cut: Plane) {
    let mut visible = Vec::new();
    clip(
        polygon,
        &Plane {
            point: position,
            normal,
        },
        &mut visible,
    );
    let mut half = Vec::new();
    clip(&visible, &cut, &mut half);
    let expected =
        point_to_polygon(position, normal, &half) / point_to_polygon(position, normal, polygon);
    let luminaire = Luminaire::new(polygon.to_vec());
    let mut scratch = Scratch::default();
    let count = 40_000;
    let sequence = Sequence::new(5, Stage::DIRECT, 0);
    let inside = (0..count)
        .filter_map(|i| luminaire.sample(position, normal, sequence, i, &mut scratch))
        .filter(|point| cut.height(*point) > 0.0)
        .count();
    let share = inside as f64 / f64::from(count);
    let sigma = (expected * (1.0 - expected) / f64::from(count)).sqrt();
    assert!(
        (share - expected).abs() < 5.0 * sigma,
        "{share} against {expected}"
    );
}

const QUAD: [DVec3; 4] = [
    DVec3::new(-1.0, -0.5, 1.0),
    DVec3::new(-1.0, 0.5, 1.0),
    DVec3::new(1.0, 0.5, 1.0),
    DVec3::new(1.0, -0.5, 1.0),
];

#[test]
fn points_follow_the_kernel() {
    let cut = Plane {
        point: DVec3::new(0.3, 0.0, 0.0),
        normal: DVec3::X,
    };
    let tilted = DVec3::new(0.9, 0.1, 0.3).normalize();
    for (position, normal) in [
        (DVec3::ZERO, DVec3::Z),
        (DVec3::new(0.2, 0.1, 0.9), DVec3::Z),
        (DVec3::new(-2.0, 0.0, 0.5), tilted),
        (DVec3::new(0.0, 3.0, 0.0), DVec3::Z),
        (DVec3::new(0.5, 0.2, -4.0), DVec3::Z),
        (DVec3::new(-3.0, 1.0, -3.5), tilted),
    ] {
        check(position, normal, &QUAD, cut);
    }
}

#[test]
fn a_disk_follows_the_kernel() {
    let disk: Vec<DVec3> = (0..48)
        .map(|k| {
            let angle = -f64::from(k) * std::f64::consts::TAU / 48.0;
            DVec3::new(angle.cos(), angle.sin(), 1.0)
        })
        .collect();
    let cut = Plane {
        point: DVec3::new(0.3, 0.0, 0.0),
        normal: DVec3::X,
    };
    check(DVec3::ZERO, DVec3::Z, &disk, cut);
    check(DVec3::new(1.5, 0.0, 0.0), DVec3::Z, &disk, cut);
}

#[test]
fn nothing_is_drawn_from_nothing() {
    let sequence = Sequence::new(5, Stage::DIRECT, 0);
    let drawn = |corners: &[DVec3]| {
        let luminaire = Luminaire::new(corners.to_vec());
        luminaire.sample(DVec3::ZERO, DVec3::Z, sequence, 0, &mut Scratch::default())
    };
    let edge_on = [DVec3::X, DVec3::X * 2.0, DVec3::new(1.5, 1.0, 0.0)];
    assert_eq!(drawn(&edge_on), None);
    let below = [
        DVec3::NEG_Z,
        DVec3::NEG_Z + DVec3::X,
        DVec3::NEG_Z + DVec3::Y,
    ];
    assert_eq!(drawn(&below), None);
}
