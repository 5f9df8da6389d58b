//! A sphere in a closed box.

use super::{ClosedBox, Surface, assert_lengths, main_camera};
use crate::scene::Scene;
use glam::DVec3;
use std::collections::HashMap;
use std::f64::consts::PI;

/// How a sphere is made of polygons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tessellation {
    /// An icosahedron whose triangles are halved along each edge `subdivisions` times:
    /// 20 · 4ⁿ triangles.
    Icosphere {
        /// How often; at most 8.
        subdivisions: u32,
    },
    /// Rings of flat quads, triangles at the poles.
    LatLong {
        /// Bands from pole to pole, at least 2.
        stacks: u32,
        /// Segments around, at least 3.
        slices: u32,
    },
}

/// What the radius of a tessellated sphere means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SphereRadius {
    /// The corners lie on the sphere: the polyhedron is smaller than it.
    Corners,
    /// The polyhedron has the area of the sphere, 4πr².
    Area,
}

/// A sphere, object `sphere`, in the middle of a [`ClosedBox`].
///
/// Exact, for the polyhedron as for the sphere, because both are convex: all that leaves the sphere
/// arrives at the walls, F(sphere → walls) = 1, so by reciprocity F(walls → sphere) = A_sphere /
/// A_walls. Where the sphere and all walls are alike, the scene is a furnace: L = Lₑ / (1 − ρ)
/// everywhere.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereInBox {
    /// The box.
    pub walls: ClosedBox,
    /// Radius in metres; the sphere must fit into the box.
    pub radius: f64,
    /// What the radius means.
    pub radius_is: SphereRadius,
    /// How the sphere is made of polygons.
    pub tessellation: Tessellation,
    /// The sphere's surface.
    pub sphere: Surface,
}

impl SphereInBox {
    /// The scene, with a camera in a corner of the box.
    ///
    /// # Panics
    /// When a length is not positive and finite, the sphere does not fit into the box, the
    /// tessellation is outside its limits, or a surface is not physical.
    pub fn scene(&self) -> Scene {
        assert_lengths(&[self.radius]);
        let mut scene = Scene {
            name: "sphere-in-box".to_owned(),
            ..Scene::default()
        };
        self.walls.push(&mut scene);
        let centre = self.walls.size * 0.5;
        let mut polyhedron = unit_sphere(self.tessellation);
        let unit_area = polyhedron.area();
        let scale = match self.radius_is {
            SphereRadius::Corners => self.radius,
            SphereRadius::Area => self.radius * (4.0 * PI / unit_area).sqrt(),
        };
        assert!(
            scale < centre.min_element(),
            "a sphere of radius {scale} does not fit into a box of {:?}",
            self.walls.size
        );
        let object = scene.push_object("sphere");
        let material = self.sphere.push(&mut scene, "sphere");
        for point in &mut polyhedron.points {
            *point = *point * scale + centre;
        }
        for face in &polyhedron.faces {
            let polygon: Vec<DVec3> = face.iter().map(|&i| polyhedron.points[i]).collect();
            scene.push_face(&polygon, object, material);
        }
        let eye = self.walls.size * DVec3::new(0.05, 0.5, 0.05);
        scene.cameras.push(main_camera(eye, centre));
        scene
    }
}

/// A closed polyhedron, faces counter-clockwise from outside.
struct Polyhedron {
    points: Vec<DVec3>,
    faces: Vec<Vec<usize>>,
}

impl Polyhedron {
    /// Exact area: the faces are planar.
    fn area(&self) -> f64 {
        let face_area = |face: &Vec<usize>| {
            let origin = self.points[face[0]];
            let doubled: DVec3 = face[1..]
                .windows(2)
                .map(|e| (self.points[e[0]] - origin).cross(self.points[e[1]] - origin))
                .sum();
            0.5 * doubled.length()
        };
        self.faces.iter().map(face_area).sum()
    }
}

/// Corners on the unit sphere.
fn unit_sphere(tessellation: Tessellation) -> Polyhedron {
    match tessellation {
        Tessellation::Icosphere { subdivisions } => icosphere(subdivisions),
        Tessellation::LatLong { stacks, slices } => lat_long(stacks, slices),
    }
}

