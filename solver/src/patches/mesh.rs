//! The patch mesher: from faces to patches of about one size.

use super::Patches;
use super::assemble::{assemble, is_two_sided};
use super::clipped::Clipped;
use super::cluster::cluster;
use super::density::{self, Density};
use super::quad_grid::QuadGrid;
use super::quads;
use super::region::{Region, Shape};
use super::separation::separate;
use super::triangle_grid::TriangleGrid;
use crate::bvh::Bvh;
use crate::surface::Surfaces;
use glam::DVec3;
use luxel_scenes::FaceId;
use std::collections::HashSet;
use thiserror::Error;

/// How finely to mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PatchSize {
    /// Side of a square patch, in metres.
    Length(f64),
    /// About this many patches.
    Count(usize),
    /// One patch for each face of the scene, or for each part of it that walls on it separate.
    Whole,
    /// One patch for each object of the scene that has faces, in the order of objects, for its
    /// front: what form factors between objects are computed from.
    Objects,
}

/// Why a mesh cannot be made.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum MeshError {
    /// The length is not a positive number.
    #[error("patch size {0} m is not a positive length; give a length in metres such as 0.1")]
    Size(f64),
    /// More patches than ids.
    #[error(
        "a patch size of {size} m cuts this scene into {count:.0} patches, more than the limit of \
         {limit}; give a larger size"
    )]
    TooMany {
        /// The size asked for, in metres.
        size: f64,
        /// The number of patches that it would make.
        count: f64,
        /// The largest number allowed.
        limit: usize,
    },
}

/// Largest number of patches: ids keep two bits for the classes of transport rows.
pub const MAX_PATCHES: usize = 1 << 29;

/// Faces of at least this share of a patch's area get elements of their own; smaller ones are
/// clustered. Above one, faces just over the limit would become single patches of odd sizes.
const LARGE_FACE: f64 = 0.7;

/// How near to the wanted number of patches the mesher tries to come.
const COUNT_TOLERANCE: f64 = 0.1;

impl Patches {
    /// Meshes a scene, everywhere as finely.
    ///
    /// # Errors
    /// [`MeshError`] when the size is not a positive number or makes too many patches.
    pub fn mesh(surfaces: &Surfaces, bvh: &Bvh, size: PatchSize) -> Result<Self, MeshError> {
        let regions = Mesher::new(surfaces, bvh, None).regions(size)?;
        if size == PatchSize::Objects {
            return Ok(assemble(surfaces, regions, true));
        }
        Ok(separated(surfaces, bvh, regions))
    }

    /// Number of patches that [`Patches::mesh`] will make, before walls divide any. Where the area alone makes more
    /// than `enough`, that number, without a mesh.
    ///
    /// # Errors
    /// As [`Patches::mesh`].
    pub fn count(
        surfaces: &Surfaces,
        bvh: &Bvh,
        size: PatchSize,
        enough: usize,
    ) -> Result<usize, MeshError> {
        let mesher = Mesher::new(surfaces, bvh, None);
        let by_area = match size {
            PatchSize::Count(count) => count,
            PatchSize::Length(length) => {
                let unit = surfaces.geometry().frame().metres_per_unit;
                // Rounding leaves half of a patch where it is a face.
                (0.5 * mesher.total * (unit / length).powi(2)) as usize
            }
            PatchSize::Whole | PatchSize::Objects => 0,
        };
        if by_area > enough {
            return Ok(by_area);
        }
        let regions = mesher.regions(size)?;
        let count = |region: &Region| {
            let both = size != PatchSize::Objects && is_two_sided(surfaces, region);
            region.element_count() as usize * (1 + usize::from(both))
        };
        Ok(regions.iter().map(count).sum())
    }

    /// Meshes a scene into about `count` patches, as finely in each place as `density` says: from
    /// face to face, and within a large one by quadtrees over its grid.
    ///
    /// # Errors
    /// [`MeshError`] when the count makes too many patches.
    pub fn mesh_with_density(
        surfaces: &Surfaces,
        bvh: &Bvh,
        count: usize,
        density: &Density,
    ) -> Result<Self, MeshError> {
        let regions = Mesher::new(surfaces, bvh, Some(density)).divide_into(count)?;
        Ok(separated(surfaces, bvh, regions))
    }
}

/// The patches of regions, with their elements divided where walls separate parts of them.
pub(super) fn separated(surfaces: &Surfaces, bvh: &Bvh, mut regions: Vec<Region>) -> Patches {
    separate(surfaces, bvh, &mut regions);
    assemble(surfaces, regions, false)
}

