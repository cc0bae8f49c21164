//! Where things are, and running programs there.

use std::env;
use std::ffi::OsString;
use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};

/// Why a task did not succeed.
#[derive(Debug)]
pub(crate) enum Failure {
    /// A program ran, did not succeed, and has said why.
    Exit { program: String, code: u8 },
    /// Something is not as it must be.
    Check(String),
    /// What a check needs is not here, so nothing is known.
    NotChecked(String),
    /// Two things cannot be compared; a comparison that found differences exits with 1.
    CannotCompare(String),
}

impl Failure {
    /// The exit code for the shell.
    pub(crate) fn code(&self) -> u8 {
        match self {
            Failure::Check(_) | Failure::NotChecked(_) => 1,
            Failure::CannotCompare(_) => 2,
            Failure::Exit { code, .. } => *code,
        }
    }

    /// The failure of a command that compares, and therefore uses exit code 1 for differences.
    pub(crate) fn of_comparison(self) -> Failure {
        Failure::CannotCompare(self.to_string())
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Failure::Exit { program, code } => write!(f, "{program} exited with code {code}"),
            Failure::Check(problem) | Failure::CannotCompare(problem) => f.write_str(problem),
            Failure::NotChecked(reason) => write!(f, "not checked: {reason}"),
        }
    }
}

/// The failure to do something with a file, for `map_err`.
pub(crate) fn io<'a>(what: &'a str, path: &'a Path) -> impl Fn(io::Error) -> Failure + 'a {
    move |error| Failure::Check(format!("failed to {what} {}: {error}", path.display()))
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
    let status = command.status().map_err(not_started(command))?;
    succeeded(command, status)
}

/// Runs a command to its end and returns its standard output.
pub(crate) fn output(command: &mut Command) -> Result<String, Failure> {
    let output = command.stderr(Stdio::inherit()).output().map_err(not_started(command))?;
    succeeded(command, output.status)?;
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

pub(crate) fn not_started(command: &Command) -> impl Fn(io::Error) -> Failure {
    io("run", Path::new(command.get_program()))
}

pub(crate) fn succeeded(command: &Command, status: ExitStatus) -> Result<(), Failure> {
    if status.success() {
        return Ok(());
    }
    // A program that a signal ended has no code.
    let code = status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1);
    Err(Failure::Exit { program: command.get_program().display().to_string(), code })
}

/// The text of a file; what is not UTF-8 in it is replaced.
pub(crate) fn read(path: &Path) -> Result<String, Failure> {
    let bytes = fs::read(path).map_err(io("read", path))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Writes a file anew.
pub(crate) fn write(path: &Path, text: &str) -> Result<(), Failure> {
    fs::write(path, text).map_err(io("write", path))
}

/// Makes a folder without contents.
pub(crate) fn emptied(folder: &Path) -> Result<(), Failure> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(io("remove", folder)(error)),
        _ => fs::create_dir_all(folder).map_err(io("create", folder)),
    }
}

/// The path of a user, who means the folder in which cargo was called, not the root.
pub(crate) fn absolute(path: &Path) -> Result<PathBuf, Failure> {
    std::path::absolute(path).map_err(io("find", path))
}

/// The entries of a folder, by name.
pub(crate) fn entries(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let entries = fs::read_dir(folder).and_then(|entries| {
        entries.map(|entry| entry.map(|entry| entry.path())).collect::<io::Result<Vec<_>>>()
    });
    let mut entries = entries.map_err(io("read", folder))?;
    entries.sort();
    Ok(entries)
}
