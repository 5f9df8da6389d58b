//! The path tracer: the unbiased reference that every other method is held against.
//!
//! L(x, ω) = L_e + Σ over paths, by Monte Carlo: at every diffuse vertex one connection to a light
//! (the next event) and one direction by the cosine; mirrors and glass continue in their own
//! direction, chosen by chance with their share of the energy. From the `ROULETTE_FROM`-th bounce
//! a path survives with a probability q ≤ `MAX_SURVIVAL` and is weighted by 1/q. Emission that
//! connections find too (the polygons of [`luxel_solver::direct::Lights`]) is shared out by the
//! balance heuristic (multiple importance sampling) where a diffuse vertex could have connected to
//! it, and counts in full from the camera and after a mirror or glass; every other emission and the
//! sky are found by the paths themselves. The backs of one-sided faces are black.
//!
//! Where reflections are limited ([`Bounces`]) a path ends when it has used them up. They are counted from the source to the first
//! diffuse surface that the eye sees, or to the receiver: the reflection there is not one of them, nor are mirrors and glass
//! before it.
//!
//! Source: J. T. Kajiya, "The rendering equation", SIGGRAPH 1986; J. Arvo, D. Kirk, "Particle
//! transport and image synthesis", SIGGRAPH 1990 (roulette). Unbiased; variance falls as 1/n, or a
//! little faster for even samples. Glossy highlights are not light transport and are left out.
//! Paths of a batch advance together, one ray batch and one shadow batch a bounce. Cost: two rays
//! a bounce.

use super::next_event::{connect, density, weight};
use super::specular::{boundary, reflect};
use super::vertex::Vertex;
use super::{Integrator, SampleKey, Seen, background, unit_ray};
use crate::camera::CameraRay;
use crate::film::{Due, Film};
use crate::progress::Progress;
use glam::DVec3;
use luxel_scenes::{Radiance, Rgb, Specular};
use luxel_solver::bounces::Bounces;
use luxel_solver::bvh::{Hit, Ray};
use luxel_solver::gather::Components;
use luxel_solver::sampling::{Frame, Sequence, Stage, cosine_hemisphere};
use luxel_solver::world::{Receiver, World};

/// Bounce from which roulette ends paths. Earlier, and the second reflection of rooms is noisy;
/// later, and dark scenes pay for bounces that carry nothing.
const ROULETTE_FROM: u32 = 3;

/// Highest probability of survival: even a path between perfect mirrors ends, after 1/(1 − q) =
/// 20 bounces on average. Nearer to 1, and one such path holds up its batch.
const MAX_SURVIVAL: f64 = 0.95;

/// The integrator.
pub struct PathTracer<'w> {
    world: &'w World<'w>,
    bounces: Bounces,
    seed: u64,
}

/// A path on its way.
struct Path {
    /// Index of its result.
    slot: u32,
    ray: Ray,
    throughput: Rgb,
    sequence: Sequence,
    index: u32,
    bounce: u32,
    /// How often light may be reflected before it comes along the ray; `None` before the first diffuse surface, where
    /// nothing is counted.
    left: Option<Bounces>,
    /// The diffuse vertex that the ray leaves, whose connections may find a source as well; `None`
    /// for the camera, mirrors and glass.
    connected_from: Option<Receiver>,
}

/// A connection to a light, not yet tested for blockers.
struct Pending {
    slot: u32,
    radiance: Rgb,
}

/// Buffers of a batch.
#[derive(Default)]
struct Wave {
    paths: Vec<Path>,
    next: Vec<Path>,
    rays: Vec<Ray>,
    hits: Vec<Hit>,
    shadow_rays: Vec<Ray>,
    pending: Vec<Pending>,
    blocked: Vec<bool>,
    sums: Vec<f64>,
}

impl<'w> PathTracer<'w> {
    /// A path tracer in `world`. All randomness follows from `seed` and the keys of samples.
    pub fn new(world: &'w World<'w>, seed: u64) -> Self {
        Self {
            world,
            bounces: Bounces::All,
            seed,
        }
    }

