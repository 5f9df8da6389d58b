//! A scene as Wavefront OBJ with lightmap coordinates.
//!
//! Source: Wavefront Technologies, "Object Files (.obj)" and "Material Library File (.mtl)", Advanced Visualizer manual,
//! appendix B, 1992. `v` are metres in world space, in f64; `vt` are lightmap coordinates, which have v upwards here:
//! (u, 1 − v) of [`Atlas::uv`]; `vn` are there where the scene has normals.
//!
//! The format has one set of coordinates and no notion of pages. So of a lightmap with several pages, the faces of each page
//! of an object are an object of their own, `NAME.page_001` on page 1, with a comment before it; `vt` are within the page. Faces
//! without a lightmap have no `vt`. And images of `map_Kd` were addressed by coordinates that are not in this file: the line
//! names the image, and a program that shows it by `vt` shows it in wrong places.
//!
//! Cost: linear in the corners, with tables of the coordinates and normals that are written.

use super::pages::Pages;
use crate::lightmap::atlas::Atlas;
use luxel_scenes::material::Wrap;
use luxel_scenes::{FaceId, Material, MaterialId, ObjectId, Scene, Texture};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt::Write as _;

/// The bytes of an OBJ file and of the material library that it names `mtl_name`.
///
/// # Panics
/// When the atlas is not one of this scene.
pub fn obj(scene: &Scene, atlas: &Atlas, mtl_name: &str) -> (Vec<u8>, Vec<u8>) {
    let materials = unique(scene.materials.iter().map(|m| m.name.as_str()), "material");
    let objects = unique(scene.objects.iter().map(|o| o.name.as_str()), "object");
    let pages = Pages::new(scene, atlas);
    let mut groups: BTreeMap<(ObjectId, Option<u32>, MaterialId), Vec<FaceId>> = BTreeMap::new();
    for id in scene.face_ids() {
        let face = scene.faces[id.index()];
        let key = (face.object, pages.of(id), face.material);
        groups.entry(key).or_default().push(id);
    }

    let mut writer = Writer::new(scene, atlas);
    writer.line(format_args!(
        "# luxel: positions in m, vt of the lightmap in the page that an object is on"
    ));
    writer.line(format_args!("mtllib {}", printable(mtl_name)));
    let mut last = None;
    for ((object, page, material), faces) in groups {
        if last != Some((object, page)) {
            last = Some((object, page));
            writer.start(&objects[object.index()], page);
        }
        writer.line(format_args!("usemtl {}", materials[material.index()]));
        for face in faces {
            writer.face(face, page.is_some());
        }
    }
    (writer.text.into_bytes(), library(scene, &materials))
}

/// A file that is being written.
struct Writer<'s> {
    scene: &'s Scene,
    atlas: &'s Atlas,
    text: String,
    /// Number of each vertex in the file, from one; zero for those that are not written yet.
    vertices: Vec<usize>,
    written: usize,
    coordinates: HashMap<[u32; 2], usize>,
    normals: HashMap<[u32; 3], usize>,
}

impl<'s> Writer<'s> {
    fn new(scene: &'s Scene, atlas: &'s Atlas) -> Self {
        Self {
            scene,
            atlas,
            text: String::new(),
            vertices: vec![0; scene.vertices.len()],
            written: 0,
            coordinates: HashMap::new(),
            normals: HashMap::new(),
        }
    }

    fn line(&mut self, line: std::fmt::Arguments) {
        // Writing to a string does not fail.
        let _ = writeln!(self.text, "{line}");
    }

    /// Begins the faces of an object on a page.
    fn start(&mut self, object: &str, page: Option<u32>) {
        match page {
            None => self.line(format_args!("# no lightmap\no {object}")),
            Some(page) if self.atlas.pages > 1 => {
                self.line(format_args!("# page {page}\no {object}.page_{page:03}"));
            }
            Some(page) => self.line(format_args!("# page {page}\no {object}")),
        }
    }

