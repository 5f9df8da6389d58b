//! The faces that stand across an element as walls do.
//!
//! A wall of an element is a plane with faces in it that rise from the element's surface, or end close
//! above it, to a height that light cannot get over nearby ([`LIFT`] of the element's size), and that are
//! about as long as the element. Furniture that is small against a patch is none: light goes around it.
//! Faces of one plane count together, so that a wall may be made of panels. Validity: faces nearly
//! parallel to the element (below about 3°) are never walls, nor are those that only stand along the
//! border of its region. Cost: a search in a tree of boxes for each element of the regions that have
//! such faces across them.

use super::box_tree::{Bounds, BoxTree, bounds_of, grown};
use super::plane::Plane;
use crate::geometry::Geometry;
use glam::DVec3;
use luxel_scenes::FaceId;

/// How high above an element light must pass to connect its parts, in sizes of the element. Lower, and a
/// slit below a door joins the patches on its sides; higher, and kerbs and skirting boards cut patches.
pub(super) const LIFT: f64 = 0.05;

/// Share of an element's width that faces of a wall must be as long as, together and each. Smaller,
/// and legs of furniture are looked at as walls; larger, and walls that are bent or made of many panels
/// are overlooked.
const LENGTH: f64 = 0.5;
const PANEL: f64 = 0.1;

/// Share of a chord that a wall must stand on to cut there. Whether light really does not pass is found
/// out by rays.
pub(super) const COVERED: f64 = 0.5;

/// Least sine of the angle between a wall and the surface.
const STEEP: f64 = 0.05;

/// Faces that may be walls.
pub(super) struct Obstacles {
    /// Least length along a surface.
    least: f64,
    faces: Vec<(FaceId, Vec<DVec3>)>,
    tree: BoxTree,
}

/// A plane across an element.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wall {
    /// Of the faces themselves: what lies on which side of them.
    pub(super) plane: Plane,
    /// Through the same line, perpendicular to the surface.
    pub(super) line: Plane,
}

/// A wall with the places that it takes up along its line.
pub(super) struct Barrier {
    pub(super) wall: Wall,
    pub(super) along: DVec3,
    spans: Vec<[f64; 2]>,
}

/// A part of a surface, and what is asked of walls across it.
pub(super) struct Surface<'e> {
    pub(super) polygons: Vec<&'e [DVec3]>,
    pub(super) normal: DVec3,
    /// Height in units that walls must reach above the surface.
    pub(super) lift: f64,
    /// Whether the surface has a back, too.
    pub(super) two_sided: bool,
    /// Within this distance in units points lie on a plane.
    pub(super) tolerance: f64,
}

impl Surface<'_> {
    fn corners(&self) -> impl Iterator<Item = &DVec3> + Clone {
        self.polygons.iter().copied().flatten()
    }

    fn bounds(&self) -> Bounds {
        bounds_of(self.corners())
    }

    /// Least and largest distance of the corners from a plane through the origin, or along a line.
    fn extent(&self, direction: DVec3) -> [f64; 2] {
        extent(self.corners(), direction)
    }

    /// Whether it lies in one plane, within the tolerance.
    pub(super) fn is_planar(&self) -> bool {
        let [low, high] = self.extent(self.normal);
        high - low <= self.tolerance
    }

    /// The plane through the line in which a wall's plane meets the surface, perpendicular to it.
    fn line(&self, wall: Plane) -> Plane {
        let [low, _] = self.extent(self.normal);
        let tilt = wall.normal.dot(self.normal);
        let across = wall.normal - self.normal * tilt;
        let length = across.length();
        Plane {
            normal: across / length,
            offset: (wall.offset - tilt * low) / length,
        }
    }

    /// The slabs of space, as least and largest height, in which walls stand.
    fn bands(&self) -> impl Iterator<Item = [f64; 2]> + use<> {
        let [low, high] = self.extent(self.normal);
        let lift = self.lift;
        let front = [low - self.tolerance, high + lift];
        let back = [low - lift, high + self.tolerance];
        [front].into_iter().chain(self.two_sided.then_some(back))
    }

    /// The part of a face in a band, if it goes through it from one end to the other: from the farther
    /// end, where light would pass, to somewhere on the way to the surface.
    fn stands(&self, face: &[DVec3], band: [f64; 2], is_front: bool) -> Option<Vec<DVec3>> {
        let [low, high] = extent(face, self.normal);
        let reaches = if is_front {
            high >= band[1] && low < band[1]
        } else {
            low <= band[0] && high > band[0]
        };
        if !reaches {
            return None;
        }
        let floor = Plane {
            normal: self.normal,
            offset: band[0],
        };
        let ceiling = Plane {
            normal: -self.normal,
            offset: -band[1],
        };
        let [_, above] = floor.split(face, 0.0);
        let [_, between] = ceiling.split(&above?, 0.0);
        between
    }
}

fn extent<'p>(points: impl IntoIterator<Item = &'p DVec3>, direction: DVec3) -> [f64; 2] {
    points
        .into_iter()
        .map(|p| p.dot(direction))
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, u], x| {
            [l.min(x), u.max(x)]
        })
}

/// The same of all that is in a box.
fn extent_of_box([lower, upper]: Bounds, direction: DVec3) -> [f64; 2] {
    let (centre, half) = (0.5 * (lower + upper), 0.5 * (upper - lower));
    let (middle, reach) = (centre.dot(direction), half.dot(direction.abs()));
    [middle - reach, middle + reach]
}

