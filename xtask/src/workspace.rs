//! Where things are, and running programs there.

use std::env;
use std::ffi::OsString;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};

/// Why a task did not succeed.
#[derive(Debug)]
pub(crate) enum Failure {
    /// A program could not be started, or a file not be handled.
    Io { what: String, error: io::Error },
    /// A program ran and did not succeed.
    Exit { program: String, code: u8 },
    /// Something is not as it must be.
    Check(String),
    /// What a check needs is not here, so nothing is known.
    NotChecked(String),
    /// Two things cannot be compared; a comparison that found differences exits with 1.
    CannotCompare(String),
    /// A signal ended it; with the code to exit with.
    Interrupted(u8),
}

impl Failure {
    /// The exit code for the shell.
    pub(crate) fn code(&self) -> u8 {
        match self {
            Failure::Io { .. } | Failure::Check(_) | Failure::NotChecked(_) => 1,
            Failure::CannotCompare(_) => 2,
            Failure::Exit { code, .. } | Failure::Interrupted(code) => *code,
        }
    }

    /// The failure of a command that compares, and therefore uses exit code 1 for differences.
    pub(crate) fn of_comparison(self) -> Failure {
        match self {
            interrupted @ Failure::Interrupted(_) => interrupted,
            other => Failure::CannotCompare(other.to_string()),
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Failure::Io { what, error } => write!(f, "failed to {what}: {error}"),
            Failure::Exit { program, code } => write!(f, "{program} exited with code {code}"),
            Failure::Check(problem) | Failure::CannotCompare(problem) => f.write_str(problem),
            Failure::NotChecked(reason) => write!(f, "not checked: {reason}"),
            Failure::Interrupted(_) => f.write_str("interrupted"),
        }
    }
}

/// The workspace's root folder, in which all commands run.
pub(crate) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("xtask lies in the workspace")
}

/// Where cargo builds.
pub(crate) fn target_folder() -> PathBuf {
    match env::var_os("CARGO_TARGET_DIR") {
        // Relative to the folder in which cargo was called, as cargo itself interprets it.
        Some(folder) => std::path::absolute(&folder).unwrap_or_else(|_| folder.into()),
        None => root().join("target"),
    }
}

/// A program, to be run in the root folder.
pub(crate) fn program(name: impl Into<OsString>) -> Command {
    let mut command = Command::new(name.into());
    command.current_dir(root());
    command
}

/// The cargo that runs this task.
pub(crate) fn cargo(arguments: &[&str]) -> Command {
    let mut command = program(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    // Children run elsewhere, so a relative folder would mean another one there.
    command.args(arguments).env("CARGO_TARGET_DIR", target_folder());
    command
}

/// Builds the `asperity` binary, to be run in the root folder.
pub(crate) fn asperity() -> Result<Command, Failure> {
    run(&mut cargo(&["build", "--package", "asperity-cli", "--locked"]))?;
    let name = format!("asperity{}", env::consts::EXE_SUFFIX);
    Ok(program(target_folder().join("debug").join(name)))
}

/// Runs a command to its end; its output goes where ours goes.
pub(crate) fn run(command: &mut Command) -> Result<(), Failure> {
    let status = command.status().map_err(|error| not_started(command, error))?;
    succeeded(command, status)
}

/// Runs a command to its end and returns its standard output.
pub(crate) fn output(command: &mut Command) -> Result<String, Failure> {
    command.stderr(std::process::Stdio::inherit());
    let output = command.output().map_err(|error| not_started(command, error))?;
    succeeded(command, output.status)?;
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// The text of a file; what is not UTF-8 in it is replaced.
pub(crate) fn read(path: &Path) -> Result<String, Failure> {
    let bytes = std::fs::read(path).map_err(|error| io("read", path, error))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// The failure to do something with a file.
pub(crate) fn io(what: &str, path: &Path, error: io::Error) -> Failure {
    Failure::Io { what: format!("{what} {}", path.display()), error }
}

pub(crate) fn not_started(command: &Command, error: io::Error) -> Failure {
    Failure::Io { what: format!("run {}", command.get_program().display()), error }
}

pub(crate) fn succeeded(command: &Command, status: ExitStatus) -> Result<(), Failure> {
    if status.success() {
        return Ok(());
    }
    // A program that a signal ended has no code.
    let code = status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1);
    Err(Failure::Exit { program: command.get_program().display().to_string(), code })
}
