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
//! E. What depends on the receiver is in single precision, eight polygons at once; radiosities are not, and may differ by
//! any ratio. Point sources and parallel light count as what they are.
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

/// Eight polygons.
#[derive(Clone, Debug, Default)]
struct Eight {
    centre: [Lanes; 3],
    normal: [Lanes; 3],
    radius: Lanes,
    /// A/π.
    area: Lanes,
}

/// The sources of a scene.
#[derive(Clone, Debug, Default)]
pub(super) struct Importance {
    polygons: Vec<Eight>,
    /// M of each polygon in W/m², the sum over channels.
    radiosity: Vec<f64>,
}

impl Importance {
    /// Of sources, the polygons among them first.
    pub(super) fn new(sources: &[Source]) -> Self {
        let mut polygons: Vec<Eight> = Vec::new();
        let mut radiosities = Vec::new();
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
            let index = radiosities.len();
            let lane = index % LANES;
            if lane == 0 {
                polygons.push(Eight::default());
            }
            let eight = &mut polygons[index / LANES];
            let (centre, normal) = (shape.centre().as_vec3(), normal.as_vec3());
            for axis in 0..3 {
                eight.centre[axis][lane] = centre[axis];
                eight.normal[axis][lane] = normal[axis];
            }
            eight.radius[lane] = shape.radius() as f32;
            eight.area[lane] = shape.area() as f32 / PI;
            radiosities.push(radiance.to_irradiance().0.element_sum());
        }
        Self {
            polygons,
            radiosity: radiosities,
        }
    }

    /// Writes the weight of each source at a point of the unit frame with the given unit normal.
    pub(super) fn weigh(
        &self,
        sources: &[Source],
        position: DVec3,
        normal: DVec3,
        weights: &mut Vec<f64>,
    ) {
        weights.clear();
        let (x, n) = (position.as_vec3(), normal.as_vec3());
        for (eight, radiosities) in self.polygons.iter().zip(self.radiosity.chunks(LANES)) {
            let factors = eight.factors(x, n);
            let products = radiosities.iter().zip(factors);
            weights.extend(products.map(|(radiosity, factor)| radiosity * f64::from(factor)));
        }
        let rest = sources[self.radiosity.len()..].iter();
        weights.extend(rest.map(|source| source.irradiance(position, normal).element_sum()));
    }
}

impl Eight {
    /// w/M.
    #[inline]
    fn factors(&self, x: Vec3, n: Vec3) -> Lanes {
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
            let reach = (squared + area).max(ROUNDING * ROUNDING);
            let root = (reach * nearest.max(ROUNDING * ROUNDING)).sqrt();
            let factor = area * (raised + ROUNDING) * (height + ROUNDING) / (reach * root);
            if height.min(above) > -ROUNDING {
                factor
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
            let weight = weights[0];
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
        // From afar the cosine at the receiver varies by r/d over the light, a tenth of itself where it is above
        // 0.1; that at the light by (r/d)².
        assert!(afar < 0.1, "afar the ratio differs from 1 by {afar}");
        // Bounded noise of one ray: no light outshines its weight by more.
        assert!(
            largest < 5.0,
            "the irradiance is {largest} times its weight"
        );
    }

    #[test]
    fn a_weight_is_finite_and_in_proportion_to_the_radiosity() {
        let Source::Polygon {
            shape,
            normal,
            extent,
            radiance,
        } = polygon(1)
        else {
            unreachable!("a polygon")
        };
        let of = |factor: f64, position: DVec3| {
            let sources = [Source::Polygon {
                shape: shape.clone(),
                normal,
                extent,
                radiance: Radiance(radiance.0 * factor),
            }];
            let mut weights = Vec::new();
            Importance::new(&sources).weigh(&sources, position, normal, &mut weights);
            weights[0]
        };
        // Beyond what single precision holds; one product of f64 each.
        let below = shape.centre() + normal * 0.1;
        let above = -normal;
        let (one, dim) = (of(1.0, below), of(1e-100, below));
        assert!(
            (dim - one * 1e-100).abs() <= 1e-15 * dim.abs(),
            "{one} {dim}"
        );
        for position in [shape.centre(), shape.corners()[0], above] {
            assert!(of(1e100, position).is_finite(), "at {position}");
        }
    }
}
