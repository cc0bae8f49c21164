//! `cargo xtask ci`: what a change must pass, stage by stage.

use std::time::{Duration, Instant};

use clap::Args;

use crate::attack::{self, AttackArguments};
use crate::say::say;
use crate::test::{self, TestArguments};
use crate::workspace::{Failure, cargo, output, run};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  cargo xtask ci
  ASPERITY_NO_SKIPS=1 cargo xtask ci

The stages run in order, the quick ones first, and the first failure ends it.
What each of them took is listed at the end. With ASPERITY_NO_SKIPS=1, a skipped
test is a failure.")]
pub(crate) struct CiArguments {}

type Stage = (&'static str, fn() -> Result<(), Failure>);

const STAGES: [Stage; 7] = [
    ("format", format),
    ("lint", lint),
    ("without analysis", without_analysis),
    ("test", test),
    ("long tests", long_tests),
    ("doc", doc),
    ("attack", attack),
];

pub(crate) fn command(_arguments: &CiArguments) -> Result<(), Failure> {
    let begun = Instant::now();
    let mut times = Vec::new();
    let mut outcome = Ok(());
    for (name, stage) in STAGES {
        say!("==> {name}");
        let started = Instant::now();
        outcome = stage();
        let time = took(started.elapsed());
        match &outcome {
            Ok(()) => say!("==> {name}: passed in {time}"),
            Err(_) => say!("==> {name}: failed after {time}"),
        }
        times.push(format!("{name} {time}"));
        if outcome.is_err() {
            break;
        }
    }
    say!("==> {}; in all {}", times.join(", "), took(begun.elapsed()));
    outcome
}

fn took(time: Duration) -> String {
    let seconds = time.as_secs();
    match seconds / 60 {
        0 => format!("{:.1} s", time.as_secs_f64()),
        minutes => format!("{minutes} min {} s", seconds % 60),
    }
}

fn format() -> Result<(), Failure> {
    run(&mut cargo(&["fmt", "--all", "--check"]))
}

/// Warnings are denied here and not by RUSTFLAGS, which would rebuild every
/// dependency.
fn lint() -> Result<(), Failure> {
    run(&mut cargo(&["clippy", "--workspace", "--all-targets", "--locked", "--", "-D", "warnings"]))
}

/// Simulating, detecting and replaying build without the heavy dependencies of
/// tables and figures.
fn without_analysis() -> Result<(), Failure> {
    const PACKAGE: [&str; 4] = ["--package", "asperity-cli", "--no-default-features", "--locked"];
    const HEAVY: [&str; 2] = ["polars", "plotters"];
    let tree = output(cargo(&["tree", "--edges", "normal", "--prefix", "none"]).args(PACKAGE))?;
    let heavy = tree.lines().find(|line| HEAVY.iter().any(|name| line.starts_with(name)));
    if let Some(package) = heavy {
        return Err(Failure::Check(format!(
            "asperity-cli depends on {package} without its default features (accepted: nothing of {})",
            HEAVY.join(", ")
        )));
    }
    run(cargo(&["check"]).args(PACKAGE))
}

fn test() -> Result<(), Failure> {
    test::command(&TestArguments::default())
}

/// Tests that are long and rarely fail, which `cargo xtask test` leaves out.
const LONG_TESTS: [&str; 5] = [
    // Every command on small logs of every scenario and law; of the tests above it is a part.
    "first_day::every_command_on_every_log",
    "reference::the_plain_solver_gives_the_tables",
    "resume::killed_two_hundred_times_a_run_ends_as_if_never_killed",
    "verify::chapter_5_begins_alike_as_coded",
    "verify::chapter_5_begins_alike_as_stated",
];

fn long_tests() -> Result<(), Failure> {
    const TEST: [&str; 6] = ["test", "--package", "asperity-cli", "--test", "root", "--locked"];
    run(cargo(&TEST).args(["--", "--ignored", "--exact", "--nocapture"]).args(LONG_TESTS))
}

fn doc() -> Result<(), Failure> {
    run(cargo(&["doc", "--workspace", "--no-deps", "--locked"]).env("RUSTDOCFLAGS", "-D warnings"))
}

fn attack() -> Result<(), Failure> {
    attack::command(&AttackArguments::of_ci())
}
