//! One sample of direct light at many points.
//!
//! A source i is chosen with probability E_i/ΣE, its unoccluded share of the irradiance (exact),
//! then a point on it by projected solid angle, so that the estimate is
//!
//! (ΣE/E_i) · L_i cos θ V / p(ω) ≈ ΣE · V:
//!
//! unbiased, because the density p is exact, and bounded, because it is nearly the integrand
//! itself. What is left of the variance is the visibility V, which no other strategy of sampling
//! knows better; combining with directions drawn by the cosine (multiple importance sampling)
//! would add only noise here. Source of the parts: see [`luxel_solver::sampling`]; E_i by Lambert's
//! formula. Cost: about 50 ns a source and point, and one ray.

use glam::DVec3;
use luxel_scenes::Rgb;
use luxel_solver::bvh::Ray;
use luxel_solver::direct::Source;
use luxel_solver::geometry::ray_origin;
use luxel_solver::sampling::ProjectedSphericalTriangle;
use luxel_solver::world::{Receiver, World};

/// A shadow ray with the irradiance (W/m²) that arrives if nothing blocks it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Connection {
    /// To the light; open at both ends.
    pub(super) ray: Ray,
    /// Estimate of the irradiance from all sources, without the visibility.
    pub(super) irradiance: Rgb,
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
    let (ray, towards, irradiance) = match source {
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
            let ray = Ray::segment(receiver.origin, ray_origin(point, *normal, *extent));
            (ray, direction, radiance.0 * (cosine.max(0.0) / pdf))
        }
        Source::Point { position, .. } => {
            let ray = Ray::segment(receiver.origin, position.as_vec3());
            let irradiance = source.irradiance(receiver.position, receiver.normal);
            (ray, *position - receiver.position, irradiance)
        }
        Source::Directional { towards, .. } => {
            let ray = Ray::new(receiver.origin, towards.as_vec3());
            let irradiance = source.irradiance(receiver.position, receiver.normal);
            (ray, *towards, irradiance)
        }
    };
    (towards.dot(face_normal) > 0.0 && irradiance.max_element() > 0.0).then(|| Connection {
        ray,
        irradiance: irradiance / share,
    })
}

/// A point of a convex polygon, its unit direction and density per solid angle: a triangle of the
/// fan by its solid angle, then a point in it by projected solid angle.
fn sample_polygon(
    receiver: &Receiver,
    corners: &[DVec3],
    mut u: [f64; 2],
) -> Option<(DVec3, DVec3, f64)> {
    let triangles = || {
        corners[1..].windows(2).filter_map(|pair| {
            let triangle = [corners[0], pair[0], pair[1]];
            let seen =
                ProjectedSphericalTriangle::new(receiver.position, receiver.normal, triangle)?;
            Some((seen, triangle))
        })
    };
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
