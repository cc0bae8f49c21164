//! The `asperity` command: arguments, progress, exit codes. The libraries do the work.

mod args;
mod catalogue;
mod check;
mod collect;
mod commands;
mod completions;
mod diff;
mod draw;
mod estimate;
mod event_table;
mod events;
mod exhausted;
mod exit;
mod explain;
mod export;
mod given;
mod interrupt;
mod man;
mod note;
mod outputs;
mod preview;
mod progress;
mod quakeml;
mod reading;
mod recording;
mod refine;
mod replay;
mod report;
mod reproduce;
mod run;
mod salvage;
mod scenario;
mod study;
mod summary;
mod sweep;
mod sweep_log;
mod sweep_plan;
mod terminal;
mod validate;
mod verdict_exit;

use std::ffi::OsString;
use std::process::ExitCode;

use asperity_record::printable;
use clap::error::ErrorKind;
use clap::{CommandFactory, Parser};

use args::{Arguments, Command};
use exit::Failure;
use progress::Board;

fn main() -> ExitCode {
    // A missing resource ends the command only when it is needed.
    interrupt::outlive_the_file_size_limit();
    let outcome = arguments().and_then(|arguments| arguments.map_or(Ok(()), dispatch));
    let code = match outcome {
        // The reader of our output left, as `head` does.
        Err(Failure::Output(error)) if error.kind() == std::io::ErrorKind::BrokenPipe => exit::Code::Success,
        outcome => exit::reported(outcome),
    };
    ExitCode::from(code as u8)
}

/// Parses the arguments; None if help, version or notices were requested and printed.
///
/// # Errors
/// If they are invalid, which has been printed, or the help cannot be printed.
fn arguments() -> Result<Option<Arguments>, Failure> {
    let given: Vec<OsString> = std::env::args_os().collect();
    let error = match Arguments::try_parse_from(&given) {
        Ok(arguments) if !arguments.notices => return Ok(Some(arguments)),
        Ok(_) => return notices(),
        Err(error) => error,
    };
    // No command is needed to print them.
    if error.kind() == ErrorKind::MissingSubcommand && given.iter().any(|word| word == "--notices") {
        return notices();
    }
    if !error.use_stderr() {
        return error.print().map(|()| None).map_err(Failure::Output);
    }
    // The library quotes refused arguments; parsing the printable ones gives the same error.
    let plain = given.iter().map(|argument| printable(&argument.to_string_lossy()).into_owned());
    let error = Arguments::try_parse_from(plain).err().unwrap_or(error);
    commands::advised(error, &Arguments::command()).print().ok();
    Err(Failure::Said(exit::Code::BadInput))
}

/// Prints the software of others that the command contains, and its licences; `cargo xtask notices` has written them.
fn notices() -> Result<Option<Arguments>, Failure> {
    terminal::print(include_bytes!("notices.txt"))?;
    Ok(None)
}

fn dispatch(arguments: Arguments) -> Result<(), Failure> {
    let board = Board::new(arguments.quiet);
    exhausted::fail();
    match arguments.command {
        Command::Scenario(command) => scenario::command(command, &board),
        Command::Run(arguments) => run::command(&arguments, &board),
        Command::Resume(arguments) => run::resume_command(&arguments, &board),
        Command::Summary(arguments) => summary::command(&arguments, &board),
        Command::Events(arguments) => events::command(&arguments, &board),
        Command::Recording(command) => recording::command(&command, &board),
        Command::Catalogue(arguments) => catalogue::command(&arguments, &board),
        Command::Check(arguments) => check::command(&arguments, &board),
        Command::Note(arguments) => note::command(&arguments),
        Command::Salvage(arguments) => salvage::command(&arguments),
        Command::Replay(arguments) => replay::command(&arguments, board),
        Command::Export(arguments) => export::command(&arguments, &board),
        Command::Diff(arguments) => diff::command(&arguments),
        Command::Report(arguments) => report::command(&arguments, &board),
        Command::Draw(arguments) => draw::command(&arguments, &board),
        Command::Reduce(arguments) => reproduce::reduce_command(&arguments, &board),
        Command::Reproduce(arguments) => reproduce::command(&arguments, &board),
        Command::Refine(arguments) => refine::command(&arguments, &board),
        Command::Sweep(command) => sweep::command(&command, &board),
        Command::Keys(arguments) => explain::keys(&arguments),
        Command::Columns(arguments) => explain::columns(&arguments),
        Command::Numbers(arguments) => explain::numbers(&arguments),
        Command::Figures(arguments) => explain::figures(&arguments),
        Command::Completions(arguments) => completions::command(&arguments),
        Command::Man(arguments) => man::command(&arguments),
    }
}
