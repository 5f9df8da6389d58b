//! Proves that Bevy loads a bake: see README.md.

mod bake;
mod snippet {
    #![allow(clippy::all)]
    include!(concat!(env!("OUT_DIR"), "/snippet.rs"));

    pub const EXPOSURE: f32 = LIGHTMAP_EXPOSURE;

    /// The app with the systems that the snippet says are to be added.
    pub fn add(app: &mut App) {
        app.add_systems(Startup, load)
            .add_systems(Update, (attach, dim));
    }
}

use bake::{Bake, half};
use bevy::asset::{AssetPlugin, LoadState, RecursiveDependencyLoadState};
use bevy::gltf::GltfExtras;
use bevy::image::{CompressedImageFormatSupport, CompressedImageFormats};
use bevy::mesh::VertexAttributeValues;
use bevy::pbr::Lightmap;
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::render_resource::TextureFormat;
use bevy::render::settings::{RenderCreation, WgpuSettings};
use std::time::{Duration, Instant};

/// A bake that takes longer to load is stuck.
const PATIENCE: Duration = Duration::from_secs(60);

fn main() {
    for (scene, format) in [
        ("furnace", "ktx2"),
        ("furnace", "hdr"),
        ("cornell", "ktx2"),
        ("pavilion", "ktx2"),
        ("pavilion", "hdr"),
        ("cornell", "bc6h"),
    ] {
        match Bake::new(scene, format) {
            Some(bake) => {
                let meshes = check(&bake);
                println!("{scene} as {format}: {meshes} meshes are as stated");
            }
            None => println!("{scene} as {format}: this luxel was built without it"),
        }
    }
}

/// An app with Bevy's loaders and systems, without a window or a graphics processor.
fn app(bake: &Bake) -> App {
    let mut app = App::new();
    // What a graphics processor of a desktop says; there is none to ask.
    app.insert_resource(CompressedImageFormatSupport(CompressedImageFormats::BC));
    let none = WgpuSettings {
        backends: None,
        ..default()
    };
    app.add_plugins(
        DefaultPlugins
            .set(AssetPlugin {
                file_path: bake.assets().to_str().expect("UTF-8").to_owned(),
                ..default()
            })
            .set(RenderPlugin {
                render_creation: RenderCreation::Automatic(Box::new(none)),
                ..default()
            }),
    );
    snippet::add(&mut app);
    app.finish();
    app.cleanup();
    app
}

/// Loads a bake and looks at everything. Returns the number of meshes.
fn check(bake: &Bake) -> usize {
    let mut app = app(bake);
    let started = Instant::now();
    while !is_loaded(&mut app) {
        assert!(started.elapsed() < PATIENCE, "it does not load");
        app.update();
        std::thread::sleep(Duration::from_millis(2));
    }
    let world = app.world_mut();
    assert_eq!(bake.stated_exposure(), bake.manifest_exposure());

    let mut lit = world.query::<(&Mesh3d, &MeshMaterial3d<StandardMaterial>, &Lightmap, &ChildOf)>();
    let lit: Vec<_> = lit
        .iter(world)
        .map(|(mesh, material, lightmap, parent)| {
            (mesh.0.clone(), material.0.clone(), lightmap.clone(), parent.parent())
        })
        .collect();
    let all = world.query::<&Mesh3d>().iter(world).count();
    assert!(all > 0 && all == lit.len(), "{} of {all} are lit", lit.len());
    for (mesh, material, lightmap, parent) in &lit {
        let said = bake::said(&world.get::<GltfExtras>(*parent).expect("extras").value);
        check_coordinates(world, bake, mesh, &said, *parent);
        let material = world.resource::<Assets<StandardMaterial>>().get(material);
        let material = material.expect("a material");
        assert_eq!(material.lightmap_exposure, snippet::EXPOSURE);
        if bake.is_made_anew() && material.metallic == 0.0 {
            assert_eq!(material.reflectance, 0.0, "matt surfaces mirror nothing");
        }
        let server = world.resource::<AssetServer>();
        let path = server.get_path(&lightmap.image).expect("a path");
        assert_eq!(path.path().to_str(), Some(format!("baked/{}", said.file).as_str()));
        assert_eq!(lightmap.uv_rect, Rect::new(0.0, 0.0, 1.0, 1.0));
        let image = world.resource::<Assets<Image>>().get(&lightmap.image);
        check_image(bake, image.expect("an image"), said.page);
    }
    check_lights(world);
    lit.len()
}

