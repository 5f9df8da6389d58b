//! Elements that walls divide, and points beside walls.
//!
//! A wall's foot is where two worlds meet in one number: a point that is hit there, or drawn there, may
//! round to the other side. Within the *guard* of a wall, a few roundings of f32, a hit therefore belongs
//! to the side that its ray came from, and so does one farther on whose ray passed the wall's plane
//! lower than that above the surface; points drawn from an element are kept out of the guard.
//! Cost: nothing for regions without walls; one table access for elements without; a step a wall for the rest.

use super::partition::{Piece, Tree};
use super::region::{fan, triangle_area};
use super::walls::Wall;
use glam::DVec3;
use luxel_scenes::FaceId;

/// Marks an element without walls.
const NONE: u32 = u32::MAX;

/// Rounding of f32 within which the place of a hit is not known, in units of 2⁻²⁴ of the coordinates and
/// extents that it is computed from: weights of corners are off by a few. A smaller guard leaks one ray in
/// 10⁸; a larger one moves the border between patches by as much.
const ROUNDINGS: f64 = 16.0;

/// The guard of walls on a surface that reaches as far as `reach` from the middle of the unit frame and
/// across `extent`, in units.
pub(super) fn guard(reach: f64, extent: f64) -> f64 {
    ROUNDINGS / 16_777_216.0 * (reach + extent)
}

/// An element with walls across it or along its border.
#[derive(Clone, Debug)]
struct Entry {
    /// Of the shape.
    element: u32,
    walls: Vec<Wall>,
    /// The way to its cells, and the part that each belongs to; `None` where it is not divided.
    cut: Option<(Tree, Vec<u32>)>,
}

/// What an element is divided into: a patch each.
#[derive(Clone, Debug)]
pub(super) struct Part {
    /// Its position among the entries.
    entry: u32,
    /// Its own number.
    element: u32,
    pub(super) polygons: Vec<Vec<DVec3>>,
    triangles: Vec<(FaceId, [DVec3; 3])>,
    /// Summed areas of the triangles.
    cumulative: Vec<f64>,
}

impl Part {
    pub(super) fn area(&self) -> f64 {
        self.cumulative.last().copied().unwrap_or(0.0)
    }

    /// The middle of the triangle at a share of the area.
    pub(super) fn middle(&self, share: f64) -> DVec3 {
        let (_, [a, b, c], _) = self.triangle(share);
        (a + b + c) / 3.0
    }

    /// The triangle at a share of the area, and where in its own.
    pub(super) fn triangle(&self, share: f64) -> (FaceId, [DVec3; 3], f64) {
        let target = share * self.area();
        let last = self.triangles.len() - 1;
        let index = self.cumulative.partition_point(|&c| c <= target).min(last);
        let below = if index == 0 {
            0.0
        } else {
            self.cumulative[index - 1]
        };
        let own = self.cumulative[index] - below;
        let (face, corners) = self.triangles[index];
        (face, corners, ((target - below) / own).clamp(0.0, 1.0))
    }
}

/// The walls of a region and what they divide.
///
/// The region's shape numbers its elements from zero; the first part of an element that is divided keeps its
/// number, the others follow behind all elements.
#[derive(Clone, Debug)]
pub(super) struct Cuts {
    /// Unit normal of the surface.
    normal: DVec3,
    guard: f64,
    /// Position in `entries` of each element of the shape.
    slots: Vec<u32>,
    entries: Vec<Entry>,
    parts: Vec<Part>,
    /// Of each part behind the elements.
    extra: Vec<u32>,
}

