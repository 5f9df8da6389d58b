//! Reads scene files: TOML that names geometry files, overrides their materials, and adds cameras,
//! lights and polygons.
//!
//! ```toml
//! geometry = ["room.obj"]            # .obj, .gltf, .glb; relative to this file
//!
//! [scene]
//! name  = "room"                     # default: the file's stem
//! scale = 0.001                      # metres per unit of every length, here and in the geometry
//! up    = "z"                        # default of cameras and skies; coordinates stay as they are
//! units = "photometric"              # what Ke and `emission` are counted in, else radiometric
//!
//! [[camera]]
//! name     = "main"
//! position = [0, 1.6, 4]
//! look_at  = [0, 1.2, 0]
//! fov      = 60                      # degrees along fov_axis, "x" (default) or "y"
//! size     = [640, 480]              # or `height = 3` for an orthographic camera
//!
//! [[light]]
//! kind     = "point"                 # see `light` for the other kinds and their units
//! position = [0, 2.5, 0]
//! candela  = 800                     # or [r, g, b]
//!
//! [material.wall]
//! reflectance = [0.7, 0.6, 0.5]
//!
//! [object."lamp*"]                   # all objects whose name matches
//! material = "glow"
//! lightmap_scale = 2                 # factor on its texels a metre; 0: it gets no lightmap
//!
//! [[polygon]]
//! object   = "floor"
//! material = "wall"
//! vertices = [[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 0, 0]]   # counter-clockwise from the front
//! ```
//!
//! Keys in geometry files are overridden, never the other way round. Errors carry the line.

mod camera;
mod document;
mod error;
mod light;
mod material;
mod polygon;
mod settings;
mod sky;
mod value;

pub use error::SceneFileError;

use crate::assemble::Assembly;
use crate::camera::Projection;
use crate::id::{MaterialId, ObjectId};
use crate::light::LightKind;
use crate::load::{
    LoadError, MaterialSource, Merged, Part, Place, UnknownName, Warning, read_geometry,
};
use crate::material::Material;
use crate::radiometry::Reflectance;
use crate::scene::UnitSystem;
use crate::texture_file::TextureFiles;
use document::{Document, Table};
use glob::Pattern;
use material::Override;
use settings::Settings;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use value::Value;

const KEYS: &[&str] = &[
    "geometry", "scene", "camera", "light", "material", "object", "polygon",
];
const OBJECT_KEYS: &[&str] = &["material", "lightmap_scale"];

/// What a scene file gives: everything, not checked yet.
#[derive(Debug)]
pub(crate) struct SceneFile {
    pub(crate) merged: Merged,
    /// The name that the file gives the scene.
    pub(crate) name: Option<String>,
    /// What `Ke` and `emission` are said to be counted in.
    pub(crate) units: Option<UnitSystem>,
}

/// Reads a scene file. `opened` is a geometry file that the scene file lies beside: it is read too
/// when `geometry` does not list it.
pub(crate) fn read(file: &Path, text: &str, opened: Option<&Path>) -> Result<SceneFile, LoadError> {
    let document = Document::parse(file, text)?;
    let root = document.root(KEYS)?;
    let settings = Settings::read(&root)?;
    let mut merged = Merged::default();
    for (path, place) in geometry_files(&root, opened)? {
        let mut part = read_geometry(&path, place.as_ref())?;
        adapt(&mut part, &settings);
        merged.add(part);
    }
    let mut textures = TextureFiles::default();
    override_materials(&root, &settings, &mut merged, &mut textures)?;
    if let Some(origin) = &mut merged.origin {
        origin.changed.sort_unstable();
    }
    add_polygons(&root, &settings, &mut merged)?;
    assign_objects(&root, &mut merged)?;
    for value in tables(&root, "light")? {
        let (light, units) = light::read(&value, &settings, &mut merged.scene, &mut textures)?;
        merged.scene.lights.push(light);
        merged.light_units.push(units);
    }
    // The file's own cameras come before those of its geometry: the first is the default.
    let mut cameras = Vec::new();
    for value in tables(&root, "camera")? {
        cameras.push(camera::read(&value, &settings, &cameras)?);
    }
    for mut camera in std::mem::take(&mut merged.scene.cameras) {
        let is_taken = |name: &str| cameras.iter().any(|other| other.name == name);
        camera.name = crate::load::unique_name(&camera.name, is_taken);
        cameras.push(camera);
    }
    merged.scene.cameras = cameras;
    Ok(SceneFile {
        merged,
        name: settings.name,
        units: settings.units,
    })
}

/// The items of an array of tables, or nothing.
fn tables<'d>(root: &Table<'d>, key: &str) -> Result<Vec<Value<'d>>, SceneFileError> {
    root.get(key).map_or(Ok(Vec::new()), |value| {
        value.items("an array of tables, written with double brackets")
    })
}

/// The sections of a table of named tables, or nothing.
fn sections<'d>(root: &Table<'d>, key: &str) -> Result<Vec<Value<'d>>, SceneFileError> {
    root.get(key).map_or(Ok(Vec::new()), |value| {
        Ok(value.any_table(format!("[{key}]"))?.entries())
    })
}

/// The geometry files to read, each with the line that names it.
fn geometry_files(
    root: &Table,
    opened: Option<&Path>,
) -> Result<Vec<(PathBuf, Option<Place>)>, SceneFileError> {
    let mut files = Vec::new();
    if let Some(value) = root.get("geometry") {
        for item in value.items("an array of file names")? {
            let file = item.file()?;
            if !crate::load::is_geometry(&file) {
                return Err(SceneFileError::NotGeometry {
                    place: item.place(),
                    file: item.string()?.to_owned(),
                });
            }
            files.push((file, Some(item.place())));
        }
    }
    if let Some(opened) = opened {
        let is_same = |file: &Path| {
            file == opened
                || file
                    .canonicalize()
                    .is_ok_and(|a| opened.canonicalize().is_ok_and(|b| a == b))
        };
        if !files.iter().any(|(file, _)| is_same(file)) {
            files.insert(0, (opened.to_owned(), None));
        }
    }
    Ok(files)
}

