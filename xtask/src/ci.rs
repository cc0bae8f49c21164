//! `cargo xtask ci`: the checks that a change must pass, stage by stage.

use std::time::{Duration, Instant};

use clap::Args;

use crate::advisories::{self, AdvisoriesArguments};
use crate::attack::{self, AttackArguments};
use crate::notices;
use crate::python::{self, PythonArguments};
use crate::say::say;
use crate::test::{self, TestArguments};
use crate::workspace::{Failure, cargo, output, run};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  cargo xtask ci
  ASPERITY_NO_SKIPS=1 cargo xtask ci

The stages run in order, the quick ones first; the first failure ends the
command. The time of each stage is listed at the end. With ASPERITY_NO_SKIPS=1,
a skipped test is a failure. A stage without its data is listed as not checked.")]
pub(crate) struct CiArguments {}

type Stage = (&'static str, fn() -> Result<(), Failure>);

const STAGES: [Stage; 10] = [
    ("format", format),
    ("licences", notices::check),
    ("advisories", || advisories::command(&AdvisoriesArguments {})),
    ("lint", lint),
    ("without analysis", without_analysis),
    ("test", test),
    ("python", python),
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
        let found = stage();
        let (word, result) = judged(found, &took(started.elapsed()));
        say!("==> {name}: {word}");
        times.push(format!("{name} {word}"));
        outcome = result;
        if outcome.is_err() {
            break;
        }
    }
    say!("==> {}; in all {}", times.join(", "), took(begun.elapsed()));
    outcome
}

/// What is said of a stage, and whether it failed. One that lacks its data has neither passed nor failed.
fn judged(found: Result<(), Failure>, time: &str) -> (String, Result<(), Failure>) {
    match found {
        Ok(()) => (format!("passed in {time}"), Ok(())),
        Err(unchecked @ Failure::NotChecked(_)) => (unchecked.to_string(), Ok(())),
        Err(failure) => (format!("failed after {time}"), Err(failure)),
    }
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
    run(&mut cargo(&[
        "clippy",
        "--workspace",
        "--all-targets",
        "--features",
        "xtask/attack",
        "--locked",
        "--",
        "-D",
        "warnings",
    ]))
}

/// Simulating, detecting and replaying build without the heavy dependencies of
/// tables and figures.
fn without_analysis() -> Result<(), Failure> {
    const PACKAGE: [&str; 4] = ["--package", "asperity-cli", "--no-default-features", "--locked"];
    let tree = output(cargo(&["tree", "--edges", "normal", "--prefix", "none"]).args(PACKAGE))?;
    let is_heavy = |line: &&str| line.starts_with("polars") || line.starts_with("plotters");
    if let Some(found) = tree.lines().find(is_heavy) {
        return Err(Failure::Check(format!("without its feature analysis, asperity-cli depends on {found}")));
    }
    run(cargo(&["check"]).args(PACKAGE))
}

fn test() -> Result<(), Failure> {
    test::command(&TestArguments::default())
}

fn python() -> Result<(), Failure> {
    python::command(&PythonArguments::default())
}

/// Ignored tests in modules `in_ci`; `cargo xtask nightly` runs the others as well.
fn long_tests() -> Result<(), Failure> {
    test::ignored(Some("in_ci"))
}

fn doc() -> Result<(), Failure> {
    run(cargo(&["doc", "--workspace", "--no-deps", "--locked"]).env("RUSTDOCFLAGS", "-D warnings"))
}

fn attack() -> Result<(), Failure> {
    attack::command(&AttackArguments::of_ci())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Such a stage was said to have passed.
    #[test]
    fn what_could_not_check_has_not_passed() {
        let of = |found| {
            let (word, result) = judged(found, "1.0 s");
            (word, result.is_ok())
        };
        assert_eq!(of(Ok(())), ("passed in 1.0 s".to_owned(), true));
        let not_checked = Failure::NotChecked("no database".to_owned());
        assert_eq!(of(Err(not_checked)), ("not checked: no database".to_owned(), true));
        assert_eq!(of(Err(Failure::Interrupted(130))), ("failed after 1.0 s".to_owned(), false));
    }
}
