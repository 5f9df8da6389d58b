//! `[[polygon]]`: a face written in the scene file itself, for exact scenes.

use super::error::SceneFileError;
use super::settings::Settings;
use super::value::Value;
use crate::assemble::{Assembly, Attributes, Corner, Outcome};
use crate::id::{MaterialId, ObjectId};
use crate::load::UnknownName;
use crate::scene::Scene;
use std::collections::HashMap;

const KEYS: &[&str] = &["object", "material", "vertices"];

/// Adds a polygon to the scene. Faces that geometry files may have wrong are errors here, where one
/// line can be put right.
pub(super) fn read(
    value: &Value,
    settings: &Settings,
    assembly: &mut Assembly,
    materials: &HashMap<String, MaterialId>,
    objects: &mut HashMap<String, ObjectId>,
) -> Result<(), SceneFileError> {
    let table = value.table("[[polygon]]".to_owned(), KEYS)?;
    let material_value = table.require("material", "`material = \"NAME\"`")?;
    let material = find_material(&material_value, materials, &assembly.scene)?;
    let name = match table.get("object") {
        Some(name) => name.string()?,
        None => "polygons",
    };
    let vertices = table.require("vertices", "`vertices = [[x, y, z], …]`, counter-clockwise")?;
    let points = vertices
        .items("an array of [x, y, z]")?
        .iter()
        .map(Value::vector)
        .collect::<Result<Vec<_>, _>>()?;
    let object = *objects
        .entry(name.to_owned())
        .or_insert_with(|| assembly.scene.push_object(name));
    let first = assembly.scene.vertices.len();
    let corners: Vec<Corner> = (0..points.len())
        .map(|i| Corner {
            vertex: (first + i) as u32,
            ..Corner::default()
        })
        .collect();
    let metres = points.iter().map(|&point| point * settings.scale);
    assembly.scene.vertices.extend(metres);
    let outcome = assembly.push_polygon(&corners, Attributes::default(), object, material);
    let problem = match outcome {
        Outcome::Kept => return Ok(()),
        Outcome::Dropped => "has no area; give at least three corners that are not in one line",
        Outcome::CutConcave => "is not convex; write it as several convex polygons",
        Outcome::CutNonPlanar => "is not flat; write it as triangles",
    };
    let place = vertices.place();
    Err(SceneFileError::Polygon { place, problem })
}

/// The material that a value names.
pub(super) fn find_material(
    value: &Value,
    materials: &HashMap<String, MaterialId>,
    scene: &Scene,
) -> Result<MaterialId, SceneFileError> {
    let name = value.string()?;
    materials.get(name).copied().ok_or_else(|| {
        let known = scene.materials.iter().map(|m| m.name.as_str());
        SceneFileError::UnknownMaterial {
            place: value.place(),
            name: UnknownName::new(name, known),
        }
    })
}
