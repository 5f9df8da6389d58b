//! What arrives at neighbours on a plane, joined ([`crate::field`]).
//!
//! As [`crate::gather`] joins irradiance: the light of gather rays alone, all replicates alike, cells chosen by the noise of one value, here
//! the irradiance φ/4 + E/2 that degree one gives along the normal. Sources are not joined: what shadow rays leave is that of
//! penumbrae alone.

use super::estimate::widened;
use super::harmonics::irradiance;
use super::{Incident, Replicates};
use crate::field::{Cells, Value, regions};
use crate::gather::MAX_REPLICATES;
use crate::world::{Receiver, World};
use glam::Vec3;
use luxel_scenes::Rgb;
use rayon::prelude::*;

/// Numbers of one kind of light.
const fn columns(n: usize) -> usize {
    3 * n * MAX_REPLICATES
}

/// Memory while so many places are joined, in bytes.
pub(super) fn bytes_for<const N: usize>(places: usize) -> usize {
    Cells::bytes_for(places, 2 * columns(N)) + places * size_of::<Incident<N>>()
}

/// What arrives at receivers after their gathered light was joined with that of neighbours which no wall stands before. All are of as many rays.
///
/// # Panics
/// When there is not one of `incidents` for each receiver.
pub fn joined<const N: usize>(
    world: &World,
    receivers: &[Receiver],
    incidents: &[Incident<N>],
) -> Vec<Incident<N>> {
    let values: Vec<Value> = receivers
        .par_iter()
        .zip(incidents)
        .map(|(receiver, incident)| value(receiver, incident))
        .collect();
    let regions = regions(receivers, world.bvh());
    let cells = Cells::new(receivers, &values, Some(&regions));
    let widening = cells.widening(MAX_REPLICATES as u32 - 1) as f32;
    let field = cells.join(2 * columns(N), |index, row| {
        let incident = &incidents[index];
        let (gathered, difference) = row.split_at_mut(columns(N));
        write(&widened(&incident.gathered, widening), gathered);
        write(&incident.difference, difference);
    });
    let mut joined = incidents.to_vec();
    let places = receivers.par_iter().zip(&mut joined).enumerate();
    places.for_each_init(
        || vec![0.0; 2 * columns(N)],
        |row, (index, (receiver, incident))| {
            row.fill(0.0);
            if field
                .add_of(index, receiver.position, 0..2 * columns(N), row)
                .is_some()
            {
                let (gathered, difference) = row.split_at(columns(N));
                read(gathered, &mut incident.gathered);
                read(difference, &mut incident.difference);
            }
        },
    );
    joined
}

/// What cells are chosen by.
fn value<const N: usize>(receiver: &Receiver, incident: &Incident<N>) -> Value {
    let values = incident.gathered.map(|row| {
        let row: [Rgb; N] = row.map(Vec3::as_dvec3);
        // Degree two says more of where light comes from than of how much of it there is.
        let low: [Rgb; 4] = std::array::from_fn(|k| row[k]);
        irradiance(&low, receiver.normal).0.element_sum()
    });
    let count = MAX_REPLICATES as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    Value {
        value: mean,
        variance: squares / (count * (count - 1.0)),
    }
}

fn write<const N: usize>(replicates: &Replicates<N>, row: &mut [f64]) {
    let (row, _) = row.as_chunks_mut::<3>();
    for (to, from) in row.iter_mut().zip(replicates.iter().flatten()) {
        *to = from.as_dvec3().to_array();
    }
}

fn read<const N: usize>(row: &[f64], replicates: &mut Replicates<N>) {
    let (row, _) = row.as_chunks::<3>();
    for (from, to) in row.iter().zip(replicates.iter_mut().flatten()) {
        *to = Vec3::from_array(from.map(|value| value as f32));
    }
}
