//! From regions to patches: their numbers, areas and sizes, and their mean materials.

use super::box_tree::bounds_of;
use super::region::{Region, Shape};
use super::{Patches, Side};
use crate::geometry::Geometry;
use crate::surface::Surfaces;
use glam::DVec3;
use luxel_scenes::{Exitance, FaceId, Reflectance, Sidedness};

/// Numbers the patches and computes what they carry.
pub(super) fn assemble(
    surfaces: &Surfaces,
    mut regions: Vec<Region>,
    fronts_only: bool,
) -> Patches {
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
        let two_sided = !fronts_only && is_two_sided(surfaces, region);
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
                    Shape::Faces { .. } => {
                        area.sqrt().max(cluster_extent(geometry, region, element))
                    }
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

/// Extent of a patch of a cluster of several faces; zero for a single face, whose area says it all.
fn cluster_extent(geometry: &Geometry, region: &Region, element: u32) -> f64 {
    if region.faces.len() == 1 {
        return 0.0;
    }
    let [lower, upper] = bounds_of(region.polygons(geometry, element).iter().flatten());
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

/// Whether both sides of a region are seen.
pub(super) fn is_two_sided(surfaces: &Surfaces, region: &Region) -> bool {
    surfaces.material(region.faces[0]).sidedness == Sidedness::Both
}
