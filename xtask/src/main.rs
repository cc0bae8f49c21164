//! `cargo xtask`: everything about this workspace that takes more than one
//! command. It drives cargo and the built `asperity` binary and links neither.
//! Standard output belongs to the commands that are run; xtask speaks on stderr.

mod advisories;
mod against;
mod attack;
mod bench;
mod ci;
mod clients;
mod convergence;
mod diff_events;
mod fuzz;
mod git;
mod golden;
#[path = "../../tests/support/golden.rs"]
mod golden_tables;
mod interrupt;
mod nightly;
mod notices;
mod python;
mod reproduce;
mod revision;
mod say;
mod seed;
mod test;
mod verify;
mod workspace;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use say::say;
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
  cargo xtask convergence
  cargo xtask test
  cargo xtask python
  cargo xtask verify-solver
  cargo xtask diff-events HEAD~1
  cargo xtask golden
  cargo xtask bench --against HEAD~1
  cargo xtask fuzz --for-s 600
  cargo xtask attack --for-s 600
  cargo xtask notices
  cargo xtask ci
  cargo xtask nightly"
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
    /// The same for chapter 6 (unloading).
    #[command(name = "reproduce-chapter6")]
    ReproduceChapter6(reproduce::ReproduceArguments),
    /// The same for appendix A (damping).
    #[command(name = "reproduce-appendix-a")]
    ReproduceAppendixA(reproduce::ReproduceArguments),
    /// The same for the studies announced in section 1.2.
    #[command(name = "reproduce-goals")]
    ReproduceGoals(reproduce::ReproduceArguments),
    /// The same for front speed against prestress, with viscosity and friction springs.
    #[command(name = "reproduce-front-speed")]
    ReproduceFrontSpeed(reproduce::ReproduceArguments),
    /// The same for slip pulses under a held top drive, and where they end.
    #[command(name = "reproduce-slip-pulses")]
    ReproduceSlipPulses(reproduce::ReproduceArguments),
    /// The same for slabs beside the chain: precursors, fronts, drives, and the state of rest.
    #[command(name = "reproduce-slab")]
    ReproduceSlab(reproduce::ReproduceArguments),
    /// The same for slow slip and slow fronts, on contacts of many junctions.
    #[command(name = "reproduce-slow-slip")]
    ReproduceSlowSlip(reproduce::ReproduceArguments),
    /// The same for sheets and bodies, whose contacts cover an area: width, corners, rest, fronts.
    #[command(name = "reproduce-area")]
    ReproduceArea(reproduce::ReproduceArguments),
    /// The same for rate-and-state friction: stability, cycles, velocity steps, holds, chains.
    #[command(name = "reproduce-rate-and-state")]
    ReproduceRateAndState(reproduce::ReproduceArguments),
    /// The same for the earthquake fault of Carlson and Langer: how its ruptures are distributed by moment.
    #[command(name = "reproduce-carlson-langer")]
    ReproduceCarlsonLanger(reproduce::ReproduceArguments),
    /// Reproduce all of these, and the studies of top-driven sliders and of the number of blocks.
    #[command(name = "reproduce-all")]
    ReproduceAll(reproduce::ReproduceArguments),
    /// Tabulate how the numbers of a run change with the time step and the number of blocks.
    Convergence(convergence::ConvergenceArguments),
    /// Set up the Python and Node clients that read run logs, and run all tests.
    Test(test::TestArguments),
    /// Build the Python package, and run its tests and notebooks.
    Python(python::PythonArguments),
    /// Compare the solvers of each law in all runs, for both parameter sets.
    VerifySolver(verify::VerifyArguments),
    /// Compare the slip events of another revision with those of this checkout.
    DiffEvents(diff_events::DiffEventsArguments),
    /// Compare the events of chapter 5 with the golden tables, or accept a change.
    Golden(golden::GoldenArguments),
    /// Measure the speed, or compare it with that of another revision.
    Bench(bench::BenchArguments),
    /// Search for harmful inputs by fuzzing; needs cargo-fuzz.
    Fuzz(fuzz::FuzzArguments),
    /// Try to break, from outside, the promises of the command about files.
    Attack(attack::AttackArguments),
    /// Write the notices of other people's software that `asperity --notices` prints.
    Notices(notices::NoticesArguments),
    /// Compare the packages of Cargo.lock with a database of known vulnerabilities.
    Advisories(advisories::AdvisoriesArguments),
    /// Run all checks that a change must pass.
    Ci(ci::CiArguments),
    /// Run the ignored tests, and all attacks with a new seed.
    Nightly(nightly::NightlyArguments),
}

