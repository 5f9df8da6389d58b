//! Meshes with a radiosity at every vertex, as binary PLY.
//!
//! Little-endian `binary_little_endian 1.0`: positions in metres (`double`), the tone-mapped
//! colour that viewers show (`red`, `green`, `blue`, 8 bits sRGB), the radiosity itself
//! (`radiosity_r`, `_g`, `_b`, W/m², `float`), its standard error (`standard_error_r`, `_g`, `_b`, W/m²,
//! `float`), and polygons. Source: G. Turk, "The PLY polygon file
//! format", Stanford University, 1994.

use crate::image::Image;
use crate::tone_map::ToneMap;
use glam::DVec3;
use luxel_scenes::Radiosity;
use std::fmt::Write as _;

/// A vertex of a [`Mesh`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// Position in metres.
    pub position: DVec3,
    /// Radiosity B in W/m².
    pub radiosity: Radiosity,
    /// One standard deviation of its error in W/m².
    pub standard_error: Radiosity,
}

/// Polygons with a radiosity at every vertex.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Mesh {
    /// The vertices.
    pub vertices: Vec<Vertex>,
    /// Indices of each polygon's vertices, counter-clockwise from its front; at most 255.
    pub faces: Vec<Vec<u32>>,
}

/// Why a mesh cannot be encoded.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("polygon {0} has more than 255 corners, which PLY's one-byte count cannot hold")]
pub struct TooManyCorners(pub usize);

impl Mesh {
    /// The bytes of a PLY file.
    ///
    /// # Errors
    /// When a polygon has more than 255 corners.
    pub fn to_ply(&self) -> Result<Vec<u8>, TooManyCorners> {
        let mut header = String::from("ply\nformat binary_little_endian 1.0\n");
        header += "comment luxel: position in m, radiosity in W/m2, colours tone-mapped sRGB\n";
        let _ = writeln!(header, "element vertex {}", self.vertices.len());
        for axis in ["x", "y", "z"] {
            let _ = writeln!(header, "property double {axis}");
        }
        for colour in ["red", "green", "blue"] {
            let _ = writeln!(header, "property uchar {colour}");
        }
        for channel in ["r", "g", "b"] {
            let _ = writeln!(header, "property float radiosity_{channel}");
        }
        for channel in ["r", "g", "b"] {
            let _ = writeln!(header, "property float standard_error_{channel}");
        }
        let _ = writeln!(header, "element face {}", self.faces.len());
        header += "property list uchar uint vertex_indices\nend_header\n";

        let pixels: Vec<[f32; 3]> = self
            .vertices
            .iter()
            .map(|vertex| vertex.radiosity.0.as_vec3().to_array())
            .collect();
        let image = Image {
            width: pixels.len(),
            height: 1,
            pixels,
        };
        let tone_map = ToneMap::automatic(&image);

        let mut bytes = header.into_bytes();
        for (vertex, &radiosity) in self.vertices.iter().zip(&image.pixels) {
            for coordinate in vertex.position.to_array() {
                bytes.extend(coordinate.to_le_bytes());
            }
            bytes.extend(tone_map.apply(radiosity));
            let error = vertex.standard_error.0.as_vec3().to_array();
            for channel in radiosity.into_iter().chain(error) {
                bytes.extend(channel.to_le_bytes());
            }
        }
        for (index, face) in self.faces.iter().enumerate() {
            bytes.push(u8::try_from(face.len()).map_err(|_| TooManyCorners(index))?);
            for vertex in face {
                bytes.extend(vertex.to_le_bytes());
            }
        }
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_has_the_documented_layout() {
        let vertex = |x: f64| Vertex {
            position: DVec3::new(x, 0.25, 0.0),
            radiosity: Radiosity::new(x, 2.0, 0.0),
            standard_error: Radiosity::splat(0.5),
        };
        let mesh = Mesh {
            vertices: vec![vertex(0.0), vertex(1.0), vertex(2.0)],
            faces: vec![vec![0, 1, 2]],
        };
        let bytes = mesh.to_ply().expect("encodable");
        let marker = b"end_header\n";
        let start = bytes
            .windows(marker.len())
            .position(|window| window == marker)
            .expect("a header")
            + marker.len();
        let header = std::str::from_utf8(&bytes[..start]).expect("text");
        assert!(header.starts_with("ply\n") && header.contains("element vertex 3\n"));
        // 3 doubles, 3 bytes and 6 floats a vertex; a count and 3 indices for the face.
        assert_eq!(bytes.len() - start, 3 * (24 + 3 + 24) + 1 + 12);
        let second = &bytes[start + 51..start + 102];
        assert_eq!(second[..8], 1.0_f64.to_le_bytes());
        assert_eq!(second[27..31], 1.0_f32.to_le_bytes());
        assert_eq!(bytes[bytes.len() - 13], 3);
    }

    #[test]
    fn a_polygon_of_many_corners_is_refused() {
        let mesh = Mesh {
            vertices: vec![],
            faces: vec![vec![], vec![0; 256]],
        };
        assert_eq!(mesh.to_ply(), Err(TooManyCorners(1)));
    }
}
