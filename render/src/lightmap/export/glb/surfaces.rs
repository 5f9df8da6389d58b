//! Materials and textures of a scene as those of glTF, with the reader's table backwards.
//!
//! | scene | glTF |
//! |---|---|
//! | diffuse reflectance, texture | base colour of a rough surface that is no metal, `KHR_materials_specular` of 0 |
//! | mirror | base colour of a smooth metal |
//! | glass | `KHR_materials_transmission`, `KHR_materials_ior` |
//! | emission up to one, above | emissive factor, times `KHR_materials_emissive_strength` |
//! | both sides | `doubleSided` |
//!
//! Emission keeps the unit that the scene counts in, so that it agrees with the maps. Textures become PNG in 8-bit sRGB; one with
//! values above one is divided by its largest, by which factors are multiplied. Highlights of Phong's kind have no like and are left out.
//! The format's surfaces mirror 4 % of what comes from ahead and reflect the less of it diffusely, unless `specularFactor` is 0: matt ones
//! have to say so, or are shown darker than they are baked. Readers that do not know the extension show them as before.
//! Sources: glTF 2.0, chapter 3.9 and appendix B; `KHR_materials_specular`; IEC 61966-2-1 (sRGB). Cost: linear in the texels.

use super::GlbError;
use super::document::{Document, child_mut, set};
use crate::tone_map::ToneMap;
use image::ImageEncoder;
use image::codecs::png::PngEncoder;
use luxel_scenes::material::Wrap;
use luxel_scenes::{Material, MaterialId, Rgb, Scene, Sidedness, Specular, TextureId};
use serde_json::{Value, json};

const STRENGTH: &str = "KHR_materials_emissive_strength";
const TRANSMISSION: &str = "KHR_materials_transmission";
const REFRACTION: &str = "KHR_materials_ior";
const GLOSS: &str = "KHR_materials_specular";

/// The scene's materials and textures that a document has so far.
pub(super) struct Surfaces<'s> {
    scene: &'s Scene,
    materials: Vec<Option<usize>>,
    textures: Vec<Option<Written>>,
}

/// A texture in the document.
#[derive(Clone, Copy)]
struct Written {
    index: usize,
    /// What its values are to be multiplied by, at least one.
    factor: f64,
}

impl<'s> Surfaces<'s> {
    /// Begins with none.
    pub(super) fn new(scene: &'s Scene) -> Self {
        Self {
            scene,
            materials: vec![None; scene.materials.len()],
            textures: vec![None; scene.textures.len()],
        }
    }

    /// The document's index of a material, which is added when it is not there yet.
    pub(super) fn material(
        &mut self,
        document: &mut Document,
        id: MaterialId,
    ) -> Result<usize, GlbError> {
        if let Some(index) = self.materials[id.index()] {
            return Ok(index);
        }
        let material = &self.scene.materials[id.index()];
        let mut value = json!({"name": material.name});
        let reflectance = material.reflectance_texture;
        let reflectance = reflectance
            .map(|id| self.texture(document, id))
            .transpose()?;
        let emission = material.emission_texture;
        let emission = emission.map(|id| self.texture(document, id)).transpose()?;
        let factor = |written: Option<Written>| written.map_or(1.0, |w| w.factor);
        colour(&mut value, material, factor(reflectance));
        emit(document, &mut value, material.emission.0 * factor(emission));
        sides(&mut value, material);
        let shine = child_mut(&mut value, "pbrMetallicRoughness");
        if let Some(Written { index, .. }) = reflectance {
            set(shine, "baseColorTexture", json!({"index": index}));
        }
        let is_mirror = matches!(material.specular, Specular::Mirror { .. });
        set(shine, "metallicFactor", u8::from(is_mirror));
        set(shine, "roughnessFactor", u8::from(!is_mirror));
        if let Some(Written { index, .. }) = emission {
            set(&mut value, "emissiveTexture", json!({"index": index}));
        }
        if material.specular == Specular::None {
            let extensions = child_mut(&mut value, "extensions");
            set(extensions, GLOSS, json!({"specularFactor": 0.0}));
            document.use_extension(GLOSS);
        }
        if let Specular::Glass {
            index_of_refraction,
            transmittance,
        } = material.specular
        {
            let whole = (transmittance + material.reflectance.0).element_sum();
            let share = transmittance.element_sum() / whole.max(f64::MIN_POSITIVE);
            let extensions = child_mut(&mut value, "extensions");
            set(
                extensions,
                TRANSMISSION,
                json!({"transmissionFactor": share}),
            );
            set(extensions, REFRACTION, json!({"ior": index_of_refraction}));
            document.use_extension(TRANSMISSION);
            document.use_extension(REFRACTION);
        }
        let index = document.push("materials", value);
        self.materials[id.index()] = Some(index);
        Ok(index)
    }

