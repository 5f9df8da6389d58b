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

/// What lies beyond a gap.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LeadsTo {
    /// Nothing, or the backs of other surfaces.
    Outside,
    /// A room that does not see the first.
    AnotherRoom,
}

/// Share of the light from which a leak is a fault: a hundredth of a per mille shows in no result, and
/// coordinates of six digits make such gaps.
const LEAK: f64 = 1e-5;

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
    /// A narrow gap through which light leaves a room.
    Gap {
        /// A face with a free edge, and the one that it should touch.
        between: [FaceRef; 2],
        /// The middle of the gap where it is widest, in metres.
        at: DVec3,
        /// Its largest width in metres.
        width: f64,
        /// Its length in metres.
        length: f64,
        /// Its area over that of all lit surfaces: about the share of the light that leaves.
        share: f64,
        /// What is beyond it.
        leads_to: LeadsTo,
    },
    /// A wide opening to the outside.
    Opening {
        /// Share of the rays from lit surfaces that leave the scene.
        fraction: f64,
        /// The objects that its rim belongs to.
        rim: Vec<String>,
        /// The middle of the rim in metres.
        at: DVec3,
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
            }
            | Self::Opening { .. } => Severity::Note,
            Self::Gap { share, .. } if *share < LEAK => Severity::Note,
            _ => Severity::Warning,
        }
    }

    /// A word for the kind of finding, for programs.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::BackSeen { .. } => "back-seen",
            Self::ObjectInside { .. } => "object-inside",
            Self::CameraInside { .. } => "camera-inside",
            Self::CameraOnFace { .. } => "camera-on-face",
            Self::Gap { .. } => "gap",
            Self::Opening { .. } => "opening",
            Self::LightInside { .. } => "light-inside",
        }
    }

    /// The objects that it is about, each once.
    pub fn objects(&self) -> Vec<&str> {
        let mut objects: Vec<&str> = match self {
            Self::BackSeen { place, .. }
            | Self::CameraInside { place, .. }
            | Self::LightInside { place, .. } => vec![&place.face.object],
            Self::ObjectInside { object, around } => vec![object, &around.object],
            Self::CameraOnFace { face, .. } => vec![&face.object],
            Self::Gap { between, .. } => between.iter().map(|f| f.object.as_str()).collect(),
            Self::Opening { rim, .. } => rim.iter().map(String::as_str).collect(),
        };
        objects.dedup();
        objects
    }

    /// Where it is, in metres.
    pub fn position(&self) -> Option<DVec3> {
        match self {
            Self::BackSeen { place, .. }
            | Self::CameraInside { place, .. }
            | Self::LightInside { place, .. } => Some(place.at),
            Self::Gap { at, .. } | Self::Opening { at, .. } => Some(*at),
            Self::ObjectInside { .. } | Self::CameraOnFace { .. } => None,
        }
    }

    /// How much it is, as a fraction of the light or of the rays in question.
    pub fn fraction(&self) -> Option<f64> {
        match self {
            Self::BackSeen { fraction, .. }
            | Self::CameraInside { fraction, .. }
            | Self::LightInside { fraction, .. }
            | Self::Opening { fraction, .. } => Some(*fraction),
            Self::Gap { share, .. } => Some(*share),
            Self::ObjectInside { .. } | Self::CameraOnFace { .. } => None,
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
            Self::Gap {
                between: [first, second],
                at,
                width,
                length,
                share,
                leads_to,
            } => {
                let DVec3 { x, y, z } = at;
                let to = match leads_to {
                    LeadsTo::Outside => "to the outside",
                    LeadsTo::AnotherRoom => "to another room",
                };
                write!(
                    f,
                    "light leaks {to} between {first} and {second}: a gap of {length:.4} m up to \
                     {width:.2e} m wide, at ({x:.4}, {y:.4}, {z:.4}), for about {share:.1e} of the light; \
                     move or extend one of them until they meet or overlap"
                )
            }
            Self::Opening { fraction, rim, at } => {
                let DVec3 { x, y, z } = at;
                let names: Vec<String> = rim.iter().take(4).map(|r| format!("`{r}`")).collect();
                let more = if rim.len() > 4 { ", …" } else { "" };
                write!(
                    f,
                    "opening around ({x:.4}, {y:.4}, {z:.4}), bounded by {}{more}: {:.2} % of the rays \
                     from surfaces leave the scene; close it if it is not meant",
                    names.join(", "),
                    percent(*fraction)
                )
            }
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
