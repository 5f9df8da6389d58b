//! Scenes as the verbs want them.

use super::Context;
use super::exit::{ExitCode, Failure};
use luxel_scenes::{Camera, Loaded, Scene, UnitSystem, load};
use luxel_solver::world::World;
use std::path::Path;

/// Reads a scene and passes its warnings on.
pub(super) fn read(path: &Path, context: &Context<'_>) -> Result<Scene, Failure> {
    Ok(read_with_origin(path, context)?.scene)
}

/// Reads a scene with what is known of its file, and passes its warnings on.
pub(super) fn read_with_origin(path: &Path, context: &Context<'_>) -> Result<Loaded, Failure> {
    let loaded = load(path)?;
    for warning in &loaded.warnings {
        context.reporter.warning(warning);
    }
    let scene = &loaded.scene;
    context.reporter.detail(format_args!(
        "{}: {} faces, {} objects, {} lights",
        scene.name,
        scene.faces.len(),
        scene.objects.len(),
        scene.lights.len()
    ));
    if scene.faces.is_empty() {
        return Err(Failure::new(
            ExitCode::NothingToDo,
            format!("{}: the scene has no faces", path.display()),
        ));
    }
    Ok(loaded)
}

/// Refuses a scene without any light.
pub(super) fn require_light(world: &World<'_>) -> Result<(), Failure> {
    let lights = world.lights();
    let scene = world.scene();
    let emits = || {
        let mut faces = scene.face_ids();
        faces.any(|face| scene.material(face).is_emissive())
    };
    if lights.are_found_by_rays() || !lights.sources().is_empty() || emits() {
        return Ok(());
    }
    Err(Failure::new(
        ExitCode::NothingToDo,
        format!(
            "{}: nothing emits light; give a material an emission (Ke) or add a [[light]]",
            scene.name
        ),
    ))
}

/// The camera called `name`, or the first one.
pub(super) fn camera<'s>(scene: &'s Scene, name: Option<&str>) -> Result<&'s Camera, Failure> {
    let names = || {
        let names: Vec<_> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
        names.join(", ")
    };
    match name {
        None => scene.cameras.first().ok_or_else(|| {
            Failure::new(
                ExitCode::InvalidInput,
                format!(
                    "{}: the scene has no camera; add one to the scene file:\n{}",
                    scene.name,
                    suggested_camera(scene)
                ),
            )
        }),
        Some(name) => scene
            .cameras
            .iter()
            .find(|camera| camera.name == name)
            .ok_or_else(|| {
                Failure::new(
                    ExitCode::Usage,
                    format!("there is no camera {name:?}; the scene has: {}", names()),
                )
            }),
    }
}

/// A camera entry for the scene file that looks at the whole scene from outside.
fn suggested_camera(scene: &Scene) -> String {
    let (lower, upper) = scene.bounds().unwrap_or_default();
    let middle = (lower + upper) / 2.0;
    let mut position = middle;
    position.z = upper.z + 1.5 * (upper - lower).max_element();
    format!(
        "[[camera]]\nname = \"main\"\nposition = {:?}\nlook_at = {:?}\nup = [0, 1, 0]\nfov = 40\nsize = [512, 512]",
        position.to_array(),
        middle.to_array()
    )
}

/// The unit of radiance in reports.
pub(super) fn radiance_unit(units: UnitSystem) -> &'static str {
    match units {
        UnitSystem::Radiometric => "W/(m2 sr)",
        UnitSystem::Photometric => "cd/m2",
    }
}
