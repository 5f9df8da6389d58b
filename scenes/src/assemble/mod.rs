//! Puts faces into a scene so that its invariants hold: planar and convex polygons go in as they
//! are, others are cut into triangles, and faces without area are dropped; each is counted.

mod fragment;
mod polygon;
mod triangulate;

pub(crate) use fragment::{Count, FACES, Fragment, append};

use crate::id::{MaterialId, ObjectId};
use crate::scene::Scene;
use glam::{Vec2, Vec3};

/// Largest coordinate in metres that a scene may have: its square is still finite in f32, in which
/// rays work. (A light year is 9.5e15 m.)
pub(crate) const MAX_COORDINATE: f64 = 1e18;

/// One corner of a polygon on its way into a scene.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Corner {
    /// Index of the vertex in the scene.
    pub(crate) vertex: u32,
    /// Shading normal, or zero.
    pub(crate) normal: Vec3,
    /// First UV, v upwards.
    pub(crate) uv0: Vec2,
    /// Second UV, v upwards.
    pub(crate) uv1: Vec2,
}

/// Which attributes the corners of a polygon carry.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Attributes {
    pub(crate) normal: bool,
    pub(crate) uv0: bool,
    pub(crate) uv1: bool,
}

/// What became of a polygon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// It went in as it was.
    Kept,
    /// It had no area and was dropped.
    Dropped,
    /// It was flat but not convex and was cut into triangles.
    CutConcave,
    /// It was not flat and was cut into triangles.
    CutNonPlanar,
}

/// A scene that is being filled polygon by polygon.
#[derive(Debug, Default)]
pub(crate) struct Assembly {
    /// The scene so far.
    pub(crate) scene: Scene,
}

impl Assembly {
    /// Adds a polygon, counter-clockwise from its front. Its vertices must be in the scene.
    pub(crate) fn push_polygon(
        &mut self,
        corners: &[Corner],
        attributes: Attributes,
        object: ObjectId,
        material: MaterialId,
    ) -> Outcome {
        let mut fragment = Fragment::default();
        let outcome = fragment.push(
            &self.scene.vertices,
            corners,
            attributes,
            (object, material),
        );
        append(&mut self.scene, vec![fragment]);
        outcome
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Material;
    use crate::radiometry::Reflectance;
    use glam::DVec3;
    use proptest::prelude::*;

    fn assemble(points: &[DVec3]) -> (Assembly, Outcome) {
        let mut assembly = Assembly::default();
        let object = assembly.scene.push_object("object");
        let material = assembly
            .scene
            .push_material(Material::diffuse("m", Reflectance::ZERO));
        assembly.scene.vertices.extend_from_slice(points);
        let corners: Vec<Corner> = (0..points.len() as u32)
            .map(|vertex| Corner {
                vertex,
                ..Corner::default()
            })
            .collect();
        let outcome = assembly.push_polygon(&corners, Attributes::default(), object, material);
        (assembly, outcome)
    }

    #[test]
    fn repeated_corners_are_left_out() {
        let [a, b, c] = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let (assembly, outcome) = assemble(&[a, a, b, c, c, a]);
        assert_eq!(outcome, Outcome::Kept);
        assert_eq!(assembly.scene.faces[0].corner_count, 3);
    }

    #[test]
    fn a_face_of_repeated_corners_is_dropped() {
        assert_eq!(
            assemble(&[DVec3::X, DVec3::X, DVec3::Y, DVec3::X]).1,
            Outcome::Dropped
        );
        assert_eq!(assemble(&[]).1, Outcome::Dropped);
    }

    #[test]
    fn a_bent_quad_becomes_two_triangles_along_the_flatter_diagonal() {
        let points = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.2), DVec3::Y];
        let (assembly, outcome) = assemble(&points);
        assert_eq!(outcome, Outcome::CutNonPlanar);
        assert_eq!(assembly.scene.faces.len(), 2);
    }

    #[test]
    fn attributes_are_padded_where_faces_have_none() {
        let mut assembly = assemble(&[DVec3::ZERO, DVec3::X, DVec3::Y]).0;
        let corners = [0, 1, 2].map(|vertex| Corner {
            vertex,
            normal: Vec3::Z,
            ..Corner::default()
        });
        let attributes = Attributes {
            normal: true,
            ..Attributes::default()
        };
        assembly.push_polygon(&corners, attributes, ObjectId(0), MaterialId(0));
        assembly.push_polygon(&corners, Attributes::default(), ObjectId(0), MaterialId(0));
        let normals = &assembly.scene.corners.normal;
        assert_eq!(normals.len(), 9);
        assert_eq!(
            (normals[0], normals[4], normals[8]),
            (Vec3::ZERO, Vec3::Z, Vec3::ZERO)
        );
        assert!(assembly.scene.corners.uv0.is_empty());
    }

    proptest! {
        /// A planar convex polygon stays one face with the same corners, wherever and however large.
        #[test]
        fn planar_convex_polygons_survive(
            corners in 3..20_u32,
            axis in prop::array::uniform3(-1.0..1.0_f64),
            offset in prop::array::uniform3(-10.0..10.0_f64),
            exponent in -6..6_i32,
        ) {
            let normal = DVec3::from(axis);
            prop_assume!(normal.length() > 0.1);
            let (u, v) = normal.normalize().any_orthonormal_pair();
            let size = 10.0_f64.powi(exponent);
            let points: Vec<DVec3> = (0..corners)
                .map(|i| {
                    let angle = f64::from(i) * std::f64::consts::TAU / f64::from(corners);
                    (DVec3::from(offset) + u * angle.cos() + v * angle.sin()) * size
                })
                .collect();
            let (assembly, outcome) = assemble(&points);
            prop_assert_eq!(outcome, Outcome::Kept);
            prop_assert_eq!(assembly.scene.faces[0].corner_count, corners);
        }

        /// Cutting loses no area beyond the slivers that it may drop.
        #[test]
        fn cut_polygons_keep_their_vector_area(
            coordinates in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 4..12),
        ) {
            let points: Vec<DVec3> = coordinates.into_iter().map(DVec3::from).collect();
            let (assembly, _) = assemble(&points);
            let scene = &assembly.scene;
            let sum: DVec3 = scene.face_ids().map(|f| scene.vector_area(f)).sum();
            let origin = points[0];
            let expected: DVec3 = points
                .windows(2)
                .map(|e| (e[0] - origin).cross(e[1] - origin) * 0.5)
                .sum();
            // Up to ten dropped slivers of 1e-7 in a polygon of extent two.
            prop_assert!((sum - expected).length() < 1e-5);
        }
    }
}
