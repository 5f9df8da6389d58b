//! Irradiance volumes: probes on a grid, for what moves through a scene.
//!
//! Each probe holds spherical harmonics of the radiance that arrives from all directions ([`luxel_solver::incident`]): a surface of any
//! normal finds its irradiance by interpolating coefficients between eight probes. Probes inside solids ([`validity`]) are filled from their
//! neighbours. [`mod@grid`] says where probes stand, [`file`](mod@file) what is written.

pub mod file;
pub mod grid;
pub mod validity;

use grid::Grid;
use luxel_scenes::Rgb;
use luxel_solver::adaptive::Control;
use luxel_solver::gather::ErrorParts;
use luxel_solver::incident::estimate::{Estimate, finish};
use luxel_solver::incident::harmonics::mean_irradiance;
use luxel_solver::incident::{self, Aim, Place, until};
use luxel_solver::pilot::PilotError;
use luxel_solver::world::World;

/// Rays of either kind and replicate that are begun with at each probe.
const FIRST_RAYS: u32 = 64;

/// Probes with what arrives at them.
pub struct Volume<const N: usize> {
    /// Where they stand.
    pub grid: Grid,
    /// One for each probe, in the order of the grid; those of buried ones are their neighbours'.
    pub estimates: Vec<Estimate<N>>,
    /// Whether light was gathered there.
    pub is_valid: Vec<bool>,
    /// Relative errors of E(n) at the valid ones, root mean square over probes, normals and channels, over the mean.
    pub parts: ErrorParts,
    /// Gather rays and shadow rays of a probe.
    pub rays: [usize; 2],
}

/// Gathers at the probes of a grid, those in the open, until `control` is satisfied; `None` when it stopped before there was anything. Without a
/// probe in the open all are dark.
///
/// # Errors
/// As [`until`].
pub fn bake<const N: usize>(
    world: &World<'_>,
    grid: Grid,
    is_valid: Vec<bool>,
    aim: &Aim,
    control: &mut dyn Control,
) -> Result<Option<Volume<N>>, PilotError> {
    let frame = *world.surfaces().geometry().frame();
    let open = (0..grid.count()).filter(|&index| is_valid[index]);
    let places: Vec<Place> = open
        .map(|index| Place::in_air(frame.to_unit(grid.position(index))))
        .collect();
    let aim = Aim {
        first_rays: FIRST_RAYS,
        ..*aim
    };
    let found = until::<N>(world, &places, &aim, &|same| same, control)?;
    Ok(found.map(|found| {
        let mut gathered = finish(&found.incidents).into_iter();
        let dark = Estimate {
            coefficients: [Rgb::ZERO; N],
            standard_error: [Rgb::ZERO; N],
        };
        let mut estimates: Vec<Estimate<N>> = is_valid
            .iter()
            .map(|&valid| valid.then(|| gathered.next()).flatten().unwrap_or(dark))
            .collect();
        validity::fill(&grid, &is_valid, &mut estimates);
        Volume {
            grid,
            estimates,
            is_valid,
            parts: found.parts,
            rays: found.rays,
        }
    }))
}

impl<const N: usize> Volume<N> {
    /// The mean over valid probes of E(n), over all normals, in W/m² (lx).
    pub fn mean_irradiance(&self) -> Rgb {
        let valid = self.estimates.iter().zip(&self.is_valid);
        let valid = valid.filter(|(_, valid)| **valid);
        let sum: Rgb = valid
            .clone()
            .map(|(estimate, _)| mean_irradiance(&estimate.coefficients).0)
            .sum();
        sum / valid.count().max(1) as f64
    }
}

/// Memory while so many probes are gathered and written, in bytes.
pub fn bytes_to_bake<const N: usize>(probes: usize) -> usize {
    let written = 2 * 3 * N * size_of::<f32>();
    incident::bytes_to_gather::<N>(probes, false) + probes * (size_of::<Estimate<N>>() + written)
}
