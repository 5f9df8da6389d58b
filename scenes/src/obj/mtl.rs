//! Makes scene materials of what MTL files say.
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

use super::survey::split_keyword;
use crate::load::{LoadError, MaterialSource, Place, Warning, count_ignored};
use crate::material::{Material, Specular, Wrap};
use crate::radiometry::{Radiance, Reflectance, Rgb};
use crate::scene::{Scene, UnitSystem};
use crate::texture_file::TextureFiles;
use std::cmp::Ordering;
use std::path::Path;

/// Index of refraction of glass whose `Ni` is missing or that of air.
const GLASS_INDEX: f64 = 1.5;
/// Phong exponent of a highlight whose `Ns` is missing.
const EXPONENT: f64 = 10.0;

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
    use super::super::library::Libraries;
    use super::*;

    fn material(text: &str) -> Material {
        let mut libraries = Libraries::default();
        libraries
            .add_text(Path::new("a.mtl"), text)
            .expect("the library is valid");
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
    fn texture_options_are_parsed() {
        let map = MapArgument::parse("-s 1 1 1 -clamp on my wood.png");
        assert_eq!((map.file, map.wrap), ("my wood.png", Wrap::Clamp));
        assert_eq!(map.ignored_option, Some("-s"));
        assert_eq!(MapArgument::parse("wood.png").wrap, Wrap::Repeat);
    }
}
