//! Support for the tests of luxel: statistics, exact cases, references, error metrics, golden
//! images, and scenes made in code.
//!
//! Nothing here is needed by the product. What a test asserts stands in the test; what it needs to
//! say it briefly stands here.

pub mod accuracy;
pub mod baked;
pub mod benchmarks;
pub mod builder;
pub mod cases;
pub mod chi_squared;
pub mod cie171;
pub mod closed_box;
pub mod command;
pub mod golden;
pub mod hypothesis;
pub mod irradiance_fields;
pub mod ledgers;
pub mod lightmaps;
pub mod metrics;
pub mod occlusion;
pub mod picture;
pub mod probe;
pub mod references;
pub mod scene_files;
pub mod special;
pub mod volumes;
