//! Points of an emissive polygon, distributed exactly as the kernel cos θ dω of the irradiance that
//! it causes.
//!
//! From afar points are drawn by area and kept by the kernel cos θ cos θ' / r² against its bound;
//! from nearby, uniformly by solid angle over the spherical triangles of the polygon's fan, and kept
//! with probability cos θ / max cos θ. So the mean visibility of the points is the share of the
//! irradiance that arrives: unbiased with a single ray, and exact where the polygon is wholly
//! visible or wholly hidden. Points spread by area, or by a kernel that is only nearly right, make
//! errors of 0.2–0.5 % that no number of points removes.
//!
//! Where a light gets many rays from one point, rejections would spoil their stratification: there
//! a [`Warp`] draws points that follow nearly the kernel and returns what is left as a weight,
//! for a ratio estimate Σ w v / Σ w, whose bias is O(1/n) times the small scatter of the weights.
//!
//! Source: J. Arvo, "Stratified Sampling of Spherical Triangles", SIGGRAPH 1995; rejection after
//! J. von Neumann, 1951; the warp after M. Pharr, W. Jakob, G. Humphreys, "Physically Based
//! Rendering", 4th ed., 2023, §6.5.4. Valid for convex polygons. Cost: about two tries of 40 ns from
//! afar, of 150 ns from nearby; the first try is stratified.

use crate::form_factors::{Plane, clip};
use crate::sampling::{Polygon, ProjectedSphericalTriangle, Sequence, SphericalTriangle};
use glam::DVec3;

/// Corners up to which a polygon is drawn by solid angle. One of more corners (a disk) is drawn by
/// area, because the fan would cost more than the rejections.
const MAX_FAN: usize = 8;

/// Tries after which a point is taken as it is. At a mean of two tries it happens once in 10⁹
/// draws; for disks close to the receiver more often.
const MAX_TRIES: u32 = 64;

/// Radius over distance up to which drawing by area is the cheaper way: the bound is then at most
/// five times the kernel.
const AFAR: f64 = 0.3;

/// A triangle of a polygon's fan as a receiver sees it.
struct Slice<T> {
    triangle: T,
    corners: [DVec3; 3],
    solid_angle: f64,
}

/// Memory for the part of a polygon above a horizon, and its fan.
#[derive(Default)]
pub(super) struct Scratch {
    clipped: Vec<DVec3>,
    uniform: Vec<Slice<SphericalTriangle>>,
    warped: Vec<Slice<ProjectedSphericalTriangle>>,
}

/// An emissive polygon with what drawing from it needs.
#[derive(Clone, Debug)]
pub struct Luminaire {
    corners: Vec<DVec3>,
    /// `None` for a polygon without area, which emits nothing.
    by_area: Option<Polygon>,
    centre: DVec3,
    radius: f64,
}

impl Luminaire {
    /// A planar convex polygon, counter-clockwise seen from where it shines.
    pub(super) fn new(corners: Vec<DVec3>) -> Self {
        let centre = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let radius = corners
            .iter()
            .map(|p| p.distance(centre))
            .fold(0.0, f64::max);
        Self {
            by_area: Polygon::new(&corners),
            corners,
            centre,
            radius,
        }
    }

    /// Its corners in the unit frame, counter-clockwise seen from where it shines.
    pub fn corners(&self) -> &[DVec3] {
        &self.corners
    }

    /// The mean of its corners.
    pub(super) fn centre(&self) -> DVec3 {
        self.centre
    }

    /// Distance from the centre to the farthest corner, in units.
    pub(super) fn radius(&self) -> f64 {
        self.radius
    }

    /// Area in square units.
    pub(super) fn area(&self) -> f64 {
        self.by_area.as_ref().map_or(0.0, Polygon::area)
    }