    fn face(&mut self, face: FaceId, has_place: bool) {
        let corners = self.scene.faces[face.index()].corners();
        let normals = self.scene.corners.normal.get(corners.clone());
        let has_normals = normals.is_some_and(|all| all.iter().all(|n| n.length_squared() > 0.0));
        let mut line = String::from("f");
        for corner in corners {
            let vertex = self.vertex(self.scene.corners.vertex[corner] as usize);
            let place = has_place.then(|| self.coordinate(corner));
            let normal = has_normals.then(|| self.normal(corner));
            // Writing to a string does not fail.
            let _ = match (place, normal) {
                (Some(place), Some(normal)) => write!(line, " {vertex}/{place}/{normal}"),
                (Some(place), None) => write!(line, " {vertex}/{place}"),
                (None, Some(normal)) => write!(line, " {vertex}//{normal}"),
                (None, None) => write!(line, " {vertex}"),
            };
        }
        self.line(format_args!("{line}"));
    }

    fn vertex(&mut self, vertex: usize) -> usize {
        if self.vertices[vertex] == 0 {
            let [x, y, z] = self.scene.vertices[vertex].to_array();
            self.line(format_args!("v {x} {y} {z}"));
            self.written += 1;
            self.vertices[vertex] = self.written;
        }
        self.vertices[vertex]
    }

    fn coordinate(&mut self, corner: usize) -> usize {
        let uv = self.atlas.uv(self.atlas.corners[corner]);
        let (u, v) = (uv.x as f32, (1.0 - uv.y) as f32);
        let next = self.coordinates.len() + 1;
        let number = *self
            .coordinates
            .entry([u.to_bits(), v.to_bits()])
            .or_insert(next);
        if number == next {
            self.line(format_args!("vt {u} {v}"));
        }
        number
    }

    fn normal(&mut self, corner: usize) -> usize {
        let normal = self.scene.corners.normal[corner].to_array();
        let next = self.normals.len() + 1;
        let number = *self.normals.entry(normal.map(f32::to_bits)).or_insert(next);
        if number == next {
            let [x, y, z] = normal;
            self.line(format_args!("vn {x} {y} {z}"));
        }
        number
    }
}

/// The material library.
fn library(scene: &Scene, names: &[String]) -> Vec<u8> {
    let mut lines = vec![
        "# luxel: Kd is the diffuse reflectance, Ke the emitted radiance; images of map_Kd are not addressed by vt".to_owned(),
    ];
    for (material, name) in scene.materials.iter().zip(names) {
        let [kd, ke] = [material.reflectance.0, material.emission.0];
        lines.push(format!("newmtl {name}"));
        lines.push(format!("Kd {} {} {}", kd.x, kd.y, kd.z));
        lines.push(format!("Ke {} {} {}", ke.x, ke.y, ke.z));
        if let Some(texture) = file_of(scene, material) {
            let clamp = match texture.wrap {
                Wrap::Clamp => "-clamp on ",
                Wrap::Repeat | Wrap::Mirror => "",
            };
            let name = printable(&texture.name.replace('\\', "/"));
            lines.push(format!("map_Kd {clamp}{name}"));
        }
    }
    lines.push(String::new());
    lines.join("\n").into_bytes()
}

/// The reflectance texture of a material when it was a file, which its name tells by the extension.
fn file_of<'s>(scene: &'s Scene, material: &Material) -> Option<&'s Texture> {
    let texture = &scene.textures[material.reflectance_texture?.index()];
    let extension = std::path::Path::new(&texture.name).extension()?;
    let known = ["png", "jpg", "jpeg", "tga", "hdr"];
    let is_known = known
        .iter()
        .any(|known| extension.eq_ignore_ascii_case(known));
    is_known.then_some(texture)
}

/// Names that a line holds and that are all different.
fn unique<'n>(names: impl Iterator<Item = &'n str>, unnamed: &str) -> Vec<String> {
    let mut taken = HashSet::new();
    names
        .map(|name| {
            let name = printable(name);
            let name = if name.is_empty() { unnamed } else { &name };
            let mut candidate = name.to_owned();
            let mut number = 2;
            while !taken.insert(candidate.clone()) {
                candidate = format!("{name}.{number}");
                number += 1;
            }
            candidate
        })
        .collect()
}

/// A name without what would end the line or begin a comment.
fn printable(name: &str) -> String {
    let is_bad = |c: char| c.is_control() || c == '#' || c == '\\';
    let name = name.trim();
    name.replace(is_bad, "_")
}

#[cfg(test)]
mod tests;
