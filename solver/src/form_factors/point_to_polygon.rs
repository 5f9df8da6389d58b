//! Lambert's formula: the form factor from a surface element to a polygon.
//!
//! F = 1/(2π) Σ_i Γ_i n·(r_{i+1} × r_i)/|r_{i+1} × r_i|, where r_i are the vectors to the vertices,
//! counter-clockwise from the polygon's front, and Γ_i the angle between r_i and r_{i+1}, after the
//! part of the polygon below the element's horizon is cut off. Times the polygon's radiosity it is
//! the irradiance at the element.
//!
//! Sources: J. H. Lambert, "Photometria", 1760; D. R. Baum, H. E. Rushmeier, J. M. Winget,
//! "Improving radiosity solutions through the use of analytically determined form-factors",
//! SIGGRAPH 1989. Valid for planar polygons of any shape, any position of the element (zero behind
//! the polygon and in its plane) and lengths between about 1e-50 and 1e50. Biased by rounding only:
//! absolute error about 1e-15. Cost: one pass over the vertices, then two divisions and a square
//! root per edge (an arc tangent for one that spans more than 90°), or none for a small polygon; no allocation.
//!
//! # Small and far polygons
//!
//! With c_i = r_i × r_{i+1} the sum is −Σ g_i n·c_i, g_i = Γ_i/|c_i|. For a polygon of extent s at
//! distance d its terms are of order s/d and the result of order s²/d²: the digits cancel. But Σ c_i
//! is twice the vector area A, so that for any constant g₀
//!
//! Σ g_i n·c_i = 2 g₀ n·A + Σ (g_i − g₀) n·c_i,
//!
//! and with g₀ = 1/|r_0|² both parts are of order s²/d². All quantities are made of the differences
//! u_i = v_i − v_0: with D_i = r_i·r_{i+1} and t² = |c_i|²/D_i²,
//!
//! g_i − g₀ = (|r_0|² − D_i)/(D_i |r_0|²) + (atan(t)/t − 1)/D_i,
//! D_i − |r_0|² = r_0·(u_i + u_{i+1}) + u_i·u_{i+1},
//!
//! the bracket by its power series. The relative error is then about 1e-15 / (cos θ cos θ'), at any
//! distance.

#![expect(
    clippy::inline_always,
    reason = "the array lengths known to point_to_polygon must reach the loops: a third of the time"
)]

use super::angle::angle_over_sine;
use super::clip::crossing;
use glam::DVec3;
use std::f64::consts::TAU;

/// Extent over distance up to which the formula for small polygons is used. The series below ends
/// with t¹², so that its error relative to the result is about t¹³/15: larger than rounding beyond
/// 1/16. Below, the general formula loses a factor of the inverse to cancellation.
const SMALL: f64 = 1.0 / 16.0;

/// The fraction of the flux leaving a diffuse surface element that arrives at the front of a polygon
/// if nothing is between them; in [0, 1].
///
/// `position` in metres, `normal` the unit normal of the element, `polygon` in metres,
/// counter-clockwise seen from its front. Zero when the element lies behind the polygon or in its
/// plane.
///
/// By reciprocity it is also the irradiance at the element per radiosity of the polygon.
pub fn point_to_polygon(position: DVec3, normal: DVec3, polygon: &[DVec3]) -> f64 {
    // A length known to the compiler unrolls every loop: a third of the time.
    if let Ok(quad) = <&[DVec3; 4]>::try_from(polygon) {
        lambert(position, normal, quad)
    } else if let Ok(triangle) = <&[DVec3; 3]>::try_from(polygon) {
        lambert(position, normal, triangle)
    } else {
        lambert(position, normal, polygon)
    }
}

