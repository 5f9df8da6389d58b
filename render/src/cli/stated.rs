//! The error that a result states: its parts, which of them dominates, and what would reduce it.

use super::exit::ExitCode;
use super::goal::Goal;
use luxel_solver::gather::ErrorParts;
use serde::{Deserialize, Serialize};

/// Where an error comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Source {
    /// The iteration of the solver.
    Solver,
    /// Noise of shadow rays.
    ShadowRays,
    /// Noise of gather rays.
    GatherRays,
    /// Noise of rows and of direct light at patches.
    Solution,
    /// Noise of all samples of a receiver together.
    Samples,
    /// Size of the patches.
    Patches,
}

impl Source {
    /// What it is called.
    fn name(self) -> &'static str {
        match self {
            Self::Solver => "solver",
            Self::ShadowRays => "direct light",
            Self::GatherRays => "gather",
            Self::Solution => "solution",
            Self::Samples => "sampling",
            Self::Patches => "patches",
        }
    }

    /// What makes it smaller.
    fn remedy(self) -> &'static str {
        match self {
            Self::Solver => "more sweeps",
            Self::ShadowRays => "more shadow rays",
            Self::GatherRays => "more gather rays",
            Self::Solution => "more rays in the rows of patches",
            Self::Samples => "more samples",
            Self::Patches => "smaller patches",
        }
    }

    /// Which of the three kinds it belongs to.
    fn kind(self) -> &'static str {
        match self {
            Self::Solver => "solver",
            Self::Patches => "discretisation",
            _ => "sampling",
        }
    }
}

/// Relative errors, rms over mean, by their source.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct StatedError(Vec<(Source, f64)>);

impl StatedError {
    /// The parts of a gather at points, with the relative bound of the solver.
    pub(super) fn of_gather(parts: &ErrorParts, solver: f64) -> Self {
        Self(vec![
            (Source::Solver, solver),
            (Source::ShadowRays, parts.direct),
            (Source::GatherRays, parts.gather),
            (Source::Solution, parts.solution),
            (Source::Patches, parts.mesh),
        ])
    }

    /// Noise, and what patches leave.
    pub(super) fn of_samples(sampling: f64, discretisation: f64, solver: f64) -> Self {
        Self(vec![
            (Source::Solver, solver),
            (Source::Samples, sampling),
            (Source::Patches, discretisation),
        ])
    }

    /// All parts together: they are independent.
    pub(super) fn total(&self) -> f64 {
        self.0.iter().map(|(_, e)| e * e).sum::<f64>().sqrt()
    }

    fn kind(&self, kind: &str) -> f64 {
        let own = self.0.iter().filter(|(source, _)| source.kind() == kind);
        own.map(|(_, e)| e * e).sum::<f64>().sqrt()
    }

    fn dominant(&self) -> Option<Source> {
        let largest = self.0.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        (largest.1 > 0.0).then_some(largest.0)
    }

    /// For scripts.
    pub(super) fn to_json(&self, goal: Option<&Goal>) -> serde_json::Value {
        let target = goal.and_then(|goal| goal.error);
        serde_json::json!({
            "solver": self.kind("solver"),
            "sampling": self.kind("sampling"),
            "discretisation": self.kind("discretisation"),
            "total": self.total(),
            "dominant": self.dominant().map(Source::name),
            "target": target.map(|target| target.0),
            "reached": target.map(|_| goal.is_some_and(|goal| goal.is_met_by(self.total()))),
        })
    }

    /// For people: the error, the target, and what to do about the largest part.
    pub(super) fn summary(&self, goal: Option<&Goal>) -> String {
        let total = 100.0 * self.total();
        let asked = goal
            .and_then(|goal| goal.error)
            .map_or(String::new(), |target| {
                format!(" (asked for {} %)", percent(target.0))
            });
        let advice = self.dominant().map_or(String::new(), |dominant| {
            let parts: Vec<String> = self
                .0
                .iter()
                .filter(|(_, error)| *error > 1e-3 * self.total())
                .map(|(source, error)| format!("{} {:.2}", source.name(), 100.0 * error))
                .collect();
            let remedy = dominant.remedy();
            format!(": {}; {remedy} would reduce it most", parts.join(", "))
        });
        format!("estimated error {total:.2} %{asked}{advice}")
    }

    /// How the command ends: well, unless an error was asked for that this is not.
    pub(super) fn exit(&self, goal: Option<&Goal>) -> ExitCode {
        match goal {
            Some(goal) if goal.error.is_some() && !goal.is_met_by(self.total()) => {
                ExitCode::TargetMissed
            }
            _ => ExitCode::Ok,
        }
    }
}

/// A percentage as a person would write it.
pub(super) fn percent(value: f64) -> f64 {
    (value * 1e9).round() / 1e7
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::goal::RelativeError;
    use std::time::Instant;

    #[test]
    fn the_largest_part_is_named_with_its_remedy() {
        let parts = ErrorParts {
            direct: 0.001,
            gather: 0.004,
            solution: 0.002,
            mesh: 0.0,
            spread: 0.0,
        };
        let stated = StatedError::of_gather(&parts, 0.0);
        let total = (1e-6_f64 + 16e-6 + 4e-6).sqrt();
        assert!((stated.total() - total).abs() < 1e-15);
        let goal = Goal::new(Some(RelativeError(0.007)), None, Instant::now());
        let text = stated.summary(Some(&goal));
        assert!(
            text.contains("asked for 0.7 %") && text.contains("more gather rays"),
            "{text}"
        );
        assert_eq!(stated.exit(Some(&goal)), ExitCode::Ok);
        let json = stated.to_json(Some(&goal));
        assert_eq!(
            (&json["dominant"], &json["reached"]),
            (&"gather".into(), &true.into())
        );
        let strict = Goal::new(Some(RelativeError(0.001)), None, Instant::now());
        assert_eq!(stated.exit(Some(&strict)), ExitCode::TargetMissed);
    }

    #[test]
    fn what_is_exact_says_so() {
        let exact = StatedError::of_samples(0.0, 0.0, 0.0);
        assert_eq!(exact.summary(None), "estimated error 0.00 %");
        assert!(exact.to_json(None)["dominant"].is_null());
    }
}
