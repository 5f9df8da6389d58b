//! How fast a large scene gets ready for rays: read from a file, and its ray tree built.

use super::measured;
use crate::builder::{Polygon, room, solid_box};
use glam::DVec3;
use luxel_solver::bvh::Bvh;
use luxel_solver::geometry::Geometry;
use luxel_solver::sampling::{Stage, hash};
use std::fmt::Write;

/// Boxes of an object.
const BOXES_OF_OBJECT: usize = 1000;

/// A large scene and what it took.
#[derive(Clone, Copy, Debug)]
pub struct Prepared {
    /// Triangles of the ray tree.
    pub triangles: usize,
    /// Size of the file in bytes.
    pub bytes: usize,
    /// Seconds of reading it, the median.
    pub reading: f64,
    /// Seconds of building the tree, the median.
    pub building: f64,
    /// Peak memory in bytes.
    pub peak: Option<u64>,
}

/// Reads a hall with so many small boxes from an OBJ file and builds its tree, `runs` times each.
///
/// # Panics
/// When the file cannot be written or is not read.
pub fn prepared(boxes: usize, runs: u64) -> Prepared {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("hall.obj");
    let text = hall(boxes);
    std::fs::write(&file, &text).expect("an OBJ file");
    let bytes = text.len();
    drop(text);
    let (reading, at_reading, loaded) = measured(runs, |_| {
        luxel_scenes::load(&file).expect("a scene that was made here")
    });
    let geometry = Geometry::new(&loaded.scene);
    let (building, at_building, _) = measured(runs, |_| Bvh::build(&geometry));
    Prepared {
        triangles: geometry.len(),
        bytes,
        reading,
        building,
        peak: at_reading.max(at_building),
    }
}

/// The text of an OBJ file.
#[derive(Default)]
struct Obj {
    text: String,
    vertices: usize,
}

impl Obj {
    fn object(&mut self, name: &str) {
        writeln!(self.text, "o {name}").expect("a string takes all");
    }

    fn add(&mut self, faces: &[Polygon]) {
        for face in faces {
            for corner in face {
                let [x, y, z] = corner.to_array();
                writeln!(self.text, "v {x:.6} {y:.6} {z:.6}").expect("a string takes all");
            }
            self.text += "f";
            for _ in face {
                self.vertices += 1;
                write!(self.text, " {}", self.vertices).expect("a string takes all");
            }
            self.text += "\n";
        }
    }
}

/// A hall with boxes of 5 to 30 cm at random places.
fn hall(boxes: usize) -> String {
    let size = DVec3::new(40.0, 10.0, 40.0);
    let mut obj = Obj::default();
    obj.object("walls");
    obj.add(&room(DVec3::ZERO, size));
    for index in 0..boxes {
        if index % BOXES_OF_OBJECT == 0 {
            obj.object(&format!("boxes {}", index / BOXES_OF_OBJECT));
        }
        let u = |k| hash::uniform(0, Stage::CAMERA, index as u64, k);
        let sides = DVec3::new(u(0), u(1), u(2)) * 0.25 + 0.05;
        let lower = DVec3::new(u(3), u(4), u(5)) * (size - sides);
        obj.add(&solid_box(lower, lower + sides));
    }
    obj.text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hall_is_read_as_it_was_meant() {
        let prepared = prepared(1001, 1);
        // Twelve triangles a box, and those of the walls; 1001 boxes are two objects.
        assert_eq!(prepared.triangles, 12 * 1002);
        assert!(hall(1001).contains("\no boxes 1\n"));
        assert_eq!(prepared.bytes, hall(1001).len());
    }
}