    /// Light of such bounces alone.
    #[must_use]
    pub fn with_bounces(mut self, bounces: Bounces) -> Self {
        self.bounces = bounces;
        self
    }

    /// Adds estimates of the irradiance at receivers in W/m², of the given components, to a film of
    /// one row: `paths` for each replicate of every receiver. Unbiased. Progress counts paths.
    ///
    /// # Panics
    /// When the film has not one pixel for each receiver, or `paths` not one number.
    pub fn irradiance(
        &self,
        film: &mut Film,
        receivers: &[Receiver],
        components: Components,
        paths: &[u32],
        progress: &dyn Progress,
    ) {
        assert_eq!(film.size(), [receivers.len(), 1], "a pixel a receiver");
        progress.start("tracing paths", film.cost(paths));
        film.expose(paths, |due, seen| {
            let mut wave = Wave::default();
            let mut sums = vec![Rgb::ZERO; due.len()];
            self.gather(&mut wave, receivers, due, components, &mut sums);
            for (seen, sum) in seen.iter_mut().zip(sums) {
                // The receivers reflected everything, so that L = E/π left them.
                *seen = Radiance(sum).to_irradiance().0.into();
            }
            progress.advance(due.len() as u64);
        });
        progress.finish();
    }

    /// Adds the radiance that perfectly white receivers reflect, one path for each that is due.
    fn gather(
        &self,
        wave: &mut Wave,
        receivers: &[Receiver],
        due: &[Due],
        components: Components,
        sums: &mut [Rgb],
    ) {
        for (slot, due) in due.iter().enumerate() {
            let receiver = &receivers[due.pixel];
            let SampleKey { item, index, .. } = due.key;
            let path = Path {
                slot: slot as u32,
                ray: Ray::new(receiver.origin, receiver.normal.as_vec3()),
                throughput: Rgb::ONE,
                sequence: Sequence::new(self.seed, Stage::PATH, item),
                index,
                bounce: 0,
                left: Some(self.bounces),
                connected_from: Some(*receiver),
            };
            let numbers = Numbers::draw(&path);
            if components != Components::Indirect {
                self.connect(wave, &path, receiver, receiver.normal, Rgb::ONE, &numbers);
            }
            let direction = cosine_direction(receiver.normal, numbers.direction);
            wave.paths.push(Path {
                ray: Ray::new(receiver.origin, direction.as_vec3()),
                bounce: 1,
                ..path
            });
        }
        self.resolve(wave, sums);
        if components == Components::Direct {
            self.advance(wave, sums, true, false);
        } else {
            self.advance(wave, sums, components == Components::All, true);
            self.run(wave, sums);
        }
    }

    /// Follows paths until none is left.
    fn run(&self, wave: &mut Wave, sums: &mut [Rgb]) {
        while !wave.paths.is_empty() {
            self.advance(wave, sums, true, true);
        }
    }

    /// Moves every path on by one vertex: emission there when `emission`, reflection when
    /// `scatter`.
    fn advance(&self, wave: &mut Wave, sums: &mut [Rgb], emission: bool, scatter: bool) {
        wave.rays.clear();
        wave.rays.extend(wave.paths.iter().map(|path| path.ray));
        wave.hits.clear();
        wave.hits.resize(wave.rays.len(), Hit::MISS);
        self.world.bvh().closest_hits(&wave.rays, &mut wave.hits);
        wave.shadow_rays.clear();
        wave.pending.clear();
        wave.next.clear();
        let paths = std::mem::take(&mut wave.paths);
        let hits = std::mem::take(&mut wave.hits);
        for (path, hit) in paths.iter().zip(&hits) {
            let sum = &mut sums[path.slot as usize];
            let Some(vertex) = Vertex::new(self.world, &path.ray, hit) else {
                if emission {
                    *sum += path.throughput * background(self.world, &path.ray);
                }
                continue;
            };
            let emitted = vertex.emission().0;
            if emission && emitted != Rgb::ZERO {
                *sum += path.throughput * emitted * self.path_share(path, &vertex);
            }
            if scatter {
                self.scatter(wave, path, &vertex);
            }
        }
        wave.hits = hits;
        wave.paths = paths;
        std::mem::swap(&mut wave.paths, &mut wave.next);
        self.resolve(wave, sums);
    }

