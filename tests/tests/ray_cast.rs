//! Ray-cast form factors on every exact pair, with a million rays: right within four standard errors,
//! and the standard errors right.

use glam::DVec3;
use luxel_solver::form_factors::{RayCastConfig, ray_cast_row};
use luxel_solver::patches::{PatchId, PatchSize};
use luxel_solver::world::World;
use luxel_tests::builder::{Part, Polygon, disk, flipped, polygon, scene, sphere};
use luxel_tests::cases;
use serde::Deserialize;

#[derive(Deserialize)]
struct File {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    id: String,
    from: Surface,
    to: Surface,
    occluders: Vec<Surface>,
    value: f64,
}

#[derive(Clone, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase")]
enum Surface {
    Polygon {
        vertices: Vec<[f64; 3]>,
    },
    Disk {
        center: [f64; 3],
        normal: [f64; 3],
        radius: f64,
    },
    Sphere {
        center: [f64; 3],
        radius: f64,
        side: String,
    },
    Element {
        point: [f64; 3],
        normal: [f64; 3],
    },
}

/// Corners of disks and segments of spheres: the flat faces are off by 1.6 / n² of the area and of
/// the height, 1e-5 here, a tenth of the standard errors.
const SEGMENTS: usize = 400;

/// Side of the square that stands for a differential element, relative to the unit scale of the
/// cases: F varies over it by less than its square.
const ELEMENT: f64 = 1e-4;

impl Surface {
    fn faces(&self) -> Vec<Polygon> {
        match self {
            Self::Polygon { vertices } => vec![polygon(vertices)],
            Self::Disk {
                center,
                normal,
                radius,
            } => {
                let upright = disk(DVec3::ZERO, *radius, SEGMENTS);
                let up = DVec3::from_array(*normal);
                let face = if up.z > 0.0 {
                    upright
                } else {
                    flipped(upright)
                };
                let centre = DVec3::from_array(*center);
                vec![face.into_iter().map(|p| p + centre).collect()]
            }
            Self::Sphere {
                center,
                radius,
                side,
            } => {
                let faces = sphere(DVec3::from_array(*center), *radius, SEGMENTS);
                if side == "inner" {
                    faces.into_iter().map(flipped).collect()
                } else {
                    faces
                }
            }
            Self::Element { point, normal } => {
                let (point, normal) = (DVec3::from_array(*point), DVec3::from_array(*normal));
                let (x, y) = normal.normalize().any_orthonormal_pair();
                let at = |i: f64, j: f64| point + (x * i + y * j) * (0.5 * ELEMENT);
                vec![vec![
                    at(-1.0, -1.0),
                    at(1.0, -1.0),
                    at(1.0, 1.0),
                    at(-1.0, 1.0),
                ]]
            }
        }
    }
}

#[test]
fn every_pair_is_within_four_standard_errors_of_its_exact_value() {
    let config = RayCastConfig {
        rays: 1_000_000,
        seed: 1,
    };
    let mut squares = Vec::new();
    for case in cases::load::<File>("viewfactors.json").cases {
        let occluders = case
            .occluders
            .iter()
            .flat_map(Surface::faces)
            .collect::<Vec<_>>();
        let mut parts = vec![
            Part::grey("from", 0.5, case.from.faces()),
            Part::grey("to", 0.5, case.to.faces()),
        ];
        if !occluders.is_empty() {
            parts.push(Part::grey("occluders", 0.5, occluders));
        }
        let scene = scene(&case.id, parts);
        let world = World::new(&scene);
        let patches = world.mesh(PatchSize::Objects).expect("three patches");
        let (factors, errors) = ray_cast_row(&world, &patches, PatchId(0), &config);
        let (value, error) = (factors[1], errors[1]);
        let difference = (value - case.value).abs();
        // No ray of a million, or all of them, met: binomial odds of 3e-7 a ray, and the distance
        // by which origins are moved off their face (6e-7 of the scene).
        let resolution = 1e-6;
        assert!(
            difference <= 4.0 * error + resolution,
            "{}: {value} ± {error}, exactly {}",
            case.id,
            case.value
        );
        if error > resolution {
            squares.push((difference / error).powi(2));
        }
    }
    // Mean of n values of t² with 31 degrees of freedom: 1.07 ± √(2.5/n), 0.2 here.
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    assert!(
        (0.7..1.4).contains(&mean),
        "mean z² is {mean} over {} pairs",
        squares.len()
    );
}
