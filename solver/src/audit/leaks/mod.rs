//! Gaps through which light leaves a room, and the openings that are meant.
//!
//! Random rays do not find a crack of a millionth of a wall. So points on the edges where surfaces end
//! (free edges of the mesh, sharp edges of solids) look for the nearest other surface: touching it they
//! are sealed; a short way from it there may be a gap, and rays from its middle tell what it connects. Light leaks where one side is a
//! lit room, and the other is the outside (rays leave the scene, or meet backs far away) or a
//! room whose surfaces do not see those of the first. The share of the light that leaves is about that of
//! the gap's area in the lit area of the scene (exact in an evenly lit enclosure). A free edge with
//! nothing near it but a room on one side and the outside on the other is the rim of an opening.
//!
//! Source: luxel's own. Validity: straight gaps from [`NARROWEST`] to [`WIDEST`]; what is bent or leads
//! through a labyrinth is not found. Deterministic. Cost: up to [`PROBES`] · 64 rays for each
//! edge that has something near it that it does not touch.

mod edges;
mod near;

use super::finding::{Finding, LeadsTo};
use super::tally::{Met, met};
use crate::bvh::{Hit, Ray};
use crate::sampling::{Frame, Sequence, Stage, cosine_hemisphere, sphere};
use crate::world::World;
use edges::{Boundary, Edge};
use glam::{DVec3, Vec3};
use luxel_scenes::check::FaceRef;
use luxel_scenes::{FaceId, ObjectId};
use near::{Near, Neighbourhood};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Width in units below which surfaces touch: four roundings of a coordinate in f32, which rays see.
const NARROWEST: f64 = 2e-7;

/// Width over the diagonal of the scene up to which a gap is taken for a mistake. Wider, and the
/// slots under doors and lamps are called gaps; narrower, and walls that are a centimetre off are not.
const WIDEST: f64 = 0.002;

/// Most points along an edge.
const PROBES: u32 = 8;

/// Length over the diagonal of the scene that one of them stands for, on short edges. Shorter, and the
/// audit of finely tessellated scenes takes longer than their solution.
const SPACING: f64 = 0.01;

/// Width over the distance from a corner that both faces share, up to which their angle is a gap and not
/// a corner of the room.
const WEDGE: f64 = 0.02;

/// Rays from a point to either side.
const RAYS: u32 = 16;

/// Cosine between a solid's normals and the direction to a surface from which that lies outside the solid.
const OUTWARDS: f64 = 0.01;

/// Distance over the width of a gap from which a hit belongs to what the gap leads to, not to the gap
/// itself, as under a sheet that lies on a desk.
const FAR: f64 = 100.0;

/// Share of the rays of a side that say what it is.
const ENOUGH: f64 = 0.25;

/// Length over the diagonal of the scene from which a gap to another room counts: shorter ones lead
/// behind books and drawers.
const SHORTEST: f64 = 0.05;

/// Points of either side that look for each other.
const WITNESSES: usize = 8;

/// Share of the pairs that see each other from which both sides are one room. Through the gap itself
/// hardly any do.
const SAME_ROOM: f64 = 0.1;

/// What a point of the boundary turned out to be.
enum Probe {
    Gap(Candidate),
    Rim(DVec3),
}

/// A gap with light on one side.
struct Candidate {
    width: f64,
    /// The part of the edge that the probe stands for, in units.
    length: f64,
    edge: FaceId,
    other: FaceId,
    at: DVec3,
    leads_to: LeadsTo,
    /// What both sides see, where that is to be compared.
    witnesses: [Vec<Vec3>; 2],
}

/// What is known of the gaps between two objects.
struct Gap {
    area: f64,
    length: f64,
    widest: f64,
    at: DVec3,
    faces: [FaceId; 2],
}

/// The object of an edge, the object that it should touch, and what is beyond.
type Key = (ObjectId, ObjectId, LeadsTo);

