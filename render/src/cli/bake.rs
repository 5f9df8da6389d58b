//! `luxel bake`: lightmaps.

use super::exit::{ExitCode, Failure};
use super::footprint::{Footprint, held_back, larger_error};
use super::memory;
use super::scene;
use super::stated::StatedError;
use super::steering::{Steering, first_error};
use super::{Context, Session};
use crate::files::Output;
use crate::image::exr::{self, Picture};
use crate::integrators::{Samples, expose};
use crate::lightmap::atlas::Atlas;
use crate::lightmap::bake::{self, BakeConfig, Luxels};
use crate::lightmap::dilation::dilate;
use crate::lightmap::map::Lightmap;
use crate::lightmap::seams;
use crate::lightmap::unwrap::{Density, UnwrapConfig, Unwrapper, UvUnwrap};
use crate::lightmap::view::LightmapView;
use crate::progress::{Progress, Silent};
use luxel_scenes::Scene;
use luxel_solver::adaptive::{self, AdaptiveConfig, Ending};
use luxel_solver::gather::Components;
use luxel_solver::world::World;
use std::path::PathBuf;

/// Bake the light of a scene into textures
#[derive(clap::Args)]
pub(super) struct Bake {
    /// Scene file (.toml), or geometry (.obj, .gltf, .glb)
    scene: PathBuf,

    /// Folder to write to; it is made when it does not exist
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,

    /// Texels along each side of a page, a multiple of 4 [default: as many as 16 texels a metre need, 256 to 1024]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(16..=16384))]
    size: Option<u32>,

    /// Texels a metre, on as many pages as are needed [default: as fine as one page allows]
    #[arg(long, value_name = "F")]
    texels_per_metre: Option<f64>,

    /// Texels around each chart: charts are at least twice as many apart
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=64))]
    padding: u32,
}

impl Bake {
    pub(super) fn run(self, session: &mut Session<'_>) -> Result<ExitCode, Failure> {
        let scene = scene::read(&self.scene, &session.context)?;
        std::fs::create_dir_all(&self.output).map_err(|e| Failure::new(ExitCode::Failure, e))?;
        let context = &session.context;
        let goal = context.common.goal(context.started);
        Footprint::to_prepare(&scene).require(context, || None)?;
        context.common.install(|| -> Result<(), Failure> {
            let world = World::new(&scene);
            scene::require_light(&world)?;
            let t = std::time::Instant::now();
            let config = UnwrapConfig {
                density: Density::Page(self.size.unwrap_or(512) as usize),
                padding: self.padding as usize,
                block_align: false,
                object_scale: vec![1.0; scene.objects.len()],
            };
            let atlas = UvUnwrap.unwrap(&scene, &config, &|_, _| true)?;
            eprintln!(
                "unwrap {:?} {} charts, use {:.3}",
                t.elapsed(),
                atlas.charts.len(),
                atlas.utilisation(&scene)
            );
            let t = std::time::Instant::now();
            let luxels = Luxels::new(&world, &atlas, 0.5);
            eprintln!(
                "luxels {:?} {} buried {}",
                t.elapsed(),
                luxels.lit.luxels.len(),
                luxels.lit.buried.len()
            );
            let t = std::time::Instant::now();
            let bake_config = BakeConfig {
                gather: AdaptiveConfig {
                    error: first_error(Some(&goal)),
                    components: Components::All,
                    most_patches: usize::MAX,
                    seed: context.common.seed,
                },
                backface_tolerance: 0.5,
            };
            let mut steering = Steering::new(context, Some(&goal));
            let Some(baked) = bake::bake(&world, &luxels, &bake_config, &mut steering)? else {
                return Ok(());
            };
            eprintln!(
                "bake {:?} parts {:?} budget {:?}",
                t.elapsed(),
                baked.adaptive.parts,
                baked.adaptive.budget
            );
            let t = std::time::Instant::now();
            let mut map = Lightmap::new(
                &atlas,
                &luxels.lit.luxels,
                &luxels.lit.buried,
                &baked.gathered,
            );
            eprintln!("error {}", bake::relative_error(&map));
            bake::add_resolution(&mut map, &luxels.lit.luxels);
            eprintln!("error {}", bake::relative_error(&map));
            dilate(&atlas, &luxels.lit.luxels, &luxels.triangles, &mut map);
            let edges = seams::matched(&atlas, &scene);
            let before = seams::steps(&map, &edges);
            crate::lightmap::fit::fit(
                &atlas,
                &mut map,
                &luxels.lit.luxels,
                &baked.gathered,
                &edges,
            );
            eprintln!(
                "seams {} {:?} {:?}",
                edges.len(),
                before,
                seams::steps(&map, &edges)
            );
            eprintln!("finish {:?}", t.elapsed());
            if let Ok(name) = std::env::var("LUXEL_REF") {
                check(&world, &atlas, &map, &name);
            }
            for page in 0..map.pages {
                let picture = Picture {
                    image: map.page(page, &map.values),
                    layers: vec![("error".into(), map.page(page, &map.errors))],
                    origin: None,
                };
                Output::prepare(&self.output.join(format!("lightmap_{page:03}.exr")))?
                    .write(&exr::encode(&picture)?)?;
            }
            if let Some(camera) = scene.cameras.first() {
                let frame = crate::camera::CameraFrame::new(camera, [512, 512])?;
                let view = LightmapView::new(&world, &atlas, &map);
                let film = expose(&view, &frame, Samples::new(16, 0), &Silent);
                let image = film.mean();
                let tone = crate::tone_map::ToneMap::automatic(&image);
                Output::prepare(&self.output.join("preview.png"))?
                    .write(&crate::image::png::encode(&image, tone)?)?;
                let page = map.page(0, &map.values);
                let tone = crate::tone_map::ToneMap::automatic(&page);
                Output::prepare(&self.output.join("page.png"))?
                    .write(&crate::image::png::encode(&page, tone)?)?;
            }
            Ok(())
        })??;
        Ok(ExitCode::Ok)
    }
}

