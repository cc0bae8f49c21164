//! The independent readers of what asperity writes: locked Python packages in
//! an environment of their own under the target folder.

use std::fs;
use std::io;
use std::path::PathBuf;

use crate::workspace::{Failure, program, root, run, target_folder};

/// The lock: every package with its hash.
const REQUIREMENTS: &str = "tests/clients/requirements.txt";

/// Sets the environment up unless it is there, and gives its interpreter.
pub(crate) fn set_up() -> Result<PathBuf, Failure> {
    let folder = target_folder().join("clients");
    let python = folder.join("bin").join("python");
    let stamp = folder.join("installed-requirements.txt");
    let requirements = read(root().join(REQUIREMENTS))?;
    if python.exists() && read(stamp.clone()).is_ok_and(|installed| installed == requirements) {
        return Ok(python);
    }
    match fs::remove_dir_all(&folder) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            return Err(Failure::Io { what: format!("replace {}", folder.display()), error });
        }
        _ => {}
    }
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
    ]))?;
    // Last, so that an installation that broke off is made again.
    fs::write(&stamp, requirements)
        .map_err(|error| Failure::Io { what: format!("write {}", stamp.display()), error })?;
    Ok(python)
}

fn read(path: PathBuf) -> Result<String, Failure> {
    fs::read_to_string(&path).map_err(|error| Failure::Io { what: format!("read {}", path.display()), error })
}
