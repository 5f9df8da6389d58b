//! What a point of a face reflects and emits.

use crate::geometry::{Geometry, TriangleId};
use crate::patches::Side;
use glam::{DVec2, DVec3};
use luxel_scenes::{
    FaceId, Material, MaterialId, Radiance, Reflectance, Rgb, Scene, Sidedness, TextureId,
};

/// Largest reflectance that a textured surface is given: a texture of pure white would otherwise
/// make ρ = 1, for which the radiosity system has no solution.
const MAX_REFLECTANCE: f64 = 0.999;

/// A point of a triangle, by the weights of its second and third corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The triangle.
    pub triangle: TriangleId,
    /// Weight of the second corner.
    pub u: f64,
    /// Weight of the third corner.
    pub v: f64,
}

/// The faces of a scene with their triangles and materials.
pub struct Surfaces<'s> {
    scene: &'s Scene,
    geometry: Geometry,
}

impl<'s> Surfaces<'s> {
    /// Cuts the faces of a scene into triangles.
    pub fn new(scene: &'s Scene) -> Self {
        Self {
            scene,
            geometry: Geometry::new(scene),
        }
    }

    /// The scene.
    pub fn scene(&self) -> &'s Scene {
        self.scene
    }

    /// The triangles.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Area of a face in square units.
    pub fn area(&self, face: FaceId) -> f64 {
        self.geometry
            .triangles_of(face)
            .map(|triangle| {
                let [a, b, c] = self.geometry.triangle(triangle);
                0.5 * (b - a).cross(c - a).length()
            })
            .sum()
    }

    /// The material of a face.
    pub fn material(&self, face: FaceId) -> &'s Material {
        &self.scene.materials[self.material_id(face).index()]
    }

    /// The material of a face.
    pub fn material_id(&self, face: FaceId) -> MaterialId {
        self.scene.faces[face.index()].material
    }

    /// True where light is emitted and reflected on that side of the face.
    pub fn has_side(&self, face: FaceId, side: Side) -> bool {
        side == Side::Front || self.material(face).sidedness == Sidedness::Both
    }

    /// Diffuse reflectance at a point.
    pub fn reflectance(&self, point: SurfacePoint) -> Reflectance {
        let material = self.material(self.geometry.face(point.triangle));
        match material.reflectance_texture {
            None => material.reflectance,
            Some(texture) => {
                let value = material.reflectance.0 * self.texture(texture, point);
                Reflectance(value.clamp(Rgb::ZERO, Rgb::splat(MAX_REFLECTANCE)))
            }
        }
    }

    /// Radiance that the surface itself emits at a point, on the sides that it has.
    pub fn emission(&self, point: SurfacePoint) -> Radiance {
        let material = self.material(self.geometry.face(point.triangle));
        match material.emission_texture {
            None => material.emission,
            Some(texture) => Radiance(material.emission.0 * self.texture(texture, point)),
        }
    }

    /// Interpolated shading normal at a point, or the face normal where the file gave none; on the
    /// front side.
    pub fn shading_normal(&self, point: SurfacePoint) -> DVec3 {
        let face = self.geometry.normal(self.geometry.face(point.triangle));
        let normals = &self.scene.corners.normal;
        if normals.is_empty() {
            return face;
        }
        let [a, b, c] = self
            .corners(point.triangle)
            .map(|corner| normals[corner].as_dvec3());
        let normal = a * (1.0 - point.u - point.v) + b * point.u + c * point.v;
        let normal = normal.normalize_or_zero();
        if normal.dot(face) > 0.0 { normal } else { face }
    }

    /// First texture coordinates at a point.
    pub fn uv(&self, point: SurfacePoint) -> DVec2 {
        let [a, b, c] = self
            .corners(point.triangle)
            .map(|corner| self.scene.uv0(corner));
        a * (1.0 - point.u - point.v) + b * point.u + c * point.v
    }

    /// The point of one of `faces` nearest to `position`, which lies on one of them up to rounding.
    pub(crate) fn locate(&self, faces: &[FaceId], position: DVec3) -> SurfacePoint {
        let mut best = (
            f64::NEG_INFINITY,
            SurfacePoint {
                triangle: TriangleId(0),
                u: 0.0,
                v: 0.0,
            },
        );
        for triangle in faces
            .iter()
            .flat_map(|&face| self.geometry.triangles_of(face))
        {
            let [a, b, c] = self.geometry.triangle(triangle);
            let normal = (b - a).cross(c - a);
            let scale = 1.0 / normal.length_squared();
            let u = (position - a).cross(c - a).dot(normal) * scale;
            let v = (b - a).cross(position - a).dot(normal) * scale;
            let inside = u.min(v).min(1.0 - u - v);
            if inside > best.0 {
                best = (inside, SurfacePoint { triangle, u, v });
            }
        }
        best.1
    }

    /// Indices of a triangle's corners in [`luxel_scenes::Corners`].
    fn corners(&self, triangle: TriangleId) -> [usize; 3] {
        let first = self.scene.faces[self.geometry.face(triangle).index()].first_corner as usize;
        let fan = self.geometry.fan_index(triangle);
        [first, first + fan + 1, first + fan + 2]
    }

    fn texture(&self, id: TextureId, point: SurfacePoint) -> Rgb {
        self.scene.textures[id.index()].sample(self.uv(point))
    }
}
