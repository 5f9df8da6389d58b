//! `[[camera]]`.

use super::document::Table;
use super::error::SceneFileError;
use super::settings::Settings;
use crate::camera::{Camera, FieldOfView, Projection};
use crate::load::unique_name;
use glam::DVec3;

const KEYS: &[&str] = &[
    "name", "position", "look_at", "up", "fov", "fov_axis", "height", "size",
];

/// Angle of view in degrees of a camera that gives none, that of a 38 mm lens on 35 mm film.
const FOV: f64 = 50.0;
/// Picture of a camera that gives no size.
const SIZE: [usize; 2] = [512, 512];
/// Largest width and height in pixels.
const MAX_SIZE: f64 = 65536.0;
/// Sine of the angle between view and up below which the picture has no upright: rounding of the
/// numbers in the file would turn it.
const PARALLEL: f64 = 1e-6;

/// Reads a camera; `taken` are those before it.
pub(super) fn read(
    value: &super::value::Value,
    settings: &Settings,
    taken: &[Camera],
) -> Result<Camera, SceneFileError> {
    let table = value.table("[[camera]]".to_owned(), KEYS)?;
    let is_taken = |name: &str| taken.iter().any(|camera| camera.name == name);
    let name = match table.get("name") {
        Some(value) => {
            let name = value.string()?.to_owned();
            if is_taken(&name) {
                let place = value.place();
                let kind = "camera";
                return Err(SceneFileError::NameTaken { place, kind, name });
            }
            name
        }
        None => unique_name("camera", is_taken),
    };
    let position = table
        .require("position", "`position = [x, y, z]`")?
        .vector()?;
    let look_at_value = table.require("look_at", "`look_at = [x, y, z]`")?;
    let look_at = look_at_value.vector()?;
    let up = match table.get("up") {
        Some(value) => value.vector()?,
        None => settings.up,
    };
    let view = (look_at - position).normalize_or_zero();
    if view == DVec3::ZERO {
        return Err(SceneFileError::NoDirection {
            place: look_at_value.place(),
            key: "the camera looks at its own position, so that the view",
            remedy: "move `look_at` or `position`",
        });
    }
    if view.cross(up.normalize_or_zero()).length() <= PARALLEL {
        return Err(SceneFileError::NoDirection {
            place: table
                .get("up")
                .map_or_else(|| look_at_value.place(), |up| up.place()),
            key: "`up` is zero or parallel to the view, so that the picture's upright",
            remedy: "choose another `up`",
        });
    }
    Ok(Camera {
        name,
        position: position * settings.scale,
        look_at: look_at * settings.scale,
        up: up.normalize(),
        projection: projection(&table, settings)?,
        size: size(&table)?,
    })
}

fn projection(table: &Table, settings: &Settings) -> Result<Projection, SceneFileError> {
    if let Some(height) = table.get("height") {
        for key in ["fov", "fov_axis"] {
            if let Some(value) = table.get(key) {
                let place = value.place();
                return Err(SceneFileError::Excludes {
                    place,
                    key,
                    other: "height",
                });
            }
        }
        let height = height.number_in("above 0", |x| x > 0.0)?;
        return Ok(Projection::Orthographic {
            height: height * settings.scale,
        });
    }
    let degrees = match table.get("fov") {
        Some(value) => value
            .number_in("an angle between 0 and 180 degrees, both excluded", |x| {
                x > 0.0 && x < 180.0
            })?,
        None => FOV,
    };
    let axis = match table.get("fov_axis") {
        Some(value) => value.choice(&["x", "y"])?,
        None => "x",
    };
    let radians = degrees.to_radians();
    let fov = match axis {
        "y" => FieldOfView::Vertical(radians),
        _ => FieldOfView::Horizontal(radians),
    };
    Ok(Projection::Perspective { fov })
}

fn size(table: &Table) -> Result<[usize; 2], SceneFileError> {
    let Some(value) = table.get("size") else {
        return Ok(SIZE);
    };
    let items = value.items_of(2, "[width, height]")?;
    let mut size = SIZE;
    for (pixels, item) in size.iter_mut().zip(&items) {
        let range = "a whole number of pixels from 1 to 65536";
        let is_size = |x: f64| x.fract() == 0.0 && (1.0..=MAX_SIZE).contains(&x);
        *pixels = item.number_in(range, is_size)? as usize;
    }
    Ok(size)
}
