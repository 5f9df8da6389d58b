//! Cameras as data; their rays are made by the renderer.

use glam::DVec3;

/// A named view.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Its name, unique in the scene.
    pub name: String,
    /// Position of the eye in metres.
    pub position: DVec3,
    /// A point in the middle of the picture, in metres, not the position itself.
    pub look_at: DVec3,
    /// A direction that appears upwards in the picture, not parallel to the view.
    pub up: DVec3,
    /// How the picture is projected.
    pub projection: Projection,
    /// Width and height of the picture in pixels.
    pub size: [usize; 2],
}

/// How a camera projects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// A pinhole.
    Perspective {
        /// The angle of view.
        fov: FieldOfView,
    },
    /// Parallel rays.
    Orthographic {
        /// Height of the visible rectangle in metres.
        height: f64,
    },
}

/// A full angle of view in radians, in (0, π), along one side of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FieldOfView {
    /// Across the width.
    Horizontal(f64),
    /// Across the height.
    Vertical(f64),
}
