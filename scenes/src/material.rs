//! What surfaces are made of.

use crate::id::TextureId;
use crate::radiometry::{Radiance, Reflectance, Rgb};
use glam::DVec2;

/// Which sides of a face emit and reflect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Sidedness {
    /// The front (counter-clockwise) side only; the back is black.
    #[default]
    Front,
    /// Both sides, each with its own light.
    Both,
}

/// What a surface does with light besides diffuse reflection. Radiosity and the gather see the
/// diffuse part; the Whitted and path integrators see all of it.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Specular {
    /// Nothing.
    #[default]
    None,
    /// A perfect mirror of the given reflectance.
    Mirror {
        /// Fraction reflected, per channel.
        reflectance: Rgb,
    },
    /// A smooth dielectric boundary: Fresnel reflection and refraction.
    Glass {
        /// Index of refraction of the inside over the outside.
        index_of_refraction: f64,
        /// Fraction transmitted besides Fresnel's factor, per channel.
        transmittance: Rgb,
    },
    /// A glossy highlight of point and spot lights (Phong and Blinn–Phong, Whitted only).
    Glossy {
        /// Strength of the highlight, per channel (`Ks`).
        reflectance: Rgb,
        /// Phong exponent (`Ns`).
        exponent: f64,
    },
}

/// A named material.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Its name in the file.
    pub name: String,
    /// Diffuse reflectance ρ; multiplied with `reflectance_texture` where there is one.
    pub reflectance: Reflectance,
    /// Image that modulates the reflectance, addressed by the first UV set.
    pub reflectance_texture: Option<TextureId>,
    /// Emitted radiance L, the same in all directions of the emitting side.
    pub emission: Radiance,
    /// Image that modulates the emission, addressed by the first UV set.
    pub emission_texture: Option<TextureId>,
    /// Which sides emit and reflect.
    pub sidedness: Sidedness,
    /// What else the surface does.
    pub specular: Specular,
}

impl Material {
    /// A one-sided diffuse material that does not emit.
    pub fn diffuse(name: impl Into<String>, reflectance: Reflectance) -> Self {
        Self {
            name: name.into(),
            reflectance,
            reflectance_texture: None,
            emission: Radiance::ZERO,
            emission_texture: None,
            sidedness: Sidedness::Front,
            specular: Specular::None,
        }
    }

    /// The same material emitting radiance L (W/(m² sr)).
    #[must_use]
    pub fn with_emission(mut self, emission: Radiance) -> Self {
        self.emission = emission;
        self
    }

    /// True when any channel emits.
    pub fn is_emissive(&self) -> bool {
        self.emission.0.max_element() > 0.0
    }
}

/// How a texture continues outside [0, 1]².
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Hash)]
pub enum Wrap {
    /// Repeats.
    #[default]
    Repeat,
    /// Repeats, every second copy mirrored.
    Mirror,
    /// Keeps the border's value.
    Clamp,
}

/// A linear RGB image. `texels` is row-major, first row at v = 1 (the top of the picture), so that
/// v grows upwards as in OBJ; readers of formats with v downwards flip their coordinates once.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// File name or name in the file.
    pub name: String,
    /// Width in texels.
    pub width: usize,
    /// Height in texels.
    pub height: usize,
    /// Linear values, `width * height` of them.
    pub texels: Vec<[f32; 3]>,
    /// What happens outside the unit square.
    pub wrap: Wrap,
}

impl Texture {
    /// The value at `uv`, bilinear between texel centres.
    pub fn sample(&self, uv: DVec2) -> Rgb {
        let x = uv.x * self.width as f64 - 0.5;
        let y = (1.0 - uv.y) * self.height as f64 - 0.5;
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let at = |dx: f64, dy: f64| {
            let column = wrap_index((x0 + dx) as i64, self.width, self.wrap);
            let row = wrap_index((y0 + dy) as i64, self.height, self.wrap);
            let [r, g, b] = self.texels[row * self.width + column];
            Rgb::new(f64::from(r), f64::from(g), f64::from(b))
        };
        let top = at(0.0, 0.0).lerp(at(1.0, 0.0), fx);
        let bottom = at(0.0, 1.0).lerp(at(1.0, 1.0), fx);
        top.lerp(bottom, fy)
    }
}

/// The texel that coordinate `i` stands for in a row of `size` texels.
#[expect(
    clippy::cast_possible_wrap,
    reason = "an image has fewer than 2^63 texels a side"
)]
fn wrap_index(i: i64, size: usize, wrap: Wrap) -> usize {
    let n = size as i64;
    let index = match wrap {
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::Clamp => i.clamp(0, n - 1),
        Wrap::Mirror => {
            let folded = i.rem_euclid(2 * n);
            folded.min(2 * n - 1 - folded)
        }
    };
    index as usize
}