fn icosphere(subdivisions: u32) -> Polyhedron {
    assert!(
        subdivisions <= 8,
        "{subdivisions} subdivisions make more than a million triangles"
    );
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut points = Vec::new();
    for (a, b) in [
        (-1.0, golden),
        (1.0, golden),
        (-1.0, -golden),
        (1.0, -golden),
    ] {
        points.extend([[a, b, 0.0], [0.0, a, b], [b, 0.0, a]].map(|p| DVec3::from(p).normalize()));
    }
    // The faces are the triples of points at edge length from each other.
    let edge = 2.0 / (1.0 + golden * golden).sqrt();
    let is_edge = |i: usize, j: usize| points[i].distance(points[j]) < 1.1 * edge;
    let mut faces = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if is_edge(i, j) && is_edge(j, k) && is_edge(k, i) {
                    let outward = points[i].cross(points[j]).dot(points[k]) > 0.0;
                    faces.push(if outward { [i, j, k] } else { [i, k, j] });
                }
            }
        }
    }
    for _ in 0..subdivisions {
        let mut middles = HashMap::new();
        let mut middle = |a: usize, b: usize| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push((points[a] + points[b]).normalize());
                points.len() - 1
            })
        };
        let quarter = |[a, b, c]: [usize; 3]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        faces = faces.into_iter().flat_map(quarter).collect();
    }
    let faces = faces.into_iter().map(Vec::from).collect();
    Polyhedron { points, faces }
}

fn lat_long(stacks: u32, slices: u32) -> Polyhedron {
    assert!(
        stacks >= 2 && slices >= 3,
        "a sphere needs 2 stacks and 3 slices at least"
    );
    let mut points = vec![DVec3::Y];
    for stack in 1..stacks {
        let polar = PI * f64::from(stack) / f64::from(stacks);
        for slice in 0..slices {
            let around = 2.0 * PI * f64::from(slice) / f64::from(slices);
            let (sine, cosine) = polar.sin_cos();
            points.push(DVec3::new(sine * around.sin(), cosine, sine * around.cos()));
        }
    }
    let south = points.len();
    points.push(-DVec3::Y);
    let (stacks, slices) = (stacks as usize, slices as usize);
    let at = |stack: usize, slice: usize| 1 + (stack - 1) * slices + slice % slices;
    let mut faces = Vec::new();
    for slice in 0..slices {
        faces.push(vec![0, at(1, slice), at(1, slice + 1)]);
        for stack in 1..stacks - 1 {
            let (upper, lower) = (stack, stack + 1);
            faces.push(vec![
                at(upper, slice),
                at(lower, slice),
                at(lower, slice + 1),
                at(upper, slice + 1),
            ]);
        }
        faces.push(vec![
            at(stacks - 1, slice),
            south,
            at(stacks - 1, slice + 1),
        ]);
    }
    Polyhedron { points, faces }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TESSELLATIONS: [(Tessellation, usize); 3] = [
        (Tessellation::Icosphere { subdivisions: 0 }, 20),
        (Tessellation::Icosphere { subdivisions: 2 }, 320),
        (
            Tessellation::LatLong {
                stacks: 8,
                slices: 12,
            },
            96,
        ),
    ];

    fn scene(tessellation: Tessellation, radius_is: SphereRadius) -> Scene {
        let walls = ClosedBox {
            size: DVec3::splat(4.0),
            walls: [Surface::BLACK; 6],
        };
        let sphere = Surface::grey(0.0, 1.0);
        SphereInBox {
            walls,
            radius: 1.0,
            radius_is,
            tessellation,
            sphere,
        }
        .scene()
    }

    #[test]
    fn the_sphere_is_closed_and_faces_outwards() {
        for (tessellation, faces) in TESSELLATIONS {
            let scene = scene(tessellation, SphereRadius::Corners);
            assert_eq!(scene.faces.len(), 6 + faces, "{tessellation:?}");
            let mut sum = DVec3::ZERO;
            for face in scene.face_ids().skip(6) {
                let area = scene.vector_area(face);
                let middle = scene.polygon(face).sum::<DVec3>() / scene.polygon(face).len() as f64;
                assert!(
                    area.dot(middle - DVec3::splat(2.0)) > 0.0,
                    "{tessellation:?} {face:?}"
                );
                for corner in scene.polygon(face) {
                    let radius = corner.distance(DVec3::splat(2.0));
                    // One rounding of each coordinate.
                    assert!((radius - 1.0).abs() < 1e-14, "{radius}");
                }
                sum += area;
            }
            assert!(sum.length() < 1e-14, "{tessellation:?}: {sum}");
        }
    }

    #[test]
    fn the_area_is_that_of_the_sphere_when_asked() {
        for (tessellation, _) in TESSELLATIONS {
            let scene = scene(tessellation, SphereRadius::Area);
            let area: f64 = scene.face_ids().skip(6).map(|face| scene.area(face)).sum();
            // A sum of at most 320 rounded terms.
            assert!(
                (area / (4.0 * PI) - 1.0).abs() < 1e-13,
                "{tessellation:?}: {area}"
            );
        }
    }
}
