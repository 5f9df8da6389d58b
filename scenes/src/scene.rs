//! The scene: structure-of-arrays geometry, materials, lights and cameras.

use crate::camera::Camera;
use crate::id::{FaceId, MaterialId, ObjectId};
use crate::light::Light;
use crate::material::{Material, Texture};
use glam::{DVec2, DVec3, Vec2, Vec3};
use rayon::prelude::*;

/// What the numbers of lights and emission are counted in; results come out in the same system.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum UnitSystem {
    /// W, W/sr, W/m², W/(m² sr).
    #[default]
    Radiometric,
    /// lm, cd, lx, cd/m².
    Photometric,
}

/// A planar convex polygon, counter-clockwise seen from its front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    /// Index of its first corner in [`Corners`].
    pub first_corner: u32,
    /// Number of corners, at least three.
    pub corner_count: u32,
    /// The object that it belongs to.
    pub object: ObjectId,
    /// Its material.
    pub material: MaterialId,
}

impl Face {
    /// Its corners' positions in the corner arrays.
    pub fn corners(self) -> std::ops::Range<usize> {
        let first = self.first_corner as usize;
        first..first + self.corner_count as usize
    }
}

/// A named group of faces.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Its name, unique in the scene.
    pub name: String,
    /// Factor on the texels a metre that it gets in lightmaps; zero where it gets none.
    pub lightmap_scale: f64,
}

/// What each corner of each face carries. Arrays of features that no face has are empty.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Corners {
    /// Index of the corner's vertex in [`Scene::vertices`].
    pub vertex: Vec<u32>,
    /// Shading normals (unit, or zero where a corner has none), or empty.
    pub normal: Vec<Vec3>,
    /// First UV set (textures), v upwards, or empty.
    pub uv0: Vec<Vec2>,
    /// Second UV set (lightmaps), v upwards, or empty.
    pub uv1: Vec<Vec2>,
}

impl Corners {
    /// Appends other corners; attributes that only one side has are zero on the other.
    pub(crate) fn append(&mut self, other: Self) {
        let (before, added) = (self.vertex.len(), other.vertex.len());
        append(&mut self.normal, &other.normal, before, added);
        append(&mut self.uv0, &other.uv0, before, added);
        append(&mut self.uv1, &other.uv1, before, added);
        self.vertex.extend(other.vertex);
    }
}

/// Appends an attribute that either side may not have; what is missing is zero.
fn append<T: Copy + Default>(to: &mut Vec<T>, from: &[T], before: usize, added: usize) {
    if to.is_empty() && from.is_empty() {
        return;
    }
    to.resize(before, T::default());
    to.extend_from_slice(from);
    to.resize(before + added, T::default());
}

/// A whole scene in world space, metres, right-handed.
///
/// Readers and generators return scenes that hold these invariants: indices in range, finite
/// coordinates, every face planar, convex and of non-zero area, reflectances in [0, 1), emission
/// finite and non-negative, unique object and camera names.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Scene {
    /// Name for reports: the file's stem, or the generator's.
    pub name: String,
    /// Units of light.
    pub units: UnitSystem,
    /// Vertex positions in metres.
    pub vertices: Vec<DVec3>,
    /// Corner attributes.
    pub corners: Corners,
    /// Faces.
    pub faces: Vec<Face>,
    /// Objects.
    pub objects: Vec<Object>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Textures.
    pub textures: Vec<Texture>,
    /// Lights that are not surfaces.
    pub lights: Vec<Light>,
    /// Cameras; the first is the default.
    pub cameras: Vec<Camera>,
}

impl Scene {
    /// Memory that its arrays hold, in bytes; names are too small to count.
    pub fn bytes(&self) -> usize {
        fn held<T>(values: &Vec<T>) -> usize {
            values.capacity() * size_of::<T>()
        }
        let corners = &self.corners;
        let textures = self.textures.iter().map(|texture| held(&texture.texels));
        held(&self.vertices)
            + held(&corners.vertex)
            + held(&corners.normal)
            + held(&corners.uv0)
            + held(&corners.uv1)
            + held(&self.faces)
            + held(&self.objects)
            + held(&self.materials)
            + held(&self.lights)
            + textures.sum::<usize>()
    }

