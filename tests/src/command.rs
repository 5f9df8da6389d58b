//! The `luxel` command without a process.

use luxel::cli::{self, ExitCode};
use std::path::Path;

/// How a run of the command ended.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Its exit code.
    pub exit: ExitCode,
    /// Results.
    pub stdout: String,
    /// Summaries, warnings, errors.
    pub stderr: String,
}

impl Outcome {
    /// Panics with the command's own message unless it succeeded.
    ///
    /// # Panics
    /// When the command failed.
    #[track_caller]
    pub fn assert_success(&self) {
        assert_eq!(self.exit, ExitCode::Ok, "luxel failed: {}", self.stderr);
    }

    /// stdout as JSON.
    ///
    /// # Panics
    /// When it is not JSON.
    #[track_caller]
    pub fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.stdout)
            .unwrap_or_else(|error| panic!("stdout is not JSON ({error}): {}", self.stdout))
    }
}

/// Runs `luxel` with the given arguments.
///
/// # Panics
/// When the command prints what is not UTF-8.
pub fn luxel(args: &[&str]) -> Outcome {
    let (mut stdout, mut stderr) = (Vec::new(), Vec::new());
    let args = std::iter::once("luxel").chain(args.iter().copied());
    let exit = cli::run(args, &mut stdout, &mut stderr);
    let text = |bytes| String::from_utf8(bytes).expect("the command prints UTF-8");
    Outcome {
        exit,
        stdout: text(stdout),
        stderr: text(stderr),
    }
}

/// A path as an argument.
///
/// # Panics
/// When it is not UTF-8, which the paths of tests are.
pub fn arg(path: &Path) -> &str {
    path.to_str().expect("paths of tests are UTF-8")
}

/// The first argument of this program as a number of things, or `default` without one.
///
/// # Errors
/// When it is no positive number.
pub fn count_argument(things: &str, default: u64) -> Result<u64, String> {
    match std::env::args().nth(1) {
        None => Ok(default),
        Some(text) => match text.parse() {
            Ok(count) if count > 0 => Ok(count),
            _ => Err(format!("{text:?} is no number of {things}: 1, 2, 3, …")),
        },
    }
}
