//! The watertight test of a block: the operations of `triangle` in their order, on four lanes at
//! once, distances to planes in f64 included. What is rare is left to `triangle::nearest`.

use super::memory;
use super::setup::Setup;
use crate::bvh::node::{BLOCK, Block};
use crate::bvh::ray::{Hit, Ray};
use crate::bvh::triangle::{self, Point, Shear};
use std::arch::x86_64::*;

/// What the hits of a block change.
pub(super) struct LeafHit<'a> {
    /// Where the ray enters the block's box.
    pub(super) entry: f32,
    /// The nearest hit so far, or the largest distance that counts.
    pub(super) nearest: &'a mut f32,
    pub(super) best: &'a mut Hit,
}

impl LeafHit<'_> {
    /// Intersects a block; true when there is a hit that counts. `ray` is asked for in rare cases.
    #[inline]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    pub(super) fn update(&mut self, block: &Block, setup: &Setup, ray: impl Fn() -> Ray) -> bool {
        let edges = edges(block, setup);
        let inside = edges.inside();
        if _mm_movemask_ps(inside) == 0 {
            return false;
        }
        let limits = [self.entry, *self.nearest];
        let Some(points) = points(block, setup, &edges, inside, limits) else {
            let ray = ray();
            let limits = [ray.tmin, self.entry];
            let shear = Shear::new(&ray);
            return triangle::nearest(block, &shear, limits, self.nearest, self.best);
        };
        let mut lanes = points.lanes;
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % BLOCK;
            lanes &= lanes - 1;
            let (point, id) = (points.point(lane), block.triangles[lane]);
            if point.t <= *self.nearest && self.best.is_replaced_by(&point, *self.nearest, id) {
                *self.nearest = point.t;
                *self.best = Hit::new(point, id);
            }
        }
        points.lanes != 0
    }
}

/// Edge functions of four triangles.
struct Edges([__m128; 3]);

impl Edges {
    /// A mask of the lanes whose edge functions do not differ in sign.
    #[inline]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn inside(&self) -> __m128 {
        let [a, b, c] = self.0;
        let zero = _mm_setzero_ps();
        let positive = _mm_cmpge_ps(_mm_min_ps(_mm_min_ps(a, b), c), zero);
        let negative = _mm_cmple_ps(_mm_max_ps(_mm_max_ps(a, b), c), zero);
        _mm_or_ps(positive, negative)
    }
}

/// The three corners' coordinates along the axis that is number `k` in the sheared order.
#[inline]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn corners(block: &Block, setup: &Setup, k: usize) -> [__m128; 3] {
    let axis = setup.axes[k] as usize;
    // SAFETY: the axes of a `Setup` are below 3.
    unsafe {
        [
            memory::coordinates(block, 0, axis),
            memory::coordinates(block, 1, axis),
            memory::coordinates(block, 2, axis),
        ]
    }
}

/// As `triangle::edges`.
#[inline]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn edges(block: &Block, setup: &Setup) -> Edges {
    let [ox, oy, oz, _] = setup.shear_origin;
    let [sx, sy, ..] = setup.scale;
    let [ox, oy, oz] = [_mm_set1_ps(ox), _mm_set1_ps(oy), _mm_set1_ps(oz)];
    let [sx, sy] = [_mm_set1_ps(sx), _mm_set1_ps(sy)];
    let [x, y, z] = [
        corners(block, setup, 0),
        corners(block, setup, 1),
        corners(block, setup, 2),
    ];
    let z0 = _mm_sub_ps(z[0], oz);
    let z1 = _mm_sub_ps(z[1], oz);
    let z2 = _mm_sub_ps(z[2], oz);
    let x0 = _mm_sub_ps(_mm_sub_ps(x[0], ox), _mm_mul_ps(sx, z0));
    let x1 = _mm_sub_ps(_mm_sub_ps(x[1], ox), _mm_mul_ps(sx, z1));
    let x2 = _mm_sub_ps(_mm_sub_ps(x[2], ox), _mm_mul_ps(sx, z2));
    let y0 = _mm_sub_ps(_mm_sub_ps(y[0], oy), _mm_mul_ps(sy, z0));
    let y1 = _mm_sub_ps(_mm_sub_ps(y[1], oy), _mm_mul_ps(sy, z1));
    let y2 = _mm_sub_ps(_mm_sub_ps(y[2], oy), _mm_mul_ps(sy, z2));
    Edges([
        _mm_sub_ps(_mm_mul_ps(x2, y1), _mm_mul_ps(y2, x1)),
        _mm_sub_ps(_mm_mul_ps(x0, y2), _mm_mul_ps(y0, x2)),
        _mm_sub_ps(_mm_mul_ps(x1, y0), _mm_mul_ps(y1, x0)),
    ])
}

