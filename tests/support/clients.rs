//! Programs of other people, where `cargo xtask ci` has set them up.

use std::env;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The path in an environment variable, unless the test skips.
pub(crate) fn find(variable: &str, name: &str) -> Option<PathBuf> {
    let reason = match env::var_os(variable).map(PathBuf::from) {
        Some(path) if path.exists() => return Some(path),
        Some(path) => format!("{variable} is {}, which is not there", path.display()),
        None => format!("{variable} is not set; `cargo xtask ci` sets it"),
    };
    let no_skips = env::var_os("ASPERITY_NO_SKIPS").is_some_and(|value| value == "1");
    assert!(!no_skips, "{name} clients must not be skipped: {reason}");
    // Not eprintln, which the test harness captures: a skip must be seen.
    writeln!(std::io::stderr(), "SKIPPED {name} clients: {reason}").expect("stderr can be written");
    None
}

/// A file of this repository.
pub(crate) fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(name)
}

/// The output of a program and its exit.
pub(crate) fn said(output: &Output) -> String {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    format!("{}\n{}\n{}", output.status, text(&output.stdout), text(&output.stderr))
}

/// The environment of Python with the clients.
pub(crate) struct Python {
    pub(crate) interpreter: PathBuf,
    /// Settings of the clients go here: the user's are none of our business.
    home: tempfile::TempDir,
}

impl Python {
    pub(crate) fn find() -> Option<Python> {
        let interpreter = find("ASPERITY_CLIENTS", "Python")?;
        let python = Python { interpreter, home: asperity_testkit::folder() };
        // rerun is not to call home.
        let quiet = python.program("rerun", &["analytics", "disable"]);
        assert!(quiet.status.success(), "{}", said(&quiet));
        Some(python)
    }

    /// Runs a program of this environment, such as `python`, or one from a package.
    pub(crate) fn program(&self, name: &str, arguments: &[&str]) -> Output {
        let path = self.interpreter.with_file_name(name);
        self.command(&path).args(arguments).output().expect("the program starts")
    }

    /// A program of this environment that keeps its settings to itself.
    pub(crate) fn command(&self, program: &Path) -> Command {
        let mut command = Command::new(program);
        for (variable, folder) in
            [("XDG_CONFIG_HOME", "config"), ("XDG_DATA_HOME", "data"), ("XDG_CACHE_HOME", "cache")]
        {
            command.env(variable, self.home.path().join(folder));
        }
        command.env("PYTHONDONTWRITEBYTECODE", "1");
        command
    }
}
