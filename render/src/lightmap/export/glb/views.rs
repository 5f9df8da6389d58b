//! Lights and cameras of a scene as nodes, and what a scene file adds to a document.
//!
//! Sources: glTF 2.0, chapter 3.10 (cameras look along −z, y up); `KHR_lights_punctual` (so do lights). Intensities keep the unit
//! that the scene counts in. The planes of clipping, which luxel's cameras do not have, follow the size of the scene.

use super::document::{Document, PUNCTUAL, child_mut, items_mut, object_mut, set};
use glam::{DMat3, DQuat, DVec3};
use luxel_scenes::{Camera, FieldOfView, GltfOrigin, Light, LightKind, Projection, Rgb, Scene};
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// Nearest that a camera sees, in diagonals of the scene: nearer costs depth buffers precision, farther cuts into walls beside it.
const NEAR: f64 = 1e-3;

/// Adds a light to a document and returns its node; `None` for one that the format cannot tell.
pub(super) fn light(document: &mut Document, light: &Light) -> Option<usize> {
    let mut node = json!({"name": light.name});
    let (kind, strength) = match &light.kind {
        LightKind::Point {
            position,
            intensity,
        } => {
            set(&mut node, "translation", json!(position.to_array()));
            ("point", intensity.0)
        }
        LightKind::Spot {
            position,
            direction,
            intensity,
            ..
        } => {
            set(&mut node, "translation", json!(position.to_array()));
            turn(&mut node, *direction);
            ("spot", intensity.0)
        }
        LightKind::Directional {
            direction,
            irradiance,
        } => {
            turn(&mut node, *direction);
            ("directional", irradiance.0)
        }
        LightKind::Lambertian { .. } | LightKind::Sky { .. } | LightKind::Environment { .. } => {
            return None;
        }
    };
    let largest = strength.max_element();
    let colour = if largest > 0.0 {
        strength / largest
    } else {
        Rgb::ONE
    };
    let mut value = json!({
        "name": light.name, "type": kind, "color": colour.to_array(), "intensity": largest,
    });
    if let LightKind::Spot {
        inner_angle,
        outer_angle,
        ..
    } = light.kind
    {
        let cone = json!({"innerConeAngle": inner_angle, "outerConeAngle": outer_angle});
        set(&mut value, "spot", cone);
    }
    document.use_extension(PUNCTUAL);
    let extension = child_mut(child_mut(&mut document.root, "extensions"), PUNCTUAL);
    let lights = items_mut(object_mut(extension), "lights");
    lights.push(value);
    let number = lights.len() - 1;
    set(
        child_mut(&mut node, "extensions"),
        PUNCTUAL,
        json!({"light": number}),
    );
    Some(document.push("nodes", node))
}

/// Turns a node so that its −z points along a unit vector.
fn turn(node: &mut Value, direction: DVec3) {
    let rotation = DQuat::from_rotation_arc(DVec3::NEG_Z, direction).normalize();
    set(node, "rotation", json!(rotation.to_array()));
}

/// Adds a camera to a document and returns its node.
pub(super) fn camera(document: &mut Document, scene: &Scene, camera: &Camera) -> usize {
    let (lower, upper) = scene.bounds().unwrap_or((DVec3::ZERO, DVec3::ONE));
    let diagonal = (upper - lower).length().max(f64::MIN_POSITIVE);
    let aspect = camera.size[0] as f64 / camera.size[1].max(1) as f64;
    let near = NEAR * diagonal;
    let mut value = match camera.projection {
        Projection::Perspective { fov } => {
            let angle = match fov {
                FieldOfView::Vertical(angle) => angle,
                FieldOfView::Horizontal(angle) => 2.0 * ((angle / 2.0).tan() / aspect).atan(),
            };
            json!({"type": "perspective", "perspective": {"yfov": angle, "aspectRatio": aspect, "znear": near}})
        }
        Projection::Orthographic { height } => {
            let middle = (lower + upper) / 2.0;
            let far = camera.position.distance(middle) + diagonal;
            json!({"type": "orthographic", "orthographic": {
                "xmag": height * aspect / 2.0, "ymag": height / 2.0, "znear": 0.0, "zfar": far,
            }})
        }
    };
    set(&mut value, "name", camera.name.as_str());
    let number = document.push("cameras", value);
    let back = (camera.position - camera.look_at).normalize_or(DVec3::Z);
    let side = camera
        .up
        .cross(back)
        .normalize_or(back.any_orthonormal_vector());
    let axes = DMat3::from_cols(side, back.cross(side), back);
    let rotation = DQuat::from_mat3(&axes).normalize();
    let node = json!({
        "name": camera.name, "camera": number,
        "translation": camera.position.to_array(), "rotation": rotation.to_array(),
    });
    document.push("nodes", node)
}

/// Adds what a scene file says beyond the document that its geometry came from: the scale as a node above all others,
/// lights and cameras.
pub(super) fn add_changes(document: &mut Document, scene: &Scene, origin: &GltfOrigin) {
    let mut roots = roots(document);
    let mut added = Vec::new();
    for own in scene.lights.iter().skip(origin.lights) {
        added.extend(light(document, own));
    }
    let own = scene.cameras.len().saturating_sub(origin.cameras);
    for own in &scene.cameras[..own] {
        added.push(camera(document, scene, own));
    }
    let is_scaled = origin.scale.to_bits() != 1.0_f64.to_bits();
    if added.is_empty() && !is_scaled {
        return;
    }
    if is_scaled {
        let scale = [origin.scale; 3];
        let node = json!({"name": "scale", "scale": scale, "children": roots});
        roots = vec![document.push("nodes", node).into()];
    }
    roots.extend(added.into_iter().map(Value::from));
    let number = default_scene(document);
    let scenes = document.items_mut("scenes");
    if let Some(scene) = scenes.get_mut(number) {
        set(scene, "nodes", roots);
    } else {
        scenes.push(json!({"nodes": roots}));
        set(&mut document.root, "scene", 0);
    }
}

fn default_scene(document: &Document) -> usize {
    super::document::index(&document.root, "scene").unwrap_or(0)
}

/// The nodes that the reader begins with.
fn roots(document: &Document) -> Vec<Value> {
    if let Some(scene) = document.items("scenes").get(default_scene(document)) {
        let nodes = scene.get("nodes").and_then(Value::as_array);
        return nodes.cloned().unwrap_or_default();
    }
    let nodes = document.items("nodes");
    let children: BTreeSet<u64> = nodes
        .iter()
        .filter_map(|node| node.get("children")?.as_array())
        .flatten()
        .filter_map(Value::as_u64)
        .collect();
    let all = 0..nodes.len() as u64;
    all.filter(|node| !children.contains(node))
        .map(Value::from)
        .collect()
}
