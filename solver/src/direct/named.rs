//! Lights as programs that show a scene know them: one by one, with a name.
//!
//! What an object emits is one light, however many polygons it is made of. A sky and an environment are none: they have no place
//! from which they shine, and no visible fraction that a shadow could be looked up for. Neither are surfaces whose emission is found
//! by rays alone ([`Lights::has_unlisted_emission`]).

use super::lights::{Lights, Source};
use crate::patches::Side;
use luxel_scenes::{LightKind, Scene, Sidedness};

/// What a light is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NamedKind {
    /// A point, shining in all directions or by Lambert's law.
    Point,
    /// A point that shines into a cone.
    Spot,
    /// Parallel light.
    Directional,
    /// All that an object emits.
    Surface,
}

/// A light.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedLight {
    /// Its name in the scene, or that of the object that emits.
    pub name: String,
    /// What it is.
    pub kind: NamedKind,
    /// Its places in [`Lights::sources`], in order.
    pub sources: Vec<usize>,
}

impl Lights {
    /// The lights of the scene that these are of: lamps in the order of the file, then emissive objects in theirs.
    pub fn named(&self, scene: &Scene) -> Vec<NamedLight> {
        let is_polygon = |source: &&Source| matches!(source, Source::Polygon { .. });
        let polygons = self.sources().iter().take_while(is_polygon).count();
        let lamps = scene.lights.iter().filter_map(|light| {
            let kind = match light.kind {
                LightKind::Point { .. } | LightKind::Lambertian { .. } => NamedKind::Point,
                LightKind::Spot { .. } => NamedKind::Spot,
                LightKind::Directional { .. } => NamedKind::Directional,
                LightKind::Sky { .. } | LightKind::Environment { .. } => return None,
            };
            Some((light.name.clone(), kind))
        });
        let mut named: Vec<NamedLight> = lamps
            .zip(polygons..)
            .map(|((name, kind), source)| NamedLight {
                name,
                kind,
                sources: vec![source],
            })
            .collect();
        let mut of_object = vec![Vec::new(); scene.objects.len()];
        for face in scene.face_ids() {
            let object = scene.faces[face.index()].object;
            let sides: &[Side] = match scene.material(face).sidedness {
                Sidedness::Both => &[Side::Back, Side::Front],
                Sidedness::Front => &[Side::Front],
            };
            let own = sides.iter().filter_map(|&side| self.source_of(face, side));
            of_object[object.index()].extend(own);
        }
        for (object, mut sources) in scene.objects.iter().zip(of_object) {
            sources.sort_unstable();
            sources.dedup();
            if !sources.is_empty() {
                named.push(NamedLight {
                    name: object.name.clone(),
                    kind: NamedKind::Surface,
                    sources,
                });
            }
        }
        named
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::World;
    use glam::DVec3;
    use luxel_scenes::{Intensity, Irradiance, Light, Material, Radiance, Reflectance, Sky};

    fn push_lamp(scene: &mut Scene, object: &str, x: f64, sidedness: Sidedness) {
        let object = scene.push_object(object);
        let mut material =
            Material::diffuse("lamp", Reflectance::ZERO).with_emission(Radiance::splat(1.0));
        material.sidedness = sidedness;
        let material = scene.push_material(material);
        let corner = |dx: f64, y: f64| DVec3::new(x + dx, y, 0.0);
        let square = [
            corner(0., 0.),
            corner(1., 0.),
            corner(1., 1.),
            corner(0., 1.),
        ];
        scene.push_face(&square, object, material);
    }

    fn push_light(scene: &mut Scene, name: &str, kind: LightKind) {
        let name = name.into();
        scene.lights.push(Light { name, kind });
    }

    #[test]
    fn every_source_belongs_to_one_light() {
        let mut scene = Scene::default();
        push_lamp(&mut scene, "left", 0.0, Sidedness::Front);
        // Beside the first, of the same material but for its sides: not one polygon with it.
        push_lamp(&mut scene, "right", 1.0, Sidedness::Both);
        let uniform = Sky::Uniform {
            radiance: Radiance::splat(1.0),
        };
        let sky = LightKind::Sky {
            sky: uniform,
            up: DVec3::Y,
            ground: Radiance::ZERO,
        };
        let sun = LightKind::Directional {
            direction: DVec3::NEG_Y,
            irradiance: Irradiance::splat(1.0),
        };
        let bulb = LightKind::Point {
            position: DVec3::Y,
            intensity: Intensity::splat(1.0),
        };
        push_light(&mut scene, "sky", sky);
        push_light(&mut scene, "sun", sun);
        push_light(&mut scene, "bulb", bulb);
        let world = World::new(&scene);
        let named = world.lights().named(&scene);
        let found: Vec<_> = named
            .iter()
            .map(|light| (light.name.as_str(), light.kind, light.sources.clone()))
            .collect();
        assert_eq!(
            found,
            [
                ("sun", NamedKind::Directional, vec![3]),
                ("bulb", NamedKind::Point, vec![4]),
                ("left", NamedKind::Surface, vec![0]),
                ("right", NamedKind::Surface, vec![1, 2]),
            ]
        );
        assert!(
            World::new(&Scene::default())
                .lights()
                .named(&Scene::default())
                .is_empty()
        );
    }

    /// Two halves of a strip in two objects of one material stay two lights.
    #[test]
    fn objects_share_no_polygon() {
        let mut scene = Scene::default();
        let material = scene.push_material(
            Material::diffuse("lamp", Reflectance::ZERO).with_emission(Radiance::splat(1.0)),
        );
        for (name, x) in [("a", 0.0), ("b", 1.0)] {
            let object = scene.push_object(name);
            let corner = |dx: f64, y: f64| DVec3::new(x + dx, y, 0.0);
            let square = [
                corner(0., 0.),
                corner(1., 0.),
                corner(1., 1.),
                corner(0., 1.),
            ];
            scene.push_face(&square, object, material);
        }
        let world = World::new(&scene);
        let named = world.lights().named(&scene);
        assert_eq!(named[0].sources, [0]);
        assert_eq!(named[1].sources, [1]);
    }
}