/// The formula itself.
#[inline(always)]
fn lambert(position: DVec3, normal: DVec3, polygon: &[DVec3]) -> f64 {
    let &[v0, v1, ..] = polygon else { return 0.0 };
    let r0 = v0 - position;

    // One pass: twice the vector area, the extent, and the heights above the horizon.
    let mut twice_area = DVec3::ZERO;
    let mut extent_squared = (v1 - v0).length_squared();
    let mut lowest = normal.dot(r0);
    let mut highest = lowest;
    let mut previous = DVec3::ZERO;
    for &v in &polygon[1..] {
        let u = v - v0;
        twice_area += previous.cross(u);
        extent_squared = extent_squared.max(u.length_squared());
        let height = normal.dot(v - position);
        lowest = lowest.min(height);
        highest = highest.max(height);
        previous = u;
    }
    if highest <= 0.0 || !is_in_front(r0, twice_area, extent_squared) {
        return 0.0;
    }

    let distance_squared = r0.length_squared();
    let is_small = extent_squared <= SMALL * SMALL * distance_squared;
    let horizon = |v: DVec3| normal.dot(v - position);
    let sum = match (is_small, lowest >= 0.0) {
        (true, true) => {
            let small = Small::new(r0, normal);
            small.constant(twice_area) + all_edges(polygon, v0, |a, b| small.edge(a, b))
        }
        (true, false) => {
            let small = Small::new(r0, normal);
            let mut area = DVec3::ZERO;
            let edges = edges_above(polygon, horizon, v0, |a, b| {
                area += a.cross(b);
                small.edge(a, b)
            });
            small.constant(area) + edges
        }
        (false, true) => <&[DVec3; 4]>::try_from(polygon)
            .ok()
            .and_then(|quad| edges_at_once(normal, quad.map(|v| v - position)))
            .unwrap_or_else(|| all_edges(polygon, position, |a, b| edge(normal, a, b))),
        (false, false) => edges_above(polygon, horizon, position, |a, b| edge(normal, a, b)),
    };
    // Counter-clockwise from the front is clockwise around the element's normal.
    (-sum / TAU).clamp(0.0, 1.0)
}

/// True when the element, from which r₀ leads to the polygon, is in front of it by more than the
/// rounding of this very test.
fn is_in_front(r0: DVec3, twice_area: DVec3, extent_squared: f64) -> bool {
    let height = -r0.dot(twice_area);
    let noise = 16.0 * f64::EPSILON * extent_squared;
    height > 0.0 && height * height > noise * noise * r0.length_squared()
}

/// Γ n·c/|c| with c = a × b: the term of one edge, a and b relative to the element.
#[inline(always)]
fn edge(normal: DVec3, a: DVec3, b: DVec3) -> f64 {
    // a × (b − a) rather than a × b: the edge vector is exact, and what cancels never appears.
    let c = a.cross(b - a);
    let (sine_squared, cosine) = (c.length_squared(), a.dot(b));
    if cosine > 0.0 {
        let lengths = (sine_squared + cosine * cosine).sqrt();
        angle_over_sine(cosine / lengths) / lengths * normal.dot(c)
    } else if sine_squared > 0.0 {
        let sine = sine_squared.sqrt();
        sine.atan2(cosine) / sine * normal.dot(c)
    } else {
        0.0
    }
}

/// The sum of [`edge`] over the edges of a polygon with vertices `r` relative to the element, written for vector
/// instructions; `None` where an edge spans more than 90°.
#[inline(always)]
fn edges_at_once<const N: usize>(normal: DVec3, r: [DVec3; N]) -> Option<f64> {
    let [mut cosine, mut squared, mut along] = [[0.0; N]; 3];
    for k in 0..N {
        let (a, b) = (r[k], r[(k + 1) % N]);
        let c = a.cross(b - a);
        cosine[k] = a.dot(b);
        squared[k] = c.length_squared() + cosine[k] * cosine[k];
        along[k] = normal.dot(c);
    }
    if cosine.iter().any(|&cosine| cosine <= 0.0) {
        return None;
    }
    let mut terms = [0.0; N];
    for k in 0..N {
        let inverse = 1.0 / squared[k].sqrt();
        terms[k] = angle_over_sine(cosine[k] * inverse) * inverse * along[k];
    }
    Some(terms.iter().sum())
}

