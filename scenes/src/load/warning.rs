//! What a reader put right or left out, counted.

use super::error::UnknownName;
use super::place::Place;
use std::fmt;

/// Something that a reader changed, assumed or left out. One warning stands for all cases of its
/// kind in a file and names the first.
#[derive(Clone, Debug, PartialEq)]
pub enum Warning {
    /// Faces without area (collinear or coincident corners) were dropped.
    DegenerateFaces {
        /// How many.
        count: usize,
        /// The first.
        first: FacePlace,
    },
    /// Faces with the corners and the front of an earlier one were dropped.
    DuplicateFaces {
        /// How many.
        count: usize,
        /// The first.
        first: FacePlace,
    },
    /// Flat faces that are not convex were cut into triangles.
    ConcaveFaces {
        /// How many.
        count: usize,
        /// The first.
        first: FacePlace,
    },
    /// Faces whose corners are not in one plane were cut into triangles.
    NonPlanarFaces {
        /// How many.
        count: usize,
        /// The first.
        first: FacePlace,
    },
    /// Objects without faces were left out.
    EmptyObjects {
        /// How many.
        count: usize,
        /// Where the first is.
        place: Place,
        /// The first one's name.
        first: String,
    },
    /// Lines or points, which have no area, were left out.
    LinesAndPoints {
        /// How many.
        count: usize,
        /// Where the first is, or the file.
        place: Place,
    },
    /// Faces had no material and were given a grey one.
    NoMaterial {
        /// How many.
        count: usize,
        /// The first.
        first: FacePlace,
    },
    /// A reflectance of one or more was lowered to the largest that is used.
    ReflectanceClamped {
        /// How many materials.
        count: usize,
        /// Where the first is.
        place: Place,
        /// The first one's name.
        first: String,
        /// What it was lowered to.
        limit: f64,
    },
    /// Something that a file says about materials is not understood and has no effect.
    Ignored {
        /// How many.
        count: usize,
        /// Where the first is.
        place: Place,
        /// What it is, as the file calls it.
        what: String,
        /// Why, or what happens instead.
        why: &'static str,
    },
    /// Watts and lumens are mixed, so that lumens were divided by 683 lm/W.
    MixedUnits {
        /// How many lights and materials were converted.
        count: usize,
        /// The first one's name.
        first: String,
    },
    /// A section of the scene file applies to nothing.
    NoMatch {
        /// Where it is.
        place: Place,
        /// The section, such as `material`.
        section: &'static str,
        /// Its name.
        name: UnknownName,
    },
    /// The scene has no faces.
    NoFaces {
        /// The scene that was opened.
        place: Place,
    },
}

/// A face in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FacePlace {
    /// The file, and the line where the format has lines.
    pub place: Place,
    /// The object that it belongs to.
    pub object: String,
    /// Its number among the faces of that object in the file, counted from one.
    pub number: usize,
}

impl fmt::Display for FacePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "face {} of object `{}`", self.number, self.object)
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::DegenerateFaces { count, first } => write!(
                f,
                "{}: {count} face(s) without area dropped, the first is {first}",
                first.place
            ),
            Self::DuplicateFaces { count, first } => write!(
                f,
                "{}: {count} face(s) that are there before dropped, the first is {first}",
                first.place
            ),
            Self::ConcaveFaces { count, first } => write!(
                f,
                "{}: {count} face(s) that are not convex cut into triangles, the first is {first}",
                first.place
            ),
            Self::NonPlanarFaces { count, first } => write!(
                f,
                "{}: {count} face(s) that are not flat cut into triangles, the first is {first}",
                first.place
            ),
            Self::EmptyObjects {
                count,
                place,
                first,
            } => write!(
                f,
                "{place}: {count} object(s) without faces left out, the first is `{first}`"
            ),
            Self::LinesAndPoints { count, place } => {
                write!(
                    f,
                    "{place}: {count} line(s) or point(s) left out: they have no area"
                )
            }
            Self::NoMaterial { count, first } => write!(
                f,
                "{}: {count} face(s) without a material made grey (reflectance 0.5), the first is \
                 {first}; name one with `usemtl` or `[object.\"{}\"]`",
                first.place, first.object
            ),
            Self::ReflectanceClamped {
                count,
                place,
                first,
                limit,
            } => write!(
                f,
                "{place}: the reflectance of {count} material(s) was lowered to {limit}, the first \
                 is `{first}`: a surface that absorbs nothing has no solution in a closed room"
            ),
            Self::Ignored {
                count,
                place,
                what,
                why,
            } => {
                write!(f, "{place}: {what} has no effect ({count} time(s)): {why}")
            }
            Self::MixedUnits { count, first } => write!(
                f,
                "watts and lumens are mixed: {count} photometric value(s), the first of `{first}`, \
                 were divided by 683 lm/W and results are in watts; for lumens throughout set \
                 `units = \"photometric\"` in `[scene]` and give every light in lumens, candela, \
                 lux or nits"
            ),
            Self::NoMatch {
                place,
                section,
                name,
            } => {
                write!(f, "{place}: [{section}] applies to nothing: {name}")
            }
            Self::NoFaces { place } => write!(f, "{place}: the scene has no faces"),
        }
    }
}

/// Adds one to the warning about `what`, or makes it.
pub(crate) fn count_ignored(
    warnings: &mut Vec<Warning>,
    what: &str,
    place: &Place,
    why: &'static str,
) {
    for warning in warnings.iter_mut() {
        if let Warning::Ignored {
            count, what: known, ..
        } = warning
            && known == what
        {
            *count += 1;
            return;
        }
    }
    warnings.push(Warning::Ignored {
        count: 1,
        place: place.clone(),
        what: what.to_owned(),
        why,
    });
}
