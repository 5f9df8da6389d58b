//! The places where corners of patches lie, and those of them that lie on a given edge.

use glam::{DVec3, I64Vec3};
use std::collections::HashMap;

/// Corners nearer than this in units are the same; f64 puts them 1e-15 apart.
const SAME: f64 = 1.0 / 4_194_304.0;

/// Corners by place.
pub(super) struct Nodes {
    positions: Vec<DVec3>,
    by_place: HashMap<I64Vec3, u32>,
    /// Nodes in each cell of a grid of about the size of the edges.
    grid: HashMap<I64Vec3, Vec<u32>>,
    cell: f64,
}

fn key(position: DVec3, cell: f64) -> I64Vec3 {
    (position / cell).floor().as_i64vec3()
}

/// The other key that a position within rounding of a cell's border may have been stored under.
fn keys(position: DVec3) -> impl Iterator<Item = I64Vec3> {
    const NEAR: f64 = 1e-3;
    (0..8).filter_map(move |k| {
        let shift = DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
        let place = position / SAME;
        let side = (place - place.floor()).map(|f| if f < 0.5 { -1.0 } else { 1.0 });
        let moved = (place + shift * side * NEAR).floor();
        // Without a shift the key itself; with one only where it crosses a border.
        let plain = place.floor();
        let crosses =
            (0..3).all(|axis| (shift[axis] > 0.0) == ((moved[axis] - plain[axis]).abs() > 0.5));
        crosses.then(|| moved.as_i64vec3())
    })
}

impl Nodes {
    /// The corners of all polygons.
    pub(super) fn new<'p>(polygons: impl Iterator<Item = &'p Vec<DVec3>> + Clone) -> Self {
        let (mut sum, mut count) = (0.0, 0.0);
        for (a, b) in polygons.clone().flat_map(|polygon| edges(polygon)) {
            sum += a.distance(b);
            count += 1.0;
        }
        let mut nodes = Self {
            positions: Vec::new(),
            by_place: HashMap::new(),
            grid: HashMap::new(),
            cell: (sum / f64::max(count, 1.0)).max(4.0 * SAME),
        };
        for &corner in polygons.flatten() {
            if nodes.find(corner).is_none() {
                let id = nodes.positions.len() as u32;
                nodes.positions.push(corner);
                nodes.by_place.insert(key(corner, SAME), id);
                let cell = key(corner, nodes.cell);
                nodes.grid.entry(cell).or_default().push(id);
            }
        }
        nodes
    }

    pub(super) fn len(&self) -> usize {
        self.positions.len()
    }

    pub(super) fn position(&self, node: usize) -> DVec3 {
        self.positions[node]
    }

    /// The node of a corner; `None` when no polygon has it.
    pub(super) fn find(&self, corner: DVec3) -> Option<u32> {
        keys(corner).find_map(|key| self.by_place.get(&key).copied())
    }

    /// The node of a corner.
    ///
    /// # Panics
    /// When no polygon has this corner.
    pub(super) fn at(&self, corner: DVec3) -> u32 {
        self.find(corner).expect("every corner is a node")
    }

    /// The nodes around a polygon, those within its edges included; true when there are such.
    pub(super) fn border(&self, polygon: &[DVec3]) -> (Vec<u32>, bool) {
        let mut border = Vec::with_capacity(polygon.len());
        let mut hangs = false;
        for (a, b) in edges(polygon) {
            border.push(self.at(a));
            let within = self.within(a, b);
            hangs |= !within.is_empty();
            border.extend(within);
        }
        // Corners that fall together within rounding are one.
        border.dedup();
        if border.len() > 1 && border.first() == border.last() {
            border.pop();
        }
        (border, hangs)
    }

    /// The nodes strictly between two points, in order.
    fn within(&self, a: DVec3, b: DVec3) -> Vec<u32> {
        let length = a.distance(b);
        // A node on the edge is at most a quarter of a cell from one of the steps.
        let steps = (2.0 * length / self.cell).ceil().max(1.0) as usize;
        let reach = 0.25 * self.cell + SAME;
        let mut found: Vec<(f64, u32)> = Vec::new();
        for step in 0..=steps {
            let at = a.lerp(b, step as f64 / steps as f64);
            let [low, high] = [at - reach, at + reach].map(|p| key(p, self.cell));
            for x in low.x..=high.x {
                for y in low.y..=high.y {
                    for z in low.z..=high.z {
                        let Some(nodes) = self.grid.get(&I64Vec3::new(x, y, z)) else {
                            continue;
                        };
                        found.extend(nodes.iter().filter_map(|&node| {
                            let p = self.positions[node as usize];
                            let along = (p - a).dot(b - a) / length;
                            let off = (p - a - (b - a) * (along / length)).length();
                            let inside = along > SAME && along < length - SAME && off < SAME;
                            inside.then_some((along, node))
                        }));
                    }
                }
            }
        }
        found.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
        found.dedup_by_key(|(_, node)| *node);
        found.into_iter().map(|(_, node)| node).collect()
    }
}

fn edges(polygon: &[DVec3]) -> impl Iterator<Item = (DVec3, DVec3)> + '_ {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().copied().zip(next.copied())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_within_edges_are_found_in_order() {
        let v = |x: f64, y: f64| DVec3::new(x, y, 0.3);
        let large = vec![v(0.0, 0.0), v(0.6, 0.0), v(0.6, 0.6), v(0.0, 0.6)];
        let small = |y: f64| vec![v(0.6, y), v(0.8, y), v(0.8, y + 0.2), v(0.6, y + 0.2)];
        // 0.2 + 0.2 is not 0.4 to the bit: rounding does not make another node.
        let polygons = [large.clone(), small(0.0), small(0.2), small(0.4)];
        let nodes = Nodes::new(polygons.iter());
        assert_eq!(nodes.len(), 4 + 6);
        let (border, hangs) = nodes.border(&large);
        assert!(hangs);
        let heights: Vec<f64> = border[1..5]
            .iter()
            .map(|&node| nodes.position(node as usize).y)
            .collect();
        assert!(
            heights.windows(2).all(|pair| pair[0] < pair[1]),
            "{heights:?}"
        );
        assert_eq!(border.len(), 6);
        let (border, hangs) = nodes.border(&small(0.2));
        assert!(!hangs && border.len() == 4);
    }
}
