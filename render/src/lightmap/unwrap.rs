//! Unwraps surfaces: places for faces in the pages of a lightmap, none on another.
//!
//! What cuts surfaces into charts, flattens and packs them is behind [`Unwrapper`]. The one that there is, [`UvUnwrap`], is
//! the crate uvunwrap: charts grown within a cone of normals, flattened by least-squares conformal maps and as-rigid-as-possible
//! refinement, packed by shape. It was chosen for its packing (86–90 % of a room's page where xatlas fills 61–77 %), for
//! having no overlap on broken meshes, and for its output, which is the same on every machine.

use super::atlas::{Atlas, Chart, ChartId};
use glam::{DVec2, Vec3};
use luxel_scenes::{ObjectId, Scene};
use std::collections::HashMap;

/// How finely surfaces are sampled, and how large pages are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Density {
    /// One page of this many texels a side, as finely as everything fits it.
    Page(usize),
    /// Texels a metre, on as many pages of so many texels a side as are needed.
    Fixed {
        /// Texels a metre.
        texels_per_metre: f64,
        /// Texels a side of a page.
        page: usize,
    },
}

/// What is wanted of an atlas.
#[derive(Clone, Debug, PartialEq)]
pub struct UnwrapConfig {
    /// How finely surfaces are sampled.
    pub density: Density,
    /// Texels around each chart: charts are at least twice as many apart.
    pub padding: usize,
    /// Whether each chart has blocks of 4 × 4 texels of its own, for block compression.
    pub block_align: bool,
}

/// Why a scene cannot be unwrapped.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum UnwrapError {
    /// Nothing to unwrap.
    #[error(
        "no object is to get a lightmap; give one a lightmap_scale above 0 ([object.\"NAME\"] in the scene file)"
    )]
    Nothing,
    /// A chart is larger than a page.
    #[error(
        "a chart of {width} × {height} texels does not fit a page of {page} × {page}; choose larger pages (--size) or fewer \
         texels a metre (--texels-per-metre)"
    )]
    ChartTooLarge {
        /// Its width with padding.
        width: u32,
        /// Its height with padding.
        height: u32,
        /// Texels a side of a page.
        page: u32,
    },
    /// More texels than can be addressed.
    #[error("the lightmap would have {0} texels; choose fewer texels a metre (--texels-per-metre)")]
    TooManyTexels(u64),
    /// The user stopped it.
    #[error("interrupted while surfaces were unwrapped")]
    Cancelled,
    /// What cannot happen with the meshes of a scene.
    #[error("surfaces cannot be unwrapped: {0}")]
    Refused(String),
}

/// Gives the faces of all objects whose `lightmap_scale` is not zero places in pages. The same scene and configuration give the same atlas on every machine.
pub trait Unwrapper {
    /// Unwraps a scene. Edges from a corner to the next of its face for which `cuts` is true separate charts; there is one for
    /// each corner, or none. `progress` hears of done and all pieces of a stage and stops the work by false.
    ///
    /// # Errors
    /// When pages are too small or the density too large, or `progress` stopped the work.
    fn unwrap(
        &self,
        scene: &Scene,
        cuts: &[bool],
        config: &UnwrapConfig,
        progress: &(dyn Fn(usize, Option<usize>) -> bool + Sync),
    ) -> Result<Atlas, UnwrapError>;
}

/// The crate uvunwrap.
#[derive(Clone, Copy, Debug, Default)]
pub struct UvUnwrap;

/// Charts of so many triangles in all are packed by their shapes; of more, by rows, which is several times faster and fills pages
/// a few percent less.
const SHAPES: usize = 200_000;

/// The faces of an object as a mesh of triangles.
#[derive(Default)]
struct Mesh {
    positions: Vec<[f32; 3]>,
    indices: Vec<u32>,
    /// Corner of the scene that each index stands for.
    corners: Vec<usize>,
    /// Number of the face that each triangle was cut from, within the object.
    polygons: Vec<u32>,
    /// Whether charts end at each edge of a triangle, from a corner to the next.
    seams: Vec<[bool; 3]>,
}

impl Unwrapper for UvUnwrap {
    fn unwrap(
        &self,
        scene: &Scene,
        cuts: &[bool],
        config: &UnwrapConfig,
        progress: &(dyn Fn(usize, Option<usize>) -> bool + Sync),
    ) -> Result<Atlas, UnwrapError> {
        let meshes = meshes(scene, cuts);
        let used: Vec<usize> = (0..meshes.len())
            .filter(|&object| {
                scene.objects[object].lightmap_scale > 0.0 && !meshes[object].indices.is_empty()
            })
            .collect();
        if used.is_empty() {
            return Err(UnwrapError::Nothing);
        }
        let inputs: Vec<uvunwrap::MeshInput> = used
            .iter()
            .map(|&object| uvunwrap::MeshInput {
                polygons: Some(&meshes[object].polygons),
                seams: Some(&meshes[object].seams),
                scale: scene.objects[object].lightmap_scale as f32,
                ..uvunwrap::MeshInput::new(&meshes[object].positions, &meshes[object].indices)
            })
            .collect();
        let triangles: usize = meshes.iter().map(|mesh| mesh.polygons.len()).sum();
        let options = uvunwrap::Options {
            density: match config.density {
                Density::Page(side) => uvunwrap::Density::Auto {
                    page_size: side as u32,
                },
                Density::Fixed {
                    texels_per_metre,
                    page,
                } => uvunwrap::Density::Fixed {
                    texels_per_unit: texels_per_metre as f32,
                    page_size: Some(page as u32),
                },
            },
            padding: config.padding as u32,
            packing: if triangles > SHAPES {
                uvunwrap::Packing::Fast
            } else {
                uvunwrap::Packing::Shape
            },
            block_align: config.block_align,
            ..uvunwrap::Options::default()
        };
        let hear = |at: uvunwrap::Progress| progress(at.done, at.total);
        let packed = uvunwrap::generate_with_progress(&inputs, &options, hear).map_err(refusal)?;
        Ok(atlas(scene, config, &meshes, &used, &packed))
    }
}

