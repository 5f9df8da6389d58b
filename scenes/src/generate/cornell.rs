//! The Cornell box.
//!
//! Source: Cornell University Program of Computer Graphics, "Cornell box data" (measured box,
//! 1998), coordinates in mm, here times 0.001 in metres. Reflectances and emission are the usual RGB
//! values for it, not the measured spectra. The box is open at the front (z = 0). The published
//! left wall is not flat (its corners lie up to 0.8 mm from a plane) and is cut into two triangles.
//!
//! There is no closed answer; `scenes/data/cornell` is the same geometry as triangles, and
//! `tests/references/cornell` has its irradiance by an independent path tracer.

use super::Surface;
use crate::camera::{Camera, FieldOfView, Projection};
use crate::radiometry::{Radiance, Reflectance};
use crate::scene::Scene;
use glam::DVec3;

/// Corners of a face in mm, counter-clockwise from its front.
type Corners = &'static [[f64; 3]];

const FLOOR: &[Corners] = &[&[
    [552.8, 0., 0.],
    [0., 0., 0.],
    [0., 0., 559.2],
    [549.6, 0., 559.2],
]];

/// Around the opening of the lamp.
const CEILING: &[Corners] = &[
    &[
        [556., 548.8, 0.],
        [556., 548.8, 559.2],
        [343., 548.8, 332.],
        [343., 548.8, 227.],
    ],
    &[
        [556., 548.8, 559.2],
        [0., 548.8, 559.2],
        [213., 548.8, 332.],
        [343., 548.8, 332.],
    ],
    &[
        [0., 548.8, 559.2],
        [0., 548.8, 0.],
        [213., 548.8, 227.],
        [213., 548.8, 332.],
    ],
    &[
        [0., 548.8, 0.],
        [556., 548.8, 0.],
        [343., 548.8, 227.],
        [213., 548.8, 227.],
    ],
];

const LIGHT: &[Corners] = &[&[
    [343., 548.8, 227.],
    [343., 548.8, 332.],
    [213., 548.8, 332.],
    [213., 548.8, 227.],
]];

const BACK_WALL: &[Corners] = &[&[
    [549.6, 0., 559.2],
    [0., 0., 559.2],
    [0., 548.8, 559.2],
    [556., 548.8, 559.2],
]];

const RIGHT_WALL: &[Corners] = &[&[
    [0., 0., 559.2],
    [0., 0., 0.],
    [0., 548.8, 0.],
    [0., 548.8, 559.2],
]];

const LEFT_WALL: &[Corners] = &[
    &[[552.8, 0., 0.], [549.6, 0., 559.2], [556., 548.8, 559.2]],
    &[[552.8, 0., 0.], [556., 548.8, 559.2], [556., 548.8, 0.]],
];

const SHORT_BLOCK: &[Corners] = &[
    &[
        [130., 165., 65.],
        [82., 165., 225.],
        [240., 165., 272.],
        [290., 165., 114.],
    ],
    &[
        [290., 0., 114.],
        [290., 165., 114.],
        [240., 165., 272.],
        [240., 0., 272.],
    ],
    &[
        [130., 0., 65.],
        [130., 165., 65.],
        [290., 165., 114.],
        [290., 0., 114.],
    ],
    &[
        [82., 0., 225.],
        [82., 165., 225.],
        [130., 165., 65.],
        [130., 0., 65.],
    ],
    &[
        [240., 0., 272.],
        [240., 165., 272.],
        [82., 165., 225.],
        [82., 0., 225.],
    ],
];

const TALL_BLOCK: &[Corners] = &[
    &[
        [423., 330., 247.],
        [265., 330., 296.],
        [314., 330., 456.],
        [472., 330., 406.],
    ],
    &[
        [423., 0., 247.],
        [423., 330., 247.],
        [472., 330., 406.],
        [472., 0., 406.],
    ],
    &[
        [472., 0., 406.],
        [472., 330., 406.],
        [314., 330., 456.],
        [314., 0., 456.],
    ],
    &[
        [314., 0., 456.],
        [314., 330., 456.],
        [265., 330., 296.],
        [265., 0., 296.],
    ],
    &[
        [265., 0., 296.],
        [265., 330., 296.],
        [423., 330., 247.],
        [423., 0., 247.],
    ],
];

/// The Cornell box in metres with the published camera.
pub fn cornell_box() -> Scene {
    let diffuse = |red, green, blue| Surface {
        reflectance: Reflectance::new(red, green, blue),
        emission: Radiance::ZERO,
    };
    let lamp = Surface {
        reflectance: Reflectance::ZERO,
        emission: Radiance::new(17.0, 12.0, 4.0),
    };
    let mut scene = Scene {
        name: "cornell".to_owned(),
        ..Scene::default()
    };
    let white = diffuse(0.725, 0.71, 0.68).push(&mut scene, "white");
    let red = diffuse(0.63, 0.065, 0.05).push(&mut scene, "red");
    let green = diffuse(0.14, 0.45, 0.091).push(&mut scene, "green");
    let light = lamp.push(&mut scene, "light");
    for (name, faces, material) in [
        ("floor", FLOOR, white),
        ("ceiling", CEILING, white),
        ("light", LIGHT, light),
        ("back_wall", BACK_WALL, white),
        ("right_wall", RIGHT_WALL, green),
        ("left_wall", LEFT_WALL, red),
        ("short_block", SHORT_BLOCK, white),
        ("tall_block", TALL_BLOCK, white),
    ] {
        let object = scene.push_object(name);
        for corners in faces {
            let polygon: Vec<DVec3> = corners.iter().map(|&c| DVec3::from(c) * 0.001).collect();
            scene.push_face(&polygon, object, material);
        }
    }
    scene.cameras.push(Camera {
        name: "main".to_owned(),
        position: DVec3::new(0.278, 0.273, -0.8),
        look_at: DVec3::new(0.278, 0.273, 0.0),
        up: DVec3::Y,
        projection: Projection::Perspective {
            // A film 25 mm wide at a focal length of 35 mm.
            fov: FieldOfView::Horizontal(2.0 * (12.5_f64 / 35.0).atan()),
        },
        size: [256, 256],
    });
    scene
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// The same box by two ways: areas of objects and their normals.
    #[test]
    fn the_generated_box_is_that_of_the_data() {
        let generated = cornell_box();
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/cornell/cornell.toml");
        let read = crate::load(file).expect("the scene is valid").scene;
        let by_object = |scene: &Scene| {
            let mut areas = vec![DVec3::ZERO; scene.objects.len()];
            for face in scene.face_ids() {
                areas[scene.faces[face.index()].object.index()] += scene.vector_area(face);
            }
            areas
        };
        assert_eq!(generated.objects, read.objects);
        for (a, b) in by_object(&generated).iter().zip(by_object(&read)) {
            // mm times 0.001 against decimals: a few roundings.
            assert!((*a - b).length() < 1e-15, "{a} against {b}");
        }
        let (lo, hi) = generated.bounds().expect("the box has faces");
        assert!((hi - lo - DVec3::new(0.556, 0.5488, 0.5592)).length() < 1e-15);
        let (a, b) = (&generated.cameras[0], &read.cameras[0]);
        assert_eq!((a.position, a.look_at), (b.position, b.look_at));
    }
}
