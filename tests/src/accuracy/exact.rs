//! `luxel probe --error 1%` at the points of the cases in closed form: direct light
//! ([`crate::irradiance_fields`]) and ambient occlusion ([`crate::occlusion`]).

use super::{Calibration, Stated};
use crate::builder::scene;
use crate::cases::{AmbientOcclusionCase, IrradianceFieldCase};
use crate::probe::Probe;
use crate::{irradiance_fields, occlusion};

/// Values of a probe over `seeds` seeds beside `expected`, give or take `tolerance`.
fn calibrate(mut probe: Probe, expected: &[f64], tolerance: f64, seeds: u64) -> Calibration {
    let error = ["--error", "1%", "-q"].map(str::to_owned);
    probe.arguments.extend(error);
    let level = super::largest(expected.iter().copied());
    // Nothing but darkness is expected: rounding is relative to an open hemisphere.
    let level = if level > 0.0 { level } else { 1.0 };
    let mut calibration = Calibration::default();
    for seed in 0..seeds {
        for (estimate, &expected) in probe.run(seed).iter().zip(expected) {
            calibration.add(&Stated {
                value: estimate.value.x,
                error: estimate.standard_error.x,
                expected,
                uncertainty: 0.0,
                tolerance,
                level,
            });
        }
    }
    calibration
}

/// A case of direct light over `seeds` seeds.
///
/// # Panics
/// When the case is not known, or the command fails.
pub fn irradiance_field(case: &IrradianceFieldCase, seeds: u64) -> Calibration {
    let setup = irradiance_fields::setup(case);
    let probe = Probe {
        scene: &scene("field", setup.parts),
        toml: &setup.toml,
        points: irradiance_fields::points(case),
        arguments: setup.arguments,
    };
    let brightest = super::largest(case.values.iter().copied());
    calibrate(probe, &case.values, setup.relative * brightest, seeds)
}

/// A case of ambient occlusion over `seeds` seeds.
///
/// # Panics
/// When the case is not known, or the command fails.
pub fn openness(case: &AmbientOcclusionCase, seeds: u64) -> Calibration {
    let groups = occlusion::groups(case).into_iter().map(|group| {
        let probe = Probe {
            scene: &group.scene,
            toml: "",
            points: group.points,
            arguments: group.arguments,
        };
        calibrate(probe, &group.values, occlusion::TOLERANCE, seeds)
    });
    groups.fold(Calibration::default(), Calibration::and)
}
