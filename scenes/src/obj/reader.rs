//! Turns what the parser gives into faces of a scene.

use super::error::ObjError;
use super::survey::{Present, Survey};
use super::{locate, mtl};
use crate::assemble::{Assembly, Attributes, Corner, Outcome};
use crate::id::{MaterialId, ObjectId};
use crate::load::{FacePlace, LoadError, MaterialSource, Part, Place, Warning};
use crate::material::Material;
use crate::radiometry::Reflectance;
use crate::scene::UnitSystem;
use crate::texture_file::TextureFiles;
use glam::{DVec3, Vec2};
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// Counts of faces that went in changed or not at all, and the first of each kind: its number in
/// the file, its object and its number there.
#[derive(Debug, Default)]
struct Tally {
    count: usize,
    first: Option<(usize, ObjectId, usize)>,
}

impl Tally {
    fn add(&mut self, in_file: usize, object: ObjectId, in_object: usize) {
        self.count += 1;
        self.first.get_or_insert((in_file, object, in_object));
    }
}

/// Everything that is known while models are turned into faces.
pub(super) struct Reader<'t> {
    file: &'t Path,
    text: &'t str,
    assembly: Assembly,
    textures: TextureFiles,
    sources: Vec<MaterialSource>,
    warnings: Vec<Warning>,
    objects: HashMap<String, ObjectId>,
    /// Faces so far of each object.
    object_faces: Vec<usize>,
    /// Faces so far in the file.
    faces: usize,
    /// What each corner names, or empty when the file has neither normals nor UVs.
    pub(super) present: Vec<Present>,
    corners_read: usize,
    grey: Option<MaterialId>,
    dropped: Tally,
    concave: Tally,
    non_planar: Tally,
    without_material: Tally,
}

impl<'t> Reader<'t> {
    pub(super) fn new(file: &'t Path, text: &'t str, warnings: Vec<Warning>) -> Self {
        Self {
            file,
            text,
            assembly: Assembly::default(),
            textures: TextureFiles::default(),
            sources: Vec::new(),
            warnings,
            objects: HashMap::new(),
            object_faces: Vec::new(),
            faces: 0,
            present: Vec::new(),
            corners_read: 0,
            grey: None,
            dropped: Tally::default(),
            concave: Tally::default(),
            non_planar: Tally::default(),
            without_material: Tally::default(),
        }
    }

    pub(super) fn add_material(
        &mut self,
        material: &tobj::Material,
        place: Place,
        folder: &Path,
    ) -> Result<(), LoadError> {
        let scene = &mut self.assembly.scene;
        let textures = &mut self.textures;
        let converted = mtl::convert(material, place, folder, scene, textures, &mut self.warnings)?;
        scene.push_material(converted.0);
        self.sources.push(converted.1);
        Ok(())
    }

    pub(super) fn add_model(&mut self, model: &tobj::Model) -> Result<(), ObjError> {
        let mesh = &model.mesh;
        if mesh.indices.is_empty() {
            return Ok(());
        }
        let base = self.assembly.scene.vertices.len();
        // The parser's own counters are 32 bits wide and would wrap.
        if base + mesh.positions.len() / 3 > u32::MAX as usize
            || self.corners_read + mesh.indices.len() > u32::MAX as usize
        {
            let file = self.file.to_owned();
            return Err(ObjError::TooLarge { file });
        }
        let positions = mesh.positions.as_chunks::<3>().0;
        let vertices = &mut self.assembly.scene.vertices;
        vertices.extend(positions.iter().map(|&p| DVec3::from(p)));

        let object = self.object(&model.name);
        let material = match mesh.material_id {
            Some(index) => MaterialId::new(index),
            None => self.grey(),
        };
        let mut corners = Vec::new();
        let mut first = 0;
        // The parser leaves arities out when all faces are triangles.
        let triangles = mesh.indices.len() / 3;
        let face_count = if mesh.face_arities.is_empty() {
            triangles
        } else {
            mesh.face_arities.len()
        };
        for face in 0..face_count {
            let arity = mesh.face_arities.get(face).map_or(3, |&n| n as usize);
            // A bare `f` line is a face of no corners for the parser and none for the line counter.
            if arity == 0 {
                continue;
            }
            let attributes = self.fill_corners(&mut corners, mesh, first..first + arity, base);
            first += arity;
            self.add_face(
                &corners,
                attributes,
                object,
                material,
                mesh.material_id.is_none(),
            );
        }
        Ok(())
    }