impl Cuts {
    /// No walls yet over `elements` elements.
    pub(super) fn new(normal: DVec3, guard: f64, elements: u32) -> Self {
        Self {
            normal,
            guard,
            slots: vec![NONE; elements as usize],
            entries: Vec::new(),
            parts: Vec::new(),
            extra: Vec::new(),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Adds walls beside an element.
    pub(super) fn add(&mut self, element: u32, walls: Vec<Wall>) {
        self.slots[element as usize] = self.entries.len() as u32;
        self.entries.push(Entry {
            element,
            walls,
            cut: None,
        });
    }

    /// Adds an element that is divided: `part_of` tells for each cell of the tree which of the parts (as
    /// polygons with their faces) it belongs to.
    pub(super) fn divide(
        &mut self,
        element: u32,
        walls: Vec<Wall>,
        tree: Tree,
        part_of: &[usize],
        parts: Vec<Vec<Piece>>,
    ) {
        let entry = self.entries.len() as u32;
        let first = self.parts.len();
        for (index, pieces) in parts.into_iter().enumerate() {
            let number = if index == 0 {
                element
            } else {
                self.extra.push(self.parts.len() as u32);
                (self.slots.len() + self.extra.len() - 1) as u32
            };
            let mut part = Part {
                entry,
                element: number,
                polygons: Vec::with_capacity(pieces.len()),
                triangles: Vec::with_capacity(2 * pieces.len()),
                cumulative: Vec::with_capacity(2 * pieces.len()),
            };
            let mut area = 0.0;
            for (face, polygon) in pieces {
                for triangle in fan(&polygon) {
                    area += triangle_area(triangle);
                    part.triangles.push((face, triangle));
                    part.cumulative.push(area);
                }
                part.polygons.push(polygon);
            }
            self.parts.push(part);
        }
        let part_of = part_of.iter().map(|part| (first + part) as u32).collect();
        self.slots[element as usize] = entry;
        self.entries.push(Entry {
            element,
            walls,
            cut: Some((tree, part_of)),
        });
    }

    /// Parts behind the elements of the shape.
    pub(super) fn extra(&self) -> u32 {
        self.extra.len() as u32
    }

    fn entry(&self, element: u32) -> Option<&Entry> {
        let slot = *self.slots.get(element as usize)?;
        self.entries.get(slot as usize)
    }

    /// The part that an element of the region stands for; `None` where it is not divided.
    pub(super) fn part(&self, element: u32) -> Option<&Part> {
        let index = match (element as usize).checked_sub(self.slots.len()) {
            Some(extra) => self.extra[extra],
            None => *self.entry(element)?.cut.as_ref()?.1.iter().min()?,
        };
        Some(&self.parts[index as usize])
    }

    /// The element of the shape that an element of the region is or belongs to.
    pub(super) fn whole(&self, element: u32) -> u32 {
        match (element as usize).checked_sub(self.slots.len()) {
            Some(extra) => {
                let part = &self.parts[self.extra[extra] as usize];
                self.entries[part.entry as usize].element
            }
            None => element,
        }
    }

    /// The element at a point, for light that comes to or from `seen_from`; `shape` finds the element of
    /// the shape.
    pub(super) fn element_at(
        &self,
        mut point: DVec3,
        seen_from: Option<DVec3>,
        shape: impl Fn(DVec3) -> u32,
    ) -> u32 {
        let mut element = shape(point);
        let Some(mut entry) = self.entry(element) else {
            return element;
        };
        if let Some(from) = seen_from
            && let Some(moved) = self.towards(entry, point, from)
        {
            point = moved;
            element = shape(point);
            let Some(other) = self.entry(element) else {
                return element;
            };
            entry = other;
        }
        match &entry.cut {
            None => element,
            Some((tree, part_of)) => {
                self.parts[part_of[tree.find(&entry.walls, point)] as usize].element
            }
        }
    }

    /// The point moved to the side of the walls beside it that a ray comes from; `None` where it stays.
    fn towards(&self, entry: &Entry, point: DVec3, from: DVec3) -> Option<DVec3> {
        let mut moved = None;
        let ray = point - from;
        let height = ray.dot(self.normal).abs();
        for wall in &entry.walls {
            let distance = wall.line.distance(point);
            let side = wall.plane.distance(from).signum();
            // Where the ray passed the wall's plane it was this high above the surface.
            let across = wall.line.normal.dot(ray).abs();
            let is_over = distance * side < 0.0 && distance.abs() * height > self.guard * across;
            if distance.abs() < self.guard || (distance * side < 0.0 && !is_over) {
                let to = side * self.guard - distance;
                moved = Some(moved.unwrap_or(point) + wall.line.normal * to);
            }
        }
        moved
    }

    /// A point of an element of the region moved out of the guards of its walls, to the side of `middle`,
    /// another point of it.
    pub(super) fn kept_off(&self, element: u32, mut point: DVec3, middle: DVec3) -> DVec3 {
        let entry = match self.part(element) {
            Some(part) => self.entries.get(part.entry as usize),
            None => self.entry(element),
        };
        for wall in entry.iter().flat_map(|entry| &entry.walls) {
            let side = wall.line.distance(middle).signum();
            let distance = wall.line.distance(point) * side;
            if distance < self.guard {
                point += wall.line.normal * (side * (self.guard - distance));
            }
        }
        point
    }
}
