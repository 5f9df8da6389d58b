//! Finds what light cannot cross on an element, and divides it there.
//!
//! An element is cut along the walls across it into cells. Points are spread over each cell; those from
//! which all that is seen are backs of one-sided faces lie inside a solid. Two cells are connected when
//! a segment between points of them, a little above the surface, meets nothing. Where the cells fall into two
//! or more connected components in the open, each is a patch of its own, and what lies inside solids is
//! one more. So it is where fronts of faces are seen from within a solid: light would pass from room to room
//! through faces that run on inside a wall. Elsewhere the element stays whole: a box that stands on a floor
//! hides a part of a patch and divides none.
//!
//! Without this one value would stand for both sides of a wall, and light would leak through the floor
//! below it. The sides of a two-sided face are examined apart; an element is divided for both where one is.
//!
//! Clusters of small faces that do not lie in one plane are furniture, not floors, and stay whole.
//!
//! Source: luxel's own; meshes that keep to where surfaces meet after D. R. Baum, S. Mann, K. P. Smith,
//! J. M. Winget, "Making Radiosity Usable", SIGGRAPH 1991. Deterministic. Validity: walls as
//! [`super::walls`] has them; a gap that none of 64 segments finds is taken for closed. Cost: seven rays for an
//! element with a wall across that light goes around, up to 64 for each pair of cells that it does not.

use super::Side;
use super::cuts::{Cuts, guard};
use super::partition::{Partition, Piece, divides, is_beside, partition};
use super::region::{Region, Shape, fan, sample_triangle, triangle_area};
use super::walls::{LIFT, Obstacles, Standing, Surface, Wall};
use crate::bvh::{Bvh, Hit, Ray};
use crate::geometry::ray_origin;
use crate::sampling::Frame;
use crate::surface::Surfaces;
use glam::{DVec3, Vec3};
use luxel_scenes::{FaceId, Sidedness};
use rayon::prelude::*;

/// Points of a cell from which segments to other cells start.
const POINTS: usize = 8;

/// Share of the way to the middle of its triangle by which a point is moved off the borders of its cell. Smaller
/// than the rounding of f32, and segments start behind the wall; larger, and those around its end are missed.
const INWARD: f64 = 0.1;

/// Faces up to this share of the mean patch's side are not examined as walls or parts of them. Larger, and
/// walls of panels are overlooked; smaller, and meshing furnished rooms takes longer than solving them.
const LEAST_FACE: f64 = 0.2;

/// Divides the elements of those regions that have not been examined.
pub(super) fn separate(surfaces: &Surfaces, bvh: &Bvh, regions: &mut [Region]) {
    let geometry = surfaces.geometry();
    let elements: f64 = regions.iter().map(|r| f64::from(r.element_count())).sum();
    let total: f64 = (0..geometry.face_count())
        .map(|index| surfaces.area(FaceId::new(index)))
        .sum();
    let least = LEAST_FACE * (total / elements.max(1.0)).sqrt();
    let obstacles = Obstacles::new(geometry, least);
    regions
        .par_iter_mut()
        .filter(|region| !region.is_examined)
        .for_each(|region| {
            region.cuts = cuts(surfaces, bvh, &obstacles, region).map(Box::new);
            region.is_examined = true;
        });
}

/// The walls of a region; `None` without.
fn cuts(surfaces: &Surfaces, bvh: &Bvh, obstacles: &Obstacles, region: &Region) -> Option<Cuts> {
    let geometry = surfaces.geometry();
    let outline: Vec<Vec<DVec3>> = region
        .faces
        .iter()
        .map(|&face| geometry.polygon(face))
        .collect();
    let corners = || outline.iter().flatten();
    let [lower, upper] = super::box_tree::bounds_of(corners());
    let reach = lower.abs().max(upper.abs()).max_element();
    let guard = guard(reach, (upper - lower).max_element());
    let normal = geometry.normal(region.faces[0]);
    let two_sided = surfaces.material(region.faces[0]).sidedness == Sidedness::Both;
    // Half of the guard: what is taken to lie on a wall is well within it.
    let tolerance = 0.5 * guard;
    let wide = Surface {
        polygons: outline.iter().map(Vec::as_slice).collect(),
        normal,
        lift: LIFT * area(&outline).sqrt(),
        two_sided,
        tolerance,
    };
    if !wide.is_planar() {
        return None;
    }
    let standing = obstacles.across(geometry, &region.faces, &wide);
    if standing.is_empty() {
        return None;
    }
    let count = region.shape_count();
    let mut cuts = Cuts::new(normal, guard, count);
    let examined = Examined {
        surfaces,
        bvh,
        two_sided,
    };
    for element in 0..count {
        let pieces = pieces(surfaces, region, element);
        let own = Surface {
            polygons: pieces
                .iter()
                .map(|(_, polygon)| polygon.as_slice())
                .collect(),
            normal,
            lift: LIFT * region.shape_area(geometry, element).sqrt(),
            two_sided,
            tolerance,
        };
        examined.element(&mut cuts, element, &own, &pieces, &standing);
    }
    (!cuts.is_empty()).then_some(cuts)
}

