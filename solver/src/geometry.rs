//! The scene as rays see it: triangles in a frame of unit size.
//!
//! Positions are re-centred and scaled so that the longest side of the scene lies in (1/2, 1].
//! The scale is a power of two, hence exact: a scene and its copy in other units give the same
//! bits, and every bound on rounding can be stated once, for coordinates of at most 1/2.

use crate::memory::held;
use glam::{DVec3, Vec3};
use luxel_scenes::{FaceId, Scene};

/// The similarity between world space (metres) and the unit frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitFrame {
    /// World position of the frame's origin, in metres.
    pub centre: DVec3,
    /// Length of one unit in metres, a power of two.
    pub metres_per_unit: f64,
}

impl UnitFrame {
    /// The frame of a box given by its corners in metres.
    pub fn of_bounds(lower: DVec3, upper: DVec3) -> Self {
        let side = (upper - lower).max_element();
        let metres_per_unit = if side > 0.0 && side.is_finite() {
            side.log2().ceil().exp2()
        } else {
            1.0
        };
        Self {
            centre: (lower + upper) * 0.5,
            metres_per_unit,
        }
    }

    /// A world position in the unit frame.
    pub fn to_unit(&self, world: DVec3) -> DVec3 {
        (world - self.centre) / self.metres_per_unit
    }

    /// A position of the unit frame in metres.
    pub fn to_world(&self, unit: DVec3) -> DVec3 {
        unit * self.metres_per_unit + self.centre
    }

    /// An area of the unit frame in m².
    pub fn area_to_world(&self, unit: f64) -> f64 {
        unit * self.metres_per_unit * self.metres_per_unit
    }
}

/// Index of a triangle in [`Geometry`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TriangleId(pub u32);

impl TriangleId {
    /// The position in the arrays of [`Geometry`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// Triangles of a scene's faces in the unit frame, each polygon cut into a fan.
#[derive(Clone, Debug)]
pub struct Geometry {
    frame: UnitFrame,
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    triangle_face: Vec<FaceId>,
    face_first_triangle: Vec<u32>,
    face_normal: Vec<DVec3>,
    face_extent: Vec<f64>,
}

impl Geometry {
    /// Cuts the faces of `scene` into triangles. A scene without faces gives an empty geometry.
    ///
    /// # Panics
    /// When the scene has 2³² triangles or more.
    pub fn new(scene: &Scene) -> Self {
        let (lower, upper) = scene.bounds().unwrap_or_default();
        let frame = UnitFrame::of_bounds(lower, upper);
        let mut triangles = Vec::with_capacity(scene.faces.len());
        let mut triangle_face = Vec::with_capacity(scene.faces.len());
        let mut face_first_triangle = Vec::with_capacity(scene.faces.len() + 1);
        let mut face_normal = Vec::with_capacity(scene.faces.len());
        let mut face_extent = Vec::with_capacity(scene.faces.len());
        for (index, face) in scene.faces.iter().enumerate() {
            let id = FaceId::new(index);
            face_first_triangle.push(triangles.len() as u32);
            face_normal.push(scene.vector_area(id).normalize_or_zero());
            let (lower, upper) = scene.polygon(id).fold(
                (DVec3::INFINITY, DVec3::NEG_INFINITY),
                |(lower, upper), corner| (lower.min(corner), upper.max(corner)),
            );
            face_extent.push((upper - lower).max_element() / frame.metres_per_unit);
            let ring = &scene.corners.vertex[face.corners()];
            for pair in ring[1..].windows(2) {
                triangles.push([ring[0], pair[0], pair[1]]);
                triangle_face.push(id);
            }
        }
        assert!(
            u32::try_from(triangles.len()).is_ok(),
            "more than 2^32 triangles"
        );
        face_first_triangle.push(triangles.len() as u32);
        Self {
            frame,
            vertices: scene.vertices.iter().map(|&v| frame.to_unit(v)).collect(),
            triangles,
            triangle_face,
            face_first_triangle,
            face_normal,
            face_extent,
        }
    }

    /// Memory that the geometry of a scene takes, in bytes.
    pub fn bytes_for(scene: &Scene) -> usize {
        scene.vertices.len() * size_of::<DVec3>()
            + triangle_count(scene) * size_of::<([u32; 3], FaceId)>()
            + scene.faces.len() * size_of::<(u32, DVec3, f64)>()
    }

    /// Memory that it holds, in bytes.
    pub fn bytes(&self) -> usize {
        held(&self.vertices)
            + held(&self.triangles)
            + held(&self.triangle_face)
            + held(&self.face_first_triangle)
            + held(&self.face_normal)
            + held(&self.face_extent)
    }

