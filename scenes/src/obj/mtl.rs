//! Reads MTL files through tobj, and makes materials of what they say.
//!
//! | MTL | meaning here |
//! |---|---|
//! | `Kd`, `map_Kd` | diffuse reflectance ρ and its image |
//! | `Ke`, `map_Ke` | emitted radiance L and its image |
//! | `illum` 0, 1 | diffuse |
//! | `illum` 2, or none | diffuse with a highlight `Ks`, `Ns` |
//! | `illum` 3, 5, 8 | diffuse and a perfect mirror of reflectance `Ks` |
//! | `illum` 4, 6, 7, 9 | clear glass of index `Ni`, transmittance `Tf`; `Kd` does not apply |
//!
//! `d` and `Tr` (opacity of a thin surface) and bump maps have no effect and give a warning.

use super::error::MtlError;
use super::survey::split_keyword;
use crate::load::{LoadError, MaterialSource, Place, Warning, count_ignored, read_file};
use crate::material::{Material, Specular, Wrap};
use crate::radiometry::{Radiance, Reflectance, Rgb};
use crate::scene::{Scene, UnitSystem};
use crate::texture_file::TextureFiles;
use std::cmp::Ordering;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Index of refraction of glass whose `Ni` is missing or that of air.
const GLASS_INDEX: f64 = 1.5;
/// Phong exponent of a highlight whose `Ns` is missing.
const EXPONENT: f64 = 10.0;

/// The libraries of one OBJ file.
#[derive(Debug, Default)]
pub(super) struct Libraries {
    /// The files, in order.
    pub(super) files: Vec<PathBuf>,
    /// Their text in the form that the parser reads, one after the other.
    pub(super) text: String,
    /// The `newmtl` line of each material.
    pub(super) places: HashMap<String, Place>,
    /// Lines that have no effect.
    pub(super) warnings: Vec<Warning>,
}

impl Libraries {
    /// Reads and checks a library that `named_at` names.
    pub(super) fn add(&mut self, file: &Path, named_at: &Place) -> Result<(), LoadError> {
        if self.files.iter().any(|known| known == file) {
            return Ok(());
        }
        let bytes = read_file(file, Some(named_at)).map_err(|error| match error {
            LoadError::Missing { file, .. } => {
                let place = named_at.clone();
                LoadError::Mtl(MtlError::Missing { file, place })
            }
            other => other,
        })?;
        self.files.push(file.to_owned());
        self.add_text(file, &String::from_utf8_lossy(&bytes))?;
        Ok(())
    }

    /// Checks a library's lines and adds them. The parser is shown one line at a time first,
    /// because it does not say in which line it failed.
    fn add_text(&mut self, file: &Path, text: &str) -> Result<(), MtlError> {
        let mut material: Option<&str> = None;
        for (index, raw) in text.lines().enumerate() {
            let place = Place::line(file, index + 1);
            let line = raw.trim().trim_start_matches('\u{feff}');
            let (keyword, rest) = split_keyword(line);
            if keyword.is_empty() || keyword.starts_with('#') {
                continue;
            }
            let syntax = |material: Option<&str>, expected: &str| MtlError::Syntax {
                place: place.clone(),
                material: material.unwrap_or_default().to_owned(),
                line: line.to_owned(),
                expected: expected.to_owned(),
            };
            if keyword == "newmtl" {
                if rest.is_empty() {
                    return Err(syntax(material, "newmtl name"));
                }
                material = Some(rest);
                if let Some(first) = self.places.insert(rest.to_owned(), place.clone()) {
                    let material = rest.to_owned();
                    return Err(MtlError::Twice {
                        place,
                        first,
                        material,
                    });
                }
            } else if material.is_none() {
                let line = line.to_owned();
                return Err(MtlError::NoMaterial { place, line });
            }
            let normal = normal_form(keyword, rest);
            let is_good = normal.as_deref().is_some_and(|normal| {
                tobj::load_mtl_buf(&mut format!("newmtl x\n{normal}").as_bytes()).is_ok()
            });
            let Some(normal) = normal.filter(|_| is_good) else {
                return Err(syntax(material, expected(keyword)));
            };
            self.note_ignored(keyword, &place);
            self.text.push_str(&normal);
            self.text.push('\n');
        }
        Ok(())
    }

