//! Whitted's recursive ray tracing over a gathered or directly lit scene.
//!
//! At a hit: L = L_e + ρE/π + highlights + k_r L(reflected) + k_t L(refracted), where
//! - E comes from a [`Gatherer`] (direct and indirect), or, without one, is the direct light plus a
//!   constant ambient irradiance;
//! - a mirror has k_r = its reflectance, glass k_r = F and k_t = (1 − F) τ/η² with Fresnel's exact F
//!   (`super::specular`);
//! - glossy surfaces add, for every point, spot and directional light that is not blocked,
//!   (k_s/π) (cos α)^n E⊥ with E⊥ = I/d² the irradiance facing the light; α lies between the mirrored
//!   light and the viewer (Phong), or between the normal and the half vector (Blinn).
//!
//! The highlight has the scale of the MTL format: a factor E⊥/π is common to `Kd cos θ` and
//! `Ks (cos α)^Ns`. It is not normalised to conserve energy. Source: T. Whitted, "An improved
//! illumination model for shaded display", CACM 23(6), 1980; B. T. Phong, "Illumination for
//! computer generated pictures", CACM 18(6), 1975; J. F. Blinn, "Models of light reflection for
//! computer synthesized pictures", SIGGRAPH 1977. Validity: light that reaches a diffuse surface
//! through mirrors or glass (caustics) is missing. Rays deeper than `Config::depth`, or whose
//! weight is below `MIN_WEIGHT`, carry nothing. Rays of one depth are cast as one batch.

use super::gather::Gatherer;
use super::specular::{boundary, reflect};
use super::vertex::Vertex;
use super::{Integrator, SampleKey, Seen, background, unit_ray};
use crate::camera::CameraRay;
use glam::DVec3;
use luxel_scenes::{Irradiance, Rgb, Specular};
use luxel_solver::bvh::{Hit, Ray};
use luxel_solver::direct::{DirectSampler, Sample, ShadowRays, Source};
use luxel_solver::sampling::hash::mix64;
use luxel_solver::sampling::{Sequence, Stage};
use luxel_solver::world::{Receiver, World};

/// Weight below which a ray is not followed: a hundredth of what an 8-bit picture shows.
/// Larger, and multiple reflections in glass fade visibly; smaller costs rays for nothing.
const MIN_WEIGHT: f64 = 5e-5;

/// Which highlight glossy surfaces show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Highlight {
    /// By the mirrored light direction.
    Phong,
    /// By the half vector.
    BlinnPhong,
}

/// How far rays are followed and what they find.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// Reflections and refractions after which a ray is given up.
    pub depth: u32,
    /// Which highlight.
    pub highlight: Highlight,
    /// Irradiance in W/m² that reaches every surface without a gatherer, in place of indirect
    /// light.
    pub ambient: Irradiance,
    /// Shadow rays of a hit without a gatherer.
    pub shadow_rays: usize,
    /// Seed of all randomness.
    pub seed: u64,
}

/// The integrator.
pub struct Whitted<'w> {
    world: &'w World<'w>,
    gatherer: Option<Gatherer<'w>>,
    config: Config,
}

/// A ray that is followed for a camera sample.
struct Branch {
    slot: usize,
    ray: Ray,
    weight: Rgb,
    key: SampleKey,
}

/// A highlight that shows if its shadow ray is free.
struct Glint {
    slot: usize,
    ray: Ray,
    radiance: Rgb,
}

impl<'w> Whitted<'w> {
    /// A ray tracer in `world`. Diffuse surfaces are answered by `gatherer` where there is one.
    pub fn new(world: &'w World<'w>, gatherer: Option<Gatherer<'w>>, config: Config) -> Self {
        Self {
            world,
            gatherer,
            config,
        }
    }

    /// Shades all branches of one depth and returns those of the next.
    fn shade(&self, branches: &[Branch], seen: &mut [Seen]) -> Vec<Branch> {
        let rays: Vec<Ray> = branches.iter().map(|branch| branch.ray).collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        self.world.bvh().closest_hits(&rays, &mut hits);

        let mut next = Vec::new();
        let mut glints = Vec::new();
        let mut vertices = Vec::with_capacity(branches.len());
        for (index, (branch, hit)) in branches.iter().zip(&hits).enumerate() {
            let Some(vertex) = Vertex::new(self.world, &branch.ray, hit) else {
                seen[branch.slot] += (branch.weight * background(self.world, &branch.ray)).into();
                continue;
            };
            seen[branch.slot] += (branch.weight * vertex.emission().0).into();
            vertices.push((index, branch.key, vertex));
            split(&vertex, branch, &mut next);
            self.highlight(&vertex, branch, &mut glints);
        }
        self.add_diffuse(branches, &vertices, seen);
        self.add_glints(&glints, seen);
        next
    }