    /// Collects the corners of one face and says which attributes all of them have.
    fn fill_corners(
        &mut self,
        corners: &mut Vec<Corner>,
        mesh: &tobj::Mesh,
        range: std::ops::Range<usize>,
        base: usize,
    ) -> Attributes {
        corners.clear();
        corners.extend(mesh.indices[range.clone()].iter().map(|&index| Corner {
            vertex: base as u32 + index,
            ..Corner::default()
        }));
        let read = self.corners_read;
        self.corners_read += range.len();
        let Some(present) = self.present.get(read..read + range.len()) else {
            return Attributes::default();
        };
        let attributes = Attributes {
            normal: present.iter().any(|p| p.normal),
            uv0: present.iter().any(|p| p.uv),
            uv1: false,
        };
        for (i, corner) in corners.iter_mut().enumerate() {
            if present[i].normal
                && let Some(&index) = mesh.normal_indices.get(range.start + i)
                && let Some(normal) = mesh.normals.get(3 * index as usize..3 * index as usize + 3)
            {
                let normal = DVec3::from_slice(normal);
                corner.normal = normal.normalize_or_zero().as_vec3();
            }
            if present[i].uv
                && let Some(&index) = mesh.texcoord_indices.get(range.start + i)
                && let Some(uv) = mesh
                    .texcoords
                    .get(2 * index as usize..2 * index as usize + 2)
            {
                corner.uv0 = Vec2::new(uv[0] as f32, uv[1] as f32);
            }
        }
        attributes
    }

    fn add_face(
        &mut self,
        corners: &[Corner],
        attributes: Attributes,
        object: ObjectId,
        material: MaterialId,
        is_without_material: bool,
    ) {
        let in_object = &mut self.object_faces[object.index()];
        *in_object += 1;
        let (in_file, in_object) = (self.faces, *in_object);
        self.faces += 1;
        let outcome = self
            .assembly
            .push_polygon(corners, attributes, object, material);
        match outcome {
            Outcome::Kept => {}
            Outcome::Dropped => self.dropped.add(in_file, object, in_object),
            Outcome::CutConcave => self.concave.add(in_file, object, in_object),
            Outcome::CutNonPlanar => self.non_planar.add(in_file, object, in_object),
        }
        if is_without_material {
            self.without_material.add(in_file, object, in_object);
        }
    }

    fn object(&mut self, name: &str) -> ObjectId {
        if let Some(&id) = self.objects.get(name) {
            return id;
        }
        let id = self.assembly.scene.push_object(name);
        self.objects.insert(name.to_owned(), id);
        self.object_faces.push(0);
        id
    }

    /// The material of faces that have none.
    fn grey(&mut self) -> MaterialId {
        if let Some(id) = self.grey {
            return id;
        }
        let grey = Material::diffuse("default", Reflectance::splat(0.5));
        let id = self.assembly.scene.push_material(grey);
        self.sources.push(MaterialSource {
            place: Place::file(self.file),
            reflectance_field: "Kd",
            emission_field: "Ke",
            specular_field: "Ks",
            emission_units: UnitSystem::Radiometric,
        });
        self.grey = Some(id);
        id
    }

    pub(super) fn finish(mut self, survey: &Survey) -> Part {
        self.warn_of_faces();
        let unused: HashSet<&str> = survey
            .objects
            .iter()
            .map(|object| object.name)
            .filter(|name| !name.is_empty() && !self.objects.contains_key(*name))
            .collect();
        if let Some(first) = survey.objects.iter().find(|o| unused.contains(o.name)) {
            self.warnings.push(Warning::EmptyObjects {
                count: unused.len(),
                place: Place::line(self.file, first.line),
                first: first.name.to_owned(),
            });
        }
        if survey.lines_and_points > 0 {
            self.warnings.push(Warning::LinesAndPoints {
                count: survey.lines_and_points,
                place: Place::line(self.file, survey.first_line_or_point),
            });
        }
        Part {
            scene: self.assembly.scene,
            materials: self.sources,
            warnings: self.warnings,
            units: None,
        }
    }

    fn warn_of_faces(&mut self) {
        let tallies = [
            &self.dropped,
            &self.concave,
            &self.non_planar,
            &self.without_material,
        ];
        let [dropped, concave, non_planar, without_material] = tallies.map(|tally| {
            let (in_file, object, number) = tally.first?;
            let first = FacePlace {
                place: locate::face_line(self.text, in_file).map_or_else(
                    || Place::file(self.file),
                    |line| Place::line(self.file, line),
                ),
                object: self.assembly.scene.objects[object.index()].name.clone(),
                number,
            };
            Some((tally.count, first))
        });
        let warnings = [
            dropped.map(|(count, first)| Warning::DegenerateFaces { count, first }),
            concave.map(|(count, first)| Warning::ConcaveFaces { count, first }),
            non_planar.map(|(count, first)| Warning::NonPlanarFaces { count, first }),
            without_material.map(|(count, first)| Warning::NoMaterial { count, first }),
        ];
        self.warnings.extend(warnings.into_iter().flatten());
    }
}
