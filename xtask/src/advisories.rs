//! `cargo xtask advisories`: what cargo-deny knows of the packages of others, by `deny.toml`.

use std::process::{Command, Stdio};

use clap::Args;

use crate::workspace::{Failure, cargo, run};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  cargo install cargo-deny --locked
  cargo xtask advisories

Licences, sources and duplicates, then known vulnerabilities, whose database is
fetched first. Without cargo-deny or the database, that is not checked, which
is a failure here and a note in `cargo xtask ci`. deny.toml says what is
accepted.")]
pub(crate) struct AdvisoriesArguments {}

pub(crate) fn command(_arguments: &AdvisoriesArguments) -> Result<(), Failure> {
    checked(|arguments| {
        let mut deny = cargo(&["deny", "--locked"]);
        deny.args(arguments);
        deny
    })
}

fn checked(deny: impl Fn(&[&str]) -> Command) -> Result<(), Failure> {
    let succeeds = |command: &mut Command| command.status().is_ok_and(|status| status.success());
    if !succeeds(deny(&["--version"]).stdout(Stdio::null()).stderr(Stdio::null())) {
        return Err(Failure::NotChecked("cargo-deny is not installed".to_owned()));
    }
    run(&mut deny(&["check", "bans", "licenses", "sources"]))?;
    if !succeeds(&mut deny(&["fetch", "db"])) {
        return Err(Failure::NotChecked("the database of advisories could not be fetched".to_owned()));
    }
    run(&mut deny(&["--offline", "check", "advisories"]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A program that succeeds, or fails where the arguments have this word.
    fn ends(failing: &'static str) -> String {
        let outcome = checked(|arguments| {
            let mut program = Command::new(env!("CARGO"));
            let fails = arguments.contains(&failing);
            program.arg(if fails { "--no-such-option" } else { "--version" }).stderr(Stdio::null());
            program
        });
        outcome.err().map_or_else(String::new, |failure| failure.to_string())
    }

    #[test]
    fn what_lacks_its_program_or_its_database_is_not_checked() {
        assert_eq!(ends("nothing"), "");
        assert_eq!(ends("--version"), "not checked: cargo-deny is not installed");
        assert_eq!(ends("fetch"), "not checked: the database of advisories could not be fetched");
        for failing in ["licenses", "advisories"] {
            assert!(ends(failing).ends_with("exited with code 1"), "{}", ends(failing));
        }
    }
}
