//! Connected surfaces: those that are closed and face inwards although nothing is in them.
//!
//! The volume of a closed surface is Σ cᵢ·aᵢ / 3 over its faces, c a point of the face and a its
//! vector area (Gauss); it is negative when the faces look inwards, as those of rooms do. Cost: O(n).

use super::edges::{Edge, groups};
use super::finding::{FaceRef, Finding};
use crate::id::FaceId;
use crate::light::LightKind;
use crate::scene::Scene;
use glam::DVec3;

/// A connected surface.
struct Shell {
    low: DVec3,
    high: DVec3,
    volume: f64,
    faces: usize,
    first: FaceId,
    is_closed: bool,
}

impl Shell {
    fn contains(&self, p: DVec3) -> bool {
        p.cmpgt(self.low).all() && p.cmplt(self.high).all()
    }
}

/// The representative of a face's surface.
fn root(parents: &mut [u32], face: u32) -> u32 {
    let mut at = face;
    while parents[at as usize] != at {
        // Halving the path keeps it short.
        parents[at as usize] = parents[parents[at as usize] as usize];
        at = parents[at as usize];
    }
    at
}

/// Findings about closed surfaces.
pub(super) fn report(scene: &Scene, edges: &[Edge], findings: &mut Vec<Finding>) {
    let shells = shells(scene, edges);
    let Some((low, high)) = scene.bounds() else {
        return;
    };
    let cameras = scene.cameras.iter().map(|camera| camera.position);
    let lights = scene.lights.iter().filter_map(|light| match light.kind {
        LightKind::Point { position, .. }
        | LightKind::Lambertian { position, .. }
        | LightKind::Spot { position, .. } => Some(position),
        _ => None,
    });
    let points: Vec<DVec3> = cameras.chain(lights).collect();
    let mut centres: Vec<DVec3> = shells.iter().map(|s| s.low.midpoint(s.high)).collect();
    centres.sort_unstable_by(|a, b| a.x.total_cmp(&b.x));
    for shell in &shells {
        let is_room = shell.low == low && shell.high == high;
        if !shell.is_closed || shell.volume >= 0.0 || is_room {
            continue;
        }
        // Centres by x: only those of the shell's own slice can be in it.
        let slice = centres.partition_point(|c| c.x <= shell.low.x)
            ..centres.partition_point(|c| c.x < shell.high.x);
        let own = shell.low.midpoint(shell.high);
        let has_shell = centres[slice]
            .iter()
            .any(|&c| c != own && shell.contains(c));
        if !has_shell && !points.iter().any(|&p| shell.contains(p)) {
            findings.push(Finding::InsideOut {
                count: shell.faces,
                first: FaceRef::new(scene, shell.first),
            });
        }
    }
}

fn shells(scene: &Scene, edges: &[Edge]) -> Vec<Shell> {
    let mut parents: Vec<u32> = (0..scene.faces.len() as u32).collect();
    for group in groups(edges) {
        for pair in group.windows(2) {
            let [a, b] = [pair[0].owner, pair[1].owner].map(|face| root(&mut parents, face));
            parents[a.max(b) as usize] = a.min(b);
        }
    }
    let mut index_of_root = vec![u32::MAX; scene.faces.len()];
    let mut shells: Vec<Shell> = Vec::new();
    for face in scene.face_ids() {
        let root = root(&mut parents, face.0) as usize;
        if index_of_root[root] == u32::MAX {
            index_of_root[root] = shells.len() as u32;
            shells.push(Shell {
                low: DVec3::INFINITY,
                high: DVec3::NEG_INFINITY,
                volume: 0.0,
                faces: 0,
                first: face,
                is_closed: true,
            });
        }
        let shell = &mut shells[index_of_root[root] as usize];
        shell.faces += 1;
        for corner in scene.polygon(face) {
            shell.low = shell.low.min(corner);
            shell.high = shell.high.max(corner);
        }
        // Any origin gives the volume; one on the surface keeps the terms small.
        let origin = scene.polygon(shell.first).next().unwrap_or_default();
        let corner = scene.polygon(face).next().unwrap_or_default();
        shell.volume += (corner - origin).dot(scene.vector_area(face)) / 3.0;
    }
    for group in groups(edges) {
        if !Edge::is_balanced(group) {
            let root = root(&mut parents, group[0].owner) as usize;
            shells[index_of_root[root] as usize].is_closed = false;
        }
    }
    shells
}
