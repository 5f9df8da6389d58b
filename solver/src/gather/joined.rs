//! Gathers of many receivers, joined in the planes that they lie in ([`crate::field`]).
//!
//! Neighbours see nearly the same light by rays of their own. What is joined is every gather's, every
//! solution's and every mesh's light alike, so that the scatters over them state what error is left; those
//! over gathers are widened by what the residuals tell of the bias. Direct light is not joined: its noise is that of
//! penumbrae alone and differs too much within a cell (joined, 1.5 times what was stated was wrong).

use super::guide::Guides;
use super::lookup::MAX_REPLICATES;
use super::tally::Tally;
use crate::field::{Cells, Field, Value, regions};
use crate::world::{Receiver, World};
use glam::DVec3;
use luxel_scenes::{Irradiance, Rgb};
use rayon::prelude::*;

/// Light by gather: mean and the variance of that of the sums of the channels, by which receivers are joined.
fn value(light: &[Rgb; MAX_REPLICATES], gathers: u8) -> Value {
    let mean = mean(light, gathers).element_sum();
    let used = &light[..usize::from(gathers).max(1)];
    let squares = used.iter().map(|x| (x.element_sum() - mean).powi(2));
    let count = used.len() as f64;
    Value {
        value: mean,
        variance: squares.sum::<f64>() / (count * (count - 1.0).max(1.0)),
    }
}

/// Light that gather rays found, a mean over the rays of each gather.
fn by_gather(tally: &Tally) -> [Rgb; MAX_REPLICATES] {
    let rays = f64::from(tally.rays.max(1));
    std::array::from_fn(|r| (tally.found[r] + tally.indirect[r]) / rays)
}

/// The cells in which light is joined, and the factor by which its scatters are to be widened.
fn cells_of(
    receivers: &[Receiver],
    tallies: &[Tally],
    regions: Option<&[u32]>,
    light: impl Fn(&Tally) -> [Rgb; MAX_REPLICATES] + Sync,
) -> (Cells, f64) {
    let values: Vec<Value> = tallies
        .par_iter()
        .map(|tally| value(&light(tally), tally.gathers))
        .collect();
    let gathers = tallies.first().map_or(0, |tally| tally.gathers);
    let cells = Cells::new(receivers, &values, regions);
    let widening = cells.widening(u32::from(gathers.max(2)) - 1);
    (cells, widening)
}

/// The mean of as many replicates as there are.
fn mean(values: &[Rgb; MAX_REPLICATES], count: u8) -> Rgb {
    let count = usize::from(count).max(1);
    values[..count].iter().sum::<Rgb>() / count as f64
}

/// Replicates farther apart, about the same mean.
fn widened(values: &[Rgb; MAX_REPLICATES], count: u8, widening: f64) -> [Rgb; MAX_REPLICATES] {
    let mean = mean(values, count);
    values.map(|value| mean + widening * (value - mean))
}

/// Columns of the light of gather rays: for each replicate light found and indirect by gather, light and
/// difference by solution; and the squares.
pub(crate) const COLUMNS: usize = 3 * (4 * MAX_REPLICATES + 1);

fn write(tally: &Tally, widening: f64, row: &mut [f64]) {
    let found = widened(&tally.found, tally.gathers, widening);
    let indirect = widened(&tally.indirect, tally.gathers, widening);
    let (rows, _) = row.as_chunks_mut::<3>();
    for r in 0..MAX_REPLICATES {
        let (by_solution, difference) = (tally.by_solution[r], tally.difference[r]);
        for (kind, value) in [found[r], indirect[r], by_solution, difference]
            .iter()
            .enumerate()
        {
            rows[4 * r + kind] = value.to_array();
        }
    }
    rows[4 * MAX_REPLICATES] = tally.squares.to_array();
}

fn read(row: &[f64], tally: &mut Tally) {
    let (rows, _) = row.as_chunks::<3>();
    for r in 0..MAX_REPLICATES {
        let value = |kind: usize| Rgb::from_array(rows[4 * r + kind]);
        if r < usize::from(tally.gathers) {
            tally.found[r] = value(0);
            tally.indirect[r] = value(1);
        }
        tally.by_solution[r] = value(2);
        tally.difference[r] = value(3);
    }
    tally.squares = Rgb::from_array(rows[4 * MAX_REPLICATES]);
}

impl Tally {
    /// Notes that the light of gather rays is that of so many receivers together: the variance of single rays,
    /// from which that of their mean is judged, becomes smaller.
    fn share(&mut self, receivers: f64) {
        self.shared = receivers;
        let count = f64::from(self.rays.max(1)) * f64::from(self.gathers.max(1));
        let sum: Rgb = self.found.iter().chain(&self.indirect).sum();
        let square_of_mean = (sum / count) * (sum / count);
        let variance = (self.squares / count - square_of_mean).max(Rgb::ZERO);
        self.squares = (square_of_mean + variance / receivers) * count;
    }
}

