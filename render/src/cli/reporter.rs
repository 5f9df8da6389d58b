//! What goes to stderr: errors, warnings, summaries and progress.

use super::common::{Common, ProgressMode};
use super::exit::Failure;
use crate::progress::Progress;
use indicatif::{ProgressBar, ProgressStyle};
use std::fmt::Display;
use std::io::Write;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Time between two plain lines of progress; work that takes less shows none.
const PLAIN_INTERVAL: Duration = Duration::from_secs(3);

/// Time between two JSON lines of progress.
const JSON_INTERVAL: Duration = Duration::from_millis(500);

/// Writes to stderr, as far as the user wants to know.
pub(super) struct Reporter<'a> {
    verbose: bool,
    quiet: bool,
    mode: ProgressMode,
    state: Mutex<State<'a>>,
}

struct State<'a> {
    stderr: &'a mut (dyn Write + Send),
    stage: Option<Stage>,
}

struct Stage {
    name: String,
    done: u64,
    total: u64,
    started: Instant,
    reported: Instant,
    bar: Option<ProgressBar>,
}

impl<'a> Reporter<'a> {
    /// A reporter on `stderr`, which is a `terminal` or not.
    pub(super) fn new(stderr: &'a mut (dyn Write + Send), terminal: bool, common: &Common) -> Self {
        let mode = match common.progress {
            _ if common.quiet => ProgressMode::None,
            ProgressMode::Auto | ProgressMode::Bar if terminal => ProgressMode::Bar,
            ProgressMode::Auto | ProgressMode::Bar => ProgressMode::Plain,
            mode => mode,
        };
        Self {
            verbose: common.verbose,
            quiet: common.quiet,
            mode,
            state: Mutex::new(State {
                stderr,
                stage: None,
            }),
        }
    }

    /// An error with its causes, always shown.
    pub(super) fn error(&self, failure: &Failure) {
        let mut text = format!("error: {}", failure.error);
        let mut cause = failure.error.source();
        while let Some(error) = cause {
            text.push_str("\n  because: ");
            text.push_str(&error.to_string());
            cause = error.source();
        }
        self.lock().line(&text);
    }

    /// Something that the user should know about the result; hidden by `-q`.
    pub(super) fn warning(&self, text: impl Display) {
        if !self.quiet {
            self.lock().line(&format!("warning: {text}"));
        }
    }

    /// A summary; hidden by `-q`.
    pub(super) fn note(&self, text: impl Display) {
        if !self.quiet {
            self.lock().line(&text.to_string());
        }
    }

    /// A detail; shown by `-v`.
    pub(super) fn detail(&self, text: impl Display) {
        if self.verbose {
            self.lock().line(&text.to_string());
        }
    }

    fn lock(&self) -> MutexGuard<'_, State<'a>> {
        // A line of progress is worth having even after another thread has panicked.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State<'_> {
    /// Writes a line. Nobody is left to tell when stderr is closed.
    fn line(&mut self, text: &str) {
        match self.stage.as_ref().and_then(|stage| stage.bar.as_ref()) {
            Some(bar) => bar.suspend(|| {
                let _ = writeln!(self.stderr, "{text}");
            }),
            None => {
                let _ = writeln!(self.stderr, "{text}");
            }
        }
    }

    fn report(&mut self, mode: ProgressMode, complete: bool) {
        let Some(stage) = &mut self.stage else {
            return;
        };
        if let Some(bar) = &stage.bar {
            bar.set_position(stage.done);
            return;
        }
        let interval = if mode == ProgressMode::Json {
            JSON_INTERVAL
        } else {
            PLAIN_INTERVAL
        };
        let due = stage.reported.elapsed() >= interval;
        let text = match mode {
            ProgressMode::Plain if due => stage.plain(),
            ProgressMode::Json if due || complete || stage.done == 0 => stage.json(),
            _ => return,
        };
        stage.reported = Instant::now();
        self.line(&text);
    }
}

impl Stage {
    /// Seconds left at the pace so far; `None` before anything is done.
    fn seconds_left(&self) -> Option<f64> {
        (self.done > 0).then(|| {
            let remaining = self.total.saturating_sub(self.done);
            self.started.elapsed().as_secs_f64() * remaining as f64 / self.done as f64
        })
    }

