//! Receivers by the plane that they lie in.
//!
//! Receivers belong together when their normals and their heights along them agree within rounding. Where
//! in the plane they lie does not matter: two table tops of one height are one plane, unless the plane is divided into
//! [regions](super::regions). Cost: O(n log n).

use crate::world::Receiver;
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// Normals are told apart to a ten-thousandth: nearer ones are the same but for rounding.
const NORMAL_STEP: f64 = 1e-4;

/// Heights that differ by less, in units, are the same: that of rounded positions.
const HEIGHT: f64 = 4e-6;

/// A normal, rounded.
type Key = [i32; 3];

fn key(normal: DVec3) -> Key {
    (normal / NORMAL_STEP).round().as_ivec3().to_array()
}

/// A plane with the receivers in it.
pub(super) struct Plane {
    axes: [DVec3; 2],
    /// Positions of the receivers among all.
    pub(super) members: Vec<u32>,
}

impl Plane {
    /// Coordinates of a position in the plane.
    #[inline]
    pub(super) fn coordinates(&self, position: DVec3) -> DVec2 {
        DVec2::new(self.axes[0].dot(position), self.axes[1].dot(position))
    }
}

/// All planes that hold enough receivers.
pub(super) struct Planes {
    /// Height and position of each undivided plane of a normal, by height.
    by_normal: BTreeMap<Key, Vec<(f64, usize)>>,
    /// The plane of each receiver.
    of_receiver: Vec<Option<u32>>,
    all: Vec<Plane>,
}

impl Planes {
    /// The planes with at least `fewest` receivers. With `regions`, the number of one for each receiver, those of a plane that
    /// are of different regions count as lying in different planes.
    pub(super) fn new(receivers: &[Receiver], regions: Option<&[u32]>, fewest: usize) -> Self {
        let mut keyed: Vec<(Key, f64, u32)> = receivers
            .iter()
            .zip(0..)
            .map(|(receiver, index)| {
                let height = receiver.normal.dot(receiver.position);
                (key(receiver.normal), height, index)
            })
            .collect();
        keyed.sort_unstable_by(|a, b| {
            let heights = a.1.total_cmp(&b.1);
            a.0.cmp(&b.0).then(heights).then(a.2.cmp(&b.2))
        });
        let mut found = Self {
            by_normal: BTreeMap::new(),
            of_receiver: vec![None; receivers.len()],
            all: Vec::new(),
        };
        for run in keyed.chunk_by(|a, b| a.0 == b.0 && b.1 - a.1 <= HEIGHT) {
            if run.len() < fewest {
                continue;
            }
            let first = &receivers[run[0].2 as usize];
            let (tangent, bitangent) = first.normal.any_orthonormal_pair();
            let axes = [tangent, bitangent];
            let mut members: Vec<u32> = run.iter().map(|entry| entry.2).collect();
            members.sort_unstable();
            let Some(regions) = regions else {
                let middle = 0.5 * (run[0].1 + run[run.len() - 1].1);
                let of_normal = found.by_normal.entry(run[0].0).or_default();
                of_normal.push((middle, found.all.len()));
                found.push(Plane { axes, members });
                continue;
            };
            members.sort_by_key(|&member| regions[member as usize]);
            for members in members.chunk_by(|&a, &b| regions[a as usize] == regions[b as usize]) {
                if members.len() >= fewest {
                    let members = members.to_vec();
                    found.push(Plane { axes, members });
                }
            }
        }
        found
    }

    fn push(&mut self, plane: Plane) {
        for &member in &plane.members {
            self.of_receiver[member as usize] = Some(self.all.len() as u32);
        }
        self.all.push(plane);
    }

    /// The plane of a receiver, by its position among all.
    #[inline]
    pub(super) fn of(&self, receiver: usize) -> Option<usize> {
        self.of_receiver[receiver].map(|plane| plane as usize)
    }

    pub(super) fn all(&self) -> &[Plane] {
        &self.all
    }

    /// The undivided plane that a place lies in, by its position among all.
    #[inline]
    pub(super) fn find(&self, position: DVec3, normal: DVec3) -> Option<usize> {
        let of_normal = self.by_normal.get(&key(normal))?;
        let height = normal.dot(position);
        let above = of_normal.partition_point(|(other, _)| *other < height);
        let near = |at: usize| {
            let (other, plane) = *of_normal.get(at)?;
            ((other - height).abs() <= HEIGHT).then_some(plane)
        };
        near(above).or_else(|| near(above.checked_sub(1)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn receiver(position: [f64; 3], normal: DVec3) -> Receiver {
        Receiver {
            position: DVec3::from_array(position),
            normal,
            origin: Vec3::ZERO,
        }
    }

    #[test]
    fn receivers_are_told_apart_by_normal_and_height() {
        let mut receivers = Vec::new();
        for i in 0..10 {
            let x = 0.05 * f64::from(i);
            receivers.push(receiver([x, 0.1, 0.2 + 1e-7 * x], DVec3::Z));
            receivers.push(receiver([x, 0.1, 0.2], DVec3::NEG_Z));
            receivers.push(receiver([x, 0.1, 0.3], DVec3::Z));
        }
        receivers.push(receiver([0.0, 0.0, 0.4], DVec3::Z));
        let planes = Planes::new(&receivers, None, 2);
        let sizes: Vec<usize> = planes
            .all()
            .iter()
            .map(|plane| plane.members.len())
            .collect();
        assert_eq!(sizes, [10; 3]);
        for (index, receiver) in receivers.iter().enumerate() {
            let plane = planes.find(receiver.position, receiver.normal);
            let is_in = |plane: usize| planes.all()[plane].members.contains(&(index as u32));
            assert_eq!(plane.is_some_and(is_in), index < 30, "{index}");
        }
        assert_eq!(planes.find(DVec3::splat(0.25), DVec3::Z), None);
        assert_eq!(planes.find(DVec3::splat(0.2), DVec3::X), None);
    }
}
