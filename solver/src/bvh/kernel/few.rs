//! Scenes of few triangles: every triangle against eight rays at once, a ray a lane.
//!
//! The watertight test of `triangle` with the operations in their order, without a tree. Rays are
//! first grouped by the longest component of their directions, so that the lanes of a test have the
//! same sheared order of axes and a corner's coordinates are one number for all of them. (The swap of
//! the first two axes for rays that run against the third one only negates all edge functions,
//! exactly, and is left out.) Distances to planes are computed in f64 where a lane is inside. A ray
//! that meets what is rare, an edge function that is zero or a triangle in its own plane, is
//! answered by the portable twin.
//!
//! Cost: five instructions a ray and triangle, and ten more where it is inside. Valid for any number of
//! triangles, and faster than the tree for at most [`FEW`](crate::bvh::collapse::FEW).

use super::groups::{CHUNK, Groups, LANES, columns};
use super::memory;
use super::wave::Answers;
use crate::bvh::collapse::Wide;
use crate::bvh::node::{BLOCK, Block};
use crate::bvh::ray::{Hit, Ray};
use crate::bvh::traverse;
use crate::bvh::triangle::Point;
use std::arch::x86_64::*;

/// Traces a batch: the closest hits, or with `ANY` whether there is a hit.
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
pub(super) fn trace<const ANY: bool>(wide: &Wide, rays: &[Ray], answers: &mut Answers<'_>) {
    let mut groups = Groups::EMPTY;
    for (chunk, rays) in rays.chunks(CHUNK).enumerate() {
        groups.sort(rays);
        let mut answers = if ANY {
            Answers {
                hits: &mut [],
                blocked: &mut answers.blocked[chunk * CHUNK..][..rays.len()],
            }
        } else {
            Answers {
                hits: &mut answers.hits[chunk * CHUNK..][..rays.len()],
                blocked: &mut [],
            }
        };
        trace_group::<ANY, 0>(wide, rays, &groups, &mut answers);
        trace_group::<ANY, 1>(wide, rays, &groups, &mut answers);
        trace_group::<ANY, 2>(wide, rays, &groups, &mut answers);
    }
}

/// Eight rays whose longest components are along one axis.
struct Rays {
    /// Origins in the sheared order of axes.
    origin: [__m256; 3],
    scale: [__m256; 2],
    tmin: __m256,
    /// Origins and directions of the lower and the upper four in the scene's order of axes.
    exact_origin: [[__m256d; 2]; 3],
    exact_direction: [[__m256d; 2]; 3],
}

impl Rays {
    #[inline]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn new<const Z: usize>(origin: [__m256; 3], tmin: __m256, direction: [__m256; 3]) -> Self {
        let (x, y) = ((Z + 1) % 3, (Z + 2) % 3);
        Self {
            origin: [origin[x], origin[y], origin[Z]],
            scale: [
                _mm256_div_ps(direction[x], direction[Z]),
                _mm256_div_ps(direction[y], direction[Z]),
            ],
            tmin,
            exact_origin: [exact(origin[0]), exact(origin[1]), exact(origin[2])],
            exact_direction: [
                exact(direction[0]),
                exact(direction[1]),
                exact(direction[2]),
            ],
        }
    }

    /// As `triangle::edges`.
    #[inline]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn edges<const Z: usize>(&self, block: &Block, lane: usize) -> [__m256; 3] {
        let (x0, y0) = self.sheared::<Z>(block, 0, lane);
        let (x1, y1) = self.sheared::<Z>(block, 1, lane);
        let (x2, y2) = self.sheared::<Z>(block, 2, lane);
        [
            _mm256_sub_ps(_mm256_mul_ps(x2, y1), _mm256_mul_ps(y2, x1)),
            _mm256_sub_ps(_mm256_mul_ps(x0, y2), _mm256_mul_ps(y0, x2)),
            _mm256_sub_ps(_mm256_mul_ps(x1, y0), _mm256_mul_ps(y1, x0)),
        ]
    }

    #[inline]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn sheared<const Z: usize>(
        &self,
        block: &Block,
        corner: usize,
        lane: usize,
    ) -> (__m256, __m256) {
        let [x, y, z] =
            [(Z + 1) % 3, (Z + 2) % 3, Z].map(|axis| block.corners[corner][axis][lane % BLOCK]);
        let [ox, oy, oz] = self.origin;
        let depth = _mm256_sub_ps(_mm256_set1_ps(z), oz);
        let x = _mm256_sub_ps(_mm256_set1_ps(x), ox);
        let y = _mm256_sub_ps(_mm256_set1_ps(y), oy);
        (
            _mm256_sub_ps(x, _mm256_mul_ps(self.scale[0], depth)),
            _mm256_sub_ps(y, _mm256_mul_ps(self.scale[1], depth)),
        )
    }

    /// As `triangle::plane_distance`.
    #[inline]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn plane_distances(&self, block: &Block, lane: usize) -> __m256 {
        let lower = self.plane_distances_of(block, lane, 0);
        let upper = self.plane_distances_of(block, lane, 1);
        _mm256_set_m128(upper, lower)
    }

    /// Of the lower or the upper four rays.
    #[inline]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn plane_distances_of(&self, block: &Block, lane: usize, half: usize) -> __m128 {
        let lane = lane % BLOCK;
        let (mut height, mut slope) = (_mm256_setzero_pd(), _mm256_setzero_pd());
        for axis in 0..3 {
            let normal = _mm256_set1_pd(block.normals[axis][lane]);
            let corner = _mm256_set1_pd(f64::from(block.corners[0][axis][lane]));
            let from_origin = _mm256_sub_pd(corner, self.exact_origin[axis][half]);
            let direction = self.exact_direction[axis][half];
            height = _mm256_add_pd(height, _mm256_mul_pd(normal, from_origin));
            slope = _mm256_add_pd(slope, _mm256_mul_pd(normal, direction));
        }
        _mm256_cvtpd_ps(_mm256_div_pd(height, slope))
    }
}

