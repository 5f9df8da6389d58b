//! Scenes as files for the command: OBJ, MTL and TOML written from a scene made in code.

use luxel_scenes::{Rgb, Scene};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Writes `NAME.obj`, `NAME.mtl` and `NAME.toml` into `folder` and returns the path of the last.
/// Geometry, diffuse materials and their emission come from `scene`; `toml` is what follows the
/// `geometry` key: cameras, lights, overrides. Numbers read back to the same bits.
///
/// # Panics
/// When a file cannot be written.
pub fn write(scene: &Scene, folder: &Path, toml: &str) -> PathBuf {
    let name = &scene.name;
    let save = |extension: &str, text: &str| {
        let path = folder.join(format!("{name}.{extension}"));
        std::fs::write(&path, text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        path
    };
    save("obj", &obj(scene));
    save("mtl", &mtl(scene));
    save("toml", &format!("geometry = [\"{name}.obj\"]\n{toml}"))
}

/// The geometry as OBJ text.
pub fn obj(scene: &Scene) -> String {
    let mut text = format!("mtllib {}.mtl\n", scene.name);
    for v in &scene.vertices {
        line(&mut text, format_args!("v {} {} {}", v.x, v.y, v.z));
    }
    let mut state = None;
    for id in scene.face_ids() {
        let face = scene.faces[id.index()];
        if state != Some((face.object, face.material)) {
            line(
                &mut text,
                format_args!("o {}", scene.objects[face.object.index()].name),
            );
            line(
                &mut text,
                format_args!("usemtl {}", scene.material(id).name),
            );
            state = Some((face.object, face.material));
        }
        let corners = face
            .corners()
            .map(|c| (scene.corners.vertex[c] + 1).to_string());
        line(
            &mut text,
            format_args!("f {}", corners.collect::<Vec<_>>().join(" ")),
        );
    }
    text
}

/// The materials as MTL text: diffuse reflectance and emitted radiance.
pub fn mtl(scene: &Scene) -> String {
    let mut text = String::new();
    let rgb = |c: Rgb| format!("{} {} {}", c.x, c.y, c.z);
    for material in &scene.materials {
        line(&mut text, format_args!("newmtl {}", material.name));
        line(
            &mut text,
            format_args!("Kd {}", rgb(material.reflectance.0)),
        );
        line(&mut text, format_args!("Ke {}", rgb(material.emission.0)));
    }
    text
}

fn line(text: &mut String, arguments: std::fmt::Arguments) {
    writeln!(text, "{arguments}").expect("writing to a string does not fail");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::{Part, polygon, scene};

    #[test]
    fn text_of_a_triangle() {
        let triangle = polygon(&[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 1e-7, 0.0]]);
        let scene = scene("t", [Part::lamp("a", 2.5, vec![triangle])]);
        assert_eq!(
            obj(&scene),
            "mtllib t.mtl\nv 0 0 0\nv 0.1 0 0\nv 0 0.0000001 0\no a\nusemtl a\nf 1 2 3\n"
        );
        assert_eq!(mtl(&scene), "newmtl a\nKd 0 0 0\nKe 2.5 2.5 2.5\n");
    }
}
