//! A scene as an engine shows it with its lightmap: L = L_e + ρE/π, with E looked up in the map.
//!
//! Nothing is gathered: what is wrong with a map or its coordinates shows. Cost: one ray a camera sample.

use super::atlas::Atlas;
use super::lookup;
use super::map::Lightmap;
use crate::camera::CameraRay;
use crate::integrators::{Integrator, SampleKey, Seen, Vertex, background, cast};
use luxel_scenes::{Irradiance, Rgb};
use luxel_solver::world::World;

/// The integrator.
pub struct LightmapView<'a> {
    world: &'a World<'a>,
    atlas: &'a Atlas,
    map: &'a Lightmap,
}

impl<'a> LightmapView<'a> {
    /// A view of a map of the scene in `world`.
    pub fn new(world: &'a World<'a>, atlas: &'a Atlas, map: &'a Lightmap) -> Self {
        Self { world, atlas, map }
    }

    /// Irradiance in the map at a vertex, zero where no map is. A map has one side: both sides of a face show it.
    fn irradiance(&self, vertex: &Vertex<'_>) -> Rgb {
        let interaction = &vertex.interaction;
        let surfaces = self.world.surfaces();
        let (scene, geometry) = (surfaces.scene(), surfaces.geometry());
        lookup::place(self.atlas, scene, geometry, interaction.point)
            .map_or(Rgb::ZERO, |(page, place)| {
                lookup::sample(self.map, &self.map.values, page, place)
            })
    }
}

impl Integrator for LightmapView<'_> {
    fn estimate(&self, rays: &[CameraRay], _keys: &[SampleKey], seen: &mut [Seen]) {
        let (rays, hits) = cast(self.world, rays);
        for ((ray, hit), seen) in rays.iter().zip(&hits).zip(seen) {
            let value = match Vertex::new(self.world, ray, hit) {
                None => background(self.world, ray),
                Some(vertex) => {
                    let irradiance = Irradiance(self.irradiance(&vertex));
                    vertex.emission().0 + (vertex.reflectance() * irradiance).to_radiance().0
                }
            };
            *seen = value.into();
        }
    }
}
