//! Reads glTF 2.0 (`.gltf`, `.glb`) through the [gltf] crate.
//!
//! Node transforms are composed in f64. Each node that has a mesh is an object of its own; mirrored
//! transforms keep faces facing as they did. Triangle strips and fans are taken apart, points and
//! lines left out. Texture coordinates are turned to v upwards. Light is photometric: lights in
//! candela and lux, emission in cd/m². Animation, skins and morph targets are left at rest.

mod accessor;
mod error;
mod material;
mod objects;
mod origin;
mod primitive;
mod punctual;
mod source;

pub use error::GltfError;
pub use origin::{GltfBytes, GltfOrigin, VertexOrigin};

use crate::id::MaterialId;
use crate::load::{FacePlace, LoadError, Part, Place, Warning, unique_name};
use crate::scene::{Scene, UnitSystem};
use glam::{DMat4, DQuat, DVec3, DVec4};
use gltf::scene::Transform;
use material::{Materials, UvMapping};
use objects::{Primitive, Tally};
use source::Source;
use std::collections::HashSet;
use std::path::Path;

/// Reads a glTF file with the buffers and images that it names.
pub(crate) fn read(file: &Path, named_at: Option<&Place>) -> Result<Part, LoadError> {
    let source = Source::read(file, named_at)?;
    let mut reader = Reader {
        source: &source,
        materials: Materials::new(&source),
        scene: Scene::default(),
        part: Part::default(),
        uvs: Vec::new(),
        default_material: None,
        names: HashSet::new(),
        primitives: Vec::new(),
    };
    for material in source.document.materials() {
        reader.add_material(&material)?;
    }
    reader.add_nodes()?;
    let tally = objects::add(&source, &mut reader.scene, &reader.primitives, &reader.uvs)?;
    Ok(reader.finish(tally))
}

/// Everything that is known while nodes are turned into faces.
struct Reader<'s> {
    source: &'s Source<'s>,
    materials: Materials<'s>,
    scene: Scene,
    /// Material sources; the scene is put in at the end.
    part: Part,
    /// How each material addresses its texture.
    uvs: Vec<UvMapping>,
    default_material: Option<MaterialId>,
    /// Names of objects, lights and cameras so far.
    names: HashSet<String>,
    /// What the objects are made of, in order.
    primitives: Vec<Primitive<'s>>,
}

impl<'s> Reader<'s> {
    fn add_material(&mut self, material: &gltf::Material) -> Result<MaterialId, LoadError> {
        let converted = self.materials.convert(material, &mut self.scene)?;
        self.part.materials.push(converted.source);
        self.uvs.push(converted.uv);
        Ok(self.scene.push_material(converted.material))
    }

    /// The material of a primitive, with glTF's white default where it names none.
    fn material(&mut self, material: &gltf::Material) -> Result<MaterialId, LoadError> {
        if let Some(index) = material.index() {
            return Ok(MaterialId::new(index));
        }
        if let Some(id) = self.default_material {
            return Ok(id);
        }
        let id = self.add_material(material)?;
        self.default_material = Some(id);
        Ok(id)
    }

    /// Visits the nodes of the default scene, of the first where there is no default, or all roots
    /// where there is no scene.
    fn add_nodes(&mut self) -> Result<(), LoadError> {
        let source: &'s Source = self.source;
        let document = &source.document;
        let scene = document
            .default_scene()
            .or_else(|| document.scenes().next());
        let roots: Vec<gltf::Node<'s>> = if let Some(scene) = scene {
            scene.nodes().collect()
        } else {
            let children: HashSet<usize> = document
                .nodes()
                .flat_map(|node| node.children().map(|child| child.index()))
                .collect();
            let is_root = |node: &gltf::Node| !children.contains(&node.index());
            document.nodes().filter(is_root).collect()
        };
        // A list of what is left to do instead of recursion: files may nest deeper than the stack.
        let mut pending: Vec<(gltf::Node<'s>, DMat4)> = roots
            .into_iter()
            .rev()
            .map(|node| (node, DMat4::IDENTITY))
            .collect();
        let mut seen = vec![false; document.nodes().len()];
        while let Some((node, parent)) = pending.pop() {
            if std::mem::replace(&mut seen[node.index()], true) {
                return Err(GltfError::Tree {
                    file: self.source.file.to_owned(),
                    node: node_name(&node),
                }
                .into());
            }
            let transform = parent * local_transform(&node);
            self.add_node(&node, &transform)?;
            let children: Vec<gltf::Node<'s>> = node.children().collect();
            pending.extend(children.into_iter().rev().map(|child| (child, transform)));
        }
        Ok(())
    }

