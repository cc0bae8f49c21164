//! `cargo xtask ci`: the checks that a change must pass, stage by stage.

use std::env;
use std::io::{Read, Seek};
use std::time::{Duration, Instant};

use clap::Args;

use crate::advisories::{self, AdvisoriesArguments};
use crate::attack::{self, AttackArguments};
use crate::notices;
use crate::python::{self, PythonArguments};
use crate::say::say;
use crate::test::{self, TestArguments};
use crate::workspace::{Failure, cargo, program, run, succeeded};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  cargo xtask ci
  cargo xtask ci lint test
  ASPERITY_NO_SKIPS=1 cargo xtask ci

Without names, stages run in two rows at once, the attack after both, and what
the second row says is printed at its end; with names, one after the other. The
first failure ends a row. The time of each stage is listed at the end. With
ASPERITY_NO_SKIPS=1, a skipped test is a failure. A stage without its data is
listed as not checked.")]
pub(crate) struct CiArguments {
    /// Which stages [default: all].
    #[arg(value_name = "STAGE", value_parser = STAGES.map(|(name, _)| name))]
    stages: Vec<String>,
}

type Stage = (&'static str, fn() -> Result<(), Failure>);

const STAGES: [Stage; 9] = [
    ("format", format),
    ("licences", notices::check),
    ("advisories", || advisories::command(&AdvisoriesArguments {})),
    ("test", test),
    ("long-tests", long_tests),
    ("doc", doc),
    ("lint", lint),
    ("python", python),
    ("attack", attack),
];

/// What keeps one core busy and waits for files and programs in between: beside the tests, which do as well.
const SECOND_ROW: [&str; 2] = ["lint", "python"];

/// What has a time to end in, and is alone.
const AT_LAST: &str = "attack";

pub(crate) fn command(arguments: &CiArguments) -> Result<(), Failure> {
    let begun = Instant::now();
    let mut times = Vec::new();
    let is_named = |name: &str| arguments.stages.iter().any(|wanted| wanted == name);
    let outcome = if arguments.stages.is_empty() {
        beside(&SECOND_ROW, || in_turn(|name| !SECOND_ROW.contains(&name) && name != AT_LAST, &mut times))
            .and_then(|()| in_turn(|name| name == AT_LAST, &mut times))
    } else {
        in_turn(is_named, &mut times)
    };
    say!("==> {}; in all {}", times.join(", "), took(begun.elapsed()));
    outcome
}

/// Runs stages one after the other, up to the first failure.
fn in_turn(is_wanted: impl Fn(&str) -> bool, times: &mut Vec<String>) -> Result<(), Failure> {
    for (name, stage) in STAGES.into_iter().filter(|(name, _)| is_wanted(name)) {
        say!("==> {name}");
        let started = Instant::now();
        let found = stage();
        let (word, result) = judged(found, &took(started.elapsed()));
        say!("==> {name}: {word}");
        times.push(format!("{name} {word}"));
        result?;
    }
    Ok(())
}

/// Runs stages in a process of their own while others run, and prints at the end what it said.
fn beside(stages: &[&str], others: impl FnOnce() -> Result<(), Failure>) -> Result<(), Failure> {
    let failed = |error| Failure::Io { what: "run stages beside others".to_owned(), error };
    let mut said = tempfile::tempfile().map_err(failed)?;
    let mut row = program(env::current_exe().map_err(failed)?);
    let [out, err] = [said.try_clone().map_err(failed)?, said.try_clone().map_err(failed)?];
    let mut child = row.arg("ci").args(stages).stdout(out).stderr(err).spawn().map_err(failed)?;
    let outcome = others();
    let status = child.wait().map_err(failed)?;
    let mut text = Vec::new();
    said.rewind().and_then(|()| said.read_to_end(&mut text)).map_err(failed)?;
    say!("{}", String::from_utf8_lossy(&text).trim_end());
    outcome.and(succeeded(&row, status))
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
