//! What is suspicious about a scene that loads, as far as it shows without rays: open edges,
//! T-junctions, flipped, duplicate and overlapping faces, materials, lights, cameras and units.
//!
//! Tolerances are relative to the extent of the scene or of a face. What the readers put right is in
//! their warnings.

mod content;
mod edges;
mod finding;
mod overlap;
mod shells;
mod weld;

pub use finding::{FaceRef, Finding, Severity};

use crate::scene::Scene;

/// Everything suspicious about a scene, the more serious first, always in the same order. Cost:
/// about a microsecond a face.
pub fn report(scene: &Scene) -> Vec<Finding> {
    let mut findings = Vec::new();
    if let Some(welded) = weld::weld(scene) {
        let edges = edges::edges(scene, &welded);
        edges::report(scene, &welded, &edges, &mut findings);
        shells::report(scene, &edges, &mut findings);
        overlap::report(scene, &welded, &mut findings);
    }
    content::report(scene, &mut findings);
    findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity()));
    findings
}

#[cfg(test)]
mod tests;
