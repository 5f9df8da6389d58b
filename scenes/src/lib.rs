//! Scenes for luxel: faces, materials, textures, lights and cameras; the readers that make them
//! (OBJ/MTL, glTF, scene TOML) and generators of scenes whose answer is known.
//!
//! A [`Scene`] is plain data in world space, in metres, right-handed. It knows nothing of rays,
//! patches or solving.

#![cfg_attr(
    test,
    allow(
        clippy::float_cmp,
        reason = "tests compare values that pass through unchanged"
    )
)]

mod assemble;
pub mod camera;
pub mod check;
pub mod generate;
pub mod gltf_file;
pub mod id;
pub mod light;
pub mod load;
pub mod material;
pub mod obj;
pub mod radiometry;
pub mod scene;
pub mod scene_file;
pub mod sky;
pub mod texture_file;

pub use camera::{Camera, FieldOfView, Projection};
pub use gltf_file::{GltfBytes, GltfOrigin};
pub use id::{FaceId, MaterialId, ObjectId, TextureId};
pub use light::{Light, LightKind};
pub use load::{FailureKind, LoadError, Loaded, Warning, load};
pub use material::{Material, Sidedness, Specular, Texture};
pub use radiometry::{
    Exitance, Flux, Intensity, Irradiance, Radiance, Radiosity, Reflectance, Rgb,
};
pub use scene::{Corners, Face, Object, Scene, UnitSystem};
pub use sky::Sky;
