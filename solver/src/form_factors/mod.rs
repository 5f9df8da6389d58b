//! Form factors, by three estimators.
//!
//! F_ij is the fraction of the flux leaving the front of i that arrives at the front of j, and
//! A_i F_ij = A_j F_ji.

mod clip;
mod point_to_polygon;

pub use clip::{Plane, clip};
pub use point_to_polygon::point_to_polygon;
