//! The sources of direct light, in the unit frame.

use crate::form_factors::point_to_polygon;
use crate::geometry::Geometry;
use crate::patches::Side;
use crate::surface::Surfaces;
use glam::DVec3;
use luxel_scenes::{FaceId, LightKind, Radiance, Rgb, Scene, Sidedness};

use super::importance::Importance;
use super::kernel::Luminaire;
use super::merge::merge;
use super::sky::SkyDome;

/// Most polygons that shadow rays are cast to; the brightest by flux are chosen, the light of the others is found
/// by the rays that meet them. A point's exact irradiance from all of them costs about 20 ns a polygon, a rough
/// weight of each 3 ns: with ten thousand lamps a tenth of what rays that must meet them cost at the same error.
const MAX_POLYGONS: usize = 1 << 14;

/// A source of direct light.
#[derive(Clone, Debug)]
pub enum Source {
    /// An emissive planar convex polygon, counter-clockwise seen from where it shines.
    Polygon {
        /// Its shape in the unit frame.
        shape: Luminaire,
        /// Unit normal of the side that shines.
        normal: DVec3,
        /// Longest side of the box around it, in units.
        extent: f64,
        /// Radiance L in W/(m² sr).
        radiance: Radiance,
    },
    /// A point source.
    Point {
        /// Position in the unit frame.
        position: DVec3,
        /// Intensity in W/sr, divided by the square of the metres in a unit: the irradiance in
        /// W/m² at a distance of one unit.
        intensity: Rgb,
        /// How the intensity depends on the direction.
        distribution: Distribution,
    },
    /// Parallel light.
    Directional {
        /// Unit vector towards the light.
        towards: DVec3,
        /// Irradiance in W/m² on a surface facing the light.
        irradiance: Rgb,
    },
}

/// How the intensity of a point source depends on the direction in which it shines.
#[derive(Clone, Copy, Debug)]
pub enum Distribution {
    /// Not at all.
    Isotropic,
    /// By the cosine from the axis: Lambert's law.
    Lambertian {
        /// Unit vector.
        axis: DVec3,
    },
    /// As `KHR_lights_punctual` has it: the square of a linear function of the cosine from the axis,
    /// clamped to [0, 1].
    Spot {
        /// Unit vector.
        axis: DVec3,
        /// Factor on the cosine.
        scale: f64,
        /// What is added to it.
        offset: f64,
    },
}

impl Distribution {
    /// Intensity in a unit direction over that of the axis.
    pub(crate) fn relative(&self, direction: DVec3) -> f64 {
        match *self {
            Self::Isotropic => 1.0,
            Self::Lambertian { axis } => direction.dot(axis).max(0.0),
            Self::Spot {
                axis,
                scale,
                offset,
            } => (direction.dot(axis) * scale + offset)
                .clamp(0.0, 1.0)
                .powi(2),
        }
    }
}

impl Source {
    /// Irradiance in W/m² at a point of the unit frame with the given unit normal, as if nothing
    /// were in between. Exact.
    pub fn irradiance(&self, position: DVec3, normal: DVec3) -> Rgb {
        match self {
            Self::Polygon {
                shape, radiance, ..
            } => radiance.to_irradiance().0 * point_to_polygon(position, normal, shape.corners()),
            Self::Point {
                position: source,
                intensity,
                distribution,
            } => {
                let to = *source - position;
                let distance_squared = to.length_squared();
                let cosine = to.dot(normal) / distance_squared.sqrt();
                if cosine.is_nan() || cosine <= 0.0 {
                    return Rgb::ZERO;
                }
                let falloff = distribution.relative(-to / distance_squared.sqrt());
                *intensity * (falloff * cosine / distance_squared)
            }
            Self::Directional {
                towards,
                irradiance,
            } => *irradiance * towards.dot(normal).max(0.0),
        }
    }
}

/// Every source of a scene.
pub struct Lights {
    /// The polygons first.
    sources: Vec<Source>,
    importance: Importance,
    /// The source that the front of each face belongs to, if any.
    front_source: Vec<Option<u32>>,
    sky: Option<SkyDome>,
    has_unlisted_emission: bool,
}

