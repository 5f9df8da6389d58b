//! Faces cut where walls stand on them, so that what lies on both sides of a wall gets charts of its own.
//!
//! A chart that runs under a wall that is thinner than two texels cannot hold both sides of it: bilinear filtering
//! mixes them within a texel of the wall, whatever texels hold. A polygon is cut by a plane as I. E. Sutherland and
//! G. W. Hodgman cut it ("Reentrant polygon clipping", CACM 17(1), 1974), once for each side. Points on an edge follow from its
//! ends taken in the order of their coordinates: faces that share the edge share the point, to the last bit. Attributes of corners
//! are interpolated along edges. Cost: linear in corners and planes of the faces that are cut.

use glam::{DVec3, Vec2, Vec3};
use luxel_scenes::{Face, FaceId, Scene};
use std::collections::{BTreeMap, HashMap};

/// Points so near to a plane, relative to the largest coordinate of the scene, lie on it.
const ON_PLANE: f64 = 1e-9;

/// The points x with n · x = d, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// n, a unit vector.
    pub normal: DVec3,
    /// d in metres.
    pub offset: f64,
}

impl Plane {
    /// Signed distance of a point in metres.
    pub fn distance(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }
}

/// A corner of a face as a mean of corners, or vertices, of the face that it was cut from: their numbers with their weights.
pub type Weights = Vec<(u32, f64)>;

/// A scene with faces that were cut.
pub struct CutScene {
    /// The scene; its first vertices are those of the scene before.
    pub scene: Scene,
    /// What each corner is made of, by vertices of the scene before.
    pub corners: Vec<Weights>,
    /// Whether the edge from each corner to the next of its face lies on a plane that cut it or ends at it.
    pub edges: Vec<bool>,
}

/// A corner while its face is cut.
#[derive(Clone)]
struct Corner {
    position: DVec3,
    /// The vertex that it had, if it is no new one.
    vertex: Option<u32>,
    weights: Weights,
    /// Whether the edge to the next corner lies on a plane.
    is_cut: bool,
}

/// Cuts faces by planes. A plane that does not cross its face marks the edges of the face that lie on it.
pub fn cut(scene: &Scene, planes: &BTreeMap<FaceId, Vec<Plane>>) -> CutScene {
    let (lower, upper) = scene.bounds().unwrap_or_default();
    let tolerance = ON_PLANE * lower.abs().max(upper.abs()).max_element();
    let mut found = Builder::new(scene);
    for id in scene.face_ids() {
        let face = scene.faces[id.index()];
        let own = face.corners().map(|corner| {
            let vertex = scene.corners.vertex[corner];
            Corner {
                position: scene.vertices[vertex as usize],
                vertex: Some(vertex),
                weights: vec![(corner as u32, 1.0)],
                is_cut: false,
            }
        });
        let mut pieces = vec![own.collect::<Vec<Corner>>()];
        for plane in planes.get(&id).into_iter().flatten() {
            pieces = pieces
                .into_iter()
                .flat_map(|piece| divide(piece, plane, tolerance))
                .collect();
        }
        for piece in pieces {
            found.push(face, piece);
        }
    }
    found.cut
}

/// The parts of a polygon on both sides of a plane.
fn divide(mut polygon: Vec<Corner>, plane: &Plane, tolerance: f64) -> Vec<Vec<Corner>> {
    let count = polygon.len();
    let side = |corner: &Corner| {
        let distance = plane.distance(corner.position);
        if distance.abs() <= tolerance {
            0.0
        } else {
            distance
        }
    };
    let sides: Vec<f64> = polygon.iter().map(side).collect();
    for corner in 0..count {
        if sides[corner] == 0.0 && sides[(corner + 1) % count] == 0.0 {
            polygon[corner].is_cut = true;
        }
    }
    let (front, back) = (
        sides.iter().any(|&side| side > 0.0),
        sides.iter().any(|&side| side < 0.0),
    );
    if !(front && back) {
        return vec![polygon];
    }
    [1.0, -1.0]
        .map(|sign| {
            let mut part = Vec::new();
            for (corner, &own) in sides.iter().enumerate() {
                let next = (corner + 1) % count;
                let (own, other) = (sign * own, sign * sides[next]);
                if own >= 0.0 {
                    let leaves = own == 0.0 && other < 0.0;
                    part.push(Corner {
                        is_cut: polygon[corner].is_cut || leaves,
                        ..polygon[corner].clone()
                    });
                }
                if own * other < 0.0 {
                    let mut between = between([&polygon[corner], &polygon[next]], [own, other]);
                    // Where the edge leaves the side, the plane is next; where it comes back, the rest of the edge.
                    between.is_cut = own > 0.0 || polygon[corner].is_cut;
                    part.push(between);
                }
            }
            part
        })
        .into()
}