    /// The share of a vertex's emission that belongs to the path which met it, not to the connections
    /// of the vertex before.
    fn path_share(&self, path: &Path, vertex: &Vertex<'_>) -> f64 {
        let lights = self.world.lights();
        let interaction = &vertex.interaction;
        let source = lights.source_of(interaction.face, interaction.side);
        let (Some(receiver), Some(source)) = (&path.connected_from, source) else {
            return 1.0;
        };
        let direction = path.ray.direction.as_dvec3();
        let density = density(self.world, receiver, source, direction);
        1.0 - weight(receiver, direction, density)
    }

    /// Casts the pending connections and adds the light of those that nothing blocks.
    fn resolve(&self, wave: &mut Wave, sums: &mut [Rgb]) {
        wave.blocked.clear();
        wave.blocked.resize(wave.shadow_rays.len(), false);
        self.world
            .bvh()
            .occluded(&wave.shadow_rays, &mut wave.blocked);
        for (pending, &blocked) in wave.pending.iter().zip(&wave.blocked) {
            if !blocked {
                sums[pending.slot as usize] += pending.radiance;
            }
        }
    }

    /// Reflects a path: a connection to a light and the next ray.
    fn scatter(&self, wave: &mut Wave, path: &Path, vertex: &Vertex<'_>) {
        // What light that this vertex reflects may have undergone before.
        let left = match path.left.map(Bounces::before_reflection) {
            None => None,
            Some(Some(left)) => Some(left),
            Some(None) => return,
        };
        let albedo = vertex.reflectance().0;
        let specular = vertex.specular();
        let numbers = Numbers::draw(path);
        if albedo.max_element() > 0.0 {
            let receiver = vertex.receiver();
            self.connect(wave, path, &receiver, vertex.normal(), albedo, &numbers);
        }
        let diffuse_weight = albedo.max_element();
        let specular_weight = match specular {
            Specular::Mirror { reflectance } => reflectance.max_element(),
            Specular::Glass { .. } => 1.0,
            Specular::None | Specular::Glossy { .. } => 0.0,
        };
        let total = diffuse_weight + specular_weight;
        if total <= 0.0 {
            return;
        }
        let diffuse_share = diffuse_weight / total;
        let (direction, weight, connected_from, left) = if numbers.lobe < diffuse_share {
            let direction = cosine_direction(vertex.shading_normal, numbers.direction);
            if direction.dot(vertex.normal()) <= 0.0 {
                // Below the face, which only a shading normal can ask for: blocked by the face.
                return;
            }
            let receiver = Some(vertex.receiver());
            // The first diffuse surface: from here on it counts.
            let left = left.or(Some(self.bounces));
            (direction, albedo / diffuse_share, receiver, left)
        } else {
            // What is left of the number chooses between reflection and refraction.
            let choice = (numbers.lobe - diffuse_share) / (1.0 - diffuse_share);
            let Some((direction, weight)) = scatter_specular(vertex, specular, choice) else {
                return;
            };
            (direction, weight / (1.0 - diffuse_share), None, left)
        };
        let mut throughput = path.throughput * weight;
        if path.bounce >= ROULETTE_FROM {
            let survival = throughput.max_element().min(MAX_SURVIVAL);
            if numbers.survival >= survival {
                return;
            }
            throughput /= survival;
        }
        if throughput.max_element() > 0.0 {
            wave.next.push(Path {
                slot: path.slot,
                ray: vertex.ray(direction),
                throughput,
                sequence: path.sequence,
                index: path.index,
                bounce: path.bounce + 1,
                left,
                connected_from,
            });
        }
    }

