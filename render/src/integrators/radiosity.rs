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
    fine: Field<'w>,
    coarse: Option<Field<'w>>,
}

/// A mesh with the irradiance of its independent solutions.
struct Field<'w> {
    patches: &'w Patches,
    display: Display,
    solutions: Vec<Values>,
}

/// Irradiance in one solution.
struct Values {
    at_vertices: Vec<Rgb>,
    of_patches: Vec<Rgb>,
}

impl<'w> RadiosityView<'w> {
    /// A view of `solutions` (at least one) over `patches` of `world`: replicate r of a pixel sees
    /// solution r, modulo their number.
    ///
    /// # Panics
    /// When there is no solution.
    pub fn new(
        world: &'w World<'w>,
        patches: &'w Patches,
        solutions: &[RadiositySolution],
    ) -> Self {
        Self {
            world,
            fine: Field::new(world, patches, solutions),
            coarse: None,
        }
    }

    /// Memory of a view of so many patches and solutions, in bytes, while it is made.
    pub fn bytes_for(patches: usize, solutions: usize) -> usize {
        // About as many vertices as patches.
        Display::bytes_for(patches) + 2 * patches * solutions * size_of::<Rgb>()
    }

    /// Adds a coarser mesh with solutions of its own, for the error that patches make.
    ///
    /// # Panics
    /// When there is no solution.
    #[must_use]
    pub fn with_coarse(mut self, patches: &'w Patches, solutions: &[RadiositySolution]) -> Self {
        self.coarse = Some(Field::new(self.world, patches, solutions));
        self
    }

    fn reflected(&self, vertex: &Vertex<'_>, replicate: u32) -> Seen {
        let radiance = |irradiance: Rgb| {
            (vertex.reflectance() * Irradiance(irradiance))
                .to_radiance()
                .0
        };
        let fine = radiance(self.fine.at(vertex, replicate));
        let coarse = self
            .coarse
            .as_ref()
            .map(|coarse| radiance(coarse.at(vertex, replicate)));
        Seen {
            value: fine,
            mesh_difference: fine - coarse.unwrap_or(fine),
        }
    }
}

impl<'w> Field<'w> {
    fn new(world: &'w World<'w>, patches: &'w Patches, solutions: &[RadiositySolution]) -> Self {
        assert!(!solutions.is_empty(), "a view needs a solution");
        let is_exposed = |patch| solutions.iter().any(|solution| solution.is_exposed(patch));
        let exposed: Vec<bool> = patches.ids().map(is_exposed).collect();
        let display = Display::new(world, patches, &exposed, |_, _| true);
        let values = |solution: &RadiositySolution| {
            let of_patches: Vec<Rgb> = patches
                .ids()
                .map(|patch| solution.mean_irradiance(patch).0)
                .collect();
            Values {
                at_vertices: display.at_vertices(&of_patches),
                of_patches,
            }
        };
        Self {
            patches,
            solutions: solutions.iter().map(values).collect(),
            display,
        }
    }

    /// Irradiance at a vertex in W/m².
    fn at(&self, vertex: &Vertex<'_>, replicate: u32) -> Rgb {
        let interaction = &vertex.interaction;
        let point = interaction.point;
        let position = interaction.receiver.position;
        let before = position + vertex.view;
        let Some(patch) =
            self.patches
                .seen_from(before, point.triangle, || position, interaction.side)
        else {
            return Rgb::ZERO;
        };
        let values = &self.solutions[replicate as usize % self.solutions.len()];
        self.display
            .interpolate(&values.at_vertices, patch, point, position)
            .unwrap_or(values.of_patches[patch.index()])
    }
}

impl Integrator for RadiosityView<'_> {
    fn estimate(&self, rays: &[CameraRay], keys: &[SampleKey], seen: &mut [Seen]) {
        let (rays, hits) = cast(self.world, rays);
        for (((ray, hit), key), seen) in rays.iter().zip(&hits).zip(keys).zip(seen) {
            *seen = match Vertex::new(self.world, ray, hit) {
                None => background(self.world, ray).into(),
                Some(vertex) => {
                    let mut sum = Seen::from(vertex.emission().0);
                    sum += self.reflected(&vertex, key.replicate);
                    sum
                }
            };
        }
    }
}