/// Gaps, the largest first, and the opening if rays leave the scene: `escaping` of those from its surfaces.
/// `lit_area` is in square units.
pub(super) fn report(world: &World, lit_area: f64, escaping: f64) -> Vec<Finding> {
    let scene = world.scene();
    let geometry = world.surfaces().geometry();
    let boundary = Boundary::new(scene, geometry);
    if boundary.edges.is_empty() {
        return Vec::new();
    }
    let search = Search::new(world, &boundary);
    let probes: Vec<Vec<Probe>> = boundary
        .edges
        .par_iter()
        .enumerate()
        .map(|(index, edge)| search.along(edge, index as u64))
        .collect();
    let object = |face: FaceId| scene.faces[face.index()].object;
    let (mut rim, mut middle, mut rims) = (BTreeSet::new(), DVec3::ZERO, 0u32);
    let mut by_objects: BTreeMap<Key, Vec<Candidate>> = BTreeMap::new();
    for (edge, probes) in boundary.edges.iter().zip(probes) {
        for probe in probes {
            match probe {
                Probe::Gap(candidate) => {
                    let key = (
                        object(candidate.edge),
                        object(candidate.other),
                        candidate.leads_to,
                    );
                    by_objects.entry(key).or_default().push(candidate);
                }
                Probe::Rim(at) => {
                    rim.insert(object(edge.face));
                    middle += at;
                    rims += 1;
                }
            }
        }
    }
    let gaps: BTreeMap<Key, Gap> = by_objects
        .into_iter()
        .filter_map(|(key, candidates)| Some((key, search.join(candidates)?)))
        .collect();
    let frame = geometry.frame();
    // Both edges of a gap tell of it: the one that tells more stands for both.
    let mut findings: Vec<(f64, Finding)> = gaps
        .iter()
        .filter(|((a, b, to), gap)| {
            gaps.get(&(*b, *a, *to))
                .is_none_or(|twin| a == b || (gap.area, b.index()) > (twin.area, a.index()))
        })
        .map(|((a, b, leads_to), gap)| {
            // Within one object both edges are in the same sum.
            let share = gap.area / lit_area * if a == b { 0.5 } else { 1.0 };
            let finding = Finding::Gap {
                between: gap.faces.map(|face| FaceRef::new(scene, face)),
                at: frame.to_world(gap.at),
                width: gap.widest * frame.metres_per_unit,
                length: gap.length * frame.metres_per_unit,
                share,
                leads_to: *leads_to,
            };
            (share, finding)
        })
        .collect();
    findings.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut findings: Vec<Finding> = findings.into_iter().map(|(_, finding)| finding).collect();
    if rims > 0 && escaping > 0.0 {
        findings.push(Finding::Opening {
            fraction: escaping,
            rim: rim
                .into_iter()
                .map(|object: ObjectId| scene.objects[object.index()].name.clone())
                .collect(),
            at: frame.to_world(middle / f64::from(rims)),
        });
    }
    findings
}

/// What the probes of one scene share.
struct Search<'w> {
    world: &'w World<'w>,
    boundary: &'w Boundary,
    neighbourhood: Neighbourhood<'w>,
    /// Diagonal of the scene in units.
    diagonal: f64,
    /// Widest gap in units.
    reach: f64,
}

impl<'w> Search<'w> {
    fn new(world: &'w World<'w>, boundary: &'w Boundary) -> Self {
        let geometry = world.surfaces().geometry();
        let (low, high) = world.scene().bounds().unwrap_or_default();
        let diagonal = low.distance(high) / geometry.frame().metres_per_unit;
        Self {
            world,
            boundary,
            neighbourhood: Neighbourhood::new(geometry),
            diagonal,
            reach: WIDEST * diagonal,
        }
    }

    /// Probes an edge.
    fn along(&self, edge: &Edge, number: u64) -> Vec<Probe> {
        let length = edge.ends[0].distance(edge.ends[1]);
        let probes = (length / (SPACING * self.diagonal)).ceil();
        let probes = (probes as u32).clamp(1, PROBES);
        // The gap beside a solid ends at two of its edges.
        let length = length / f64::from(probes) * if edge.other.is_some() { 0.5 } else { 1.0 };
        (0..probes)
            .filter_map(|index| {
                let share = (f64::from(index) + 0.5) / f64::from(probes);
                let point = edge.ends[0].lerp(edge.ends[1], share);
                let item = number * u64::from(PROBES) + u64::from(index);
                match self.near(edge, point) {
                    Some(near) if near.distance < NARROWEST => None,
                    Some(near) => self.gap(edge, point, near, length, item),
                    None if edge.other.is_none() => self.rim(edge, point, item),
                    None => None,
                }
            })
            .collect()
    }