/// The objects of a scene as meshes. Corners of one position and normal are one vertex: surfaces that are smooth over an edge are
/// cut there last.
fn meshes(scene: &Scene, cuts: &[bool]) -> Vec<Mesh> {
    let (lower, upper) = scene.bounds().unwrap_or_default();
    let middle = (lower + upper) / 2.0;
    let mut meshes: Vec<Mesh> = scene.objects.iter().map(|_| Mesh::default()).collect();
    let mut vertices: HashMap<(ObjectId, u32, [u32; 3]), u32> = HashMap::new();
    for face in &scene.faces {
        let mesh = &mut meshes[face.object.index()];
        let vertex = |corner: usize, mesh: &mut Mesh, vertices: &mut HashMap<_, u32>| {
            let normal = scene
                .corners
                .normal
                .get(corner)
                .copied()
                .unwrap_or(Vec3::ZERO);
            let position = scene.corners.vertex[corner];
            let key = (face.object, position, normal.to_array().map(f32::to_bits));
            *vertices.entry(key).or_insert_with(|| {
                let place = scene.vertices[position as usize] - middle;
                mesh.positions.push(place.as_vec3().to_array());
                mesh.positions.len() as u32 - 1
            })
        };
        let polygon = mesh.polygons.last().map_or(0, |last| last + 1);
        let corners = face.corners();
        for next in corners.start + 1..corners.end - 1 {
            for corner in [corners.start, next, next + 1] {
                let index = vertex(corner, mesh, &mut vertices);
                mesh.indices.push(index);
                mesh.corners.push(corner);
            }
            mesh.polygons.push(polygon);
            // The first edge of the fan's first triangle and the last of its last are the polygon's, those between its own.
            let is_cut = |corner: usize| cuts.get(corner).copied().unwrap_or(false);
            let (is_first, is_last) = (next == corners.start + 1, next + 2 == corners.end);
            mesh.seams.push([
                is_first && is_cut(corners.start),
                is_cut(next),
                is_last && is_cut(next + 1),
            ]);
        }
    }
    meshes
}

/// The atlas that was packed for some objects.
fn atlas(
    scene: &Scene,
    config: &UnwrapConfig,
    meshes: &[Mesh],
    used: &[usize],
    packed: &uvunwrap::Atlas,
) -> Atlas {
    // A single page is cropped to what is used.
    let side = match config.density {
        Density::Page(side) | Density::Fixed { page: side, .. } => side,
    };
    let scale = DVec2::new(f64::from(packed.width), f64::from(packed.height));
    let mut charts = vec![None; packed.chart_count as usize];
    let mut corners = vec![DVec2::ZERO; scene.corners.vertex.len()];
    let mut face_chart = vec![None; scene.faces.len()];
    for (&object, output) in used.iter().zip(&packed.meshes) {
        let mesh = &meshes[object];
        for (&corner, &index) in mesh.corners.iter().zip(&output.indices) {
            let vertex = &output.vertices[index as usize];
            corners[corner] = DVec2::from(vertex.uv.map(f64::from)) * scale;
            let (Some(chart), Some(page)) = (vertex.chart, vertex.page) else {
                continue;
            };
            charts[chart as usize] = Some(Chart {
                page,
                object: ObjectId::new(object),
            });
            let face = scene
                .faces
                .partition_point(|face| face.first_corner as usize <= corner);
            face_chart[face - 1] = Some(ChartId(chart));
        }
    }
    // Degenerate faces lie on a place that they share with others: they get no texels.
    for (index, face) in scene.faces.iter().enumerate() {
        if super::atlas::polygon_area(&corners[face.corners()]) <= 0.0 {
            face_chart[index] = None;
        }
    }
    let without_faces = Chart {
        page: 0,
        object: ObjectId(0),
    };
    Atlas {
        size: [side; 2],
        pages: packed.page_count as usize,
        corners,
        face_chart,
        charts: charts
            .into_iter()
            .map(|chart| chart.unwrap_or(without_faces))
            .collect(),
        padding: config.padding,
    }
}

/// What the crate refused, in luxel's words.
fn refusal(error: uvunwrap::Error) -> UnwrapError {
    match error {
        uvunwrap::Error::Cancelled => UnwrapError::Cancelled,
        uvunwrap::Error::AtlasTooLarge { texels } => UnwrapError::TooManyTexels(texels),
        uvunwrap::Error::ChartTooLarge {
            width,
            height,
            page_size,
        } => UnwrapError::ChartTooLarge {
            width,
            height,
            page: page_size,
        },
        other => UnwrapError::Refused(other.to_string()),
    }
}
