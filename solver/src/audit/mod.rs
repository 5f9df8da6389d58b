//! What is suspicious about a scene that only rays can find: backs of faces in the light, objects
//! inside solids, eyes inside walls, lights inside housings, gaps that light leaves a room by.
//!
//! Rays leave points spread over the lit sides of all faces, the eyes of cameras and the point
//! lights. Where most rays from a point meet the backs of one-sided faces, the point lies inside a
//! solid; where some rays from the open do, a face is turned over or misses its other side, and
//! swallows the light that it should reflect. Deterministic; independent of threads.
//!
//! Validity: a back is found when it fills about 1e-5 of what an average point sees. Cost: at most
//! 300 000 rays and 64 for each light, 0.1–0.5 s.

mod finding;
mod leaks;
mod tally;

pub use finding::{Finding, LeadsTo, Place};

use crate::bvh::Ray;
use crate::geometry::offset_bound;
use crate::patches::{PatchId, PatchSize, Patches, Side};
use crate::sampling::{Frame, Sequence, Stage, cosine_hemisphere, sphere};
use crate::world::World;
use glam::{DVec3, Vec3};
use luxel_scenes::check::FaceRef;
use luxel_scenes::{Light, LightKind};
use rayon::prelude::*;
use std::f64::consts::FRAC_PI_2;
use tally::{Met, Tally, met};

/// Points on all faces together, spread by area. Fewer, and objects of a ten-thousandth of the
/// area are often missed; more take longer than loading the scene.
const POINTS: u32 = 16_384;

/// Rays from each point: enough to tell a point in a corner from one inside a solid.
const RAYS: u32 = 16;

/// Rays from each light.
const LIGHT_RAYS: u32 = 64;

/// Fraction of back hits from which a point, an eye or a light counts as inside a solid: a point
/// before a wall that is turned over sees half of them at most.
const INSIDE: f64 = 0.5;

/// Share of the rays that meet an object from which its back matters. Below it the fault is small
/// or hidden, and only noted.
const SHARE: f64 = 0.01;

/// Share of an object's own points inside solids from which the object as a whole is.
const BURIED: f64 = 0.95;

/// Points per parallel task.
const CHUNK: u32 = 1024;

/// An eye with rays over its picture.
#[derive(Clone, Debug)]
pub struct View {
    /// The camera's name.
    pub camera: String,
    /// Position of the eye in metres; `None` for parallel rays.
    pub eye: Option<DVec3>,
    /// Rays in the unit frame, evenly over the picture.
    pub rays: Vec<Ray>,
}

/// Everything suspicious that rays find, the more serious first, always in the same order.
pub fn report(world: &World, views: &[View]) -> Vec<Finding> {
    let surfaces = from_surfaces(world);
    let mut findings = surfaces.backs(world, None);
    findings.extend(surfaces.buried(world));
    findings.extend(leaks::report(world, lit_area(world), surfaces.escaping()));
    for view in views {
        if let Some(finding) = inside_view(world, view) {
            findings.push(finding);
        } else {
            let mut tally = Tally::new(world);
            tally.add(&met(world, &view.rays));
            for seen in tally.backs(world, Some(&view.camera)) {
                // What surfaces or another camera see is said once.
                if !findings.iter().any(|known| known.is_about_same_back(&seen)) {
                    findings.push(seen);
                }
            }
        }
        findings.extend(eye_on_face(world, view));
    }
    let lights = world.scene().lights.iter();
    findings.extend(lights.filter_map(|light| inside_light(world, light)));
    findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity()));
    findings
}

/// Whether the eye of a view is inside a solid: most of its rays meet backs.
pub fn inside_view(world: &World, view: &View) -> Option<Finding> {
    let (fraction, place) = inside(world, &view.rays)?;
    Some(Finding::CameraInside {
        camera: view.camera.clone(),
        fraction,
        place,
    })
}

/// The fraction of rays that meet backs, and the face that most of them meet, when it is more than
/// [`INSIDE`].
fn inside(world: &World, rays: &[Ray]) -> Option<(f64, Place)> {
    let mut tally = Tally::new(world);
    tally.add(&met(world, rays));
    let fraction = f64::from(tally.total_backs()) / rays.len().max(1) as f64;
    if fraction <= INSIDE {
        return None;
    }
    Some((fraction, tally.most_seen_back(world, None)?))
}

