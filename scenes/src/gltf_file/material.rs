//! Makes scene materials of glTF materials.
//!
//! | glTF | meaning here |
//! |---|---|
//! | base colour factor, texture | diffuse reflectance, at most [`WHITE`]: glTF's default is one, which no room can have |
//! | metallic ≥ 0.9, roughness ≤ 0.05, no texture of them | perfect mirror of the base colour |
//! | other metallic and roughness | diffuse |
//! | `KHR_materials_transmission` | smooth glass of the base colour, index by `KHR_materials_ior` or 1.5 |
//! | emissive factor × `KHR_materials_emissive_strength`, texture | emitted luminance in cd/m² |
//! | `doubleSided` | both sides |

use super::error::GltfError;
use super::source::Source;
use crate::id::TextureId;
use crate::load::{LoadError, MaterialSource, Place, WHITE, Warning, count_ignored};
use crate::material::{Material, Sidedness, Specular, Wrap};
use crate::radiometry::{Radiance, Reflectance, Rgb};
use crate::scene::{Scene, UnitSystem};
use crate::texture_file::{self, TextureError};
use glam::{DMat2, DVec2};
use gltf::texture::{Info, WrappingMode};
use std::collections::HashMap;

/// From here on a metal is a mirror. A real mirror is written as 1; 0.9 forgives 8-bit editors.
const MIRROR_METALLIC: f64 = 0.9;
/// Up to here a metal is smooth: the highlight of roughness 0.05 is a quarter of a degree wide.
const MIRROR_ROUGHNESS: f64 = 0.05;
/// Index of refraction of glass without `KHR_materials_ior`, as that extension says.
const GLASS_INDEX: f64 = 1.5;

/// How a material addresses its base colour texture.
#[derive(Clone, Copy, Debug)]
pub(super) struct UvMapping {
    /// The set of texture coordinates.
    pub(super) set: u32,
    linear: DMat2,
    offset: DVec2,
}

impl UvMapping {
    const IDENTITY: Self = Self {
        set: 0,
        linear: DMat2::IDENTITY,
        offset: DVec2::ZERO,
    };

    /// What `KHR_texture_transform` says.
    fn new(info: &Info) -> Self {
        let Some(transform) = info.texture_transform() else {
            return Self {
                set: info.tex_coord(),
                ..Self::IDENTITY
            };
        };
        let scale = DVec2::from(transform.scale().map(f64::from));
        // The extension's rotation is counter-clockwise in coordinates with v downwards.
        let rotation = DMat2::from_angle(-f64::from(transform.rotation()));
        Self {
            set: transform.tex_coord().unwrap_or(info.tex_coord()),
            linear: rotation * DMat2::from_diagonal(scale),
            offset: DVec2::from(transform.offset().map(f64::from)),
        }
    }

    /// Maps coordinates of the file (v downwards) to ours (v upwards).
    pub(super) fn apply(&self, uv: [f32; 2]) -> glam::Vec2 {
        let mapped = self.linear * DVec2::from(uv.map(f64::from)) + self.offset;
        DVec2::new(mapped.x, 1.0 - mapped.y).as_vec2()
    }
}

/// A scene material, with what the geometry must know of it.
pub(super) struct Converted {
    pub(super) material: Material,
    pub(super) source: MaterialSource,
    pub(super) uv: UvMapping,
}

/// Converts materials, loading each image once.
pub(super) struct Materials<'s> {
    source: &'s Source<'s>,
    textures: HashMap<(usize, Wrap), TextureId>,
    clamped: Option<Warning>,
    warnings: Vec<Warning>,
}

impl<'s> Materials<'s> {
    pub(super) fn new(source: &'s Source<'s>) -> Self {
        Self {
            source,
            textures: HashMap::new(),
            clamped: None,
            warnings: Vec::new(),
        }
    }

    /// What was put right or left out.
    pub(super) fn into_warnings(self) -> Vec<Warning> {
        self.warnings.into_iter().chain(self.clamped).collect()
    }

    fn place(&self) -> Place {
        Place::file(self.source.file)
    }

