//! Two rectangles that see each other, with their exact form factors.
//!
//! Source: J. R. Howell, "A catalog of radiation heat transfer configuration factors", C-11
//! (parallel) and C-14 (perpendicular). Valid for all positive lengths. Tests hold them against the
//! tabulated values for squares and against each other in the closed box.

use super::{Surface, assert_lengths, main_camera};
use crate::scene::Scene;
use glam::DVec3;
use std::f64::consts::PI;

/// Two equal rectangles face to face. The first, `lower`, lies in y = 0 with a corner at the origin
/// and faces up; the second, `upper`, lies in y = `distance` and faces down.
///
/// Exact: [`ParallelPlates::form_factor`].
#[derive(Clone, Debug, PartialEq)]
pub struct ParallelPlates {
    /// Extent along x in metres.
    pub width: f64,
    /// Extent along z in metres.
    pub depth: f64,
    /// Distance of the planes in metres.
    pub distance: f64,
    /// The lower plate.
    pub lower: Surface,
    /// The upper plate.
    pub upper: Surface,
}

impl ParallelPlates {
    /// The scene, with a camera that sees both plates from the side.
    ///
    /// # Panics
    /// When a length is not positive and finite, or a surface not physical.
    pub fn scene(&self) -> Scene {
        let (w, d, h) = (self.width, self.depth, self.distance);
        assert_lengths(&[w, d, h]);
        let lower = [[0., 0., 0.], [0., 0., d], [w, 0., d], [w, 0., 0.]];
        let upper = [[0., h, 0.], [w, h, 0.], [w, h, d], [0., h, d]];
        let plates = [("lower", self.lower, lower), ("upper", self.upper, upper)];
        let centre = DVec3::new(w, h, d) * 0.5;
        let extent = w.max(d).max(h);
        let eye = centre + DVec3::new(0.3, 0.0, 1.0) * extent * 2.0;
        two_plates("parallel-plates", &plates, eye, centre)
    }

    /// Fraction of the flux leaving one plate that arrives at the other, the same both ways.
    pub fn form_factor(&self) -> f64 {
        let (x, y) = (self.width / self.distance, self.depth / self.distance);
        let (x1, y1) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
        // ln((1+x²)(1+y²)/(1+x²+y²)) without cancellation for small plates.
        let logarithm = 0.5 * (x * x * y * y / (1.0 + x * x + y * y)).ln_1p();
        let sum = logarithm + x * y1 * (x / y1).atan() + y * x1 * (y / x1).atan()
            - x * x.atan()
            - y * y.atan();
        2.0 / (PI * x * y) * sum
    }
}

/// Two rectangles with a common edge at a right angle. The first, `floor`, lies in y = 0 and faces
/// up; the second, `wall`, lies in z = 0 and faces along z. The common edge runs from the origin
/// along x.
///
/// Exact: [`PerpendicularPlates::form_factor`].
#[derive(Clone, Debug, PartialEq)]
pub struct PerpendicularPlates {
    /// Length of the common edge in metres.
    pub width: f64,
    /// Extent of the floor from the edge in metres.
    pub depth: f64,
    /// Extent of the wall from the edge in metres.
    pub height: f64,
    /// The floor.
    pub floor: Surface,
    /// The wall.
    pub wall: Surface,
}

impl PerpendicularPlates {
    /// The scene, with a camera that sees both plates.
    ///
    /// # Panics
    /// When a length is not positive and finite, or a surface not physical.
    pub fn scene(&self) -> Scene {
        let (w, d, h) = (self.width, self.depth, self.height);
        assert_lengths(&[w, d, h]);
        let floor = [[0., 0., 0.], [0., 0., d], [w, 0., d], [w, 0., 0.]];
        let wall = [[0., 0., 0.], [w, 0., 0.], [w, h, 0.], [0., h, 0.]];
        let plates = [("floor", self.floor, floor), ("wall", self.wall, wall)];
        let target = DVec3::new(0.5 * w, 0.25 * h, 0.25 * d);
        let extent = w.max(d).max(h);
        let eye = target + DVec3::new(0.3, 0.8, 1.0) * extent * 1.5;
        two_plates("perpendicular-plates", &plates, eye, target)
    }

