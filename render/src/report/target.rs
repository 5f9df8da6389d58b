//! What methods are compared at: irradiance at points, or radiance in the pixels of a camera.
//!
//! Radiosity on a mesh is looked up as it is, one value a patch: at a point E of the patch beneath it, in a
//! pixel the mean of L_e + ρE/π over a few fixed camera samples. Nothing is interpolated, so that
//! what is seen is the error of the solution.

use crate::camera::CameraFrame;
use crate::integrators::unit_ray;
use crate::points::Estimate;
use glam::{DVec2, DVec3};
use luxel_scenes::{Irradiance, Rgb};
use luxel_solver::bvh::{Hit, Ray};
use luxel_solver::patches::Patches;
use luxel_solver::sampling::{Sequence, Stage};
use luxel_solver::world::{Receiver, World};

/// Camera samples of a pixel through which meshes are looked up, a power of four: the edges of objects
/// are then as smooth as in the pictures of the other methods, up to a few per cent of a pixel.
const PIXEL_SAMPLES: u32 = 16;

/// Height above a surface, in units, up to which a point lies on it; above what `World::receivers`
/// corrects, far below any patch.
const ON_SURFACE: f32 = 1e-5;

/// Where a mesh is looked up, and what its irradiance is multiplied with there.
struct Lookup {
    slot: usize,
    ray: Ray,
    hit: Hit,
    /// Value per irradiance.
    factor: Rgb,
}

/// The receivers of a comparison.
pub struct Target {
    kind: Kind,
    lookups: Vec<Lookup>,
    /// Part of each value that does not depend on the method: emission and background.
    fixed: Vec<Rgb>,
    on_surface: Vec<bool>,
}

/// What a value is.
pub enum Kind {
    /// Irradiance in W/m² at points.
    Points(Vec<Receiver>),
    /// Radiance in W/(m² sr) of pixels, row by row from the top.
    Pixels(CameraFrame),
}

impl Target {
    /// Points with normals, in world space (metres). Points that lie on no surface are left out when
    /// meshes are looked up.
    pub fn points(world: &World<'_>, positions: &[DVec3], normals: &[DVec3]) -> Self {
        Self::receivers(world, world.receivers(positions, normals))
    }

    /// Receivers of the unit frame.
    pub fn receivers(world: &World<'_>, receivers: Vec<Receiver>) -> Self {
        let rays: Vec<Ray> = receivers
            .iter()
            .map(|receiver| Ray {
                origin: receiver.origin,
                tmin: 0.0,
                direction: -receiver.normal.as_vec3(),
                tmax: ON_SURFACE,
            })
            .collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        world.bvh().closest_hits(&rays, &mut hits);
        let lookups: Vec<Lookup> = rays
            .into_iter()
            .zip(hits)
            .enumerate()
            .filter(|(_, (_, hit))| hit.triangle().is_some())
            .map(|(slot, (ray, hit))| Lookup {
                slot,
                ray,
                hit,
                factor: Rgb::ONE,
            })
            .collect();
        let mut on_surface = vec![false; receivers.len()];
        for lookup in &lookups {
            on_surface[lookup.slot] = true;
        }
        Self {
            fixed: vec![Rgb::ZERO; receivers.len()],
            kind: Kind::Points(receivers),
            lookups,
            on_surface,
        }
    }

    /// The pixels of a camera.
    pub fn pixels(world: &World<'_>, frame: CameraFrame, seed: u64) -> Self {
        let [width, height] = frame.size();
        let count = width * height;
        let share = 1.0 / f64::from(PIXEL_SAMPLES);
        let mut fixed = vec![Rgb::ZERO; count];
        let mut lookups = Vec::new();
        let mut hits = vec![Hit::MISS; width];
        for row in 0..height {
            for index in 0..PIXEL_SAMPLES {
                let rays: Vec<Ray> = (0..width)
                    .map(|column| {
                        let item = (row * width + column) as u64;
                        let sequence = Sequence::new(seed, Stage::COMPARISON, item);
                        let jitter = DVec2::from_array(sequence.point2(index));
                        let corner = DVec2::new(column as f64, row as f64);
                        unit_ray(world, &frame.ray(corner + jitter))
                    })
                    .collect();
                world.bvh().closest_hits(&rays, &mut hits);
                for (column, (ray, &hit)) in rays.into_iter().zip(&hits).enumerate() {
                    let slot = row * width + column;
                    let Some(interaction) = world.interaction(&ray, &hit) else {
                        let direction = ray.direction.as_dvec3();
                        let sky = world.lights().sky(world.surfaces(), direction);
                        fixed[slot] += sky.0 * share;
                        continue;
                    };
                    let surfaces = world.surfaces();
                    if !surfaces.has_side(interaction.face, interaction.side) {
                        continue;
                    }
                    fixed[slot] += surfaces.emission(interaction.point).0 * share;
                    let white = Irradiance(Rgb::splat(share));
                    let radiosity = surfaces.reflectance(interaction.point) * white;
                    lookups.push(Lookup {
                        slot,
                        ray,
                        hit,
                        factor: radiosity.to_radiance().0,
                    });
                }
            }
        }
        Self {
            kind: Kind::Pixels(frame),
            lookups,
            fixed,
            on_surface: vec![true; count],
        }
    }

