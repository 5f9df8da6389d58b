//! Lights of `KHR_lights_punctual` (candela, lux) and cameras, both at nodes.

use super::error::GltfError;
use super::material::finite;
use super::source::Source;
use crate::camera::{Camera, FieldOfView, Projection};
use crate::light::{Light, LightKind};
use crate::radiometry::{Intensity, Irradiance, Rgb};
use glam::{DMat4, DVec3};
use gltf::khr_lights_punctual::Kind;
use std::f64::consts::{FRAC_PI_2, PI};

/// Height in pixels of pictures of cameras, of which glTF gives the aspect only.
const HEIGHT: f64 = 512.0;
/// Largest width in pixels.
const MAX_WIDTH: f64 = 65536.0;

/// Lights and cameras look along −z of their node.
fn forward(transform: &DMat4) -> DVec3 {
    -transform.z_axis.truncate().normalize_or_zero()
}

/// The light at a node of this name and transform to the world.
pub(super) fn light(
    source: &Source,
    light: &gltf::khr_lights_punctual::Light,
    name: &str,
    transform: &DMat4,
) -> Result<Light, GltfError> {
    let element = format!("light `{name}`");
    let value = |problem| GltfError::Value {
        file: source.file.to_owned(),
        element: element.clone(),
        problem,
    };
    let range = "colour and intensity must be finite and at least 0";
    let strength = Rgb::from(light.color().map(f64::from)) * f64::from(light.intensity());
    finite(source, &element, &light.color(), range)?;
    if !strength.is_finite() || strength.min_element() < 0.0 {
        return Err(value(range));
    }
    let position = transform.w_axis.truncate();
    let direction = forward(transform);
    let has_direction = direction != DVec3::ZERO;
    let kind = match light.kind() {
        Kind::Point => LightKind::Point {
            position,
            intensity: Intensity(strength),
        },
        Kind::Directional if has_direction => LightKind::Directional {
            direction,
            irradiance: Irradiance(strength),
        },
        Kind::Spot {
            inner_cone_angle,
            outer_cone_angle,
        } if has_direction => {
            let (inner_angle, outer_angle) =
                (f64::from(inner_cone_angle), f64::from(outer_cone_angle));
            // The default of π/4 and the limit of π/2 are rounded to f32.
            let outer_angle = if outer_angle > FRAC_PI_2 && outer_angle < FRAC_PI_2 + 1e-6 {
                FRAC_PI_2
            } else {
                outer_angle
            };
            if !(0.0 <= inner_angle && inner_angle < outer_angle && outer_angle <= FRAC_PI_2) {
                return Err(value("cone angles must be 0 ≤ inner < outer ≤ π/2"));
            }
            LightKind::Spot {
                position,
                direction,
                intensity: Intensity(strength),
                inner_angle,
                outer_angle,
            }
        }
        _ => return Err(value("the node's scale leaves no direction")),
    };
    let name = name.to_owned();
    Ok(Light { name, kind })
}

/// The camera at a node of this name and transform to the world.
pub(super) fn camera(
    source: &Source,
    camera: &gltf::Camera,
    name: &str,
    transform: &DMat4,
) -> Result<Camera, GltfError> {
    let value = |problem| GltfError::Value {
        file: source.file.to_owned(),
        element: format!("camera `{name}`"),
        problem,
    };
    let position = transform.w_axis.truncate();
    let view = forward(transform);
    let up = transform.y_axis.truncate().normalize_or_zero();
    if view == DVec3::ZERO || view.cross(up) == DVec3::ZERO {
        return Err(value("the node's scale leaves no direction"));
    }
    let (projection, aspect) = match camera.projection() {
        gltf::camera::Projection::Perspective(perspective) => {
            let angle = f64::from(perspective.yfov());
            if !(angle > 0.0 && angle < PI) {
                return Err(value("yfov must lie between 0 and π"));
            }
            let fov = FieldOfView::Vertical(angle);
            let aspect = perspective.aspect_ratio().map_or(1.0, f64::from);
            (Projection::Perspective { fov }, aspect)
        }
        gltf::camera::Projection::Orthographic(orthographic) => {
            let [width, height] = [orthographic.xmag(), orthographic.ymag()].map(f64::from);
            if !(width.abs() > 0.0 && height.abs() > 0.0 && (width / height).is_finite()) {
                return Err(value("xmag and ymag must be finite and not 0"));
            }
            let height = height.abs();
            let projection = Projection::Orthographic {
                height: 2.0 * height,
            };
            (projection, width.abs() / height)
        }
    };
    if !(aspect > 0.0 && aspect.is_finite()) {
        return Err(value("aspectRatio must be finite and above 0"));
    }
    let width = (HEIGHT * aspect).round().clamp(1.0, MAX_WIDTH);
    Ok(Camera {
        name: name.to_owned(),
        position,
        look_at: position + view,
        up,
        projection,
        size: [width as usize, HEIGHT as usize],
    })
}
