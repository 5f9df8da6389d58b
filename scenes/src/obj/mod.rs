//! Reads OBJ geometry and MTL materials through [tobj].
//!
//! Coordinates stay f64. Objects (`o`) and groups (`g`) are objects; the last name given counts, and
//! a name that comes again continues its object. Faces of any number of corners are kept where they
//! are flat and convex. `Ke` is radiance. A file is read as UTF-8; other bytes are replaced, which
//! only names can show.

mod corners;
mod error;
mod library;
mod locate;
mod mtl;
mod pieces;
mod reader;
mod sections;
mod survey;

pub use error::{MtlError, ObjError};

use crate::load::{LoadError, Part, Place, UnknownName, read_file};
use library::Libraries;
use rayon::prelude::*;
use reader::Reader;
use std::io::Read;
use std::path::Path;
use survey::{Presence, Survey};

/// The parser's name of faces before the first `o` or `g`.
const UNNAMED: &str = "unnamed_object";

/// The line that makes the parser ask for the libraries.
const LIBRARIES: &[u8] = b"mtllib all\n";

/// Keeps polygons, gives each attribute its own index (a shared one would tear vertices apart and,
/// where only some corners have an attribute, assign it wrongly), and leaves out points and lines.
const OPTIONS: tobj::LoadOptions = tobj::LoadOptions {
    single_index: false,
    triangulate: false,
    ignore_points: true,
    ignore_lines: true,
};

/// Reads an OBJ file and the libraries and images that it names.
pub(crate) fn read(file: &Path, named_at: Option<&Place>) -> Result<Part, LoadError> {
    let text = String::from_utf8(read_file(file, named_at)?)
        .unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned());
    parse(file, &text)
}

fn parse(file: &Path, text: &str) -> Result<Part, LoadError> {
    let text = survey::join_continued(text.trim_start_matches('\u{feff}'));
    let survey = Survey::new(&text);
    let folder = file.parent().unwrap_or(Path::new(""));
    let libraries = read_libraries(file, folder, &survey)?;
    check_names(file, &survey, &libraries)?;
    if survey.has_negative_indices {
        // The parser computes with indices before it checks them, and may overflow.
        if let Some(error) = locate::bad_index(&text, file) {
            return Err(error.into());
        }
    }
    let (materials, numbers) =
        tobj::load_mtl_buf(&mut libraries.text.as_bytes()).unwrap_or_default();
    // All libraries come first and only once: a `mtllib` line may stand behind its first use.
    let library = |_: &Path| Ok((Vec::new(), numbers.clone()));
    let load = |first: &[u8], lines: &[u8]| {
        tobj::load_obj_buf(&mut first.chain(lines), &OPTIONS, library).map(|(models, _)| models)
    };
    let by_sections = sections::parse(&text, &survey.pieces, |section| load(LIBRARIES, section));
    let models = match by_sections {
        Some(models) => models,
        None => load(LIBRARIES, survey::for_parser(&text, &survey).as_bytes())
            .map_err(|source| locate::explain(&text, file, source))?,
    };
    let is_finite = |values: &[f64]| values.iter().all(|x| x.is_finite());
    if !models.par_iter().all(|m| {
        is_finite(&m.mesh.positions) && is_finite(&m.mesh.normals) && is_finite(&m.mesh.texcoords)
    }) && let Some(error) = locate::not_finite(&text, file)
    {
        return Err(error.into());
    }

    let mut reader = Reader::new(file, &text, libraries.warnings);
    for material in materials {
        let place = libraries.places.get(&material.name).cloned();
        let place = place.unwrap_or_else(|| Place::file(file));
        reader.add_material(&material, place, folder)?;
    }
    reader.add_models(&models, &Presence::new(&text, &survey))?;
    Ok(reader.finish(&survey))
}

fn read_libraries(file: &Path, folder: &Path, survey: &Survey) -> Result<Libraries, LoadError> {
    let mut libraries = Libraries::default();
    for library in &survey.libraries {
        let place = Place::line(file, library.line);
        if library.name.is_empty() {
            let keyword = "mtllib";
            return Err(ObjError::NoName { place, keyword }.into());
        }
        // One name with spaces or several names: what exists decides.
        let whole = folder.join(library.name.replace('\\', "/"));
        if whole.is_file() || !library.name.contains(char::is_whitespace) {
            libraries.add(&whole, &place)?;
        } else {
            for name in library.name.split_whitespace() {
                libraries.add(&folder.join(name), &place)?;
            }
        }
    }
    Ok(libraries)
}

/// The parser leaves faces of unknown materials without one: that would be found in the picture.
fn check_names(file: &Path, survey: &Survey, libraries: &Libraries) -> Result<(), ObjError> {
    for used in &survey.materials {
        let place = Place::line(file, used.line);
        if used.name.is_empty() {
            let keyword = "usemtl";
            return Err(ObjError::NoName { place, keyword });
        }
        if !libraries.places.contains_key(used.name) {
            let known = libraries.places.keys().map(String::as_str);
            return Err(ObjError::UnknownMaterial {
                place,
                name: UnknownName::new(used.name, known),
                libraries: libraries.files.clone(),
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