    /// Counts a line that has no effect on light here.
    fn note_ignored(&mut self, keyword: &str, place: &Place) {
        let why = match keyword {
            "map_d" => "partly transparent surfaces are not supported; the surface is opaque",
            "bump" | "map_bump" | "map_Bump" | "norm" | "disp" => {
                "diffuse light is computed on the geometry itself"
            }
            "map_Ks" | "map_Ns" => "highlights are the same all over a surface",
            _ => return,
        };
        count_ignored(&mut self.warnings, keyword, place, why);
    }
}

/// A line as the parser wants it: colours need three numbers (it panics otherwise), where the format
/// allows one for grey. `None` when the line is no colour.
fn normal_form(keyword: &str, rest: &str) -> Option<String> {
    if !matches!(keyword, "Ka" | "Kd" | "Ks" | "Ke" | "Tf") {
        return Some(format!("{keyword} {rest}"));
    }
    let words: Vec<&str> = rest.split_whitespace().collect();
    if !words.iter().all(|word| word.parse::<f64>().is_ok()) {
        return None;
    }
    match words[..] {
        [grey] => Some(format!("{keyword} {grey} {grey} {grey}")),
        // Some exporters append alpha.
        [r, g, b] | [r, g, b, _] => Some(format!("{keyword} {r} {g} {b}")),
        _ => None,
    }
}

fn expected(keyword: &str) -> &'static str {
    match keyword {
        "Ka" | "Kd" | "Ks" | "Ke" | "Tf" => "keyword red green blue, linear numbers",
        "illum" => "illum number",
        "Ns" | "Ni" | "d" => "keyword number",
        _ => "keyword file",
    }
}

/// Makes a scene material, with the source that its later checks name.
pub(super) fn convert(
    mtl: &tobj::Material,
    place: Place,
    folder: &Path,
    scene: &mut Scene,
    textures: &mut TextureFiles,
    warnings: &mut Vec<Warning>,
) -> Result<(Material, MaterialSource), LoadError> {
    let mut texture = |argument: &str, warnings: &mut Vec<Warning>| {
        let map = MapArgument::parse(argument);
        if let Some(option) = map.ignored_option {
            let why = "texture options other than -clamp are not supported";
            count_ignored(warnings, option, &place, why);
        }
        textures.load(
            scene,
            &folder.join(map.file.replace('\\', "/")),
            map.wrap,
            &place,
        )
    };
    let reflectance_map = mtl.diffuse_texture.as_deref();
    let emission_map = mtl.unknown_param.get("map_Ke").map(String::as_str);
    let reflectance_texture = reflectance_map.map(|m| texture(m, warnings)).transpose()?;
    let emission_texture = emission_map.map(|m| texture(m, warnings)).transpose()?;

    // An image without a factor is not dimmed; a surface without either is black.
    let default = |has_map: bool| if has_map { Rgb::ONE } else { Rgb::ZERO };
    let emission = mtl
        .emissive
        .map_or(default(emission_texture.is_some()), Rgb::from);
    let mut reflectance = mtl
        .diffuse
        .map_or(default(reflectance_texture.is_some()), Rgb::from);
    let specular = specular(mtl);
    if matches!(specular, Specular::Glass { .. }) {
        reflectance = Rgb::ZERO;
    }
    let is_see_through = mtl.dissolve.is_some_and(|d| d < 1.0);
    if is_see_through && !matches!(specular, Specular::Glass { .. }) {
        let why = "partly transparent surfaces are not supported; the surface is opaque \
                   (glass is `illum` 4, 6 or 7)";
        count_ignored(warnings, "d", &place, why);
    }
    if mtl.diffuse.is_none()
        && reflectance_map.is_none()
        && emission == Rgb::ZERO
        && matches!(specular, Specular::None | Specular::Glossy { .. })
    {
        let why = "the material reflects nothing: it has no `Kd` and is black";
        count_ignored(warnings, "a missing Kd", &place, why);
    }
    let material = Material {
        name: mtl.name.clone(),
        reflectance: Reflectance(reflectance),
        reflectance_texture,
        emission: Radiance(emission),
        emission_texture,
        sidedness: crate::material::Sidedness::Front,
        specular,
    };
    let source = MaterialSource {
        place,
        reflectance_field: "Kd",
        emission_field: "Ke",
        specular_field: "Ks",
        emission_units: UnitSystem::Radiometric,
    };
    Ok((material, source))
}