fn area(polygons: &[Vec<DVec3>]) -> f64 {
    let triangles = polygons.iter().flat_map(|polygon| fan(polygon));
    triangles.map(triangle_area).sum()
}

/// The polygons of an element of the shape with their faces. An element of joined triangles has the first:
/// they are one plane.
fn pieces(surfaces: &Surfaces, region: &Region, element: u32) -> Vec<Piece> {
    let polygons = region.shape_polygons(surfaces.geometry(), element);
    let face = |index: usize| match region.shape {
        Shape::Faces { .. } => region.faces[index],
        _ => region.faces[0],
    };
    polygons
        .into_iter()
        .enumerate()
        .map(|(index, polygon)| (face(index), polygon))
        .collect()
}

/// What points of a cell see.
#[derive(Default)]
struct View {
    /// Those in the open, raised above the surface.
    open: Vec<Vec3>,
    /// Whether one inside a solid sees a front besides backs.
    sees_front: bool,
}

/// What elements are examined with.
struct Examined<'a> {
    surfaces: &'a Surfaces<'a>,
    bvh: &'a Bvh,
    two_sided: bool,
}

impl Examined<'_> {
    /// Adds what walls make of an element.
    fn element(
        &self,
        cuts: &mut Cuts,
        element: u32,
        surface: &Surface,
        pieces: &[Piece],
        standing: &Standing,
    ) {
        let barriers = standing.barriers(surface);
        if barriers.is_empty() {
            return;
        }
        let Partition { tree, cells } = partition(pieces.to_vec(), &barriers, surface.tolerance);
        let walls: Vec<Wall> = barriers.iter().map(|barrier| barrier.wall).collect();
        if cells.len() > 1
            && let Some((part_of, count)) = self.components(&cells, surface.lift)
        {
            let mut parts = vec![Vec::new(); count];
            for (pieces, &part) in cells.into_iter().zip(&part_of) {
                parts[part].extend(pieces);
            }
            cuts.divide(element, walls, tree, &part_of, parts);
            return;
        }
        let beside: Vec<Wall> = barriers
            .iter()
            .filter(|barrier| {
                is_beside(pieces, barrier, surface.tolerance)
                    && !divides(pieces, &barrier.wall, surface.tolerance)
            })
            .map(|barrier| barrier.wall)
            .collect();
        if !beside.is_empty() {
            cuts.add(element, beside);
        }
    }

    /// The component of each cell and their number; `None` when light connects all that is open.
    fn components(&self, cells: &[Vec<Piece>], lift: f64) -> Option<(Vec<usize>, usize)> {
        let mut keys = vec![[None; 2]; cells.len()];
        let mut is_divided = false;
        for side in [Side::Front, Side::Back] {
            if side == Side::Back && !self.two_sided {
                continue;
            }
            let (labels, is_seen_within) = self.labels(cells, lift, side);
            let mut open: Vec<usize> = labels.iter().copied().flatten().collect();
            open.sort_unstable();
            open.dedup();
            is_divided |= open.len() > 1 || (open.len() == 1 && is_seen_within);
            for (key, label) in keys.iter_mut().zip(labels) {
                key[usize::from(side == Side::Back)] = label;
            }
        }
        if !is_divided {
            return None;
        }
        let mut distinct = Vec::new();
        let part_of = keys
            .iter()
            .map(|key| {
                distinct.iter().position(|k| k == key).unwrap_or_else(|| {
                    distinct.push(*key);
                    distinct.len() - 1
                })
            })
            .collect();
        Some((part_of, distinct.len()))
    }

    /// A label for each cell, the same where light connects them on a side, `None` inside solids; and
    /// whether fronts are seen from within one.
    fn labels(&self, cells: &[Vec<Piece>], lift: f64, side: Side) -> (Vec<Option<usize>>, bool) {
        // One point of each cell tells where light goes around everything, which is the rule.
        let views = |count| -> Vec<View> {
            let view = |pieces: &Vec<Piece>| self.view(pieces, lift, side, count);
            cells.iter().map(view).collect()
        };
        let first = views(1);
        if first.iter().all(|view| view.open.len() == 1) {
            let labels = self.connect(&first);
            if labels.iter().all(|&label| label == Some(0)) {
                return (labels, false);
            }
        }
        let views = views(POINTS);
        let is_seen_within = |view: &View| view.open.is_empty() && view.sees_front;
        (self.connect(&views), views.iter().any(is_seen_within))
    }

    /// What `count` points of a cell see.
    fn view(&self, pieces: &[Piece], lift: f64, side: Side, count: usize) -> View {
        let mut view = View::default();
        for (face, point) in spread(pieces, count) {
            self.look_around(face, point, lift, side, &mut view);
        }
        view
    }

    /// Adds a point to the view of its cell. In the open it is raised, at most half as high as what hangs
    /// over it.
    fn look_around(&self, face: FaceId, point: DVec3, lift: f64, side: Side, view: &mut View) {
        let geometry = self.surfaces.geometry();
        let front = geometry.normal(face);
        let normal = if side == Side::Front { front } else { -front };
        let origin = ray_origin(point, normal, geometry.extent(face));
        let frame = Frame::around(normal.as_vec3());
        let slant = std::f32::consts::FRAC_1_SQRT_2;
        // The upright ray alone may run along a solid to where its end and another face are one plane.
        let rays = [(0.0, 1.0), (slant, slant), (-slant, slant)]
            .map(|(x, z)| Ray::new(origin, frame.to_world(Vec3::new(x, 0.0, z))));
        let mut hits = [Hit::MISS; 3];
        self.bvh.closest_hits(&rays, &mut hits);
        let met = rays.iter().zip(&hits);
        let backs = met.filter(|(ray, hit)| self.is_back(ray, hit)).count();
        if backs > 1 {
            view.sees_front |= backs < rays.len();
        } else {
            let height = lift.min(0.5 * f64::from(hits[0].t));
            let above = origin.as_dvec3() + normal * height;
            view.open.push(above.as_vec3());
        }
    }

    /// True when a ray met the back of a one-sided face.
    fn is_back(&self, ray: &Ray, hit: &Hit) -> bool {
        hit.triangle().is_some_and(|triangle| {
            let face = self.surfaces.geometry().face(triangle);
            let normal = self.surfaces.geometry().normal(face);
            Side::facing(ray.direction.as_dvec3(), normal) == Side::Back
                && !self.surfaces.has_side(face, Side::Back)
        })
    }

    /// Labels of cells from points above them: the lowest number among those that are connected.
    fn connect(&self, views: &[View]) -> Vec<Option<usize>> {
        let mut labels: Vec<Option<usize>> = views
            .iter()
            .enumerate()
            .map(|(cell, view)| (!view.open.is_empty()).then_some(cell))
            .collect();
        for a in 0..views.len() {
            for b in a + 1..views.len() {
                let (Some(one), Some(other)) = (labels[a], labels[b]) else {
                    continue;
                };
                if one != other && self.passes(&views[a].open, &views[b].open) {
                    let (low, high) = (one.min(other), one.max(other));
                    for label in labels.iter_mut().filter(|label| **label == Some(high)) {
                        *label = Some(low);
                    }
                }
            }
        }
        labels
    }

    /// Whether a segment between any two of the points meets nothing.
    fn passes(&self, from: &[Vec3], to: &[Vec3]) -> bool {
        from.iter().any(|&a| {
            let rays: Vec<Ray> = to.iter().map(|&b| Ray::segment(a, b)).collect();
            let mut blocked = vec![true; rays.len()];
            self.bvh.occluded(&rays, &mut blocked);
            blocked.contains(&false)
        })
    }
}

