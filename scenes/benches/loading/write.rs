//! Writes the hall as OBJ with MTL, and as GLB.

use super::hall::{MATERIALS, Mesh};
use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::Path;

/// Where an OBJ file has the vertices of its objects.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Layout {
    /// Each before the faces of its object, as most exporters do.
    ByObject,
    /// All before the first face.
    VerticesFirst,
}

/// Writes `NAME.obj` with a `NAME.mtl` beside it.
pub(crate) fn obj(file: &Path, meshes: &[Mesh], layout: Layout) -> io::Result<()> {
    let library = file.with_extension("mtl");
    let mut text = String::new();
    for (name, reflectance) in MATERIALS {
        let emission = if name == "lamp" { 10.0 } else { 0.0 };
        _ = writeln!(
            text,
            "newmtl {name}\nKd {reflectance} {reflectance} {reflectance}"
        );
        _ = writeln!(text, "Ke {emission} {emission} {emission}\nillum 1\n");
    }
    fs::write(&library, text)?;
    let mut text = format!(
        "# a hall\nmtllib {}\n",
        library.file_name().unwrap_or_default().display()
    );
    if layout == Layout::VerticesFirst {
        for mesh in meshes {
            vertices(&mut text, mesh);
        }
    }
    let mut first = 1;
    for mesh in meshes {
        let keyword = if mesh.name.starts_with("clutter") {
            "g"
        } else {
            "o"
        };
        _ = writeln!(text, "{keyword} {}", mesh.name);
        if layout == Layout::ByObject {
            vertices(&mut text, mesh);
        }
        _ = writeln!(text, "usemtl {}\ns off", MATERIALS[mesh.material].0);
        for face in &mesh.faces {
            text.push('f');
            for corner in face {
                let index = first + corner;
                _ = write!(text, " {index}/{index}/{index}");
            }
            text.push('\n');
        }
        first += mesh.positions.len() as u32;
    }
    fs::write(file, text)
}

fn vertices(text: &mut String, mesh: &Mesh) {
    for [x, y, z] in &mesh.positions {
        _ = writeln!(text, "v {x:.6} {y:.6} {z:.6}");
    }
    for [u, v] in &mesh.uvs {
        _ = writeln!(text, "vt {u:.6} {v:.6}");
    }
    for [x, y, z] in &mesh.normals {
        _ = writeln!(text, "vn {x:.4} {y:.4} {z:.4}");
    }
}

/// Writes a GLB file; quads are cut into two triangles.
#[expect(
    clippy::too_many_lines,
    reason = "one document, written from top to bottom"
)]
pub(crate) fn glb(file: &Path, meshes: &[Mesh]) -> io::Result<()> {
    let mut binary: Vec<u8> = Vec::new();
    let (mut views, mut accessors, mut json_meshes, mut nodes) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (number, mesh) in meshes.iter().enumerate() {
        let triangles: Vec<u32> = mesh
            .faces
            .iter()
            .flat_map(|face| {
                face[1..]
                    .windows(2)
                    .flat_map(|edge| [face[0], edge[0], edge[1]])
            })
            .collect();
        let floats = |values: &mut dyn Iterator<Item = f64>| -> Vec<u8> {
            values.flat_map(|x| (x as f32).to_le_bytes()).collect()
        };
        let count = mesh.positions.len();
        let bounds = |pick: fn(f64, f64) -> f64| {
            let fold = |a: [f64; 3], b: &[f64; 3]| [0, 1, 2].map(|k| pick(a[k], b[k]));
            let start = mesh.positions[0];
            mesh.positions.iter().fold(start, fold).map(|x| x as f32)
        };
        let extent = format!(
            r#","min":{:?},"max":{:?}"#,
            bounds(f64::min),
            bounds(f64::max)
        );
        let arrays = [
            (
                floats(&mut mesh.positions.iter().flatten().copied()),
                5126,
                "VEC3",
                count,
                extent,
            ),
            (
                floats(&mut mesh.normals.iter().flatten().copied()),
                5126,
                "VEC3",
                count,
                String::new(),
            ),
            (
                floats(&mut mesh.uvs.iter().flatten().copied()),
                5126,
                "VEC2",
                count,
                String::new(),
            ),
            (
                triangles
                    .iter()
                    .flat_map(|index| index.to_le_bytes())
                    .collect(),
                5125,
                "SCALAR",
                triangles.len(),
                String::new(),
            ),
        ];
        for (bytes, component, kind, count, extent) in arrays {
            views.push(format!(
                r#"{{"buffer":0,"byteOffset":{},"byteLength":{}}}"#,
                binary.len(),
                bytes.len()
            ));
            accessors.push(format!(
                r#"{{"bufferView":{},"componentType":{component},"type":"{kind}","count":{count}{extent}}}"#,
                views.len() - 1
            ));
            binary.extend(bytes);
        }
        let a = 4 * number;
        json_meshes.push(format!(
            r#"{{"primitives":[{{"attributes":{{"POSITION":{a},"NORMAL":{},"TEXCOORD_0":{}}},"indices":{},"material":{}}}]}}"#,
            a + 1,
            a + 2,
            a + 3,
            mesh.material
        ));
        nodes.push(format!(r#"{{"name":"{}","mesh":{number}}}"#, mesh.name));
    }
    let materials = MATERIALS.map(|(name, grey)| {
        format!(r#"{{"name":"{name}","pbrMetallicRoughness":{{"baseColorFactor":[{grey},{grey},{grey},1],"metallicFactor":0}}}}"#)
    });
    let roots: Vec<String> = (0..nodes.len()).map(|node| node.to_string()).collect();
    let mut json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[{}]}}],"buffers":[{{"byteLength":{}}}],"bufferViews":[{}],"accessors":[{}],"meshes":[{}],"nodes":[{}],"materials":[{}]}}"#,
        roots.join(","),
        binary.len(),
        views.join(","),
        accessors.join(","),
        json_meshes.join(","),
        nodes.join(","),
        materials.join(",")
    );
    while json.len() % 4 != 0 {
        json.push(' ');
    }
    let mut bytes = b"glTF".to_vec();
    let total = 12 + 8 + json.len() + 8 + binary.len();
    bytes.extend(
        [2, total as u32, json.len() as u32]
            .into_iter()
            .flat_map(u32::to_le_bytes),
    );
    bytes.extend(b"JSON");
    bytes.extend(json.into_bytes());
    bytes.extend((binary.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(binary);
    fs::write(file, bytes)
}
