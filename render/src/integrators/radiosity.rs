//! The radiosity solution itself, as a picture.
//!
//! L = L_e + ρE/π, where E is the irradiance of the patches, interpolated over smooth surfaces but
//! not across creases ([`crate::display`]); emission and reflectance are those of the very point, so
//! that textures stay sharp. Biased by the size of the patches: shadows are as soft as patches are
//! large. Cost: one ray a camera sample.

use super::vertex::Vertex;
use super::{Integrator, SampleKey, Seen, background, cast};
use crate::camera::CameraRay;
use crate::display::Display;
use luxel_scenes::{Irradiance, Rgb};
use luxel_solver::patches::Patches;
use luxel_solver::radiosity::RadiositySolution;
use luxel_solver::world::World;

/// The integrator.
pub struct RadiosityView<'w> {
    world: &'w World<'w>,
    patches: &'w Patches,
    display: Display,
    /// Irradiance at the display's vertices.
    at_vertices: Vec<Rgb>,
    /// Irradiance of the patches.
    of_patches: Vec<Rgb>,
}

impl<'w> RadiosityView<'w> {
    /// A view of the mean of `solutions` (at least one) over `patches` of `world`.
    ///
    /// # Panics
    /// When there is no solution.
    pub fn new(
        world: &'w World<'w>,
        patches: &'w Patches,
        solutions: &[RadiositySolution],
    ) -> Self {
        assert!(!solutions.is_empty(), "a view needs a solution");
        let share = 1.0 / solutions.len() as f64;
        let mean = |patch| -> Irradiance {
            let values = solutions
                .iter()
                .map(|solution| solution.mean_irradiance(patch));
            values.sum::<Irradiance>() * share
        };
        let of_patches: Vec<Rgb> = patches.ids().map(|patch| mean(patch).0).collect();
        let is_exposed = |patch| solutions.iter().any(|solution| solution.is_exposed(patch));
        let exposed: Vec<bool> = patches.ids().map(is_exposed).collect();
        let display = Display::new(world, patches, &exposed, |_, _| true);
        Self {
            world,
            patches,
            at_vertices: display.at_vertices(&of_patches),
            display,
            of_patches,
        }
    }

    fn reflected(&self, vertex: &Vertex<'_>) -> Rgb {
        let interaction = &vertex.interaction;
        let point = interaction.point;
        let geometry = self.world.surfaces().geometry();
        let patch = self
            .patches
            .at(geometry, point.triangle, point.u, point.v, interaction.side);
        let irradiance = patch.map_or(Irradiance::ZERO, |patch| {
            let position = interaction.receiver.position;
            let smooth = self
                .display
                .interpolate(&self.at_vertices, patch, point, position);
            Irradiance(smooth.unwrap_or(self.of_patches[patch.index()]))
        });
        (vertex.reflectance() * irradiance).to_radiance().0
    }
}

impl Integrator for RadiosityView<'_> {
    fn estimate(&self, rays: &[CameraRay], _keys: &[SampleKey], seen: &mut [Seen]) {
        let (rays, hits) = cast(self.world, rays);
        for ((ray, hit), seen) in rays.iter().zip(&hits).zip(seen) {
            let value = Vertex::new(self.world, ray, hit).map_or_else(
                || background(self.world, ray),
                |vertex| vertex.emission().0 + self.reflected(&vertex),
            );
            *seen = value.into();
        }
    }
}