impl Lights {
    /// Collects the lights of a scene.
    pub fn new(surfaces: &Surfaces) -> Self {
        let scene = surfaces.scene();
        let geometry = surfaces.geometry();
        let emissive: Vec<FaceId> = scene
            .face_ids()
            .filter(|&face| {
                let material = surfaces.material(face);
                material.is_emissive() && material.emission_texture.is_none()
            })
            .collect();
        let mut polygons = polygons(surfaces, geometry, &emissive);
        if polygons.len() > MAX_POLYGONS {
            // Stable: equal fluxes keep the order of the file.
            polygons.sort_by(|a, b| b.flux.total_cmp(&a.flux));
            polygons.truncate(MAX_POLYGONS);
        }
        let mut front_source = vec![None; scene.faces.len()];
        let mut sources = Vec::new();
        for polygon in polygons {
            let EmissivePolygon {
                corners,
                radiance,
                normal,
                extent,
                two_sided,
                faces,
                ..
            } = polygon;
            // The back of a two-sided polygon comes just before its front.
            let front = sources.len() as u32 + u32::from(two_sided);
            for face in faces {
                front_source[face.index()] = Some(front);
            }
            if two_sided {
                let reversed = corners.iter().rev().copied().collect();
                sources.push(Source::Polygon {
                    shape: Luminaire::new(reversed),
                    normal: -normal,
                    extent,
                    radiance,
                });
            }
            sources.push(Source::Polygon {
                shape: Luminaire::new(corners),
                normal,
                extent,
                radiance,
            });
        }
        sources.extend(lamps(scene, geometry));
        let sky = SkyDome::new(scene);
        let has_unlisted_emission = scene.face_ids().any(|face| {
            surfaces.material(face).is_emissive() && front_source[face.index()].is_none()
        });
        Self {
            importance: Importance::new(&sources),
            sources,
            front_source,
            sky,
            has_unlisted_emission,
        }
    }

    /// Some of the sources, by their places, and nothing else: for direct light from them alone. Rays that meet surfaces must not
    /// count what these emit, which nobody here knows to be a source.
    ///
    /// # Panics
    /// When there is no such source.
    #[must_use]
    pub fn only(&self, sources: &[usize]) -> Self {
        let sources: Vec<Source> = sources.iter().map(|&i| self.sources[i].clone()).collect();
        Self {
            importance: Importance::new(&sources),
            sources,
            front_source: vec![None; self.front_source.len()],
            sky: None,
            has_unlisted_emission: false,
        }
    }

    /// The sky of a scene and nothing else, in the same sense.
    #[must_use]
    pub fn sky_of(scene: &Scene) -> Self {
        Self {
            importance: Importance::default(),
            sources: Vec::new(),
            front_source: vec![None; scene.faces.len()],
            sky: SkyDome::new(scene),
            has_unlisted_emission: false,
        }
    }

    /// The sources that shadow rays are cast to.
    pub fn sources(&self) -> &[Source] {
        &self.sources
    }

    /// Writes roughly how much each of [`Self::sources`] lights a point of the unit frame with the given unit
    /// normal; zero only where a source does not.
    pub(crate) fn weigh(&self, position: DVec3, normal: DVec3, weights: &mut Vec<f64>) {
        self.importance
            .weigh(&self.sources, position, normal, weights);
    }

    /// Whether the emission of a face is a source here: rays that meet it must not count it again.
    pub fn is_source(&self, face: FaceId) -> bool {
        self.front_source[face.index()].is_some()
    }

    /// The index in [`Self::sources`] of what a side of a face emits. Only for sides that emit.
    pub fn source_of(&self, face: FaceId, side: Side) -> Option<usize> {
        let front = self.front_source[face.index()]? as usize;
        Some(if side == Side::Front {
            front
        } else {
            front - 1
        })
    }

