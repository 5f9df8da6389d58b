//! Small scenes made in code, and the polygons that they are made of.

use glam::DVec3;
use luxel_scenes::{Material, Radiance, Reflectance, Scene};
use std::f64::consts::{PI, TAU};

/// A planar convex polygon, metres, counter-clockwise seen from its front.
pub type Polygon = Vec<DVec3>;

/// A part of a scene: one object of one material.
#[derive(Clone, Debug)]
pub struct Part {
    /// Name of the object and of its material.
    pub name: &'static str,
    /// Diffuse reflectance, each channel in [0, 1).
    pub reflectance: Reflectance,
    /// Emitted radiance in W/(m² sr).
    pub emission: Radiance,
    /// Its faces.
    pub faces: Vec<Polygon>,
}

impl Part {
    /// A grey part that does not emit.
    pub fn grey(name: &'static str, reflectance: f64, faces: Vec<Polygon>) -> Self {
        Self {
            name,
            reflectance: Reflectance::splat(reflectance),
            emission: Radiance::ZERO,
            faces,
        }
    }

    /// A black part that emits radiance `emission` in W/(m² sr).
    pub fn lamp(name: &'static str, emission: f64, faces: Vec<Polygon>) -> Self {
        Self {
            name,
            reflectance: Reflectance::ZERO,
            emission: Radiance::splat(emission),
            faces,
        }
    }
}

/// A scene of the given parts.
pub fn scene(name: &str, parts: impl IntoIterator<Item = Part>) -> Scene {
    let mut scene = Scene {
        name: name.to_owned(),
        ..Scene::default()
    };
    for part in parts {
        let object = scene.push_object(part.name);
        let material = scene.push_material(
            Material::diffuse(part.name, part.reflectance).with_emission(part.emission),
        );
        for face in &part.faces {
            scene.push_face(face, object, material);
        }
    }
    scene
}

/// A polygon from coordinates in metres.
pub fn polygon(vertices: &[[f64; 3]]) -> Polygon {
    vertices.iter().copied().map(DVec3::from_array).collect()
}

/// A parallelogram from a corner and its two sides; it faces side × other side.
pub fn parallelogram(corner: DVec3, side: DVec3, other_side: DVec3) -> Polygon {
    vec![
        corner,
        corner + side,
        corner + side + other_side,
        corner + other_side,
    ]
}

/// The polygon seen from behind.
#[must_use]
pub fn flipped(mut polygon: Polygon) -> Polygon {
    polygon.reverse();
    polygon
}

/// The six faces of the box from `lower` to `upper`, facing inwards, in the order x−, x+, y−, y+,
/// z−, z+.
pub fn room(lower: DVec3, upper: DVec3) -> Vec<Polygon> {
    let size = upper - lower;
    let (x, y, z) = (DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z);
    vec![
        parallelogram(lower, y, z),
        flipped(parallelogram(lower + x, y, z)),
        parallelogram(lower, z, x),
        flipped(parallelogram(lower + y, z, x)),
        parallelogram(lower, x, y),
        flipped(parallelogram(lower + z, x, y)),
    ]
}

/// The same faces, facing outwards.
pub fn solid_box(lower: DVec3, upper: DVec3) -> Vec<Polygon> {
    room(lower, upper).into_iter().map(flipped).collect()
}

/// A sphere of triangles and quadrilaterals that faces outwards, poles on the z axis. Its corners
/// lie on the sphere of the given radius: a solid angle seen from outside is too small by up to
/// about (π / segments)²/2 of itself.
pub fn sphere(centre: DVec3, radius: f64, segments: usize) -> Vec<Polygon> {
    let point = |ring: usize, segment: usize| {
        let (sin, cos) = (PI * ring as f64 / (segments / 2) as f64).sin_cos();
        // All segments share the poles to the bit, where the sine of π is not quite zero.
        let sin = if ring.is_multiple_of(segments / 2) {
            0.0
        } else {
            sin
        };
        let phi = TAU * (segment % segments) as f64 / segments as f64;
        let direction = DVec3::new(sin * phi.cos(), sin * phi.sin(), cos);
        centre + direction * radius
    };
    let rings = segments / 2;
    let mut faces = Vec::new();
    for ring in 0..rings {
        for segment in 0..segments {
            let mut face = vec![point(ring, segment), point(ring + 1, segment)];
            if ring + 1 < rings {
                face.push(point(ring + 1, segment + 1));
            }
            if ring > 0 {
                face.push(point(ring, segment + 1));
            }
            faces.push(face);
        }
    }
    faces
}

/// A regular polygon in the plane through `centre` across `axis` z, facing +z; of the same area as
/// the disk of the given radius.
pub fn disk(centre: DVec3, radius: f64, segments: usize) -> Polygon {
    let step = TAU / segments as f64;
    let circumradius = radius * (step / step.sin()).sqrt();
    (0..segments)
        .map(|i| {
            let (sin, cos) = (step * i as f64).sin_cos();
            centre + DVec3::new(cos, sin, 0.0) * circumradius
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use luxel_scenes::FaceId;

    fn volume(faces: &[Polygon]) -> f64 {
        // Divergence theorem over fans.
        let fan = |f: &Polygon| {
            f.windows(2)
                .skip(1)
                .map(|e| f[0].dot(e[0].cross(e[1])) / 6.0)
                .sum::<f64>()
        };
        faces.iter().map(fan).sum()
    }

    #[test]
    fn closed_shapes_face_the_right_way() {
        let (lower, upper) = (DVec3::new(-1.0, 0.0, 2.0), DVec3::new(1.0, 3.0, 3.0));
        assert!((volume(&room(lower, upper)) + 6.0).abs() < 1e-12);
        assert!((volume(&solid_box(lower, upper)) - 6.0).abs() < 1e-12);
        let ball = volume(&sphere(DVec3::ONE, 0.5, 128));
        let exact = 4.0 / 3.0 * PI * 0.125;
        assert!(ball < exact && ball > 0.998 * exact, "{ball}");
    }

    #[test]
    fn scenes_hold_their_parts() {
        let scene = scene(
            "s",
            [
                Part::grey("walls", 0.5, room(DVec3::ZERO, DVec3::ONE)),
                Part::lamp("lamp", 2.0, vec![disk(DVec3::splat(0.5), 0.1, 64)]),
            ],
        );
        assert_eq!(
            (
                scene.faces.len(),
                scene.objects.len(),
                scene.materials.len()
            ),
            (7, 2, 2)
        );
        assert!((scene.area(FaceId(6)) - PI * 0.01).abs() < 1e-15);
        assert!(scene.vector_area(FaceId(6)).z > 0.0);
    }
}
