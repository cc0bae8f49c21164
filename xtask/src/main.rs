//! `cargo xtask`: everything about this workspace that takes more than one
//! command. It drives cargo and the built `asperity` binary and links neither.

#![expect(
    clippy::print_stderr,
    reason = "stdout belongs to the commands that are run; xtask speaks on stderr"
)]

mod bench;
mod ci;
mod clients;
mod diff_events;
mod fuzz;
mod git;
mod golden;
#[path = "../../tests/support/golden.rs"]
mod golden_tables;
mod interrupt;
mod reproduce;
mod revision;
mod seed;
mod test;
mod verify;
mod workspace;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use workspace::Failure;

/// Automation of the Asperity workspace.
#[derive(Debug, Parser)]
#[command(
    name = "cargo xtask",
    bin_name = "cargo xtask",
    after_help = "\
Examples:
  cargo xtask reproduce-chapter5
  cargo xtask reproduce-all
  cargo xtask test
  cargo xtask verify-solver
  cargo xtask diff-events HEAD~1
  cargo xtask golden
  cargo xtask bench
  cargo xtask fuzz --for-s 600
  cargo xtask ci"
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Make the runs, tables, figures and claims of chapter 5.
    #[command(name = "reproduce-chapter5")]
    ReproduceChapter5(reproduce::ReproduceArguments),
    /// The same for chapter 6, unloading.
    #[command(name = "reproduce-chapter6")]
    ReproduceChapter6(reproduce::ReproduceArguments),
    /// The same for appendix A, damping.
    #[command(name = "reproduce-appendix-a")]
    ReproduceAppendixA(reproduce::ReproduceArguments),
    /// The same for the studies that section 1.2 sets out to make.
    #[command(name = "reproduce-goals")]
    ReproduceGoals(reproduce::ReproduceArguments),
    /// All of these, the study of top-driven sliders and that of the number of blocks.
    #[command(name = "reproduce-all")]
    ReproduceAll(reproduce::ReproduceArguments),
    /// Set up the clients of the run log, in Python and Node, and run all tests.
    Test(test::TestArguments),
    /// Hold the fast solver against the plain one over all of chapter 5, in both parameter sets.
    VerifySolver(verify::VerifyArguments),
    /// Say what became of the events of another revision.
    DiffEvents(diff_events::DiffEventsArguments),
    /// Hold the events of chapter 5 against the golden tables, or accept that these change.
    Golden(golden::GoldenArguments),
    /// Measure how fast it is.
    Bench(bench::BenchArguments),
    /// Look for inputs that do harm; needs cargo-fuzz.
    Fuzz(fuzz::FuzzArguments),
    /// Check everything that a change must pass.
    Ci(ci::CiArguments),
}

fn main() -> ExitCode {
    let outcome = match Arguments::parse().command {
        Command::ReproduceChapter5(arguments) => reproduce::command(&arguments, &[reproduce::CHAPTER5]),
        Command::ReproduceChapter6(arguments) => reproduce::command(&arguments, &[reproduce::CHAPTER6]),
        Command::ReproduceAppendixA(arguments) => reproduce::command(&arguments, &[reproduce::APPENDIX_A]),
        Command::ReproduceGoals(arguments) => reproduce::command(&arguments, &[reproduce::GOALS]),
        Command::ReproduceAll(arguments) => reproduce::command(&arguments, &reproduce::ALL),
        Command::Test(arguments) => test::command(&arguments),
        Command::VerifySolver(arguments) => verify::command(&arguments),
        Command::DiffEvents(arguments) => diff_events::command(&arguments),
        Command::Golden(arguments) => golden::command(&arguments),
        Command::Bench(arguments) => bench::command(&arguments),
        Command::Fuzz(arguments) => fuzz::command(&arguments),
        Command::Ci(arguments) => ci::command(&arguments),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        // A command that ran and failed has said why.
        Err(Failure::Exit { code, .. }) => ExitCode::from(code),
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::from(failure.code())
        }
    }
}