impl Obstacles {
    /// The faces of a scene whose extent is at least `least` units; along a surface they must be as long.
    pub(super) fn new(geometry: &Geometry, least: f64) -> Self {
        let faces: Vec<(FaceId, Vec<DVec3>)> = (0..geometry.face_count())
            .map(FaceId::new)
            .filter(|&face| geometry.extent(face) >= least)
            .map(|face| (face, geometry.polygon(face)))
            .collect();
        let tree = BoxTree::new(faces.iter().map(|(_, polygon)| bounds_of(polygon)));
        Self { least, faces, tree }
    }

    /// The faces, of others than `own`, that may be walls of elements of a region: its whole surface, with
    /// the lift of its largest element.
    pub(super) fn across(
        &self,
        geometry: &Geometry,
        own: &[FaceId],
        region: &Surface,
    ) -> Standing<'_> {
        let mut found = Vec::new();
        let own_bounds = region.bounds();
        let bounds = grown(own_bounds, region.lift + region.tolerance);
        let bands: Vec<[f64; 2]> = region.bands().collect();
        self.tree.search(&bounds, |position| {
            let (face, polygon) = &self.faces[position];
            let normal = geometry.normal(*face);
            let along = normal.cross(region.normal);
            let sine = along.length();
            let [start, end] = extent(polygon, along);
            // Legs of furniture are as long as walls, but not along the floor.
            if sine < STEEP || end - start < self.least * sine {
                return;
            }
            let [low, high] = extent(polygon, region.normal);
            let touches = bands.iter().any(|band| low <= band[1] && high >= band[0]);
            let plane = Plane::through(polygon[0], normal);
            let divides = |[low, high]: [f64; 2]| {
                low < plane.offset - region.tolerance && high > plane.offset + region.tolerance
            };
            // The box first: a cluster may have many corners.
            if touches
                && divides(extent_of_box(own_bounds, normal))
                && !own.contains(face)
                && divides(region.extent(normal))
            {
                found.push((plane, polygon.as_slice()));
            }
        });
        // The tree's order depends on the rest of the scene.
        found.sort_by(|a, b| a.0.offset.total_cmp(&b.0.offset));
        let boxes = found.iter().map(|(_, polygon)| bounds_of(*polygon));
        Standing {
            tree: BoxTree::new(boxes),
            faces: found,
        }
    }
}

/// Faces that may stand across elements of a region.
pub(super) struct Standing<'o> {
    faces: Vec<(Plane, &'o [DVec3])>,
    tree: BoxTree,
}

impl Standing<'_> {
    pub(super) fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }

    /// The walls across an element.
    pub(super) fn barriers(&self, element: &Surface) -> Vec<Barrier> {
        let mut near = Vec::new();
        let own_bounds = element.bounds();
        let bounds = grown(own_bounds, element.lift + element.tolerance);
        self.tree.search(&bounds, |position| near.push(position));
        if near.is_empty() {
            return Vec::new();
        }
        near.sort_unstable();
        let bands: Vec<([f64; 2], bool)> = element.bands().zip([true, false]).collect();
        let mut barriers: Vec<Barrier> = Vec::new();
        for (plane, polygon) in near.into_iter().map(|position| self.faces[position]) {
            let meets = |[low, high]: [f64; 2]| {
                low <= plane.offset + element.tolerance && high >= plane.offset - element.tolerance
            };
            if !meets(extent_of_box(own_bounds, plane.normal))
                || !meets(element.extent(plane.normal))
            {
                continue;
            }
            let along = plane.normal.cross(element.normal).normalize();
            let [start, end] = element.extent(along);
            let is_panel = |[low, high]: &[f64; 2]| high - low >= PANEL * (end - start);
            let spans: Vec<[f64; 2]> = bands
                .iter()
                .filter_map(|&(band, is_front)| element.stands(polygon, band, is_front))
                .map(|part| extent(&part, along))
                .filter(is_panel)
                .collect();
            if spans.is_empty() {
                continue;
            }
            let same = barriers.iter_mut().find(|barrier| {
                let plane = barrier.wall.plane;
                polygon
                    .iter()
                    .all(|&p| plane.distance(p).abs() <= element.tolerance)
            });
            if let Some(barrier) = same {
                let flip = |[low, high]: [f64; 2]| {
                    if barrier.wall.plane.normal.dot(plane.normal) < 0.0 {
                        [-high, -low]
                    } else {
                        [low, high]
                    }
                };
                barrier.spans.extend(spans.into_iter().map(flip));
                continue;
            }
            let line = element.line(plane);
            barriers.push(Barrier {
                wall: Wall { plane, line },
                along,
                spans,
            });
        }
        for barrier in &mut barriers {
            merge(&mut barrier.spans, element.tolerance);
        }
        barriers.retain(|barrier| {
            let [start, end] = element.extent(barrier.along);
            let length: f64 = barrier.spans.iter().map(|[low, high]| high - low).sum();
            length >= LENGTH * (end - start)
        });
        barriers
    }
}

/// Joins spans that overlap or touch.
fn merge(spans: &mut Vec<[f64; 2]>, tolerance: f64) {
    spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut merged: Vec<[f64; 2]> = Vec::with_capacity(spans.len());
    for &[low, high] in spans.iter() {
        match merged.last_mut() {
            Some(last) if low <= last[1] + tolerance => last[1] = last[1].max(high),
            _ => merged.push([low, high]),
        }
    }
    *spans = merged;
}

impl Barrier {
    /// Share of a chord along the wall's line that faces stand on.
    pub(super) fn covered(&self, [start, end]: [f64; 2]) -> f64 {
        let length: f64 = self
            .spans
            .iter()
            .map(|[low, high]| (high.min(end) - low.max(start)).max(0.0))
            .sum();
        length / (end - start)
    }
}
