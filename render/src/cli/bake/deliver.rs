//! Writes the folder of a bake, each file whole or not at all and the manifest last: a folder with a manifest is complete.

use super::{Baked, Layer, mask_files, texels_per_metre};
use crate::camera::CameraFrame;
use crate::cli::exit::Failure;
use crate::files::OutputFolder;
use crate::film::Film;
use crate::image::exr::{self, Picture};
use crate::image::{Image, png};
use crate::integrators::{Samples, expose};
use crate::lightmap::bake::Finished;
use crate::lightmap::export::glb::glb;
use crate::lightmap::export::obj::obj;
use crate::lightmap::manifest::{self, Bevy, Files, Manifest, Page, Sampling, Units};
use crate::lightmap::map::Texel;
use crate::lightmap::picture;
use crate::lightmap::target::Target;
use crate::lightmap::view::LightmapView;
use crate::progress::Silent;
use crate::tone_map::ToneMap;
use glam::DVec3;
use luxel_scenes::{Camera, FieldOfView, GltfOrigin, Projection, Rgb, Scene, UnitSystem};
use luxel_solver::bounces::Bounces;
use luxel_solver::world::World;
use rayon::prelude::*;

/// Samples of a pixel of the preview, its longer side, and its size where the scene has no camera.
const PREVIEW_SAMPLES: u32 = 16;
const PREVIEW_SIDE: usize = 768;
const PREVIEW_SIZE: [usize; 2] = [768, 576];

/// What is delivered, to whom.
pub(super) struct Delivery<'a> {
    pub(super) folder: &'a OutputFolder,
    pub(super) world: &'a World<'a>,
    pub(super) origin: Option<&'a GltfOrigin>,
    pub(super) baked: &'a Baked,
    pub(super) target: Target,
    pub(super) bounces: Bounces,
    pub(super) seed: u64,
}

impl Delivery<'_> {
    /// Writes everything. Returns the manifest.
    pub(super) fn write(&self) -> Result<Manifest, Failure> {
        let scene = self.world.scene();
        let Baked { atlas, layers, .. } = self.baked;
        // An older manifest does not speak of what is written now.
        self.folder.remove("manifest.json")?;
        let mut described = Vec::new();
        for (index, layer) in layers.iter().enumerate() {
            let include = crate::cli::name(&layer.include);
            let stem = if index == 0 {
                "lightmap"
            } else {
                include.as_str()
            };
            let pages: Vec<Page> = (0..atlas.pages).map(|page| self.page(stem, page)).collect();
            self.write_maps(layer, &pages)?;
            described.push(manifest::Layer {
                include,
                pages,
                error: layer.error,
                energy: layer.energy,
                patches: layer.patches,
            });
        }
        let masks = mask_files::write(self.folder, atlas, &self.baked.masks)?;
        let mut described = described.into_iter();
        let Some(lightmap) = described.next() else {
            unreachable!("something is included");
        };
        let raw = &layers[0].maps.raw;
        for (index, page) in lightmap.pages.iter().enumerate() {
            let samples = picture::page(atlas, &self.baked.luxels.triangles, raw, index);
            self.folder
                .write(&page.charts, &png::encode_rgb8(&samples, atlas.size)?)?;
            let validity = png::encode_grey8(&raw.validity(index), atlas.size)?;
            self.folder.write(&page.validity, &validity)?;
        }
        let files = lightmap.pages.iter().map(|page| page.file.clone());
        let files: Vec<String> = files.collect();
        self.folder
            .write("scene.glb", &glb(scene, self.origin, atlas, &files)?)?;
        let (geometry, materials) = obj(scene, atlas, "scene.mtl");
        self.folder.write("scene.mtl", &materials)?;
        self.folder.write("scene.obj", &geometry)?;
        let preview = self.preview()?;
        let tone_map = ToneMap::automatic(&preview);
        self.folder
            .write("preview.png", &png::encode(&preview, tone_map)?)?;
        let exposure = f64::from(tone_map.exposure);
        let manifest = self.manifest(lightmap, described.collect(), masks, exposure);
        if let Some((name, text)) = self.target.snippet() {
            let exposure = manifest.bevy.map_or(1.0, |bevy| bevy.lightmap_exposure);
            let text = text.replace("{lightmap_exposure}", &format!("{exposure:?}"));
            self.folder.write(name, text.as_bytes())?;
        }
        let mut text = serde_json::to_string_pretty(&manifest)?;
        text.push('\n');
        self.folder.write("manifest.json", text.as_bytes())?;
        Ok(manifest)
    }

    fn page(&self, stem: &str, page: usize) -> Page {
        Page {
            file: format!("{stem}_{page:03}.exr"),
            error: format!("{stem}_{page:03}_error.exr"),
            luxels: format!("{stem}_{page:03}_luxels.exr"),
            validity: format!("atlas_{page:03}_validity.png"),
            charts: format!("atlas_{page:03}.png"),
            width: self.baked.atlas.size[0],
            height: self.baked.atlas.size[1],
        }
    }

    /// Writes the files of a set of maps.
    fn write_maps(&self, layer: &Layer, pages: &[Page]) -> Result<(), Failure> {
        let Finished { raw, map } = &layer.maps;
        let factor = if layer.include.is_light() {
            self.target.quantity().factor()
        } else {
            1.0
        };
        let scaled =
            |values: &[Rgb]| -> Vec<Rgb> { values.iter().map(|value| *value * factor).collect() };
        let (values, errors) = (scaled(&map.values), scaled(&map.errors));
        let pictures: Vec<(&str, Picture)> = pages
            .iter()
            .enumerate()
            .flat_map(|(index, page)| {
                let luxels = raw.page(index, &raw.values);
                let error = ("error".to_owned(), raw.page(index, &raw.errors));
                [
                    (
                        page.file.as_str(),
                        picture_of(map.page(index, &values), vec![]),
                    ),
                    (
                        page.error.as_str(),
                        picture_of(map.page(index, &errors), vec![]),
                    ),
                    (page.luxels.as_str(), picture_of(luxels, vec![error])),
                ]
            })
            .collect();
        pictures.par_iter().try_for_each(|(name, picture)| {
            self.folder.write(name, &exr::encode(picture)?)?;
            Ok(())
        })
    }

    /// The scene with its maps.
    fn preview(&self) -> Result<Image, Failure> {
        let (camera, size) = view_of(self.world.scene());
        let frame = CameraFrame::new(&camera, size)?;
        let view = LightmapView::new(
            self.world,
            &self.baked.atlas,
            &self.baked.layers[0].maps.map,
        );
        let samples = Samples::new(PREVIEW_SAMPLES, self.seed);
        Ok(expose(&view, &frame, samples, &Silent).mean())
    }

    fn manifest(
        &self,
        lightmap: manifest::Layer,
        others: Vec<manifest::Layer>,
        masks: Vec<manifest::Masks>,
        exposure: f64,
    ) -> Manifest {
        let Baked { atlas, .. } = self.baked;
        let map = &self.baked.layers[0].maps.map;
        let scene = self.world.scene();
        let quantity = self.target.quantity();
        Manifest {
            schema: manifest::SCHEMA,
            software: concat!("luxel ", env!("CARGO_PKG_VERSION")).into(),
            scene: scene.name.clone(),
            units: Units {
                quantity,
                unit: match scene.units {
                    UnitSystem::Radiometric => "W/m2".into(),
                    UnitSystem::Photometric => "lx".into(),
                },
                factor: quantity.factor(),
                colour_space: "linear Rec. 709".into(),
                target: self.target,
            },
            exposure,
            lightmap,
            others,
            masks,
            bounces: match self.bounces {
                Bounces::All => None,
                Bounces::AtMost(most) => Some(most),
            },
            atlas: Sampling {
                width: atlas.size[0],
                height: atlas.size[1],
                texels_per_metre: texels_per_metre(atlas, scene),
                utilisation: atlas.utilisation(scene),
                charts: atlas.charts.len(),
                padding: atlas.padding,
                lit: map.lit().count(),
                buried: map
                    .texels
                    .iter()
                    .filter(|texel| **texel == Texel::Buried)
                    .count(),
            },
            objects: manifest::objects(scene, atlas),
            files: Files {
                glb: "scene.glb".into(),
                obj: "scene.obj".into(),
                preview: "preview.png".into(),
            },
            bevy: (self.target == Target::Bevy).then(|| Bevy::new(scene.units, exposure)),
            seed: self.seed,
        }
    }
}