fn specular(mtl: &tobj::Material) -> Specular {
    let reflectance = mtl.specular.map_or(Rgb::ZERO, Rgb::from);
    match mtl.illumination_model {
        Some(4 | 6 | 7 | 9) => Specular::Glass {
            index_of_refraction: mtl
                .optical_density
                .filter(|index| index.partial_cmp(&1.0) != Some(Ordering::Equal))
                .unwrap_or(GLASS_INDEX),
            transmittance: transmittance(mtl),
        },
        _ if reflectance == Rgb::ZERO => Specular::None,
        Some(3 | 5 | 8) => Specular::Mirror { reflectance },
        Some(0 | 1) => Specular::None,
        _ => Specular::Glossy {
            reflectance,
            exponent: mtl.shininess.unwrap_or(EXPONENT),
        },
    }
}

/// `Tf`, which the parser leaves as text; clear without it.
fn transmittance(mtl: &tobj::Material) -> Rgb {
    let Some(text) = mtl.unknown_param.get("Tf") else {
        return Rgb::ONE;
    };
    let mut numbers = text.split_whitespace().filter_map(|word| word.parse().ok());
    let mut next = || numbers.next().unwrap_or(1.0);
    Rgb::new(next(), next(), next())
}

/// The argument of a `map_…` line: options, then a file name that may hold spaces.
struct MapArgument<'t> {
    file: &'t str,
    wrap: Wrap,
    ignored_option: Option<&'t str>,
}

