//! `luxel diff`: how far an image is from a reference.

use super::Session;
use super::exit::{ExitCode, Failure};
use crate::diff::{Difference, difference};
use crate::image::exr;
use std::path::PathBuf;

/// Compare two EXR images: RMSE, relative RMSE, bias, maximum
///
/// nRMSE is the RMSE over the mean of the reference; relRMSE weighs every pixel relative to its
/// own reference, so that dark parts count. With --json, ratios to a black reference are null.
#[derive(clap::Args)]
pub(super) struct Diff {
    /// The image to judge
    image: PathBuf,

    /// The reference
    reference: PathBuf,

    /// Exit with code 5 when the relative RMSE is above X
    #[arg(long, value_name = "X", value_parser = parse_limit)]
    max_rel_rmse: Option<f64>,
}

impl Diff {
    pub(super) fn run(self, session: &mut Session<'_>) -> Result<ExitCode, Failure> {
        let compare = || -> Result<Difference, Failure> {
            let image = exr::read(&self.image)?.image;
            let reference = exr::read(&self.reference)?.image;
            Ok(difference(&image, &reference)?)
        };
        let result = session.context.common.install(compare)??;
        let text = if session.context.common.json {
            serde_json::to_string_pretty(&result)?
        } else {
            table(&result)
        };
        session.print(&text)?;
        match self.max_rel_rmse {
            Some(limit) if result.rel_rmse > limit => {
                session.context.reporter.warning(format_args!(
                    "the relative RMSE {} is above the limit {limit}",
                    result.rel_rmse
                ));
                Ok(ExitCode::LimitExceeded)
            }
            _ => Ok(ExitCode::Ok),
        }
    }
}

/// One line per metric.
fn table(result: &Difference) -> String {
    let percent = |ratio: f64| format!("{:.4} %", 100.0 * ratio);
    format!(
        "RMSE     {:.6e}\nnRMSE    {}\nrelRMSE  {}\nbias     {:+.6e} ({})\nmax      {:.6e}\np95      {:.6e}",
        result.rmse,
        percent(result.nrmse),
        percent(result.rel_rmse),
        result.bias,
        percent(result.rel_bias),
        result.max,
        result.p95,
    )
}

/// A finite number that is not negative.
fn parse_limit(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(limit) if limit.is_finite() && limit >= 0.0 => Ok(limit),
        _ => Err("a number of at least 0 is needed, for example 0.02 for 2 %".into()),
    }
}
