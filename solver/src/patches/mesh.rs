//! The patch mesher: from faces to patches of about one size.

use super::clipped::Clipped;
use super::cluster::{self, cluster};
use super::quads;
use super::region::{Quad, Region, Shape};
use super::{PatchId, Patches, Side};
use crate::bvh::Bvh;
use crate::geometry::Geometry;
use crate::surface::Surfaces;
use glam::DVec3;
use luxel_scenes::{Exitance, FaceId, Reflectance, Sidedness};
use thiserror::Error;

/// How finely to mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PatchSize {
    /// Side of a square patch, in metres.
    Length(f64),
    /// About this many patches.
    Count(usize),
    /// One patch for each face of the scene.
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
    /// Meshes a scene.
    ///
    /// # Errors
    /// [`MeshError`] when the size is not a positive number or makes too many patches.
    pub fn mesh(surfaces: &Surfaces, bvh: &Bvh, size: PatchSize) -> Result<Self, MeshError> {
        let geometry = surfaces.geometry();
        let areas: Vec<f64> = (0..geometry.face_count())
            .map(|index| surfaces.area(FaceId::new(index)))
            .collect();
        let total: f64 = areas.iter().sum();
        let metres = geometry.frame().metres_per_unit;
        let regions = match size {
            PatchSize::Whole => (0..areas.len())
                .map(|i| single(vec![FaceId::new(i)], &areas))
                .collect(),
            PatchSize::Objects => objects(surfaces, &areas),
            PatchSize::Length(length) => {
                if !(length > 0.0 && length.is_finite()) {
                    return Err(MeshError::Size(length));
                }
                divide(surfaces, bvh, &areas, length / metres, total)?
            }
            PatchSize::Count(count) => {
                let wanted = count.max(1) as f64;
                let mut side = (total / wanted).sqrt();
                let mut regions = divide(surfaces, bvh, &areas, side, total)?;
                for _ in 0..3 {
                    let made: f64 = regions.iter().map(|r| f64::from(r.element_count())).sum();
                    let ratio = made / wanted;
                    if (ratio - 1.0).abs() <= COUNT_TOLERANCE {
                        break;
                    }
                    side *= ratio.sqrt();
                    regions = divide(surfaces, bvh, &areas, side, total)?;
                }
                regions
            }
        };
        Ok(assemble(surfaces, regions, size == PatchSize::Objects))
    }
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

/// Cuts the scene into regions with elements of side `size` (in units).
fn divide(
    surfaces: &Surfaces,
    bvh: &Bvh,
    areas: &[f64],
    size: f64,
    total: f64,
) -> Result<Vec<Region>, MeshError> {
    let geometry = surfaces.geometry();
    if total / (size * size) > MAX_PATCHES as f64 {
        return Err(MeshError::TooMany {
            size: size * geometry.frame().metres_per_unit,
            count: total / (size * size),
            limit: MAX_PATCHES,
        });
    }
    let is_large = |face: FaceId| areas[face.index()] >= LARGE_FACE * size * size;
    let large: Vec<FaceId> = (0..areas.len())
        .map(FaceId::new)
        .filter(|&f| is_large(f))
        .collect();
    let mut regions = Vec::new();
    let mut joined = vec![false; areas.len()];
    for quad in quads::join(geometry, &large, |face| surfaces.material_id(face)) {
        for face in quad.faces {
            joined[face.index()] = true;
        }
        regions.push(region(quad_shape(quad.corners, size), quad.faces.to_vec()));
    }
    for &face in large.iter().filter(|face| !joined[face.index()]) {
        let polygon = geometry.polygon(face);
        if let Ok(corners) = <[DVec3; 4]>::try_from(polygon.as_slice())
            && quads::is_convex(corners, geometry.normal(face))
        {
            regions.push(region(quad_shape(corners, size), vec![face]));
        } else if let Ok(corners) = <[DVec3; 3]>::try_from(polygon.as_slice()) {
            let side = (areas[face.index()].sqrt() / size).round().max(1.0) as u32;
            regions.push(region(Shape::Triangle { corners, side }, vec![face]));
        } else {
            regions.push(region(polygon_shape(&polygon, size), vec![face]));
        }
    }
    let mut seen = vec![false; areas.len()];
    let small = bvh
        .leaf_order()
        .iter()
        .map(|&triangle| geometry.face(triangle))
        .filter(|face| !is_large(*face) && !std::mem::replace(&mut seen[face.index()], true));
    let clusters = cluster(
        geometry,
        small,
        |face| surfaces.material_id(face),
        |face| areas[face.index()],
        size,
    );
    regions.extend(clusters.into_iter().map(|members| single(members, areas)));
    Ok(regions)
}

