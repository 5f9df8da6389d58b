//! Luxels as receivers of light: points that see the scene from outside its solids.
//!
//! - A point under other geometry sees the backs of one-sided faces. Where more than a tolerated share of its rays does, other
//!   points of the same texel are tried, the nearest to its centre first; where all are buried the luxel is *invalid*
//!   and is filled from its neighbours later.
//! - Of several points of a texel only those count that see the first: a wall may stand between them.
//! - On smooth surfaces light is received along the shading normal, from a point on the curved surface that the facets stand for
//!   (J. Hanika, "Hacking the Shadow Terminator", Ray Tracing Gems II, 2021): a facet's own horizon would show otherwise.
//!
//! Cost: 16 rays a luxel.

use super::atlas::Atlas;
use super::luxels::{Luxel, Placed, centre};
use glam::{DVec2, DVec3};
use luxel_scenes::Scene;
use luxel_solver::bvh::{Hit, Ray};
use luxel_solver::geometry::{offset_bound, ray_origin};
use luxel_solver::sampling::{Frame, Sequence, Stage, cosine_hemisphere};
use luxel_solver::surface::SurfacePoint;
use luxel_solver::world::{Receiver, World};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Rays by which a point is judged.
const RAYS: u32 = 16;

/// Points of a texel that are tried along each side, where its first is buried.
const TRIES: usize = 4;

/// Luxels that a thread judges at a time.
const BATCH: usize = 256;

/// Luxels with their receivers.
pub struct Lit {
    /// Luxels that are not buried, in the order of their texels.
    pub luxels: Vec<Luxel>,
    /// One for each of them.
    pub receivers: Vec<Receiver>,
    /// Texels whose points are all buried.
    pub buried: Vec<u32>,
}

/// Keeps the luxels of whose rays no more than the share `tolerance` meets backs; texels that lose all get other points.
pub fn lit(
    world: &World<'_>,
    atlas: &Atlas,
    triangles: &[Placed],
    mut luxels: Vec<Luxel>,
    tolerance: f64,
) -> Lit {
    let is_buried = buried(world, &luxels, tolerance);
    let mut lost: Vec<u32> = Vec::new();
    for (own, is_buried) in
        luxels
            .chunk_by(|a, b| a.texel == b.texel)
            .scan(is_buried.as_slice(), |rest, own| {
                let (first, after) = rest.split_at(own.len());
                *rest = after;
                Some((own, first))
            })
    {
        if is_buried.iter().all(|&buried| buried) {
            lost.push(own[0].texel);
        }
    }
    let mut is_buried = is_buried.into_iter();
    luxels.retain(|_| is_buried.next() == Some(false));
    // Other points of the texels that lost all.
    let tries = other_points(atlas, triangles, &lost);
    let is_buried = buried(world, &tries, tolerance);
    let mut better: BTreeMap<u32, Luxel> = BTreeMap::new();
    for (luxel, buried) in tries.iter().zip(is_buried) {
        if buried {
            continue;
        }
        let distance = |luxel: &Luxel| luxel.offset.length_squared();
        let best = better.entry(luxel.texel).or_insert(*luxel);
        if distance(luxel) < distance(best) {
            *best = *luxel;
        }
    }
    lost.retain(|texel| !better.contains_key(texel));
    luxels.extend(better.into_values());
    luxels.sort_by_key(|luxel| luxel.texel);
    let luxels = connected(world, luxels);
    let receivers = luxels
        .par_iter()
        .map(|luxel| receiver(world, luxel.point))
        .collect();
    Lit {
        luxels,
        receivers,
        buried: lost,
    }
}

/// Of each texel's luxels the first and those that it sees: a wall through a texel leaves those on one of its sides.
fn connected(world: &World<'_>, luxels: Vec<Luxel>) -> Vec<Luxel> {
    let mut first = luxels.first().copied();
    let firsts: Vec<Option<Luxel>> = luxels
        .iter()
        .map(|luxel| {
            let same = first.filter(|first| first.texel == luxel.texel);
            if same.is_none() {
                first = Some(*luxel);
            }
            same
        })
        .collect();
    let segments: Vec<Ray> = luxels
        .iter()
        .zip(&firsts)
        .filter_map(|(luxel, first)| {
            let [one, other] = [first.as_ref()?, luxel].map(|l| on_face(world, l.point));
            // Above the surface, which may be curved.
            let height = 0.5 * one.position.distance(other.position);
            let [from, to] = [one, other].map(|r| r.origin + (r.normal * height).as_vec3());
            Some(Ray::segment(from, to))
        })
        .collect();
    let mut blocked = vec![false; segments.len()];
    world.bvh().occluded(&segments, &mut blocked);
    let mut blocked = blocked.into_iter();
    luxels
        .into_iter()
        .zip(firsts)
        .filter(|(_, first)| first.is_none() || blocked.next() == Some(false))
        .map(|(luxel, _)| luxel)
        .collect()
}

