//! Points on the surfaces of a scene, spread by area.
//!
//! A point is drawn by area from the fronts of all faces (and the backs of two-sided ones), with
//! Owen-scrambled Sobol' points, so that large faces get their share to within one point. Points
//! inside solids, where the floor runs on under a box, are dropped: most of what they see are backs.

use luxel_solver::bvh::{Hit, Ray};
use luxel_solver::patches::{PatchSize, Side};
use luxel_solver::sampling::{Discrete, Frame, Sequence, Stage, cosine_hemisphere};
use luxel_solver::world::{Receiver, World};

/// Rays that tell a point in the open from one inside a solid.
const RAYS: u32 = 32;

/// Share of rays that meet backs from which a point is inside a solid.
const INSIDE: f64 = 0.5;

/// Up to `count` points on the surfaces of `world`, in the unit frame.
pub(super) fn surface_points(world: &World<'_>, count: usize, seed: u64) -> Vec<Receiver> {
    let Ok(patches) = world.mesh(PatchSize::Whole) else {
        return Vec::new();
    };
    let Ok(by_area) = Discrete::new(patches.areas().iter().copied()) else {
        return Vec::new();
    };
    let geometry = world.surfaces().geometry();
    let ids: Vec<_> = patches.ids().collect();
    let sequence = Sequence::new(seed, Stage::COMPARISON, u64::MAX);
    let receivers = (0..count as u32).map(|index| {
        let [choice, _, u, v] = sequence.point4(index);
        let face = by_area.sample(choice).index;
        let sample = patches.sample(geometry, ids[face], [u, v]);
        Receiver {
            position: sample.position,
            normal: sample.normal,
            origin: sample.origin,
        }
    });
    receivers
        .enumerate()
        .filter(|(index, receiver)| is_open(world, receiver, *index as u64, seed))
        .map(|(_, receiver)| receiver)
        .collect()
}

/// True unless most rays from the point meet backs of one-sided faces.
fn is_open(world: &World<'_>, receiver: &Receiver, item: u64, seed: u64) -> bool {
    let sequence = Sequence::new(seed, Stage::COMPARISON, (1 << 40) | item);
    let frame = Frame::around(receiver.normal.as_vec3());
    let rays: Vec<Ray> = (0..RAYS)
        .map(|index| {
            let local = cosine_hemisphere::sample(sequence.point2_f32(index));
            Ray::new(receiver.origin, frame.to_world(local))
        })
        .collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    world.bvh().closest_hits(&rays, &mut hits);
    let backs = rays.iter().zip(&hits).filter(|(ray, hit)| {
        world.interaction(ray, hit).is_some_and(|met| {
            met.side == Side::Back && !world.surfaces().has_side(met.face, met.side)
        })
    });
    (backs.count() as f64) < INSIDE * f64::from(RAYS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use luxel_scenes::generate::{ClosedBox, Surface, furnace_box};

    #[test]
    fn points_follow_the_area() {
        let size = DVec3::new(4.0, 1.0, 1.0);
        let scene = furnace_box(size, Surface::grey(0.5, 1.0));
        let world = World::new(&scene);
        let points = surface_points(&world, 288, 3);
        assert_eq!(points.len(), 288, "nothing is hidden in a box");
        let floor = points.iter().filter(|p| p.normal.y > 0.5).count();
        // 4 of 18 m²; an even spread is off by a point or two, chance would be by seven.
        let area = ClosedBox {
            size,
            walls: [Surface::BLACK; 6],
        }
        .area();
        assert!((floor as f64 - 288.0 * 4.0 / area).abs() <= 3.0, "{floor}");
    }

    #[test]
    fn what_lies_under_a_box_is_left_out() {
        // A box of half the floor's sides stands on the floor without a bottom of its own.
        let mut scene = furnace_box(DVec3::ONE, Surface::grey(0.5, 1.0));
        let object = scene.push_object("block");
        let material = scene.faces[0].material;
        let at = |x, y, z| DVec3::new(0.25 + 0.5 * x, 0.5 * y, 0.25 + 0.5 * z);
        for corners in [
            [
                at(0., 1., 0.),
                at(0., 1., 1.),
                at(1., 1., 1.),
                at(1., 1., 0.),
            ],
            [
                at(0., 0., 0.),
                at(0., 1., 0.),
                at(1., 1., 0.),
                at(1., 0., 0.),
            ],
            [
                at(1., 0., 1.),
                at(1., 1., 1.),
                at(0., 1., 1.),
                at(0., 0., 1.),
            ],
            [
                at(0., 0., 1.),
                at(0., 1., 1.),
                at(0., 1., 0.),
                at(0., 0., 0.),
            ],
            [
                at(1., 0., 0.),
                at(1., 1., 0.),
                at(1., 1., 1.),
                at(1., 0., 1.),
            ],
        ] {
            scene.push_face(&corners, object, material);
        }
        let world = World::new(&scene);
        let frame = world.surfaces().geometry().frame();
        let hidden = surface_points(&world, 500, 1).into_iter().filter(|point| {
            let p = frame.to_world(point.position);
            p.y < 1e-6 && (p.x - 0.5).abs() < 0.24 && (p.z - 0.5).abs() < 0.24
        });
        assert_eq!(hidden.count(), 0);
    }
}
