//! The error that patches of finite size make, from a second, coarser mesh.
//!
//! With x_h the light found with patches of size h and D = x_h − x_2h the difference from a mesh of a
//! quarter of the patches, errors that fall as h^p obey x_h − x = D / (2^p − 1) (L. F. Richardson, "The
//! approximate arithmetical solution by finite differences", 1911). The extrapolated value is not
//! used: with occlusion p is not the same everywhere, and extrapolated light was measured to be worse
//! in 12 of 15 cases. The size of D is a good measure of the size of the error all the same.
//!
//! D holds the noise of both solutions, or what is left of it when both come from the same rays. The mean square over all
//! receivers is freed of it; a single receiver's is not known well enough.

/// Error of a mesh over its difference from one of a quarter of the patches: a tuned value.
const ERROR_OVER_DIFFERENCE: f64 = 0.75;

/// Weight of a receiver's own squared difference against that of all receivers relative to their
/// light: the difference may vanish by chance where the error does not.
const OWN: f64 = 0.5;

/// Squared errors of the mesh at receivers, from their differences between meshes, each with the
/// variance of its noise, and the squares of their light (all in the unit of the light, squared).
///
/// # Panics
/// When the slices differ in length.
pub fn discretisation(differences: &[(f64, f64)], levels: &[f64]) -> Vec<f64> {
    assert_eq!(
        differences.len(),
        levels.len(),
        "one level for each difference"
    );
    let all: f64 = differences.iter().map(|(d, _)| d * d).sum();
    let noise: f64 = differences.iter().map(|(_, noise)| noise).sum();
    let level: f64 = levels.iter().sum();
    if all <= 0.0 || level <= 0.0 {
        return vec![0.0; differences.len()];
    }
    let signal = (1.0 - noise / all).max(0.0);
    let factor = ERROR_OVER_DIFFERENCE * ERROR_OVER_DIFFERENCE * signal;
    differences
        .iter()
        .zip(levels)
        .map(|((own, _), own_level)| {
            let usual = all / level * own_level;
            factor * (OWN * own * own + (1.0 - OWN) * usual)
        })
        .collect()
}
