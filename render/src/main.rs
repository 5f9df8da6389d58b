//! The luxel command.

use luxel::cli::{ExitCode, Interrupt, run_with};
use std::io::IsTerminal;

fn main() -> std::process::ExitCode {
    let terminal = std::io::stderr().is_terminal();
    let interrupt = Interrupt::default();
    let raised = interrupt.clone();
    // Without a handler Ctrl-C still ends the process, only less tidily.
    let _ = ctrlc::set_handler(move || raised.raise(ExitCode::Interrupted as i32));
    let outcome = std::panic::catch_unwind(|| {
        run_with(
            std::env::args_os(),
            &mut std::io::stdout().lock(),
            &mut std::io::stderr(),
            terminal,
            interrupt,
        )
    });
    // The panic's own message is on stderr already; what remains is the documented exit code.
    outcome.unwrap_or(ExitCode::Failure).into()
}