/// A face that the eye of a view lies on, up to rounding.
fn eye_on_face(world: &World, view: &View) -> Option<Finding> {
    let geometry = world.surfaces().geometry();
    let position = geometry.frame().to_unit(view.eye?);
    if position.abs().max_element() > 1.0 {
        return None;
    }
    // Twice the bound on what rounding does to the eye and to the face; along the seven axes and
    // diagonals, one of which crosses any plane at less than 55° from its normal.
    let reach = 4.0 * offset_bound(position, 1.0);
    let directions = [
        Vec3::X,
        Vec3::Y,
        Vec3::Z,
        Vec3::new(1.0, 1.0, 1.0),
        Vec3::new(1.0, 1.0, -1.0),
        Vec3::new(1.0, -1.0, 1.0),
        Vec3::new(-1.0, 1.0, 1.0),
    ];
    let rays = directions.map(|direction| {
        let direction = direction.normalize();
        let mut ray = Ray::new(
            (position - direction.as_dvec3() * reach).as_vec3(),
            direction,
        );
        ray.tmax = 2.0 * reach as f32;
        ray
    });
    let faces = met(world, &rays).into_iter().filter_map(Met::face).min();
    Some(Finding::CameraOnFace {
        camera: view.camera.clone(),
        face: FaceRef::new(world.scene(), faces?),
    })
}

/// Whether a point or spot light is inside a solid.
fn inside_light(world: &World, light: &Light) -> Option<Finding> {
    let (position, cone) = match light.kind {
        LightKind::Point { position, .. } => (position, None),
        LightKind::Lambertian {
            position,
            direction,
            ..
        } => (position, Some((direction, FRAC_PI_2))),
        LightKind::Spot {
            position,
            direction,
            outer_angle,
            ..
        } => (position, Some((direction, outer_angle))),
        _ => return None,
    };
    let origin = world.surfaces().geometry().frame().to_unit(position);
    let sequence = Sequence::new(0, Stage::AUDIT, u64::from(u32::MAX));
    let rays: Vec<Ray> = (0..LIGHT_RAYS)
        .map(|index| {
            let u = sequence.point2_f32(index);
            let direction = match cone {
                None => sphere::sample_sphere(u),
                Some((axis, angle)) => in_cone(axis.as_vec3(), angle as f32, u),
            };
            Ray::new(origin.as_vec3(), direction)
        })
        .collect();
    let (fraction, place) = inside(world, &rays)?;
    Some(Finding::LightInside {
        light: light.name.clone(),
        fraction,
        place,
    })
}

/// A direction at most `angle` (radians) from `axis`, uniform by solid angle.
fn in_cone(axis: Vec3, angle: f32, [x, y]: [f32; 2]) -> Vec3 {
    let cosine = 1.0 - x * (1.0 - angle.cos());
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let (sin, cos) = (std::f32::consts::TAU * y).sin_cos();
    Frame::around(axis).to_world(Vec3::new(sine * cos, sine * sin, cosine))
}

/// Area of the lit sides of all faces, in square units.
fn lit_area(world: &World) -> f64 {
    let surfaces = world.surfaces();
    let sides = |face| [Side::Front, Side::Back].map(|side| surfaces.has_side(face, side));
    let lit = |face| sides(face).into_iter().filter(|lit| *lit).count();
    let faces = world.scene().face_ids();
    faces
        .map(|face| surfaces.area(face) * lit(face) as f64)
        .sum()
}

/// What points all over the lit sides of faces see.
fn from_surfaces(world: &World) -> Tally {
    let mut total = Tally::new(world);
    // One patch for each lit side of each face.
    let Ok(sides) = world.mesh(PatchSize::Whole) else {
        return total;
    };
    let mut sum = 0.0;
    let cumulative: Vec<f64> = sides
        .areas()
        .iter()
        .map(|area| {
            sum += area;
            sum
        })
        .collect();
    let chunks: Vec<Tally> = (0..POINTS.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let mut tally = Tally::new(world);
            let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(POINTS);
            look_around(world, &sides, &cumulative, range, &mut tally);
            tally
        })
        .collect();
    for tally in &chunks {
        total.merge(tally);
    }
    total
}

/// Adds what some of the points see.
fn look_around(
    world: &World,
    sides: &Patches,
    cumulative: &[f64],
    points: std::ops::Range<u32>,
    tally: &mut Tally,
) {
    let Some(&area) = cumulative.last() else {
        return;
    };
    let surfaces = world.surfaces();
    let places = Sequence::new(0, Stage::AUDIT, 0);
    let mut rays = Vec::new();
    let mut objects = Vec::new();
    for index in points {
        // Systematic along the faces, so that each gets its share of points.
        let place = area * (f64::from(index) + 0.5) / f64::from(POINTS);
        let side = cumulative.partition_point(|&sum| sum <= place);
        let side = PatchId::new(side.min(cumulative.len() - 1));
        let point = sides.sample(surfaces.geometry(), side, places.point2(index));
        let frame = Frame::around(point.normal.as_vec3());
        let directions = Sequence::new(0, Stage::AUDIT, 1 + u64::from(index));
        rays.extend((0..RAYS).map(|ray| {
            let local = cosine_hemisphere::sample(directions.point2_f32(ray));
            Ray::new(point.origin, frame.to_world(local))
        }));
        objects.push(surfaces.scene().faces[point.face.index()].object);
    }
    let met = met(world, &rays);
    for (object, met) in objects.into_iter().zip(met.chunks(RAYS as usize)) {
        tally.add_point(object, met);
    }
}

#[cfg(test)]
mod tests;