    /// Adds up the gaps between two objects that lead to one goal; nothing when they are none after all.
    fn join(&self, candidates: Vec<Candidate>) -> Option<Gap> {
        let length = |candidates: &[Candidate]| candidates.iter().map(|c| c.length).sum::<f64>();
        let mut candidates = candidates;
        if candidates.first()?.leads_to == LeadsTo::AnotherRoom {
            let is_long = |candidates: &[Candidate]| length(candidates) >= SHORTEST * self.diagonal;
            if !is_long(&candidates) {
                return None;
            }
            candidates.retain(|candidate| {
                let [a, b] = &candidate.witnesses;
                !self.is_one_room(a, b)
            });
            if !is_long(&candidates) {
                return None;
            }
        }
        let widest = candidates
            .iter()
            .rev()
            .max_by(|a, b| a.width.total_cmp(&b.width))?;
        Some(Gap {
            area: candidates.iter().map(|c| c.width * c.length).sum(),
            length: length(&candidates),
            widest: widest.width,
            at: widest.at,
            faces: [widest.edge, widest.other],
        })
    }

    /// The nearest surface that is not the edge's own, nor its neighbour around a corner.
    fn near(&self, edge: &Edge, point: DVec3) -> Option<Near> {
        let geometry = self.world.surfaces().geometry();
        self.neighbourhood.nearest(point, self.reach, |near| {
            let is_own = near.face == edge.face || Some(near.face) == edge.other;
            let corner = self.boundary.shared_end(edge, near.face);
            let is_corner =
                corner.is_some_and(|corner| near.distance > WEDGE * point.distance(corner));
            // From the edge of a solid, what lies outside it.
            let is_outside = edge.other.is_none_or(|other| {
                let to = near.point - point;
                near.distance < NARROWEST
                    || [edge.face, other]
                        .iter()
                        .any(|&face| geometry.normal(face).dot(to) > OUTWARDS * near.distance)
            });
            !is_own && !is_corner && is_outside
        })
    }

    /// Whether light leaves between an edge and a surface near it.
    fn gap(&self, edge: &Edge, point: DVec3, near: Near, length: f64, item: u64) -> Option<Probe> {
        let along = (edge.ends[1] - edge.ends[0]).normalize();
        let through = along.cross(near.point - point).try_normalize()?;
        let at = point.midpoint(near.point);
        let far = FAR * near.distance;
        let [a, b] = [through, -through].map(|axis| {
            // Flat rays pass through a long channel, where others end at once; others see the room where
            // flat ones leave it through a gap on its far side.
            let flat = self.look(at, flat_fan(axis, along), far);
            let round = self.look(at, hemisphere(axis, item), far);
            if round.lit >= ENOUGH {
                round
            } else if flat.lit >= ENOUGH || flat.out > round.out {
                flat
            } else {
                round
            }
        });
        let leads_to = match (a.lit >= ENOUGH, b.lit >= ENOUGH) {
            (true, true) => LeadsTo::AnotherRoom,
            (true, false) if b.out >= ENOUGH => LeadsTo::Outside,
            (false, true) if a.out >= ENOUGH => LeadsTo::Outside,
            _ => return None,
        };
        Some(Probe::Gap(Candidate {
            width: near.distance,
            length,
            edge: edge.face,
            other: near.face,
            at,
            leads_to,
            witnesses: [a.witnesses, b.witnesses],
        }))
    }

    /// Whether points that the two sides see, see each other, or what the others see.
    fn is_one_room(&self, a: &[Vec3], b: &[Vec3]) -> bool {
        self.see_each_other(a, b) || {
            let rays: Vec<Ray> = a
                .iter()
                .enumerate()
                .flat_map(|(index, &from)| {
                    let sequence = Sequence::new(0, Stage::AUDIT, (1 << 41) + index as u64);
                    (0..RAYS).map(move |ray| {
                        Ray::new(from, sphere::sample_sphere(sequence.point2_f32(ray)))
                    })
                })
                .collect();
            let mut hits = vec![Hit::MISS; rays.len()];
            self.world.bvh().closest_hits(&rays, &mut hits);
            let met = rays
                .iter()
                .zip(&hits)
                .filter(|(_, hit)| hit.triangle().is_some());
            let around: Vec<Vec3> = met.map(|(ray, hit)| ray.at(WITNESS * hit.t)).collect();
            self.see_each_other(&around, b)
        }
    }