    /// The vertices of a face in metres, counter-clockwise from the front.
    pub fn polygon(&self, face: FaceId) -> impl ExactSizeIterator<Item = DVec3> + Clone + '_ {
        self.faces[face.index()]
            .corners()
            .map(|corner| self.vertices[self.corners.vertex[corner] as usize])
    }

    /// Newell's vector area of a face in m²: its direction is the front normal, its length the area.
    ///
    /// Source: I. E. Sutherland, R. F. Sproull, R. A. Schumacker, "A characterization of ten
    /// hidden-surface algorithms", ACM Computing Surveys 6(1), 1974 (Newell's method).
    pub fn vector_area(&self, face: FaceId) -> DVec3 {
        let polygon = self.polygon(face);
        let origin = polygon.clone().next().unwrap_or_default();
        let next = polygon.clone().skip(1);
        polygon
            .skip(1)
            .zip(next.skip(1))
            .map(|(a, b)| (a - origin).cross(b - origin) * 0.5)
            .sum()
    }

    /// Area of a face in m².
    pub fn area(&self, face: FaceId) -> f64 {
        self.vector_area(face).length()
    }

    /// The material of a face.
    pub fn material(&self, face: FaceId) -> &Material {
        &self.materials[self.faces[face.index()].material.index()]
    }

    /// First UV of a corner, or the origin where there is none.
    pub fn uv0(&self, corner: usize) -> DVec2 {
        self.corners
            .uv0
            .get(corner)
            .map_or(DVec2::ZERO, |uv| uv.as_dvec2())
    }

    /// All face ids in order.
    pub fn face_ids(&self) -> impl ExactSizeIterator<Item = FaceId> + Clone + use<> {
        (0..self.faces.len()).map(FaceId::new)
    }

    /// Lower and upper corner of the box around all vertices that faces use, in metres; `None`
    /// without faces.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        /// Corners that are joined at a time: the same at any number of threads, because of two zeros of
        /// different sign the first is the minimum.
        const CHUNK: usize = 1 << 16;
        type Bounds = (DVec3, DVec3);
        let join = |a: Bounds, b: Bounds| (a.0.min(b.0), a.1.max(b.1));
        let of_chunk = |corners: &[u32]| -> Option<Bounds> {
            let points = corners.iter().map(|&v| self.vertices[v as usize]);
            points.map(|p| (p, p)).reduce(join)
        };
        let chunks: Vec<Option<Bounds>> = self
            .corners
            .vertex
            .par_chunks(CHUNK)
            .map(of_chunk)
            .collect();
        chunks.into_iter().flatten().reduce(join)
    }

    /// Adds a face with the given vertex positions (metres, counter-clockwise), without normals
    /// or UVs. Meant for generators: the caller keeps the invariants.
    pub fn push_face(
        &mut self,
        polygon: &[DVec3],
        object: ObjectId,
        material: MaterialId,
    ) -> FaceId {
        let id = FaceId::new(self.faces.len());
        self.faces.push(Face {
            first_corner: self.corners.vertex.len() as u32,
            corner_count: polygon.len() as u32,
            object,
            material,
        });
        for &position in polygon {
            self.corners.vertex.push(self.vertices.len() as u32);
            self.vertices.push(position);
        }
        id
    }

    /// Adds an object and returns its id.
    pub fn push_object(&mut self, name: impl Into<String>) -> ObjectId {
        self.objects.push(Object {
            name: name.into(),
            lightmap_scale: 1.0,
        });
        ObjectId::new(self.objects.len() - 1)
    }

    /// Adds a material and returns its id.
    pub fn push_material(&mut self, material: Material) -> MaterialId {
        self.materials.push(material);
        MaterialId::new(self.materials.len() - 1)
    }
}
