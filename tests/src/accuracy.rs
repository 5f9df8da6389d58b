//! How accurate luxel is, and how honest about it: what `tests/ACCURACY.md` tabulates.
//!
//! A stated error s is honest when errors are as large as it says: about 95 % of the values lie within
//! 2 s of the truth, and the mean of z² = (x − x*)²/s² is near one. Fewer within, and the statement
//! is a boast; all of them, and it is a useless bound that rays were wasted on.
//!
//! [`scenes`] holds whole runs of `luxel probe --error` against converged references, [`exact`] against
//! closed forms; [`noise`] holds the sampling part alone against the scatter over seeds, and
//! [`solving`] the solvers against their theory. [`document`] writes them all down.

mod calibration;
mod document;
pub mod exact;
pub mod noise;
pub mod scenes;
pub mod solving;

pub use calibration::{Calibration, Stated};
pub use document::document;

/// Below this fraction of its level a stated error says that a value is exact: coordinates on rays are
/// single-precision, 6e-8, and some tens of them add up.
const ROUNDING: f64 = crate::irradiance_fields::ROUNDING;

/// The middle of some numbers, the upper one of an even number of them; NaN without any.
pub(crate) fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The largest of some numbers, none of which is negative; zero without any.
pub(crate) fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, f64::max)
}
