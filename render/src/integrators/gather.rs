//! The final gather: the default integrator.
//!
//! L = L_e + ρE/π at the first hit, with E the irradiance that [`luxel_solver::gather`] finds
//! there: direct light exact up to its sampled visibility, indirect light by rays into a coarse
//! radiosity solution, or from a field of it ([`IndirectField`]) where one is known. Mirrors and glass are not followed here (see [`super::whitted`]); their
//! diffuse part is shown. Every replicate of a pixel looks up a radiosity solution of its own, so
//! that the film's standard error holds the noise of the solution, too. Biased by the finite size
//! of the patches, and of the polynomials of a field, whose noise is stated the wider for it. Cost: rays + shadow
//! rays for each camera sample, shadow rays alone where there is a field.

use super::vertex::Vertex;
use super::{Integrator, SampleKey, Seen, background, cast};
use crate::camera::CameraRay;
use luxel_solver::gather::{
    Components, GatherConfig, IndirectField, Key, Lookup, SkyRays, Solutions, Tally, gather,
};
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

/// Where the indirect light at a hit comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum IndirectLight {
    /// Gather rays of its own.
    Gathered,
    /// A field.
    Known,
}

/// Irradiance at hits, from radiosity solutions.
pub struct Gatherer<'w> {
    world: &'w World<'w>,
    /// `None` where direct light is all that counts.
    lookup: Option<&'w Lookup>,
    field: Option<&'w IndirectField>,
    config: Config,
}

impl<'w> Gatherer<'w> {
    /// A gatherer into what `lookup` holds of `world`. Replicate r of a pixel looks up solution r,
    /// modulo their number.
    pub fn new(world: &'w World<'w>, lookup: &'w Lookup, config: Config) -> Self {
        Self {
            world,
            lookup: Some(lookup),
            field: None,
            config,
        }
    }

    /// A gatherer of direct light alone.
    pub fn of_direct_light(world: &'w World<'w>, config: Config) -> Self {
        Self {
            world,
            lookup: None,
            field: None,
            config,
        }
    }

    /// Takes indirect light from a field where it knows it.
    #[must_use]
    pub fn with_field(mut self, field: &'w IndirectField) -> Self {
        self.field = Some(field);
        self
    }

    /// Mean radiance along some camera rays and over the channels, roughly.
    pub(crate) fn level(&self, rays: &[CameraRay]) -> f64 {
        let key = |item| SampleKey {
            item,
            replicate: 0,
            index: 0,
        };
        let keys: Vec<SampleKey> = (0..rays.len() as u64).map(key).collect();
        let mut seen = vec![Seen::default(); rays.len()];
        self.estimate(rays, &keys, &mut seen);
        let sum: f64 = seen.iter().map(|seen| seen.value.element_sum()).sum();
        sum / (3.0 * rays.len().max(1) as f64)
    }

    /// The solution that a sample looks up, by its position.
    fn solution(&self, key: &SampleKey) -> usize {
        let solutions = self.lookup.map_or(1, Lookup::solutions);
        key.replicate as usize % solutions
    }

    /// What is gathered at each receiver. The samples of all keys belong to one replicate.
    fn gather(
        &self,
        receivers: &[Receiver],
        keys: &[SampleKey],
        indirect: IndirectLight,
    ) -> Vec<Tally> {
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
            rays: match indirect {
                IndirectLight::Gathered => self.config.rays,
                IndirectLight::Known => 0,
            },
            rays_before: 0,
            shadow_rays: self.config.shadow_rays,
            sky: SkyRays::Gather,
            gathers: 1,
            solutions: Solutions::One(self.solution(first)),
            components: match self.lookup {
                Some(_) => Components::All,
                None => Components::Direct,
            },
            seed: self.config.seed,
        };
        gather(self.world, self.lookup, receivers, &keys, &config)
    }

    /// Adds ρE/π of every diffuse vertex to what its slot sees. All samples belong to one replicate.
    pub(super) fn add_reflected(
        &self,
        vertices: &[(usize, SampleKey, Vertex<'_>)],
        seen: &mut [Seen],
    ) {
        let mut gathered = Vec::new();
        let mut known = Vec::new();
        for (slot, key, vertex) in vertices {
            let reflectance = vertex.reflectance();
            if reflectance.0.max_element() <= 0.0 {
                continue;
            }
            let receiver = vertex.receiver();
            let lit = (*slot, *key, reflectance, receiver);
            let replicate = self.solution(key);
            let field = self
                .field
                .and_then(|field| field.at(receiver.position, receiver.normal, replicate));
            let Some([irradiance, difference]) = field else {
                gathered.push(lit);
                continue;
            };
            let radiance = |irradiance| (reflectance * irradiance).to_radiance().0;
            seen[*slot] += Seen {
                value: radiance(irradiance),
                mesh_difference: radiance(difference),
            };
            known.push(lit);
        }
        for (lit, indirect) in [
            (gathered, IndirectLight::Gathered),
            (known, IndirectLight::Known),
        ] {
            let receivers: Vec<Receiver> = lit.iter().map(|(.., receiver)| *receiver).collect();
            let keys: Vec<SampleKey> = lit.iter().map(|(_, key, ..)| *key).collect();
            let tallies = self.gather(&receivers, &keys, indirect);
            for ((slot, _, reflectance, _), tally) in lit.iter().zip(tallies) {
                let radiance = |irradiance| (*reflectance * irradiance).to_radiance().0;
                seen[*slot] += Seen {
                    value: radiance(tally.irradiance()),
                    mesh_difference: radiance(tally.mesh_difference()),
                };
            }
        }
    }
}

impl Integrator for Gatherer<'_> {
    fn estimate(&self, rays: &[CameraRay], keys: &[SampleKey], seen: &mut [Seen]) {
        let (rays, hits) = cast(self.world, rays);
        let mut vertices = Vec::with_capacity(rays.len());
        for (slot, (ray, hit)) in rays.iter().zip(&hits).enumerate() {
            let Some(vertex) = Vertex::new(self.world, ray, hit) else {
                seen[slot] = background(self.world, ray).into();
                continue;
            };
            seen[slot] = vertex.emission().0.into();
            vertices.push((slot, keys[slot], vertex));
        }
        self.add_reflected(&vertices, seen);
    }
}
