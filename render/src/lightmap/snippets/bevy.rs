// Shows a scene with the lightmaps that luxel baked for Bevy 0.19. (Before that, `WorldAssetRoot` is called `SceneRoot`, and before 0.18
// `GlobalAmbientLight` is `AmbientLight`.)
//
//   app.add_systems(Startup, load).add_systems(Update, (attach, dim));
//
// `scene.glb` and the maps lie in `assets/baked/`. KTX2 and HDR files need no feature that is not a default; EXR files need `exr`.
// Texels hold E/π; the manifest's `bevy.lightmap_exposure` belongs into every material. The maps hold all light: ambient light and the
// scene's own lights are kept from adding to it.

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
    let scene = assets.load(GltfAssetLabel::Scene(0).from_asset("baked/scene.glb"));
    commands.spawn(WorldAssetRoot(scene));
    commands.insert_resource(GlobalAmbientLight {
        affects_lightmapped_meshes: false,
        ..default()
    });
}

/// The maps' coordinates are those of whole pages: `uv_rect` stays 0 to 1. Extras stand at nodes, or at primitives of nodes that cannot
/// be divided.
fn attach(
    mut commands: Commands,
    assets: Res<AssetServer>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    said: Query<(Entity, &GltfExtras, Option<&Children>), Added<GltfExtras>>,
    meshes: Query<&MeshMaterial3d<StandardMaterial>>,
) {
    for (entity, extras, children) in &said {
        let Ok(Extras { luxel_lightmap: Some(said) }) = serde_json::from_str(&extras.value) else {
            continue;
        };
        for mesh in std::iter::once(entity).chain(children.into_iter().flatten().copied()) {
            let Ok(material) = meshes.get(mesh) else {
                continue;
            };
            if let Some(mut material) = materials.get_mut(&material.0) {
                material.lightmap_exposure = LIGHTMAP_EXPOSURE;
            }
            commands.entity(mesh).insert(Lightmap {
                image: assets.load(format!("baked/{}", said.file)),
                uv_rect: Rect::new(0.0, 0.0, 1.0, 1.0),
                ..default()
            });
        }
    }
}

/// The lights of the scene shine on what has no lightmap, and make highlights.
fn dim(
    mut points: Query<&mut PointLight, Added<PointLight>>,
    mut spots: Query<&mut SpotLight, Added<SpotLight>>,
    mut suns: Query<&mut DirectionalLight, Added<DirectionalLight>>,
) {
    points.iter_mut().for_each(|mut light| light.affects_lightmapped_mesh_diffuse = false);
    spots.iter_mut().for_each(|mut light| light.affects_lightmapped_mesh_diffuse = false);
    suns.iter_mut().for_each(|mut light| light.affects_lightmapped_mesh_diffuse = false);
}