    fn add_node(&mut self, node: &gltf::Node<'s>, transform: &DMat4) -> Result<(), LoadError> {
        if !transform.is_finite() {
            return Err(GltfError::Value {
                file: self.source.file.to_owned(),
                element: node_name(node),
                problem: "the transform is not finite; export the file again",
            }
            .into());
        }
        if let Some(light) = node.light() {
            let name = self.name(node.name().or(light.name()), "light");
            let light = punctual::light(self.source, &light, &name, transform)?;
            self.scene.lights.push(light);
        }
        if let Some(camera) = node.camera() {
            let name = self.name(node.name().or(camera.name()), "camera");
            let camera = punctual::camera(self.source, &camera, &name, transform)?;
            self.scene.cameras.push(camera);
        }
        if let Some(mesh) = node.mesh() {
            let name = self.name(node.name().or(mesh.name()), "object");
            self.add_mesh(node, &mesh, name, transform)?;
        }
        Ok(())
    }

    fn name(&mut self, name: Option<&str>, kind: &str) -> String {
        let name = name.filter(|name| !name.is_empty()).unwrap_or(kind);
        let name = unique_name(name, |name| self.names.contains(name));
        self.names.insert(name.clone());
        name
    }

    fn add_mesh(
        &mut self,
        node: &gltf::Node<'s>,
        mesh: &gltf::Mesh<'s>,
        name: String,
        transform: &DMat4,
    ) -> Result<(), LoadError> {
        let object = self.scene.push_object(name);
        for primitive in mesh.primitives() {
            let material = self.material(&primitive.material())?;
            self.primitives.push(Primitive {
                object,
                material,
                node: node.index(),
                mesh: mesh.clone(),
                content: primitive,
                transform: *transform,
            });
        }
        Ok(())
    }

    fn finish(self, tally: Tally) -> Part {
        let mut part = self.part;
        let place = Place::file(self.source.file);
        part.warnings = self.materials.into_warnings();
        if let Some((object, number)) = tally.first_dropped {
            let first = FacePlace {
                place: place.clone(),
                object,
                number,
            };
            let count = tally.dropped;
            part.warnings
                .push(Warning::DegenerateFaces { count, first });
        }
        if let Some(first) = tally.empty_objects.first() {
            part.warnings.push(Warning::EmptyObjects {
                count: tally.empty_objects.len(),
                place: place.clone(),
                first: first.clone(),
            });
        }
        if tally.lines_and_points > 0 {
            let count = tally.lines_and_points;
            part.warnings.push(Warning::LinesAndPoints { count, place });
        }
        part.origin = Some(GltfOrigin {
            file: self.source.file.to_owned(),
            runs: tally.origins,
            scale: 1.0,
            changed: Vec::new(),
            lights: self.scene.lights.len(),
            cameras: self.scene.cameras.len(),
        });
        part.scene = self.scene;
        part.units = Some(UnitSystem::Photometric);
        part
    }
}

fn node_name(node: &gltf::Node) -> String {
    match node.name() {
        Some(name) => format!("node `{name}`"),
        None => format!("node {}", node.index()),
    }
}

/// The node's transform to its parent, in f64.
fn local_transform(node: &gltf::Node) -> DMat4 {
    match node.transform() {
        Transform::Matrix { matrix } => {
            let [x, y, z, w] = matrix.map(|column| DVec4::from(column.map(f64::from)));
            DMat4::from_cols(x, y, z, w)
        }
        Transform::Decomposed {
            translation,
            rotation,
            scale,
        } => {
            // Rounded to f32 in the file, quaternions are not quite of unit length.
            let rotation = DQuat::from_array(rotation.map(f64::from));
            let rotation = if rotation.length_squared() > 0.0 {
                rotation.normalize()
            } else {
                DQuat::IDENTITY
            };
            DMat4::from_scale_rotation_translation(
                DVec3::from(scale.map(f64::from)),
                rotation,
                DVec3::from(translation.map(f64::from)),
            )
        }
    }
}

#[cfg(test)]
mod tests;
