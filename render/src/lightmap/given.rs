//! Places that a scene brings along: its own second texture coordinates, checked before they are trusted.
//!
//! Lightmap coordinates have to lie within the page and may not lie on each other: each texel has one light. Both are looked for
//! at the texels' centres, as filtering would see them. Faces whose corners share coordinates are one chart. Mirrored charts
//! are as good as others. Cost: a few operations for each texel of each triangle's box.

use super::atlas::{Atlas, Chart, ChartId, polygon_area};
use super::luxels::{Placed, placed};
use glam::{DVec2, Vec2};
use luxel_scenes::{FaceId, ObjectId, Scene};
use luxel_solver::geometry::Geometry;
use std::collections::HashMap;

/// How far beyond the page, in texels, coordinates may lie: rounding of exporters.
const BEYOND: f64 = 0.01;

/// Share of a triangle's extent by which a place has to lie inside it to count as its own: neighbours share their edges.
const INSIDE: f64 = 1e-4;

/// Why a scene's own coordinates cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GivenError {
    /// Objects without a second set.
    #[error(
        "{count} object(s) have no second texture coordinates, the first is `{first}`; use --uv unwrap, or export the scene with \
         a lightmap UV set"
    )]
    Missing {
        /// How many objects.
        count: usize,
        /// The first of them.
        first: String,
    },
    /// A face reaches beyond the page.
    #[error(
        "face {face} of object `{object}` has lightmap coordinates outside of the page ({u}, {v}); they must lie in [0, 1]: use \
         --uv unwrap, or pack them again"
    )]
    OutOfPage {
        /// The object.
        object: String,
        /// Number of the face in its object, from one.
        face: usize,
        /// The coordinates.
        u: f64,
        /// Upwards.
        v: f64,
    },
    /// Faces lie on each other.
    #[error(
        "lightmap coordinates overlap on {texels} texels: face {one_face} of object `{one}` lies on face {other_face} of object \
         `{other}`; use --uv unwrap, or unwrap them again"
    )]
    Overlap {
        /// Texels with more than one face at their centre.
        texels: usize,
        /// An object.
        one: String,
        /// Its face's number, from one.
        one_face: usize,
        /// The object of the other face.
        other: String,
        /// That face's number, from one.
        other_face: usize,
    },
}

/// The atlas of one page that a scene's own second coordinates make. Objects whose `lightmap_scale` is zero are left out.
///
/// # Errors
/// When coordinates are missing, reach beyond the page, or overlap.
pub fn given(scene: &Scene, geometry: &Geometry, side: usize) -> Result<Atlas, GivenError> {
    let is_used = |face: FaceId| {
        let object = scene.faces[face.index()].object;
        scene.objects[object.index()].lightmap_scale > 0.0
    };
    let corners = &scene.corners.uv1;
    let place = |uv: Vec2| DVec2::new(f64::from(uv.x), 1.0 - f64::from(uv.y)) * side as f64;
    let places: Vec<DVec2> = corners.iter().map(|&uv| place(uv)).collect();
    require_coordinates(scene, &places, &is_used)?;
    for face in scene.face_ids().filter(|&face| is_used(face)) {
        for corner in scene.faces[face.index()].corners() {
            let at = places[corner];
            let page = -BEYOND..=side as f64 + BEYOND;
            if !(page.contains(&at.x) && page.contains(&at.y)) {
                let uv = corners[corner];
                return Err(GivenError::OutOfPage {
                    object: object_name(scene, face),
                    face: number(scene, face),
                    u: uv.x.into(),
                    v: uv.y.into(),
                });
            }
        }
    }
    let (face_chart, charts) = charts(scene, &places, &is_used);
    let atlas = Atlas {
        size: [side; 2],
        pages: 1,
        corners: places,
        face_chart,
        charts,
        padding: 1,
    };
    let triangles = placed(&atlas, scene, geometry);
    match overlap(&atlas, scene, geometry, &triangles) {
        Some(error) => Err(error),
        None => Ok(atlas),
    }
}

