//! What a lightmap is delivered with: the scene with the texture coordinates that its surfaces have in the pages.
//!
//! [`obj`] is for programs that read nothing newer: one set of coordinates, and pages told apart by names. [`glb`] is for
//! engines: the scene as it came, with a second set of coordinates and, at each node, the file and rectangle of its map.

pub mod glb;
pub mod obj;
mod pages;

#[cfg(test)]
mod testing;