fn check(
    world: &World<'_>,
    atlas: &crate::lightmap::atlas::Atlas,
    map: &crate::lightmap::map::Lightmap,
    file: &str,
) {
    use glam::DVec3;
    use luxel_solver::bvh::{Hit, Ray};
    let text = std::fs::read_to_string(file).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let get = |k: &str| -> Vec<[f64; 3]> { serde_json::from_value(json[k].clone()).unwrap() };
    let (p, n, e) = (get("position"), get("normal"), get("E"));
    let geometry = world.surfaces().geometry();
    let (mut sq, mut sum, mut bias, mut rel, mut z, mut count, mut within) =
        (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, [0.0, 0.0]);
    let mut worst = vec![];
    let mean = e.iter().flatten().sum::<f64>() / (3.0 * e.len() as f64);
    for i in 0..p.len() {
        let n = DVec3::from(n[i]);
        let q = geometry.frame().to_unit(DVec3::from(p[i]));
        let ray = Ray {
            origin: (q + n * 1e-5).as_vec3(),
            tmin: 0.0,
            direction: -n.as_vec3(),
            tmax: 1e-4,
        };
        let mut hit = [Hit::MISS];
        world.bvh().closest_hits(&[ray], &mut hit);
        let Some(x) = world.interaction(&ray, &hit[0]) else {
            eprintln!("miss {i}");
            continue;
        };
        let Some((page, place)) =
            crate::lightmap::lookup::place(atlas, world.scene(), geometry, x.point)
        else {
            eprintln!("nochart {i}");
            continue;
        };
        let v = crate::lightmap::lookup::sample(map, &map.values, page, place);
        let se = crate::lightmap::lookup::sample(map, &map.errors, page, place);
        for c in 0..3 {
            let d = v[c] - e[i][c];
            sq += d * d;
            sum += e[i][c];
            bias += d;
            count += 1.0;
            rel += d * d / (e[i][c].powi(2) + (0.01 * mean).powi(2));
            z += (d / se[c].max(1e-12)).powi(2);
            if d.abs() <= 1.96 * se[c] {
                within[0] += 1.0;
            }
        }
        worst.push((
            (v - DVec3::from(e[i])).length_squared(),
            i,
            v,
            DVec3::from(e[i]),
            place,
            se,
        ));
    }
    worst.sort_by(|a, b| b.0.total_cmp(&a.0));
    eprintln!(
        "nrmse {:.4} bias {:.5} rel {:.4} within {:.3} stated {:.4}",
        (sq / count).sqrt() / (sum / count),
        bias / sum,
        (rel / count).sqrt(),
        within[0] / count,
        crate::lightmap::bake::relative_error(map)
    );
    let all: f64 = worst.iter().map(|w| w.0).sum();
    let mut acc = 0.0;
    for w in worst.iter().take(8) {
        acc += w.0;
        eprintln!(
            "  {:.3} point {} map {:.4?} ref {:.4?} at {:.2?} se {:.4?}",
            acc / all,
            w.1,
            w.2.to_array(),
            w.3.to_array(),
            w.4.to_array(),
            w.5.to_array()
        );
    }
}