/// Refuses objects all of whose faces have no area in the page.
fn require_coordinates(
    scene: &Scene,
    places: &[DVec2],
    is_used: &impl Fn(FaceId) -> bool,
) -> Result<(), GivenError> {
    let mut has = vec![false; scene.objects.len()];
    let mut wants = vec![false; scene.objects.len()];
    for face in scene.face_ids().filter(|&face| is_used(face)) {
        let object = scene.faces[face.index()].object.index();
        wants[object] = true;
        let ring = places.get(scene.faces[face.index()].corners());
        has[object] |= ring.is_some_and(|ring| polygon_area(ring).abs() > 0.0);
    }
    let missing = |&object: &usize| wants[object] && !has[object];
    let all: Vec<usize> = (0..has.len()).filter(missing).collect();
    match all.first() {
        Some(&first) => Err(GivenError::Missing {
            count: all.len(),
            first: scene.objects[first].name.clone(),
        }),
        None => Ok(()),
    }
}

/// Charts of faces that share corners: the same vertex at the same place.
fn charts(
    scene: &Scene,
    places: &[DVec2],
    is_used: &impl Fn(FaceId) -> bool,
) -> (Vec<Option<ChartId>>, Vec<Chart>) {
    let mut parent: Vec<usize> = (0..scene.faces.len()).collect();
    let mut first_at: HashMap<(ObjectId, [u64; 2], [u64; 3]), usize> = HashMap::new();
    for face in scene.face_ids().filter(|&face| is_used(face)) {
        let Some(of_face) = scene.faces.get(face.index()) else {
            continue;
        };
        for corner in of_face.corners() {
            let position = scene.vertices[scene.corners.vertex[corner] as usize];
            let key = (
                of_face.object,
                places[corner].to_array().map(f64::to_bits),
                position.to_array().map(|x| (x + 0.0).to_bits()),
            );
            let other = *first_at.entry(key).or_insert(face.index());
            let (one, other) = (root(&mut parent, face.index()), root(&mut parent, other));
            // The lower number stands for both: charts are in the order of their first faces.
            parent[one.max(other)] = one.min(other);
        }
    }
    let mut charts = Vec::new();
    let mut of_root: HashMap<usize, ChartId> = HashMap::new();
    let mut face_chart = vec![None; scene.faces.len()];
    for face in scene.face_ids().filter(|&face| is_used(face)) {
        let of_face = scene.faces[face.index()];
        if polygon_area(&places[of_face.corners()]).abs() <= 0.0 {
            continue;
        }
        let root = root(&mut parent, face.index());
        let id = *of_root.entry(root).or_insert_with(|| {
            charts.push(Chart {
                page: 0,
                object: of_face.object,
            });
            ChartId(charts.len() as u32 - 1)
        });
        face_chart[face.index()] = Some(id);
    }
    (face_chart, charts)
}

/// The face that stands for a face's chart; what lies on the way there points to it afterwards.
fn root(parent: &mut [usize], mut face: usize) -> usize {
    while parent[face] != face {
        parent[face] = parent[parent[face]];
        face = parent[face];
    }
    face
}

/// Two faces with a texel's centre in common, and how many texels have such.
fn overlap(
    atlas: &Atlas,
    scene: &Scene,
    geometry: &Geometry,
    triangles: &[Placed],
) -> Option<GivenError> {
    const NONE: u32 = u32::MAX;
    let mut owner = vec![NONE; atlas.texels()];
    let mut found: Option<(u32, u32)> = None;
    let mut texels = 0;
    for (index, triangle) in triangles.iter().enumerate() {
        let [columns, rows] = triangle.texels(atlas.size);
        for row in rows {
            for column in columns.clone() {
                let centre = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
                let [u, v] = triangle.weights(centre);
                if u.min(v).min(1.0 - u - v) < INSIDE {
                    continue;
                }
                let own = &mut owner[atlas.texel(triangle.page, column, row)];
                if *own == NONE {
                    *own = index as u32;
                } else {
                    texels += 1;
                    found = found.or(Some((*own, index as u32)));
                }
            }
        }
    }
    let (one, other) = found?;
    let [one, other] = [one, other].map(|index| geometry.face(triangles[index as usize].id));
    Some(GivenError::Overlap {
        texels,
        one: object_name(scene, one),
        one_face: number(scene, one),
        other: object_name(scene, other),
        other_face: number(scene, other),
    })
}

fn object_name(scene: &Scene, face: FaceId) -> String {
    let object = scene.faces[face.index()].object;
    scene.objects[object.index()].name.clone()
}

/// Number of a face in its object, from one.
fn number(scene: &Scene, face: FaceId) -> usize {
    let object = scene.faces[face.index()].object;
    let before = scene.faces[..=face.index()].iter();
    before.filter(|other| other.object == object).count()
}