/// The point between two corners at opposite distances from a plane.
fn between(ends: [&Corner; 2], distances: [f64; 2]) -> Corner {
    let order = |corner: &Corner| corner.position.to_array();
    let is_ordered = order(ends[0]) <= order(ends[1]);
    let [(a, at_a), (b, at_b)] = if is_ordered {
        [(ends[0], distances[0]), (ends[1], distances[1])]
    } else {
        [(ends[1], distances[1]), (ends[0], distances[0])]
    };
    let share = at_a / (at_a - at_b);
    let mut weights: BTreeMap<u32, f64> = BTreeMap::new();
    for (corner, share) in [(a, 1.0 - share), (b, share)] {
        for &(old, weight) in &corner.weights {
            *weights.entry(old).or_default() += share * weight;
        }
    }
    Corner {
        position: a.position + (b.position - a.position) * share,
        vertex: None,
        weights: weights.into_iter().collect(),
        is_cut: false,
    }
}

/// A scene as it grows, face by face.
struct Builder<'s> {
    old: &'s Scene,
    cut: CutScene,
    /// New vertices by their positions.
    vertices: HashMap<[u64; 3], u32>,
}

impl<'s> Builder<'s> {
    fn new(old: &'s Scene) -> Self {
        let mut scene = old.clone();
        scene.faces.clear();
        scene.corners = luxel_scenes::Corners::default();
        Self {
            old,
            cut: CutScene {
                scene,
                corners: Vec::new(),
                edges: Vec::new(),
            },
            vertices: HashMap::new(),
        }
    }

    /// Adds a piece of a face.
    fn push(&mut self, face: Face, piece: Vec<Corner>) {
        let scene = &mut self.cut.scene;
        scene.faces.push(Face {
            first_corner: scene.corners.vertex.len() as u32,
            corner_count: piece.len() as u32,
            ..face
        });
        for corner in piece {
            let vertex = corner.vertex.unwrap_or_else(|| {
                let key = corner.position.to_array().map(|x| (x + 0.0).to_bits());
                *self.vertices.entry(key).or_insert_with(|| {
                    scene.vertices.push(corner.position);
                    scene.vertices.len() as u32 - 1
                })
            });
            scene.corners.vertex.push(vertex);
            let old = &self.old.corners;
            let weights = &corner.weights;
            if !old.normal.is_empty() {
                let mean = mean(&old.normal, weights, Vec3::ZERO);
                scene.corners.normal.push(mean.normalize_or_zero());
            }
            if !old.uv0.is_empty() {
                scene.corners.uv0.push(mean(&old.uv0, weights, Vec2::ZERO));
            }
            if !old.uv1.is_empty() {
                scene.corners.uv1.push(mean(&old.uv1, weights, Vec2::ZERO));
            }
            self.cut.edges.push(corner.is_cut);
            let of_vertices = weights
                .iter()
                .map(|&(old_corner, weight)| (old.vertex[old_corner as usize], weight));
            self.cut.corners.push(of_vertices.collect());
        }
    }
}

/// The weighted mean of an attribute.
fn mean<T>(values: &[T], weights: &Weights, zero: T) -> T
where
    T: Copy + std::ops::Add<Output = T> + std::ops::Mul<f32, Output = T>,
{
    let term = |&(corner, weight): &(u32, f64)| values[corner as usize] * weight as f32;
    weights.iter().map(term).fold(zero, |sum, term| sum + term)
}

#[cfg(test)]
mod tests {
    use super::*;
    use luxel_scenes::{Material, Reflectance};

