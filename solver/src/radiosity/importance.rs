//! What light on a patch means to some receivers: the adjoint of the radiosity system.
//!
//! Receivers that gather B with weights R (R_j is the share of their rays that meet unknown j) are
//! lit by R·B = R·(I − ρF)⁻¹ S. The same number is Ψ·E with the importance
//!
//!   Ψ_i = ρ_i (R_i + Σ_k Ψ_k F_ki),
//!
//! so that an error δ of the light on patch i, from noise or from the size of a patch, becomes Ψ_i δ at the
//! receivers. Solved by Jacobi's iteration with the rows turned round.
//!
//! Source: B. E. Smits, J. R. Arvo, D. H. Salesin, "An importance-driven radiosity algorithm",
//! SIGGRAPH 1992. Valid for ‖ρF‖ < 1; the mean over the channels stands for ρ. As noisy as the rows: good to tell where
//! patches and rays are due, not to correct a result. Cost: a ray an entry of R, and a gather a sweep.

use super::{Assembly, Class, RadiosityConfig, unknown};
use crate::bvh::{Hit, Ray};
use crate::patches::Patches;
use crate::sampling::{self, Sequence, Stage, cosine_hemisphere};
use crate::solvers::{self, SystemError};
use crate::transport::{SparseRows, Transport};
use crate::world::{Receiver, World};
use luxel_scenes::Rgb;

/// Rays of a receiver that tell what it sees, at least, and those of all together.
const RAYS: usize = 64;
const ALL_RAYS: usize = 1 << 13;

/// What a further sweep must add to the importance to be worth one.
const TOLERANCE: f64 = 0.01;

/// Sweeps after which what is missing is small or lies in mirrors of reflectance near one, where it is spread evenly.
const MAX_SWEEPS: usize = 100;

/// What a patch gets and what that means, in sums over the channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Flow {
    /// Irradiance, direct light included, in W/m².
    pub(crate) irradiance: f64,
    /// Standard deviation of what single rays of its row find, in W/m².
    pub(crate) scatter: f64,
    /// Importance per area, in any unit.
    pub(crate) importance: f64,
}

/// Solves for the light on all patches and for its importance to some receivers: one an area where there are none.
///
/// # Errors
/// As [`super::solve`].
pub(crate) fn flow(
    world: &World,
    patches: &Patches,
    receivers: &[Receiver],
    config: &RadiosityConfig,
) -> Result<Vec<Flow>, SystemError> {
    let assembly = Assembly::new(world, patches, config);
    let system = assembly.system()?;
    let solution = solvers::jacobi(&system, &config.solver, solvers::no_progress);
    let rows = &assembly.cast.rows;
    let reflectance: Vec<f64> = assembly.reflectance.iter().map(|rho| mean(rho.0)).collect();
    let seen = seen(world, patches, receivers, config);
    let importance = importance(rows, &reflectance, &seen);
    let flow_of = |patch| {
        let unknowns = Class::all().map(|class| unknown(patch, class));
        let weights = unknowns.map(|u| f64::from(assembly.cast.weights[u]));
        let total = weights.iter().sum::<f64>().max(1.0);
        let (mut irradiance, mut found, mut squares) = (0.0, 0.0, 0.0);
        for (u, weight) in unknowns.into_iter().zip(weights) {
            let weight = weight / total;
            let light = solution.irradiance[u] + assembly.cast.direct[u];
            irradiance += weight * light.0.element_sum();
            rows.visit_row(u, &mut |met, share| {
                let radiosity = solution.radiosity[met].0.element_sum();
                found += weight * share * radiosity;
                squares += weight * share * radiosity * radiosity;
            });
        }
        let own: f64 = unknowns.iter().map(|&u| importance[u]).sum();
        Flow {
            irradiance,
            scatter: (squares - found * found).max(0.0).sqrt(),
            importance: if receivers.is_empty() {
                1.0
            } else {
                own / patches.areas()[patch.index()]
            },
        }
    };
    Ok(patches.ids().map(flow_of).collect())
}

/// Of the channels.
fn mean(value: Rgb) -> f64 {
    value.element_sum() / 3.0
}

