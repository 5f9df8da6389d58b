//! Reads the primitives of all objects and puts their triangles into the scene, both in parallel.

use super::error::GltfError;
use super::material::UvMapping;
use super::origin::VertexOrigin;
use super::primitive::{self, Geometry};
use super::source::Source;
use crate::assemble::{self, Fragment};
use crate::id::{MaterialId, ObjectId};
use crate::load::LoadError;
use crate::scene::Scene;
use glam::DMat4;
use rayon::prelude::*;

/// A primitive at a node.
pub(super) struct Primitive<'s> {
    pub(super) object: ObjectId,
    pub(super) material: MaterialId,
    pub(super) node: usize,
    pub(super) mesh: gltf::Mesh<'s>,
    pub(super) content: gltf::Primitive<'s>,
    /// To the world.
    pub(super) transform: DMat4,
}

/// What was left out, counted, and where the rest comes from.
#[derive(Debug, Default)]
pub(super) struct Tally {
    pub(super) dropped: usize,
    /// Object and number of the first dropped face.
    pub(super) first_dropped: Option<(String, usize)>,
    pub(super) lines_and_points: usize,
    pub(super) empty_objects: Vec<String>,
    /// Where the vertices come from.
    pub(super) origins: Vec<VertexOrigin>,
}

/// Triangles of a primitive that are put in at a time.
struct Run<'g> {
    geometry: &'g Geometry,
    triangles: &'g [[u32; 3]],
    /// Triangles of the object before them.
    number: usize,
    /// The first vertex of the geometry in the scene.
    base: u32,
    object: ObjectId,
    material: MaterialId,
}

/// Adds primitives, which come object by object, to a scene that has their objects. Objects without
/// faces are taken out of it.
pub(super) fn add(
    source: &Source,
    scene: &mut Scene,
    primitives: &[Primitive],
    uvs: &[UvMapping],
) -> Result<Tally, LoadError> {
    let mut tally = Tally::default();
    let read: Vec<Result<Option<Geometry>, GltfError>> = primitives
        .par_iter()
        .map(|primitive| {
            let Primitive {
                mesh,
                content,
                transform,
                material,
                ..
            } = primitive;
            primitive::read(source, mesh, content, transform, &uvs[material.index()])
        })
        .collect();
    let mut geometries = Vec::with_capacity(read.len());
    for (primitive, geometry) in primitives.iter().zip(read) {
        match geometry? {
            Some(geometry) => geometries.push((primitive, geometry)),
            None => tally.lines_and_points += 1,
        }
    }

    let sum =
        |count: fn(&Geometry) -> usize| geometries.iter().map(|(_, g)| count(g)).sum::<usize>();
    let (vertices, corners) = (sum(|g| g.positions.len()), sum(|g| 3 * g.triangles.len()));
    if vertices.max(corners) > u32::MAX as usize {
        let file = source.file.to_owned();
        return Err(GltfError::TooLarge { file }.into());
    }
    scene.vertices.reserve(vertices);
    let mut numbers = vec![0; scene.objects.len()];
    let mut runs = Vec::new();
    for (primitive, geometry) in &geometries {
        let base = scene.vertices.len() as u32;
        scene.vertices.extend_from_slice(&geometry.positions);
        tally.origins.push(VertexOrigin {
            vertices: base..scene.vertices.len() as u32,
            node: primitive.node as u32,
            primitive: primitive.content.index() as u32,
            is_mirrored: primitive::is_mirrored(&primitive.transform),
        });
        let number = &mut numbers[primitive.object.index()];
        for triangles in geometry.triangles.chunks(assemble::FACES) {
            runs.push(Run {
                geometry,
                triangles,
                number: *number,
                base,
                object: primitive.object,
                material: primitive.material,
            });
            *number += triangles.len();
        }
    }
    let vertices = &scene.vertices;
    let mut fragments: Vec<Fragment> = runs.par_iter().map(|run| run.read(vertices)).collect();

    let mut faces = vec![0; scene.objects.len()];
    for (run, fragment) in runs.iter().zip(&fragments) {
        faces[run.object.index()] += fragment.faces.len();
        let dropped = fragment.dropped;
        if dropped.count > 0 {
            let name = &scene.objects[run.object.index()].name;
            let number = run.number + dropped.first + 1;
            tally
                .first_dropped
                .get_or_insert_with(|| (name.clone(), number));
            tally.dropped += dropped.count;
        }
    }
    tally.empty_objects = take_out_empty(scene, &mut fragments, &faces);
    assemble::append(scene, fragments);
    Ok(tally)
}

impl Run<'_> {
    fn read(&self, vertices: &[glam::DVec3]) -> Fragment {
        let mut fragment = Fragment::with_capacity(self.triangles.len());
        let attributes = self.geometry.attributes();
        for &triangle in self.triangles {
            let corners = self.geometry.corners(triangle, self.base);
            fragment.push(vertices, &corners, attributes, (self.object, self.material));
        }
        fragment
    }
}

/// Takes objects without faces out of a scene and gives the others numbers without gaps. Returns the
/// names of those taken out.
fn take_out_empty(scene: &mut Scene, fragments: &mut [Fragment], faces: &[usize]) -> Vec<String> {
    if faces.iter().all(|&count| count > 0) {
        return Vec::new();
    }
    let mut empty = Vec::new();
    let mut moved = Vec::with_capacity(faces.len());
    for (object, &count) in std::mem::take(&mut scene.objects).into_iter().zip(faces) {
        moved.push(ObjectId::new(scene.objects.len()));
        if count > 0 {
            scene.objects.push(object);
        } else {
            empty.push(object.name);
        }
    }
    for face in fragments
        .iter_mut()
        .flat_map(|fragment| &mut fragment.faces)
    {
        face.object = moved[face.object.index()];
    }
    empty
}
