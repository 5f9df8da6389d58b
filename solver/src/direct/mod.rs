//! Direct light: what arrives at a point from the sources without reflection.
//!
//! Emissive polygons are integrated exactly (Lambert's formula) and multiplied by a visibility
//! that is sampled by the same kernel; point, spot and directional lights cost one shadow ray; the
//! sky is integrated by rays of its own where a receiver has many, and else seen by the rays of rows
//! and gathers that leave the scene.

mod dome;
mod importance;
mod kernel;
mod lights;
mod lit;
mod merge;
mod named;
mod sampler;
mod sky;

pub(crate) use dome::{Dome, DomeRays};
pub use kernel::Luminaire;
pub use lights::{Distribution, Lights, Source};
pub use lit::Lit;
pub use named::{NamedKind, NamedLight};
pub(crate) use sampler::systematic;
pub use sampler::{DirectSampler, Sample, ShadowRays};