/// The tallies of receivers after their light was joined with that of neighbours which no wall stands before. All are of as many
/// rays, gathers and solutions.
///
/// # Panics
/// When there is not one tally for each receiver.
pub fn joined(world: &World, receivers: &[Receiver], tallies: &[Tally]) -> Vec<Tally> {
    let mut joined = tallies.to_vec();
    let regions = regions(receivers, world.bvh());
    let (cells, widening) = cells_of(receivers, tallies, Some(&regions), by_gather);
    let field = cells.join(COLUMNS, |index, row| write(&tallies[index], widening, row));
    let places = receivers.par_iter().zip(&mut joined).enumerate();
    places.for_each(|(index, (receiver, tally))| {
        let mut row = [0.0; COLUMNS];
        let shared = field.add_of(index, receiver.position, 0..COLUMNS, &mut row);
        if let Some(receivers) = shared {
            read(&row, tally);
            tally.share(receivers);
        }
    });
    joined
}

/// Indirect light at any place of the planes on which it was gathered.
pub struct IndirectField(Field);

/// Columns of a replicate: the light of a gather, how that of a solution differs from the mean, and how it
/// differs from that of a coarser mesh.
const OF_REPLICATE: usize = 9;

impl IndirectField {
    /// Memory of a field of so many receivers, and of what it is made from, in bytes.
    pub fn bytes_for(receivers: usize) -> usize {
        Cells::bytes_for(receivers, OF_REPLICATE * MAX_REPLICATES) + Guides::bytes_for(receivers)
    }

    /// Joins the light that gather rays found at receivers. Replicate r of the field is that of gather r and
    /// of solution r, so that the scatter of its replicates tells the noise of both.
    ///
    /// # Panics
    /// When there is not one tally for each receiver, or they have not [`MAX_REPLICATES`] gathers and
    /// solutions each.
    pub fn new(receivers: &[Receiver], tallies: &[Tally]) -> Self {
        for tally in tallies {
            let replicates = [tally.gathers, tally.solutions].map(usize::from);
            assert_eq!(replicates, [MAX_REPLICATES; 2], "all replicates");
        }
        let (cells, widening) = cells_of(receivers, tallies, None, by_gather);
        let columns = OF_REPLICATE * MAX_REPLICATES;
        Self(cells.join(columns, |index, row| {
            let tally = &tallies[index];
            let all_rays = f64::from(tally.rays.max(1)) * MAX_REPLICATES as f64;
            let gathered = widened(&by_gather(tally), tally.gathers, widening);
            let by_solution = tally.by_solution.map(|sum| sum / all_rays);
            let of_solutions = mean(&by_solution, tally.solutions);
            let (rows, _) = row.as_chunks_mut::<3>();
            for r in 0..MAX_REPLICATES {
                rows[3 * r] = gathered[r].to_array();
                rows[3 * r + 1] = (by_solution[r] - of_solutions).to_array();
                rows[3 * r + 2] = (tally.difference[r] / all_rays).to_array();
            }
        }))
    }

    /// Irradiance of a replicate, and how it differs from what a coarser mesh would give, in W/m²; `None` where
    /// no receivers were near. `position` and `normal` (unit) are in the unit frame.
    ///
    /// # Panics
    /// When there is no such replicate.
    #[inline]
    pub fn at(&self, position: DVec3, normal: DVec3, replicate: usize) -> Option<[Irradiance; 2]> {
        let mut row = [0.0; OF_REPLICATE];
        let first = OF_REPLICATE * replicate;
        let columns = first..first + OF_REPLICATE;
        self.0.add_at(position, normal, columns, &mut row)?;
        let (rows, _) = row.as_chunks::<3>();
        let [gathered, solution, difference] = [0, 1, 2].map(|kind| Rgb::from_array(rows[kind]));
        // Polynomials of noisy values may go below zero in the dark.
        let light = (gathered + solution).max(Rgb::ZERO);
        Some([Irradiance(light), Irradiance(difference)])
    }

    /// Standard error that the noise of gather rays leaves at receivers, each channel times the receiver's
    /// weight: root mean square over receivers and channels, in W/m² times the unit of the weights. Zero
    /// where the field is not known.
    ///
    /// # Panics
    /// When there is not one weight for each receiver.
    pub fn gather_noise(&self, receivers: &[Receiver], weights: &[Rgb]) -> f64 {
        assert_eq!(receivers.len(), weights.len(), "a weight a receiver");
        let square = |(receiver, weight): (&Receiver, &Rgb)| {
            let mut gathers = [Rgb::ZERO; MAX_REPLICATES];
            for (r, gathered) in gathers.iter_mut().enumerate() {
                let mut row = [0.0; 3];
                let first = OF_REPLICATE * r;
                let columns = first..first + row.len();
                self.0
                    .add_at(receiver.position, receiver.normal, columns, &mut row)?;
                *gathered = Rgb::from_array(row);
            }
            let mean = mean(&gathers, MAX_REPLICATES as u8);
            let squares = gathers
                .iter()
                .map(|g| (*weight * (*g - mean)).length_squared());
            Some(squares.sum::<f64>())
        };
        let squares: Vec<f64> = receivers
            .par_iter()
            .zip(weights)
            .filter_map(square)
            .collect();
        let degrees = (MAX_REPLICATES * (MAX_REPLICATES - 1)) as f64;
        let values = 3.0 * receivers.len().max(1) as f64;
        (squares.iter().sum::<f64>() / (degrees * values)).sqrt()
    }
}
