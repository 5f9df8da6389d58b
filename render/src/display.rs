//! Values of patches made continuous over smooth surfaces, for pictures and meshes.
//!
//! Where patches meet, a vertex carries the mean of their values; each patch is interpolated from the
//! vertices on its border. A vertex that hangs in the middle of a larger patch's edge is a corner of
//! that patch, too, so that both sides agree along every edge and meshes have no T-junctions
//! (D. R. Baum, S. Mann, K. P. Smith, J. M. Winget, "Making Radiosity Usable", SIGGRAPH 1991). Patches
//! share a vertex when nothing separates them there: their normals lie within `CREASE` of each
//! other and a short ray from one to the other passes. A patch whose middle does not see its own
//! corner (a body stands between) leaves the value there to the others, and so does one inside a
//! solid. For display only: interpolation does not lower the error of a radiosity solution.
//! Cost: a hash of all corners and about ten short rays a corner.

mod coordinates;
mod nodes;

use glam::DVec3;
use luxel_scenes::Rgb;
use luxel_solver::bvh::Ray;
use luxel_solver::geometry::TriangleId;
use luxel_solver::patches::{PatchId, Patches, Side};
use luxel_solver::surface::SurfacePoint;
use luxel_solver::world::World;
use nodes::Nodes;
use rayon::prelude::*;
use std::collections::HashMap;

/// Least cosine between the normals of patches that are smoothed into each other: 30°. A smaller
/// angle shows the facets of coarse spheres, a larger one blurs the edges of furniture.
const CREASE: f64 = 0.866;

/// Polygons up to which the one that holds a point is searched for. Clusters have more; their
/// triangles are looked up directly.
const MAX_POLYGONS: usize = 4;

/// How far from a corner towards a patch's middle, and how high above it, its rays start, relative to
/// the way and to the patch's size. Smaller, and walls that stand near the corner are missed or rounding
/// decides; larger, and thin things on a floor separate it.
const INSET: f64 = 0.1;
const LIFT: f64 = 0.01;

/// Patches with shared vertices.
pub struct Display {
    vertices: Vec<Vertex>,
    pieces: Vec<Vec<Piece>>,
    /// Vertices of the triangles of clusters, front side.
    triangles: HashMap<TriangleId, [u32; 3]>,
}

/// A point where patches meet.
#[derive(Clone, Debug, PartialEq)]
pub struct Vertex {
    /// In the unit frame.
    pub position: DVec3,
    /// The patches whose mean it carries; at least one.
    pub patches: Vec<PatchId>,
}

/// A convex polygon of a patch, counter-clockwise from its side; some corners may lie on straight
/// edges.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// Indices of vertices.
    pub vertices: Vec<u32>,
    /// True when a corner lies on a straight edge, where a smaller neighbour ends.
    pub has_hanging: bool,
}

/// A patch at one of its corners.
#[derive(Clone, Copy)]
struct Share {
    patch: PatchId,
    normal: DVec3,
}

impl Display {
    /// Memory while so many patches are joined, in bytes: each has about four corners and as many vertices as
    /// patches that it shares them with, once in polygons, nodes and borders and once in what is made of them.
    pub fn bytes_for(patches: usize) -> usize {
        const LISTS: usize = 10 * size_of::<Vec<u32>>();
        const CORNERS: usize = 4 * size_of::<(DVec3, Share, [(u64, u64); 2])>();
        patches * (LISTS + CORNERS + size_of::<(Vertex, Piece, DVec3)>())
    }

