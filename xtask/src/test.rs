//! `cargo xtask test`: all tests, those of each library at the level of optimisation at which they are done first.

use std::path::{Path, PathBuf};
use std::process::Command;

use tempfile::TempDir;

use crate::clients;
use crate::say::say;
use crate::workspace::{Failure, cargo, output, program, run};

/// Libraries whose unit tests are not optimised, since that takes longer than those tests. Each is compiled by a
/// separate call, so that its dependencies stay optimised. A library whose tests use asperity-testkit, and which that uses,
/// is not among them: cargo would compile it at both levels, and all between the two.
const LIGHT: [&str; 5] =
    ["asperity-tables", "asperity-diff", "asperity-model", "asperity-report", "asperity-run"];

/// The module for Python has no tests in Rust, see `cargo xtask python`.
const ALL_PACKAGES: [&str; 3] = ["--workspace", "--exclude", "asperity-python"];

/// The package of the command.
const COMMAND: &str = "asperity-cli";

pub(crate) fn command(further: &[String]) -> Result<(), Failure> {
    if further.is_empty() {
        return all(&["--quiet"], &[]);
    }
    run(cargo(&["test", "--locked"]).args(ALL_PACKAGES).args(further))
}

/// Runs tests that are ignored otherwise: all, or those in modules with that name.
pub(crate) fn ignored(module: Option<&str>) -> Result<(), Failure> {
    let filter = module.map(|module| format!("{module}::"));
    let options: Vec<&str> = ["--ignored"].into_iter().chain(filter.as_deref()).collect();
    let mut variables = Vec::new();
    for clients in clients::ALL {
        match (clients.set_up)() {
            Ok(path) => variables.push((clients.variable, path)),
            Err(failure) => say!("warning: no {} clients, tests go on without them: {failure}", clients.name),
        }
    }
    all(&options, &variables)
}

/// Runs some ignored tests of the command, with variables of the environment.
pub(crate) fn of_command(filter: &str, variables: &[(&str, String)]) -> Result<(), Failure> {
    let test = ["test", "--locked", "-p", COMMAND, "--test", "root", "--", "--ignored", filter];
    run(cargo(&test).envs(variables.iter().cloned()))
}

/// Runs all tests with these options, whether or not some fail.
fn all(options: &[&str], variables: &[(&str, PathBuf)]) -> Result<(), Failure> {
    let memory = in_memory();
    let temporary = memory.as_ref().map(|folder| ("TMPDIR", folder.path()));
    let mut failed = Ok(());
    for mut call in calls() {
        call.arg("--").args(options).envs(variables.iter().cloned()).envs(temporary);
        failed = failed.and(run(&mut call));
    }
    failed
}

/// A folder for temporary files in memory, if 4 GiB of it are free: commands have each file written to the disk before they
/// go on, and tests write ten thousand files.
fn in_memory() -> Option<TempDir> {
    const NEEDED_KIB: u64 = 4 << 20;
    let shared = Path::new("/dev/shm");
    if !shared.is_dir() {
        return None;
    }
    let free = output(program("df").args(["-P", "-k"]).arg(shared)).ok()?;
    let free_kib: u64 = free.lines().nth(1)?.split_whitespace().nth(3)?.parse().ok()?;
    if free_kib < NEEDED_KIB { None } else { tempfile::tempdir_in(shared).ok() }
}

fn calls() -> Vec<Command> {
    let test = || cargo(&["test", "--locked", "--no-fail-fast"]);
    // With the command: for a library alone, cargo would give dependencies fewer features, and compile them and all that
    // uses them once more.
    let mut calls = Vec::from(LIGHT.map(|package| {
        let mut call = test();
        call.args(["--package", COMMAND, "--package", package, "--lib"]);
        call.arg(format!("--config=profile.dev.package.{package}.opt-level=0"));
        call
    }));
    let all = || {
        let mut call = test();
        call.args(ALL_PACKAGES);
        call
    };
    let mut units = all();
    units.arg("--lib").args(LIGHT.iter().flat_map(|package| ["--exclude", *package]));
    let mut programs = all();
    programs.args(["--bins", "--examples", "--test", "*"]);
    let mut examples = all();
    examples.arg("--doc");
    calls.extend([units, programs, examples]);
    calls
}