/// Points of four triangles; `lanes` are the bits of those that count.
struct Points {
    lanes: u32,
    t: [f32; BLOCK],
    u: [f32; BLOCK],
    v: [f32; BLOCK],
}

impl Points {
    #[inline]
    fn point(&self, lane: usize) -> Point {
        let lane = lane % BLOCK;
        Point {
            t: self.t[lane],
            u: self.u[lane],
            v: self.v[lane],
        }
    }
}

/// As `triangle::resolve` for the lanes `inside`; `None` where one of them needs what is rare: an
/// edge function that is zero, or a ray in the plane.
#[inline]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn points(
    block: &Block,
    setup: &Setup,
    Edges([a, b, c]): &Edges,
    inside: __m128,
    [entry, nearest]: [f32; 2],
) -> Option<Points> {
    let t = plane_distances(block, setup);
    let zero = _mm_setzero_ps();
    let on_edge = _mm_or_ps(
        _mm_or_ps(_mm_cmpeq_ps(*a, zero), _mm_cmpeq_ps(*b, zero)),
        _mm_cmpeq_ps(*c, zero),
    );
    // Infinite or not a number: the difference with itself is not zero.
    let in_plane = _mm_cmpneq_ps(_mm_sub_ps(t, t), zero);
    let rare = _mm_and_ps(inside, _mm_or_ps(on_edge, in_plane));
    if _mm_movemask_ps(rare) != 0 {
        return None;
    }
    let raised = _mm_max_ps(t, _mm_set1_ps(entry));
    let within = _mm_and_ps(
        _mm_cmpge_ps(t, _mm_set1_ps(setup.tmin)),
        _mm_cmple_ps(raised, _mm_set1_ps(nearest)),
    );
    let inverse = _mm_div_ps(_mm_set1_ps(1.0), _mm_add_ps(_mm_add_ps(*a, *b), *c));
    let mut points = Points {
        lanes: _mm_movemask_ps(_mm_and_ps(inside, within)) as u32,
        t: [0.0; BLOCK],
        u: [0.0; BLOCK],
        v: [0.0; BLOCK],
    };
    memory::store(&mut points.t, raised);
    memory::store(&mut points.u, _mm_mul_ps(*b, inverse));
    memory::store(&mut points.v, _mm_mul_ps(*c, inverse));
    Some(points)
}

/// As `triangle::plane_distance`.
#[inline]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn plane_distances(block: &Block, setup: &Setup) -> __m128 {
    let (mut height, mut slope) = (_mm256_setzero_pd(), _mm256_setzero_pd());
    for axis in 0..3 {
        let normal = memory::load_f64(&block.normals[axis]);
        let corner = _mm256_cvtps_pd(memory::load(&block.corners[0][axis]));
        let from_origin = _mm256_sub_pd(corner, _mm256_set1_pd(setup.exact_origin[axis]));
        let direction = _mm256_set1_pd(setup.exact_direction[axis]);
        height = _mm256_add_pd(height, _mm256_mul_pd(normal, from_origin));
        slope = _mm256_add_pd(slope, _mm256_mul_pd(normal, direction));
    }
    _mm256_cvtpd_ps(_mm256_div_pd(height, slope))
}
