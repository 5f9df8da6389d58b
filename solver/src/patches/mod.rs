//! Patches: the pieces of surface that carry one radiosity each.
//!
//! A face that is large against the patch size is a *region* with a grid of elements in its own
//! parameter space; coplanar pairs of triangles are joined to quads first. Faces that are small
//! against the patch size are clustered in the order of the ray tree's leaves, so that the number
//! of patches follows the light and not the triangle count. A hit finds its patch by one lookup:
//! triangle → region → element. Two-sided faces have a patch for each side. Elements on which walls stand
//! that light cannot pass are divided along them (`separation`), so that no patch lies in two rooms.

mod assemble;
mod box_tree;
mod clipped;
mod cluster;
mod cuts;
mod density;
mod forest;
mod mesh;
mod partition;
mod plane;
mod quad_grid;
mod quads;
mod refined;
mod region;
mod separation;
mod triangle_grid;
mod walls;

pub use density::Density;
pub use mesh::{MAX_PATCHES, MeshError, PatchSize};
pub use region::SurfaceSample;

use crate::geometry::{Geometry, TriangleId, triangle_count};
use glam::DVec3;
use luxel_scenes::{Exitance, FaceId, Reflectance, Scene};
use region::Region;

/// Index of a patch in [`Patches`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PatchId(pub u32);

impl PatchId {
    /// The id of the `index`-th patch.
    pub fn new(index: usize) -> Self {
        Self(index as u32)
    }

    /// The position in arrays by patch.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A side of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Where the corners run counter-clockwise.
    Front,
    /// The other.
    Back,
}

impl Side {
    /// The side of a face of the given unit normal that a ray of the given direction arrives at.
    pub fn facing(direction: DVec3, normal: DVec3) -> Self {
        if direction.dot(normal) < 0.0 {
            Self::Front
        } else {
            Self::Back
        }
    }
}

/// Every patch of a scene, as arrays by [`PatchId`]. Lengths and areas are in the unit frame.
pub struct Patches {
    regions: Vec<Region>,
    /// Region of each triangle.
    triangle_region: Vec<u32>,
    /// Region of each patch.
    patch_region: Vec<u32>,
    area: Vec<f64>,
    size: Vec<f32>,
    reflectance: Vec<Reflectance>,
    emission: Vec<Exitance>,
}

impl Patches {
    /// Number of patches.
    pub fn len(&self) -> usize {
        self.area.len()
    }

    /// True when the scene has no faces.
    pub fn is_empty(&self) -> bool {
        self.area.is_empty()
    }

    /// The most patches that a mesh of about `count` has before walls divide any: the mesher stops within a tenth.
    pub fn at_most(count: usize) -> usize {
        count + count / 10
    }

    /// Memory that so many patches of a scene take, in bytes, in quadtrees where they follow a density. Walls
    /// that divide patches are not known before they are found.
    pub fn bytes_for(patches: usize, scene: &Scene) -> usize {
        let faces = scene.faces.len();
        patches * (size_of::<(f64, Reflectance, Exitance, u32, f32)>() + forest::BYTES_A_LEAF)
            + triangle_count(scene) * size_of::<u32>()
            + patches.min(faces) * size_of::<Region>()
            + faces * size_of::<(f64, FaceId)>()
    }

    /// All ids in order.
    pub fn ids(&self) -> impl ExactSizeIterator<Item = PatchId> + use<> {
        (0..self.len() as u32).map(PatchId)
    }

    /// Areas in square units; [`crate::geometry::UnitFrame::area_to_world`] makes them m².
    pub fn areas(&self) -> &[f64] {
        &self.area
    }

    /// The linear size of a patch in units: the side of a square element of the same area, or the
    /// extent of a cluster.
    pub fn size(&self, patch: PatchId) -> f32 {
        self.size[patch.index()]
    }

    /// Mean diffuse reflectance of each patch.
    pub fn reflectances(&self) -> &[Reflectance] {
        &self.reflectance
    }

    /// Mean emitted exitance of each patch in W/m².
    pub fn emissions(&self) -> &[Exitance] {
        &self.emission
    }

    /// The patch at a point of a triangle (weights u, v of its second and third corner); `None` on
    /// the back of a one-sided face. At the foot of a wall it may be that of either side.
    pub fn at(
        &self,
        geometry: &Geometry,
        triangle: TriangleId,
        u: f64,
        v: f64,
        side: Side,
    ) -> Option<PatchId> {
        self.find(
            triangle,
            || geometry.interpolate(triangle, u, v),
            side,
            None,
        )
    }

    /// The patch that a ray sees at a `position` of a triangle, as [`Patches::at`]; within rounding of the
    /// foot of a wall that on the side that the ray comes from. `before` is its origin, or any other point of
    /// its line before the hit; both in the unit frame.
    pub fn seen_from(
        &self,
        before: DVec3,
        triangle: TriangleId,
        position: impl FnOnce() -> DVec3,
        side: Side,
    ) -> Option<PatchId> {
        self.find(triangle, position, side, Some(before))
    }

    /// Patches of clusters of faces need no position.
    fn find(
        &self,
        triangle: TriangleId,
        position: impl FnOnce() -> DVec3,
        side: Side,
        seen_from: Option<DVec3>,
    ) -> Option<PatchId> {
        let region = &self.regions[self.triangle_region[triangle.index()] as usize];
        let first = match side {
            Side::Front => region.first,
            Side::Back => region.first_back?,
        };
        Some(PatchId(first + region.element_at(position, seen_from)))
    }

    /// A point of a patch, uniform by area for uniform `sample` in [0, 1)².
    pub fn sample(&self, geometry: &Geometry, patch: PatchId, sample: [f64; 2]) -> SurfaceSample {
        let region = &self.regions[self.patch_region[patch.index()] as usize];
        let (element, side) = region.element_of(patch.0);
        region.sample(geometry, element, side, sample)
    }

    /// The planar convex polygons that make up a patch, in the unit frame, counter-clockwise seen
    /// from the patch's own side.
    pub fn polygons(&self, geometry: &Geometry, patch: PatchId) -> Vec<Vec<DVec3>> {
        let region = &self.regions[self.patch_region[patch.index()] as usize];
        let (element, side) = region.element_of(patch.0);
        let mut polygons = region.polygons(geometry, element);
        if side == Side::Back {
            for polygon in &mut polygons {
                polygon.reverse();
            }
        }
        polygons
    }

    /// The faces that the patch belongs to and the side that it lies on. They share their material,
    /// but the faces of a cluster may belong to several objects.
    pub fn faces(&self, patch: PatchId) -> (&[FaceId], Side) {
        let region = &self.regions[self.patch_region[patch.index()] as usize];
        (&region.faces, region.element_of(patch.0).1)
    }
}

#[cfg(test)]
mod tests;

#[cfg(test)]
mod separation_tests;
