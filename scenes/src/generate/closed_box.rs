//! A closed box seen from within.

use super::{Surface, assert_lengths, main_camera};
use crate::scene::Scene;
use glam::DVec3;

/// A closed box with its corners at the origin and at `size`, whose six walls face inwards: one
/// rectangle and one object each, named as in [`ClosedBox::WALLS`].
///
/// Exact: the form factors of a row sum to one. Where all walls are alike, the box is a furnace, see
/// [`furnace_box`].
#[derive(Clone, Debug, PartialEq)]
pub struct ClosedBox {
    /// Extent along x, y and z in metres.
    pub size: DVec3,
    /// The walls in the order of [`ClosedBox::WALLS`].
    pub walls: [Surface; 6],
}

/// Corners of each wall in units of the size, counter-clockwise from within.
const CORNERS: [[[f64; 3]; 4]; 6] = [
    [[0., 0., 0.], [0., 1., 0.], [0., 1., 1.], [0., 0., 1.]],
    [[1., 0., 0.], [1., 0., 1.], [1., 1., 1.], [1., 1., 0.]],
    [[0., 0., 0.], [0., 0., 1.], [1., 0., 1.], [1., 0., 0.]],
    [[0., 1., 0.], [1., 1., 0.], [1., 1., 1.], [0., 1., 1.]],
    [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]],
    [[0., 0., 1.], [0., 1., 1.], [1., 1., 1.], [1., 0., 1.]],
];

impl ClosedBox {
    /// Names of the walls: at x = 0, x = size, y = 0, y = size, z = 0 and z = size.
    pub const WALLS: [&str; 6] = ["left", "right", "floor", "ceiling", "back", "front"];

    /// The scene, with a camera inside.
    ///
    /// # Panics
    /// When an extent is not positive and finite, or a surface not physical.
    pub fn scene(&self) -> Scene {
        let mut scene = Scene {
            name: "box".to_owned(),
            ..Scene::default()
        };
        self.push(&mut scene);
        let [eye, target] = [DVec3::new(0.15, 0.2, 0.1), DVec3::new(0.8, 0.55, 0.9)];
        scene
            .cameras
            .push(main_camera(eye * self.size, target * self.size));
        scene
    }

    /// Adds the walls to a scene.
    pub(super) fn push(&self, scene: &mut Scene) {
        assert_lengths(&self.size.to_array());
        for ((name, surface), corners) in Self::WALLS.iter().zip(self.walls).zip(CORNERS) {
            let object = scene.push_object(*name);
            let material = surface.push(scene, name);
            let polygon = corners.map(|corner| DVec3::from(corner) * self.size);
            scene.push_face(&polygon, object, material);
        }
    }

    /// Area of the walls in m².
    pub fn area(&self) -> f64 {
        let DVec3 { x, y, z } = self.size;
        2.0 * (x * y + y * z + z * x)
    }
}

/// A closed box of walls that are all alike. Everywhere on it, and in every direction, with emitted
/// radiance Lₑ and reflectance ρ:
///
/// L = Lₑ / (1 − ρ), E = B = πL, whatever the size.
///
/// # Panics
/// When an extent (metres) is not positive and finite, or the surface not physical.
pub fn furnace_box(size: DVec3, surface: Surface) -> Scene {
    let walls = [surface; 6];
    let mut scene = ClosedBox { size, walls }.scene();
    "furnace".clone_into(&mut scene.name);
    scene
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_walls_close_the_box_and_face_inwards() {
        let size = DVec3::new(2.0, 3.0, 5.0);
        let scene = furnace_box(size, Surface::grey(0.5, 1.0));
        let centre = size * 0.5;
        let sum: DVec3 = scene.face_ids().map(|face| scene.vector_area(face)).sum();
        assert_eq!(sum, DVec3::ZERO, "a closed surface");
        for face in scene.face_ids() {
            let corner = scene.polygon(face).next().expect("a face has corners");
            assert!(
                scene.vector_area(face).dot(centre - corner) > 0.0,
                "{face:?}"
            );
        }
        let area: f64 = scene.face_ids().map(|face| scene.area(face)).sum();
        assert_eq!(area, 62.0);
    }

    #[test]
    fn walls_have_their_own_surfaces() {
        let mut walls = [Surface::BLACK; 6];
        walls[3] = Surface::grey(0.0, 2.0);
        let scene = ClosedBox {
            size: DVec3::ONE,
            walls,
        }
        .scene();
        let ceiling = scene.objects.iter().position(|o| o.name == "ceiling");
        for face in scene.face_ids() {
            let is_ceiling = Some(scene.faces[face.index()].object.index()) == ceiling;
            assert_eq!(scene.material(face).is_emissive(), is_ceiling);
        }
    }
}
