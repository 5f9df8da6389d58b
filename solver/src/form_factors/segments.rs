//! The share of the exchange between two polygons that is visible, by segments.
//!
//! V = Σ w v / Σ w over segments between points spread evenly over P and Q, with the kernel
//! w = cos θ_p cos θ_q / r² and v = 1 where nothing is hit. For pairs with too many occluders to subtract
//! them (see `occluded`). A ratio, hence biased by O(1/N), with a standard error from independent
//! randomisations that falls as N^-0.5. Source: D. R. Baum, H. E. Rushmeier, J. M. Winget, "Improving
//! radiosity solutions through the use of analytically determined form-factors", SIGGRAPH 1989. Valid
//! for any scene; ray origins are moved off their surfaces by the rounding bound. Cost: one ray a
//! segment.

use super::occluded::AnalyticConfig;
use super::polygon::Polygon;
use super::ray_cast::REPLICATES;
use crate::bvh::{Hit, Ray};
use crate::geometry::{offset_bound, ray_origin, ray_target};
use crate::sampling::{self, Sequence, Stage};
use crate::world::World;
use glam::DVec3;
use luxel_scenes::FaceId;

/// Largest relative margin along the edges of a polygon that no points are drawn from. It is reached by
/// slivers a few thousandths of the scene wide; larger would bias them visibly.
const MAX_INSET: f64 = 1e-3;

/// A polygon in the unit frame as a source of points.
struct Sampled<'a> {
    polygon: &'a Polygon,
    points: sampling::Polygon,
    extent: f64,
    /// How far points are drawn towards the centre, relative to their distance from it.
    inset: f64,
}

impl<'a> Sampled<'a> {
    fn new(polygon: &'a Polygon) -> Option<Self> {
        let [low, high] = polygon.bounds();
        let extent = (high - low).max_element();
        let width = polygon.area() / extent;
        Some(Self {
            points: sampling::Polygon::new(polygon.vertices())?,
            inset: (8.0 * offset_bound(polygon.centre(), extent) / width).min(MAX_INSET),
            polygon,
            extent,
        })
    }

    /// A point for `u` in the unit square, even over the polygon but for a margin along its edges of
    /// a few times the rounding of ray origins: a point on an edge could be rounded to behind the
    /// face that adjoins there, which would then seem to block it.
    fn point(&self, u: [f64; 2]) -> DVec3 {
        self.points
            .sample(u)
            .lerp(self.polygon.centre(), self.inset)
    }

    /// The origin of a ray that leaves it at a point.
    fn leave(&self, point: DVec3) -> glam::Vec3 {
        ray_origin(point, self.polygon.normal(), self.extent)
    }

    /// The end of a segment to a point of it.
    fn end(&self, point: DVec3, origin: glam::Vec3) -> glam::Vec3 {
        ray_target(point, self.polygon.normal(), self.extent, origin)
    }
}

/// The visible share of the exchange between two polygons in the unit frame, and its standard error.
/// Faces for which `is_own` holds hide nothing; `item` tells pairs apart.
pub(super) fn visible_share(
    world: &World,
    [p, q]: [&Polygon; 2],
    is_own: impl Fn(FaceId) -> bool,
    item: u64,
    config: &AnalyticConfig,
) -> (f64, f64) {
    let (Some(p), Some(q)) = (Sampled::new(p), Sampled::new(q)) else {
        return (0.0, 0.0);
    };
    let per_replicate = (config.points as u64).div_ceil(REPLICATES).max(1) as u32;
    let mut rays = Vec::new();
    let mut weights = Vec::new();
    for replicate in 0..REPLICATES {
        // Replicates of a pair of 32-bit ids need more bits than an item has: the seed carries them.
        let seed = sampling::hash::mix64(config.seed ^ sampling::hash::mix64(replicate));
        let sequence = Sequence::new(seed, Stage::FORM_FACTORS, item);
        for index in 0..per_replicate {
            let [x, y, u, v] = sequence.point4(index);
            let (from, to) = (p.point([x, y]), q.point([u, v]));
            let origin = p.leave(from);
            rays.push(Ray::segment(origin, q.end(to, origin)));
            weights.push(kernel(from, p.polygon.normal(), to, q.polygon.normal()));
        }
    }
    let mut hits = vec![Hit::MISS; rays.len()];
    world.bvh().closest_hits(&rays, &mut hits);
    let geometry = world.surfaces().geometry();
    let is_open = |hit: &Hit| {
        hit.triangle()
            .is_none_or(|triangle| is_own(geometry.face(triangle)))
    };
    let total: f64 = weights.iter().sum();
    if total <= 0.0 {
        return (0.0, 0.0);
    }
    let open = hits.iter().map(|hit| f64::from(u8::from(is_open(hit))));
    let seen: Vec<f64> = open.zip(&weights).map(|(v, w)| v * w).collect();
    let visible = seen.iter().sum::<f64>() / total;
    // The scatter of a ratio of sums: Σ (s_r − V t_r)² over the replicates' sums.
    let each = per_replicate as usize;
    let squares: f64 = seen
        .chunks(each)
        .zip(weights.chunks(each))
        .map(|(s, t)| (s.iter().sum::<f64>() - visible * t.iter().sum::<f64>()).powi(2))
        .sum();
    let r = REPLICATES as f64;
    (visible, (squares * r / (r - 1.0)).sqrt() / total)
}

/// cos θ_p cos θ_q / r², zero where the fronts do not see each other.
fn kernel(from: DVec3, from_normal: DVec3, to: DVec3, to_normal: DVec3) -> f64 {
    let way = to - from;
    let squared = way.length_squared();
    let cosines = way.dot(from_normal).max(0.0) * (-way.dot(to_normal)).max(0.0);
    if squared > 0.0 {
        cosines / (squared * squared)
    } else {
        0.0
    }
}