    /// The similarity to world space.
    pub fn frame(&self) -> &UnitFrame {
        &self.frame
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// True when the scene has no faces.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Number of faces.
    pub fn face_count(&self) -> usize {
        self.face_normal.len()
    }

    /// The corners of a triangle in the unit frame, counter-clockwise from the front.
    pub fn triangle(&self, id: TriangleId) -> [DVec3; 3] {
        self.triangles[id.index()].map(|v| self.vertices[v as usize])
    }

    /// The face that a triangle was cut from.
    pub fn face(&self, id: TriangleId) -> FaceId {
        self.triangle_face[id.index()]
    }

    /// The triangles of a face, in fan order: the k-th spans corners 0, k+1, k+2.
    pub fn triangles_of(
        &self,
        face: FaceId,
    ) -> impl ExactSizeIterator<Item = TriangleId> + Clone + use<> {
        let first = self.face_first_triangle[face.index()];
        (first..self.face_first_triangle[face.index() + 1]).map(TriangleId)
    }

    /// Position of a triangle in the fan of its face.
    pub fn fan_index(&self, id: TriangleId) -> usize {
        (id.0 - self.face_first_triangle[self.face(id).index()]) as usize
    }

    /// Unit normal of a face's front.
    pub fn normal(&self, face: FaceId) -> DVec3 {
        self.face_normal[face.index()]
    }

    /// Longest side of the box around a face, in units.
    pub fn extent(&self, face: FaceId) -> f64 {
        self.face_extent[face.index()]
    }

    /// The corners of a face in the unit frame, counter-clockwise from the front.
    pub fn polygon(&self, face: FaceId) -> Vec<DVec3> {
        let mut polygon = Vec::new();
        for (k, triangle) in self.triangles_of(face).enumerate() {
            let [a, b, c] = self.triangle(triangle);
            if k == 0 {
                polygon.extend([a, b]);
            }
            polygon.push(c);
        }
        polygon
    }

    /// The point of a triangle with weights (1 − u − v, u, v).
    pub fn interpolate(&self, id: TriangleId, u: f64, v: f64) -> DVec3 {
        let [a, b, c] = self.triangle(id);
        a + (b - a) * u + (c - a) * v
    }
}

/// Triangles that the faces of a scene are cut into.
pub fn triangle_count(scene: &Scene) -> usize {
    let corners: usize = scene.faces.iter().map(|f| f.corner_count as usize).sum();
    corners - 2 * scene.faces.len()
}

/// Unit roundoff of f32, u = 2⁻²⁴.
const ROUNDOFF: f64 = 1.0 / 16_777_216.0;

/// Least step off a surface: decides for planes through the frame's middle, where f32 is exact.
const LEAST_STEP: f64 = 1e-12;

/// A bound on the step that [`ray_origin`] takes from a face of extent s, in any direction.
pub fn offset_bound(position: DVec3, extent: f64) -> f64 {
    ROUNDOFF * (7.0 * position.abs().max_element() + 6.0 * extent)
}

/// A bound on the distance, along the unit normal n, between `position` rounded to f32 and the plane
/// that rays see, whose corners are rounded too: 2u Σ |nᵢ| vᵢ, where no corner's coordinate i is
/// larger than vᵢ = |pᵢ| + √3 s √(1 − nᵢ²) on a face of extent s. Rays compute distances to that
/// plane in f64, which adds nothing. Zero across an axis-aligned plane through the middle, at most
/// 5e-7 in the unit frame.
fn plane_rounding(position: DVec3, normal: DVec3, extent: f64) -> f64 {
    let tilt = (DVec3::ONE - normal * normal)
        .max(DVec3::ZERO)
        .map(f64::sqrt);
    let reach = position.abs() + tilt * (3f64.sqrt() * extent);
    2.0 * ROUNDOFF * normal.abs().dot(reach)
}

/// The f32 origin of rays that leave `position` (on a face of the given `extent`) to the side of
/// `normal`: moved off by twice the bound on rounding, so that the face itself cannot be hit again.
pub fn ray_origin(position: DVec3, normal: DVec3, extent: f64) -> Vec3 {
    let step = 2.0 * plane_rounding(position, normal, extent) + LEAST_STEP;
    (position + normal * step).as_vec3()
}

/// The f32 end of a segment from `origin` to `position` on a face of the given `extent`: moved off
/// the face as an origin is, and by the rounding of the segment's direction besides.
pub fn ray_target(position: DVec3, normal: DVec3, extent: f64, origin: Vec3) -> Vec3 {
    let length = position.abs() + origin.as_dvec3().abs();
    let step = 2.0 * plane_rounding(position, normal, extent)
        + 4.0 * ROUNDOFF * normal.abs().dot(length)
        + LEAST_STEP;
    (position + normal * step).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;
    use luxel_scenes::{Material, Reflectance};

    fn square(origin: DVec3, side: f64) -> Scene {
        let mut scene = Scene::default();
        let object = scene.push_object("square");
        let material = scene.push_material(Material::diffuse("grey", Reflectance::splat(0.5)));
        let [x, y] = [DVec3::X * side, DVec3::Y * side];
        scene.push_face(
            &[origin, origin + x, origin + x + y, origin + y],
            object,
            material,
        );
        scene
    }

    #[test]
    fn longest_side_is_between_one_half_and_one() {
        for side in [1e-6, 0.3, 1.0, 2.0, 3.0, 1e6] {
            let geometry = Geometry::new(&square(DVec3::splat(7.0), side));
            let polygon = geometry.polygon(FaceId(0));
            let width = (polygon[1] - polygon[0]).length();
            // The offset 7 costs at most one ulp of 8 in the world coordinates.
            assert!(
                width > 0.5 - 1e-8 && width < 1.0 + 1e-8,
                "side {side}: {width}"
            );
        }
    }

    #[test]
    fn scaling_by_a_power_of_two_changes_no_bit() {
        let small = Geometry::new(&square(DVec3::ZERO, 0.7 * (-20f64).exp2()));
        let large = Geometry::new(&square(DVec3::ZERO, 0.7 * 20f64.exp2()));
        assert_eq!(small.polygon(FaceId(0)), large.polygon(FaceId(0)));
    }

    #[test]
    fn no_faces_no_triangles() {
        assert!(Geometry::new(&Scene::default()).is_empty());
    }
}
