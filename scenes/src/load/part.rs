//! What one file gives, and how several become one scene.

use super::place::Place;
use super::warning::Warning;
use crate::gltf_file::GltfOrigin;
use crate::id::{MaterialId, ObjectId, TextureId};
use crate::light::LightKind;
use crate::scene::{Scene, UnitSystem};
use std::collections::HashSet;

/// Where a material comes from: later checks name it in the file's own words.
#[derive(Clone, Debug)]
pub(crate) struct MaterialSource {
    pub(crate) place: Place,
    pub(crate) reflectance_field: &'static str,
    pub(crate) emission_field: &'static str,
    pub(crate) specular_field: &'static str,
    /// What its emission is counted in.
    pub(crate) emission_units: UnitSystem,
}

/// The scene that one file gives. Its materials are not checked yet, because the scene file may
/// override them.
#[derive(Debug, Default)]
pub(crate) struct Part {
    pub(crate) scene: Scene,
    /// One for each material of the scene.
    pub(crate) materials: Vec<MaterialSource>,
    pub(crate) warnings: Vec<Warning>,
    /// What the lights are counted in, and what the format prescribes where nothing emits.
    pub(crate) units: Option<UnitSystem>,
    /// Where the vertices come from, when the file is glTF.
    pub(crate) origin: Option<GltfOrigin>,
}

/// All parts so far, as one.
#[derive(Debug, Default)]
pub(crate) struct Merged {
    pub(crate) scene: Scene,
    pub(crate) materials: Vec<MaterialSource>,
    /// What each light is counted in.
    pub(crate) light_units: Vec<UnitSystem>,
    pub(crate) warnings: Vec<Warning>,
    /// What a format prescribes where nothing emits.
    pub(crate) format_units: Option<UnitSystem>,
    /// Where the vertices come from, as long as all are from one glTF file.
    pub(crate) origin: Option<GltfOrigin>,
}

impl Merged {
    /// Adds a part. Names of its objects, lights and cameras that are taken get a number.
    pub(crate) fn add(&mut self, part: Part) {
        let Part {
            scene: mut part,
            materials,
            warnings,
            units,
            origin,
        } = part;
        self.materials.extend(materials);
        self.warnings.extend(warnings);
        self.format_units = self.format_units.or(units);
        self.light_units.extend(std::iter::repeat_n(
            units.unwrap_or_default(),
            part.lights.len(),
        ));
        if self.is_empty() {
            self.scene = part;
            self.origin = origin;
            return;
        }
        self.origin = None;
        let scene = &mut self.scene;
        make_unique(&scene.objects, &mut part.objects, |object| &mut object.name);
        make_unique(&scene.lights, &mut part.lights, |light| &mut light.name);
        make_unique(&scene.cameras, &mut part.cameras, |camera| &mut camera.name);

        let first_vertex = scene.vertices.len();
        let first_corner = scene.corners.vertex.len();
        // Checked here once: the sums below fit 32 bits.
        let _last = ObjectId::new(first_vertex + part.vertices.len());
        let _last = ObjectId::new(first_corner + part.corners.vertex.len());
        let move_texture = |id: TextureId| TextureId::new(id.index() + scene.textures.len());
        for material in &mut part.materials {
            material.reflectance_texture = material.reflectance_texture.map(move_texture);
            material.emission_texture = material.emission_texture.map(move_texture);
        }
        for light in &mut part.lights {
            if let LightKind::Environment { texture, .. } = &mut light.kind {
                *texture = move_texture(*texture);
            }
        }
        for face in &mut part.faces {
            face.first_corner += first_corner as u32;
            face.object = ObjectId::new(face.object.index() + scene.objects.len());
            face.material = MaterialId::new(face.material.index() + scene.materials.len());
        }
        for vertex in &mut part.corners.vertex {
            *vertex += first_vertex as u32;
        }
        scene.corners.append(part.corners);
        scene.vertices.extend(part.vertices);
        scene.faces.extend(part.faces);
        scene.objects.extend(part.objects);
        scene.materials.extend(part.materials);
        scene.textures.extend(part.textures);
        scene.lights.extend(part.lights);
        scene.cameras.extend(part.cameras);
    }

    fn is_empty(&self) -> bool {
        let s = &self.scene;
        s.vertices.is_empty()
            && s.objects.is_empty()
            && s.materials.is_empty()
            && s.textures.is_empty()
            && s.lights.is_empty()
            && s.cameras.is_empty()
    }
}

/// Gives names that are taken a number.
fn make_unique<T: Clone>(taken: &[T], added: &mut [T], name: impl Fn(&mut T) -> &mut String) {
    let mut taken: HashSet<String> = taken
        .iter()
        .map(|item| name(&mut item.clone()).clone())
        .collect();
    for item in added {
        let name = name(item);
        *name = unique_name(name, |candidate| taken.contains(candidate));
        taken.insert(name.clone());
    }
}

/// `name`, or `name.2`, `name.3` … when it is taken.
pub(crate) fn unique_name(name: &str, is_taken: impl Fn(&str) -> bool) -> String {
    if !is_taken(name) {
        return name.to_owned();
    }
    let mut number = 2;
    loop {
        let candidate = format!("{name}.{number}");
        if !is_taken(&candidate) {
            return candidate;
        }
        number += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Material;
    use crate::radiometry::Reflectance;
    use glam::{DVec3, Vec3};

    fn part(normal: Option<Vec3>) -> Part {
        let mut part = Part::default();
        let scene = &mut part.scene;
        let object = scene.push_object("box");
        let material = scene.push_material(Material::diffuse("m", Reflectance::splat(0.5)));
        scene.push_face(&[DVec3::ZERO, DVec3::X, DVec3::Y], object, material);
        if let Some(normal) = normal {
            scene.corners.normal = vec![normal; 3];
        }
        part
    }

    #[test]
    fn indices_are_moved_and_names_stay_unique() {
        let mut merged = Merged::default();
        merged.add(part(None));
        merged.add(part(Some(Vec3::Z)));
        merged.add(part(None));
        let scene = &merged.scene;
        let names: Vec<&str> = scene.objects.iter().map(|o| o.name.as_str()).collect();
        assert_eq!(names, ["box", "box.2", "box.3"]);
        for face in scene.face_ids() {
            assert_eq!(scene.area(face), 0.5);
            assert_eq!(scene.faces[face.index()].object.index(), face.index());
            assert_eq!(scene.faces[face.index()].material.index(), face.index());
        }
        let expected = [[Vec3::ZERO; 3], [Vec3::Z; 3], [Vec3::ZERO; 3]].concat();
        assert_eq!(scene.corners.normal, expected);
    }
}
