//! Materials, lights, cameras, units and shading normals. Cost: O(n).

use super::finding::{FaceRef, Finding};
use crate::camera::{Camera, FieldOfView, Projection};
use crate::id::FaceId;
use crate::light::LightKind;
use crate::material::Specular;
use crate::scene::Scene;
use glam::DVec3;
use std::collections::BTreeMap;

/// Reflectance from which a material is named: snow and the best white paints have 0.9 to 0.95.
const HIGH_REFLECTANCE: f64 = 0.95;
/// Rooms and objects are larger; a scene of centimetres is most often one of metres written in
/// another unit.
const SMALLEST: f64 = 0.05;
/// Scenes of interiors and streets are smaller; one of kilometres is most often one in millimetres.
const LARGEST: f64 = 1000.0;

/// Findings about what the geometry carries.
pub(super) fn report(scene: &Scene, findings: &mut Vec<Finding>) {
    normals(scene, findings);
    materials(scene, findings);
    let Some((low, high)) = scene.bounds() else {
        return;
    };
    let extent = high - low;
    if extent.max_element() < SMALLEST || extent.max_element() > LARGEST {
        findings.push(Finding::SuspiciousSize { extent });
    }
    for light in &scene.lights {
        let (LightKind::Point { position, .. }
        | LightKind::Lambertian { position, .. }
        | LightKind::Spot { position, .. }) = light.kind
        else {
            continue;
        };
        if position.cmplt(low).any() || position.cmpgt(high).any() {
            findings.push(Finding::LightOutside {
                light: light.name.clone(),
                position,
            });
        }
    }
    for camera in &scene.cameras {
        findings.extend(self::camera(camera, low, high));
    }
}

fn normals(scene: &Scene, findings: &mut Vec<Finding>) {
    if scene.corners.normal.is_empty() {
        return;
    }
    let mut behind: BTreeMap<u32, (usize, FaceId)> = BTreeMap::new();
    for id in scene.face_ids() {
        let face = scene.faces[id.index()];
        let area = scene.vector_area(id);
        let normals = &scene.corners.normal[face.corners()];
        if normals
            .iter()
            .any(|normal| normal.as_dvec3().dot(area) < 0.0)
        {
            behind.entry(face.object.0).or_insert((0, id)).0 += 1;
        }
    }
    findings.extend(
        behind
            .into_values()
            .map(|(count, first)| Finding::NormalsBehind {
                count,
                first: FaceRef::new(scene, first),
            }),
    );
}

fn materials(scene: &Scene, findings: &mut Vec<Finding>) {
    let mut first_face = vec![None; scene.materials.len()];
    for id in scene.face_ids() {
        first_face[scene.faces[id.index()].material.index()].get_or_insert(id);
    }
    for (material, first) in scene.materials.iter().zip(first_face) {
        let Some(first) = first else {
            if material.is_emissive() {
                let material = material.name.clone();
                findings.push(Finding::EmitterWithoutArea { material });
            }
            continue;
        };
        let reflectance = material.reflectance.0;
        if reflectance.max_element() >= HIGH_REFLECTANCE {
            findings.push(Finding::HighReflectance {
                material: material.name.clone(),
                reflectance: reflectance.max_element(),
                first: FaceRef::new(scene, first),
            });
        }
        if let Specular::Mirror {
            reflectance: mirror,
        } = material.specular
            && (reflectance + mirror).max_element() > 1.0
        {
            findings.push(Finding::GainsEnergy {
                material: material.name.clone(),
                sum: (reflectance + mirror).max_element(),
                first: FaceRef::new(scene, first),
            });
        }
    }
}

fn camera(camera: &Camera, low: DVec3, high: DVec3) -> Option<Finding> {
    let view = (camera.look_at - camera.position).normalize_or_zero();
    let is_ahead = |i: u32| {
        let pick = |axis: u32, low: f64, high: f64| if i >> axis & 1 == 0 { low } else { high };
        let corner = DVec3::new(
            pick(0, low.x, high.x),
            pick(1, low.y, high.y),
            pick(2, low.z, high.z),
        );
        (corner - camera.position).dot(view) > 0.0
    };
    if !(0..8).any(is_ahead) {
        let camera = camera.name.clone();
        return Some(Finding::CameraLooksAway { camera });
    }
    let Projection::Perspective { fov } = camera.projection else {
        return None;
    };
    let (angle, pixels) = match fov {
        FieldOfView::Horizontal(angle) => (angle, camera.size[0]),
        FieldOfView::Vertical(angle) => (angle, camera.size[1]),
    };
    let distance = camera.position.distance(low.midpoint(high));
    let pixel = 2.0 * (0.5 * angle).tan() / pixels as f64;
    (low.distance(high) < pixel * distance).then(|| Finding::CameraTooFar {
        camera: camera.name.clone(),
        distance,
    })
}
