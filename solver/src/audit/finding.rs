//! What rays may find wrong with a scene.

use crate::world::World;
use glam::DVec3;
use luxel_scenes::FaceId;
use luxel_scenes::check::{FaceRef, Severity};
use std::fmt;

/// A face, and where it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// The face.
    pub face: FaceRef,
    /// The middle of its corners in metres.
    pub at: DVec3,
}

impl Place {
    pub(super) fn new(world: &World, face: FaceId) -> Self {
        let corners = world.scene().polygon(face);
        let count = corners.len() as f64;
        Self {
            face: FaceRef::new(world.scene(), face),
            at: corners.sum::<DVec3>() / count,
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let DVec3 { x, y, z } = self.at;
        write!(f, "{} at ({x:.4}, {y:.4}, {z:.4})", self.face)
    }
}

/// Something suspicious that rays found.
#[derive(Clone, Debug, PartialEq)]
pub enum Finding {
    /// The back of a one-sided object that is seen from the open.
    BackSeen {
        /// Back hits among all hits of the object.
        fraction: f64,
        /// Whether this is often enough to matter.
        is_frequent: bool,
        /// The face that is seen from behind most often.
        place: Place,
        /// The camera that sees it; from other surfaces when there is none.
        camera: Option<String>,
    },
    /// An object all of whose surface lies inside a solid.
    ObjectInside {
        /// The object.
        object: String,
        /// A face of the solid.
        around: FaceRef,
    },
    /// A camera most of whose rays meet backs.
    CameraInside {
        /// The camera.
        camera: String,
        /// Fraction of its rays that do.
        fraction: f64,
        /// The face that most of them meet.
        place: Place,
    },
    /// A camera whose eye lies on a face.
    CameraOnFace {
        /// The camera.
        camera: String,
        /// The face.
        face: FaceRef,
    },
    /// A point or spot light most of whose rays meet backs.
    LightInside {
        /// The light.
        light: String,
        /// Fraction of its rays that do.
        fraction: f64,
        /// The face that most of them meet.
        place: Place,
    },
}

impl Finding {
    /// How much it matters.
    pub fn severity(&self) -> Severity {
        match self {
            Self::BackSeen {
                is_frequent: false, ..
            } => Severity::Note,
            _ => Severity::Warning,
        }
    }

    /// Whether a camera or a light sees nothing but backs.
    pub fn is_total(&self) -> bool {
        match self {
            // A fraction of counts: exact.
            Self::CameraInside { fraction, .. } | Self::LightInside { fraction, .. } => {
                *fraction >= 1.0
            }
            _ => false,
        }
    }

    /// Whether both say that the back of the same object is seen.
    pub(super) fn is_about_same_back(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::BackSeen { place: a, .. }, Self::BackSeen { place: b, .. }) => {
                a.face.object == b.face.object
            }
            _ => false,
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |fraction: f64| 100.0 * fraction;
        match self {
            Self::BackSeen {
                fraction,
                place,
                camera,
                ..
            } => {
                let viewer = match camera {
                    Some(camera) => format!("camera `{camera}`"),
                    None => "other surfaces".to_owned(),
                };
                write!(
                    f,
                    "object `{}` is seen from behind by {viewer} ({:.2} % of the rays that meet it, \
                     most often {place}), and its back is black: turn its faces over, or set \
                     `two_sided = true` in its material",
                    place.face.object,
                    percent(*fraction)
                )
            }
            Self::ObjectInside { object, around } => write!(
                f,
                "object `{object}` lies inside a solid (it sees the back of {around}), or its faces \
                 are turned over: no light reaches it"
            ),
            Self::CameraInside {
                camera,
                fraction,
                place,
            } => write!(
                f,
                "camera `{camera}` is inside a wall or a solid: {:.0} % of its rays meet the backs of \
                 faces, most often {place}; move the camera out of object `{}`, or turn the faces \
                 over if it should be seen from there",
                percent(*fraction),
                place.face.object
            ),
            Self::CameraOnFace { camera, face } => write!(
                f,
                "camera `{camera}` lies on {face}: which side it sees is left to rounding; move it \
                 off the face"
            ),
            Self::LightInside {
                light,
                fraction,
                place,
            } => write!(
                f,
                "light `{light}` is inside a solid: {:.0} % of its rays meet the backs of faces, most \
                 often {place}; move the light out of object `{}`",
                percent(*fraction),
                place.face.object
            ),
        }
    }
}
