//! The `asperity` command: arguments, progress, exit codes. Everything else is
//! in the libraries.

mod args;
mod check;
mod completions;
mod diff;
mod event_table;
mod events;
mod exit;
mod export;
mod interrupt;
mod man;
mod progress;
mod replay;
#[cfg(feature = "analysis")]
mod reproduce;
mod run;
mod salvage;
mod scenario;
mod terminal;
#[cfg(feature = "analysis")]
mod verify;

use std::process::ExitCode;

use args::{Arguments, Command};
use exit::Failure;
use progress::Board;

fn main() -> ExitCode {
    // What cannot be had then ends the command when it is needed, and not before.
    interrupt::outlive_the_file_size_limit();
    let outcome = terminal::arguments().and_then(|arguments| arguments.map_or(Ok(()), dispatch));
    match outcome {
        Ok(()) => exit::Code::Success.into(),
        Err(failure) if failure.is_broken_pipe() => exit::Code::Success.into(),
        Err(failure) => {
            exit::report(&failure);
            failure.code().into()
        }
    }
}

fn dispatch(arguments: Arguments) -> Result<(), Failure> {
    let board = Board::new(arguments.quiet);
    match arguments.command {
        Command::Scenario(command) => scenario::command(command),
        Command::Run(arguments) => run::command(&arguments, &board),
        Command::Events(arguments) => events::command(&arguments),
        Command::Check(arguments) => check::command(&arguments),
        Command::Salvage(arguments) => salvage::command(&arguments),
        Command::Replay(arguments) => replay::command(&arguments, board),
        Command::Export(arguments) => export::command(&arguments, &board),
        Command::Diff(arguments) => diff::command(&arguments),
        #[cfg(feature = "analysis")]
        Command::Reduce(arguments) => reproduce::reduce_command(&arguments),
        #[cfg(feature = "analysis")]
        Command::Reproduce(arguments) => reproduce::command(&arguments, &board),
        #[cfg(feature = "analysis")]
        Command::VerifySolver(arguments) => verify::command(&arguments, &board),
        Command::Completions(arguments) => completions::command(&arguments),
        Command::Man(arguments) => man::command(&arguments),
    }
}
