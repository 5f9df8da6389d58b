//! Mirrors and smooth dielectric boundaries.
//!
//! With ω the unit direction *to* the viewer, n the unit normal on the viewer's side, and
//! η = n_t/n_i the index beyond the boundary over the index on the viewer's side:
//!
//! - reflection: r = 2(ω·n)n − ω;
//! - Snell: sin θ_t = sin θ_i/η, t = −ω/η + (cos θ_i/η − cos θ_t)n; total reflection where
//!   sin θ_t > 1;
//! - Fresnel, unpolarised: F = (r∥² + r⊥²)/2 with r∥ = (η cos θ_i − cos θ_t)/(η cos θ_i + cos θ_t),
//!   r⊥ = (cos θ_i − η cos θ_t)/(cos θ_i + η cos θ_t).
//!
//! Radiance that crosses the boundary towards the viewer is multiplied by 1/η², because a bundle
//! of rays widens; it cancels for light that enters a body and leaves it again. Source: M. Born,
//! E. Wolf, "Principles of Optics", 7th ed. 1999, section 1.5.2; the factor: M. Pharr, W. Jakob,
//! G. Humphreys, "Physically Based Rendering", 4th ed. 2023, section 9.5.2. Exact for smooth
//! boundaries of media that do not absorb.

use glam::DVec3;

/// The mirror image of the direction to the viewer, both pointing away from the surface.
pub(super) fn reflect(view: DVec3, normal: DVec3) -> DVec3 {
    (normal * (2.0 * view.dot(normal)) - view).normalize()
}

/// What a smooth boundary does with a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Boundary {
    /// Fraction F that is reflected, in [0, 1]; 1 for total reflection.
    pub(super) fresnel: f64,
    /// Unit direction of the refracted ray; `None` for total reflection.
    pub(super) refracted: Option<DVec3>,
    /// Factor 1/η² on radiance that arrives along `refracted`.
    pub(super) radiance_scale: f64,
}

/// The boundary between the viewer's medium and one of relative index `eta`, seen from `view`.
pub(super) fn boundary(view: DVec3, normal: DVec3, eta: f64) -> Boundary {
    let cos_i = view.dot(normal).clamp(0.0, 1.0);
    let sin2_t = (1.0 - cos_i * cos_i) / (eta * eta);
    let radiance_scale = 1.0 / (eta * eta);
    if sin2_t >= 1.0 {
        return Boundary {
            fresnel: 1.0,
            refracted: None,
            radiance_scale,
        };
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    let parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let refracted = normal * (cos_i / eta - cos_t) - view / eta;
    Boundary {
        fresnel: 0.5 * (parallel * parallel + perpendicular * perpendicular),
        refracted: Some(refracted.normalize()),
        radiance_scale,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(degrees: f64) -> DVec3 {
        let (sin, cos) = degrees.to_radians().sin_cos();
        DVec3::new(sin, 0.0, cos)
    }

    #[test]
    fn a_mirror_turns_the_tangent_part_only() {
        let r = reflect(view(30.0), DVec3::Z);
        assert!((r - view(-30.0)).length() < 1e-15);
    }

    #[test]
    fn snell_and_fresnel_of_glass() {
        // Normal incidence: ((n − 1)/(n + 1))² = 4 % for n = 1.5.
        let head_on = boundary(DVec3::Z, DVec3::Z, 1.5);
        assert!((head_on.fresnel - 0.04).abs() < 1e-15);
        assert_eq!(head_on.refracted, Some(DVec3::NEG_Z));
        let oblique = boundary(view(40.0), DVec3::Z, 1.5);
        let t = oblique.refracted.expect("no total reflection from outside");
        let sin_t = 40f64.to_radians().sin() / 1.5;
        assert!((t - DVec3::new(-sin_t, 0.0, -(1.0 - sin_t * sin_t).sqrt())).length() < 1e-15);
        // Grazing light is reflected.
        assert!(boundary(view(89.9999), DVec3::Z, 1.5).fresnel > 0.9999);
    }

    #[test]
    fn brewsters_angle_reflects_one_polarisation_only() {
        let brewster = 1.5_f64.atan().to_degrees();
        let result = boundary(view(brewster), DVec3::Z, 1.5);
        // r∥ = 0 and r⊥ = (1 − n²)/(1 + n²), so that F = r⊥²/2.
        let perpendicular: f64 = (1.0 - 2.25) / (1.0 + 2.25);
        assert!((result.fresnel - 0.5 * perpendicular * perpendicular).abs() < 1e-15);
    }

    #[test]
    fn inside_glass_light_is_totally_reflected_beyond_the_critical_angle() {
        let critical = (1.0 / 1.5_f64).asin().to_degrees();
        let below = boundary(view(critical - 0.01), DVec3::Z, 1.0 / 1.5);
        assert!(below.refracted.is_some() && below.fresnel < 1.0);
        let above = boundary(view(critical + 0.01), DVec3::Z, 1.0 / 1.5);
        assert_eq!((above.fresnel, above.refracted), (1.0, None));
    }

    #[test]
    fn a_way_in_and_out_is_reciprocal() {
        let enter = boundary(view(50.0), DVec3::Z, 1.5);
        let inside = enter.refracted.expect("refraction");
        // From the other side: the viewer stands along −t … seen along t the normal is −z.
        let leave = boundary(inside, DVec3::NEG_Z, 1.0 / 1.5);
        let out = leave.refracted.expect("refraction");
        assert!((out - view(50.0)).length() < 1e-14);
        assert!((enter.fresnel - leave.fresnel).abs() < 1e-14);
        assert!((enter.radiance_scale * leave.radiance_scale - 1.0).abs() < 1e-15);
    }
}