    fn plain(&self) -> String {
        let percent = 100 * self.done / self.total.max(1);
        let left = self
            .seconds_left()
            .map_or(String::new(), |seconds| format!(", {seconds:.0} s left"));
        format!("{}: {percent} %{left}", self.name)
    }

    fn json(&self) -> String {
        serde_json::json!({
            "stage": self.name,
            "done": self.done,
            "total": self.total,
            "elapsed": self.started.elapsed().as_secs_f64(),
            "left": self.seconds_left(),
        })
        .to_string()
    }
}

impl Progress for Reporter<'_> {
    fn start(&self, stage: &str, total: u64) {
        if self.mode == ProgressMode::None {
            return;
        }
        let bar = (self.mode == ProgressMode::Bar).then(|| {
            let style = ProgressStyle::with_template("{msg} [{bar:30}] {percent} %, {eta} left")
                .unwrap_or_else(|_| ProgressStyle::default_bar());
            ProgressBar::new(total)
                .with_style(style)
                .with_message(stage.to_owned())
        });
        let now = Instant::now();
        let mut state = self.lock();
        state.stage = Some(Stage {
            name: stage.to_owned(),
            done: 0,
            total,
            started: now,
            reported: now,
            bar,
        });
        state.report(self.mode, false);
    }

    fn advance(&self, amount: u64) {
        if self.mode == ProgressMode::None {
            return;
        }
        let mut state = self.lock();
        if let Some(stage) = &mut state.stage {
            stage.done += amount;
        }
        state.report(self.mode, false);
    }

    fn finish(&self) {
        if self.mode == ProgressMode::None {
            return;
        }
        let mut state = self.lock();
        if let Some(stage) = &mut state.stage {
            stage.done = stage.total;
        }
        state.report(self.mode, true);
        if let Some(bar) = state.stage.take().and_then(|stage| stage.bar) {
            bar.finish_and_clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::ExitCode;

    fn common(progress: ProgressMode, quiet: bool) -> Common {
        Common {
            seed: 0,
            error: None,
            time: None,
            max_memory: None,
            jobs: None,
            progress,
            json: false,
            verbose: false,
            quiet,
        }
    }

    fn written(common: &Common, work: impl Fn(&Reporter<'_>)) -> String {
        let mut stderr = Vec::new();
        work(&Reporter::new(&mut stderr, false, common));
        String::from_utf8(stderr).expect("text")
    }

    fn stage(reporter: &Reporter<'_>) {
        reporter.start("rays", 10);
        reporter.advance(5);
        reporter.finish();
    }

    #[test]
    fn json_lines_start_at_zero_and_end_at_the_total() {
        let text = written(&common(ProgressMode::Json, false), stage);
        let lines: Vec<serde_json::Value> = text
            .lines()
            .map(|line| serde_json::from_str(line).expect("JSON"))
            .collect();
        assert_eq!(lines[0]["done"], 0);
        assert_eq!(lines[lines.len() - 1]["done"], 10);
        assert!(lines.iter().all(|line| line["stage"] == "rays"));
    }

    #[test]
    fn short_work_and_quiet_users_see_nothing() {
        assert_eq!(written(&common(ProgressMode::Auto, false), stage), "");
        assert_eq!(written(&common(ProgressMode::Json, true), stage), "");
        let quiet = written(&common(ProgressMode::Auto, true), |reporter| {
            reporter.warning("odd");
            reporter.note("done");
        });
        assert_eq!(quiet, "");
    }

    #[test]
    fn errors_show_their_causes() {
        #[derive(Debug, thiserror::Error)]
        #[error("outer")]
        struct Outer(#[source] std::fmt::Error);
        let failure = Failure::new(ExitCode::Failure, Outer(std::fmt::Error));
        let text = written(&common(ProgressMode::None, true), |r| r.error(&failure));
        assert!(text.starts_with("error: outer\n  because: "));
    }
}
