//! `cargo xtask python`: builds the Python package as `pip` does, and runs its tests and notebooks.

use crate::clients::{pip_install, python_with};
use crate::workspace::{Failure, program, run, target_folder};

/// Installs the package as a user does, with the locked back end, and tests it.
pub(crate) fn command(further: &[String]) -> Result<(), Failure> {
    let python = python_with("python", "tests/python/requirements.txt")?;
    let mut install = pip_install(&python);
    install.args(["--no-deps", "--no-build-isolation", "--force-reinstall", "./crates/python"]);
    // maturin is found beside the interpreter.
    let beside = target_folder().join("python").join("bin");
    let path = format!("{}:{}", beside.display(), std::env::var("PATH").unwrap_or_default());
    run(install.env("CARGO_TARGET_DIR", target_folder()).env("PATH", path))?;
    let mut tests = program(&python);
    tests.args(["-m", "pytest", "--quiet", "-p", "no:cacheprovider", "tests/python"]);
    run(tests.args(further).env("CARGO_TARGET_DIR", target_folder()))
}