    /// Number of receivers.
    pub fn len(&self) -> usize {
        self.fixed.len()
    }

    /// True without receivers.
    pub fn is_empty(&self) -> bool {
        self.fixed.is_empty()
    }

    /// What a value is.
    pub fn kind(&self) -> &Kind {
        &self.kind
    }

    /// Whether a mesh can be looked up at each receiver.
    pub fn on_surface(&self) -> &[bool] {
        &self.on_surface
    }

    /// The values that irradiances of patches (W/m²) make.
    ///
    /// # Panics
    /// When there is not one irradiance per patch.
    pub fn values(
        &self,
        world: &World<'_>,
        patches: &Patches,
        irradiance: &[Irradiance],
    ) -> Vec<Rgb> {
        let mut values = self.fixed.clone();
        for (slot, value) in self.reflected(world, patches, irradiance) {
            values[slot] += value;
        }
        values
    }

    /// The standard errors of values that standard errors of irradiances (W/m²) make, as if all in a
    /// pixel went together.
    ///
    /// # Panics
    /// When there is not one standard error per patch.
    pub fn standard_errors(
        &self,
        world: &World<'_>,
        patches: &Patches,
        irradiance: &[Irradiance],
    ) -> Vec<Rgb> {
        let mut values = vec![Rgb::ZERO; self.len()];
        for (slot, value) in self.reflected(world, patches, irradiance) {
            values[slot] += value;
        }
        values
    }

    fn reflected<'a>(
        &'a self,
        world: &'a World<'_>,
        patches: &'a Patches,
        irradiance: &'a [Irradiance],
    ) -> impl Iterator<Item = (usize, Rgb)> + 'a {
        assert_eq!(irradiance.len(), patches.len(), "one irradiance per patch");
        self.lookups.iter().filter_map(|lookup| {
            let patch = world.patch_hit(patches, &lookup.ray, &lookup.hit)?;
            Some((lookup.slot, lookup.factor * irradiance[patch.index()].0))
        })
    }
}

/// Estimates without a standard error.
pub(super) fn exact_estimates(values: impl IntoIterator<Item = Rgb>) -> Vec<Estimate> {
    values
        .into_iter()
        .map(|value| Estimate {
            value,
            standard_error: Rgb::ZERO,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use luxel_scenes::generate::{Surface, furnace_box};
    use luxel_solver::patches::PatchSize;

    #[test]
    fn a_point_reads_its_patch_and_a_floating_one_none() {
        let scene = furnace_box(DVec3::ONE, Surface::grey(0.5, 1.0));
        let world = World::new(&scene);
        let patches = world.mesh(PatchSize::Whole).expect("six patches");
        let target = Target::points(
            &world,
            &[DVec3::new(0.5, 0.0, 0.5), DVec3::splat(0.5)],
            &[DVec3::Y, DVec3::Y],
        );
        assert_eq!(target.on_surface(), [true, false]);
        let light: Vec<_> = (0..6).map(|i| Irradiance::splat(f64::from(i))).collect();
        // Walls are in the order of `ClosedBox::WALLS`: the floor is the third.
        assert_eq!(target.values(&world, &patches, &light)[0], Rgb::splat(2.0));
    }

    #[test]
    fn a_pixel_of_the_furnace_is_emission_and_reflection() {
        let scene = furnace_box(DVec3::ONE, Surface::grey(0.5, 1.0));
        let world = World::new(&scene);
        let patches = world.mesh(PatchSize::Whole).expect("six patches");
        let frame = CameraFrame::new(&scene.cameras[0], [4, 3]).expect("a camera");
        let target = Target::pixels(&world, frame, 0);
        let light = vec![Irradiance::splat(2.0 * std::f64::consts::PI); 6];
        for value in target.values(&world, &patches, &light) {
            // L = Lₑ/(1 − ρ) = 2, summed from sixteen samples.
            assert!((value - 2.0).abs().max_element() < 1e-13, "{value}");
        }
        let errors = target.standard_errors(&world, &patches, &light);
        assert!(errors.iter().all(|e| (e - 1.0).abs().max_element() < 1e-13));
    }
}
