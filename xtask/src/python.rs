//! `cargo xtask python`: builds the Python package as `pip` does, and runs its tests and notebooks.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::clients::{pip_install, python_with};
use crate::workspace::{Failure, program, run, target_folder};

/// Tests the installed package.
pub(crate) fn command(further: &[String]) -> Result<(), Failure> {
    let python = installed()?;
    let tests = ["-m", "pytest", "--quiet", "-p", "no:cacheprovider", "tests/python"];
    run(with(&python).args(tests).args(further))
}

/// Installs the package as a user does, with the locked back end, and gives its interpreter.
pub(crate) fn installed() -> Result<PathBuf, Failure> {
    let python = python_with("python", "tests/python/requirements.txt")?;
    let options = ["--no-deps", "--no-build-isolation", "--force-reinstall", "./crates/python"];
    run(beside(&mut pip_install(&python), &python).args(options))?;
    Ok(python)
}

/// An interpreter that finds the programs beside it, such as maturin and the command.
pub(crate) fn with(python: &Path) -> Command {
    let mut command = program(python);
    beside(&mut command, python);
    command
}

fn beside<'a>(command: &'a mut Command, python: &Path) -> &'a mut Command {
    let beside = python.parent().unwrap_or(python).display();
    let path = format!("{beside}:{}", std::env::var("PATH").unwrap_or_default());
    command.env("CARGO_TARGET_DIR", target_folder()).env("PATH", path)
}
