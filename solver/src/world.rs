//! A scene made ready for light: surfaces, ray tree and lights.

use crate::bvh::{Bvh, Hit, Ray};
use crate::direct::Lights;
use crate::geometry::{Geometry, ray_origin, triangle_count};
use crate::patches::{Density, MeshError, PatchId, PatchSize, Patches, Side};
use crate::surface::{SurfacePoint, Surfaces};
use glam::{DVec3, Vec3};
use luxel_scenes::{FaceId, Scene};
use std::sync::Arc;

/// Everything that rays and lights need to know of a scene.
pub struct World<'s> {
    surfaces: Arc<Surfaces<'s>>,
    bvh: Arc<Bvh>,
    lights: Lights,
}

/// A point at which light is received.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// Position in the unit frame.
    pub position: DVec3,
    /// Unit normal of the receiving side.
    pub normal: DVec3,
    /// Origin for rays that leave it, off the surface that it lies on.
    pub origin: Vec3,
}

/// A hit with all that shading wants to know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interaction {
    /// The point in its triangle's own coordinates.
    pub point: SurfacePoint,
    /// The face.
    pub face: FaceId,
    /// The side that the ray arrived at.
    pub side: Side,
    /// The point as a receiver of light on that side.
    pub receiver: Receiver,
}

/// How far from a surface, in units, a receiver may be given and still be meant to lie on it: half
/// a unit of the seventh digit, which is what files of points carry, with a margin of four.
const SNAP: f64 = 2e-6;

impl<'s> World<'s> {
    /// Prepares a scene. Deterministic; about 1 µs a triangle.
    pub fn new(scene: &'s Scene) -> Self {
        let surfaces = Surfaces::new(scene);
        let bvh = Bvh::build(surfaces.geometry());
        let lights = Lights::new(&surfaces);
        Self {
            surfaces: Arc::new(surfaces),
            bvh: Arc::new(bvh),
            lights,
        }
    }

    /// The same surfaces in the light of `lights`, which are some of its own: for direct light from them alone.
    #[must_use]
    pub fn lit_by(&self, lights: Lights) -> Self {
        Self {
            surfaces: Arc::clone(&self.surfaces),
            bvh: Arc::clone(&self.bvh),
            lights,
        }
    }

    /// Memory that a scene takes while it is prepared, in bytes: of the scene itself, of what is made of it, and of what
    /// the ray tree is built from.
    pub fn bytes_to_build(scene: &Scene) -> usize {
        scene.bytes() + Geometry::bytes_for(scene) + Bvh::bytes_to_build(triangle_count(scene))
    }

    /// Memory that the scene and what was made of it hold, in bytes.
    pub fn bytes(&self) -> usize {
        self.scene().bytes() + self.surfaces.geometry().bytes() + self.bvh.bytes()
    }