#[inline]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn exact(v: __m256) -> [__m256d; 2] {
    [
        _mm256_cvtps_pd(_mm256_castps256_ps128(v)),
        _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(v)),
    ]
}

/// A mask of the lanes whose edge functions do not differ in sign.
#[inline]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn agree([a, b, c]: [__m256; 3]) -> __m256 {
    let zero = _mm256_setzero_ps();
    let least = _mm256_min_ps(_mm256_min_ps(a, b), c);
    let greatest = _mm256_max_ps(_mm256_max_ps(a, b), c);
    _mm256_or_ps(
        _mm256_cmp_ps::<_CMP_GE_OQ>(least, zero),
        _mm256_cmp_ps::<_CMP_LE_OQ>(greatest, zero),
    )
}

/// A mask of what needs the twin: an edge function of zero, or a distance that is no number.
#[inline]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn is_rare([a, b, c]: [__m256; 3], t: __m256) -> __m256 {
    let zero = _mm256_setzero_ps();
    let on_edge = _mm256_or_ps(
        _mm256_or_ps(
            _mm256_cmp_ps::<_CMP_EQ_OQ>(a, zero),
            _mm256_cmp_ps::<_CMP_EQ_OQ>(b, zero),
        ),
        _mm256_cmp_ps::<_CMP_EQ_OQ>(c, zero),
    );
    // Infinite or not a number: the difference with itself is not zero.
    _mm256_or_ps(
        on_edge,
        _mm256_cmp_ps::<_CMP_NEQ_UQ>(_mm256_sub_ps(t, t), zero),
    )
}

/// Hits of eight rays.
struct Nearest {
    t: __m256,
    u: __m256,
    v: __m256,
    /// −1 for none.
    triangle: __m256i,
    /// Lanes that need the twin.
    rare: __m256,
    /// Lanes that were hit.
    found: __m256,
}

