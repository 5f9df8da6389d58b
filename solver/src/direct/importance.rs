//! Roughly how much each source lights a point: what one ray for all of them is given by.
//!
//! A polygon of area A, radius r and centre at distance d, at height h above its plane and H above the receiver's
//! horizon, with radiosity M and a = A/π:
//!
//!   w = M a H⁺ h / ((d² + a) √((d² + a) max(h², d² − r²))),   H⁺ = H, or (H + r)²/4r for |H| < r,
//!
//! which is M times the form factor of a disk on the axis and of any polygon from afar; near its border the
//! cosine at the polygon counts as that to its nearest point, and a polygon that the horizon cuts by what of its
//! sphere is above. So w is zero only where the irradiance is, and E/w stays within a small factor: one source drawn
//! in proportion to w gives E V Σw / w, unbiased, at the cost of a few nanoseconds a source and one exact
//! E. Single precision, eight polygons at once. Point sources and parallel light count as what they are.
//!
//! Source: the disk is that of any textbook (J. R. Howell, catalogue B-12); one-sample estimates of many lights after P.
//! Shirley, C. Wang, K. Zimmerman, "Monte Carlo techniques for direct lighting calculations", ACM TOG 15(1),
//! 1996. Cost: O(sources).

use super::lights::Source;
use glam::{DVec3, Vec3};
use std::f32::consts::PI;

/// Polygons at once: the widest vector registers.
const LANES: usize = 8;

/// Heights that rounding of single precision may have made of zero or less, in units.
const ROUNDING: f32 = 1e-6;

type Lanes = [f32; LANES];

/// Eight polygons; lanes without one have no strength.
#[derive(Clone, Debug, Default)]
struct Eight {
    centre: [Lanes; 3],
    normal: [Lanes; 3],
    radius: Lanes,
    /// A/π.
    area: Lanes,
    /// M A/π, the sum over channels.
    strength: Lanes,
}

/// The sources of a scene.
#[derive(Clone, Debug, Default)]
pub(super) struct Importance {
    polygons: Vec<Eight>,
    count: usize,
}

impl Importance {
    /// Of sources, the polygons among them first.
    pub(super) fn new(sources: &[Source]) -> Self {
        let mut polygons: Vec<Eight> = Vec::new();
        let mut count = 0;
        for source in sources {
            let Source::Polygon {
                shape,
                normal,
                radiance,
                ..
            } = source
            else {
                break;
            };
            let lane = count % LANES;
            if lane == 0 {
                polygons.push(Eight::default());
            }
            let eight = &mut polygons[count / LANES];
            let (centre, normal) = (shape.centre().as_vec3(), normal.as_vec3());
            for axis in 0..3 {
                eight.centre[axis][lane] = centre[axis];
                eight.normal[axis][lane] = normal[axis];
            }
            let area = shape.area() as f32 / PI;
            eight.radius[lane] = shape.radius() as f32;
            eight.area[lane] = area;
            eight.strength[lane] = area * radiance.to_irradiance().0.element_sum() as f32;
            count += 1;
        }
        Self { polygons, count }
    }

    /// Writes the weight of each source at a point of the unit frame with the given unit normal.
    pub(super) fn weigh(
        &self,
        sources: &[Source],
        position: DVec3,
        normal: DVec3,
        weights: &mut Vec<f32>,
    ) {
        weights.clear();
        let (x, n) = (position.as_vec3(), normal.as_vec3());
        for eight in &self.polygons {
            weights.extend(eight.weights(x, n));
        }
        weights.truncate(self.count);
        let rest = sources[self.count..].iter();
        weights.extend(rest.map(|source| source.irradiance(position, normal).element_sum() as f32));
    }
}

impl Eight {
    #[inline]
    fn weights(&self, x: Vec3, n: Vec3) -> Lanes {
        std::array::from_fn(|lane| {
            let to = [
                self.centre[0][lane] - x.x,
                self.centre[1][lane] - x.y,
                self.centre[2][lane] - x.z,
            ];
            let dot = |v: [f32; 3]| v[0] * to[0] + v[1] * to[1] + v[2] * to[2];
            let (radius, area) = (self.radius[lane], self.area[lane]);
            let squared = dot(to);
            let height = -dot([
                self.normal[0][lane],
                self.normal[1][lane],
                self.normal[2][lane],
            ]);
            let raised = dot([n.x, n.y, n.z]);
            let above = raised + radius;
            let partly = above * above / (4.0 * radius.max(f32::MIN_POSITIVE));
            let raised = if raised >= radius { raised } else { partly };
            let nearest = (height * height).max(squared - radius * radius);
            let reach = squared + area;
            let root = (reach * nearest.max(ROUNDING * ROUNDING)).sqrt();
            let weight =
                self.strength[lane] * (raised + ROUNDING) * (height + ROUNDING) / (reach * root);
            if height.min(above) > -ROUNDING {
                weight
            } else {
                0.0
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::direct::Luminaire;
    use crate::sampling::Stage;
    use crate::sampling::hash::uniform;
    use luxel_scenes::Radiance;

    /// A random parallelogram of radiosity 1 in the unit cube.
    fn polygon(item: u64) -> Source {
        let random = |d| 2.0 * uniform(8, Stage::DIRECT, item, d) - 1.0;
        let vector = |d| DVec3::new(random(d), random(d + 1), random(d + 2));
        let size = 10.0_f64.powf(1.5 * random(9) - 1.5);
        let (e, f) = (vector(3) * size, vector(6) * size);
        let corner = vector(0);
        Source::Polygon {
            shape: Luminaire::new(vec![corner, corner + e, corner + e + f, corner + f]),
            normal: e.cross(f).normalize(),
            extent: size,
            radiance: Radiance(luxel_scenes::Rgb::new(
                std::f64::consts::FRAC_1_PI,
                0.0,
                0.0,
            )),
        }
    }

    #[test]
    fn weights_are_of_the_size_of_the_irradiance() {
        let (mut afar, mut largest) = (0.0_f64, 0.0_f64);
        for item in 0..20_000 {
            let sources = [polygon(item)];
            let random = |d| 2.0 * uniform(9, Stage::DIRECT, item, d) - 1.0;
            let position = DVec3::new(random(0), random(1), random(2));
            let normal = DVec3::new(random(3), random(4), random(5)).normalize();
            let mut weights = Vec::new();
            Importance::new(&sources).weigh(&sources, position, normal, &mut weights);
            let weight = f64::from(weights[0]);
            let irradiance = sources[0].irradiance(position, normal).x;
            let Source::Polygon { shape, .. } = &sources[0] else {
                unreachable!("a polygon")
            };
            if irradiance < 1e-9 {
                continue;
            }
            let ratio = irradiance / weight;
            largest = largest.max(ratio);
            let distance = position.distance(shape.centre());
            let cosine = (shape.centre() - position).dot(normal) / distance;
            if shape.radius() < 0.01 * distance && cosine > 0.1 {
                afar = afar.max((ratio - 1.0).abs());
            }
        }
        // From afar: (r/d)² and, for a light seen at a cosine above 0.1 by both, some r/d over it.
        assert!(afar < 0.1, "afar the ratio differs from 1 by {afar}");
        // Bounded noise of one ray: no light outshines its weight by more.
        assert!(
            largest < 5.0,
            "the irradiance is {largest} times its weight"
        );
    }
}
