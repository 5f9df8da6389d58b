//! Camera rays.
//!
//! Raster coordinates `(x, y)` are continuous, in pixels: `(0, 0)` is the *upper left* corner of
//! the picture, `x` grows to the right and `y` downwards, so that row 0 of an image is its top and
//! the centre of the first pixel is `(0.5, 0.5)`. With the unit vectors right **r**, up **u** and
//! forward **f** = (`look_at` − `position`)/|…|, **r** = **f** × `up`/|…|, **u** = **r** × **f**,
//! and X = 2x/w − 1, Y = 1 − 2y/h:
//!
//! - perspective: o = `position`, d ∝ **f** + X tan(φx/2) **r** + Y tan(φy/2) **u**, pixels square,
//!   so that tan(φx/2)/tan(φy/2) = w/h;
//! - orthographic: o = `position` + (H/2)(X w/h **r** + Y **u**), d = **f**.
//!
//! Source: the look-at transform as in M. Pharr, W. Jakob, G. Humphreys, "Physically Based
//! Rendering", 4th ed. 2023, section 3.9.1 and 5.2, in a right-handed frame. Cost: O(1) a ray.

use glam::{DVec2, DVec3};
use luxel_scenes::{Camera, FieldOfView, Projection};

/// A half line in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraRay {
    /// Where it starts, in metres.
    pub origin: DVec3,
    /// Its unit direction.
    pub direction: DVec3,
}

/// Why a camera makes no rays.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CameraError {
    /// The eye stands where it looks at.
    #[error("camera {0:?}: position and look_at are the same point; move one of them")]
    NoView(String),
    /// The up vector is zero or points along the view.
    #[error("camera {0:?}: up is zero or parallel to the view; choose another up")]
    NoUp(String),
    /// The angle of view or the height of the visible rectangle is out of range.
    #[error(
        "camera {0:?}: the picture has no extent; fov must lie between 0 and 180 degrees, height above 0"
    )]
    NoExtent(String),
    /// There are no pixels.
    #[error("camera {0:?}: a picture needs at least one pixel in each direction")]
    NoPixels(String),
}

/// A camera with its frame worked out, for pictures of one size.
#[derive(Clone, Debug)]
pub struct CameraFrame {
    position: DVec3,
    forward: DVec3,
    /// Half the width and half the height of the picture, as vectors in the image plane.
    half_right: DVec3,
    half_up: DVec3,
    perspective: bool,
    size: [usize; 2],
}

impl CameraFrame {
    /// The frame of `camera` for a picture of `size` (width, height) pixels. A field of view keeps
    /// its angle along its own axis; the other axis follows the shape of the picture.
    ///
    /// # Errors
    /// When the camera's vectors span no frame, its picture no area, or `size` holds a zero.
    pub fn new(camera: &Camera, size: [usize; 2]) -> Result<Self, CameraError> {
        let name = || camera.name.clone();
        if size.contains(&0) {
            return Err(CameraError::NoPixels(name()));
        }
        let forward = (camera.look_at - camera.position)
            .try_normalize()
            .ok_or_else(|| CameraError::NoView(name()))?;
        let up = camera
            .up
            .try_normalize()
            .ok_or_else(|| CameraError::NoUp(name()))?;
        let across = forward.cross(up);
        // Below this sine the direction of `across` is rounding noise of two unit vectors.
        if across.length() < 1e-12 {
            return Err(CameraError::NoUp(name()));
        }
        let right = across.normalize();
        let up = right.cross(forward);
        let aspect = size[0] as f64 / size[1] as f64;
        let (half_width, half_height) = match camera.projection {
            Projection::Perspective {
                fov: FieldOfView::Horizontal(angle),
            } => ((angle / 2.0).tan(), (angle / 2.0).tan() / aspect),
            Projection::Perspective {
                fov: FieldOfView::Vertical(angle),
            } => ((angle / 2.0).tan() * aspect, (angle / 2.0).tan()),
            Projection::Orthographic { height } => (height / 2.0 * aspect, height / 2.0),
        };
        let good = |x: f64| x.is_finite() && x > 0.0;
        if !good(half_width) || !good(half_height) {
            return Err(CameraError::NoExtent(name()));
        }
        Ok(Self {
            position: camera.position,
            forward,
            half_right: right * half_width,
            half_up: up * half_height,
            perspective: matches!(camera.projection, Projection::Perspective { .. }),
            size,
        })
    }

