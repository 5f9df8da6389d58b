//! Light transport: from a [`luxel_scenes::Scene`] to radiosity, irradiance and form factors.
//!
//! The modules stand in the order in which light passes through them.

pub mod sampling;

pub mod geometry;

pub mod surface;

mod memory;

pub mod bvh;

pub mod patches;

pub mod form_factors;

pub mod transport;

pub mod bounces;

pub mod solvers;

pub mod direct;

pub mod world;

pub mod radiosity;

pub mod error;

pub mod pilot;

pub mod subdivision;

pub mod field;

pub mod gather;

pub mod adaptive;

pub mod incident;

pub mod audit;