    /// A point of the part above the horizon of a receiver at `position` with unit `normal`; `None`
    /// when that part covers no solid angle.
    pub(super) fn sample(
        &self,
        position: DVec3,
        normal: DVec3,
        sequence: Sequence,
        index: u32,
        scratch: &mut Scratch,
    ) -> Option<DVec3> {
        let distance = position.distance(self.centre);
        let heights = || {
            self.corners
                .iter()
                .map(|&corner| normal.dot(corner - position))
        };
        if self.radius < AFAR * distance && heights().all(|height| height > 0.0) {
            let highest = heights().fold(0.0, f64::max);
            let nearest = self.nearest(self.by_area.as_ref()?, position);
            return draw_by_area(
                self.by_area.as_ref()?,
                sequence,
                index,
                |to, distance| normal.dot(to) / highest * (nearest / distance).powi(4),
                position,
            );
        }
        if self.corners.len() > MAX_FAN {
            let nearest = self.nearest(self.by_area.as_ref()?, position);
            return draw_by_area(
                self.by_area.as_ref()?,
                sequence,
                index,
                |to, distance| normal.dot(to) / distance * (nearest / distance).powi(3),
                position,
            );
        }
        self.clip(position, normal, scratch);
        draw_by_solid_angle(position, normal, scratch, sequence, index)
    }

    /// What draws many points for a receiver at `position` with unit `normal`.
    pub(super) fn warp<'a>(
        &'a self,
        position: DVec3,
        normal: DVec3,
        scratch: &'a mut Scratch,
    ) -> Warp<'a> {
        let by_area = self.corners.len() > MAX_FAN;
        scratch.warped.clear();
        if !by_area {
            self.clip(position, normal, scratch);
            let triangles = fan(&scratch.clipped).filter_map(|corners| {
                let triangle = ProjectedSphericalTriangle::new(position, normal, corners)?;
                let solid_angle = triangle.triangle().solid_angle();
                Some(Slice {
                    triangle,
                    corners,
                    solid_angle,
                })
            });
            scratch.warped.extend(triangles);
        }
        Warp {
            position,
            normal,
            by_area: self.by_area.as_ref().filter(|_| by_area),
            solid_angle: total(&scratch.warped),
            fan: &scratch.warped,
        }
    }

    /// Leaves the part above the horizon in `scratch`.
    fn clip(&self, position: DVec3, normal: DVec3, scratch: &mut Scratch) {
        let plane = Plane {
            point: position,
            normal,
        };
        clip(&self.corners, &plane, &mut scratch.clipped);
    }

    /// A distance that no point of the polygon is nearer than: that of its plane or of its bounding
    /// sphere.
    fn nearest(&self, polygon: &Polygon, position: DVec3) -> f64 {
        let height = (position - self.corners[0]).dot(polygon.normal()).abs();
        height.max(position.distance(self.centre) - self.radius)
    }
}

/// Area-uniform points, kept with a probability of the vector to them and its length.
fn draw_by_area(
    polygon: &Polygon,
    sequence: Sequence,
    index: u32,
    probability: impl Fn(DVec3, f64) -> f64,
    position: DVec3,
) -> Option<DVec3> {
    draw(sequence, index, |u| {
        let point = polygon.sample(u);
        let to = point - position;
        Some((point, probability(to, to.length())))
    })
}

/// The triangles of a convex polygon; none of one that is clipped away.
fn fan(polygon: &[DVec3]) -> impl Iterator<Item = [DVec3; 3]> + '_ {
    let pairs = polygon.get(1..).unwrap_or_default().windows(2);
    pairs.map(|pair| [polygon[0], pair[0], pair[1]])
}

fn total<T>(slices: &[Slice<T>]) -> f64 {
    slices.iter().map(|slice| slice.solid_angle).sum()
}

/// The slice in which the solid angle up to `x` of all of it ends, and the share of it that is below.
fn pick<T>(slices: &[Slice<T>], x: f64, solid_angle: f64) -> Option<(&Slice<T>, f64)> {
    let mut rest = x * solid_angle;
    let mut chosen = None;
    for slice in slices {
        let share = (rest / slice.solid_angle).clamp(0.0, 1.0 - f64::EPSILON);
        chosen = Some((slice, share));
        if rest < slice.solid_angle {
            break;
        }
        rest -= slice.solid_angle;
    }
    chosen
}