    /// Joins the patches of a world. `exposed` tells which lie in the open (not inside a solid), and
    /// `joins` which pairs may share a vertex as far as the caller is concerned.
    ///
    /// # Panics
    /// When there is not one `exposed` for each patch.
    pub fn new(
        world: &World<'_>,
        patches: &Patches,
        exposed: &[bool],
        joins: impl Fn(PatchId, PatchId) -> bool + Sync,
    ) -> Self {
        assert_eq!(exposed.len(), patches.len(), "one answer for each patch");
        let geometry = world.surfaces().geometry();
        let polygons: Vec<Vec<Vec<DVec3>>> = patches
            .ids()
            .map(|patch| patches.polygons(geometry, patch))
            .collect();
        let nodes = Nodes::new(polygons.iter().flatten());
        // Borders with the nodes that hang in them.
        let borders: Vec<Vec<(Vec<u32>, bool)>> = polygons
            .par_iter()
            .map(|polygons| {
                polygons
                    .iter()
                    .map(|polygon| nodes.border(polygon))
                    .collect()
            })
            .collect();
        let mut shares: Vec<Vec<Share>> = vec![Vec::new(); nodes.len()];
        for (patch, (polygons, borders)) in patches.ids().zip(polygons.iter().zip(&borders)) {
            for (polygon, (border, _)) in polygons.iter().zip(borders) {
                let normal = normal(polygon);
                for &node in border {
                    let shares = &mut shares[node as usize];
                    if shares.iter().all(|share| share.patch != patch) {
                        shares.push(Share { patch, normal });
                    }
                }
            }
        }
        let groups: Vec<Vec<Group>> = shares
            .par_iter()
            .enumerate()
            .map(|(node, shares)| {
                group(
                    world,
                    patches,
                    exposed,
                    &joins,
                    nodes.position(node),
                    shares,
                )
            })
            .collect();
        let mut vertices = Vec::new();
        let mut vertex_of: HashMap<(u32, PatchId), u32> = HashMap::new();
        for (node, groups) in groups.iter().enumerate() {
            for group in groups {
                for &member in &group.members {
                    vertex_of.insert((node as u32, member), vertices.len() as u32);
                }
                vertices.push(Vertex {
                    position: nodes.position(node),
                    patches: group.givers.clone(),
                });
            }
        }
        let mut triangles = HashMap::new();
        let pieces = patches
            .ids()
            .zip(&borders)
            .map(|(patch, borders)| {
                let (faces, side) = patches.faces(patch);
                if borders.len() > MAX_POLYGONS && side == Side::Front {
                    for triangle in faces.iter().flat_map(|&face| geometry.triangles_of(face)) {
                        let middle = 1.0 / 3.0;
                        if patches.at(geometry, triangle, middle, middle, side) != Some(patch) {
                            continue;
                        }
                        let [a, b, c] = geometry.triangle(triangle).map(|corner| {
                            let key = (nodes.find(corner)?, patch);
                            vertex_of.get(&key).copied()
                        });
                        // One that a wall divides has corners in other patches.
                        if let (Some(a), Some(b), Some(c)) = (a, b, c) {
                            triangles.insert(triangle, [a, b, c]);
                        }
                    }
                }
                let piece = |(border, has_hanging): &(Vec<u32>, bool)| Piece {
                    vertices: border
                        .iter()
                        .map(|&node| vertex_of[&(node, patch)])
                        .collect(),
                    has_hanging: *has_hanging,
                };
                borders.iter().map(piece).collect()
            })
            .collect();
        Self {
            vertices,
            pieces,
            triangles,
        }
    }

    /// All vertices.
    pub fn vertices(&self) -> &[Vertex] {
        &self.vertices
    }

    /// The polygons of a patch.
    pub fn pieces(&self, patch: PatchId) -> &[Piece] {
        &self.pieces[patch.index()]
    }

    /// The values of the vertices from one for each patch.
    pub fn at_vertices(&self, values: &[Rgb]) -> Vec<Rgb> {
        self.vertices
            .iter()
            .map(|vertex| {
                let sum: Rgb = vertex.patches.iter().map(|p| values[p.index()]).sum();
                sum / vertex.patches.len() as f64
            })
            .collect()
    }

