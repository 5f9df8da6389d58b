//! Writes the folder of a bake, each file whole or not at all and the manifest last: a folder with a manifest is complete.

use super::{Baked, Layer, mask_files};
use crate::camera::CameraFrame;
use crate::cli::exit::Failure;
use crate::cli::reporter::Reporter;
use crate::files::OutputFolder;
use crate::film::Film;
use crate::image::exr::{self, Picture};
use crate::image::{Image, png};
use crate::integrators::{Samples, expose};
use crate::lightmap::atlas::Atlas;
use crate::lightmap::bake::Finished;
use crate::lightmap::cut::Weights;
use crate::lightmap::export::glb::glb;
use crate::lightmap::export::obj::obj;
use crate::lightmap::handover::{self, Common, Handover, Of, Values};
use crate::lightmap::manifest::{self, Files, Manifest, Page, Sampling};
use crate::lightmap::map::Texel;
use crate::lightmap::picture;
use crate::lightmap::view::LightmapView;
use crate::progress::Silent;
use crate::tone_map::ToneMap;
use glam::DVec3;
use luxel_scenes::{Camera, FieldOfView, GltfOrigin, Projection, Scene};
use luxel_solver::bounces::Bounces;
use luxel_solver::world::World;
use rayon::prelude::*;

/// Samples of a pixel of the preview, its longer side, and its size where the scene has no camera.
const PREVIEW_SAMPLES: u32 = 16;
const PREVIEW_SIDE: usize = 768;
const PREVIEW_SIZE: [usize; 2] = [768, 576];

/// The program and its version.
const SOFTWARE: &str = concat!("luxel ", env!("CARGO_PKG_VERSION"));

