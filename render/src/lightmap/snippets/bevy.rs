// Shows a scene with the lightmaps that luxel baked for Bevy (0.15 or later; EXR files need its feature `exr`).
//
//   app.add_systems(Startup, load).add_systems(Update, attach);
//
// `scene.glb` and the maps lie in `assets/baked/`. Texels hold E/π; the manifest's `bevy.lightmap_exposure` belongs into every
// material. The maps hold all light: spawn no ambient light, and set `affects_lightmapped_mesh_diffuse: false` on lights.

use bevy::{gltf::GltfExtras, pbr::Lightmap, prelude::*};

/// `bevy.lightmap_exposure` of manifest.json.
const LIGHTMAP_EXPOSURE: f32 = {lightmap_exposure};

#[derive(serde::Deserialize)]
struct Extras {
    luxel_lightmap: Option<Said>,
}

#[derive(serde::Deserialize)]
struct Said {
    file: String,
}

fn load(mut commands: Commands, assets: Res<AssetServer>) {
    commands.spawn(SceneRoot(assets.load(GltfAssetLabel::Scene(0).from_asset("baked/scene.glb"))));
}

/// The maps' coordinates are those of whole pages: `uv_rect` stays 0 to 1.
fn attach(
    mut commands: Commands,
    assets: Res<AssetServer>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    nodes: Query<(&GltfExtras, &Children), Added<GltfExtras>>,
    meshes: Query<&MeshMaterial3d<StandardMaterial>>,
) {
    for (extras, children) in &nodes {
        let Ok(Extras { luxel_lightmap: Some(said) }) = serde_json::from_str(&extras.value) else {
            continue;
        };
        for child in children.iter() {
            let Ok(material) = meshes.get(child) else {
                continue;
            };
            if let Some(material) = materials.get_mut(&material.0) {
                material.lightmap_exposure = LIGHTMAP_EXPOSURE;
            }
            commands.entity(child).insert(Lightmap {
                image: assets.load(format!("baked/{}", said.file)),
                uv_rect: Rect::new(0.0, 0.0, 1.0, 1.0),
                ..default()
            });
        }
    }
}
