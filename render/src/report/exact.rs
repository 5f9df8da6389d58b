//! Scenes whose answer is known whatever their shape: furnaces.
//!
//! Where every surface emits the same radiance Lₑ and reflects the same ρ, and every ray that leaves a
//! surface meets another one's lit side, each channel has L = Lₑ / (1 − ρ) in every direction
//! and E = πL everywhere.
//!
//! A scene counts as one when its materials are diffuse, without textures and alike, it has no
//! other lights, no edge of it is open (by [`luxel_scenes::check`]), and all of many rays from points
//! spread over it meet lit sides. Names play no part. The rays are a test, not a proof: a back that fills
//! less than 1e-5 of what an average point sees may be missed.

use super::surface_points::surface_points;
use luxel_scenes::check::{self, Finding};
use luxel_scenes::{Radiance, Reflectance, Rgb, Scene, Specular};
use luxel_solver::bvh::{Hit, Ray};
use luxel_solver::sampling::{Frame, Sequence, Stage, cosine_hemisphere};
use luxel_solver::world::World;

/// Points that rays leave.
const POINTS: usize = 4096;

/// Rays from each: 131 072 in all.
const RAYS: u32 = 32;

/// The radiance L of a furnace, the same everywhere and in all directions; `None` when the scene is
/// none. Cost: 131 072 rays where everything else fits.
pub fn furnace_radiance(world: &World<'_>) -> Option<Radiance> {
    let (emission, reflectance) = uniform_surface(world.scene())?;
    let is_open = |finding: &Finding| matches!(finding, Finding::OpenEdges { .. });
    if check::report(world.scene()).iter().any(is_open) || !is_closed(world) {
        return None;
    }
    Some(Radiance(emission.0 / (Rgb::ONE - reflectance.0)))
}

/// Emission and reflectance that all faces share, when the scene has no other light.
fn uniform_surface(scene: &Scene) -> Option<(Radiance, Reflectance)> {
    let mut faces = scene.face_ids();
    let first = scene.material(faces.next()?);
    let is_alike = |face| {
        let material = scene.material(face);
        material.emission == first.emission
            && material.reflectance == first.reflectance
            && material.emission_texture.is_none()
            && material.reflectance_texture.is_none()
            && !matches!(
                material.specular,
                Specular::Mirror { .. } | Specular::Glass { .. }
            )
    };
    let all_alike = scene.face_ids().all(is_alike);
    (all_alike && scene.lights.is_empty() && first.is_emissive())
        .then_some((first.emission, first.reflectance))
}

/// True when all test rays meet lit sides.
fn is_closed(world: &World<'_>) -> bool {
    let points = surface_points(world, POINTS, 0);
    let mut hits = vec![Hit::MISS; RAYS as usize];
    !points.is_empty()
        && points.iter().enumerate().all(|(item, point)| {
            let sequence = Sequence::new(0, Stage::COMPARISON, (2 << 40) | item as u64);
            let frame = Frame::around(point.normal.as_vec3());
            let rays: Vec<Ray> = (0..RAYS)
                .map(|index| {
                    let local = cosine_hemisphere::sample(sequence.point2_f32(index));
                    Ray::new(point.origin, frame.to_world(local))
                })
                .collect();
            world.bvh().closest_hits(&rays, &mut hits);
            rays.iter().zip(&hits).all(|(ray, hit)| {
                world
                    .interaction(ray, hit)
                    .is_some_and(|met| world.surfaces().has_side(met.face, met.side))
            })
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use luxel_scenes::Light;
    use luxel_scenes::generate::{ClosedBox, Surface, cornell_box, furnace_box};

    fn radiance(scene: &Scene) -> Option<Radiance> {
        furnace_radiance(&World::new(scene))
    }

    fn furnace() -> Scene {
        let surface = Surface {
            reflectance: Reflectance::new(0.5, 0.75, 0.0),
            emission: Radiance::new(1.0, 1.0, 3.0),
        };
        furnace_box(DVec3::new(1.0, 2.0, 3.0), surface)
    }

    #[test]
    fn a_furnace_is_known_by_its_content() {
        let mut scene = furnace();
        scene.name = "anything".into();
        assert_eq!(radiance(&scene), Some(Radiance::new(2.0, 4.0, 3.0)));
    }

    #[test]
    fn what_is_not_alike_closed_or_lit_by_itself_is_none() {
        assert_eq!(radiance(&cornell_box()), None);
        let mut walls = [Surface::grey(0.5, 1.0); 6];
        walls[2] = Surface::grey(0.4, 1.0);
        let size = DVec3::ONE;
        assert_eq!(radiance(&ClosedBox { size, walls }.scene()), None);

        let mut open = furnace();
        open.faces.pop();
        assert_eq!(radiance(&open), None, "a wall is missing");

        let mut dark = furnace();
        for material in &mut dark.materials {
            material.emission = Radiance::ZERO;
        }
        assert_eq!(radiance(&dark), None);

        let mut lit = furnace();
        lit.lights.push(Light {
            name: "sun".into(),
            kind: luxel_scenes::LightKind::Directional {
                direction: DVec3::NEG_Y,
                irradiance: luxel_scenes::Irradiance::splat(1.0),
            },
        });
        assert_eq!(radiance(&lit), None);

        // A furnace turned inside out is closed, but its surfaces see nothing.
        let mut turned = furnace();
        for face in turned.faces.clone() {
            turned.corners.vertex[face.corners()].reverse();
        }
        assert_eq!(radiance(&turned), None);
    }
}