/// The terms of a polygon that is small against its distance; vertices relative to its first one.
struct Small {
    r0: DVec3,
    normal: DVec3,
    distance_squared: f64,
    inverse_squared: f64,
    normal_cross_r0: DVec3,
}

impl Small {
    fn new(r0: DVec3, normal: DVec3) -> Self {
        Self {
            r0,
            normal,
            distance_squared: r0.length_squared(),
            inverse_squared: 1.0 / r0.length_squared(),
            normal_cross_r0: normal.cross(r0),
        }
    }

    /// 2 g₀ n·A.
    fn constant(&self, twice_area: DVec3) -> f64 {
        self.normal.dot(twice_area) * self.inverse_squared
    }

    /// (g_i − g₀) n·c_i of the edge from u to v.
    #[inline(always)]
    fn edge(&self, u: DVec3, v: DVec3) -> f64 {
        let along = v - u;
        let rise = self.r0.dot(u + v) + u.dot(v);
        let cosine = self.distance_squared + rise;
        let a = self.r0 + u;
        let inverse = 1.0 / cosine;
        let t2 = a.cross(along).length_squared() * (inverse * inverse);
        let bend = -t2
            * (1.0 / 3.0
                - t2 * (1.0 / 5.0
                    - t2 * (1.0 / 7.0 - t2 * (1.0 / 9.0 - t2 * (1.0 / 11.0 - t2 / 13.0)))));
        let excess = (bend - rise * self.inverse_squared) * inverse;
        excess * (self.normal_cross_r0.dot(along) + self.normal.dot(u.cross(v)))
    }
}

/// Sums a term over all edges, vertices relative to an origin.
#[inline(always)]
fn all_edges(polygon: &[DVec3], origin: DVec3, mut term: impl FnMut(DVec3, DVec3) -> f64) -> f64 {
    let mut previous = polygon[polygon.len() - 1] - origin;
    let mut sum = 0.0;
    for &v in polygon {
        let next = v - origin;
        sum += term(previous, next);
        previous = next;
    }
    sum
}

