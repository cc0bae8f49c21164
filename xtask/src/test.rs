//! `cargo xtask test`: all tests, with the clients of the run log at hand.

use std::fs;
use std::panic::resume_unwind;
use std::path::PathBuf;
use std::thread;
use std::time::Instant;

use clap::Args;

use crate::clients;
use crate::say::say;
use crate::schedule::{Job, Program, programs, run_all};
use crate::workspace::{Failure, cargo, output, root, run, target_folder};

#[derive(Debug, Default, Args)]
#[command(after_help = "\
Examples:
  cargo xtask test
  cargo xtask test --test root clients:: -- --nocapture

Without arguments, tests run on all cores, and failures are shown at the end.
Any arguments are passed to cargo test, which then runs the tests.

Without python3, or node and npm, or their packages, the tests of those clients
are skipped, and without Chromium those of the page that asperity diff writes.
A skipped test prints a note; with ASPERITY_NO_SKIPS=1 in the environment it
fails instead. Ignored tests, which take long and rarely fail, are run by
cargo xtask nightly, and those in modules named in_ci by cargo xtask ci too.")]
pub(crate) struct TestArguments {
    /// Arguments for cargo test.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "ARGUMENTS")]
    further: Vec<String>,
}

/// Libraries that are optimised but whose unit tests are not: optimising takes longer than those tests.
/// Each is compiled by a separate call, so that its dependencies stay optimised.
const LIGHT: [&str; 5] =
    ["asperity-tables", "asperity-diff", "asperity-model", "asperity-run", "asperity-runlog"];

/// The longest jobs, so that no core runs one alone at the end.
const FIRST: [&str; 17] = [
    EXAMPLES,
    "root print",
    "root resume",
    "root salvage",
    "root bounds",
    "root ruptures",
    "root hostile",
    "root look",
    "root files",
    "root clients",
    "root flips",
    "root reference",
    "root golden",
    "root staging",
    "root first_day",
    "root slurm",
    "root page",
];

/// The same of ignored tests.
const LONGEST: [&str; 3] = [
    "root reference::in_ci::the_plain_solver_gives_the_table_as_coded",
    "root reference::the_plain_solver_gives_the_table_as_stated",
    "root reference::the_plain_solver_gives_the_other_tables",
];

/// The module for Python has no tests in Rust, see `cargo xtask python`.
const ALL_PACKAGES: [&str; 3] = ["--workspace", "--exclude", "asperity-python"];

/// Examples in comments, which cargo compiles and runs.
const EXAMPLES: &str = "examples";

pub(crate) fn command(arguments: &TestArguments) -> Result<(), Failure> {
    if !arguments.further.is_empty() {
        let variables = variables();
        let mut tests = cargo(&["test", "--locked"]);
        tests.args(ALL_PACKAGES);
        tests.args(&arguments.further);
        for (name, value) in &variables {
            match value {
                Some(value) => tests.env(name, value),
                None => tests.env_remove(name),
            };
        }
        return run(&mut tests);
    }
    let started = Instant::now();
    // Clients are set up meanwhile, with the other core: that takes as long as compiling these tests.
    let (variables, root) = thread::scope(|scope| {
        let variables = scope.spawn(variables);
        let root = root_tests();
        (variables.join().unwrap_or_else(|panic| resume_unwind(panic)), root)
    });
    run_all(started, &FIRST, &variables, |add| {
        compile(root?, |program| {
            add(Job::all_of(program)?);
            Ok(())
        })?;
        let mut examples = cargo(&["test", "--doc", "--locked", "--quiet"]);
        add(vec![Job::call(EXAMPLES, examples.args(ALL_PACKAGES))]);
        Ok(())
    })
}

/// Runs tests that are ignored otherwise: all, or those in modules with that name.
pub(crate) fn ignored(module: Option<&str>) -> Result<(), Failure> {
    run_all(Instant::now(), &LONGEST, &variables(), |add| {
        let mut jobs = Vec::new();
        compile(root_tests()?, |program| {
            jobs.extend(Job::ignored(program, module)?);
            Ok(())
        })?;
        if jobs.is_empty() {
            return Err(Failure::Check("no program has an ignored test to run".to_owned()));
        }
        add(jobs);
        Ok(())
    })
}

/// Hands over every test program, as soon as it is compiled; those that call the command are.
fn compile(
    root: Vec<Program>,
    mut hand_over: impl FnMut(&Program) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let mut hand_over = |programs: Vec<Program>| programs.iter().try_for_each(&mut hand_over);
    hand_over(root)?;
    for package in LIGHT {
        let opt_level = format!("--config=profile.dev.package.{package}.opt-level=0");
        hand_over(of_packages(&[package], &[opt_level, "--lib".to_owned()])?)?;
    }
    // The command is among all packages, see `of_packages`, but not the tests `root`.
    let mut units = cargo(&["test", "--no-run", "--locked", MESSAGES]);
    units.args(ALL_PACKAGES).args(["--lib", "--bins"]);
    units.args(LIGHT.iter().flat_map(|package| ["--exclude", package]));
    hand_over(programs(&output(&mut units)?))?;
    let mut others = cargo(&["test", "--no-run", "--locked", MESSAGES, "--examples"]);
    others.args(ALL_PACKAGES).args(tests_of_crates()?.iter().flat_map(|name| ["--test", name]));
    hand_over(programs(&output(&mut others)?))
}

/// Makes cargo report its artefacts in JSON, and other messages as usual.
const MESSAGES: &str = "--message-format=json-render-diagnostics";

/// The package of the command and of the tests that call it.
const COMMAND: &str = "asperity-cli";

/// Compiles the tests that call the command.
fn root_tests() -> Result<Vec<Program>, Failure> {
    of_packages(&[], &["--test=root".to_owned()])
}

/// The names of all tests in folders `tests` of crates.
fn tests_of_crates() -> Result<Vec<String>, Failure> {
    let crates = root().join("crates");
    let failed = |error| Failure::Io { what: format!("read {}", crates.display()), error };
    let mut names = Vec::new();
    for package in fs::read_dir(&crates).map_err(failed)? {
        let folder = package.map_err(failed)?.path().join("tests");
        if folder.is_dir() {
            for file in fs::read_dir(folder).map_err(failed)? {
                let path = file.map_err(failed)?.path();
                let is_file = path.extension().is_some_and(|extension| extension == "rs");
                let is_program = is_file || path.join("main.rs").is_file();
                names.extend(path.file_stem().filter(|_| is_program).map(|name| name.display().to_string()));
            }
        }
    }
    names.sort();
    names.dedup();
    Ok(names)
}

/// Compiles tests of packages. The command is named as well: with less, cargo would give dependencies fewer
/// features, and compile them and all that uses them once more.
fn of_packages(packages: &[&str], arguments: &[String]) -> Result<Vec<Program>, Failure> {
    let mut build = cargo(&["test", "--no-run", "--locked", MESSAGES]);
    build.args(packages.iter().chain([&COMMAND]).flat_map(|package| ["--package", package]));
    Ok(programs(&output(build.args(arguments))?))
}

/// Passes to tests the target folder of cargo and the paths of the clients, which are set up if missing.
fn variables() -> Vec<(&'static str, Option<PathBuf>)> {
    let set_up = |clients: &clients::Clients| {
        let found = (clients.set_up)().inspect_err(|failure| {
            say!("warning: no {} clients, tests go on without them: {failure}", clients.name);
        });
        (clients.variable, found.ok())
    };
    let target = ("CARGO_TARGET_DIR", Some(target_folder()));
    clients::ALL.iter().map(set_up).chain([target]).collect()
}
