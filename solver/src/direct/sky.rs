//! Light from outside the scene: sky models and environment images.

use glam::{DVec2, DVec3, Quat};
use luxel_scenes::{LightKind, Radiance, Scene, Sky, TextureId};
use std::f64::consts::{PI, TAU};

/// The sum of a scene's skies and environments.
pub(super) struct SkyDome {
    layers: Vec<Layer>,
}

enum Layer {
    Formula {
        sky: Sky,
        up: DVec3,
        ground: Radiance,
    },
    Image {
        texture: TextureId,
        scale: Radiance,
        rotation: f64,
        up: DVec3,
    },
}

impl SkyDome {
    /// `None` for a scene without sky.
    pub(super) fn new(scene: &Scene) -> Option<Self> {
        let layers: Vec<Layer> = scene
            .lights
            .iter()
            .filter_map(|light| match &light.kind {
                LightKind::Sky { sky, up, ground } => Some(Layer::Formula {
                    sky: *sky,
                    up: *up,
                    ground: *ground,
                }),
                LightKind::Environment {
                    texture,
                    scale,
                    rotation,
                    up,
                } => Some(Layer::Image {
                    texture: *texture,
                    scale: *scale,
                    rotation: *rotation,
                    up: *up,
                }),
                _ => None,
            })
            .collect();
        (!layers.is_empty()).then_some(Self { layers })
    }

    /// Radiance from the unit direction that a ray leaves the scene in.
    pub(super) fn radiance(&self, scene: &Scene, direction: DVec3) -> Radiance {
        self.layers
            .iter()
            .map(|layer| match layer {
                Layer::Formula { up, ground, .. } if direction.dot(*up) < 0.0 => *ground,
                Layer::Formula { sky, up, .. } => sky.radiance(direction, *up),
                Layer::Image {
                    texture,
                    scale,
                    rotation,
                    up,
                } => {
                    let uv = latitude_longitude(direction, *up, *rotation);
                    Radiance(scale.0 * scene.textures[texture.index()].sample(uv))
                }
            })
            .sum()
    }
}

/// Texture coordinates (v upwards) of a direction in a latitude–longitude image whose middle looks
/// along −z for `up` = y, as in most tools, turned by `rotation` about `up`.
fn latitude_longitude(direction: DVec3, up: DVec3, rotation: f64) -> DVec2 {
    let upright = Quat::from_rotation_arc(up.as_vec3(), glam::Vec3::Y).as_dquat();
    let local = upright * direction;
    let azimuth = local.x.atan2(-local.z) + rotation;
    let v = 1.0 - local.y.clamp(-1.0, 1.0).acos() / PI;
    DVec2::new((azimuth / TAU + 0.5).rem_euclid(1.0), v)
}
