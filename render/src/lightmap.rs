//! Lightmaps: the light of a scene in textures that its surfaces are addressed by.
//!
//! The way of the light through this module: faces get places in pages ([`unwrap`], [`atlas`]), texels get points on
//! them ([`luxels`]), the points become receivers ([`receivers`]), faces under thin walls are cut ([`walls`], [`mod@cut`]), light is gathered ([`bake`]), and what lies
//! between and beside the charts is filled ([`dilation`]) and fitted ([`fit`], [`seams`]) so that filtered look-ups are right.
//! [`lookup`] is how an engine reads the result, [`view`] how it shows it, and [`mod@target`] what it wants texels to hold;
//! [`encoding`] makes files of maps, [`handover`] all that is made for one consumer. [`export`] writes the scene with its new
//! coordinates, [`manifest`] what is where, [`folder`] reads it again, and [`mod@page`] makes all of it a page to look at.

pub mod atlas;
pub mod bake;
pub mod cut;
pub mod denoise;
pub mod dilation;
pub mod directional;
pub mod encoding;
pub mod export;
pub mod fit;
pub mod folder;
pub mod given;
pub mod handover;
pub mod lookup;
pub mod luxels;
pub mod manifest;
pub mod map;
pub mod masks;
pub mod page;
pub mod picture;
pub mod receivers;
pub mod seams;
pub mod target;
pub mod unwrap;
pub mod view;
pub mod walls;
