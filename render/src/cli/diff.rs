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

#[cfg(test)]
mod tests {
    use crate::cli::{ExitCode, run};
    use crate::image::Image;
    use crate::image::exr::{Picture, encode};

    fn luxel(args: &[&str]) -> (ExitCode, String, String) {
        let (mut stdout, mut stderr) = (Vec::new(), Vec::new());
        let args = std::iter::once("luxel").chain(args.iter().copied());
        let exit = run(args, &mut stdout, &mut stderr);
        let text = |bytes| String::from_utf8(bytes).expect("text");
        (exit, text(stdout), text(stderr))
    }

    #[test]
    fn metrics_limits_and_errors_have_their_exit_codes() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, width: usize, value: f32| {
            let path = folder.path().join(name);
            let picture = Picture {
                image: Image {
                    width,
                    height: 2,
                    pixels: vec![[value; 3]; width * 2],
                },
                layers: vec![],
                origin: None,
            };
            std::fs::write(&path, encode(&picture).expect("encodable")).expect("writable");
            path.to_str().expect("a text path").to_owned()
        };
        let one = write("one.exr", 2, 1.0);
        let more = write("more.exr", 2, 1.1);
        let wide = write("wide.exr", 3, 1.0);

        let (exit, stdout, _) = luxel(&["diff", &more, &one, "--json"]);
        assert_eq!(exit, ExitCode::Ok);
        let json: serde_json::Value = serde_json::from_str(&stdout).expect("JSON");
        // 10 % in f32, and the regulariser 0.01² in the relative form.
        let near = |key: &str, expected: f64| {
            let value = json[key].as_f64().expect("a number");
            assert!((value - expected).abs() < 1e-6, "{key}: {value}");
        };
        near("rmse", 0.1);
        near("rel_rmse", 0.1 / 1.0001_f64.sqrt());
        near("bias", 0.1);
        near("max", 0.1);

        let (exit, stdout, _) = luxel(&["diff", &more, &one, "--max-rel-rmse", "0.2"]);
        assert_eq!(exit, ExitCode::Ok);
        assert!(stdout.starts_with("RMSE"));
        let (exit, ..) = luxel(&["diff", &more, &one, "--max-rel-rmse", "0.05"]);
        assert_eq!(exit, ExitCode::LimitExceeded);
        let (exit, stdout, stderr) = luxel(&["diff", &wide, &one]);
        assert_eq!((exit, stdout.as_str()), (ExitCode::InvalidInput, ""));
        assert!(stderr.contains("3x2 against 2x2"));
        let (exit, _, stderr) = luxel(&["diff", "missing.exr", &one]);
        assert_eq!(exit, ExitCode::Failure);
        assert!(stderr.contains("missing.exr") && stderr.contains("because"));
        let (exit, ..) = luxel(&["diff", &one, &one, "--max-rel-rmse", "-1"]);
        assert_eq!(exit, ExitCode::Usage);
    }
}