impl<'t> MapArgument<'t> {
    fn parse(argument: &'t str) -> Self {
        let mut map = Self {
            file: argument.trim(),
            wrap: Wrap::Repeat,
            ignored_option: None,
        };
        loop {
            let (option, rest) = split_keyword(map.file);
            let (count, numeric) = match option {
                "-clamp" | "-blendu" | "-blendv" | "-cc" | "-imfchan" | "-type" => (1, false),
                "-bm" | "-boost" | "-texres" => (1, true),
                "-mm" => (2, true),
                "-o" | "-s" | "-t" => (3, true),
                _ => return map,
            };
            let mut rest = rest;
            for _ in 0..count {
                let (word, after) = split_keyword(rest);
                if after.is_empty() || (numeric && word.parse::<f64>().is_err()) {
                    break;
                }
                if option == "-clamp" && word == "on" {
                    map.wrap = Wrap::Clamp;
                }
                rest = after;
            }
            if option != "-clamp" {
                map.ignored_option = map.ignored_option.or(Some(option));
            }
            map.file = rest;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn library(text: &str) -> Result<Libraries, MtlError> {
        let mut libraries = Libraries::default();
        libraries.add_text(Path::new("a.mtl"), text)?;
        Ok(libraries)
    }

    fn material(text: &str) -> Material {
        let libraries = library(text).expect("the library is valid");
        let (materials, _) =
            tobj::load_mtl_buf(&mut libraries.text.as_bytes()).expect("the parser reads it");
        let mut scene = Scene::default();
        let mut textures = TextureFiles::default();
        let place = Place::file(Path::new("a.mtl"));
        let folder = Path::new("");
        let mut warnings = Vec::new();
        convert(
            &materials[0],
            place,
            folder,
            &mut scene,
            &mut textures,
            &mut warnings,
        )
        .expect("the material is valid")
        .0
    }

    #[test]
    fn diffuse_and_emission_are_read_in_f64() {
        let m = material("newmtl a\nKd 0.1 0.2 0.3\nKe 17 12 4\n");
        assert_eq!(m.reflectance, Reflectance::new(0.1, 0.2, 0.3));
        assert_eq!(m.emission, Radiance::new(17.0, 12.0, 4.0));
        assert_eq!(m.specular, Specular::None);
    }

    #[test]
    fn one_number_is_grey() {
        assert_eq!(
            material("newmtl a\nKd 0.5\n").reflectance,
            Reflectance::splat(0.5)
        );
    }

    #[test]
    fn illumination_models_decide_the_specular_part() {
        let mirror = material("newmtl a\nKd 0 0 0\nKs 0.9 0.9 0.9\nillum 3\n");
        assert_eq!(
            mirror.specular,
            Specular::Mirror {
                reflectance: Rgb::splat(0.9)
            }
        );
        let glass = material("newmtl a\nKd 0.8 0.8 0.8\nNi 1.33\nTf 0.9 1 1\nillum 7\n");
        assert_eq!(glass.reflectance, Reflectance::ZERO);
        let Specular::Glass {
            index_of_refraction,
            transmittance,
        } = glass.specular
        else {
            panic!("illum 7 is glass, not {:?}", glass.specular);
        };
        assert_eq!(
            (index_of_refraction, transmittance),
            (1.33, Rgb::new(0.9, 1.0, 1.0))
        );
        let glossy = material("newmtl a\nKd 0.5 0.5 0.5\nKs 0.2 0.2 0.2\nNs 50\nillum 2\n");
        let reflectance = Rgb::splat(0.2);
        assert_eq!(
            glossy.specular,
            Specular::Glossy {
                reflectance,
                exponent: 50.0
            }
        );
        let matte = material("newmtl a\nKd 0.5 0.5 0.5\nKs 0.2 0.2 0.2\nillum 1\n");
        assert_eq!(matte.specular, Specular::None);
    }

    #[test]
    fn bad_lines_are_named() {
        for (text, start) in [
            (
                "newmtl a\nKd 0.1 0.2\n",
                "a.mtl:2: `Kd 0.1 0.2` (material `a`)",
            ),
            ("newmtl a\nKd red\n", "a.mtl:2: "),
            ("newmtl a\nKd spectral file.rfl\n", "a.mtl:2: "),
            ("newmtl a\n\nillum bright\n", "a.mtl:3: "),
            ("newmtl a\nNs\n", "a.mtl:2: "),
            ("newmtl\n", "a.mtl:1: "),
            ("Kd 1 1 1\n", "a.mtl:1: `Kd 1 1 1` stands before"),
            (
                "newmtl a\nnewmtl a\n",
                "a.mtl:2: material `a` is already defined at a.mtl:1",
            ),
        ] {
            let error = library(text).expect_err(text).to_string();
            assert!(error.starts_with(start), "{error}");
        }
    }

    #[test]
    fn what_has_no_effect_is_counted() {
        let libraries = library("newmtl a\nmap_bump a.png\nnewmtl b\nmap_bump b.png\n")
            .expect("bump maps are no error");
        assert!(matches!(
            libraries.warnings[..],
            [Warning::Ignored { count: 2, .. }]
        ));
    }

    #[test]
    fn texture_options_are_parsed() {
        let map = MapArgument::parse("-s 1 1 1 -clamp on my wood.png");
        assert_eq!((map.file, map.wrap), ("my wood.png", Wrap::Clamp));
        assert_eq!(map.ignored_option, Some("-s"));
        assert_eq!(MapArgument::parse("wood.png").wrap, Wrap::Repeat);
    }
}
