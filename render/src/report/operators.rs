//! Operators of classical radiosity: how each family estimates and stores form factors.
//!
//! Rays of a row grow along with the mesh, so that neither the noise of rows nor the size of patches stays
//! behind while the other falls: with h ∝ n^(−1/2), noise ∝ K^(−1/2) asks for K ∝ n.

use super::family::Family;
use luxel_scenes::{Irradiance, Radiosity, Rgb};
use luxel_solver::form_factors::{
    AnalyticConfig, HemicubeConfig, RayCastConfig, RayCastRowsConfig, analytic_factors,
    hemicube_factors, ray_cast, ray_cast_rows,
};
use luxel_solver::patches::Patches;
use luxel_solver::sampling::hash::mix64;
use luxel_solver::transport::{Dense, DenseError, SparseRows, Transport};
use luxel_solver::world::World;

/// Fewest rays of a row of a ray-cast matrix in each repetition; there are as many as patches.
const MATRIX_RAYS: usize = 256;

/// Fewest rays of a sparse row in each repetition; there are a quarter as many as patches.
const SPARSE_RAYS: usize = 64;

/// Points on a polygon of a pair that something may occlude: an error of about 1 % of such a form factor,
/// far below that of the mesh.
const ANALYTIC_POINTS: usize = 100;

/// Relative accuracy of pairs that nothing occludes, for the same reason.
const ANALYTIC_ACCURACY: f64 = 1e-6;

/// Pixels along an edge of a hemicube, for the same reason.
const HEMICUBE_RESOLUTION: usize = 64;

/// Patches up to which every pair is stored: 8 bytes each, and as many for standard errors.
const MAX_DENSE: usize = 4096;

/// Pairs of polygons times faces that may stand between them, up to which analytic form factors are
/// tried: about ten seconds.
const MAX_SCAN: f64 = 1e10;

/// Hemicubes, counted a thousand faces each, that are tried: about ten seconds.
const MAX_HEMICUBES: f64 = 8e4;

/// An operator as the estimator stores it.
pub(super) enum Operator {
    Dense(Dense),
    Rows(SparseRows),
}

impl Operator {
    pub(super) fn transport(&self) -> &dyn Transport {
        match self {
            Self::Dense(dense) => dense,
            Self::Rows(rows) => rows,
        }
    }
}

/// Why form factors were not computed.
#[derive(Debug, thiserror::Error)]
pub(super) enum OperatorError {
    #[error("{0} patches are too many to store every pair (at most {MAX_DENSE})")]
    TooManyPairs(usize),
    #[error("too many polygons may occlude each other ({polygons} polygons, {faces} faces)")]
    TooManyPolygons { polygons: usize, faces: usize },
    #[error(transparent)]
    Dense(#[from] DenseError),
}

/// Rays of a row in each repetition; zero where none are cast.
pub(super) fn row_rays(family: Family, patches: usize) -> usize {
    match family {
        Family::RayCast => patches.max(MATRIX_RAYS),
        Family::RayCastRows => (patches / 4).max(SPARSE_RAYS),
        _ => 0,
    }
}

/// Refuses what would take minutes at any size, because the scene has many faces.
pub(super) fn check_work(
    world: &World<'_>,
    patches: &Patches,
    family: Family,
) -> Result<(), OperatorError> {
    let n = patches.len();
    if family != Family::RayCastRows && n > MAX_DENSE {
        return Err(OperatorError::TooManyPairs(n));
    }
    let geometry = world.surfaces().geometry();
    let faces = geometry.face_count();
    let polygons = || -> usize {
        let count = |patch| patches.polygons(geometry, patch).len();
        patches.ids().map(count).sum()
    };
    let work = match family {
        Family::Analytic => (polygons() as f64).powi(2) / 2.0 * faces as f64 / MAX_SCAN,
        Family::Hemicube => {
            let origins = HemicubeConfig::balanced(HEMICUBE_RESOLUTION).origins;
            let each = 1.0 + faces as f64 / 1000.0;
            (polygons() * origins) as f64 * each / MAX_HEMICUBES
        }
        _ => 0.0,
    };
    if work > 1.0 {
        return Err(OperatorError::TooManyPolygons {
            polygons: polygons(),
            faces,
        });
    }
    Ok(())
}

/// Form factors, and the standard errors of analytic ones (row-major).
pub(super) fn operator(
    world: &World<'_>,
    patches: &Patches,
    family: Family,
    seed: u64,
    replicate: u32,
) -> Result<(Operator, Option<Vec<f64>>), OperatorError> {
    Ok(match family {
        Family::Hemicube => {
            let config = HemicubeConfig::balanced(HEMICUBE_RESOLUTION);
            let dense = hemicube_factors(world, patches, &config);
            (Operator::Dense(dense), None)
        }
        Family::RayCast => {
            let config = RayCastConfig {
                rays: row_rays(family, patches.len()),
                seed: mix64(seed ^ mix64(u64::from(replicate) + 1)),
            };
            let factors = ray_cast(world, patches, &config).factors;
            (Operator::Dense(Dense::new(patches.len(), factors)?), None)
        }
        Family::RayCastRows => {
            let config = RayCastRowsConfig {
                rays: row_rays(family, patches.len()) as u32,
                seed,
                replicate,
            };
            (Operator::Rows(ray_cast_rows(world, patches, &config)), None)
        }
        _ => {
            let config = AnalyticConfig {
                accuracy: ANALYTIC_ACCURACY,
                points: ANALYTIC_POINTS,
                seed,
            };
            let factors = analytic_factors(world, patches, &config);
            (
                Operator::Dense(factors.matrix),
                Some(factors.standard_error),
            )
        }
    })
}

/// σ(E_i) = √(Σ_j σ(F_ij)² B_j²): the first order of what errors of form factors do, without their
/// further reflections.
pub(super) fn propagated(errors: &[f64], radiosity: &[Radiosity]) -> Vec<Irradiance> {
    errors
        .chunks(radiosity.len().max(1))
        .map(|row| {
            let squares: Rgb = row
                .iter()
                .zip(radiosity)
                .map(|(&error, b)| b.0 * b.0 * (error * error))
                .sum();
            Irradiance(squares.map(f64::sqrt))
        })
        .collect()
}
