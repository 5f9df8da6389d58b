//! Meshes whose marked patches are divided.

use super::Patches;
use super::mesh::{Mesher, polygon_shape, region, separated};
use super::region::Shape;
use crate::bvh::Bvh;
use crate::surface::Surfaces;

impl Patches {
    /// The mesh with the marked patches divided: elements of grids in four (and neighbours with them,
    /// so that elements that share an edge differ by one level at most), clusters into smaller ones,
    /// and polygons of five and more corners as a whole where half of their area is marked. A patch
    /// of one side is divided when its other side is.
    ///
    /// # Panics
    /// When there is not one mark per patch.
    #[must_use]
    pub fn refined(&self, surfaces: &Surfaces, bvh: &Bvh, marked: &[bool]) -> Self {
        assert_eq!(marked.len(), self.len(), "one mark for each patch");
        let geometry = surfaces.geometry();
        let mesher = Mesher::new(surfaces, bvh, None);
        let mut regions = Vec::new();
        for old in &self.regions {
            let count = old.shape_count();
            let mut is_marked = vec![false; count as usize];
            for element in 0..old.element_count() {
                let firsts = [Some(old.first), old.first_back];
                is_marked[old.whole(element) as usize] |= firsts
                    .into_iter()
                    .flatten()
                    .any(|first| marked[(first + element) as usize]);
            }
            if !is_marked.contains(&true) {
                regions.push(old.clone());
                continue;
            }
            let is_marked = |element: u32| is_marked[element as usize];
            let shape = match &old.shape {
                Shape::Quad(quad) => Shape::Quad(quad.refined(is_marked)),
                Shape::Triangle(triangle) => Shape::Triangle(triangle.refined(is_marked)),
                Shape::Clipped(clipped) => {
                    let area = |wanted: bool| -> f64 {
                        (0..count)
                            .filter(|&element| is_marked(element) || !wanted)
                            .map(|element| old.shape_area(geometry, element))
                            .sum()
                    };
                    if area(true) < 0.5 * area(false) {
                        old.shape.clone()
                    } else {
                        let polygon = geometry.polygon(old.faces[0]);
                        polygon_shape(&polygon, 0.5 * clipped.cell())
                    }
                }
                Shape::Faces { .. } => {
                    let size = 0.5 * old.shape_area(geometry, 0).sqrt();
                    let mut faces = old.faces.clone();
                    faces.sort_unstable_by_key(|face| face.index());
                    regions.extend(mesher.divide_faces(&faces, &old.faces, size));
                    continue;
                }
            };
            regions.push(region(shape, old.faces.clone()));
        }
        separated(surfaces, bvh, regions)
    }
}
