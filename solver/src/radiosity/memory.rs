//! What solving holds at its peak.

use super::{Class, RadiositySolution};
use crate::transport::SparseRows;
use luxel_scenes::{Irradiance, Reflectance, Rgb};

/// Memory while so many patches are solved with so many rays each, in bytes, their solution among it; `against` parents
/// ([`super::solve_against`]) or not. The mesh is not counted.
///
/// Rows are cast in parts, whose lists grow by doubling and stay with the threads that made them, and put together; then come the
/// arrays of the system: reflectance, emission, source and area of each unknown, its radiosity and irradiance.
pub fn bytes_to_solve(patches: usize, rays: usize, against: bool) -> usize {
    let unknowns = Class::COUNT * patches;
    let direct = unknowns * size_of::<Irradiance>();
    let parts = 2 * patches * rays * size_of::<u32>() + unknowns * size_of::<[u32; 2]>() + direct;
    let cast = SparseRows::bytes_for(unknowns, patches * rays) + direct;
    let system = unknowns * (size_of::<Reflectance>() + 4 * size_of::<Rgb>() + size_of::<f64>());
    // Averages over parents, and what is iterated.
    let coarsening = unknowns * (6 * size_of::<Rgb>() + size_of::<u32>());
    RadiositySolution::bytes_for(patches, against)
        + parts
        + cast
        + system
        + usize::from(against) * coarsening
}