    /// Adds the light that diffuse surfaces reflect.
    fn add_diffuse(
        &self,
        branches: &[Branch],
        vertices: &[(usize, SampleKey, Vertex<'_>)],
        seen: &mut [Seen],
    ) {
        let mut reflected = vec![Seen::default(); branches.len()];
        match &self.gatherer {
            Some(gatherer) => gatherer.add_reflected(vertices, &mut reflected),
            None => self.add_direct(vertices, &mut reflected),
        }
        for (branch, reflected) in branches.iter().zip(reflected) {
            seen[branch.slot] += branch.weight * reflected;
        }
    }

    /// ρ(E^direct + ambient)/π of every vertex, into its slot.
    fn add_direct(&self, vertices: &[(usize, SampleKey, Vertex<'_>)], seen: &mut [Seen]) {
        let samples: Vec<Sample> = vertices
            .iter()
            .map(|(_, key, vertex)| {
                let Receiver {
                    position,
                    normal,
                    origin,
                } = vertex.receiver();
                Sample {
                    position,
                    normal,
                    origin,
                    sequence: Sequence::new(self.config.seed, Stage::DIRECT, key.item),
                    index: key.index,
                }
            })
            .collect();
        let mut irradiance = vec![Irradiance::ZERO; samples.len()];
        let mut sampler = DirectSampler::new(self.world.lights(), self.world.bvh());
        let shadow_rays = ShadowRays::About(self.config.shadow_rays);
        sampler.irradiance(&samples, shadow_rays, &mut irradiance);
        for ((slot, _, vertex), irradiance) in vertices.iter().zip(irradiance) {
            let reflected = vertex.reflectance() * (irradiance + self.config.ambient);
            seen[*slot] += reflected.to_radiance().0.into();
        }
    }

    /// Collects the highlights of a glossy vertex.
    fn highlight(&self, vertex: &Vertex<'_>, branch: &Branch, glints: &mut Vec<Glint>) {
        let Specular::Glossy {
            reflectance,
            exponent,
        } = vertex.specular()
        else {
            return;
        };
        let Receiver {
            position,
            origin,
            normal,
        } = vertex.receiver();
        for source in self.world.lights().sources() {
            let (towards, ray) = match source {
                Source::Polygon { .. } => continue,
                Source::Point {
                    position: light, ..
                } => {
                    let towards = (*light - position).normalize_or_zero();
                    (towards, Ray::segment(origin, light.as_vec3()))
                }
                Source::Directional { towards, .. } => {
                    (*towards, Ray::new(origin, towards.as_vec3()))
                }
            };
            if towards.dot(normal) <= 0.0 || towards.dot(vertex.normal()) <= 0.0 {
                continue;
            }
            let lobe = lobe(
                self.config.highlight,
                towards,
                vertex.view,
                normal,
                exponent,
            );
            // The irradiance on a surface that faces the light.
            let facing = Irradiance(source.irradiance(position, towards) * lobe);
            let radiance = reflectance * luxel_scenes::Radiosity(facing.0).to_radiance().0;
            if radiance.max_element() > 0.0 {
                glints.push(Glint {
                    slot: branch.slot,
                    ray,
                    radiance: branch.weight * radiance,
                });
            }
        }
    }

    fn add_glints(&self, glints: &[Glint], seen: &mut [Seen]) {
        let rays: Vec<Ray> = glints.iter().map(|glint| glint.ray).collect();
        let mut blocked = vec![false; rays.len()];
        self.world.bvh().occluded(&rays, &mut blocked);
        for (glint, blocked) in glints.iter().zip(blocked) {
            if !blocked {
                seen[glint.slot] += glint.radiance.into();
            }
        }
    }
}

/// (cos α)^n of a highlight; all vectors unit, pointing away from the surface.
fn lobe(highlight: Highlight, towards: DVec3, view: DVec3, normal: DVec3, exponent: f64) -> f64 {
    let cosine = match highlight {
        Highlight::Phong => reflect(towards, normal).dot(view),
        Highlight::BlinnPhong => (towards + view).normalize_or_zero().dot(normal),
    };
    cosine.clamp(0.0, 1.0).powf(exponent)
}

/// The rays that a mirror or glass sends on.
fn split(vertex: &Vertex<'_>, branch: &Branch, next: &mut Vec<Branch>) {
    let normal = vertex.shading_normal;
    let mut follow = |direction: DVec3, weight: Rgb, beyond: bool| {
        let weight = branch.weight * weight;
        // A shading normal may send a ray to the wrong side of the face.
        let right_side = (direction.dot(vertex.normal()) < 0.0) == beyond;
        if right_side && weight.max_element() > MIN_WEIGHT {
            next.push(Branch {
                slot: branch.slot,
                ray: vertex.ray(direction),
                weight,
                // Branches of a sample draw from sequences of their own.
                key: SampleKey {
                    item: mix64(branch.key.item ^ (1 + u64::from(beyond))),
                    ..branch.key
                },
            });
        }
    };
    match vertex.specular() {
        Specular::Mirror { reflectance } => {
            follow(reflect(vertex.view, normal), reflectance, false);
        }
        Specular::Glass {
            index_of_refraction,
            transmittance,
        } => {
            let eta = vertex.relative_index(index_of_refraction);
            let boundary = boundary(vertex.view, normal, eta);
            let reflected = reflect(vertex.view, normal);
            follow(reflected, Rgb::splat(boundary.fresnel), false);
            if let Some(direction) = boundary.refracted {
                let passed = (1.0 - boundary.fresnel) * boundary.radiance_scale;
                follow(direction, transmittance * passed, true);
            }
        }
        Specular::None | Specular::Glossy { .. } => {}
    }
}

impl Integrator for Whitted<'_> {
    fn estimate(&self, rays: &[CameraRay], keys: &[SampleKey], seen: &mut [Seen]) {
        seen.fill(Seen::default());
        let samples = rays.iter().zip(keys).enumerate();
        let mut branches: Vec<Branch> = samples
            .map(|(slot, (ray, key))| Branch {
                slot,
                ray: unit_ray(self.world, ray),
                weight: Rgb::ONE,
                key: *key,
            })
            .collect();
        for _ in 0..=self.config.depth {
            if branches.is_empty() {
                break;
            }
            branches = self.shade(&branches, seen);
        }
    }
}