    /// Converts a material; its images go into `scene`.
    pub(super) fn convert(
        &mut self,
        material: &gltf::Material,
        scene: &mut Scene,
    ) -> Result<Converted, LoadError> {
        let place = self.place();
        let name = match (material.name(), material.index()) {
            (Some(name), _) => name.to_owned(),
            (None, Some(index)) => format!("material {index}"),
            (None, None) => "default".to_owned(),
        };
        if material.alpha_mode() != gltf::material::AlphaMode::Opaque {
            let why = "partly transparent surfaces are not supported; the surface is opaque";
            count_ignored(&mut self.warnings, "alphaMode", &place, why);
        }
        let pbr = material.pbr_metallic_roughness();
        let [r, g, b, _] = pbr.base_color_factor().map(f64::from);
        let base = Rgb::new(r, g, b);
        let base_texture = pbr.base_color_texture();
        let uv = base_texture
            .as_ref()
            .map_or(UvMapping::IDENTITY, UvMapping::new);
        let reflectance_texture = base_texture.map(|t| self.texture(&t, scene)).transpose()?;
        let emissive_texture = material.emissive_texture();
        if let Some(texture) = &emissive_texture
            && base_texture_differs(&uv, texture, reflectance_texture.is_some())
        {
            let why = "the emissive texture is addressed like the base colour's";
            count_ignored(&mut self.warnings, "emissiveTexture.texCoord", &place, why);
        }
        let emission_texture = emissive_texture
            .map(|t| self.texture(&t, scene))
            .transpose()?;
        let strength = f64::from(material.emissive_strength().unwrap_or(1.0));
        let emission = Rgb::from(material.emissive_factor().map(f64::from)) * strength;

        let transmission = material.transmission();
        let transmission = transmission.map_or(0.0, |t| f64::from(t.transmission_factor()));
        let is_mirror = f64::from(pbr.metallic_factor()) >= MIRROR_METALLIC
            && f64::from(pbr.roughness_factor()) <= MIRROR_ROUGHNESS
            && pbr.metallic_roughness_texture().is_none();
        let (diffuse, specular) = if transmission > 0.0 {
            let specular = Specular::Glass {
                index_of_refraction: material.ior().map_or(GLASS_INDEX, f64::from),
                transmittance: base * transmission,
            };
            (base * (1.0 - transmission), specular)
        } else if is_mirror {
            (Rgb::ZERO, Specular::Mirror { reflectance: base })
        } else {
            (base, Specular::None)
        };
        let material = Material {
            reflectance: self.clamp(&name, diffuse),
            name,
            reflectance_texture,
            emission: Radiance(emission),
            emission_texture,
            sidedness: if material.double_sided() {
                Sidedness::Both
            } else {
                Sidedness::Front
            },
            specular,
        };
        let source = MaterialSource {
            place,
            reflectance_field: "baseColorFactor",
            emission_field: "emissiveFactor × emissiveStrength",
            specular_field: "baseColorFactor",
            emission_units: UnitSystem::Photometric,
        };
        Ok(Converted {
            material,
            source,
            uv,
        })
    }

    /// Lowers a reflectance between [`WHITE`] and one, which glTF allows; others are checked later.
    fn clamp(&mut self, name: &str, reflectance: Rgb) -> Reflectance {
        let is_allowed = |c: f64| (0.0..=1.0).contains(&c);
        let is_high = reflectance.max_element() > WHITE;
        if !is_high || !reflectance.to_array().into_iter().all(is_allowed) {
            return Reflectance(reflectance);
        }
        if let Some(Warning::ReflectanceClamped { count, .. }) = &mut self.clamped {
            *count += 1;
        } else {
            self.clamped = Some(Warning::ReflectanceClamped {
                count: 1,
                place: self.place(),
                first: name.to_owned(),
                limit: WHITE,
            });
        }
        Reflectance(reflectance.min(Rgb::splat(WHITE)))
    }

    fn texture(&mut self, info: &Info, scene: &mut Scene) -> Result<TextureId, LoadError> {
        let texture = info.texture();
        let wrap = match texture.sampler().wrap_s() {
            WrappingMode::ClampToEdge => Wrap::Clamp,
            WrappingMode::MirroredRepeat => Wrap::Mirror,
            WrappingMode::Repeat => Wrap::Repeat,
        };
        let index = self.source.document.as_json().textures[texture.index()]
            .source
            .value();
        if let Some(&id) = self.textures.get(&(index, wrap)) {
            return Ok(id);
        }
        let (bytes, name) = self.source.image(index)?;
        let image = texture_file::decode(&bytes, &name).map_err(|source| TextureError::Decode {
            name: name.display().to_string(),
            place: self.place(),
            source: Box::new(source),
        })?;
        let name = name.display().to_string();
        let id = texture_file::push(scene, texture_file::to_texture(name, &image, wrap));
        self.textures.insert((index, wrap), id);
        Ok(id)
    }
}

/// True when a texture does not use the coordinates that the base colour texture uses.
fn base_texture_differs(base: &UvMapping, texture: &Info, has_base: bool) -> bool {
    let own = UvMapping::new(texture);
    let is_same = own.set == base.set && own.linear == base.linear && own.offset == base.offset;
    !is_same && (has_base || own.set != 0 || texture.texture_transform().is_some())
}

/// Refuses what is not a number where the format's reader lets it through.
pub(super) fn finite(
    source: &Source,
    element: &str,
    values: &[f32],
    problem: &'static str,
) -> Result<(), GltfError> {
    if values.iter().all(|value| value.is_finite()) {
        return Ok(());
    }
    Err(GltfError::Value {
        file: source.file.to_owned(),
        element: element.to_owned(),
        problem,
    })
}