/// Brings a part into metres and the units that the scene file declares.
fn adapt(part: &mut Part, settings: &Settings) {
    if let Some(units) = settings.units
        && part.units.is_none()
    {
        for source in &mut part.materials {
            source.emission_units = units;
        }
    }
    let scale = settings.scale;
    if let Some(origin) = &mut part.origin {
        origin.scale = scale;
    }
    let scene = &mut part.scene;
    scene
        .vertices
        .iter_mut()
        .for_each(|vertex| *vertex *= scale);
    for light in &mut scene.lights {
        if let LightKind::Point { position, .. }
        | LightKind::Lambertian { position, .. }
        | LightKind::Spot { position, .. } = &mut light.kind
        {
            *position *= scale;
        }
    }
    for camera in &mut scene.cameras {
        camera.position *= scale;
        camera.look_at *= scale;
        if let Projection::Orthographic { height } = &mut camera.projection {
            *height *= scale;
        }
    }
}

fn override_materials(
    root: &Table,
    settings: &Settings,
    merged: &mut Merged,
    textures: &mut TextureFiles,
) -> Result<(), LoadError> {
    for value in sections(root, "material")? {
        let change = Override::read(&value, settings, &mut merged.scene, textures)?;
        let mut is_known = false;
        let materials = merged.scene.materials.iter_mut().enumerate();
        for ((index, material), source) in materials.zip(&mut merged.materials) {
            if material.name == value.key() {
                is_known = true;
                if let Some(origin) = &mut merged.origin {
                    origin.changed.push(MaterialId::new(index));
                }
                change.apply(material);
                source.emission_units = change.emission_units().unwrap_or(source.emission_units);
            }
        }
        if !is_known {
            let mut material = Material::diffuse(value.key(), Reflectance::ZERO);
            change.apply(&mut material);
            merged.scene.push_material(material);
            merged.materials.push(MaterialSource {
                place: value.place(),
                reflectance_field: "reflectance",
                emission_field: "emission",
                specular_field: "mirror or glossy",
                emission_units: change.emission_units().unwrap_or_default(),
            });
        }
    }
    Ok(())
}

/// The first material of each name.
fn materials_by_name(merged: &Merged) -> HashMap<String, MaterialId> {
    let materials = merged.scene.materials.iter().enumerate().rev();
    materials
        .map(|(index, material)| (material.name.clone(), MaterialId::new(index)))
        .collect()
}

fn add_polygons(
    root: &Table,
    settings: &Settings,
    merged: &mut Merged,
) -> Result<(), SceneFileError> {
    let polygons = tables(root, "polygon")?;
    if polygons.is_empty() {
        return Ok(());
    }
    merged.origin = None;
    let materials = materials_by_name(merged);
    let mut objects: HashMap<String, ObjectId> = merged
        .scene
        .objects
        .iter()
        .enumerate()
        .map(|(index, object)| (object.name.clone(), ObjectId::new(index)))
        .collect();
    let mut assembly = Assembly {
        scene: std::mem::take(&mut merged.scene),
    };
    for value in polygons {
        polygon::read(&value, settings, &mut assembly, &materials, &mut objects)?;
    }
    merged.scene = assembly.scene;
    Ok(())
}

fn assign_objects(root: &Table, merged: &mut Merged) -> Result<(), SceneFileError> {
    let materials = materials_by_name(merged);
    for value in sections(root, "object")? {
        let table = value.table(format!("[object.\"{}\"]", value.key()), OBJECT_KEYS)?;
        let pattern = Pattern::new(value.key()).map_err(|error| SceneFileError::Pattern {
            place: value.place(),
            pattern: value.key().to_owned(),
            message: error.msg,
        })?;
        let scene = &mut merged.scene;
        let matches: Vec<bool> = scene
            .objects
            .iter()
            .map(|o| pattern.matches(&o.name))
            .collect();
        if !matches.contains(&true) {
            merged.warnings.push(Warning::NoMatch {
                place: value.place(),
                section: "object",
                name: UnknownName::new(value.key(), scene.objects.iter().map(|o| o.name.as_str())),
            });
        }
        if let Some(name) = table.get("material") {
            let material = polygon::find_material(&name, &materials, scene)?;
            for face in &mut scene.faces {
                if matches[face.object.index()] {
                    face.material = material;
                }
            }
        }
        if let Some(scale) = table.get("lightmap_scale") {
            let scale = scale.number_in("from 0 to 64", |scale| (0.0..=64.0).contains(&scale))?;
            for (object, matches) in scene.objects.iter_mut().zip(&matches) {
                if *matches {
                    object.lightmap_scale = scale;
                }
            }
        }
    }
    // A section for a material that no face has is most often a misspelt name.
    let mut is_used = vec![false; merged.scene.materials.len()];
    for face in &merged.scene.faces {
        is_used[face.material.index()] = true;
    }
    for value in sections(root, "material")? {
        let used_by_name =
            |(material, used): (&Material, &bool)| *used && material.name == value.key();
        if !merged
            .scene
            .materials
            .iter()
            .zip(&is_used)
            .any(used_by_name)
        {
            let used = merged.scene.materials.iter().zip(&is_used);
            let names = used
                .filter(|(_, used)| **used)
                .map(|(m, _)| m.name.as_str());
            merged.warnings.push(Warning::NoMatch {
                place: value.place(),
                section: "material",
                name: UnknownName::new(value.key(), names),
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
