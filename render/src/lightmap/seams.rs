//! Seams: where a smooth surface was cut into charts, and how large the step of filtered values is there.
//!
//! Two edges match when they join the same two points of the surface and it is smooth across them: the shading normals of both
//! faces agree at the ends, or the faces' own where there are none. Elsewhere light has a true step. [`super::fit`] makes
//! the values on both sides agree, but not where a wall stands between them. Cost: a hash look-up an edge, and a
//! ray for each texel of its length.

use super::atlas::Atlas;
use super::lookup;
use super::map::Lightmap;
use glam::{DVec2, DVec3, Vec3};
use luxel_scenes::{FaceId, Scene};
use luxel_solver::bvh::Ray;
use luxel_solver::geometry::ray_origin;
use luxel_solver::world::World;
use std::collections::HashMap;

/// Points of an edge to a texel of its length.
const POINTS_A_TEXEL: f64 = 2.0;

/// Cosine from which normals agree: one degree.
const AGREEMENT: f64 = 0.999_85;

/// An edge of a face in its chart.
#[derive(Clone, Copy)]
struct Edge {
    face: FaceId,
    page: u32,
    /// Its ends in texels, the first at the key's lower position.
    ends: [DVec2; 2],
    /// The same in the unit frame.
    positions: [DVec3; 2],
    /// In the face, perpendicular to the edge, into the face.
    inwards: DVec3,
    normals: [DVec3; 2],
}

/// Two places that are one place of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Matched {
    /// Page and ends in texels on one side.
    pub one: (u32, [DVec2; 2]),
    /// The same on the other.
    pub other: (u32, [DVec2; 2]),
}

impl Matched {
    /// Points along it, as places on both sides.
    pub fn points(&self) -> impl Iterator<Item = [(u32, DVec2); 2]> + use<> {
        let Self { one, other } = *self;
        let length = |ends: [DVec2; 2]| ends[0].distance(ends[1]);
        let texels = length(one.1).max(length(other.1));
        let count = (POINTS_A_TEXEL * texels).ceil().max(1.0) as usize;
        (0..=count).map(move |index| {
            let along = index as f64 / count as f64;
            [one, other].map(|(page, ends)| (page, ends[0].lerp(ends[1], along)))
        })
    }
}

/// Edges that two charts share, or that lie apart in one, where the surface is smooth and one side sees the other.
pub fn matched(atlas: &Atlas, world: &World<'_>) -> Vec<Matched> {
    type Key = [[u64; 3]; 2];
    let scene = world.scene();
    let frame = world.surfaces().geometry().frame();
    let bits = |position: DVec3| position.to_array().map(|x| (x + 0.0).to_bits());
    let mut edges: HashMap<Key, Vec<Edge>> = HashMap::new();
    let mut order: Vec<Key> = Vec::new();
    for face in scene.face_ids() {
        let Some((_, chart)) = atlas.chart(face) else {
            continue;
        };
        let corners = scene.faces[face.index()].corners();
        let front = scene.vector_area(face).normalize_or_zero();
        for corner in corners.clone() {
            let next = if corner + 1 == corners.end {
                corners.start
            } else {
                corner + 1
            };
            let position = |corner: usize| scene.vertices[scene.corners.vertex[corner] as usize];
            let mut ends = [corner, next];
            let inwards = front.cross(position(next) - position(corner));
            let mut key = ends.map(|corner| bits(position(corner)));
            if key[0] > key[1] {
                key.swap(0, 1);
                ends.swap(0, 1);
            }
            let edge = Edge {
                face,
                page: chart.page,
                ends: ends.map(|corner| atlas.corners[corner]),
                positions: ends.map(|corner| frame.to_unit(position(corner))),
                inwards: inwards.normalize_or_zero(),
                normals: ends.map(|corner| normal(scene, corner, front)),
            };
            let own = edges.entry(key).or_default();
            if own.is_empty() {
                order.push(key);
            }
            own.push(edge);
        }
    }
    let mut found = Vec::new();
    for key in order {
        let own = &edges[&key];
        for (index, one) in own.iter().enumerate() {
            let mut others = own[index + 1..].iter();
            // Where more than two smooth faces meet, one partner is enough.
            if let Some(other) = others.find(|other| one.is_cut_from(other)) {
                found.push([*one, *other]);
            }
        }
    }
    without_walls(&found, world)
}