    /// Width and height of the picture in pixels.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Where all rays start, in metres; `None` for parallel rays.
    pub fn eye(&self) -> Option<DVec3> {
        self.perspective.then_some(self.position)
    }

    /// The ray through raster position `raster` (pixels, from the upper left corner).
    pub fn ray(&self, raster: DVec2) -> CameraRay {
        let x = 2.0 * raster.x / self.size[0] as f64 - 1.0;
        let y = 1.0 - 2.0 * raster.y / self.size[1] as f64;
        let offset = self.half_right * x + self.half_up * y;
        if self.perspective {
            CameraRay {
                origin: self.position,
                direction: (self.forward + offset).normalize(),
            }
        } else {
            CameraRay {
                origin: self.position + offset,
                direction: self.forward,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    /// A camera in the origin that looks along −z, with y up: right is +x.
    fn camera(projection: Projection) -> Camera {
        Camera {
            name: "test".into(),
            position: DVec3::ZERO,
            look_at: DVec3::NEG_Z,
            up: DVec3::Y,
            projection,
            size: [4, 2],
        }
    }

    fn close(a: DVec3, b: DVec3) -> bool {
        (a - b).length() < 1e-14
    }

    #[test]
    fn corner_rays_of_a_right_angle_have_unit_slopes() {
        let horizontal = Projection::Perspective {
            fov: FieldOfView::Horizontal(FRAC_PI_2),
        };
        let frame = CameraFrame::new(&camera(horizontal), [4, 2]).expect("a valid camera");
        let upper_left = DVec3::new(-1.0, 0.5, -1.0).normalize();
        let lower_right = DVec3::new(1.0, -0.5, -1.0).normalize();
        assert!(close(frame.ray(DVec2::ZERO).direction, upper_left));
        assert!(close(
            frame.ray(DVec2::new(4.0, 2.0)).direction,
            lower_right
        ));
        assert!(close(
            frame.ray(DVec2::new(2.0, 1.0)).direction,
            DVec3::NEG_Z
        ));

        let vertical = Projection::Perspective {
            fov: FieldOfView::Vertical(FRAC_PI_2),
        };
        let frame = CameraFrame::new(&camera(vertical), [4, 2]).expect("a valid camera");
        let upper_left = DVec3::new(-2.0, 1.0, -1.0).normalize();
        assert!(close(frame.ray(DVec2::ZERO).direction, upper_left));
    }

    #[test]
    fn orthographic_rays_start_in_the_image_plane() {
        let projection = Projection::Orthographic { height: 3.0 };
        let frame = CameraFrame::new(&camera(projection), [4, 2]).expect("a valid camera");
        let ray = frame.ray(DVec2::ZERO);
        assert!(close(ray.direction, DVec3::NEG_Z));
        assert!(close(ray.origin, DVec3::new(-3.0, 1.5, 0.0)));
    }

    #[test]
    fn a_tilted_up_vector_is_made_perpendicular() {
        let mut tilted = camera(Projection::Orthographic { height: 2.0 });
        tilted.up = DVec3::new(0.0, 1.0, -0.7);
        let frame = CameraFrame::new(&tilted, [2, 2]).expect("a valid camera");
        let top = frame.ray(DVec2::new(1.0, 0.0)).origin;
        assert!(close(top, DVec3::Y));
    }

    #[test]
    fn degenerate_cameras_are_refused() {
        let good = camera(Projection::Perspective {
            fov: FieldOfView::Horizontal(1.0),
        });
        let refused = |change: &dyn Fn(&mut Camera)| {
            let mut bad = good.clone();
            change(&mut bad);
            CameraFrame::new(&bad, [4, 2]).err()
        };
        let name = || "test".to_string();
        assert_eq!(
            refused(&|c| c.look_at = c.position),
            Some(CameraError::NoView(name()))
        );
        assert_eq!(
            refused(&|c| c.up = DVec3::Z),
            Some(CameraError::NoUp(name()))
        );
        assert_eq!(
            refused(&|c| c.up = DVec3::ZERO),
            Some(CameraError::NoUp(name()))
        );
        let half_turn = Projection::Perspective {
            fov: FieldOfView::Vertical(-PI),
        };
        assert_eq!(
            refused(&|c| c.projection = half_turn),
            Some(CameraError::NoExtent(name()))
        );
        assert_eq!(
            CameraFrame::new(&good, [0, 2]).err(),
            Some(CameraError::NoPixels(name()))
        );
    }
}
