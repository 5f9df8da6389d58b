//! Luxels as receivers of light: points that see the scene from outside its solids.
//!
//! - A point under other geometry sees the backs of one-sided faces. Where more than a tolerated share of its rays does, other
//!   points of the same texel are tried, the nearest to its centre first; where all are buried the luxel is *invalid*
//!   and is filled from its neighbours later.
//! - On smooth surfaces light is received along the shading normal, from a point on the curved surface that the facets stand for
//!   (J. Hanika, "Hacking the Shadow Terminator", Ray Tracing Gems II, 2021): a facet's own horizon would show otherwise.
//!
//! Cost: [`RAYS`] rays a luxel.

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
use std::collections::HashMap;

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

/// Finds points of luxels of whose rays no more than the share `tolerance` meets backs.
pub fn lit(
    world: &World<'_>,
    atlas: &Atlas,
    triangles: &[Placed],
    mut luxels: Vec<Luxel>,
    tolerance: f64,
) -> Lit {
    let is_buried = buried(world, &luxels, tolerance);
    let first: Vec<usize> = (0..luxels.len())
        .filter(|&index| is_buried[index])
        .collect();
    // Other points of the same texels.
    let tries = other_points(atlas, triangles, first.iter().map(|&index| &luxels[index]));
    let is_buried_too = buried(world, &tries, tolerance);
    let mut better: HashMap<u32, Luxel> = HashMap::new();
    for (luxel, buried) in tries.iter().zip(is_buried_too) {
        if buried {
            continue;
        }
        let distance = |luxel: &Luxel| luxel.offset.length_squared();
        let best = better.entry(luxel.texel).or_insert(*luxel);
        if distance(luxel) < distance(best) {
            *best = *luxel;
        }
    }
    let mut lost = Vec::new();
    for index in first {
        let texel = luxels[index].texel;
        match better.get(&texel) {
            Some(luxel) => luxels[index] = *luxel,
            None => lost.push(texel),
        }
    }
    let mut gone = lost.iter().peekable();
    luxels.retain(|luxel| gone.next_if_eq(&&luxel.texel).is_none());
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

/// The points of a regular grid in some texels that lie on faces.
fn other_points<'l>(
    atlas: &Atlas,
    triangles: &[Placed],
    of: impl Iterator<Item = &'l Luxel>,
) -> Vec<Luxel> {
    let texels: HashMap<u32, ()> = of.map(|luxel| (luxel.texel, ())).collect();
    if texels.is_empty() {
        return Vec::new();
    }
    let [width, height] = atlas.size;
    let mut found = Vec::new();
    for triangle in triangles {
        let [columns, rows] = triangle.texels(atlas.size);
        for row in rows {
            for column in columns.clone() {
                let texel = (triangle.page as usize * height + row) * width + column;
                if !texels.contains_key(&(texel as u32)) {
                    continue;
                }
                found.extend(grid().filter_map(|offset| {
                    let [u, v] = triangle.weights(centre(atlas, texel) + offset);
                    (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then_some(Luxel {
                        texel: texel as u32,
                        chart: triangle.chart,
                        point: SurfacePoint {
                            triangle: triangle.id,
                            u,
                            v,
                        },
                        offset,
                    })
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
