//! Receivers of a plane that nothing divides: a wall that stands on a floor makes two regions of it, unless it has an opening.
//!
//! Neighbours are of one region when the segment between them is free. Neighbours are found by a grid of some
//! [`RECEIVERS_OF_CELL`] receivers a cell: the first receiver of a cell stands for it and is tried with all others of the cell and
//! with those that stand for the cells around. What a wall through a cell cuts off from its first is tried with the
//! first ones around, and with the others that are cut off. Cost: about three segments a receiver.

use super::FEWEST;
use super::planes::Planes;
use crate::bvh::{Bvh, Ray};
use crate::world::Receiver;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Receivers of a cell of the grid, on average: the grid's cells are then about twice as wide as receivers are apart.
const RECEIVERS_OF_CELL: f64 = 4.0;

/// The cells after a cell in the order of rows: the others have it among theirs.
const AFTER: [(i32, i32); 4] = [(1, 0), (-1, 1), (0, 1), (1, 1)];

/// The cells around a cell.
const AROUND: [(i32, i32); 8] = [
    (1, 0),
    (-1, 1),
    (0, 1),
    (1, 1),
    (-1, 0),
    (1, -1),
    (0, -1),
    (-1, -1),
];

/// The region of each receiver, by number; receivers of different planes may have the same.
pub(crate) fn regions(receivers: &[Receiver], bvh: &Bvh) -> Vec<u32> {
    let planes = Planes::new(receivers, None, FEWEST);
    let mut found = vec![0; receivers.len()];
    let of_planes: Vec<Vec<u32>> = planes
        .all()
        .par_iter()
        .map(|plane| {
            let places = plane.members.iter().map(|&member| {
                let position = receivers[member as usize].position;
                plane.coordinates(position).to_array()
            });
            let places: Vec<[f64; 2]> = places.collect();
            of_plane(&plane.members, &places, receivers, bvh)
        })
        .collect();
    for (plane, regions) in planes.all().iter().zip(of_planes) {
        for (&member, region) in plane.members.iter().zip(regions) {
            found[member as usize] = region;
        }
    }
    found
}

/// The regions of a plane's members, by the number of their first one.
fn of_plane(members: &[u32], places: &[[f64; 2]], receivers: &[Receiver], bvh: &Bvh) -> Vec<u32> {
    let mut cells: BTreeMap<(i32, i32), Vec<u32>> = BTreeMap::new();
    let width = cell_width(places);
    for (place, member) in places.iter().zip(0..) {
        let [column, row] = place.map(|x| (x / width).floor() as i32);
        cells.entry((row, column)).or_default().push(member);
    }
    let first = |(row, column): (i32, i32), (dx, dy): (i32, i32)| {
        let cell = cells.get(&(row.checked_add(dy)?, column.checked_add(dx)?))?;
        cell.first().copied()
    };
    let mut pairs = Vec::new();
    for (&at, cell) in &cells {
        pairs.extend(cell[1..].iter().map(|&member| [cell[0], member]));
        let after = AFTER.iter().filter_map(|&step| first(at, step));
        pairs.extend(after.map(|other| [cell[0], other]));
    }
    let mut sets = Sets::new(members.len());
    let is_free = |pairs: &[[u32; 2]]| -> Vec<bool> {
        let segments: Vec<Ray> = pairs
            .iter()
            .map(|pair| {
                let [from, to] =
                    pair.map(|member| receivers[members[member as usize] as usize].origin);
                Ray::segment(from, to)
            })
            .collect();
        let mut blocked = vec![false; segments.len()];
        bvh.occluded(&segments, &mut blocked);
        blocked.into_iter().map(|blocked| !blocked).collect()
    };
    sets.join_free(&pairs, &is_free(&pairs));
    // What is cut off from its cell's first.
    let mut pairs = Vec::new();
    for (&at, cell) in &cells {
        let cut: Vec<u32> = cell[1..]
            .iter()
            .copied()
            .filter(|&member| !sets.are_joined(cell[0], member))
            .collect();
        for (index, &member) in cut.iter().enumerate() {
            let around = AROUND.iter().filter_map(|&step| first(at, step));
            pairs.extend(around.map(|other| [member, other]));
            pairs.extend(cut[index + 1..].iter().map(|&other| [member, other]));
        }
    }
    sets.join_free(&pairs, &is_free(&pairs));
    (0..members.len() as u32)
        .map(|member| sets.first(member))
        .collect()
}

/// Width of the cells of a grid over places; one where all are in one place.
fn cell_width(places: &[[f64; 2]]) -> f64 {
    let [columns, rows] = [0, 1].map(|axis| {
        let along = places.iter().map(|place| place[axis]);
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        high - low
    });
    let share = RECEIVERS_OF_CELL / places.len() as f64;
    // Of a strip only the length is divided.
    let width = (columns * rows * share)
        .sqrt()
        .max(columns.max(rows) * share);
    if width > 0.0 { width } else { 1.0 }
}

/// Disjoint sets of the numbers from zero on, each with its lowest number as its name.
struct Sets(Vec<u32>);

impl Sets {
    fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn first(&mut self, mut member: u32) -> u32 {
        while self.0[member as usize] != member {
            let next = self.0[member as usize];
            self.0[member as usize] = self.0[next as usize];
            member = self.0[member as usize];
        }
        member
    }

    fn are_joined(&mut self, one: u32, other: u32) -> bool {
        self.first(one) == self.first(other)
    }

    /// Joins the pairs that are free.
    fn join_free(&mut self, pairs: &[[u32; 2]], free: &[bool]) {
        for (&[one, other], &is_free) in pairs.iter().zip(free) {
            if is_free {
                let (one, other) = (self.first(one), self.first(other));
                self.0[one.max(other) as usize] = one.min(other);
            }
        }
    }
}
