//! The last checks on a scene, after all files have spoken: units, materials, extent.

use super::Loaded;
use super::duplicates::drop_duplicates;
use super::error::{ExtentError, LoadError, MaterialError, MaterialProblem};
use super::part::{MaterialSource, Merged};
use super::place::Place;
use super::warning::Warning;
use crate::assemble::MAX_COORDINATE;
use crate::id::FaceId;
use crate::light::LightKind;
use crate::material::{Material, Specular};
use crate::radiometry::{Reflectance, Rgb};
use crate::scene::{Scene, UnitSystem};
use glam::DVec3;
use rayon::prelude::*;
use std::path::Path;

/// Luminous efficacy by which photometric values are divided where both systems are mixed: that of
/// monochromatic light of 540 THz (SI definition of the candela; 9th SI Brochure, 2019). What a
/// real spectrum gives is lower and not known here, so that mixing is always warned of.
const LUMENS_PER_WATT: f64 = 683.0;

/// The largest reflectance that is made of one where a format's default is one. A closed room of
/// it keeps light for 50 bounces; nearer to one would keep the solve from converging, and the
/// whitest paints (barium sulphate) reach 0.98.
pub(crate) const WHITE: f64 = 0.98;

/// Checks everything and settles the units.
pub(super) fn finish(
    mut merged: Merged,
    file: &Path,
    name: String,
    declared: Option<UnitSystem>,
) -> Result<Loaded, LoadError> {
    whiten_textured(&mut merged);
    for (material, source) in merged.scene.materials.iter().zip(&merged.materials) {
        check_material(material, source)?;
    }
    check_extent(&merged.scene, file)?;
    settle_units(&mut merged, declared);
    let Merged {
        mut scene,
        mut warnings,
        origin,
        ..
    } = merged;
    scene.name = name;
    warnings.extend(drop_duplicates(&mut scene, file));
    if scene.faces.is_empty() {
        let place = Place::file(file);
        warnings.push(Warning::NoFaces { place });
    }
    Ok(Loaded {
        scene,
        warnings,
        origin,
    })
}

/// A factor of one on an image means "as the image says", and is lowered to [`WHITE`].
fn whiten_textured(merged: &mut Merged) {
    let mut clamped: Option<Warning> = None;
    for (material, source) in merged.scene.materials.iter_mut().zip(&merged.materials) {
        let factor = material.reflectance.0;
        if material.reflectance_texture.is_none() || !is_white(factor) {
            continue;
        }
        material.reflectance = Reflectance(factor.min(Rgb::splat(WHITE)));
        if let Some(Warning::ReflectanceClamped { count, .. }) = &mut clamped {
            *count += 1;
        } else {
            clamped = Some(Warning::ReflectanceClamped {
                count: 1,
                place: source.place.clone(),
                first: material.name.clone(),
                limit: WHITE,
            });
        }
    }
    merged.warnings.extend(clamped);
}

/// True when the largest channel is exactly one.
fn is_white(factor: Rgb) -> bool {
    factor.max_element() >= 1.0 && factor.max_element() <= 1.0
}

fn check_material(material: &Material, source: &MaterialSource) -> Result<(), MaterialError> {
    let check = |field, value: Rgb, is_allowed: fn(f64) -> bool, problem| {
        if value.to_array().into_iter().all(is_allowed) {
            return Ok(());
        }
        Err(MaterialError {
            place: source.place.clone(),
            material: material.name.clone(),
            field,
            value: value.to_array(),
            problem,
        })
    };
    let is_fraction = |x: f64| (0.0..=1.0).contains(&x);
    check(
        source.reflectance_field,
        material.reflectance.0,
        |x| (0.0..1.0).contains(&x),
        MaterialProblem::Reflectance,
    )?;
    check(
        source.emission_field,
        material.emission.0,
        |x| x >= 0.0 && x.is_finite(),
        MaterialProblem::Emission,
    )?;
    match material.specular {
        Specular::None => Ok(()),
        Specular::Mirror { reflectance } => check(
            source.specular_field,
            reflectance,
            is_fraction,
            MaterialProblem::Fraction,
        ),
        Specular::Glossy {
            reflectance,
            exponent,
        } => {
            check(
                source.specular_field,
                reflectance,
                is_fraction,
                MaterialProblem::Fraction,
            )?;
            let is_exponent = |x: f64| x >= 0.0 && x.is_finite();
            check(
                "Ns",
                Rgb::splat(exponent),
                is_exponent,
                MaterialProblem::Exponent,
            )
        }
        Specular::Glass {
            index_of_refraction,
            transmittance,
        } => {
            check("Tf", transmittance, is_fraction, MaterialProblem::Fraction)?;
            let is_index = |x: f64| x > 0.0 && x.is_finite();
            let index = Rgb::splat(index_of_refraction);
            check("Ni", index, is_index, MaterialProblem::IndexOfRefraction)
        }
    }
}

