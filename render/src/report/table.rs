//! The measurements as CSV, and the whole study as JSON.

use super::family::Family;
use super::order::{self, Fit, NotAsymptotic, Richardson};
use super::study::{FamilyResult, Quantity, Row, Study};
use serde_json::{Value, json};

/// The columns of the CSV table.
const COLUMNS: [&str; 22] = [
    "method",
    "solver",
    "step",
    "patches",
    "rays",
    "iterations",
    "seconds",
    "solver_seconds",
    "nrmse",
    "rel_rmse",
    "bias",
    "p95",
    "resolved",
    "stated",
    "stated_solver",
    "stated_sampling",
    "stated_discretisation",
    "within_two",
    "mean",
    "reference_mean",
    "reference_noise",
    "seed",
];

/// Every measurement as one line of CSV. Errors are ratios; numbers read back to the same bits.
///
/// # Errors
/// Never in practice: the writer's target is memory.
pub fn to_csv(study: &Study) -> Result<Vec<u8>, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(COLUMNS)?;
    for row in rows(study) {
        writer.write_record(fields(study, row))?;
    }
    Ok(writer
        .into_inner()
        .map_err(csv::IntoInnerError::into_error)?)
}

/// All rows, family by family.
pub fn rows(study: &Study) -> impl Iterator<Item = &Row> {
    study.families.iter().flat_map(|family| &family.rows)
}

fn fields(study: &Study, row: &Row) -> [String; 22] {
    let text = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
    let stated = row.stated;
    [
        row.family.name().to_owned(),
        row.solver.map_or(String::new(), |s| s.name().to_owned()),
        row.step.to_string(),
        row.patches.map_or(String::new(), |n| n.to_string()),
        row.rays.map_or(String::new(), |n| n.to_string()),
        row.iterations.map_or(String::new(), |n| n.to_string()),
        row.seconds.to_string(),
        text(row.solver_seconds),
        row.error.nrmse.to_string(),
        row.error.rel_rmse.to_string(),
        row.error.bias.to_string(),
        row.error.p95.to_string(),
        row.error.is_resolved.to_string(),
        text(row.stated_total()),
        stated.solver.to_string(),
        text(stated.sampling),
        text(stated.discretisation),
        text(row.within_two),
        row.mean.to_string(),
        study.reference.mean.to_string(),
        text(study.reference.noise),
        study.seed.to_string(),
    ]
}

/// What the rows of a family say of its convergence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Convergence {
    /// The family.
    pub family: Family,
    /// Order of the nRMSE in the mesh size h = n^(−1/2), or, without a mesh of its own, in the number of
    /// samples.
    pub order: Option<Fit>,
    /// What the order is in.
    pub variable: Variable,
    /// The mean over all receivers on the finest mesh.
    pub finest_mean: f64,
    /// Its Richardson extrapolate over the last three meshes.
    pub richardson: Result<Richardson, NotAsymptotic>,
}

/// What an order of convergence is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Variable {
    /// The mesh size h = n^(−1/2).
    MeshSize,
    /// The number of samples.
    Samples,
}

impl Convergence {
    fn json(&self) -> Value {
        json!({
            "order": self.order,
            "variable": self.variable,
            "finest_mean": self.finest_mean,
            "richardson": self.richardson.ok(),
            "no_richardson": self.richardson.err(),
        })
    }
}

/// The convergence of a family; `None` without rows. Rows of different solvers differ by the tolerance
/// alone: one of each size counts.
pub fn convergence(result: &FamilyResult) -> Option<Convergence> {
    let mut rows: Vec<&Row> = result.rows.iter().collect();
    rows.dedup_by_key(|row| row.step);
    let last = rows.last()?;
    let resolved = rows.iter().filter(|row| row.error.is_resolved);
    let samples = |row: &Row| row.rays.unwrap_or(0) as f64;
    let size = |row: &Row| row.patches.map_or(1.0, |n| n as f64).sqrt();
    let is_mesh = !matches!(result.family, Family::Gather | Family::Path);
    let pairs: Vec<(f64, f64)> = resolved
        .map(|row| {
            (
                if is_mesh { size(row) } else { samples(row) },
                row.error.nrmse,
            )
        })
        .collect();
    let meshes: Vec<(f64, f64)> = rows.iter().map(|row| (1.0 / size(row), row.mean)).collect();
    Some(Convergence {
        family: result.family,
        order: order::fit(pairs),
        variable: if is_mesh {
            Variable::MeshSize
        } else {
            Variable::Samples
        },
        finest_mean: last.mean,
        richardson: if is_mesh {
            order::richardson(&meshes)
        } else {
            Err(NotAsymptotic::NoMesh)
        },
    })
}

/// Everything but the pictures.
///
/// # Errors
/// Never in practice: all of it is plain data.
pub fn to_json(study: &Study) -> Result<Value, serde_json::Error> {
    let families = study
        .families
        .iter()
        .map(|family| {
            let mut value = serde_json::to_value(family)?;
            value["convergence"] = convergence(family).map_or(Value::Null, |found| found.json());
            Ok(value)
        })
        .collect::<Result<Vec<Value>, serde_json::Error>>()?;
    Ok(json!({
        "scene": study.scene,
        "faces": study.faces,
        "quantity": match study.quantity {
            Quantity::Irradiance => "irradiance",
            Quantity::Radiance { .. } => "radiance",
        },
        "receivers": study.receivers[0],
        "receivers_on_surfaces": study.receivers[1],
        "reference": {
            "source": study.reference.source,
            "mean": study.reference.mean,
            "noise": study.reference.noise,
        },
        "families": families,
        "solvers": study.solvers,
        "version": env!("CARGO_PKG_VERSION"),
        "seed": study.seed,
        "machine": study.machine,
        "seconds": study.seconds,
    }))
}
