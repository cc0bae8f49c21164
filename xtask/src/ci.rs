//! `cargo xtask ci`: the checks that a change must pass, stage by stage.

use std::env;
use std::io::{Read, Seek};
use std::path::Path;
use std::time::{Duration, Instant};

use clap::Args;

use crate::say::say;
use crate::workspace::{Failure, cargo, io, program, run, succeeded};
use crate::{attack, book, notices, python, test};

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

const STAGES: [Stage; 10] = [
    ("format", || run(&mut cargo(&["fmt", "--all", "--check"]))),
    ("licences", notices::check),
    ("advisories", || advisories(|arguments| run(cargo(&["deny", "--locked"]).args(arguments)).is_ok())),
    ("test", || test::command(&[])),
    // `cargo xtask nightly` runs the other ignored tests as well.
    ("long-tests", || test::ignored(Some("in_ci"))),
    ("doc", || {
        run(cargo(&["doc", "--workspace", "--no-deps", "--locked"]).env("RUSTDOCFLAGS", "-D warnings"))
    }),
    ("lint", lint),
    ("python", || python::command(&[])),
    ("book", book::command),
    // Equal cases in every call, so that the outcome depends on the program and not on chance.
    ("attack", || attack::command(&["--seed".to_owned(), "1".to_owned()])),
];

/// What keeps one core busy and waits for files and programs in between: beside the tests, which do as well.
const SECOND_ROW: [&str; 3] = ["lint", "python", "book"];

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
    let failed = io("run beside others", Path::new("stages"));
    let mut said = tempfile::tempfile().map_err(&failed)?;
    let mut row = program(env::current_exe().map_err(&failed)?);
    let [out, err] = [said.try_clone().map_err(&failed)?, said.try_clone().map_err(&failed)?];
    let mut child = row.arg("ci").args(stages).stdout(out).stderr(err).spawn().map_err(&failed)?;
    let outcome = others();
    let status = child.wait().map_err(&failed)?;
    let mut text = Vec::new();
    said.rewind().and_then(|()| said.read_to_end(&mut text)).map_err(&failed)?;
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

/// Warnings are denied here and not by RUSTFLAGS, which would rebuild every dependency.
fn lint() -> Result<(), Failure> {
    let clippy = ["clippy", "--workspace", "--all-targets", "--features", "xtask/attack", "--locked"];
    run(cargo(&clippy).args(["--", "-D", "warnings"]))
}

/// What cargo-deny knows of the packages of others, by `deny.toml`; `succeeds` calls it.
fn advisories(succeeds: impl Fn(&[&str]) -> bool) -> Result<(), Failure> {
    let failed = |what: &str| Failure::Check(format!("cargo-deny refuses {what}; it says above what"));
    let unknown = |why: &str| Failure::NotChecked(why.to_owned());
    if !succeeds(&["--version"]) {
        return Err(unknown("cargo-deny is not installed (accepted: `cargo install cargo-deny --locked`)"));
    }
    if !succeeds(&["check", "bans", "licenses", "sources"]) {
        return Err(failed("packages"));
    }
    if !succeeds(&["fetch", "db"]) {
        return Err(unknown("the database of advisories could not be fetched"));
    }
    if succeeds(&["--offline", "check", "advisories"]) {
        Ok(())
    } else {
        Err(failed("packages with known vulnerabilities"))
    }
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
        assert_eq!(of(Err(Failure::Check("x".to_owned()))), ("failed after 1.0 s".to_owned(), false));
        // Without its program or its database, cargo-deny checks nothing.
        let denied = |failing: &str| of(advisories(|arguments| !arguments.contains(&failing)));
        for (failing, word, passes) in [
            ("nothing", "passed in", true),
            ("--version", "not checked: cargo-deny is not installed", true),
            ("fetch", "not checked: the database of advisories could not be fetched", true),
            ("licenses", "failed after", false),
            ("advisories", "failed after", false),
        ] {
            let (said, passed) = denied(failing);
            assert!(said.starts_with(word) && passed == passes, "{failing}: {said}");
        }
    }
}
