//! `cargo xtask python`: builds the Python package as `pip` does, and runs its tests and notebooks.

use std::path::PathBuf;

use clap::Args;

use crate::clients::set_up_once;
use crate::workspace::{Failure, program, root, run, target_folder};

#[derive(Debug, Default, Args)]
#[command(after_help = "\
Examples:
  cargo xtask python
  cargo xtask python -k field

Sets up an environment with locked packages under the target folder, installs
the package in it and runs tests/python with pytest, which receives any
arguments. cargo xtask ci runs it.")]
pub(crate) struct PythonArguments {
    /// Arguments for pytest.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "ARGUMENTS")]
    further: Vec<String>,
}

/// The lock of the packages that build and test it.
const REQUIREMENTS: &str = "tests/python/requirements.txt";

pub(crate) fn command(arguments: &PythonArguments) -> Result<(), Failure> {
    let python = installed()?;
    let mut tests = program(&python);
    tests.args(["-m", "pytest", "--quiet", "-p", "no:cacheprovider", "tests/python"]);
    run(tests.args(&arguments.further).env("CARGO_TARGET_DIR", target_folder()))
}

/// Installs the package as a user does, with the back end that is locked. Returns its interpreter.
fn installed() -> Result<PathBuf, Failure> {
    let folder = target_folder().join("python");
    let python = folder.join("bin").join("python");
    set_up_once(&folder, &root().join(REQUIREMENTS), &python, || {
        run(program("python3").args(["-m", "venv"]).arg(&folder))?;
        let pip =
            ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--require-hashes", "-r"];
        run(program(&python).args(pip).arg(REQUIREMENTS))
    })?;
    let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"];
    let package = ["--no-build-isolation", "--force-reinstall", "./crates/python"];
    // maturin is found beside the interpreter.
    let path = format!("{}:{}", folder.join("bin").display(), std::env::var("PATH").unwrap_or_default());
    let mut install = program(&python);
    install.args(pip).args(package).env("CARGO_TARGET_DIR", target_folder()).env("PATH", path);
    run(&mut install)?;
    Ok(python)
}
