//! Faces that are in a scene twice.
//!
//! Two faces with the same corners and the same front are one surface: a ray meets one of them, no more,
//! while areas and emission would count twice. The first stands, the others are dropped with a
//! warning. Corners are compared to the bit, whichever comes first in a face; a face and its reverse
//! are the two sides of a thin wall, and both stay. Cost: a hash of every face.

use super::place::Place;
use super::warning::{FacePlace, Warning};
use crate::id::FaceId;
use crate::scene::{Corners, Scene};
use std::collections::HashSet;
use std::path::Path;

/// Drops every face that an earlier one already is.
pub(super) fn drop_duplicates(scene: &mut Scene, file: &Path) -> Option<Warning> {
    let mut seen = HashSet::with_capacity(scene.faces.len());
    let is_first: Vec<bool> = scene
        .face_ids()
        .map(|face| seen.insert(corners(scene, face)))
        .collect();
    let first = is_first.iter().position(|is_first| !is_first)?;
    let object = scene.faces[first].object;
    let number = scene.faces[..=first]
        .iter()
        .filter(|face| face.object == object)
        .count();
    let warning = Warning::DuplicateFaces {
        count: is_first.iter().filter(|is_first| !*is_first).count(),
        first: FacePlace {
            place: Place::file(file),
            object: scene.objects[object.index()].name.clone(),
            number,
        },
    };

    let old = std::mem::take(&mut scene.corners);
    let faces = std::mem::take(&mut scene.faces);
    for (mut face, _) in faces.into_iter().zip(is_first).filter(|(_, keep)| *keep) {
        let range = face.corners();
        face.first_corner = scene.corners.vertex.len() as u32;
        let Corners {
            vertex,
            normal,
            uv0,
            uv1,
        } = &mut scene.corners;
        vertex.extend_from_slice(&old.vertex[range.clone()]);
        // Features that no face has are empty.
        normal.extend_from_slice(old.normal.get(range.clone()).unwrap_or_default());
        uv0.extend_from_slice(old.uv0.get(range.clone()).unwrap_or_default());
        uv1.extend_from_slice(old.uv1.get(range).unwrap_or_default());
        scene.faces.push(face);
    }
    Some(warning)
}

/// The corners of a face as bits, in its own order, the least first.
fn corners(scene: &Scene, face: FaceId) -> Vec<[u64; 3]> {
    // Zero has two signs and is one place.
    let bits = |x: f64| (x + 0.0).to_bits();
    let mut corners: Vec<[u64; 3]> = scene
        .polygon(face)
        .map(|corner| corner.to_array().map(bits))
        .collect();
    let least = (0..corners.len()).min_by_key(|&at| corners[at]);
    corners.rotate_left(least.unwrap_or(0));
    corners
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Material;
    use crate::radiometry::Reflectance;
    use glam::{DVec3, Vec2};

    #[test]
    fn a_scene_without_faces_has_none() {
        assert_eq!(
            drop_duplicates(&mut Scene::default(), Path::new("s.obj")),
            None
        );
    }

    #[test]
    fn later_faces_with_the_same_front_are_dropped() {
        let mut scene = Scene::default();
        let grey = scene.push_material(Material::diffuse("grey", Reflectance::splat(0.5)));
        let object = scene.push_object("plate");
        let face = [DVec3::ZERO, DVec3::X, DVec3::ONE, DVec3::Y + DVec3::Z];
        let other = [DVec3::ZERO, DVec3::X, DVec3::ONE, DVec3::Y];
        let mut turned = face;
        turned.rotate_left(3);
        let mut behind = face;
        behind.reverse();
        // Minus zero is zero.
        let signed = face.map(|v| DVec3::select(v.cmpeq(DVec3::ZERO), DVec3::splat(-0.0), v));
        for face in [face, turned, other, behind, signed, other] {
            scene.push_face(&face, object, grey);
        }
        scene.corners.uv0 = (0_u8..24).map(|k| Vec2::splat(f32::from(k))).collect();
        let warning = drop_duplicates(&mut scene, Path::new("s.obj")).expect("three are dropped");
        assert_eq!(
            warning.to_string(),
            "s.obj: 3 face(s) that are there before dropped, the first is face 2 of object `plate`"
        );
        let kept: Vec<Vec<DVec3>> = scene
            .face_ids()
            .map(|f| scene.polygon(f).collect())
            .collect();
        assert_eq!(kept, [face.to_vec(), other.to_vec(), behind.to_vec()]);
        let corners: Vec<f32> = scene.corners.uv0.iter().map(|uv| uv.x).collect();
        let expected = (0_u8..4).chain(8..16).map(f32::from);
        assert_eq!(
            corners,
            expected.collect::<Vec<_>>(),
            "corners go with their face"
        );
    }
}
