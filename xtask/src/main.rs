//! `cargo xtask`: everything about this workspace that takes more than one
//! command. It drives cargo and the built `asperity` binary and links neither.
//! Standard output belongs to the commands that are run; xtask speaks on stderr.

mod against;
mod attack;
mod bench;
mod book;
mod ci;
mod clients;
mod cpu;
mod diff_events;
mod fuzz;
mod golden;
#[path = "../../tests/support/golden.rs"]
mod golden_tables;
mod notices;
#[path = "../../tests/support/pairs.rs"]
mod pairs;
mod python;
mod reproduce;
mod revision;
mod say;
mod test;
mod verify;
mod workspace;

use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};

use say::say;
use workspace::Failure;

/// Automation of the Asperity workspace.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Make the runs, tables, figures and claims of chapter 5.
    #[command(name = "reproduce-chapter5")]
    ReproduceChapter5(reproduce::ReproduceArguments),
    /// The same for any pipeline.
    Reproduce(reproduce::OneArguments),
    /// The same for all pipelines.
    #[command(name = "reproduce-all")]
    ReproduceAll(reproduce::ReproduceArguments),
    #[command(
        about = "Run the tests.",
        after_help = "\
Examples:
  cargo xtask test
  cargo xtask test --test root summary:: -- --nocapture

Arguments are passed to cargo test, which then runs the selected tests. A test
without the program that it drives, such as Chromium, is skipped and prints a
note; with ASPERITY_NO_SKIPS=1 in the environment it fails instead. Ignored
tests, which take long and rarely fail or need packages of Python and Node, are
run by cargo xtask nightly, and those in modules named in_ci by cargo xtask ci."
    )]
    Test(Further),
    #[command(
        about = "Build the Python package, and run its tests and notebooks.",
        after_help = "\
Examples:
  cargo xtask python
  cargo xtask python -k field

Sets up an environment with locked packages under the target folder, installs
the package in it and runs tests/python with pytest, which receives any
arguments. cargo xtask ci runs it."
    )]
    Python(Further),
    /// Make one site with a search of all pages, keys, columns, numbers, figures and commands.
    Book,
    /// Compare the solvers of each law in all runs, for both parameter sets.
    Verify(verify::VerifyArguments),
    /// Compare the slip events of another revision with those of this checkout.
    DiffEvents(diff_events::DiffEventsArguments),
    /// Compare the events of chapter 5 with the golden tables, or accept a change.
    Golden(golden::GoldenArguments),
    /// Measure the speed, or compare it with that of another revision.
    Bench(bench::BenchArguments),
    /// Search for harmful inputs by fuzzing; needs cargo-fuzz.
    Fuzz(fuzz::FuzzArguments),
    #[command(
        about = "Try to break, from outside, the promises of the command about files.",
        after_help = "\
Examples:
  cargo xtask attack
  cargo xtask attack flips mixes --seed 7
  cargo xtask attack -- --help"
    )]
    Attack(Further),
    /// Draw the pictures of docs/gallery.md anew, by the commands on that page.
    Gallery,
    /// Write the notices of other people's software that `asperity --notices` prints.
    Notices,
    /// Run all checks that a change must pass.
    Ci(ci::CiArguments),
    /// Run the ignored tests, and all attacks with a new seed.
    #[command(after_help = "\
Examples:
  cargo xtask nightly
  ASPERITY_NO_SKIPS=1 cargo xtask nightly

Runs all tests that are ignored otherwise, those in modules named in_ci among
them, and then all attacks with a new seed, which is printed.")]
    Nightly,
}

#[derive(Debug, Args)]
struct Further {
    /// Arguments that are passed on.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "ARGUMENTS")]
    further: Vec<String>,
}

fn main() -> ExitCode {
    let outcome = match Arguments::parse().command {
        Command::ReproduceChapter5(arguments) => reproduce::command(&arguments, &[reproduce::CHAPTER5]),
        Command::Reproduce(arguments) => arguments.run(),
        Command::ReproduceAll(arguments) => reproduce::command(&arguments, &reproduce::ALL),
        Command::Test(Further { further }) => test::command(&further),
        Command::Python(Further { further }) => python::command(&further),
        Command::Book => book::command(),
        Command::Verify(arguments) => verify::command(&arguments),
        Command::DiffEvents(arguments) => diff_events::command(&arguments),
        Command::Golden(arguments) => golden::command(&arguments),
        Command::Bench(arguments) => bench::command(&arguments),
        Command::Fuzz(arguments) => fuzz::command(&arguments),
        Command::Attack(Further { further }) => attack::command(&further),
        Command::Gallery => test::of_command("gallery::", &[("UPDATE_EXPECT", "1".to_owned())]),
        Command::Notices => notices::write(),
        Command::Ci(arguments) => ci::command(&arguments),
        Command::Nightly => test::ignored(None).and_then(|()| attack::command(&[])),
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
