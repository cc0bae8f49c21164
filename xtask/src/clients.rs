//! The independent readers of asperity's files: locked packages of Python and of Node, each set in its own
//! folder under the target folder.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::workspace::{Failure, program, root, run, target_folder};

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

/// The lock: every package with its hash.
const REQUIREMENTS: &str = "tests/clients/requirements.txt";

/// Sets the Python packages up unless they are there, and gives their interpreter.
fn python() -> Result<PathBuf, Failure> {
    let folder = target_folder().join("clients");
    let python = folder.join("bin").join("python");
    set_up_once(&folder, &root().join(REQUIREMENTS), &python, || {
        run(program("python3").args(["-m", "venv"]).arg(&folder))?;
        run(program(&python).args([
            "-m",
            "pip",
            "install",
            "--quiet",
            "--disable-pip-version-check",
            "--require-hashes",
            "-r",
            REQUIREMENTS,
        ]))
    })?;
    Ok(python)
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
        let failed = |error| Failure::Io { what: format!("fill {}", folder.display()), error };
        fs::create_dir_all(&folder).map_err(failed)?;
        for file in ["package.json", "package-lock.json", ".npmrc"] {
            fs::copy(source.join(file), folder.join(file)).map_err(failed)?;
        }
        run(program("npm").args(["ci", "--loglevel", "error"]).current_dir(&folder))
    })?;
    Ok(modules)
}

/// Installs the packages of a lock file into a folder, unless that was done before.
pub(crate) fn set_up_once(
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
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            return Err(Failure::Io { what: format!("replace {}", folder.display()), error });
        }
        _ => {}
    }
    install()?;
    // Last, so that an interrupted installation is repeated.
    fs::write(&stamp, locked)
        .map_err(|error| Failure::Io { what: format!("write {}", stamp.display()), error })
}

fn read(path: &Path) -> Result<String, Failure> {
    fs::read_to_string(path).map_err(|error| Failure::Io { what: format!("read {}", path.display()), error })
}
