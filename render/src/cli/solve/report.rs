//! What `solve` prints.

use crate::accuracy::{Part, RelativeErrors};
use crate::cli::memory;
use crate::solution::ObjectLight;
use luxel_scenes::{Radiosity, Rgb};
use luxel_solver::radiosity::RadiositySolution;
use luxel_solver::solvers::Ledger;
use std::fmt::Write as _;

/// What is reported.
pub(super) struct Report {
    pub(super) patches: usize,
    pub(super) objects: Vec<ObjectLight>,
    pub(super) mesh: Option<Vec<u8>>,
    pub(super) iterations: usize,
    pub(super) residual: Rgb,
    pub(super) energy: Energy,
    pub(super) errors: RelativeErrors,
    /// Bound on the root mean square of what the iteration leaves, over the mean radiosity; `None`
    /// where form factors are not reciprocal.
    pub(super) solver_rms: Option<f64>,
    /// The relative error that was aimed at.
    pub(super) target: Option<f64>,
    pub(super) converged: bool,
    pub(super) seconds: Vec<(&'static str, f64)>,
    /// The options that would reduce the dominant part of the error.
    pub(super) remedy: &'static str,
}

/// Where the flux goes, in W: emitted = absorbed + escaped + residual.
pub(super) struct Energy {
    pub(super) emitted: Rgb,
    pub(super) absorbed: Rgb,
    pub(super) escaped: Rgb,
    pub(super) residual: Rgb,
}

impl Energy {
    /// The mean ledger of the solutions. `emitted` is the flux of all surfaces when these are the
    /// only lights: what of it meets no surface has escaped. Of other lights, only what arrives is
    /// known to be theirs, so that it counts as emitted.
    pub(super) fn new(solutions: &[RadiositySolution], emitted: Option<Rgb>) -> Self {
        let ledgers: Vec<Ledger> = solutions.iter().map(|solution| solution.ledger).collect();
        let ledger = Ledger::mean(&ledgers);
        let arrived = ledger.emitted.0 + ledger.direct.0;
        let emitted = emitted.unwrap_or(arrived);
        Self {
            emitted,
            absorbed: ledger.absorbed.0,
            escaped: ledger.escaped.0 + (emitted - arrived),
            residual: ledger.residual.0 + ledger.defect.0,
        }
    }
}

impl Report {
    /// Whether the target was reached; `None` without one.
    pub(super) fn reached(&self) -> Option<bool> {
        self.target.map(|target| self.errors.total() <= target)
    }

    /// The summary for people.
    pub(super) fn summary(&self, seconds: f64) -> String {
        let percent = |value: f64| format!("{:.2} %", 100.0 * value);
        let errors = &self.errors;
        let sampling = errors.sampling.map_or("unknown".to_owned(), percent);
        let mut text = format!(
            "{} patches, {} sweeps, {seconds:.2} s{}; estimated error {} of the mean irradiance \
             (sampling {sampling}, discretisation {}, solver {:.1e})",
            self.patches,
            self.iterations,
            memory::peak_in_words(),
            percent(errors.total()),
            percent(errors.discretisation),
            errors.solver,
        );
        // Writing to a string does not fail.
        let _ = write!(text, "; {} dominates", errors.dominant().name());
        let _ = match errors.dominant() {
            Part::Solver => write!(text, ": a smaller --tolerance would reduce it"),
            _ => write!(text, ": {} would reduce it", self.remedy),
        };
        text
    }

    pub(super) fn to_json(&self, output: Option<&std::path::Path>) -> serde_json::Value {
        let objects: serde_json::Map<_, _> = self
            .objects
            .iter()
            .map(|object| {
                let Radiosity(radiosity) = object.radiosity;
                let value = serde_json::json!({
                    "area": object.area,
                    "radiosity": radiosity.to_array(),
                    "irradiance": object.irradiance.0.to_array(),
                    "standard_error": object.standard_error.map(|e| e.0.to_array()),
                });
                (object.name.clone(), value)
            })
            .collect();
        let seconds: serde_json::Map<_, _> = self
            .seconds
            .iter()
            .map(|&(stage, seconds)| (stage.to_owned(), seconds.into()))
            .collect();
        serde_json::json!({
            "patches": self.patches,
            "objects": objects,
            "iterations": self.iterations,
            "residual": self.residual.to_array(),
            "energy": {
                "emitted": self.energy.emitted.to_array(),
                "absorbed": self.energy.absorbed.to_array(),
                "escaped": self.energy.escaped.to_array(),
                "residual": self.energy.residual.to_array(),
            },
            "error": {
                "solver": self.errors.solver,
                "solver_rms": self.solver_rms,
                "sampling": self.errors.sampling,
                "discretisation": self.errors.discretisation,
                "total": self.errors.total(),
                "dominant": self.errors.dominant().name(),
                "target": self.target,
                "reached": self.reached(),
            },
            "output": output.map(|path| path.display().to_string()),
            "seconds": seconds,
        })
    }

    pub(super) fn to_table(&self) -> String {
        let rgb = |value: Rgb| format!("{:>11.4e} {:>11.4e} {:>11.4e}", value.x, value.y, value.z);
        let width = self.objects.iter().map(|o| o.name.chars().count()).max();
        let width = width.unwrap_or(0).max(9);
        // Writing to a string does not fail.
        let mut text = format!(
            "{:width$} {:>10}  {:>35}  {:>35}  {:>8}\n",
            "object", "area m2", "radiosity W/m2", "irradiance W/m2", "error"
        );
        for object in &self.objects {
            let relative = object.standard_error.map_or(String::new(), |error| {
                let level = object.radiosity.0.max_element();
                if level > 0.0 {
                    format!("{:.2} %", 100.0 * error.0.max_element() / level)
                } else {
                    String::new()
                }
            });
            let _ = writeln!(
                text,
                "{:width$} {:>10.4}  {}  {}  {relative:>8}",
                object.name,
                object.area,
                rgb(object.radiosity.0),
                rgb(object.irradiance.0)
            );
        }
        let lines = [
            ("emitted", self.energy.emitted),
            ("absorbed", self.energy.absorbed),
            ("escaped", self.energy.escaped),
            ("residual", self.energy.residual),
        ];
        for (index, (name, flux)) in lines.into_iter().enumerate() {
            let line = if index == 0 { "\n" } else { "" };
            let _ = writeln!(text, "{line}{name:width$} {:>10}  {}", "W", rgb(flux));
        }
        text.trim_end().to_owned()
    }
}
