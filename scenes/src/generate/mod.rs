//! Scenes whose answer is known, made by parameters.
//!
//! Each generator documents what is exact about its scene. All are in metres, y up, and hold the
//! invariants of [`Scene`]; every one has a camera named `main`.

mod closed_box;
mod cornell;
mod plates;
mod sphere;

pub use closed_box::{ClosedBox, furnace_box};
pub use cornell::cornell_box;
pub use plates::{ParallelPlates, PerpendicularPlates};
pub use sphere::{SphereInBox, SphereRadius, Tessellation};

use crate::camera::{Camera, FieldOfView, Projection};
use crate::id::MaterialId;
use crate::material::Material;
use crate::radiometry::{Radiance, Reflectance};
use crate::scene::Scene;
use glam::DVec3;

/// What a generated surface does with light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Diffuse reflectance ρ in [0, 1).
    pub reflectance: Reflectance,
    /// Emitted radiance L in W/(m² sr).
    pub emission: Radiance,
}

impl Surface {
    /// A surface that neither reflects nor emits.
    pub const BLACK: Self = Self {
        reflectance: Reflectance::ZERO,
        emission: Radiance::ZERO,
    };

    /// The same reflectance and emitted radiance (W/(m² sr)) in the three channels.
    pub const fn grey(reflectance: f64, emission: f64) -> Self {
        Self {
            reflectance: Reflectance::splat(reflectance),
            emission: Radiance::splat(emission),
        }
    }

    /// Adds it to a scene.
    ///
    /// # Panics
    /// When the reflectance is outside [0, 1) or the emission negative or not finite.
    fn push(self, scene: &mut Scene, name: &str) -> MaterialId {
        assert!(
            self.reflectance.is_valid(),
            "the reflectance of `{name}` must lie in [0, 1), not {:?}",
            self.reflectance.0
        );
        assert!(
            self.emission.0.is_finite() && self.emission.0.min_element() >= 0.0,
            "the emission of `{name}` must be finite and at least 0, not {:?}",
            self.emission.0
        );
        scene.push_material(Material::diffuse(name, self.reflectance).with_emission(self.emission))
    }
}

/// The camera of a generated scene: 256², 60° across.
fn main_camera(position: DVec3, look_at: DVec3) -> Camera {
    Camera {
        name: "main".to_owned(),
        position,
        look_at,
        up: DVec3::Y,
        projection: Projection::Perspective {
            fov: FieldOfView::Horizontal(60.0_f64.to_radians()),
        },
        size: [256, 256],
    }
}

/// Refuses lengths that are no lengths.
fn assert_lengths(lengths: &[f64]) {
    assert!(
        lengths
            .iter()
            .all(|&length| length > 0.0 && length.is_finite()),
        "lengths must be positive and finite, not {lengths:?}"
    );
}