/// One region for each object with faces.
fn objects(surfaces: &Surfaces, areas: &[f64]) -> Vec<Region> {
    let scene = surfaces.scene();
    let mut members = vec![Vec::new(); scene.objects.len()];
    for (index, face) in scene.faces.iter().enumerate() {
        members[face.object.index()].push(FaceId::new(index));
    }
    members
        .into_iter()
        .filter(|faces| !faces.is_empty())
        .map(|faces| single(faces, areas))
        .collect()
}

/// What regions are made from.
pub(super) struct Mesher<'m, 's> {
    surfaces: &'m Surfaces<'s>,
    bvh: &'m Bvh,
    /// Of each face.
    areas: Vec<f64>,
    /// Of all faces.
    total: f64,
    density: Option<&'m Density>,
}

impl<'m, 's> Mesher<'m, 's> {
    pub(super) fn new(
        surfaces: &'m Surfaces<'s>,
        bvh: &'m Bvh,
        density: Option<&'m Density>,
    ) -> Self {
        let areas: Vec<f64> = (0..surfaces.geometry().face_count())
            .map(|index| surfaces.area(FaceId::new(index)))
            .collect();
        let total = areas.iter().sum();
        Self {
            surfaces,
            bvh,
            areas,
            total,
            density,
        }
    }

    /// The regions of a mesh.
    fn regions(&self, size: PatchSize) -> Result<Vec<Region>, MeshError> {
        match size {
            PatchSize::Whole => Ok((0..self.areas.len())
                .map(|i| single(vec![FaceId::new(i)], &self.areas))
                .collect()),
            PatchSize::Objects => Ok(objects(self.surfaces, &self.areas)),
            PatchSize::Length(length) => {
                if !(length > 0.0 && length.is_finite()) {
                    return Err(MeshError::Size(length));
                }
                self.divide(length / self.surfaces.geometry().frame().metres_per_unit)
            }
            PatchSize::Count(count) => self.divide_into(count),
        }
    }

    /// Patches per area on a face, relative to the mean.
    fn face_density(&self, face: FaceId) -> f64 {
        self.density.map_or(1.0, |density| density.face(face))
    }

    /// Cuts the scene into about `count` elements.
    fn divide_into(&self, count: usize) -> Result<Vec<Region>, MeshError> {
        let wanted = count.max(1) as f64;
        let mut side = (self.total / wanted).sqrt();
        let mut regions = self.divide(side)?;
        for _ in 0..3 {
            let made: f64 = regions.iter().map(|r| f64::from(r.element_count())).sum();
            let ratio = made / wanted;
            if (ratio - 1.0).abs() <= COUNT_TOLERANCE {
                break;
            }
            side *= ratio.sqrt();
            regions = self.divide(side)?;
        }
        Ok(regions)
    }

    /// Cuts the scene into regions with elements of side `size` (in units) where the density is one.
    fn divide(&self, size: f64) -> Result<Vec<Region>, MeshError> {
        let geometry = self.surfaces.geometry();
        if self.total / (size * size) > MAX_PATCHES as f64 {
            return Err(MeshError::TooMany {
                size: size * geometry.frame().metres_per_unit,
                count: self.total / (size * size),
                limit: MAX_PATCHES,
            });
        }
        let faces: Vec<FaceId> = (0..self.areas.len()).map(FaceId::new).collect();
        let mut seen = vec![false; self.areas.len()];
        let ordered: Vec<FaceId> = self
            .bvh
            .leaf_order()
            .iter()
            .map(|&triangle| geometry.face(triangle))
            .filter(|face| !std::mem::replace(&mut seen[face.index()], true))
            .collect();
        Ok(self.divide_faces(&faces, &ordered, size))
    }

