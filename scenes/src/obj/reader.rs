//! Turns what the parser gives into faces of a scene.

use super::error::ObjError;
use super::survey::{Presence, Present, Survey};
use super::{locate, mtl};
use crate::assemble::{self, Attributes, Corner, Count, Fragment};
use crate::id::{MaterialId, ObjectId};
use crate::load::{FacePlace, LoadError, MaterialSource, Part, Place, Warning};
use crate::material::Material;
use crate::radiometry::Reflectance;
use crate::scene::{Scene, UnitSystem};
use crate::texture_file::TextureFiles;
use glam::{DVec3, Vec2};
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::path::Path;

/// Counts of faces that went in changed or not at all, and the first of each kind: its number in
/// the file, its object and its number there.
#[derive(Debug, Default)]
struct Tally {
    count: usize,
    first: Option<(usize, ObjectId, usize)>,
}

impl Tally {
    /// Adds what a run of faces counted.
    fn add(&mut self, run: &Run, counted: Count) {
        if counted.count > 0 {
            let [in_file, in_object] = [run.in_file, run.in_object + 1].map(|n| n + counted.first);
            self.first.get_or_insert((in_file, run.object, in_object));
            self.count += counted.count;
        }
    }
}

/// Faces of a model that are read at a time.
struct Run<'m> {
    mesh: &'m tobj::Mesh,
    /// Corners of each face; `None` for triangles.
    arities: Option<&'m [u32]>,
    /// Faces without those of no corners.
    faces: usize,
    /// Its first corner in the mesh.
    index: usize,
    /// Its first corner in the file.
    corner: usize,
    /// Faces before it in the file and in the object.
    in_file: usize,
    in_object: usize,
    /// The first vertex of the model.
    base: u32,
    object: ObjectId,
    material: MaterialId,
}

