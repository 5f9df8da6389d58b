//! Watertight intersection of a ray with four triangles.
//!
//! The triangle is moved to the ray's origin and sheared so that the ray is the z axis; the signs
//! of the three edge functions U = CₓBᵧ − CᵧBₓ, … decide. Neighbours compute the shared edge's
//! function from the same numbers, so a ray through the edge is inside at least one of them.
//! A function that is zero in f32 is computed again in f64, which is exact for products of f32;
//! the others stay, so that what an edge decides depends on the edge alone.
//!
//! The distance that follows from the edge functions is off by about ε s on a triangle of extent s,
//! and by more on slivers: rays would hit the triangle that they leave. The distance of the few
//! lanes that are inside is therefore that to the plane of the corners, in f64: exact but for its
//! last rounding.
//!
//! A kernel with vector instructions does the same operations in the same order, so that it gives
//! the same bits; what is rare it leaves to [`nearest`].
//!
//! Source: S. Woop, C. Benthin, I. Wald, "Watertight Ray/Triangle Intersection", Journal of
//! Computer Graphics Techniques 2(1), 2013. Valid for finite coordinates and a direction that is
//! not zero. Both sides of a triangle are hit. Cost: about 30 multiplications a block lane,
//! written so that the four lanes share vector instructions.

#![allow(
    clippy::needless_range_loop,
    clippy::needless_bitwise_bool,
    reason = "loops over lanes without branches become vector instructions"
)]

use super::node::{BLOCK, Block};
use super::ray::{Hit, Ray};

/// The part of the test that depends on the ray only.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shear {
    pub(super) origin: [f32; 3],
    /// The axes in the order (x, y, z) of the sheared space; z is the ray's longest component.
    pub(super) axes: [usize; 3],
    /// The shear of x and of y.
    pub(super) scale: [f32; 2],
    /// What a depth along z is, times this, in lengths of the direction.
    depth_scale: f32,
    /// The ray in the scene's order of axes.
    ray_origin: [f64; 3],
    ray_direction: [f64; 3],
}

impl Shear {
    #[inline]
    pub(super) fn new(ray: &Ray) -> Self {
        let direction = ray.direction.to_array();
        let magnitude = ray.direction.abs();
        let kz = if magnitude.x >= magnitude.y && magnitude.x >= magnitude.z {
            0
        } else if magnitude.y >= magnitude.z {
            1
        } else {
            2
        };
        let (mut kx, mut ky) = ((kz + 1) % 3, (kz + 2) % 3);
        if direction[kz] < 0.0 {
            std::mem::swap(&mut kx, &mut ky);
        }
        let origin = ray.origin.to_array();
        Self {
            origin: [origin[kx], origin[ky], origin[kz]],
            axes: [kx, ky, kz],
            scale: [direction[kx] / direction[kz], direction[ky] / direction[kz]],
            depth_scale: 1.0 / direction[kz],
            ray_origin: origin.map(f64::from),
            ray_direction: direction.map(f64::from),
        }
    }
}

/// The edge functions of all lanes, `[edge][lane]`.
#[inline]
fn edges(block: &Block, shear: &Shear) -> [[f32; BLOCK]; 3] {
    let [kx, ky, kz] = shear.axes;
    let [ox, oy, oz] = shear.origin;
    let [sx, sy] = shear.scale;
    let mut x = [[0f32; BLOCK]; 3];
    let mut y = [[0f32; BLOCK]; 3];
    for corner in 0..3 {
        let planes = &block.corners[corner];
        for lane in 0..BLOCK {
            let depth = planes[kz][lane] - oz;
            x[corner][lane] = (planes[kx][lane] - ox) - sx * depth;
            y[corner][lane] = (planes[ky][lane] - oy) - sy * depth;
        }
    }
    let mut edge = [[0f32; BLOCK]; 3];
    for lane in 0..BLOCK {
        edge[0][lane] = x[2][lane] * y[1][lane] - y[2][lane] * x[1][lane];
        edge[1][lane] = x[0][lane] * y[2][lane] - y[0][lane] * x[2][lane];
        edge[2][lane] = x[1][lane] * y[0][lane] - y[1][lane] * x[0][lane];
    }
    edge
}

/// The lanes whose edge functions do not differ in sign, as bits; zeros agree with either.
#[inline]
fn candidates(edge: &[[f32; BLOCK]; 3]) -> u32 {
    let mut bits = 0;
    for lane in 0..BLOCK {
        let [a, b, c] = [edge[0][lane], edge[1][lane], edge[2][lane]];
        bits |= u32::from(agree([a, b, c])) << lane;
    }
    bits
}

#[inline]
fn agree([a, b, c]: [f32; 3]) -> bool {
    ((a >= 0.0) & (b >= 0.0) & (c >= 0.0)) | ((a <= 0.0) & (b <= 0.0) & (c <= 0.0))
}

