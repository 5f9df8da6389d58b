//! Light that was reflected a limited number of times, for a gather that counts reflections.
//!
//! A gather of at most N bounces reflects what it looks up once: at a hit of its own rays it wants the irradiance E_{N−1} after at most
//! N − 1 reflections, and where a near chain goes on from a hit it wants E_{N−2} at the next one, and so on. All of them come
//! from the same rows in one pass ([`solvers::neumann`]). Cost: N + 1 sweeps.

use super::{Assembly, RadiosityConfig, RadiositySolution};
use crate::bounces::Bounces;
use crate::patches::Patches;
use crate::solvers::{self, Outcome, SystemError};
use crate::world::World;
use luxel_scenes::{Irradiance, Rgb};
use std::collections::VecDeque;

/// Casts rows from every patch and adds up the light that patches receive after at most `bounces` − 1 reflections, and after up to
/// `orders` − 1 fewer: what a gather of at most `bounces` looks up.
///
/// A partial sum is exact but for rounding and the noise of the rows: `config.solver` is not used, and the error bound is zero. The
/// ledger is that of the light which a gather shows, with the reflection after `bounces`, which is left out, as its residual.
///
/// # Errors
/// As [`super::solve`].
///
/// # Panics
/// Without a bounce, or an order.
pub fn solve_partial(
    world: &World,
    patches: &Patches,
    bounces: u32,
    orders: usize,
    config: &RadiosityConfig,
) -> Result<RadiositySolution, SystemError> {
    assert!(bounces > 0 && orders > 0, "something is looked up");
    let assembly = Assembly::new(world, patches, config);
    let system = assembly.system()?;
    let wanted = orders.min(bounces as usize);
    // The newest first.
    let mut kept: VecDeque<Vec<Irradiance>> = VecDeque::new();
    let mut visited = 0;
    let solution = solvers::neumann(&system, &assembly.emission, bounces, |irradiance| {
        if visited < bounces {
            kept.truncate(wanted - 1);
            kept.push_front(assembly.with_direct(irradiance));
            visited += 1;
        }
    });
    // Where the series ended early its last sum stands for all further ones.
    let newest = (bounces - visited) as usize;
    let irradiance = (0..wanted)
        .map(|order| kept[order.saturating_sub(newest)].clone())
        .collect();
    Ok(RadiositySolution {
        irradiance,
        bounces: Bounces::AtMost(bounces - 1),
        coarsening: Vec::new(),
        coarse: Vec::new(),
        outcome: Outcome::Converged,
        iterations: solution.iterations,
        residual: solution.residual,
        error_bound: Rgb::ZERO,
        ledger: assembly.ledger(&system, &solution),
        row_rays: assembly.cast.cast_rays,
        buried_points: assembly.cast.buried_points,
        rays: assembly.cast.weights,
    })
}
