//! Polygons put into faces apart from the scene, so that many can be at once, and strung together in
//! order: what comes out does not depend on how many threads worked on it.

use super::polygon::{self, Shape};
use super::triangulate::triangulate;
use super::{Attributes, Corner, Outcome};
use crate::id::{FaceId, MaterialId, ObjectId};
use crate::scene::{Corners, Face, Scene};
use glam::DVec3;

/// Polygons of a fragment: some milliseconds of work. Smaller pays for more joints, larger leaves
/// threads idle at the end.
pub(crate) const FACES: usize = 1 << 14;

/// How many polygons of a fragment had one outcome, and the first of them by its number there.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Count {
    pub(crate) count: usize,
    pub(crate) first: usize,
}

impl Count {
    fn add(&mut self, number: usize) {
        if self.count == 0 {
            self.first = number;
        }
        self.count += 1;
    }
}

/// Faces on their way into a scene, whose vertices are there already.
#[derive(Debug, Default)]
pub(crate) struct Fragment {
    pub(crate) faces: Vec<Face>,
    corners: Corners,
    pub(crate) dropped: Count,
    pub(crate) concave: Count,
    pub(crate) non_planar: Count,
    polygons: usize,
    ring: Vec<Corner>,
    points: Vec<DVec3>,
}

impl Fragment {
    /// An empty fragment for so many polygons.
    pub(crate) fn with_capacity(polygons: usize) -> Self {
        let mut fragment = Self::default();
        fragment.faces.reserve(polygons);
        fragment.corners.vertex.reserve(3 * polygons);
        fragment
    }

    /// Adds a polygon, counter-clockwise from its front.
    pub(crate) fn push(
        &mut self,
        vertices: &[DVec3],
        corners: &[Corner],
        attributes: Attributes,
        (object, material): (ObjectId, MaterialId),
    ) -> Outcome {
        let number = self.polygons;
        self.polygons += 1;
        self.take_ring(vertices, corners);
        let shape = if self.ring.len() < 3 || !polygon::normalise(&mut self.points) {
            Shape::Degenerate
        } else {
            polygon::classify(&self.points)
        };
        match shape {
            Shape::Degenerate => {
                self.dropped.add(number);
                Outcome::Dropped
            }
            Shape::Convex => {
                let (faces, stored) = (&mut self.faces, &mut self.corners);
                push_face(faces, stored, &self.ring, attributes, (object, material));
                Outcome::Kept
            }
            Shape::Concave => {
                self.push_triangles(attributes, object, material);
                self.concave.add(number);
                Outcome::CutConcave
            }
            Shape::NonPlanar => {
                self.push_triangles(attributes, object, material);
                self.non_planar.add(number);
                Outcome::CutNonPlanar
            }
        }
    }

    /// Copies the corners, leaving out those at the same place as the one before.
    fn take_ring(&mut self, vertices: &[DVec3], corners: &[Corner]) {
        self.ring.clear();
        self.points.clear();
        for &corner in corners {
            let point = vertices[corner.vertex as usize];
            if self.points.last() != Some(&point) {
                self.ring.push(corner);
                self.points.push(point);
            }
        }
        while self.points.len() > 1 && self.points.first() == self.points.last() {
            self.ring.pop();
            self.points.pop();
        }
    }

    fn push_triangles(&mut self, attributes: Attributes, object: ObjectId, material: MaterialId) {
        let normal = polygon::doubled_area(&self.points).normalize();
        for triangle in triangulate(&self.points, normal) {
            let [a, b, c] = triangle.map(|i| self.points[i]);
            // Against the polygon's extent, which is one: a cut may leave slivers of rounding.
            if polygon::has_no_area((b - a).cross(c - a)) {
                continue;
            }
            let corners = triangle.map(|i| self.ring[i]);
            let (faces, stored) = (&mut self.faces, &mut self.corners);
            push_face(faces, stored, &corners, attributes, (object, material));
        }
    }
}

fn push_face(
    faces: &mut Vec<Face>,
    stored: &mut Corners,
    corners: &[Corner],
    attributes: Attributes,
    (object, material): (ObjectId, MaterialId),
) {
    let first = stored.vertex.len();
    faces.push(Face {
        first_corner: first as u32,
        corner_count: corners.len() as u32,
        object,
        material,
    });
    let corners = corners.iter();
    stored.vertex.extend(corners.clone().map(|c| c.vertex));
    let Attributes { normal, uv0, uv1 } = attributes;
    let normals = corners.clone().map(|c| c.normal);
    extend(&mut stored.normal, normal, first, normals);
    extend(&mut stored.uv0, uv0, first, corners.clone().map(|c| c.uv0));
    extend(&mut stored.uv1, uv1, first, corners.map(|c| c.uv1));
}

/// Appends an attribute to its array, which stays empty until the first face that has it.
fn extend<T: Copy + Default>(
    array: &mut Vec<T>,
    present: bool,
    first: usize,
    values: impl ExactSizeIterator<Item = T>,
) {
    if present {
        array.resize(first, T::default());
        array.extend(values);
    } else if !array.is_empty() {
        array.resize(first + values.len(), T::default());
    }
}

/// Adds the faces of fragments to a scene, in order.
///
/// # Panics
/// When the scene would have 2³² corners or more: readers check before.
pub(crate) fn append(scene: &mut Scene, fragments: Vec<Fragment>) {
    let sum = |count: fn(&Fragment) -> usize| fragments.iter().map(count).sum::<usize>();
    let (faces, corners) = (sum(|f| f.faces.len()), sum(|f| f.corners.vertex.len()));
    // Checked here once: corner indices are 32 bits wide.
    let _last = FaceId::new(scene.corners.vertex.len() + corners);
    scene.faces.reserve(faces);
    scene.corners.vertex.reserve(corners);
    if sum(|f| f.corners.normal.len()) > 0 {
        scene.corners.normal.reserve(corners);
    }
    if sum(|f| f.corners.uv0.len()) > 0 {
        scene.corners.uv0.reserve(corners);
    }
    for fragment in fragments {
        let first = scene.corners.vertex.len();
        let moved = fragment.faces.iter().map(|&face| Face {
            first_corner: face.first_corner + first as u32,
            ..face
        });
        scene.faces.extend(moved);
        scene.corners.append(fragment.corners);
    }
}