    /// Adds a connection from a receiver of the given albedo to a light.
    fn connect(
        &self,
        wave: &mut Wave,
        path: &Path,
        receiver: &Receiver,
        face_normal: DVec3,
        albedo: Rgb,
        numbers: &Numbers,
    ) {
        let Some(connection) = connect(
            self.world,
            receiver,
            face_normal,
            numbers.light,
            numbers.position,
            &mut wave.sums,
        ) else {
            return;
        };
        let share = connection.density.map_or(1.0, |(direction, density)| {
            weight(receiver, direction, density)
        });
        let irradiance = connection.irradiance * share;
        let reflected = luxel_scenes::Radiosity(albedo * irradiance).to_radiance();
        wave.shadow_rays.push(connection.ray);
        wave.pending.push(Pending {
            slot: path.slot,
            radiance: path.throughput * reflected.0,
        });
    }
}

impl Integrator for PathTracer<'_> {
    fn estimate(&self, rays: &[CameraRay], keys: &[SampleKey], seen: &mut [Seen]) {
        let mut values = vec![Rgb::ZERO; rays.len()];
        let mut wave = Wave::default();
        let keyed = rays.iter().zip(keys).enumerate();
        wave.paths.extend(keyed.map(|(slot, (ray, key))| Path {
            slot: slot as u32,
            ray: unit_ray(self.world, ray),
            throughput: Rgb::ONE,
            sequence: Sequence::new(self.seed, Stage::PATH, key.item),
            index: key.index,
            bounce: 0,
            left: None,
            connected_from: None,
        }));
        self.run(&mut wave, &mut values);
        for (seen, value) in seen.iter_mut().zip(values) {
            *seen = value.into();
        }
    }
}

/// The random numbers of one vertex, uniform in [0, 1).
struct Numbers {
    /// A point on a light.
    position: [f64; 2],
    /// A direction.
    direction: [f32; 2],
    /// Which light.
    light: f64,
    /// Which kind of reflection.
    lobe: f64,
    /// Whether the path goes on.
    survival: f64,
}

impl Numbers {
    /// The numbers of the path's next vertex: dimensions of its own for each bounce.
    fn draw(path: &Path) -> Self {
        let places = path.sequence.dimension_set(2 * path.bounce);
        let choices = path.sequence.dimension_set(2 * path.bounce + 1);
        let [x, y, _, _] = places.point4(path.index);
        let [_, _, u, v] = places.point4_f32(path.index);
        let [light, lobe, survival, _] = choices.point4(path.index);
        Self {
            position: [x, y],
            direction: [u, v],
            light,
            lobe,
            survival,
        }
    }
}

/// A direction by the cosine about a unit normal.
fn cosine_direction(normal: DVec3, u: [f32; 2]) -> DVec3 {
    let local = cosine_hemisphere::sample(u);
    let frame = Frame::around(normal.as_vec3());
    frame.to_world(local).as_dvec3().normalize()
}

/// The direction in which mirror or glass continue, and the weight of the radiance from there.
/// `choice` is uniform in [0, 1).
fn scatter_specular(vertex: &Vertex<'_>, specular: Specular, choice: f64) -> Option<(DVec3, Rgb)> {
    let normal = vertex.shading_normal;
    match specular {
        Specular::Mirror { reflectance } => {
            let direction = reflect(vertex.view, normal);
            (direction.dot(vertex.normal()) > 0.0).then_some((direction, reflectance))
        }
        Specular::Glass {
            index_of_refraction,
            transmittance,
        } => {
            let eta = vertex.relative_index(index_of_refraction);
            let boundary = boundary(vertex.view, normal, eta);
            if choice < boundary.fresnel {
                let direction = reflect(vertex.view, normal);
                (direction.dot(vertex.normal()) > 0.0).then_some((direction, Rgb::ONE))
            } else {
                let direction = boundary.refracted?;
                (direction.dot(vertex.normal()) < 0.0)
                    .then_some((direction, transmittance * boundary.radiance_scale))
            }
        }
        Specular::None | Specular::Glossy { .. } => None,
    }
}
