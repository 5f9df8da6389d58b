//! Randomness and what is drawn with it.
//!
//! All randomness of a run comes from one counter-based source keyed by (seed, stage, item,
//! sample): [`hash`] for independent numbers and [`sobol`] for points that fill their square
//! evenly. Nothing here has a state that advances, so that any thread may draw any sample and
//! the result is the same.
//!
//! The other files are warps from the unit square. Each has the same three parts: `sample` maps
//! a point of the unit square, `pdf` is the density of the result (its measure stands in the
//! documentation), and `invert` maps a result back to the square. Directions around a surface
//! are f32 because rays are; what is seen from a point under a solid angle is f64.

pub mod bilinear;
pub mod cosine_hemisphere;
pub mod discrete;
pub mod disk;
pub mod frame;
pub mod hash;
pub mod mixed_hemisphere;
pub mod polygon;
pub mod projected_spherical_triangle;
pub mod sobol;
pub mod sphere;
pub mod spherical_triangle;
pub mod stage;
pub mod triangle;

pub use discrete::Discrete;
pub use frame::Frame;
pub use polygon::Polygon;
pub use projected_spherical_triangle::ProjectedSphericalTriangle;
pub use sobol::Sequence;
pub use spherical_triangle::SphericalTriangle;
pub use stage::Stage;

#[cfg(test)]
mod tests;
