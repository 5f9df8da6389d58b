//! The page that each face is drawn with, and the texels that faces take there.
//!
//! A face without a chart in an object that has charts is a sliver that covers no texel; it still needs light, and gets the
//! page of a face of its object that meets it in the atlas, or else the object's first page. Cost: one pass over the faces,
//! and a table of corners where there are slivers.

use crate::lightmap::atlas::Atlas;
use luxel_scenes::{FaceId, ObjectId, Scene};
use std::collections::HashMap;

/// A corner in the atlas: object, vertex, and the bits of its place.
type Corner = (ObjectId, u32, [u64; 2]);

/// The page of each face; `None` where the object has no lightmap.
pub(super) struct Pages {
    of_face: Vec<Option<u32>>,
}

impl Pages {
    /// Finds the page of each face.
    pub(super) fn new(scene: &Scene, atlas: &Atlas) -> Self {
        let mut of_face: Vec<Option<u32>> = scene
            .face_ids()
            .map(|face| atlas.chart(face).map(|(_, chart)| chart.page))
            .collect();
        let mut first = vec![None; scene.objects.len()];
        for (face, page) in scene.faces.iter().zip(&of_face) {
            let first = &mut first[face.object.index()];
            *first = first.or(*page);
        }
        let slivers: Vec<FaceId> = scene
            .face_ids()
            .filter(|id| {
                let object = scene.faces[id.index()].object;
                of_face[id.index()].is_none() && first[object.index()].is_some()
            })
            .collect();
        if !slivers.is_empty() {
            let met = met(scene, atlas, &of_face);
            for face in slivers {
                let page = corners(scene, atlas, face).find_map(|corner| met.get(&corner).copied());
                let object = scene.faces[face.index()].object;
                of_face[face.index()] = page.or(first[object.index()]);
            }
        }
        Self { of_face }
    }

    /// The page of a face; `None` where it has no lightmap.
    pub(super) fn of(&self, face: FaceId) -> Option<u32> {
        self.of_face[face.index()]
    }
}

/// A page of each corner of faces that have one.
fn met(scene: &Scene, atlas: &Atlas, of_face: &[Option<u32>]) -> HashMap<Corner, u32> {
    let mut met = HashMap::new();
    for face in scene.face_ids() {
        if let Some(page) = of_face[face.index()] {
            for corner in corners(scene, atlas, face) {
                met.entry(corner).or_insert(page);
            }
        }
    }
    met
}

fn corners(scene: &Scene, atlas: &Atlas, face: FaceId) -> impl Iterator<Item = Corner> {
    let face = scene.faces[face.index()];
    face.corners().map(move |corner| {
        let place = atlas.corners[corner].to_array().map(f64::to_bits);
        (face.object, scene.corners.vertex[corner], place)
    })
}

/// The rectangle of the texels of some faces of one page: lower and upper corner in texture coordinates, v down.
pub(super) fn rectangle(scene: &Scene, atlas: &Atlas, faces: &[FaceId]) -> [[f64; 2]; 2] {
    let size = atlas.size.map(|texels| texels as f64);
    let mut lower = size;
    let mut upper = [0.0_f64; 2];
    for face in faces {
        for corner in scene.faces[face.index()].corners() {
            let place = atlas.corners[corner].to_array();
            for axis in 0..2 {
                lower[axis] = lower[axis].min(place[axis].floor().max(0.0));
                upper[axis] = upper[axis].max(place[axis].ceil().min(size[axis]));
            }
        }
    }
    [lower, upper].map(|corner| [corner[0] / size[0], corner[1] / size[1]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lightmap::export::testing;

    #[test]
    fn slivers_are_drawn_with_what_they_meet() {
        let scene = testing::cornell();
        let mut atlas = testing::atlas(&scene, 128);
        // All faces of the first object but one lie on page 1, and the other has no texels.
        let object = scene.faces[0].object;
        let own: Vec<usize> = (0..scene.faces.len())
            .filter(|&face| scene.faces[face].object == object)
            .collect();
        for &face in &own {
            let chart = atlas.face_chart[face].expect("all faces have charts");
            atlas.charts[chart.index()].page = 1;
        }
        atlas.face_chart[own[1]] = None;
        let pages = Pages::new(&scene, &atlas);
        assert_eq!(pages.of(FaceId::new(own[1])), Some(1));
        for &face in &own {
            atlas.face_chart[face] = None;
        }
        let pages = Pages::new(&scene, &atlas);
        assert_eq!(
            pages.of(FaceId::new(own[0])),
            None,
            "an object without charts"
        );
    }

    #[test]
    fn rectangles_hold_whole_texels() {
        let scene = testing::cornell();
        let atlas = testing::atlas(&scene, 128);
        let faces: Vec<FaceId> = scene.face_ids().collect();
        let all = atlas.rectangles(&scene);
        for (number, rectangles) in all.iter().enumerate() {
            let own = faces
                .iter()
                .copied()
                .filter(|face| scene.faces[face.index()].object.index() == number);
            let own: Vec<FaceId> = own.collect();
            let [min, max] = rectangle(&scene, &atlas, &own);
            let texels = |corner: [f64; 2]| corner.map(|x| (x * 128.0) as usize);
            assert_eq!(texels(min), rectangles[0].min);
            assert_eq!(texels(max), rectangles[0].max);
        }
    }
}