    /// The value at a point of a patch, `position` in the unit frame, interpolated between the
    /// `values` of vertices; `None` on a degenerate polygon, on the back of a cluster and on faces of a
    /// cluster that walls divide.
    pub fn interpolate(
        &self,
        values: &[Rgb],
        patch: PatchId,
        point: SurfacePoint,
        position: DVec3,
    ) -> Option<Rgb> {
        let pieces = self.pieces(patch);
        if pieces.len() > MAX_POLYGONS {
            let corners = self.triangles.get(&point.triangle)?;
            let [a, b, c] = corners.map(|vertex| values[vertex as usize]);
            return Some(a * (1.0 - point.u - point.v) + b * point.u + c * point.v);
        }
        let corners = |piece: &Piece| -> Vec<DVec3> {
            let position = |&vertex: &u32| self.vertices[vertex as usize].position;
            piece.vertices.iter().map(position).collect()
        };
        let (border, piece) =
            match pieces {
                [piece] => (corners(piece), piece),
                pieces => pieces.iter().map(|piece| (corners(piece), piece)).max_by(
                    |(a, _), (b, _)| {
                        coordinates::depth(a, position).total_cmp(&coordinates::depth(b, position))
                    },
                )?,
            };
        let weights = coordinates::mean_value(&border, position)?;
        let weighted = piece.vertices.iter().zip(weights);
        Some(
            weighted
                .map(|(&vertex, weight)| values[vertex as usize] * weight)
                .sum(),
        )
    }
}

/// Patches that share a vertex.
struct Group {
    members: Vec<PatchId>,
    /// Those whose values it carries.
    givers: Vec<PatchId>,
}

/// Divides the patches at a node into those that nothing separates.
fn group(
    world: &World<'_>,
    patches: &Patches,
    exposed: &[bool],
    joins: &impl Fn(PatchId, PatchId) -> bool,
    node: DVec3,
    shares: &[Share],
) -> Vec<Group> {
    let geometry = world.surfaces().geometry();
    let free = |from: DVec3, to: DVec3| {
        let mut blocked = [true];
        let ray = Ray::segment(from.as_vec3(), to.as_vec3());
        world.bvh().occluded(&[ray], &mut blocked);
        !blocked[0]
    };
    // A point beside the node, above each patch, and whether the patch's middle sees it.
    let near: Vec<(DVec3, bool)> = shares
        .iter()
        .map(|share| {
            let lift = share.normal * (LIFT * f64::from(patches.size(share.patch)));
            let middle = patches.sample(geometry, share.patch, [0.5, 0.5]).position;
            let near = node.lerp(middle, INSET) + lift;
            let gives = exposed[share.patch.index()] && free(middle + lift, near);
            (near, gives)
        })
        .collect();
    let mut group_of: Vec<usize> = (0..shares.len()).collect();
    for a in 0..shares.len() {
        for b in 0..a {
            let (one, other) = (shares[a], shares[b]);
            if group_of[a] != group_of[b]
                && one.normal.dot(other.normal) > CREASE
                && exposed[one.patch.index()] == exposed[other.patch.index()]
                && joins(one.patch, other.patch)
                && free(near[a].0, near[b].0)
            {
                let (from, to) = (group_of[a], group_of[b]);
                for group in &mut group_of {
                    if *group == from {
                        *group = to;
                    }
                }
            }
        }
    }
    let mut groups = Vec::new();
    for representative in 0..shares.len() {
        let of_group = || (0..shares.len()).filter(|&k| group_of[k] == representative);
        let members: Vec<PatchId> = of_group().map(|k| shares[k].patch).collect();
        if members.is_empty() {
            continue;
        }
        let mut givers: Vec<PatchId> = of_group()
            .filter(|&k| near[k].1)
            .map(|k| shares[k].patch)
            .collect();
        if givers.is_empty() {
            givers.clone_from(&members);
        }
        groups.push(Group { members, givers });
    }
    groups
}

/// Unit normal of a planar convex polygon.
fn normal(polygon: &[DVec3]) -> DVec3 {
    coordinates::vector_area(polygon).normalize_or_zero()
}