fn main() -> ExitCode {
    let outcome = match Arguments::parse().command {
        Command::ReproduceChapter5(arguments) => reproduce::command(&arguments, &[reproduce::CHAPTER5]),
        Command::ReproduceChapter6(arguments) => reproduce::command(&arguments, &[reproduce::CHAPTER6]),
        Command::ReproduceAppendixA(arguments) => reproduce::command(&arguments, &[reproduce::APPENDIX_A]),
        Command::ReproduceGoals(arguments) => reproduce::command(&arguments, &[reproduce::GOALS]),
        Command::ReproduceFrontSpeed(arguments) => reproduce::command(&arguments, &[reproduce::FRONT_SPEED]),
        Command::ReproduceSlipPulses(arguments) => reproduce::command(&arguments, &[reproduce::SLIP_PULSES]),
        Command::ReproduceSlab(arguments) => reproduce::command(&arguments, &[reproduce::SLAB]),
        Command::ReproduceSlowSlip(arguments) => reproduce::command(&arguments, &[reproduce::SLOW_SLIP]),
        Command::ReproduceArea(arguments) => reproduce::command(&arguments, &[reproduce::AREA]),
        Command::ReproduceRateAndState(arguments) => {
            reproduce::command(&arguments, &[reproduce::RATE_AND_STATE])
        }
        Command::ReproduceCarlsonLanger(arguments) => {
            reproduce::command(&arguments, &[reproduce::CARLSON_LANGER])
        }
        Command::ReproduceAll(arguments) => reproduce::command(&arguments, &reproduce::ALL),
        Command::Convergence(arguments) => convergence::command(&arguments),
        Command::Test(arguments) => test::command(&arguments),
        Command::Python(arguments) => python::command(&arguments),
        Command::VerifySolver(arguments) => verify::command(&arguments),
        Command::DiffEvents(arguments) => diff_events::command(&arguments),
        Command::Golden(arguments) => golden::command(&arguments),
        Command::Bench(arguments) => bench::command(&arguments),
        Command::Fuzz(arguments) => fuzz::command(&arguments),
        Command::Attack(arguments) => attack::command(&arguments),
        Command::Notices(arguments) => notices::command(&arguments),
        Command::Advisories(arguments) => advisories::command(&arguments),
        Command::Ci(arguments) => ci::command(&arguments),
        Command::Nightly(arguments) => nightly::command(&arguments),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        // A command that ran and failed has said why.
        Err(Failure::Exit { code, .. }) => ExitCode::from(code),
        Err(failure) => {
            say!("error: {failure}");
            ExitCode::from(failure.code())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    /// What stands below the options is broken into lines by hand, and must not be broken again.
    #[test]
    fn help_fits_into_80_columns() {
        let mut all = Arguments::command();
        all.build();
        for command in all.get_subcommands().chain([&all]) {
            let help = |columns| command.clone().term_width(columns).render_long_help().to_string();
            let below_options = |help: &str| help.find("\nExamples:\n").map(|start| help[start..].to_owned());
            let (narrow, wide) = (help(80), help(100));
            let long = narrow.lines().find(|line| line.chars().count() > 80);
            assert_eq!(long, None, "{}", command.get_name());
            assert_eq!(below_options(&narrow), below_options(&wide), "{}", command.get_name());
        }
    }

    #[test]
    fn bench_takes_limits_only_with_a_revision() {
        let parse = |words: &str| Arguments::try_parse_from(words.split(' '));
        for good in
            ["xtask bench", "xtask bench loop", "xtask bench --against A --pairs 3 --within 0.1 replay"]
        {
            assert!(parse(good).is_ok(), "{good}");
        }
        for bad in [
            "--pairs 3",
            "--within 0.1",
            "--against A --pairs 0",
            "--against A --within 0",
            "--against A --within 2",
        ] {
            assert!(parse(&format!("xtask bench {bad}")).is_err(), "{bad}");
        }
    }
}