/// Everything that is known while models are turned into faces.
pub(super) struct Reader<'t> {
    file: &'t Path,
    text: &'t str,
    scene: Scene,
    textures: TextureFiles,
    sources: Vec<MaterialSource>,
    warnings: Vec<Warning>,
    objects: HashMap<String, ObjectId>,
    /// Faces so far of each object.
    object_faces: Vec<usize>,
    /// Faces so far in the file.
    faces: usize,
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
            scene: Scene::default(),
            textures: TextureFiles::default(),
            sources: Vec::new(),
            warnings,
            objects: HashMap::new(),
            object_faces: Vec::new(),
            faces: 0,
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
        let scene = &mut self.scene;
        let textures = &mut self.textures;
        let converted = mtl::convert(material, place, folder, scene, textures, &mut self.warnings)?;
        scene.push_material(converted.0);
        self.sources.push(converted.1);
        Ok(())
    }

    /// Adds all models. Their faces are read in parallel.
    pub(super) fn add_models(
        &mut self,
        models: &[tobj::Model],
        present: &Presence,
    ) -> Result<(), ObjError> {
        let mut runs = Vec::new();
        for model in models {
            self.add_vertices(model, &mut runs)?;
        }
        let vertices = &self.scene.vertices;
        let fragments: Vec<Fragment> = runs
            .par_iter()
            .map(|run| run.read(vertices, present))
            .collect();
        for (run, fragment) in runs.iter().zip(&fragments) {
            self.dropped.add(run, fragment.dropped);
            self.concave.add(run, fragment.concave);
            self.non_planar.add(run, fragment.non_planar);
            if Some(run.material) == self.grey {
                let (count, first) = (run.faces, 0);
                self.without_material.add(run, Count { count, first });
            }
        }
        assemble::append(&mut self.scene, fragments);
        Ok(())
    }

    /// Adds the vertices of a model and lists its faces.
    fn add_vertices<'m>(
        &mut self,
        model: &'m tobj::Model,
        runs: &mut Vec<Run<'m>>,
    ) -> Result<(), ObjError> {
        let mesh = &model.mesh;
        if mesh.indices.is_empty() {
            return Ok(());
        }
        let base = self.scene.vertices.len();
        // The parser's own counters are 32 bits wide and would wrap.
        if base + mesh.positions.len() / 3 > u32::MAX as usize
            || self.corners_read + mesh.indices.len() > u32::MAX as usize
        {
            let file = self.file.to_owned();
            return Err(ObjError::TooLarge { file });
        }
        let positions = mesh.positions.as_chunks::<3>().0;
        let vertices = &mut self.scene.vertices;
        vertices.extend(positions.iter().map(|&p| DVec3::from(p)));

        let object = self.object(&model.name);
        let material = match mesh.material_id {
            Some(index) => MaterialId::new(index),
            None => self.grey(),
        };
        let mut run = Run {
            mesh,
            arities: None,
            faces: 0,
            index: 0,
            corner: self.corners_read,
            in_file: self.faces,
            in_object: self.object_faces[object.index()],
            base: base as u32,
            object,
            material,
        };
        let mut add = |arities, faces, corners| {
            runs.push(Run {
                arities,
                faces,
                ..run
            });
            run.index += corners;
            run.corner += corners;
            run.in_file += faces;
            run.in_object += faces;
        };
        if mesh.face_arities.is_empty() {
            // The parser leaves arities out when all faces are triangles.
            for triangles in mesh.indices.chunks(3 * assemble::FACES) {
                add(None, triangles.len() / 3, triangles.len());
            }
        }
        for arities in mesh.face_arities.chunks(assemble::FACES) {
            // A bare `f` line is a face of no corners for the parser and none for the line counter.
            let faces = arities.iter().filter(|arity| **arity > 0).count();
            let corners = arities.iter().map(|&arity| arity as usize).sum();
            add(Some(arities), faces, corners);
        }
        self.corners_read = run.corner;
        self.faces = run.in_file;
        self.object_faces[object.index()] = run.in_object;
        Ok(())
    }

    fn object(&mut self, name: &str) -> ObjectId {
        if let Some(&id) = self.objects.get(name) {
            return id;
        }
        let id = self.scene.push_object(name);
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
        let id = self.scene.push_material(grey);
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
            scene: self.scene,
            materials: self.sources,
            warnings: self.warnings,
            units: None,
            origin: None,
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
                object: self.scene.objects[object.index()].name.clone(),
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

impl Run<'_> {
    fn read(&self, vertices: &[DVec3], present: &Presence) -> Fragment {
        let mut fragment = Fragment::with_capacity(self.faces);
        let mut corners = Vec::new();
        let mut first = 0;
        let count = self.arities.map_or(self.faces, <[u32]>::len);
        for face in 0..count {
            let arity = self.arities.map_or(3, |arities| arities[face] as usize);
            if arity == 0 {
                continue;
            }
            let attributes = self.fill_corners(&mut corners, present, first..first + arity);
            first += arity;
            fragment.push(vertices, &corners, attributes, (self.object, self.material));
        }
        fragment
    }

    /// Collects the corners of one face and says which attributes it has.
    fn fill_corners(
        &self,
        corners: &mut Vec<Corner>,
        present: &Presence,
        range: Range<usize>,
    ) -> Attributes {
        let mesh = self.mesh;
        let mut attributes = Attributes::default();
        corners.clear();
        for i in range {
            let at = self.index + i;
            let mut corner = Corner {
                vertex: self.base + mesh.indices[at],
                ..Corner::default()
            };
            let Present { uv, normal } = present.of(self.corner + i);
            attributes.normal |= normal;
            attributes.uv0 |= uv;
            if normal
                && let Some(&index) = mesh.normal_indices.get(at)
                && let Some(normal) = mesh.normals.get(3 * index as usize..3 * index as usize + 3)
            {
                corner.normal = DVec3::from_slice(normal).normalize_or_zero().as_vec3();
            }
            if uv
                && let Some(&index) = mesh.texcoord_indices.get(at)
                && let Some(uv) = mesh
                    .texcoords
                    .get(2 * index as usize..2 * index as usize + 2)
            {
                corner.uv0 = Vec2::new(uv[0] as f32, uv[1] as f32);
            }
            corners.push(corner);
        }
        attributes
    }
}