impl Nearest {
    #[inline]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn new(tmax: __m256) -> Self {
        Self {
            t: tmax,
            u: _mm256_setzero_ps(),
            v: _mm256_setzero_ps(),
            triangle: _mm256_set1_epi32(-1),
            rare: _mm256_setzero_ps(),
            found: _mm256_setzero_ps(),
        }
    }

    /// Lets the hits of a triangle replace those so far. A tie with `tmax` does not count: no
    /// triangle stands for it.
    #[inline]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn update<const Z: usize>(&mut self, block: &Block, lane: usize, rays: &Rays) {
        let edges = rays.edges::<Z>(block, lane);
        let inside = agree(edges);
        if _mm256_movemask_ps(inside) == 0 {
            return;
        }
        let t = rays.plane_distances(block, lane);
        self.rare = _mm256_or_ps(self.rare, _mm256_and_ps(inside, is_rare(edges, t)));
        let id = _mm256_set1_epi32(block.triangles[lane % BLOCK].cast_signed());
        let lower = _mm256_castsi256_ps(_mm256_cmpgt_epi32(self.triangle, id));
        let replaces = _mm256_or_ps(
            _mm256_cmp_ps::<_CMP_LT_OQ>(t, self.t),
            _mm256_and_ps(_mm256_cmp_ps::<_CMP_EQ_OQ>(t, self.t), lower),
        );
        let within = _mm256_and_ps(_mm256_cmp_ps::<_CMP_GE_OQ>(t, rays.tmin), replaces);
        // As the twin raises it, which tells −0 from +0.
        let t = _mm256_max_ps(t, rays.tmin);
        let counts = _mm256_and_ps(inside, within);
        let [a, b, c] = edges;
        let sum = _mm256_add_ps(_mm256_add_ps(a, b), c);
        let inverse = _mm256_div_ps(_mm256_set1_ps(1.0), sum);
        self.found = _mm256_or_ps(self.found, counts);
        self.t = _mm256_blendv_ps(self.t, t, counts);
        self.u = _mm256_blendv_ps(self.u, _mm256_mul_ps(b, inverse), counts);
        self.v = _mm256_blendv_ps(self.v, _mm256_mul_ps(c, inverse), counts);
        self.triangle = _mm256_blendv_epi8(self.triangle, id, _mm256_castps_si256(counts));
    }
}

/// Traces the rays of a chunk whose longest components are along axis `Z`.
#[inline]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn trace_group<const ANY: bool, const Z: usize>(
    wide: &Wide,
    rays: &[Ray],
    groups: &Groups,
    answers: &mut Answers<'_>,
) {
    let count = groups.counts[Z];
    for first in (0..count).step_by(LANES) {
        let numbers = &groups.rays[Z][first..(first + LANES).min(count)];
        let lane_ray = |lane: usize| numbers[lane.min(numbers.len() - 1)] as usize;
        let [ox, oy, oz, tmin, dx, dy, dz, tmax] =
            columns(std::array::from_fn(|lane| &rays[lane_ray(lane)]));
        // Not −0, as the twin's.
        let tmin = _mm256_add_ps(tmin, _mm256_setzero_ps());
        let eight = Rays::new::<Z>([ox, oy, oz], tmin, [dx, dy, dz]);
        let mut nearest = Nearest::new(tmax);
        'all: for block in &wide.blocks {
            for lane in 0..BLOCK {
                if block.triangles[lane] == u32::MAX {
                    break;
                }
                nearest.update::<Z>(block, lane, &eight);
            }
            if ANY && _mm256_movemask_ps(_mm256_or_ps(nearest.found, nearest.rare)) == 0xff {
                break 'all;
            }
        }
        let found = _mm256_movemask_ps(nearest.found) as u32;
        let rare = _mm256_movemask_ps(nearest.rare) as u32;
        if ANY {
            for (lane, &ray) in numbers.iter().enumerate() {
                answers.blocked[ray as usize] = found >> lane & 1 != 0;
            }
        } else {
            let [t, u, v] = [
                memory::lanes(nearest.t),
                memory::lanes(nearest.u),
                memory::lanes(nearest.v),
            ];
            let triangles = memory::lanes(_mm256_castsi256_ps(nearest.triangle));
            for (lane, &ray) in numbers.iter().enumerate() {
                let point = Point {
                    t: t[lane],
                    u: u[lane],
                    v: v[lane],
                };
                answers.hits[ray as usize] = if found >> lane & 1 != 0 {
                    Hit::new(point, triangles[lane].to_bits())
                } else {
                    Hit::MISS
                };
            }
        }
        for (lane, &ray) in numbers.iter().enumerate() {
            if rare >> lane & 1 != 0 {
                let ray = ray as usize;
                if ANY {
                    traverse::occluded(wide, &rays[ray..=ray], &mut answers.blocked[ray..=ray]);
                } else {
                    traverse::closest_hits(wide, &rays[ray..=ray], &mut answers.hits[ray..=ray]);
                }
            }
        }
    }
}
