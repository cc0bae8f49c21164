//! The independent readers of asperity's files: locked packages of Python and of Node, each set in its own
//! folder under the target folder.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::workspace::{Failure, emptied, io, program, read, root, run, target_folder, write};

/// A set of clients: its name in tests, the variable with its path, and its setup.
pub(crate) struct Clients {
    pub(crate) name: &'static str,
    pub(crate) variable: &'static str,
    /// Returns the value of the variable.
    pub(crate) set_up: fn() -> Result<PathBuf, Failure>,
}

pub(crate) const ALL: [Clients; 2] = [
    Clients { name: "Python", variable: "ASPERITY_CLIENTS", set_up: python },
    Clients { name: "Node", variable: "ASPERITY_NODE_CLIENTS", set_up: node },
];

/// Sets the Python packages up unless they are there, and gives their interpreter.
fn python() -> Result<PathBuf, Failure> {
    python_with("clients", "tests/clients/requirements.txt")
}

/// Sets an environment of Python up unless it is there, with the packages of a lock that has the hash of each, and gives
/// its interpreter.
pub(crate) fn python_with(name: &str, requirements: &str) -> Result<PathBuf, Failure> {
    let folder = target_folder().join(name);
    let python = folder.join("bin").join("python");
    set_up_once(&folder, &root().join(requirements), &python, || {
        run(program("python3").args(["-m", "venv"]).arg(&folder))?;
        run(pip_install(&python).args(["--require-hashes", "-r", requirements]))
    })?;
    Ok(python)
}

/// An installation by pip, which names what failed.
pub(crate) fn pip_install(python: &Path) -> Command {
    let mut pip = program(python);
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
    pip
}

/// Where the Node packages are declared and locked.
const NODE: &str = "tests/clients/node";

/// Sets the Node packages up unless they are there, and gives their folder.
fn node() -> Result<PathBuf, Failure> {
    let folder = target_folder().join("clients-node");
    let modules = folder.join("node_modules");
    let source = root().join(NODE);
    set_up_once(&folder, &source.join("package-lock.json"), &modules, || {
        // Fails here on machines without node, with an error that names it.
        run(program("node").arg("--version").stdout(std::process::Stdio::null()))?;
        for file in ["package.json", "package-lock.json", ".npmrc"] {
            fs::copy(source.join(file), folder.join(file)).map_err(io("fill", &folder))?;
        }
        run(program("npm").args(["ci", "--loglevel", "error"]).current_dir(&folder))
    })?;
    Ok(modules)
}

/// Installs the packages of a lock file into a folder, unless that was done before.
fn set_up_once(
    folder: &Path,
    lock: &Path,
    there: &Path,
    install: impl FnOnce() -> Result<(), Failure>,
) -> Result<(), Failure> {
    let stamp = folder.join("installed.lock");
    let locked = read(lock)?;
    if there.exists() && read(&stamp).is_ok_and(|installed| installed == locked) {
        return Ok(());
    }
    emptied(folder)?;
    install()?;
    // Last, so that an interrupted installation is repeated.
    write(&stamp, &locked)
}