    /// Cuts some faces into regions; `ordered` are the same faces as neighbours in space.
    pub(super) fn divide_faces(
        &self,
        faces: &[FaceId],
        ordered: &[FaceId],
        size: f64,
    ) -> Vec<Region> {
        let geometry = self.surfaces.geometry();
        let is_large = |face: FaceId| {
            self.areas[face.index()] * self.face_density(face) >= LARGE_FACE * size * size
        };
        let large: Vec<FaceId> = faces.iter().copied().filter(|&f| is_large(f)).collect();
        let mut regions = Vec::new();
        let mut joined = HashSet::new();
        for quad in quads::join(geometry, &large, |face| self.surfaces.material_id(face)) {
            for face in quad.faces {
                joined.insert(face);
            }
            let shape = self.quad_shape(quad.corners, &quad.faces, size);
            regions.push(region(shape, quad.faces.to_vec()));
        }
        for &face in large.iter().filter(|face| !joined.contains(*face)) {
            let polygon = geometry.polygon(face);
            let shape = if let Ok(corners) = <[DVec3; 4]>::try_from(polygon.as_slice())
                && quads::is_convex(corners, geometry.normal(face))
            {
                self.quad_shape(corners, &[face], size)
            } else if let Ok(corners) = <[DVec3; 3]>::try_from(polygon.as_slice()) {
                self.triangle_shape(corners, face, size)
            } else {
                polygon_shape(&polygon, size / self.face_density(face).sqrt())
            };
            regions.push(region(shape, vec![face]));
        }
        let small = ordered.iter().copied().filter(|&face| !is_large(face));
        let clusters = cluster(
            geometry,
            small,
            |face| self.surfaces.material_id(face),
            |face| self.areas[face.index()],
            |face| size / self.face_density(face).sqrt(),
        );
        regions.extend(
            clusters
                .into_iter()
                .map(|members| single(members, &self.areas)),
        );
        regions
    }

    fn quad_shape(&self, corners: [DVec3; 4], faces: &[FaceId], size: f64) -> Shape {
        let Some(density) = self.density else {
            return Shape::Quad(QuadGrid::new(corners, size));
        };
        let at = |position| density.at(self.surfaces, faces, position);
        let whole = QuadGrid::new(corners, f64::INFINITY);
        let cells = faces
            .iter()
            .map(|face| self.areas[face.index()] * density.face(*face))
            .sum::<f64>()
            / (size * size);
        let wanted: Vec<f64> = density::centres(density::region_samples(cells))
            .map(|[s, t]| at(whole.at(s, t)))
            .collect();
        let grid = density::grid_density(&wanted);
        let shape = QuadGrid::new(corners, size / grid.sqrt());
        Shape::Quad(shape.divided(|node| {
            let own = grid * 4f64.powi(i32::from(node.level));
            density::divides(own, |sample| at(shape.point(node, sample)))
        }))
    }

    fn triangle_shape(&self, corners: [DVec3; 3], face: FaceId, size: f64) -> Shape {
        let area = self.areas[face.index()];
        let Some(density) = self.density else {
            return Shape::Triangle(TriangleGrid::new(corners, area, size));
        };
        let at = |position| density.at(self.surfaces, &[face], position);
        let whole = TriangleGrid::new(corners, area, f64::INFINITY);
        let samples = density::region_samples(area * density.face(face) / (size * size));
        let wanted: Vec<f64> = density::centres(samples)
            .map(fold)
            .map(|[x, y]| at(whole.at(x, y)))
            .collect();
        let grid = density::grid_density(&wanted);
        let shape = TriangleGrid::new(corners, area, size / grid.sqrt());
        Shape::Triangle(shape.divided(|node| {
            let own = grid * 4f64.powi(i32::from(node.level));
            density::divides(own, |sample| at(shape.point(node, fold(sample))))
        }))
    }
}

/// Folds the unit square onto the half of it below its diagonal: weights of two corners of a
/// triangle.
fn fold([x, y]: [f64; 2]) -> [f64; 2] {
    if x + y <= 1.0 {
        [x, y]
    } else {
        [1.0 - x, 1.0 - y]
    }
}

pub(super) fn region(shape: Shape, faces: Vec<FaceId>) -> Region {
    Region {
        shape,
        faces,
        cuts: None,
        is_examined: false,
        first: 0,
        first_back: None,
    }
}

/// One patch of whole faces.
fn single(members: Vec<FaceId>, areas: &[f64]) -> Region {
    let total: f64 = members.iter().map(|face| areas[face.index()]).sum();
    let mut sum = 0.0;
    let cumulative = members
        .iter()
        .map(|face| {
            sum += areas[face.index()] / total;
            sum
        })
        .collect();
    region(Shape::Faces { cumulative }, members)
}

/// A polygon of five or more corners is covered by the grid of its box in its own plane.
pub(super) fn polygon_shape(polygon: &[DVec3], size: f64) -> Shape {
    Shape::Clipped(Clipped::new(polygon, size))
}
