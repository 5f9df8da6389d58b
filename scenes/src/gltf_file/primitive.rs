//! One primitive of a mesh at one node: its triangles in world space.

use super::accessor;
use super::error::GltfError;
use super::material::UvMapping;
use super::source::Source;
use crate::assemble::{Attributes, Corner};
use glam::{DMat3, DMat4, DVec3, DVec4, Vec2, Vec3};
use gltf::Semantic;
use gltf::accessor::{DataType, Dimensions};
use gltf::mesh::Mode;
use gltf::mesh::util::ReadTexCoords;

/// The triangles of a primitive.
pub(super) struct Geometry {
    pub(super) positions: Vec<DVec3>,
    normals: Vec<Vec3>,
    uv0: Vec<Vec2>,
    uv1: Vec<Vec2>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Reads a primitive, or nothing when it is made of points or lines. `uv` is how its material's
/// texture is addressed.
pub(super) fn read(
    source: &Source,
    mesh: &gltf::Mesh,
    primitive: &gltf::Primitive,
    transform: &DMat4,
    uv: &UvMapping,
) -> Result<Option<Geometry>, GltfError> {
    let mode = primitive.mode();
    if !matches!(
        mode,
        Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
    ) {
        return Ok(None);
    }
    let error = |attribute, problem| GltfError::Attribute {
        file: source.file.to_owned(),
        attribute,
        primitive: primitive.index(),
        mesh: mesh
            .name()
            .map_or_else(|| mesh.index().to_string(), |name| format!("`{name}`")),
        problem,
    };
    check_attributes(source, primitive)
        .map_err(|(attribute, problem)| error(attribute, problem))?;

    let reader = primitive.reader(|buffer| source.buffer(buffer.index()));
    let Some(positions) = reader.read_positions() else {
        return Err(error("POSITION", "is missing".to_owned()));
    };
    let positions: Vec<DVec3> = positions
        .map(|p| transform.transform_point3(DVec3::from(p.map(f64::from))))
        .collect();
    if !positions.iter().all(|p| p.is_finite()) {
        return Err(error("POSITION", "is not finite".to_owned()));
    }
    let count = positions.len();
    // One value a vertex, or none at all.
    let normals = normal_matrix(transform);
    let normals: Vec<Vec3> = reader
        .read_normals()
        .into_iter()
        .flatten()
        .map(|n| {
            (normals * DVec3::from(n.map(f64::from)))
                .normalize_or_zero()
                .as_vec3()
        })
        .collect();
    let uv_set = |set| reader.read_tex_coords(set).map(ReadTexCoords::into_f32);
    let uv0: Vec<Vec2> = uv_set(uv.set)
        .into_iter()
        .flatten()
        .map(|v| uv.apply(v))
        .collect();
    let uv1: Vec<Vec2> = uv_set(1)
        .into_iter()
        .flatten()
        .map(|[u, v]| Vec2::new(u, 1.0 - v))
        .collect();
    for (attribute, length) in [
        ("NORMAL", normals.len()),
        ("TEXCOORD_0", uv0.len()),
        ("TEXCOORD_1", uv1.len()),
    ] {
        if length != 0 && length != count {
            return Err(error(
                attribute,
                format!("has {length} values for {count} vertices"),
            ));
        }
    }
    if !uv0.iter().chain(&uv1).all(|uv| uv.is_finite()) {
        return Err(error("TEXCOORD", "is not finite".to_owned()));
    }
    let indices: Vec<u32> = match reader.read_indices() {
        Some(indices) => indices.into_u32().collect(),
        None => (0..count as u32).collect(),
    };
    if let Some(index) = indices.iter().find(|&&index| index as usize >= count) {
        return Err(error("indices", format!("name vertex {index} of {count}")));
    }
    let mut triangles = triangles(mode, &indices);
    if is_mirrored(transform) {
        // A mirror turns faces over; turning them back keeps what faced outwards outside.
        for triangle in &mut triangles {
            triangle.swap(1, 2);
        }
    }
    Ok(Some(Geometry {
        positions,
        normals,
        uv0,
        uv1,
        triangles,
    }))
}

/// Checks all that is read.
fn check_attributes(
    source: &Source,
    primitive: &gltf::Primitive,
) -> Result<(), (&'static str, String)> {
    use DataType::{F32, U8, U16, U32};
    for (semantic, accessor) in primitive.attributes() {
        let (attribute, dimensions, types): (_, _, &[DataType]) = match semantic {
            Semantic::Positions => ("POSITION", Dimensions::Vec3, &[F32]),
            Semantic::Normals => ("NORMAL", Dimensions::Vec3, &[F32]),
            Semantic::TexCoords(_) => ("TEXCOORD", Dimensions::Vec2, &[F32, U8, U16]),
            _ => continue,
        };
        accessor::check(source, &accessor, dimensions, types).map_err(|e| (attribute, e))?;
    }
    if let Some(indices) = primitive.indices() {
        accessor::check(source, &indices, Dimensions::Scalar, &[U8, U16, U32])
            .map_err(|e| ("indices", e))?;
    }
    Ok(())
}

/// Whether a transform turns faces over.
pub(super) fn is_mirrored(transform: &DMat4) -> bool {
    transform.determinant() < 0.0
}

/// Inverse transpose times a positive factor, which also exists where the inverse does not.
fn normal_matrix(transform: &DMat4) -> DMat3 {
    let [x, y, z] = [transform.x_axis, transform.y_axis, transform.z_axis].map(DVec4::truncate);
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    cofactors * transform.determinant().signum()
}

fn triangles(mode: Mode, indices: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => indices
            .windows(3)
            .enumerate()
            .map(|(i, w)| {
                if i % 2 == 0 {
                    [w[0], w[1], w[2]]
                } else {
                    [w[1], w[0], w[2]]
                }
            })
            .collect(),
        Mode::TriangleFan => indices
            .get(1..)
            .unwrap_or_default()
            .windows(2)
            .map(|w| [indices[0], w[0], w[1]])
            .collect(),
        _ => indices.as_chunks::<3>().0.to_vec(),
    }
}

impl Geometry {
    /// Which attributes the vertices have.
    pub(super) fn attributes(&self) -> Attributes {
        Attributes {
            normal: !self.normals.is_empty(),
            uv0: !self.uv0.is_empty(),
            uv1: !self.uv1.is_empty(),
        }
    }

    /// The corners of a triangle in a scene where the geometry's first vertex has the number `base`.
    pub(super) fn corners(&self, triangle: [u32; 3], base: u32) -> [Corner; 3] {
        triangle.map(|index| {
            let i = index as usize;
            Corner {
                vertex: base + index,
                normal: self.normals.get(i).copied().unwrap_or_default(),
                uv0: self.uv0.get(i).copied().unwrap_or_default(),
                uv1: self.uv1.get(i).copied().unwrap_or_default(),
            }
        })
    }
}
