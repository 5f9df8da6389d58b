//! The luxel command.

use std::io::IsTerminal;
use std::process::ExitCode;

fn main() -> ExitCode {
    let terminal = std::io::stderr().is_terminal();
    let outcome = std::panic::catch_unwind(|| {
        luxel::cli::run_with(
            std::env::args_os(),
            &mut std::io::stdout().lock(),
            &mut std::io::stderr(),
            terminal,
        )
    });
    // The panic's own message is on stderr already; what remains is the documented exit code.
    outcome.unwrap_or(luxel::cli::ExitCode::Failure).into()
}