/// A point of a triangle: distance, and weights of the second and third corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) t: f32,
    pub(super) u: f32,
    pub(super) v: f32,
}

/// Lets the hits of a block replace `best`, which is at `nearest` unless it is a miss, and says
/// whether there is one. `entry` is where the ray enters the block's box.
#[inline]
pub(super) fn nearest(
    block: &Block,
    shear: &Shear,
    [tmin, entry]: [f32; 2],
    nearest: &mut f32,
    best: &mut Hit,
) -> bool {
    let edges = edges(block, shear);
    let mut lanes = candidates(&edges);
    let mut found = false;
    while lanes != 0 {
        let lane = lanes.trailing_zeros() as usize;
        lanes &= lanes - 1;
        let edge = edges.map(|edge| edge[lane]);
        let id = block.triangles[lane];
        if let Some(point) = resolve(block, shear, lane, edge, [tmin, entry, *nearest])
            && best.is_replaced_by(&point, *nearest, id)
        {
            *nearest = point.t;
            *best = Hit::new(point, id);
            found = true;
        }
    }
    found
}

/// The hit of a candidate lane with the given edge functions, when its distance is at least `tmin`
/// and, raised to `entry`, at most `tmax`.
///
/// `entry` is where the ray enters the block's box. A grazing ray may be inside by rounding where
/// the plane lies nearer than the box does; its distance becomes that of the box. No block can then
/// hold a hit nearer than its box, and the answer does not depend on the order of the blocks.
#[inline]
fn resolve(
    block: &Block,
    shear: &Shear,
    lane: usize,
    edge: [f32; 3],
    [tmin, entry, tmax]: [f32; 3],
) -> Option<Point> {
    let [a, b, c] = if edge.contains(&0.0) {
        sharpened(block, shear, lane, edge)?
    } else {
        edge
    };
    let inverse = 1.0 / (a + b + c);
    // A ray in the plane takes the first-order value: it must not slip between two triangles.
    let t = plane_distance(block, shear, lane)
        .unwrap_or_else(|| edge_distance(block, shear, lane, [a, b, c]) * inverse);
    let raised = if t > entry { t } else { entry };
    ((t >= tmin) & (raised <= tmax)).then_some(Point {
        t: raised,
        u: b * inverse,
        v: c * inverse,
    })
}

/// Distance to the plane of a triangle in lengths of the ray's direction, computed in f64; `None`
/// for a ray in the plane.
#[inline]
fn plane_distance(block: &Block, shear: &Shear, lane: usize) -> Option<f32> {
    let (mut height, mut slope) = (0.0, 0.0);
    for axis in 0..3 {
        let normal = block.normals[axis][lane];
        let from_origin = f64::from(block.corners[0][axis][lane]) - shear.ray_origin[axis];
        height += normal * from_origin;
        slope += normal * shear.ray_direction[axis];
    }
    let t = (height / slope) as f32;
    t.is_finite().then_some(t)
}

/// The edge functions with those that are zero computed again in f64; `None` when the ray is
/// outside by them, or the triangle is seen as a line.
#[cold]
fn sharpened(block: &Block, shear: &Shear, lane: usize, edge: [f32; 3]) -> Option<[f32; 3]> {
    let [kx, ky, kz] = shear.axes;
    let corner = |corner: usize| {
        let planes = &block.corners[corner];
        let depth = planes[kz][lane] - shear.origin[2];
        let x = (planes[kx][lane] - shear.origin[0]) - shear.scale[0] * depth;
        let y = (planes[ky][lane] - shear.origin[1]) - shear.scale[1] * depth;
        (f64::from(x), f64::from(y))
    };
    let p = [corner(0), corner(1), corner(2)];
    let mut sharp = edge;
    for (value, (i, j)) in sharp.iter_mut().zip([(1, 2), (2, 0), (0, 1)]) {
        if *value == 0.0 {
            // Exact up to one rounding of the difference; the sign survives the return to f32
            // because values that small stay normal or become a signed zero.
            *value = (p[j].0 * p[i].1 - p[j].1 * p[i].0) as f32;
        }
    }
    (agree(sharp) && sharp[0] + sharp[1] + sharp[2] != 0.0).then_some(sharp)
}

/// The distance by the edge functions, times their sum.
#[cold]
fn edge_distance(block: &Block, shear: &Shear, lane: usize, edge: [f32; 3]) -> f32 {
    let depth = |corner: usize| {
        shear.depth_scale * (block.corners[corner][shear.axes[2]][lane] - shear.origin[2])
    };
    edge[0] * depth(0) + edge[1] * depth(1) + edge[2] * depth(2)
}
