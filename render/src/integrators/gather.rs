//! The final gather: the default integrator.
//!
//! L = L_e + ρE/π at the first hit, with E the irradiance that [`luxel_solver::gather`] finds
//! there: direct light exact up to its sampled visibility, indirect light by rays into a coarse
//! radiosity solution. Mirrors and glass are not followed here (see [`super::whitted`]); their
//! diffuse part is shown. Every replicate of a pixel looks up a radiosity solution of its own, so
//! that the film's standard error holds the noise of the solution, too. Biased by the finite size
//! of the patches alone. Cost: rays + shadow rays for each camera sample.

use super::vertex::Vertex;
use super::{Integrator, SampleKey, background, cast};
use crate::camera::CameraRay;
use luxel_scenes::{Irradiance, Rgb};
use luxel_solver::gather::{Components, GatherConfig, Key, gather};
use luxel_solver::patches::Patches;
use luxel_solver::radiosity::RadiositySolution;
use luxel_solver::world::{Receiver, World};

/// How much is spent on a camera sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    /// Rays for indirect light, at least one.
    pub rays: usize,
    /// Shadow rays for direct light, at least one.
    pub shadow_rays: usize,
    /// Seed of all randomness.
    pub seed: u64,
}

/// Irradiance at hits, from radiosity solutions.
pub struct Gatherer<'w> {
    world: &'w World<'w>,
    patches: &'w Patches,
    solutions: &'w [RadiositySolution],
    config: Config,
}

impl<'w> Gatherer<'w> {
    /// A gatherer into `solutions` (at least one) over `patches` of `world`. Replicate r of a pixel
    /// looks up solution r, modulo their number.
    ///
    /// # Panics
    /// When there is no solution.
    pub fn new(
        world: &'w World<'w>,
        patches: &'w Patches,
        solutions: &'w [RadiositySolution],
        config: Config,
    ) -> Self {
        assert!(!solutions.is_empty(), "a gather needs a solution");
        Self {
            world,
            patches,
            solutions,
            config,
        }
    }

    /// Irradiance at each receiver in W/m². The samples of all keys belong to one replicate.
    pub(super) fn irradiance(&self, receivers: &[Receiver], keys: &[SampleKey]) -> Vec<Irradiance> {
        let Some(first) = keys.first() else {
            return Vec::new();
        };
        let keys: Vec<Key> = keys
            .iter()
            .map(|key| Key {
                item: key.item,
                index: key.index,
            })
            .collect();
        let config = GatherConfig {
            rays: self.config.rays,
            shadow_rays: self.config.shadow_rays,
            replicates: 1,
            components: Components::All,
            seed: self.config.seed,
        };
        let replicate = first.replicate as usize % self.solutions.len();
        let solution = &self.solutions[replicate..=replicate];
        gather(
            self.world,
            self.patches,
            solution,
            receivers,
            &keys,
            &config,
        )
        .into_iter()
        .map(|gathered| gathered.irradiance())
        .collect()
    }

    /// Adds ρE/π of every diffuse vertex to the value of its slot.
    pub(super) fn add_reflected(
        &self,
        vertices: &[(usize, SampleKey, Vertex<'_>)],
        values: &mut [Rgb],
    ) {
        let lit: Vec<_> = vertices
            .iter()
            .map(|(slot, key, vertex)| (*slot, *key, vertex.reflectance(), vertex.receiver()))
            .filter(|(_, _, reflectance, _)| reflectance.0.max_element() > 0.0)
            .collect();
        let receivers: Vec<Receiver> = lit.iter().map(|(.., receiver)| *receiver).collect();
        let keys: Vec<SampleKey> = lit.iter().map(|(_, key, ..)| *key).collect();
        let irradiance = self.irradiance(&receivers, &keys);
        for ((slot, _, reflectance, _), irradiance) in lit.iter().zip(irradiance) {
            values[*slot] += (*reflectance * irradiance).to_radiance().0;
        }
    }
}

impl Integrator for Gatherer<'_> {
    fn estimate(&self, rays: &[CameraRay], keys: &[SampleKey], values: &mut [Rgb]) {
        let (rays, hits) = cast(self.world, rays);
        let mut vertices = Vec::with_capacity(rays.len());
        for (slot, (ray, hit)) in rays.iter().zip(&hits).enumerate() {
            let Some(vertex) = Vertex::new(self.world, ray, hit) else {
                values[slot] = background(self.world, ray);
                continue;
            };
            values[slot] = vertex.emission().0;
            vertices.push((slot, keys[slot], vertex));
        }
        self.add_reflected(&vertices, values);
    }
}
