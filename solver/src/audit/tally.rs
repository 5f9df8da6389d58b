//! Counts which faces rays meet from the front and which from behind.

use super::finding::{Finding, Place};
use super::{BURIED, INSIDE, SHARE};
use crate::bvh::{Hit, Ray};
use crate::patches::Side;
use crate::world::World;
use luxel_scenes::check::FaceRef;
use luxel_scenes::{FaceId, ObjectId, Specular};

/// What a ray met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Met {
    /// Nothing.
    Nothing,
    /// A side that reflects, emits or transmits.
    Lit(FaceId),
    /// The back of a one-sided face.
    Back(FaceId),
}

impl Met {
    /// The face.
    pub(super) fn face(self) -> Option<FaceId> {
        match self {
            Self::Nothing => None,
            Self::Lit(face) | Self::Back(face) => Some(face),
        }
    }
}

/// What each ray meets first.
pub(super) fn met(world: &World, rays: &[Ray]) -> Vec<Met> {
    let surfaces = world.surfaces();
    let geometry = surfaces.geometry();
    let mut hits = vec![Hit::MISS; rays.len()];
    world.bvh().closest_hits(rays, &mut hits);
    rays.iter()
        .zip(&hits)
        .map(|(ray, hit)| {
            let Some(triangle) = hit.triangle() else {
                return Met::Nothing;
            };
            let face = geometry.face(triangle);
            let side = Side::facing(ray.direction.as_dvec3(), geometry.normal(face));
            let is_glass = matches!(surfaces.material(face).specular, Specular::Glass { .. });
            if is_glass || surfaces.has_side(face, side) {
                Met::Lit(face)
            } else {
                Met::Back(face)
            }
        })
        .collect()
}

/// Hits by face, and points by object.
#[derive(Clone)]
pub(super) struct Tally {
    /// Of each face: rays that met its lit side, and its back.
    faces: Vec<[u32; 2]>,
    /// Of each object: points on it, and those of them that lie inside a solid.
    points: Vec<[u32; 2]>,
    /// Of each object: the back that was met first from inside a solid.
    around: Vec<Option<FaceId>>,
    /// Rays of points that see more lit surfaces than nothing, and those of them that left the scene.
    rays: [u64; 2],
}

impl Tally {
    /// Nothing counted yet.
    pub(super) fn new(world: &World) -> Self {
        let scene = world.scene();
        Self {
            faces: vec![[0; 2]; scene.faces.len()],
            points: vec![[0; 2]; scene.objects.len()],
            around: vec![None; scene.objects.len()],
            rays: [0; 2],
        }
    }

    /// Counts rays.
    pub(super) fn add(&mut self, met: &[Met]) {
        for met in met {
            match met {
                Met::Nothing => {}
                Met::Lit(face) => self.faces[face.index()][0] += 1,
                Met::Back(face) => self.faces[face.index()][1] += 1,
            }
        }
    }

    /// Counts the rays of a point on an object, unless it lies inside a solid.
    pub(super) fn add_point(&mut self, object: ObjectId, met: &[Met]) {
        let back = |met: &Met| match met {
            Met::Back(face) => Some(*face),
            _ => None,
        };
        let backs = met.iter().filter_map(back).count();
        let points = &mut self.points[object.index()];
        points[0] += 1;
        if backs as f64 > INSIDE * met.len() as f64 {
            points[1] += 1;
            let around = &mut self.around[object.index()];
            *around = around.or(met.iter().find_map(back));
        } else {
            let missed = met.iter().filter(|met| **met == Met::Nothing).count();
            // Others stand outside: they are not in a room that light could leave.
            if met.len() - backs >= 2 * missed {
                self.rays[0] += met.len() as u64;
                self.rays[1] += missed as u64;
            }
            self.add(met);
        }
    }

    /// Adds the counts of later points.
    pub(super) fn merge(&mut self, later: &Self) {
        let add = |sum: &mut [u32; 2], more: &[u32; 2]| {
            sum[0] += more[0];
            sum[1] += more[1];
        };
        for (sum, more) in self.faces.iter_mut().zip(&later.faces) {
            add(sum, more);
        }
        for (sum, more) in self.points.iter_mut().zip(&later.points) {
            add(sum, more);
        }
        for (sum, more) in self.rays.iter_mut().zip(later.rays) {
            *sum += more;
        }
        for (first, next) in self.around.iter_mut().zip(&later.around) {
            *first = first.or(*next);
        }
    }

    /// Fraction of the rays from points in rooms that left the scene.
    pub(super) fn escaping(&self) -> f64 {
        let [rays, escaped] = self.rays;
        escaped as f64 / rays.max(1) as f64
    }

    /// All hits of backs.
    pub(super) fn total_backs(&self) -> u32 {
        self.faces.iter().map(|[_, backs]| backs).sum()
    }

    /// The face whose back was met most often, among those of `object` when one is given; the first
    /// of equals.
    pub(super) fn most_seen_back(&self, world: &World, object: Option<ObjectId>) -> Option<Place> {
        let scene = world.scene();
        let of_object =
            |face: &FaceId| object.is_none_or(|object| scene.faces[face.index()].object == object);
        let (_, face) = scene
            .face_ids()
            .map(|face| (self.faces[face.index()][1], face))
            .filter(|(backs, face)| *backs > 0 && of_object(face))
            .max_by_key(|&(backs, face)| (backs, std::cmp::Reverse(face)))?;
        Some(Place::new(world, face))
    }

    /// Objects whose backs rays meet in the open.
    pub(super) fn backs(&self, world: &World, camera: Option<&str>) -> Vec<Finding> {
        let scene = world.scene();
        let mut objects = vec![[0u32; 2]; scene.objects.len()];
        for (face, [lit, backs]) in scene.faces.iter().zip(&self.faces) {
            let sum = &mut objects[face.object.index()];
            sum[0] += lit + backs;
            sum[1] += backs;
        }
        let seen = |(index, [rays, backs]): (usize, [u32; 2])| {
            if backs == 0 {
                return None;
            }
            let fraction = f64::from(backs) / f64::from(rays.max(1));
            Some(Finding::BackSeen {
                fraction,
                is_frequent: fraction >= SHARE,
                place: self.most_seen_back(world, Some(ObjectId::new(index)))?,
                camera: camera.map(str::to_owned),
            })
        };
        objects.into_iter().enumerate().filter_map(seen).collect()
    }

    /// Objects that lie inside solids as a whole.
    pub(super) fn buried(&self, world: &World) -> Vec<Finding> {
        let scene = world.scene();
        let objects = self.points.iter().zip(&self.around).enumerate();
        objects
            .filter(|(_, ([points, inside], _))| f64::from(*inside) >= BURIED * f64::from(*points))
            .filter_map(|(index, (_, around))| {
                Some(Finding::ObjectInside {
                    object: scene.objects[index].name.clone(),
                    around: FaceRef::new(scene, (*around)?),
                })
            })
            .collect()
    }
}