/// What is delivered, to whom.
pub(super) struct Delivery<'a> {
    pub(super) folder: &'a OutputFolder,
    pub(super) world: &'a World<'a>,
    pub(super) origin: Option<&'a GltfOrigin>,
    /// What the corners of the scene are made of, where its faces were cut.
    pub(super) corners: Option<&'a [Weights]>,
    pub(super) baked: &'a Baked,
    pub(super) handover: Handover,
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
            let of = Of {
                common: self.common(),
                include: &include,
                is_first: index == 0,
                error: layer.error.luxels,
            };
            let pages = each_page(atlas.pages, |page| self.write_page(layer, &of, page))?;
            let directional = layer.directional.as_ref();
            let directional = directional
                .map(|maps| maps.write(self.folder, of.layer(), &layer.maps.map))
                .transpose()?;
            described.push(manifest::Layer {
                directional,
                pages,
                include,
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
        // That of an older bake is of another scene.
        self.folder.remove(crate::volume::file::HEADER)?;
        let volume = self.baked.volume.as_ref();
        let volume = volume.map(|volume| volume.write(self.folder)).transpose()?;
        let files = lightmap.pages.iter().map(|page| page.file.clone());
        let files: Vec<String> = files.collect();
        self.folder.write(
            "scene.glb",
            &glb(scene, self.origin, self.corners, atlas, &files)?,
        )?;
        let (geometry, materials) = obj(scene, atlas, "scene.mtl");
        self.folder.write("scene.mtl", &materials)?;
        self.folder.write("scene.obj", &geometry)?;
        let preview = self.preview()?;
        let tone_map = ToneMap::automatic(&preview);
        self.folder
            .write("preview.png", &png::encode(&preview, tone_map)?)?;
        let exposure = f64::from(tone_map.exposure);
        let mut manifest = self.manifest(lightmap, described.collect(), masks, exposure);
        manifest.volume = volume;
        write_manifest(self.folder, self.handover, &manifest)?;
        Ok(manifest)
    }

    fn common(&self) -> Common<'_> {
        let scene = self.world.scene();
        Common {
            software: SOFTWARE,
            scene: &scene.name,
            units: scene.units,
            seed: self.seed,
        }
    }

    /// Writes the maps of a page.
    fn write_page(&self, layer: &Layer, of: &Of, page: usize) -> Result<Page, Failure> {
        let Finished { raw, map } = &layer.maps;
        let picture = |image, layers, values| Picture {
            image,
            layers,
            origin: Some(of.origin(values, page)),
        };
        let stem = of.stem(page);
        let master = map.page(page, &map.values);
        let files = self.handover.files(&master, of, page)?;
        drop(master);
        let described = write_page(self.folder, &files, &stem, map.size)?;
        let error = picture(map.page(page, &map.errors), vec![], Values::Error);
        self.folder.write(&described.error, &exr::encode(&error)?)?;
        let luxels = raw.page(page, &raw.values);
        let error = ("error".to_owned(), raw.page(page, &raw.errors));
        let luxels = picture(luxels, vec![error], Values::Luxels);
        self.folder
            .write(&described.luxels, &exr::encode(&luxels)?)?;
        Ok(described)
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
        Manifest {
            schema: manifest::SCHEMA,
            software: SOFTWARE.into(),
            scene: scene.name.clone(),
            units: self.handover.units(scene.units),
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
            bevy: self.handover.bevy(scene.units, exposure),
            volume: None,
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

/// Pages that are encoded at a time, whatever the number of threads: what a command holds does not depend on that.
pub(in crate::cli) const PAGES_AT_A_TIME: usize = 2;

/// Does something for each page, and returns what it gives in their order.
pub(in crate::cli) fn each_page<T: Send>(
    pages: usize,
    work: impl Fn(usize) -> Result<T, Failure> + Sync,
) -> Result<Vec<T>, Failure> {
    let mut all = Vec::with_capacity(pages);
    for first in (0..pages).step_by(PAGES_AT_A_TIME) {
        let some = first..(first + PAGES_AT_A_TIME).min(pages);
        let done: Result<Vec<T>, Failure> = some.into_par_iter().map(&work).collect();
        all.extend(done?);
    }
    Ok(all)
}

/// Writes what a consumer gets of a page with its master, and says what belongs to the page. The other files that it names are still to
/// be written.
pub(in crate::cli) fn write_page(
    folder: &OutputFolder,
    files: &handover::Files,
    stem: &str,
    size: [usize; 2],
) -> Result<Page, Failure> {
    for (name, bytes) in std::iter::once(&files.file).chain(&files.master) {
        folder.write(name, bytes)?;
    }
    let (_, number) = stem.rsplit_once('_').unwrap_or_default();
    Ok(Page {
        file: files.file.0.clone(),
        encoding: files.encoding.clone(),
        master: files.master_name().to_owned(),
        error: format!("{stem}_error.exr"),
        luxels: format!("{stem}_luxels.exr"),
        validity: format!("atlas_{number}_validity.png"),
        charts: format!("atlas_{number}.png"),
        width: size[0],
        height: size[1],
    })
}

/// Writes what ends a folder: the snippet, and the manifest last.
pub(in crate::cli) fn write_manifest(
    folder: &OutputFolder,
    handover: Handover,
    manifest: &Manifest,
) -> Result<(), Failure> {
    if let Some((name, text)) = handover.snippet(manifest) {
        folder.write(name, text.as_bytes())?;
    }
    let mut text = serde_json::to_string_pretty(manifest)?;
    text.push('\n');
    Ok(folder.write("manifest.json", text.as_bytes())?)
}

/// Tells what the maps' files do not hold.
pub(in crate::cli) fn tell_losses(manifest: &Manifest, reporter: &Reporter) {
    for warning in handover::warnings(manifest) {
        reporter.warning(warning);
    }
    if let Some(loss) = handover::loss(manifest) {
        reporter.note(loss);
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

/// Texels a metre, the root mean square over all surfaces that have texels.
fn texels_per_metre(atlas: &Atlas, scene: &Scene) -> f64 {
    let texels: f64 = atlas.object_texels(scene).iter().sum();
    let charted = scene.face_ids().filter(|face| atlas.chart(*face).is_some());
    let area: f64 = charted.map(|face| scene.area(face)).sum();
    if area > 0.0 {
        (texels / area).sqrt()
    } else {
        0.0
    }
}