    fn see_each_other(&self, a: &[Vec3], b: &[Vec3]) -> bool {
        let rays: Vec<Ray> = a
            .iter()
            .flat_map(|&from| b.iter().map(move |&to| Ray::segment(from, to)))
            .collect();
        let mut blocked = vec![false; rays.len()];
        self.world.bvh().occluded(&rays, &mut blocked);
        let free = blocked.iter().filter(|blocked| !**blocked).count();
        free as f64 > SAME_ROOM * rays.len() as f64
    }

    /// Whether the room ends at an edge, with nothing beyond.
    fn rim(&self, edge: &Edge, point: DVec3, item: u64) -> Option<Probe> {
        let normal = self.world.surfaces().geometry().normal(edge.face);
        let outwards = (edge.ends[1] - edge.ends[0]).cross(normal).normalize();
        let at = point + outwards * self.reach;
        // Through the opening, which is about square to the wall: from inwards to outwards.
        let [inside, outside] =
            [-outwards, outwards].map(|axis| self.look(at, hemisphere(axis, item), self.reach));
        (inside.lit >= ENOUGH
            && outside.missed >= 2.0 * ENOUGH
            && inside.missed <= 0.5 * outside.missed)
            .then_some(Probe::Rim(point))
    }

    /// Looks from a point into some directions.
    fn look(&self, at: DVec3, directions: impl Iterator<Item = Vec3>, far: f64) -> Side {
        let origin = at.as_vec3();
        let rays: Vec<Ray> = directions
            .map(|direction| Ray::new(origin, direction))
            .collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        self.world.bvh().closest_hits(&rays, &mut hits);
        let mut side = Side::default();
        for ((ray, hit), met) in rays.iter().zip(&hits).zip(met(self.world, &rays)) {
            let is_far = f64::from(hit.t) > far;
            match met {
                Met::Nothing => {
                    side.out += 1.0;
                    side.missed += 1.0;
                }
                Met::Back(_) if is_far => side.out += 1.0,
                Met::Lit(_) if is_far => {
                    side.lit += 1.0;
                    side.witnesses.push(ray.at(WITNESS * hit.t));
                }
                Met::Lit(_) | Met::Back(_) => {}
            }
        }
        // Some of them, from one end of the fan to the other.
        let step = side.witnesses.len().div_ceil(WITNESSES).max(1);
        side.witnesses = side.witnesses.into_iter().step_by(step).collect();
        for share in [&mut side.lit, &mut side.out, &mut side.missed] {
            *share /= f64::from(RAYS);
        }
        side
    }
}

/// Directions around an axis in the plane of it and `along`, by the cosine from the axis.
fn flat_fan(axis: DVec3, along: DVec3) -> impl Iterator<Item = Vec3> {
    (0..RAYS).map(move |ray| {
        let sine = (2.0 * f64::from(ray) + 1.0) / f64::from(RAYS) - 1.0;
        (axis * (1.0 - sine * sine).sqrt() + along * sine).as_vec3()
    })
}

/// Directions of the hemisphere around an axis, by the cosine from it.
fn hemisphere(axis: DVec3, item: u64) -> impl Iterator<Item = Vec3> {
    let frame = Frame::around(axis.as_vec3());
    let sequence = Sequence::new(0, Stage::AUDIT, (1 << 40) + item);
    (0..RAYS).map(move |ray| frame.to_world(cosine_hemisphere::sample(sequence.point2_f32(ray))))
}

/// Part of the way to a hit at which its witness stands, so that it is off the surface.
const WITNESS: f32 = 0.999;

/// What is on one side of a gap: shares of the rays.
#[derive(Default)]
struct Side {
    /// Lit surfaces beyond the gap itself.
    lit: f64,
    /// Nothing, or backs beyond the gap itself.
    out: f64,
    /// Nothing.
    missed: f64,
    /// Points before the lit surfaces.
    witnesses: Vec<Vec3>,
}

#[cfg(test)]
mod tests;
