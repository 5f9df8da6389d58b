//! Faces that are in a scene twice.
//!
//! Two faces with the same corners and the same front are one surface: a ray meets one of them, no more,
//! while areas and emission would count twice. The first stands, the others are dropped with a
//! warning. Corners are compared to the bit, whichever comes first in a face; a face and its reverse
//! are the two sides of a thin wall, and both stay.
//!
//! A face's key is a sum over its edges, so that it does not depend on where the face begins. Faces
//! sorted by key stand beside their likes; those of one key are compared corner by corner. Cost: a sort
//! of 16 bytes a face, in parallel.

use super::place::Place;
use super::warning::{FacePlace, Warning};
use crate::id::FaceId;
use crate::scene::{Corners, Scene};
use glam::DVec3;
use rayon::prelude::*;
use std::path::Path;

/// Drops every face that an earlier one already is.
pub(super) fn drop_duplicates(scene: &mut Scene, file: &Path) -> Option<Warning> {
    let is_first = first_of_their_kind(scene)?;
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

/// Whether each face is none of those before it; `None` when all are.
fn first_of_their_kind(scene: &Scene) -> Option<Vec<bool>> {
    let mut keys: Vec<(u64, FaceId)> = (0..scene.faces.len())
        .into_par_iter()
        .map(FaceId::new)
        .map(|face| (key(scene.polygon(face)), face))
        .collect();
    keys.par_sort_unstable();
    let has_likes = keys.par_windows(2).any(|pair| pair[0].0 == pair[1].0);
    if !has_likes {
        return None;
    }
    let mut is_first = vec![true; scene.faces.len()];
    for alike in keys
        .chunk_by(|a, b| a.0 == b.0)
        .filter(|faces| faces.len() > 1)
    {
        // More than one kind of the same key is an accident of 2⁻⁶⁴ a pair.
        let mut kinds: Vec<Vec<DVec3>> = Vec::new();
        for &(_, face) in alike {
            if kinds.iter().any(|kind| is_same(kind, &scene.polygon(face))) {
                is_first[face.index()] = false;
            } else {
                kinds.push(scene.polygon(face).collect());
            }
        }
    }
    Some(is_first)
}

/// Whether a ring has the same corners as another, in the same order from some corner on.
fn is_same(ring: &[DVec3], other: &(impl ExactSizeIterator<Item = DVec3> + Clone)) -> bool {
    // Zero has two signs and is one place: numbers are compared, not bits.
    ring.len() == other.len()
        && (0..ring.len()).any(|start| {
            let turned = ring[start..].iter().chain(&ring[..start]);
            turned.copied().eq(other.clone())
        })
}

/// A hash of a polygon that is the same whichever corner comes first.
fn key(polygon: impl Iterator<Item = DVec3>) -> u64 {
    let mut corners = polygon.map(|corner| {
        let [x, y, z] = corner.to_array().map(|x| (x + 0.0).to_bits());
        mixed(
            x ^ 0x9E37_79B9_7F4A_7C15,
            mixed(y, z ^ 0xC2B2_AE3D_27D4_EB4F),
        )
    });
    let Some(first) = corners.next() else {
        return 0;
    };
    let edge = |from: u64, to: u64| mixed(from ^ 0x1656_67B1_9E37_79F9, to);
    let (last, sum) = corners.fold((first, 0_u64), |(from, sum), to| {
        (to, sum.wrapping_add(edge(from, to)))
    });
    sum.wrapping_add(edge(last, first))
}

/// Both halves of a product of odd numbers: each bit depends on all of both.
fn mixed(a: u64, b: u64) -> u64 {
    let product = u128::from(a | 1) * u128::from(b.rotate_left(32) ^ 0xA076_1D64_78BD_642F);
    (product as u64) ^ ((product >> 64) as u64) ^ a
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