    /// The scene.
    pub fn scene(&self) -> &'s Scene {
        self.surfaces.scene()
    }

    /// Faces and materials.
    pub fn surfaces(&self) -> &Surfaces<'s> {
        &self.surfaces
    }

    /// The ray tree.
    pub fn bvh(&self) -> &Bvh {
        &self.bvh
    }

    /// The sources of direct light.
    pub fn lights(&self) -> &Lights {
        &self.lights
    }

    /// Meshes the scene.
    ///
    /// # Errors
    /// As [`Patches::mesh`].
    pub fn mesh(&self, size: PatchSize) -> Result<Patches, MeshError> {
        Patches::mesh(&self.surfaces, &self.bvh, size)
    }

    /// Meshes the scene into about `count` patches, as finely in each place as `density` says.
    ///
    /// # Errors
    /// As [`Patches::mesh_with_density`].
    pub fn mesh_with_density(&self, count: usize, density: &Density) -> Result<Patches, MeshError> {
        Patches::mesh_with_density(&self.surfaces, &self.bvh, count, density)
    }

    /// A mesh with the marked patches divided.
    ///
    /// # Panics
    /// As [`Patches::refined`].
    pub fn refine(&self, patches: &Patches, marked: &[bool]) -> Patches {
        patches.refined(&self.surfaces, &self.bvh, marked)
    }

    /// What a ray met; `None` for a miss.
    #[inline]
    pub fn interaction(&self, ray: &Ray, hit: &Hit) -> Option<Interaction> {
        let triangle = hit.triangle()?;
        let geometry = self.surfaces.geometry();
        let point = SurfacePoint {
            triangle,
            u: f64::from(hit.u),
            v: f64::from(hit.v),
        };
        let face = geometry.face(triangle);
        let front = geometry.normal(face);
        let side = Side::facing(ray.direction.as_dvec3(), front);
        let normal = if side == Side::Front { front } else { -front };
        let position = geometry.interpolate(triangle, point.u, point.v);
        let origin = ray_origin(position, normal, geometry.extent(face));
        Some(Interaction {
            point,
            face,
            side,
            receiver: Receiver {
                position,
                normal,
                origin,
            },
        })
    }

    /// The patch that a ray met; `None` for a miss and on the back of a one-sided face.
    pub fn patch_hit(&self, patches: &Patches, ray: &Ray, hit: &Hit) -> Option<PatchId> {
        let triangle = hit.triangle()?;
        let geometry = self.surfaces.geometry();
        let normal = geometry.normal(geometry.face(triangle));
        let side = Side::facing(ray.direction.as_dvec3(), normal);
        let position = || geometry.interpolate(triangle, f64::from(hit.u), f64::from(hit.v));
        patches.seen_from(ray.origin.as_dvec3(), triangle, position, side)
    }

    /// Whether a ray met the back of a one-sided face: it set out from inside a solid, or the scene is open there.
    pub fn meets_back(&self, ray: &Ray, hit: &Hit) -> bool {
        hit.triangle().is_some_and(|triangle| {
            let geometry = self.surfaces.geometry();
            let face = geometry.face(triangle);
            let side = Side::facing(ray.direction.as_dvec3(), geometry.normal(face));
            !self.surfaces.has_side(face, side)
        })
    }

    /// Receivers from world positions (metres) and normals. A position within rounding of a face
    /// that looks along the normal is taken to lie on it; others float freely.
    ///
    /// # Panics
    /// When the slices differ in length.
    pub fn receivers(&self, positions: &[DVec3], normals: &[DVec3]) -> Vec<Receiver> {
        assert_eq!(
            positions.len(),
            normals.len(),
            "one normal for each position"
        );
        let geometry = self.surfaces.geometry();
        let points: Vec<(DVec3, DVec3)> = positions
            .iter()
            .zip(normals)
            .map(|(&p, n)| (geometry.frame().to_unit(p), n.normalize()))
            .collect();
        // Decimal digits are relative to world coordinates, which may be offset from the scene.
        let snap = |p: &DVec3| {
            let world = geometry.frame().to_world(*p).abs().max_element();
            SNAP * (world / geometry.frame().metres_per_unit).max(1.0)
        };
        let rays: Vec<Ray> = points
            .iter()
            .map(|(p, n)| Ray {
                origin: (*p + *n * snap(p)).as_vec3(),
                tmin: 0.0,
                direction: -n.as_vec3(),
                tmax: 2.0 * snap(p) as f32,
            })
            .collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        self.bvh.closest_hits(&rays, &mut hits);
        points
            .iter()
            .zip(rays.iter().zip(&hits))
            .map(|(&(position, normal), (ray, hit))| {
                let surface = self.interaction(ray, hit).map(|surface| surface.receiver);
                match surface.filter(|surface| surface.normal.dot(normal) > 0.5) {
                    Some(surface) => {
                        // Only the height above the face is corrected; the normal stays the
                        // user's, which may be a shading normal.
                        let height = (position - surface.position).dot(surface.normal);
                        let position = position - surface.normal * height;
                        let extent = hit
                            .triangle()
                            .map_or(0.0, |triangle| geometry.extent(geometry.face(triangle)));
                        let origin = ray_origin(position, surface.normal, extent);
                        Receiver {
                            position,
                            normal,
                            origin,
                        }
                    }
                    None => Receiver {
                        position,
                        normal,
                        origin: position.as_vec3(),
                    },
                }
            })
            .collect()
    }
}