fn region(shape: Shape, faces: Vec<FaceId>) -> Region {
    Region {
        shape,
        faces,
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

fn quad_shape(corners: [DVec3; 4], size: f64) -> Shape {
    let [a, b, c, d] = corners;
    let count = |first: DVec3, second: DVec3| {
        ((first.length() + second.length()) / (2.0 * size))
            .round()
            .max(1.0) as u32
    };
    Shape::Quad(Quad {
        corners,
        counts: [count(b - a, c - d), count(d - a, c - b)],
    })
}

/// A polygon of five or more corners is covered by the grid of its box in its own plane.
fn polygon_shape(polygon: &[DVec3], size: f64) -> Shape {
    Shape::Clipped(Clipped::new(polygon, size))
}

/// Numbers the patches and computes what they carry.
fn assemble(surfaces: &Surfaces, mut regions: Vec<Region>, fronts_only: bool) -> Patches {
    let geometry = surfaces.geometry();
    let mut triangle_region = vec![0; geometry.len()];
    let mut patches = Patches {
        regions: Vec::new(),
        triangle_region: Vec::new(),
        patch_region: Vec::new(),
        area: Vec::new(),
        size: Vec::new(),
        reflectance: Vec::new(),
        emission: Vec::new(),
    };
    for (index, region) in regions.iter_mut().enumerate() {
        for triangle in region
            .faces
            .iter()
            .flat_map(|&face| geometry.triangles_of(face))
        {
            triangle_region[triangle.index()] = index as u32;
        }
        let two_sided =
            !fronts_only && surfaces.material(region.faces[0]).sidedness == Sidedness::Both;
        region.first = patches.area.len() as u32;
        let count = region.element_count();
        region.first_back = two_sided.then_some(region.first + count);
        for side in [Side::Front, Side::Back] {
            if side == Side::Back && !two_sided {
                continue;
            }
            for element in 0..count {
                let area = region.element_area(geometry, element);
                let size = match region.shape {
                    Shape::Faces { .. } => area.sqrt().max(cluster_extent(geometry, region)),
                    _ => area.sqrt(),
                };
                let (reflectance, emission) = mean_material(surfaces, region, element, side);
                patches.patch_region.push(index as u32);
                patches.area.push(area);
                patches.size.push(size as f32);
                patches.reflectance.push(reflectance);
                patches.emission.push(emission);
            }
        }
    }
    patches.regions = regions;
    patches.triangle_region = triangle_region;
    patches
}

/// Extent of a cluster of several faces; zero for a single face, whose area says it all.
fn cluster_extent(geometry: &Geometry, region: &Region) -> f64 {
    if region.faces.len() == 1 {
        return 0.0;
    }
    let (lower, upper) = region
        .faces
        .iter()
        .map(|&face| cluster::bounds(geometry, face))
        .fold(
            (DVec3::INFINITY, DVec3::NEG_INFINITY),
            |(lower, upper), (l, u)| (lower.min(l), upper.max(u)),
        );
    (upper - lower).max_element()
}

/// Mean reflectance and emission of an element. Textures, and the materials of an object of several,
/// are averaged over a regular grid of points; a single plain material costs nothing.
fn mean_material(
    surfaces: &Surfaces,
    region: &Region,
    element: u32,
    side: Side,
) -> (Reflectance, Exitance) {
    const GRID: usize = 4;
    let is_textured = |face: &FaceId| {
        let material = surfaces.material(*face);
        material.reflectance_texture.is_some() || material.emission_texture.is_some()
    };
    let first = surfaces.material_id(region.faces[0]);
    if region
        .faces
        .iter()
        .all(|&face| surfaces.material_id(face) == first)
        && !is_textured(&region.faces[0])
    {
        let material = surfaces.material(region.faces[0]);
        return (material.reflectance, material.emission.to_exitance());
    }
    let mut reflectance = DVec3::ZERO;
    let mut emission = Exitance::ZERO;
    for index in 0..GRID * GRID {
        let centre = |i: usize| (i as f64 + 0.5) / GRID as f64;
        let sample = region.sample(
            surfaces.geometry(),
            element,
            side,
            [centre(index % GRID), centre(index / GRID)],
        );
        let point = surfaces.locate(&region.faces, sample.position);
        reflectance += surfaces.reflectance(point).0;
        emission += surfaces.emission(point).to_exitance();
    }
    let weight = 1.0 / (GRID * GRID) as f64;
    (Reflectance(reflectance * weight), emission * weight)
}

impl PatchId {
    /// The id of the `index`-th patch.
    pub fn new(index: usize) -> Self {
        Self(index as u32)
    }
}