/// Sums a term over the edges of the part of a polygon that is not below the horizon, among them the
/// edge along the horizon; vertices relative to an origin.
fn edges_above(
    polygon: &[DVec3],
    height: impl Fn(DVec3) -> f64,
    origin: DVec3,
    mut term: impl FnMut(DVec3, DVec3) -> f64,
) -> f64 {
    let last = polygon[polygon.len() - 1];
    let (mut a, mut height_a) = (last - origin, height(last));
    let mut sum = 0.0;
    let mut first_entry = None;
    let mut exit = None;
    for &vertex in polygon {
        let (b, height_b) = (vertex - origin, height(vertex));
        match (height_a >= 0.0, height_b >= 0.0) {
            (true, true) => sum += term(a, b),
            (true, false) => {
                let q = crossing(a, height_a, b, height_b);
                sum += term(a, q);
                exit = Some(q);
            }
            (false, true) => {
                let q = crossing(a, height_a, b, height_b);
                match exit.take() {
                    Some(out) => sum += term(out, q),
                    None => first_entry = Some(q),
                }
                sum += term(q, b);
            }
            (false, false) => {}
        }
        (a, height_a) = (b, height_b);
    }
    if let (Some(out), Some(back)) = (exit, first_entry) {
        sum += term(out, back);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// A square of side 2h centred at the origin's axis at height z, facing down.
    fn ceiling(h: f64, z: f64) -> [DVec3; 4] {
        [
            DVec3::new(-h, h, z),
            DVec3::new(h, h, z),
            DVec3::new(h, -h, z),
            DVec3::new(-h, -h, z),
        ]
    }

    /// Howell B-3 four times: element under the centre of a parallel square.
    fn square_overhead(h: f64, z: f64) -> f64 {
        let x = h / z;
        4.0 / TAU * 2.0 * x / (1.0 + x * x).sqrt() * (x / (1.0 + x * x).sqrt()).atan()
    }

    #[test]
    fn a_square_overhead_has_its_closed_form_at_any_distance() {
        for exponent in -12..=40 {
            let z = 2.0_f64.powi(exponent);
            let f = point_to_polygon(DVec3::ZERO, DVec3::Z, &ceiling(0.5, z));
            let exact = square_overhead(0.5, z);
            // General formula: cancellation of up to 16 on a few units of rounding; small
            // polygons: some ten rounded operations of one magnitude.
            assert!(
                (f - exact).abs() <= 2e-14 * exact,
                "z = 2^{exponent}: {f} against {exact}"
            );
        }
    }

    #[test]
    fn an_oblique_far_polygon_is_the_kernel_times_its_area() {
        // Solid angle 1e-6 to 1e-24: F -> cos cos' A / (pi d^2), with an error of order (s/d)^2.
        let normal = DVec3::new(0.3, -0.2, 0.9).normalize();
        for distance in [1e3, 1e4, 1e6, 1e9, 1e12] {
            let centre = DVec3::new(0.6, 0.3, 0.7).normalize() * distance;
            let (u, v) = (DVec3::new(0.1, -0.4, 0.2), DVec3::new(0.5, 0.3, -0.1));
            let polygon = [
                centre - u - v,
                centre + u - v,
                centre + u + v,
                centre - u + v,
            ];
            let facing = u.cross(v);
            let kernel =
                |r: DVec3| -normal.dot(r) * facing.dot(r) * 4.0 / (PI * r.length_squared().powi(2));
            let (f, exact) = if kernel(centre) > 0.0 {
                (
                    point_to_polygon(DVec3::ZERO, normal, &polygon),
                    kernel(centre),
                )
            } else {
                let reversed: Vec<_> = polygon.iter().rev().copied().collect();
                (
                    point_to_polygon(DVec3::ZERO, normal, &reversed),
                    -kernel(centre),
                )
            };
            // Vertices at distance d are rounded by d eps, their differences by d eps / s.
            let tolerance = 2.0 / (distance * distance) + 8.0 * f64::EPSILON * distance;
            assert!(
                (f - exact).abs() <= tolerance * exact,
                "{distance}: {f} against {exact}"
            );
        }
    }

    #[test]
    fn both_formulas_agree_where_they_meet() {
        let normal = DVec3::new(0.1, 0.2, 0.95).normalize();
        let polygon = ceiling(0.5, 22.8);
        let position = DVec3::new(0.3, -0.2, 0.0);
        let general = -all_edges(&polygon, position, |a, b| edge(normal, a, b)) / TAU;
        let f = point_to_polygon(position, normal, &polygon);
        assert!(
            (polygon[2] - polygon[0]).length() < SMALL * (polygon[0] - position).length(),
            "the small formula is taken"
        );
        // The general one cancels by about 16 at this distance.
        assert!((f / general - 1.0).abs() < 1e-13, "{f} against {general}");
    }

    #[test]
    fn a_hemisphere_cut_at_the_horizon_never_gives_negative_light() {
        // A wall that reaches below the floor counts as the part above it.
        let wall = |low: f64| {
            [
                DVec3::new(1.0, 1.0, low),
                DVec3::new(1.0, -1.0, low),
                DVec3::new(1.0, -1.0, 2.0),
                DVec3::new(1.0, 1.0, 2.0),
            ]
        };
        let reversed = |low| {
            let mut w = wall(low);
            w.reverse();
            w
        };
        let above = point_to_polygon(DVec3::ZERO, DVec3::Z, &reversed(0.0))
            + point_to_polygon(DVec3::ZERO, DVec3::Z, &wall(0.0));
        for low in [-1e-9, -0.1, -1.0, -1e6] {
            let f = point_to_polygon(DVec3::ZERO, DVec3::Z, &wall(low))
                + point_to_polygon(DVec3::ZERO, DVec3::Z, &reversed(low));
            assert!((f - above).abs() < 1e-15, "{low}: {f} against {above}");
        }
    }

    #[test]
    fn it_is_continuous_through_the_horizon() {
        let polygon = ceiling(0.5, 1.0);
        let mut last: Option<f64> = None;
        for k in 0..=2000 {
            let angle = f64::from(k) / 2000.0 * PI;
            let normal = DVec3::new(angle.sin(), 0.0, angle.cos());
            let f = point_to_polygon(DVec3::ZERO, normal, &polygon);
            assert!((0.0..=1.0).contains(&f), "{f}");
            if let Some(last) = last {
                // |dF/dangle| <= |vector irradiance| + solid angle / pi < 1.
                assert!((f - last).abs() <= PI / 2000.0, "step {k}");
            }
            last = Some(f);
        }
        assert_eq!(last, Some(0.0), "all of it is behind");
    }

    #[test]
    fn behind_and_in_the_plane_it_is_zero() {
        let polygon = ceiling(0.5, 1.0);
        for position in [
            DVec3::new(0.0, 0.0, 1.0),
            DVec3::new(0.5, 0.5, 1.0),
            DVec3::new(0.5, 0.1, 1.0),
            DVec3::new(3.0, 0.1, 1.0),
            DVec3::new(0.0, 0.0, 2.0),
        ] {
            for normal in [DVec3::Z, -DVec3::Z, DVec3::X, -DVec3::X] {
                let f = point_to_polygon(position, normal, &polygon);
                assert_eq!(f.to_bits(), 0, "{position} {normal}");
            }
        }
    }

    #[test]
    fn an_element_inside_a_closed_box_sees_it_all() {
        let corners = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let faces = [
            [
                corners(0., 0., 0.),
                corners(0., 1., 0.),
                corners(0., 1., 1.),
                corners(0., 0., 1.),
            ],
            [
                corners(1., 0., 0.),
                corners(1., 0., 1.),
                corners(1., 1., 1.),
                corners(1., 1., 0.),
            ],
            [
                corners(0., 0., 0.),
                corners(0., 0., 1.),
                corners(1., 0., 1.),
                corners(1., 0., 0.),
            ],
            [
                corners(0., 1., 0.),
                corners(1., 1., 0.),
                corners(1., 1., 1.),
                corners(0., 1., 1.),
            ],
            [
                corners(0., 0., 0.),
                corners(1., 0., 0.),
                corners(1., 1., 0.),
                corners(0., 1., 0.),
            ],
            [
                corners(0., 0., 1.),
                corners(0., 1., 1.),
                corners(1., 1., 1.),
                corners(1., 0., 1.),
            ],
        ];
        for k in 0..200 {
            let h = |m: u32| f64::from((k * 7919 + 13) * m % 1009) / 1009.0;
            let position =
                DVec3::new(h(3), h(17), h(101)).clamp(DVec3::splat(1e-6), DVec3::splat(0.999));
            let normal = (DVec3::new(h(29), h(37), h(59)) - 0.5).normalize();
            let sum: f64 = faces
                .iter()
                .map(|f| point_to_polygon(position, normal, f))
                .sum();
            // Six faces, some thirty terms of magnitude up to one half.
            assert!((sum - 1.0).abs() < 1e-14, "{position} {normal}: {sum}");
        }
    }

    #[test]
    fn degenerate_polygons_receive_nothing() {
        let p = DVec3::new(0.1, 0.2, 1.0);
        for polygon in [
            vec![],
            vec![p],
            vec![p, -p],
            vec![p, p, p],
            vec![p, p + DVec3::X, p + DVec3::X * 3.0],
        ] {
            let f = point_to_polygon(DVec3::ZERO, DVec3::Z, &polygon);
            assert_eq!(f.to_bits(), 0, "{polygon:?}");
        }
    }
}