fn check_extent(scene: &Scene, file: &Path) -> Result<(), ExtentError> {
    let is_far = |x: f64| x.abs() > MAX_COORDINATE || x.is_nan();
    let is_far_point = |point: &DVec3| point.to_array().into_iter().any(is_far);
    if !scene.vertices.par_iter().any(is_far_point) {
        return Ok(());
    }
    // Only vertices that faces use count.
    let is_far_vertex = |vertex: u32| is_far_point(&scene.vertices[vertex as usize]);
    let Some(corner) = scene.corners.vertex.iter().position(|&v| is_far_vertex(v)) else {
        return Ok(());
    };
    let vertex = scene.vertices[scene.corners.vertex[corner] as usize];
    let face = scene
        .faces
        .partition_point(|face| face.first_corner as usize <= corner);
    let object = scene.faces[FaceId::new(face - 1).index()].object;
    Err(ExtentError {
        file: file.to_owned(),
        object: scene.objects[object.index()].name.clone(),
        coordinate: vertex
            .to_array()
            .into_iter()
            .find(|&x| is_far(x))
            .unwrap_or(f64::NAN),
    })
}

/// Photometric where everything that shines is, else radiometric with the rest converted.
fn settle_units(merged: &mut Merged, declared: Option<UnitSystem>) {
    let mut photometric = Vec::new();
    let mut has_radiometric = false;
    let scene = &mut merged.scene;
    for (material, source) in scene.materials.iter().zip(&merged.materials) {
        if material.is_emissive() {
            match source.emission_units {
                UnitSystem::Photometric => photometric.push(material.name.clone()),
                UnitSystem::Radiometric => has_radiometric = true,
            }
        }
    }
    for (light, units) in scene.lights.iter().zip(&merged.light_units) {
        match units {
            UnitSystem::Photometric => photometric.push(light.name.clone()),
            UnitSystem::Radiometric => has_radiometric = true,
        }
    }
    scene.units = match (photometric.is_empty(), has_radiometric) {
        (false, false) => UnitSystem::Photometric,
        (_, true) => UnitSystem::Radiometric,
        (true, false) => declared.or(merged.format_units).unwrap_or_default(),
    };
    if photometric.is_empty() || !has_radiometric {
        return;
    }
    let factor = 1.0 / LUMENS_PER_WATT;
    for (material, source) in scene.materials.iter_mut().zip(&merged.materials) {
        if source.emission_units == UnitSystem::Photometric {
            material.emission = material.emission * factor;
        }
    }
    for (light, units) in scene.lights.iter_mut().zip(&merged.light_units) {
        if *units == UnitSystem::Photometric {
            scale_light(&mut light.kind, factor);
        }
    }
    merged.warnings.push(Warning::MixedUnits {
        count: photometric.len(),
        first: photometric.swap_remove(0),
    });
}

fn scale_light(kind: &mut LightKind, factor: f64) {
    match kind {
        LightKind::Point { intensity, .. }
        | LightKind::Lambertian { intensity, .. }
        | LightKind::Spot { intensity, .. } => {
            *intensity = *intensity * factor;
        }
        LightKind::Directional { irradiance, .. } => *irradiance = *irradiance * factor,
        LightKind::Sky { sky, ground, .. } => {
            *sky = sky.scaled(factor);
            *ground = *ground * factor;
        }
        LightKind::Environment { scale, .. } => *scale = *scale * factor,
    }
}
