//! A large polygon of five or more corners, divided by the square grid of its own plane.
//!
//! Elements are the cells of the grid clipped to the polygon (I. E. Sutherland, G. W. Hodgman,
//! "Reentrant polygon clipping", Communications of the ACM 17(1), 1974).

use glam::{DVec2, DVec3};

/// Cells with less than this share of a full cell are given to the nearest larger one: a sliver of
/// a patch would cost as much as a whole one.
const LEAST_SHARE: f64 = 0.05;

/// A polygon with its grid.
#[derive(Clone, Debug)]
pub(super) struct Clipped {
    origin: DVec3,
    axes: [DVec3; 2],
    cell: f64,
    counts: [u32; 2],
    /// Element of each cell of the grid, row by row.
    element_of_cell: Vec<u32>,
    /// Corners of each element.
    pub(super) elements: Vec<Vec<DVec3>>,
}

impl Clipped {
    /// Divides a planar convex polygon into cells of side `size`, the first edge along the grid.
    pub(super) fn new(polygon: &[DVec3], size: f64) -> Self {
        let normal: DVec3 = polygon[1..]
            .windows(2)
            .map(|pair| (pair[0] - polygon[0]).cross(pair[1] - polygon[0]))
            .sum::<DVec3>()
            .normalize();
        let x = (polygon[1] - polygon[0]).normalize();
        let axes = [x, normal.cross(x)];
        let flat = |p: &DVec3| {
            DVec2::new(
                (*p - polygon[0]).dot(axes[0]),
                (*p - polygon[0]).dot(axes[1]),
            )
        };
        let ring: Vec<DVec2> = polygon.iter().map(flat).collect();
        let lower = ring.iter().fold(DVec2::INFINITY, |l, p| l.min(*p));
        let upper = ring.iter().fold(DVec2::NEG_INFINITY, |u, p| u.max(*p));
        // A whole number of cells across the longer side.
        let side = upper - lower;
        let cell = side.max_element() / (side.max_element() / size).round().max(1.0);
        let counts = [side.x, side.y].map(|s| (s / cell - 1e-9).ceil().max(1.0) as u32);
        let origin = polygon[0] + axes[0] * lower.x + axes[1] * lower.y;
        let local: Vec<DVec2> = ring.iter().map(|p| (*p - lower) / cell).collect();
        let mut elements = Vec::new();
        let mut element_of_cell = vec![u32::MAX; (counts[0] * counts[1]) as usize];
        let mut centres = Vec::new();
        for (index, element) in element_of_cell.iter_mut().enumerate() {
            let (i, j) = (index as u32 % counts[0], index as u32 / counts[0]);
            let corner = DVec2::new(f64::from(i), f64::from(j));
            let piece = clip_to_cell(&local, corner);
            if area(&piece) >= LEAST_SHARE {
                *element = elements.len() as u32;
                centres.push(corner);
                elements.push(
                    piece
                        .iter()
                        .map(|p| origin + axes[0] * (p.x * cell) + axes[1] * (p.y * cell))
                        .collect(),
                );
            }
        }
        if elements.is_empty() {
            elements.push(polygon.to_vec());
            centres.push(DVec2::ZERO);
        }
        for (index, element) in element_of_cell.iter_mut().enumerate() {
            if *element == u32::MAX {
                let corner = DVec2::new(
                    f64::from(index as u32 % counts[0]),
                    f64::from(index as u32 / counts[0]),
                );
                let distance = |c: &DVec2| c.distance_squared(corner);
                let nearest = (0..centres.len())
                    .min_by(|&a, &b| distance(&centres[a]).total_cmp(&distance(&centres[b])));
                *element = nearest.unwrap_or(0) as u32;
            }
        }
        Self {
            origin,
            axes,
            cell,
            counts,
            element_of_cell,
            elements,
        }
    }

    /// Side of a cell.
    pub(super) fn cell(&self) -> f64 {
        self.cell
    }

    /// The element at a point of the polygon's plane.
    pub(super) fn element_at(&self, p: DVec3) -> u32 {
        let index = |axis: usize| {
            let x = (p - self.origin).dot(self.axes[axis]) / self.cell;
            (x.max(0.0) as u32).min(self.counts[axis] - 1)
        };
        self.element_of_cell[(index(1) * self.counts[0] + index(0)) as usize]
    }
}

/// The part of a convex polygon inside the unit cell at `corner`.
fn clip_to_cell(polygon: &[DVec2], corner: DVec2) -> Vec<DVec2> {
    let planes = [
        (DVec2::X, corner.x),
        (DVec2::NEG_X, -(corner.x + 1.0)),
        (DVec2::Y, corner.y),
        (DVec2::NEG_Y, -(corner.y + 1.0)),
    ];
    let mut current = polygon.to_vec();
    for (normal, offset) in planes {
        let mut next = Vec::with_capacity(current.len() + 1);
        for (k, &a) in current.iter().enumerate() {
            let b = current[(k + 1) % current.len()];
            let (da, db) = (a.dot(normal) - offset, b.dot(normal) - offset);
            if da >= 0.0 {
                next.push(a);
            }
            if (da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0) {
                next.push(a.lerp(b, da / (da - db)));
            }
        }
        current = next;
    }
    current
}

fn area(polygon: &[DVec2]) -> f64 {
    (0..polygon.len())
        .map(|k| 0.5 * polygon[k].perp_dot(polygon[(k + 1) % polygon.len()]))
        .sum::<f64>()
}