/// The points of a regular grid in some texels, given in order, that lie on faces.
fn other_points(atlas: &Atlas, triangles: &[Placed], texels: &[u32]) -> Vec<Luxel> {
    if texels.is_empty() {
        return Vec::new();
    }
    let mut found = Vec::new();
    for triangle in triangles {
        let [columns, rows] = triangle.texels(atlas.size);
        for row in rows {
            for column in columns.clone() {
                let texel = atlas.texel(triangle.page, column, row);
                if texels.binary_search(&(texel as u32)).is_err() {
                    continue;
                }
                let places = grid().map(|offset| (offset, centre(atlas, texel) + offset));
                let inside = places.filter(|(_, place)| triangle.contains(*place));
                found.extend(inside.map(|(offset, place)| {
                    let [u, v] = triangle.weights(place);
                    Luxel {
                        texel: texel as u32,
                        chart: triangle.chart,
                        point: SurfacePoint {
                            triangle: triangle.id,
                            u,
                            v,
                        },
                        offset,
                    }
                }));
            }
        }
    }
    found
}

/// Points of a texel from its centre.
fn grid() -> impl Iterator<Item = DVec2> {
    let along = |index: usize| (index as f64 + 0.5) / TRIES as f64 - 0.5;
    (0..TRIES * TRIES).map(move |index| DVec2::new(along(index % TRIES), along(index / TRIES)))
}

/// Whether more of the rays of each luxel's point than the share `tolerance` meet backs.
fn buried(world: &World<'_>, luxels: &[Luxel], tolerance: f64) -> Vec<bool> {
    let of_batch = |luxels: &[Luxel]| -> Vec<bool> {
        let mut rays = Vec::with_capacity(luxels.len() * RAYS as usize);
        for luxel in luxels {
            let receiver = on_face(world, luxel.point);
            let frame = Frame::around(receiver.normal.as_vec3());
            // The same directions everywhere: neighbours are judged alike.
            let sequence = Sequence::new(0, Stage::LIGHTMAP, 0);
            rays.extend((0..RAYS).map(|index| {
                let local = cosine_hemisphere::sample(sequence.point2_f32(index));
                Ray::new(receiver.origin, frame.to_world(local))
            }));
        }
        let mut hits = vec![Hit::MISS; rays.len()];
        world.bvh().closest_hits(&rays, &mut hits);
        let met: Vec<bool> = rays
            .iter()
            .zip(&hits)
            .map(|(ray, hit)| world.meets_back(ray, hit))
            .collect();
        met.chunks(RAYS as usize)
            .map(|met| {
                let backs = met.iter().filter(|back| **back).count();
                backs as f64 > tolerance * f64::from(RAYS)
            })
            .collect()
    };
    luxels.par_chunks(BATCH).flat_map_iter(of_batch).collect()
}

/// A point as a receiver on its face.
fn on_face(world: &World<'_>, point: SurfacePoint) -> Receiver {
    let geometry = world.surfaces().geometry();
    let face = geometry.face(point.triangle);
    let position = geometry.interpolate(point.triangle, point.u, point.v);
    let normal = geometry.normal(face);
    Receiver {
        position,
        normal,
        origin: ray_origin(position, normal, geometry.extent(face)),
    }
}

/// A point as a receiver of a surface that is smooth where its corners' normals say so.
pub fn receiver(world: &World<'_>, point: SurfacePoint) -> Receiver {
    let on_face = on_face(world, point);
    let surfaces = world.surfaces();
    let normal = surfaces.shading_normal(point);
    let scene = surfaces.scene();
    let geometry = surfaces.geometry();
    let face = geometry.face(point.triangle);
    if scene.corners.normal.is_empty() || normal.dot(on_face.normal) >= 1.0 - f64::EPSILON {
        return on_face;
    }
    let lift = lift(scene, world, point, on_face.position);
    let position = on_face.position + lift;
    // A lift below what rounding needs to leave the face would leave the origin behind it.
    let least = offset_bound(on_face.position, geometry.extent(face));
    let height = lift.dot(on_face.normal);
    let origin = if height > least {
        position.as_vec3()
    } else {
        on_face.origin
    };
    Receiver {
        position,
        normal,
        origin,
    }
}

/// From a point of a facet to the curved surface: the weighted mean of its projections onto the tangent planes of the corners
/// that lie above it.
fn lift(scene: &Scene, world: &World<'_>, point: SurfacePoint, position: DVec3) -> DVec3 {
    let geometry = world.surfaces().geometry();
    let face = geometry.face(point.triangle);
    let first = scene.faces[face.index()].first_corner as usize;
    let fan = geometry.fan_index(point.triangle);
    let corners = [first, first + fan + 1, first + fan + 2];
    let weights = [1.0 - point.u - point.v, point.u, point.v];
    let vertices = geometry.triangle(point.triangle);
    let mut lift = DVec3::ZERO;
    for ((corner, weight), vertex) in corners.into_iter().zip(weights).zip(vertices) {
        let normal = scene.corners.normal[corner].as_dvec3();
        let below = (position - vertex).dot(normal).min(0.0);
        lift -= normal * (weight * below);
    }
    lift
}
