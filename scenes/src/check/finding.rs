//! What may be wrong with a scene that loads.

use crate::id::FaceId;
use crate::scene::Scene;
use glam::DVec3;
use std::fmt;

/// How much a finding matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Often meant, such as a box that is open at the front.
    Note,
    /// Hardly ever meant: results are likely not what was wanted.
    Warning,
}

/// A face as findings name it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FaceRef {
    /// The face.
    pub face: FaceId,
    /// Its object's name.
    pub object: String,
    /// Its number among the faces of its object in the scene, counted from one.
    pub number: usize,
}

impl FaceRef {
    /// Names a face of `scene`.
    pub fn new(scene: &Scene, face: FaceId) -> Self {
        let object = scene.faces[face.index()].object;
        let before = &scene.faces[..=face.index()];
        Self {
            face,
            object: scene.objects[object.index()].name.clone(),
            number: before.iter().filter(|f| f.object == object).count(),
        }
    }
}

impl fmt::Display for FaceRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "face {} of object `{}`", self.number, self.object)
    }
}

/// Something suspicious. What concerns faces is counted by object and names the first.
#[derive(Clone, Debug, PartialEq)]
pub enum Finding {
    /// Edges that only one face has: light can leave there.
    OpenEdges {
        /// How many edges of the object.
        count: usize,
        /// A face that has one.
        first: FaceRef,
        /// The middle of that edge in metres.
        at: DVec3,
    },
    /// Edges that end in the middle of another one: cracks of rounding may open there.
    TJunctions {
        /// How many edges of the object have another one ending on them.
        count: usize,
        /// A face that has one.
        first: FaceRef,
        /// The middle of that edge in metres.
        at: DVec3,
    },
    /// Neighbours that face opposite sides.
    InconsistentWinding {
        /// How many edges of the object.
        count: usize,
        /// A face.
        first: FaceRef,
        /// Its neighbour.
        second: FaceRef,
    },
    /// A closed surface that faces inwards although nothing is in it.
    InsideOut {
        /// Number of faces of the surface.
        count: usize,
        /// One of them.
        first: FaceRef,
    },
    /// Shading normals that point behind their face.
    NormalsBehind {
        /// How many faces of the object have one.
        count: usize,
        /// The first of them.
        first: FaceRef,
    },
    /// Faces with the same corners that face the same side.
    DuplicateFaces {
        /// How many faces of the object are there once more.
        count: usize,
        /// A face.
        first: FaceRef,
        /// The same face again.
        second: FaceRef,
    },
    /// Faces in one plane that overlap and face the same side: which one is seen is left to rounding.
    OverlappingFaces {
        /// How many pairs, by the object of the first face.
        count: usize,
        /// A face.
        first: FaceRef,
        /// A face that covers part of it.
        second: FaceRef,
    },
    /// A reflectance that real surfaces do not have and that makes light bounce for long.
    HighReflectance {
        /// The material.
        material: String,
        /// Its largest channel.
        reflectance: f64,
        /// A face that has it.
        first: FaceRef,
    },
    /// A material that reflects more than arrives, diffuse and mirror together.
    GainsEnergy {
        /// The material.
        material: String,
        /// Sum of the largest channel.
        sum: f64,
        /// A face that has it.
        first: FaceRef,
    },
    /// A material that emits but that no face has.
    EmitterWithoutArea {
        /// The material.
        material: String,
    },
    /// A point or spot light outside the box around all faces.
    LightOutside {
        /// The light.
        light: String,
        /// Its position in metres.
        position: DVec3,
    },
    /// A scene so small or large that its unit is doubtful.
    SuspiciousSize {
        /// Extent along x, y and z in metres.
        extent: DVec3,
    },
    /// All of the scene lies behind a camera.
    CameraLooksAway {
        /// The camera.
        camera: String,
    },
    /// A camera so far away that the scene is smaller than a pixel.
    CameraTooFar {
        /// The camera.
        camera: String,
        /// Its distance from the middle of the scene in metres.
        distance: f64,
    },
}

impl Finding {
    /// How much it matters.
    pub fn severity(&self) -> Severity {
        match self {
            Self::OpenEdges { .. } | Self::TJunctions { .. } | Self::LightOutside { .. } => {
                Severity::Note
            }
            _ => Severity::Warning,
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OpenEdges { count, first, at } => {
                write!(
                    f,
                    "{count} open edge(s), one at {} of {first}: light can leave there",
                    point(*at)
                )
            }
            Self::TJunctions { count, first, at } => write!(
                f,
                "{count} edge(s) on which another one ends, one at {} of {first}: split them there \
                 to rule out cracks",
                point(*at)
            ),
            Self::InconsistentWinding {
                count,
                first,
                second,
            } => write!(
                f,
                "{first} and its neighbour, {second}, face opposite sides ({count} such edge(s)): \
                 turn one of them over"
            ),
            Self::InsideOut { count, first } => write!(
                f,
                "the closed surface of {count} face(s) around {first} faces inwards and has nothing \
                 in it: turn its faces over"
            ),
            Self::NormalsBehind { count, first } => write!(
                f,
                "shading normals of {count} face(s) point behind them, the first is {first}: turn \
                 the faces or the normals over"
            ),
            Self::DuplicateFaces {
                count,
                first,
                second,
            } => {
                write!(
                    f,
                    "{second} is {first} again ({count} such face(s)): remove one of them"
                )
            }
            Self::OverlappingFaces {
                count,
                first,
                second,
            } => write!(
                f,
                "{first} and {second} overlap in one plane ({count} such pair(s)): which one is seen \
                 is left to rounding; move or cut one of them"
            ),
            Self::HighReflectance {
                material,
                reflectance,
                first,
            } => write!(
                f,
                "material `{material}` ({first}) has a reflectance of {reflectance}: white paint \
                 has 0.9 at most"
            ),
            Self::GainsEnergy {
                material,
                sum,
                first,
            } => write!(
                f,
                "material `{material}` ({first}) reflects {sum} of what arrives, diffuse and mirror \
                 together: lower one of them"
            ),
            Self::EmitterWithoutArea { material } => {
                write!(
                    f,
                    "material `{material}` emits, but no face has it: assign it or remove it"
                )
            }
            Self::LightOutside { light, position } => write!(
                f,
                "light `{light}` at {} is outside the box around all faces",
                point(*position)
            ),
            Self::SuspiciousSize { extent } => write!(
                f,
                "the scene measures {:.3} × {:.3} × {:.3} m: is its unit the metre? Otherwise set \
                 `scale` in `[scene]`",
                extent.x, extent.y, extent.z
            ),
            Self::CameraLooksAway { camera } => {
                write!(
                    f,
                    "camera `{camera}` sees nothing: the whole scene is behind it"
                )
            }
            Self::CameraTooFar { camera, distance } => write!(
                f,
                "camera `{camera}` is {distance:.0} m away: the scene is smaller than a pixel; are \
                 its position and the geometry in the same unit?"
            ),
        }
    }
}

fn point(p: DVec3) -> String {
    format!("({:.4}, {:.4}, {:.4})", p.x, p.y, p.z)
}
