//! One sample of direct light at many points.
//!
//! A source i is chosen with probability E_i/ΣE, its unoccluded share of the irradiance (exact),
//! then a point on it by projected solid angle, so that the estimate is
//!
//! (ΣE/E_i) · L_i cos θ V / p(ω) ≈ ΣE · V:
//!
//! unbiased, because the density p is exact, and bounded, because it is nearly the integrand
//! itself. Paths may meet the same source by a direction drawn by the cosine, with density
//! cos θ / π: [`weight`] is the balance heuristic that shares the light out between the two, where
//! both could have found it (E. Veach, L. Guibas, "Optimally combining sampling techniques for
//! Monte Carlo rendering", SIGGRAPH 1995). Source of the parts: see [`luxel_solver::sampling`];
//! E_i by Lambert's formula. Cost: about 50 ns a source and point, and one ray.

use glam::DVec3;
use luxel_scenes::Rgb;
use luxel_solver::bvh::Ray;
use luxel_solver::direct::Source;
use luxel_solver::geometry::ray_target;
use luxel_solver::sampling::ProjectedSphericalTriangle;
use luxel_solver::world::{Receiver, World};
use std::f64::consts::PI;

/// A shadow ray with the irradiance (W/m²) that arrives if nothing blocks it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Connection {
    /// To the light; open at both ends.
    pub(super) ray: Ray,
    /// Estimate of the irradiance from all sources, without the visibility.
    pub(super) irradiance: Rgb,
    /// Unit vector to the light, with its density per solid angle; `None` for a light that only
    /// connections can find (a point, a direction).
    pub(super) density: Option<(DVec3, f64)>,
}

/// The balance heuristic: the share of a connection in the light from a direction that a cosine
/// sample could have found as well. `density` is that of the connection, per solid angle.
pub(super) fn weight(receiver: &Receiver, direction: DVec3, density: f64) -> f64 {
    let cosine = receiver.normal.dot(direction).max(0.0) / PI;
    density / (density + cosine)
}

/// The density per solid angle with which [`connect`] draws `direction`, in which `receiver` sees
/// the source of the given index.
pub(super) fn density(
    world: &World<'_>,
    receiver: &Receiver,
    index: usize,
    direction: DVec3,
) -> f64 {
    let contribution = |source: &Source| {
        source
            .irradiance(receiver.position, receiver.normal)
            .element_sum()
    };
    let sources = world.lights().sources();
    let Source::Polygon { shape, .. } = &sources[index] else {
        return 0.0;
    };
    let own = contribution(&sources[index]);
    if own <= 0.0 {
        return 0.0;
    }
    let total: f64 = sources.iter().map(contribution).sum();
    let solid_angle: f64 = fan(receiver, shape.corners())
        .map(|(seen, _)| seen.triangle().solid_angle())
        .sum();
    // The triangle that the direction lies deepest in: rounding may leave it outside of all.
    let depth = |seen: &ProjectedSphericalTriangle| {
        let [a, b, c] = seen.triangle().corners();
        let side = a.cross(b).dot(c).signum();
        let edge = |p: DVec3, q: DVec3| p.cross(q).dot(direction) * side;
        edge(a, b).min(edge(b, c)).min(edge(c, a))
    };
    fan(receiver, shape.corners())
        .map(|(seen, _)| seen)
        .max_by(|a, b| depth(a).total_cmp(&depth(b)))
        .map_or(0.0, |seen| {
            let chosen = seen.triangle().solid_angle() / solid_angle;
            own / total * chosen * seen.pdf(direction)
        })
}

/// The triangles of a convex polygon that `receiver` sees under a solid angle.
fn fan<'c>(
    receiver: &'c Receiver,
    corners: &'c [DVec3],
) -> impl Iterator<Item = (ProjectedSphericalTriangle, [DVec3; 3])> + 'c {
    corners[1..].windows(2).filter_map(|pair| {
        let triangle = [corners[0], pair[0], pair[1]];
        let seen = ProjectedSphericalTriangle::new(receiver.position, receiver.normal, triangle)?;
        Some((seen, triangle))
    })
}

/// Chooses a source and a point on it for `receiver`. `choice` and `position` are uniform in [0, 1).
/// `face_normal` is the face's own normal: light from behind the face never arrives, whatever the
/// shading normal says. `None` where no light arrives. `scratch` is working space.
pub(super) fn connect(
    world: &World<'_>,
    receiver: &Receiver,
    face_normal: DVec3,
    choice: f64,
    position: [f64; 2],
    scratch: &mut Vec<f64>,
) -> Option<Connection> {
    let sources = world.lights().sources();
    scratch.clear();
    let mut total = 0.0;
    for source in sources {
        let irradiance = source.irradiance(receiver.position, receiver.normal);
        total += irradiance.element_sum();
        scratch.push(total);
    }
    if total <= 0.0 || total.is_nan() {
        return None;
    }
    let threshold = choice * total;
    let index = scratch
        .partition_point(|&sum| sum <= threshold)
        .min(sources.len() - 1);
    let before = if index == 0 { 0.0 } else { scratch[index - 1] };
    let share = (scratch[index] - before) / total;
    if share <= 0.0 {
        return None;
    }
    let source = &sources[index];
    let (ray, towards, irradiance, density) = match source {
        Source::Polygon {
            shape,
            normal,
            extent,
            radiance,
        } => {
            let (point, direction, pdf) = sample_polygon(receiver, shape.corners(), position)?;
            let cosine = direction.dot(receiver.normal);
            // Points of a polygon behind its own plane send nothing: the exact E_i is zero there,
            // so that such a source is never chosen.
            let target = ray_target(point, *normal, *extent, receiver.origin);
            let ray = Ray::segment(receiver.origin, target);
            let irradiance = radiance.0 * (cosine.max(0.0) / pdf);
            (ray, direction, irradiance, Some((direction, pdf * share)))
        }
        Source::Point { position, .. } => {
            let ray = Ray::segment(receiver.origin, position.as_vec3());
            let irradiance = source.irradiance(receiver.position, receiver.normal);
            (ray, *position - receiver.position, irradiance, None)
        }
        Source::Directional { towards, .. } => {
            let ray = Ray::new(receiver.origin, towards.as_vec3());
            let irradiance = source.irradiance(receiver.position, receiver.normal);
            (ray, *towards, irradiance, None)
        }
    };
    (towards.dot(face_normal) > 0.0 && irradiance.max_element() > 0.0).then(|| Connection {
        ray,
        irradiance: irradiance / share,
        density,
    })
}

/// A point of a convex polygon, its unit direction and density per solid angle: a triangle of the
/// fan by its solid angle, then a point in it by projected solid angle.
fn sample_polygon(
    receiver: &Receiver,
    corners: &[DVec3],
    mut u: [f64; 2],
) -> Option<(DVec3, DVec3, f64)> {
    let triangles = || fan(receiver, corners);
    let solid_angle: f64 = triangles()
        .map(|(seen, _)| seen.triangle().solid_angle())
        .sum();
    let mut rest = u[0] * solid_angle;
    let mut chosen = None;
    for (seen, triangle) in triangles() {
        let own = seen.triangle().solid_angle();
        chosen = Some((seen, triangle, own));
        if rest < own {
            break;
        }
        rest -= own;
    }
    let (seen, [a, b, c], own) = chosen?;
    u[0] = (rest / own).clamp(0.0, 1.0 - f64::EPSILON);
    let sample = seen.sample(u);
    let [wa, wb, wc] = sample.barycentric;
    let point = a * wa + b * wb + c * wc;
    Some((point, sample.direction, sample.pdf * own / solid_angle))
}