/// What the preview shows, from the first camera or one that sees most of the scene, and its size in pixels.
fn view_of(scene: &Scene) -> (Camera, [usize; 2]) {
    let first = scene.cameras.first().cloned();
    let camera = first.unwrap_or_else(|| overview(scene));
    let side = camera.size[0].max(camera.size[1]);
    let size = camera.size.map(|s| (s * PREVIEW_SIDE / side.max(1)).max(1));
    (camera, size)
}

/// Memory while the preview of a scene is made, in bytes.
pub(super) fn bytes_to_preview(scene: &Scene) -> usize {
    let (_, [width, height]) = view_of(scene);
    Film::bytes_to_expose(width * height) + Picture::bytes_for(width * height, 0)
}

/// A picture that needs no word on its origin: the manifest has it.
fn picture_of(image: Image, layers: Vec<(String, Image)>) -> Picture {
    Picture {
        image,
        layers,
        origin: None,
    }
}

/// A wide view through a scene from near a corner of the box around it, a little above its middle.
fn overview(scene: &Scene) -> Camera {
    let (lower, upper) = scene.bounds().unwrap_or_default();
    let (middle, size) = ((lower + upper) / 2.0, upper - lower);
    // A flat scene is looked at from above it.
    let height = size.y.max(0.5 * size.x.min(size.z));
    let away = DVec3::new(0.42 * size.x, 0.15 * height, 0.42 * size.z);
    let far = size.max_element()
        * if size.y < 0.1 * size.x.max(size.z) {
            1.0
        } else {
            0.0
        };
    Camera {
        name: "overview".into(),
        position: middle + away + DVec3::new(0.0, far, 0.0),
        look_at: middle - DVec3::new(0.1 * size.x, 0.1 * size.y, 0.1 * size.z),
        up: DVec3::Y,
        projection: Projection::Perspective {
            fov: FieldOfView::Horizontal(1.3),
        },
        size: PREVIEW_SIZE,
    }
}
