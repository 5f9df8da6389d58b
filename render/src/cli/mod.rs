//! The `luxel` command: one file per verb.
//!
//! stdout carries results only; progress, summaries, warnings and errors go to stderr. The verbs
//! read their arguments, call the library and print; what they compute lives elsewhere.

mod bake;
mod check;
mod checkpoint;
mod common;
mod converge;
mod dense;
mod diff;
mod exit;
mod export;
mod footprint;
mod form_factors;
mod goal;
mod interrupt;
mod memory;
mod occlusion;
mod probe;
mod refine;
mod reflections;
mod render;
mod reporter;
mod scene;
mod solve;
mod stated;
mod steering;
mod transport;
mod view;

pub use exit::ExitCode;
pub use interrupt::Interrupt;

use clap::Parser;
use common::Common;
use exit::Failure;
use reporter::Reporter;
use std::ffi::OsString;
use std::io::Write;
use std::time::Instant;

/// Radiosity and global illumination with a stated error.
#[derive(Parser)]
#[command(name = "luxel", version, max_term_width = 100)]
struct Arguments {
    #[command(flatten)]
    common: Common,
    #[command(subcommand)]
    verb: Verb,
}

#[derive(clap::Subcommand)]
enum Verb {
    Render(render::Render),
    Solve(solve::Solve),
    Probe(probe::Probe),
    Bake(bake::Bake),
    Export(export::Export),
    View(view::View),
    FormFactors(form_factors::FormFactors),
    Converge(converge::Converge),
    Check(check::Check),
    Diff(diff::Diff),
}

/// What a verb works with besides its own arguments.
struct Session<'a> {
    context: Context<'a>,
    stdout: &'a mut dyn Write,
}

/// What may be used from any thread.
struct Context<'a> {
    common: Common,
    reporter: Reporter<'a>,
    interrupt: Interrupt,
    /// When the command began: times that are asked for include everything.
    started: Instant,
}

impl Session<'_> {
    /// Prints a result. A reader that has gone away (a closed pipe) is no failure: whoever closed
    /// it has seen enough.
    fn print(&mut self, result: &str) -> Result<(), Failure> {
        let written = writeln!(self.stdout, "{result}").and_then(|()| self.stdout.flush());
        match written {
            Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
                Err(Failure::new(ExitCode::Failure, error))
            }
            _ => Ok(()),
        }
    }
}

/// Runs the command with `args` (the program's name first), as if stderr were no terminal.
pub fn run(
    args: impl IntoIterator<Item = impl Into<OsString> + Clone>,
    stdout: &mut dyn Write,
    stderr: &mut (dyn Write + Send),
) -> ExitCode {
    run_with(args, stdout, stderr, false, Interrupt::default())
}

/// Runs the command with `args` (the program's name first). `terminal` says that stderr is a
/// terminal, on which bars may be drawn. `interrupt` may be raised from another thread.
pub fn run_with(
    args: impl IntoIterator<Item = impl Into<OsString> + Clone>,
    stdout: &mut dyn Write,
    stderr: &mut (dyn Write + Send),
    terminal: bool,
    interrupt: Interrupt,
) -> ExitCode {
    let started = Instant::now();
    let arguments = match Arguments::try_parse_from(args) {
        Ok(arguments) => arguments,
        Err(error) => return usage(&error, stdout, stderr),
    };
    let mut session = Session {
        context: Context {
            reporter: Reporter::new(stderr, terminal, &arguments.common),
            common: arguments.common,
            interrupt,
            started,
        },
        stdout,
    };
    let outcome = match arguments.verb {
        Verb::Render(verb) => verb.run(&mut session),
        Verb::Solve(verb) => verb.run(&mut session),
        Verb::Probe(verb) => verb.run(&mut session),
        Verb::Bake(verb) => verb.run(&mut session),
        Verb::Export(verb) => verb.run(&mut session),
        Verb::View(verb) => verb.run(&mut session),
        Verb::FormFactors(verb) => verb.run(&mut session),
        Verb::Converge(verb) => verb.run(&mut session),
        Verb::Check(verb) => verb.run(&mut session),
        Verb::Diff(verb) => verb.run(&mut session),
    };
    let seconds = started.elapsed().as_secs_f64();
    session
        .context
        .reporter
        .detail(format_args!("{seconds:.3} s"));
    outcome.unwrap_or_else(|failure| {
        session.context.reporter.error(&failure);
        failure.exit
    })
}

/// Prints clap's message: help and version are results, everything else is a usage error.
fn usage(error: &clap::Error, stdout: &mut dyn Write, stderr: &mut (dyn Write + Send)) -> ExitCode {
    // There is nobody left to tell when these writes fail.
    if error.use_stderr() {
        let _ = write!(stderr, "{}", error.render());
        ExitCode::Usage
    } else {
        let _ = write!(stdout, "{}", error.render());
        ExitCode::Ok
    }
}

/// The name of an option's value on the command line.
fn name(value: &impl clap::ValueEnum) -> String {
    value
        .to_possible_value()
        .map(|value| value.get_name().to_owned())
        .unwrap_or_default()
}

/// A length in metres: finite and positive.
fn parse_length(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(length) if length.is_finite() && length > 0.0 => Ok(length),
        _ => Err("a length in metres above 0 is needed, such as 0.5".into()),
    }
}

#[cfg(test)]
mod tests;