    /// Radiance from outside the scene, from the direction that a ray travels to; zero without sky.
    pub fn sky(&self, surfaces: &Surfaces, direction: DVec3) -> Radiance {
        self.sky.as_ref().map_or(Radiance::ZERO, |sky| {
            sky.radiance(surfaces.scene(), direction)
        })
    }

    /// True when some direct light does not come from [`Self::sources`]: a sky, textured emission,
    /// emissive faces beyond the brightest. Rays from the receiver find it.
    pub fn are_found_by_rays(&self) -> bool {
        self.has_sky() || self.has_unlisted_emission
    }

    /// Whether light comes from outside the scene.
    pub fn has_sky(&self) -> bool {
        self.sky.is_some()
    }

    /// Whether there is emission that is not one of [`Self::sources`].
    pub fn has_unlisted_emission(&self) -> bool {
        self.has_unlisted_emission
    }
}

struct EmissivePolygon {
    corners: Vec<DVec3>,
    normal: DVec3,
    extent: f64,
    radiance: Radiance,
    flux: f64,
    two_sided: bool,
    faces: Vec<FaceId>,
}

/// The lights that are no surfaces and have a place or a direction.
fn lamps<'s>(scene: &'s Scene, geometry: &'s Geometry) -> impl Iterator<Item = Source> + 's {
    let frame = geometry.frame();
    let per_square_unit = 1.0 / (frame.metres_per_unit * frame.metres_per_unit);
    scene
        .lights
        .iter()
        .filter_map(move |light| match &light.kind {
            LightKind::Point {
                position,
                intensity,
            } => Some(Source::Point {
                position: frame.to_unit(*position),
                intensity: intensity.0 * per_square_unit,
                distribution: Distribution::Isotropic,
            }),
            LightKind::Lambertian {
                position,
                direction,
                intensity,
            } => Some(Source::Point {
                position: frame.to_unit(*position),
                intensity: intensity.0 * per_square_unit,
                distribution: Distribution::Lambertian { axis: *direction },
            }),
            LightKind::Spot {
                position,
                direction,
                intensity,
                inner_angle,
                outer_angle,
            } => {
                let scale = 1.0 / (inner_angle.cos() - outer_angle.cos()).max(1e-3);
                Some(Source::Point {
                    position: frame.to_unit(*position),
                    intensity: intensity.0 * per_square_unit,
                    distribution: Distribution::Spot {
                        axis: *direction,
                        scale,
                        offset: -outer_angle.cos() * scale,
                    },
                })
            }
            LightKind::Directional {
                direction,
                irradiance,
            } => Some(Source::Directional {
                towards: -*direction,
                irradiance: irradiance.0,
            }),
            LightKind::Sky { .. } | LightKind::Environment { .. } => None,
        })
}

/// The emissive faces, merged to as few convex polygons as possible, in the order of the file.
fn polygons(surfaces: &Surfaces, geometry: &Geometry, emissive: &[FaceId]) -> Vec<EmissivePolygon> {
    let single = emissive
        .iter()
        .map(|&face| (geometry.polygon(face), vec![face]))
        .collect::<Vec<_>>();
    let merged = merge(
        single,
        // A light of one object, so that lights can be told apart by theirs.
        |a, b| {
            let object = |face: FaceId| surfaces.scene().faces[face.index()].object;
            surfaces.material_id(a[0]) == surfaces.material_id(b[0]) && object(a[0]) == object(b[0])
        },
        Extend::extend,
    );
    merged
        .into_iter()
        .map(|(corners, faces)| {
            let material = surfaces.material(faces[0]);
            let area: f64 = faces.iter().map(|&face| surfaces.area(face)).sum();
            let (lower, upper) = corners.iter().fold(
                (DVec3::INFINITY, DVec3::NEG_INFINITY),
                |(lower, upper), corner| (lower.min(*corner), upper.max(*corner)),
            );
            EmissivePolygon {
                normal: geometry.normal(faces[0]),
                extent: (upper - lower).max_element(),
                radiance: material.emission,
                flux: area * material.emission.0.element_sum(),
                two_sided: material.sidedness == Sidedness::Both,
                corners,
                faces,
            }
        })
        .collect()
}
