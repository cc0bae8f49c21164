//! `cargo xtask python`: builds the Python package as `pip` does, and runs its tests and notebooks.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::clients::{pip_install, python_with};
use crate::workspace::{Failure, emptied, entries, program, run, target_folder};

/// Tests the installed package, and the wheel that it comes from as a registry would.
pub(crate) fn command(further: &[String]) -> Result<(), Failure> {
    let python = installed()?;
    run(with(&python).args(["-m", "twine", "--no-color", "check", "--strict"]).args(entries(&wheels())?))?;
    let tests = ["-m", "pytest", "--quiet", "-p", "no:cacheprovider", "tests/python"];
    run(with(&python).args(tests).args(further))
}

/// Installs the package as a user does, with the locked back end, and gives its interpreter.
pub(crate) fn installed() -> Result<PathBuf, Failure> {
    let python = python_with("python", "tests/python/requirements.txt")?;
    emptied(&wheels())?;
    let build =
        ["-m", "pip", "wheel", "--quiet", "--disable-pip-version-check", "--no-deps", "--no-build-isolation"];
    run(with(&python).args(build).args(["./crates/python", "--wheel-dir"]).arg(wheels()))?;
    run(pip_install(&python).args(["--no-deps", "--force-reinstall"]).args(entries(&wheels())?))?;
    Ok(python)
}

/// The folder of the wheel.
fn wheels() -> PathBuf {
    target_folder().join("wheels")
}

/// An interpreter that finds the programs beside it, such as maturin and the command.
pub(crate) fn with(python: &Path) -> Command {
    let beside = python.parent().unwrap_or(python).display();
    let path = format!("{beside}:{}", std::env::var("PATH").unwrap_or_default());
    let mut command = program(python);
    command.env("CARGO_TARGET_DIR", target_folder()).env("PATH", path);
    command
}
