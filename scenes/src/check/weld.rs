//! Finds vertices at the same place by hashing space. Cost: O(n).

use crate::scene::Scene;
use glam::{DVec3, I64Vec3};
use std::collections::HashMap;

/// Distance over the diagonal of the scene within which vertices are one. Six decimals of a metre in
/// a room of ten metres are 1e-7 of it; larger would join small details, smaller would tear apart
/// what was rounded twice.
const SAME_PLACE: f64 = 1e-6;

/// Vertices of a scene by place.
pub(super) struct Welded {
    /// For each vertex of the scene, the number of its place; `u32::MAX` where no face uses it.
    pub(super) place: Vec<u32>,
    /// Position of each place in metres.
    pub(super) position: Vec<DVec3>,
    /// Lower corner of the scene in metres.
    pub(super) low: DVec3,
    /// Diagonal of the scene in metres.
    pub(super) diagonal: f64,
    /// Distance in metres within which points are one.
    pub(super) tolerance: f64,
}

/// The cell of a grid that a point lies in. The grid's origin is the scene's corner, so that cells
/// have small numbers.
pub(super) fn cell(p: DVec3, origin: DVec3, size: f64) -> I64Vec3 {
    ((p - origin) / size).floor().as_i64vec3()
}

/// Joins vertices; `None` without faces.
pub(super) fn weld(scene: &Scene) -> Option<Welded> {
    let (low, high) = scene.bounds()?;
    let diagonal = low.distance(high);
    let tolerance = SAME_PLACE * diagonal;
    let size = 4.0 * tolerance;
    let mut welded = Welded {
        place: vec![u32::MAX; scene.vertices.len()],
        position: Vec::new(),
        low,
        diagonal,
        tolerance,
    };
    // Places in a cell are a list through `next`.
    let mut first: HashMap<I64Vec3, u32> = HashMap::new();
    let mut next: Vec<u32> = Vec::new();
    for &vertex in &scene.corners.vertex {
        let vertex = vertex as usize;
        if welded.place[vertex] != u32::MAX {
            continue;
        }
        let p = scene.vertices[vertex];
        let near = cells_around(p, low, size, tolerance)
            .into_iter()
            .find_map(|key| {
                let mut at = *first.get(&key)?;
                while at != u32::MAX {
                    if welded.position[at as usize].distance(p) <= tolerance {
                        return Some(at);
                    }
                    at = next[at as usize];
                }
                None
            });
        welded.place[vertex] = near.unwrap_or_else(|| {
            let new = welded.position.len() as u32;
            welded.position.push(p);
            let head = first.entry(cell(p, low, size)).or_insert(u32::MAX);
            next.push(std::mem::replace(head, new));
            new
        });
    }
    Some(welded)
}

/// The one to eight cells that a ball around a point touches.
fn cells_around(p: DVec3, origin: DVec3, size: f64, radius: f64) -> Vec<I64Vec3> {
    let low = cell(p - radius, origin, size);
    let high = cell(p + radius, origin, size);
    let mut cells = Vec::with_capacity(8);
    for x in low.x..=high.x {
        for y in low.y..=high.y {
            for z in low.z..=high.z {
                cells.push(I64Vec3::new(x, y, z));
            }
        }
    }
    cells
}