/// Whether the scene and all that it names are there.
fn is_loaded(app: &mut App) -> bool {
    let world = app.world_mut();
    let images: Vec<_> = world.query::<&Lightmap>().iter(world).map(|own| own.image.clone()).collect();
    let scenes = world.query::<&WorldAssetRoot>().iter(world).next().map(|root| root.0.clone());
    let server = world.resource::<AssetServer>();
    if let Some(RecursiveDependencyLoadState::Failed(error)) =
        scenes.and_then(|scene| server.get_recursive_dependency_load_state(&scene))
    {
        panic!("the scene: {error}");
    }
    for image in &images {
        if let LoadState::Failed(error) = server.load_state(image) {
            panic!("{:?}: {error}", server.get_path(image));
        }
    }
    !images.is_empty() && images.iter().all(|image| server.is_loaded(image))
}

/// Coordinates lie in the page, and within what the node and the manifest state of it.
fn check_coordinates(world: &World, bake: &Bake, mesh: &Handle<Mesh>, said: &bake::Said, node: Entity) {
    let mesh = world.resource::<Assets<Mesh>>().get(mesh).expect("a mesh");
    let Some(VertexAttributeValues::Float32x2(places)) = mesh.attribute(Mesh::ATTRIBUTE_UV_1) else {
        panic!("no TEXCOORD_1");
    };
    assert_eq!(places.len(), mesh.count_vertices());
    // Rectangles are those of whole texels; coordinates are rounded to 32 bits.
    for place in places {
        for axis in 0..2 {
            let inside = said.rect.min[axis] - 1e-6..=said.rect.max[axis] + 1e-6;
            assert!(inside.contains(&place[axis]), "{place:?} of {:?}", said.rect);
        }
    }
    let name = world.get::<Name>(node).map(|name| name.to_string()).unwrap_or_default();
    let stated = bake.rectangles(&name, said.page);
    let size = bake.size(said.page);
    let texels = |axis: usize, x: f32| (f64::from(x) * size[axis] as f64).round() as usize;
    let holds = |stated: &bake::Rectangle<usize>| {
        (0..2).all(|axis| {
            stated.min[axis] <= texels(axis, said.rect.min[axis])
                && texels(axis, said.rect.max[axis]) <= stated.max[axis]
        })
    };
    assert!(stated.iter().any(holds), "{name}: {:?} of {stated:?}", said.rect);
}

/// Size and format are what the manifest leads to, and texels E/π.
fn check_image(bake: &Bake, image: &Image, page: usize) {
    let [width, height] = bake.size(page);
    assert_eq!([image.width() as usize, image.height() as usize], [width, height]);
    assert_eq!(image.texture_descriptor.mip_level_count, 1);
    let data = image.data.as_ref().expect("texels");
    let (format, texels): (_, Vec<f32>) = match bake.format() {
        "ktx2" => {
            let halves = data.chunks_exact(2).map(|pair| half(u16::from_le_bytes([pair[0], pair[1]])));
            (TextureFormat::Rgba16Float, halves.collect())
        }
        "hdr" => {
            let floats = data.chunks_exact(4).map(|own| f32::from_le_bytes(own.try_into().expect("four")));
            (TextureFormat::Rgba32Float, floats.collect())
        }
        "bc6h" => (TextureFormat::Bc6hRgbUfloat, Vec::new()),
        other => panic!("{other} is not known here"),
    };
    assert_eq!(image.texture_descriptor.format, format);
    // Half a unit in the last of 11 and of 8 bits; the second of the largest channel.
    let step = if bake.format() == "hdr" { 2.0_f32.powi(-8) } else { 2.0_f32.powi(-11) };
    for (texel, irradiance) in texels.chunks_exact(4).zip(bake.master(page)) {
        let white = irradiance.map(|e| e * std::f32::consts::FRAC_1_PI);
        let largest = white.iter().copied().fold(0.0, f32::max);
        for (value, expected) in texel.iter().zip(white) {
            let bound = if bake.format() == "hdr" { largest } else { expected };
            // Rounding of the master's product with 1/π in 32 bits here, and of halves below 2⁻¹⁴.
            let bound = bound * (step + 1e-6) + 2.0_f32.powi(-25);
            assert!((value - expected).abs() <= bound, "{value} for E = {irradiance:?}");
            if bake.scene() == "furnace" {
                // E = 2π by theory; luxel's test holds it to a thousandth.
                assert!((value / 2.0 - 1.0).abs() <= 1e-3 + step, "E/π = {value}");
            }
        }
        assert_eq!(texel[3], 1.0);
    }
}

/// Nothing that the maps hold is added once more.
fn check_lights(world: &mut World) {
    assert!(!world.resource::<GlobalAmbientLight>().affects_lightmapped_meshes);
    let mut lights = world.query::<(Option<&PointLight>, Option<&SpotLight>, Option<&DirectionalLight>)>();
    for (point, spot, sun) in lights.iter(world) {
        assert!(point.is_none_or(|light| !light.affects_lightmapped_mesh_diffuse));
        assert!(spot.is_none_or(|light| !light.affects_lightmapped_mesh_diffuse));
        assert!(sun.is_none_or(|light| !light.affects_lightmapped_mesh_diffuse));
    }
}