    /// A floor of two squares, 2 m × 1 m, with normals and texture coordinates that are its x and y.
    fn floor() -> Scene {
        let mut scene = Scene::default();
        let (object, material) = (
            scene.push_object("floor"),
            scene.push_material(Material::diffuse("grey", Reflectance::splat(0.5))),
        );
        for x in [0.0, 1.0] {
            let at = |dx: f64, y: f64| DVec3::new(x + dx, y, 0.0);
            scene.push_face(
                &[at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)],
                object,
                material,
            );
        }
        for face in scene.face_ids() {
            let polygon: Vec<DVec3> = scene.polygon(face).collect();
            for p in polygon {
                scene.corners.uv0.push(Vec2::new(p.x as f32, p.y as f32));
                scene.corners.normal.push(Vec3::Z);
            }
        }
        scene
    }

    fn all(scene: &Scene, plane: Plane) -> BTreeMap<FaceId, Vec<Plane>> {
        scene.face_ids().map(|face| (face, vec![plane])).collect()
    }

    #[test]
    fn nothing_is_cut_by_nothing_or_by_a_plane_beside_it() {
        let scene = floor();
        let same = cut(&scene, &BTreeMap::new());
        assert_eq!(same.scene, scene);
        assert!(same.edges.iter().all(|edge| !edge));
        let beside = Plane {
            normal: DVec3::X,
            offset: 2.5,
        };
        assert_eq!(cut(&scene, &all(&scene, beside)).scene, scene);
        let empty = Scene::default();
        assert_eq!(cut(&empty, &BTreeMap::new()).scene, empty);
    }

    #[test]
    fn a_plane_along_an_edge_marks_it_and_cuts_nothing() {
        let scene = floor();
        let along = Plane {
            normal: DVec3::X,
            offset: 1.0,
        };
        let found = cut(&scene, &all(&scene, along));
        assert_eq!(found.scene, scene);
        // The right edge of the first square and the left one of the second.
        let marked: Vec<usize> = (0..8).filter(|&corner| found.edges[corner]).collect();
        assert_eq!(marked, [1, 7]);
    }

    #[test]
    fn pieces_fill_the_face_and_share_what_lies_on_the_plane() {
        let scene = floor();
        let slanted = Plane {
            normal: DVec3::new(3.0, 1.0, 0.0).normalize(),
            offset: 3.2 / 10.0_f64.sqrt(),
        };
        let found = cut(&scene, &all(&scene, slanted));
        // The line goes from (1.067, 0) to (0.733, 1): through both squares and the edge between them.
        assert_eq!(found.scene.faces.len(), 4);
        let area: f64 = found
            .scene
            .face_ids()
            .map(|face| found.scene.area(face))
            .sum();
        // Sums of a dozen products of numbers below two.
        assert!((area - 2.0).abs() < 1e-14);
        for face in found.scene.face_ids() {
            let own = found.scene.faces[face.index()].corners();
            assert_eq!(
                found.edges[own.clone()]
                    .iter()
                    .filter(|edge| **edge)
                    .count(),
                1
            );
            for corner in own {
                let position = found.scene.vertices[found.scene.corners.vertex[corner] as usize];
                let uv = found.scene.corners.uv0[corner].as_dvec2();
                // Coordinates follow the position to the rounding of f32.
                assert!((uv - position.truncate()).length() < 1e-6);
                let of_weights: DVec3 = found.corners[corner]
                    .iter()
                    .map(|&(vertex, weight)| scene.vertices[vertex as usize] * weight)
                    .sum();
                assert!((of_weights - position).length() < 1e-14);
                assert_eq!(found.scene.corners.normal[corner], Vec3::Z);
            }
        }
        // Three new points; the one on the common edge is one vertex, although both squares found it. Each square had
        // vertices of its own.
        assert_eq!(found.scene.vertices.len(), scene.vertices.len() + 3);
    }

    #[test]
    fn planes_cross_and_a_face_becomes_four() {
        let scene = floor();
        let planes = [DVec3::X, DVec3::Y].map(|normal| Plane {
            normal,
            offset: 0.25,
        });
        let first = scene.face_ids().next().expect("a face");
        let found = cut(&scene, &BTreeMap::from([(first, planes.to_vec())]));
        assert_eq!(found.scene.faces.len(), 5);
        let area: f64 = found
            .scene
            .face_ids()
            .map(|face| found.scene.area(face))
            .sum();
        assert!((area - 2.0).abs() < 1e-14);
    }
}