/// Rays of the receivers that meet each unknown.
fn seen(
    world: &World,
    patches: &Patches,
    receivers: &[Receiver],
    config: &RadiosityConfig,
) -> Vec<f64> {
    let each = RAYS.max(ALL_RAYS / receivers.len().max(1));
    let mut rays = Vec::with_capacity(receivers.len() * each);
    for (index, receiver) in receivers.iter().enumerate() {
        let item = (config.replicate << 32) | index as u64;
        let sequence = Sequence::new(config.seed, Stage::GATHER, item);
        let frame = sampling::Frame::around(receiver.normal.as_vec3());
        rays.extend((0..each as u32).map(|ray| {
            let local = cosine_hemisphere::sample(sequence.point2_f32(ray));
            Ray::new(receiver.origin, frame.to_world(local))
        }));
    }
    let mut hits = vec![Hit::MISS; rays.len()];
    world.bvh().closest_hits(&rays, &mut hits);
    let mut seen = vec![0.0; patches.len() * Class::COUNT];
    for (ray, hit) in rays.iter().zip(&hits) {
        if let Some(patch) = world.patch_hit(patches, ray, hit) {
            seen[unknown(patch, Class::at(hit.t, patches.size(patch)))] += 1.0;
        }
    }
    seen
}

/// The importance of the light on each unknown, from that of its radiosity to the receivers alone.
fn importance(rows: &SparseRows, reflectance: &[f64], seen: &[f64]) -> Vec<f64> {
    let of_light = |of_radiosity: &[f64]| -> Vec<f64> {
        let both = of_radiosity.iter().zip(reflectance);
        both.map(|(y, rho)| y * rho).collect()
    };
    let mut importance = of_light(seen);
    for _ in 0..MAX_SWEEPS {
        let mut of_radiosity = seen.to_vec();
        for (row, &own) in importance.iter().enumerate() {
            if own > 0.0 {
                rows.visit_row(row, &mut |met, share| of_radiosity[met] += own * share);
            }
        }
        let next = of_light(&of_radiosity);
        let [before, after] = [&importance, &next].map(|values| values.iter().sum::<f64>());
        importance = next;
        if after - before <= TOLERANCE * after {
            break;
        }
    }
    importance
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patches::PatchSize;
    use crate::solvers::{Config, Tolerance};
    use glam::DVec3;
    use luxel_scenes::{Reflectance, generate};

    fn config(rays: usize) -> RadiosityConfig {
        RadiosityConfig {
            rays,
            shadow_rays: 1,
            solver: Config {
                tolerance: Tolerance::Error(1e-9),
                max_iterations: 1000,
            },
            seed: 5,
            replicate: 0,
        }
    }

    /// Ψ·E^direct = R·B − R·S': both sides are the reflected light that the receivers gather, the one carried from the
    /// lights, the other from the receivers. With the same rows they are the same but for rounding, what the
    /// sweeps leave (1 % of the last, a geometric series of ratio below one half here) and the mean ρ of the
    /// channels; the box is grey for that.
    #[test]
    fn light_and_importance_meet_in_the_same_number() {
        let mut scene = generate::cornell_box();
        for material in &mut scene.materials {
            material.reflectance = Reflectance::splat(0.5);
        }
        let world = World::new(&scene);
        let patches = world.mesh(PatchSize::Count(200)).expect("meshes");
        let config = config(32);
        let positions: Vec<DVec3> = (1..9)
            .map(|i| DVec3::new(0.05 * f64::from(i), 0.0, 0.2))
            .collect();
        let receivers = world.receivers(&positions, &vec![DVec3::Y; positions.len()]);
        let assembly = Assembly::new(&world, &patches, &config);
        let system = assembly.system().expect("a valid system");
        let solution = solvers::jacobi(&system, &config.solver, solvers::no_progress);
        let reflectance: Vec<f64> = assembly.reflectance.iter().map(|rho| mean(rho.0)).collect();
        let seen = seen(&world, &patches, &receivers, &config);
        let importance = importance(&assembly.cast.rows, &reflectance, &seen);
        let of = |values: &[f64], light: &dyn Fn(usize) -> f64| -> f64 {
            values
                .iter()
                .enumerate()
                .map(|(u, value)| value * light(u))
                .sum()
        };
        let carried = of(&seen, &|u| solution.radiosity[u].0.x);
        let meant = of(&importance, &|u| assembly.cast.direct[u].0.x);
        assert!(carried > 0.0);
        assert!(
            (meant / carried - 1.0).abs() < 0.02,
            "{meant} and {carried}"
        );
    }
}
