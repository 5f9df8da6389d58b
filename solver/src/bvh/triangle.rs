//! Watertight intersection of a ray with four triangles.
//!
//! The triangle is moved to the ray's origin and sheared so that the ray is the z axis; the signs
//! of the three edge functions U = CₓBᵧ − CᵧBₓ, … decide. Neighbours compute the shared edge's
//! function from the same numbers, so a ray through the edge is inside at least one of them.
//! Where a function is zero in f32 it is computed again in f64, which is exact for products of
//! f32.
//!
//! The distance that follows from the edge functions is off by about ε s on a triangle of extent s,
//! and by more on slivers: rays would hit the triangle that they leave. The distance of the few
//! lanes that are inside is therefore that to the plane of the corners, in f64: exact but for its
//! last rounding.
//!
//! Source: S. Woop, C. Benthin, I. Wald, "Watertight Ray/Triangle Intersection", Journal of
//! Computer Graphics Techniques 2(1), 2013. Valid for finite coordinates and a direction that is
//! not zero. Both sides of a triangle are hit. Cost: about 60 multiplications a block lane,
//! written so that the four lanes share vector instructions.

#![allow(
    clippy::needless_range_loop,
    clippy::needless_bitwise_bool,
    reason = "loops over lanes without branches become vector instructions"
)]

use super::node::{BLOCK, Block};
use super::ray::Ray;
use glam::{DVec3, Vec3};

/// The part of the test that depends on the ray only.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shear {
    origin: [f32; 3],
    /// The axes in the order (x, y, z) of the sheared space; z is the ray's longest component.
    axes: [usize; 3],
    scale: [f32; 3],
    /// The direction in the order of `axes`.
    direction: [f32; 3],
}

impl Shear {
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
            scale: [
                direction[kx] / direction[kz],
                direction[ky] / direction[kz],
                1.0 / direction[kz],
            ],
            direction: [direction[kx], direction[ky], direction[kz]],
        }
    }
}

/// Hits of the four lanes: distance, weights of the second and third corner. A lane that is not
/// hit within [tmin, tmax] has t = ∞.
pub(super) struct BlockHit {
    pub(super) t: [f32; BLOCK],
    pub(super) u: [f32; BLOCK],
    pub(super) v: [f32; BLOCK],
}

/// Intersects all lanes; hits beyond `tmax` or nearer than `tmin` are dropped, ties at `tmax` kept.
#[inline]
pub(super) fn intersect(block: &Block, shear: &Shear, tmin: f32, tmax: f32) -> BlockHit {
    let [kx, ky, kz] = shear.axes;
    let [ox, oy, oz] = shear.origin;
    let [sx, sy, sz] = shear.scale;
    let mut x = [[0f32; BLOCK]; 3];
    let mut y = [[0f32; BLOCK]; 3];
    let mut z = [[0f32; BLOCK]; 3];
    for corner in 0..3 {
        let planes = &block.corners[corner];
        for lane in 0..BLOCK {
            let depth = planes[kz][lane] - oz;
            x[corner][lane] = (planes[kx][lane] - ox) - sx * depth;
            y[corner][lane] = (planes[ky][lane] - oy) - sy * depth;
            z[corner][lane] = sz * depth;
        }
    }
    let mut edge = [[0f32; BLOCK]; 3];
    for lane in 0..BLOCK {
        edge[0][lane] = x[2][lane] * y[1][lane] - y[2][lane] * x[1][lane];
        edge[1][lane] = x[0][lane] * y[2][lane] - y[0][lane] * x[2][lane];
        edge[2][lane] = x[1][lane] * y[0][lane] - y[1][lane] * x[0][lane];
    }
    let mut any_zero = false;
    for lane in 0..BLOCK {
        any_zero |= (edge[0][lane] == 0.0) | (edge[1][lane] == 0.0) | (edge[2][lane] == 0.0);
    }
    if any_zero {
        recompute_in_f64(&x, &y, &mut edge);
    }
    let mut inside = [false; BLOCK];
    for lane in 0..BLOCK {
        let [a, b, c] = [edge[0][lane], edge[1][lane], edge[2][lane]];
        inside[lane] = (((a >= 0.0) & (b >= 0.0) & (c >= 0.0))
            | ((a <= 0.0) & (b <= 0.0) & (c <= 0.0)))
            & (a + b + c != 0.0);
    }
    let mut hit = BlockHit {
        t: [f32::INFINITY; BLOCK],
        u: [0.0; BLOCK],
        v: [0.0; BLOCK],
    };
    if !inside.iter().any(|&inside| inside) {
        return hit;
    }
    for lane in 0..BLOCK {
        if !inside[lane] {
            continue;
        }
        let [a, b, c] = [edge[0][lane], edge[1][lane], edge[2][lane]];
        let determinant = a + b + c;
        let inverse = 1.0 / determinant;
        // A ray in the plane takes the first-order value: it must not slip between two triangles.
        let t = plane_distance(block, shear, lane)
            .unwrap_or_else(|| (a * z[0][lane] + b * z[1][lane] + c * z[2][lane]) * inverse);
        if (t >= tmin) & (t <= tmax) {
            hit.t[lane] = t;
            hit.u[lane] = b * inverse;
            hit.v[lane] = c * inverse;
        }
    }
    hit
}

/// Distance to the plane of a triangle in lengths of the ray's direction, computed in f64; `None`
/// for a ray in the plane.
#[inline]
fn plane_distance(block: &Block, shear: &Shear, lane: usize) -> Option<f32> {
    let relative = |corner: usize| {
        let component = |k: usize| {
            f64::from(block.corners[corner][shear.axes[k]][lane]) - f64::from(shear.origin[k])
        };
        DVec3::new(component(0), component(1), component(2))
    };
    let [a, b, c] = [relative(0), relative(1), relative(2)];
    let normal = (b - a).cross(c - a);
    let direction = DVec3::from_array(shear.direction.map(f64::from));
    let t = (normal.dot(a) / normal.dot(direction)) as f32;
    t.is_finite().then_some(t)
}

#[cold]
fn recompute_in_f64(x: &[[f32; BLOCK]; 3], y: &[[f32; BLOCK]; 3], edge: &mut [[f32; BLOCK]; 3]) {
    let wide = |value: f32| f64::from(value);
    for lane in 0..BLOCK {
        let function = |b: usize, c: usize| {
            wide(x[c][lane]) * wide(y[b][lane]) - wide(y[c][lane]) * wide(x[b][lane])
        };
        // The f64 value is exact up to one rounding of the difference; its sign survives the
        // return to f32 because values that small stay normal or become a signed zero.
        edge[0][lane] = function(1, 2) as f32;
        edge[1][lane] = function(2, 0) as f32;
        edge[2][lane] = function(0, 1) as f32;
    }
}

/// The position that a direction's components have after division, with zeros replaced by the
/// smallest number whose reciprocal is finite.
pub(super) fn safe_reciprocal(direction: Vec3) -> Vec3 {
    let reciprocal = |component: f32| {
        if component.abs() < 1e-30 {
            1e30_f32.copysign(component)
        } else {
            1.0 / component
        }
    };
    Vec3::new(
        reciprocal(direction.x),
        reciprocal(direction.y),
        reciprocal(direction.z),
    )
}
