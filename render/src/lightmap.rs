//! Lightmaps: the light of a scene in textures that its surfaces are addressed by.
//!
//! The way of the light through this module: faces get places in pages ([`unwrap`], [`atlas`]), texels get points on
//! them ([`luxels`]), the points become receivers ([`receivers`]), light is gathered there ([`bake`]), and what lies
//! between and beside the charts is filled so that filtered look-ups are right ([`seams`], [`dilation`]). [`lookup`] is
//! how an engine reads the result.

pub mod atlas;
pub mod bake;
pub mod dilation;
pub mod export;
pub mod lookup;
pub mod luxels;
pub mod map;
pub mod receivers;
pub mod seams;
pub mod unwrap;