    fn texture(&mut self, document: &mut Document, id: TextureId) -> Result<Written, GlbError> {
        if let Some(written) = self.textures[id.index()] {
            return Ok(written);
        }
        let texture = &self.scene.textures[id.index()];
        let values = texture.texels.iter().flatten();
        let largest = values
            .copied()
            .filter(|x| x.is_finite())
            .fold(1.0, f32::max);
        let encode = ToneMap {
            exposure: 1.0 / largest,
        };
        let pixels: Vec<u8> = texture
            .texels
            .iter()
            .flat_map(|&t| encode.apply(t))
            .collect();
        let mut png = Vec::new();
        PngEncoder::new(&mut png)
            .write_image(
                &pixels,
                texture.width as u32,
                texture.height as u32,
                image::ExtendedColorType::Rgb8,
            )
            .map_err(|source| GlbError::Texture {
                name: texture.name.clone(),
                source,
            })?;
        let view = document.view(&png, json!({}));
        let image = json!({"name": texture.name, "bufferView": view, "mimeType": "image/png"});
        let image = document.push("images", image);
        let wrap = match texture.wrap {
            Wrap::Repeat => 10497,
            Wrap::Mirror => 33648,
            Wrap::Clamp => 33071,
        };
        let sampler = json!({"magFilter": 9729, "minFilter": 9987, "wrapS": wrap, "wrapT": wrap});
        let known = document
            .items("samplers")
            .iter()
            .position(|s| *s == sampler);
        let sampler = known.unwrap_or_else(|| document.push("samplers", sampler));
        let index = document.push("textures", json!({"sampler": sampler, "source": image}));
        let written = Written {
            index,
            factor: f64::from(largest),
        };
        self.textures[id.index()] = Some(written);
        Ok(written)
    }
}

/// Gives a material of the document the factors and sides that a scene file gave it; textures stay.
pub(super) fn change(document: &mut Document, index: usize, material: &Material) {
    let mut value = document.items("materials")[index].clone();
    colour(&mut value, material, 1.0);
    emit(document, &mut value, material.emission.0);
    sides(&mut value, material);
    document.items_mut("materials")[index] = value;
}

/// Sets the base colour, of which opacity stays as it is.
fn colour(value: &mut Value, material: &Material, factor: f64) {
    let base = match material.specular {
        Specular::Mirror { reflectance } => reflectance,
        Specular::Glass { transmittance, .. } => transmittance + material.reflectance.0,
        Specular::None | Specular::Glossy { .. } => material.reflectance.0,
    };
    let base = (base * factor).min(Rgb::ONE);
    let shine = child_mut(value, "pbrMetallicRoughness");
    let opacity = shine.pointer("/baseColorFactor/3").cloned();
    let opacity = opacity.unwrap_or(json!(1.0));
    set(
        shine,
        "baseColorFactor",
        json!([base.x, base.y, base.z, opacity]),
    );
}

/// Sets the emission.
fn emit(document: &mut Document, value: &mut Value, emission: Rgb) {
    let strength = emission.max_element().max(1.0);
    let factor = (emission / strength).to_array();
    if let Some(extensions) = value.get_mut("extensions").and_then(Value::as_object_mut) {
        extensions.remove(STRENGTH);
    }
    set(value, "emissiveFactor", json!(factor));
    if strength > 1.0 {
        let extensions = child_mut(value, "extensions");
        set(extensions, STRENGTH, json!({"emissiveStrength": strength}));
        document.use_extension(STRENGTH);
    }
}

fn sides(value: &mut Value, material: &Material) {
    set(value, "doubleSided", material.sidedness == Sidedness::Both);
}