/// Matched edges but for the parts, about a texel long, where a wall stands between the sides.
fn without_walls(pairs: &[[Edge; 2]], world: &World<'_>) -> Vec<Matched> {
    let parts = |[one, other]: &[Edge; 2]| one.texels().max(other.texels()).ceil().max(1.0);
    let segments: Vec<Ray> = pairs
        .iter()
        .flat_map(|pair| {
            let count = parts(pair);
            (0..count as usize).map(move |part| {
                let along = (part as f64 + 0.5) / count;
                let [one, other] = pair;
                let distance = 0.25 * one.positions[0].distance(one.positions[1]) / count;
                // Above the surface, which may be curved.
                let [from, to] = [one, other].map(|edge| edge.beside(along, distance, world));
                Ray::segment(from, to)
            })
        })
        .collect();
    let mut blocked = vec![false; segments.len()];
    world.bvh().occluded(&segments, &mut blocked);
    let mut rest = blocked.as_slice();
    let mut found = Vec::new();
    for pair in pairs {
        let count = parts(pair);
        let (own, after) = rest.split_at(count as usize);
        rest = after;
        let mut first = 0;
        for run in own.chunk_by(|a, b| a == b) {
            let behind = first + run.len();
            if !run[0] {
                let range = [first, behind].map(|part| part as f64 / count);
                let [one, other] = pair.map(|edge| (edge.page, edge.part(range)));
                found.push(Matched { one, other });
            }
            first = behind;
        }
    }
    found
}

impl Edge {
    /// Whether the surface goes on smoothly from one to the other, but the atlas does not.
    fn is_cut_from(&self, other: &Self) -> bool {
        let agree = |end: usize| self.normals[end].dot(other.normals[end]) >= AGREEMENT;
        let apart = self.page != other.page
            || (0..2).any(|end| self.ends[end].distance(other.ends[end]) > 1e-3);
        apart && agree(0) && agree(1)
    }

    /// Its length in texels.
    fn texels(&self) -> f64 {
        self.ends[0].distance(self.ends[1])
    }

    /// A part of it in texels, by shares of its length.
    fn part(&self, [from, to]: [f64; 2]) -> [DVec2; 2] {
        let at = |share: f64| match share {
            0.0 => self.ends[0],
            1.0 => self.ends[1],
            share => self.ends[0].lerp(self.ends[1], share),
        };
        [at(from), at(to)]
    }

    /// A point of its face beside it, and as far above the face, in the unit frame.
    fn beside(&self, along: f64, distance: f64, world: &World<'_>) -> Vec3 {
        let geometry = world.surfaces().geometry();
        let normal = geometry.normal(self.face);
        let on_edge = self.positions[0].lerp(self.positions[1], along);
        let position = on_edge + self.inwards * distance;
        ray_origin(position, normal, geometry.extent(self.face)) + (normal * distance).as_vec3()
    }
}

/// The shading normal of a corner, or that of its face where it has none.
fn normal(scene: &Scene, corner: usize, front: DVec3) -> DVec3 {
    let normal = scene
        .corners
        .normal
        .get(corner)
        .map_or(DVec3::ZERO, |n| n.as_dvec3());
    if normal.dot(front) > 0.0 {
        normal.normalize()
    } else {
        front
    }
}

/// The largest step along matched edges relative to the value there, and the root of the mean square of the steps relative to the
/// mean value; what an eye sees of the seams.
pub fn steps(map: &Lightmap, edges: &[Matched]) -> [f64; 2] {
    let (mut largest, mut squares, mut values, mut count) = (0.0_f64, 0.0, 0.0, 0.0);
    for sides in edges.iter().flat_map(Matched::points) {
        let [one, other] = sides.map(|(page, place)| lookup::sample(map, &map.values, page, place));
        let value = 0.5 * (one + other).element_sum();
        let step = (one - other).element_sum().abs();
        if value > 0.0 {
            largest = largest.max(step / value);
        }
        squares += step * step;
        values += value;
        count += 1.0;
    }
    if values > 0.0 {
        [largest, (squares / count).sqrt() / (values / count)]
    } else {
        [largest, 0.0]
    }
}