    /// Fraction of the flux leaving the floor that arrives at the wall. The way back is this times
    /// `depth / height`.
    pub fn form_factor(&self) -> f64 {
        let (w, h) = (self.depth / self.width, self.height / self.width);
        let (ww, hh) = (w * w, h * h);
        let r = ww + hh;
        let arcs = w * (1.0 / w).atan() + h * (1.0 / h).atan() - r.sqrt() * (1.0 / r.sqrt()).atan();
        let logarithm = ((1.0 + ww) * (1.0 + hh) / (1.0 + r)).ln()
            + ww * (ww * (1.0 + r) / ((1.0 + ww) * r)).ln()
            + hh * (hh * (1.0 + r) / ((1.0 + hh) * r)).ln();
        (arcs + 0.25 * logarithm) / (PI * w)
    }
}

type Plate<'a> = (&'a str, Surface, [[f64; 3]; 4]);

fn two_plates(name: &str, plates: &[Plate; 2], eye: DVec3, target: DVec3) -> Scene {
    let mut scene = Scene {
        name: name.to_owned(),
        ..Scene::default()
    };
    for &(name, surface, corners) in plates {
        let object = scene.push_object(name);
        let material = surface.push(&mut scene, name);
        scene.push_face(&corners.map(DVec3::from), object, material);
    }
    scene.cameras.push(main_camera(eye, target));
    scene
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::id::FaceId;

    fn parallel(width: f64, depth: f64, distance: f64) -> ParallelPlates {
        let [lower, upper] = [Surface::grey(0.0, 1.0), Surface::BLACK];
        ParallelPlates {
            width,
            depth,
            distance,
            lower,
            upper,
        }
    }

    fn perpendicular(width: f64, depth: f64, height: f64) -> PerpendicularPlates {
        let [floor, wall] = [Surface::grey(0.0, 1.0), Surface::BLACK];
        PerpendicularPlates {
            width,
            depth,
            height,
            floor,
            wall,
        }
    }

    #[test]
    fn unit_squares_have_the_published_factors() {
        // Howell's tables: 0.199825 face to face, 0.200044 at a right angle.
        assert!((parallel(1.0, 1.0, 1.0).form_factor() - 0.199_825).abs() < 1e-6);
        assert!((perpendicular(1.0, 1.0, 1.0).form_factor() - 0.200_044).abs() < 1e-6);
    }

    #[test]
    fn the_factors_of_a_box_sum_to_one() {
        for size in [[1.0, 1.0, 1.0], [2.0, 3.0, 5.0], [0.1, 1.0, 10.0]] {
            let [w, h, d] = size;
            let sum = parallel(w, d, h).form_factor()
                + 2.0 * perpendicular(w, d, h).form_factor()
                + 2.0 * perpendicular(d, w, h).form_factor();
            // Cancellation of terms up to 100 in f64.
            assert!((sum - 1.0).abs() < 1e-12, "{size:?}: {sum}");
        }
    }

    #[test]
    fn plates_face_each_other() {
        let scene = parallel(2.0, 3.0, 4.0).scene();
        assert_eq!(scene.vector_area(FaceId(0)), DVec3::new(0.0, 6.0, 0.0));
        assert_eq!(scene.vector_area(FaceId(1)), DVec3::new(0.0, -6.0, 0.0));
        let scene = perpendicular(2.0, 3.0, 4.0).scene();
        assert_eq!(scene.vector_area(FaceId(0)), DVec3::new(0.0, 6.0, 0.0));
        assert_eq!(scene.vector_area(FaceId(1)), DVec3::new(0.0, 0.0, 8.0));
    }
}