/// `count` points spread evenly by area over some polygons, and inside them by more than rounding: on the foot
/// of a wall they would be on both of its sides. The points of J. M. Hammersley, "Monte Carlo Methods for
/// Solving Multivariable Problems", 1960, each moved a little towards the middle of its triangle.
fn spread(pieces: &[Piece], count: usize) -> Vec<(FaceId, DVec3)> {
    let triangles: Vec<(FaceId, [DVec3; 3])> = pieces
        .iter()
        .flat_map(|(face, polygon)| fan(polygon).map(|triangle| (*face, triangle)))
        .collect();
    let areas: Vec<f64> = triangles.iter().map(|(_, t)| triangle_area(*t)).collect();
    let total: f64 = areas.iter().sum();
    let inward = if count == 1 { 1.0 } else { INWARD };
    (0..count)
        .filter_map(|k| {
            let mut x = (k as f64 + 0.5) / count as f64 * total;
            let y = f64::from((k as u32).reverse_bits()) / 4_294_967_296.0;
            let index = areas.iter().position(|&area| {
                let is_here = x < area;
                x -= if is_here { 0.0 } else { area };
                is_here
            });
            // Rounding may let the sum fall short of the total.
            let index = index.or_else(|| triangles.len().checked_sub(1))?;
            let (face, [a, b, c]) = triangles[index];
            let share = (x / areas[index]).clamp(0.0, 1.0);
            let point = sample_triangle([a, b, c], [share, y]);
            Some((face, point.lerp((a + b + c) / 3.0, inward)))
        })
        .collect()
}