/// Points of a polygon above the horizon, uniform by solid angle, kept by cos θ.
fn draw_by_solid_angle(
    position: DVec3,
    normal: DVec3,
    scratch: &mut Scratch,
    sequence: Sequence,
    index: u32,
) -> Option<DVec3> {
    let polygon = &scratch.clipped;
    scratch.uniform.clear();
    let triangles = fan(polygon).filter_map(|corners| {
        let triangle = SphericalTriangle::new(position, corners)?;
        let solid_angle = triangle.solid_angle();
        Some(Slice {
            triangle,
            corners,
            solid_angle,
        })
    });
    scratch.uniform.extend(triangles);
    if scratch.uniform.is_empty() {
        return None;
    }
    let solid_angle = total(&scratch.uniform);
    let highest = highest_cosine(position, normal, polygon);
    draw(sequence, index, |[x, y]| {
        let (slice, share) = pick(&scratch.uniform, x, solid_angle)?;
        let drawn = slice.triangle.sample([share, y]);
        let point = weighted(&slice.corners, drawn.barycentric);
        Some((point, normal.dot(drawn.direction) / highest))
    })
}

fn weighted(corners: &[DVec3; 3], weights: [f64; 3]) -> DVec3 {
    corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]
}

/// Draws points that are distributed nearly as the kernel.
pub(super) struct Warp<'a> {
    position: DVec3,
    normal: DVec3,
    /// A polygon of too many corners for a fan.
    by_area: Option<&'a Polygon>,
    fan: &'a [Slice<ProjectedSphericalTriangle>],
    solid_angle: f64,
}

impl Warp<'_> {
    /// A point with its weight: kernel over density, up to a constant; `None` when the part above the horizon
    /// covers no solid angle.
    pub(super) fn sample(&self, [x, y]: [f64; 2]) -> Option<(DVec3, f64)> {
        if let Some(polygon) = self.by_area {
            let point = polygon.sample([x, y]);
            let to = point - self.position;
            return Some((point, self.normal.dot(to).max(0.0) / to.length().powi(4)));
        }
        let (slice, share) = pick(self.fan, x, self.solid_angle)?;
        let drawn = slice.triangle.sample([share, y]);
        let cosine = self.normal.dot(drawn.direction).max(0.0);
        let weight = cosine / (drawn.pdf * slice.solid_angle);
        Some((weighted(&slice.corners, drawn.barycentric), weight))
    }
}

/// Draws points with the probability of keeping each until one is kept.
fn draw(
    sequence: Sequence,
    index: u32,
    point: impl Fn([f64; 2]) -> Option<(DVec3, f64)>,
) -> Option<DVec3> {
    let mut last = None;
    let mut set = sequence;
    for _ in 0..MAX_TRIES {
        let [x, y, keep, _] = set.point4(index);
        let (candidate, probability) = point([x, y])?;
        if keep < probability {
            return Some(candidate);
        }
        last = Some(candidate);
        set = set.dimension_set(0);
    }
    last
}

/// The largest cosine between the normal and directions to a convex polygon above the horizon.
fn highest_cosine(position: DVec3, normal: DVec3, polygon: &[DVec3]) -> f64 {
    let mut highest = 0f64;
    let mut inside = true;
    let to = |k: usize| (polygon[k % polygon.len()] - position).normalize_or_zero();
    let orientation = to(0).dot(to(1).cross(to(2))).signum();
    for k in 0..polygon.len() {
        let (a, b) = (to(k), to(k + 1));
        highest = highest.max(normal.dot(a));
        let edge = a.cross(b) * orientation;
        inside &= edge.dot(normal) >= 0.0;
        // The point of the great circle through the edge that is nearest to the normal.
        let nearest = normal - edge * (normal.dot(edge) / edge.length_squared().max(1e-300));
        let within = a.cross(nearest).dot(edge) * orientation >= 0.0
            && nearest.cross(b).dot(edge) * orientation >= 0.0;
        if within {
            highest = highest.max(nearest.length());
        }
    }
    if inside {
        1.0
    } else {
        highest.clamp(1e-12, 1.0)
    }
}

#[cfg(test)]
#[path = "kernel_tests.rs"]
mod tests;
