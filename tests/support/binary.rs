//! Running the built `asperity` binary.

use std::path::Path;
use std::process::{Command, Output};

/// Runs the binary to its end.
pub(crate) fn asperity(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_asperity")).args(arguments).output().expect("the binary starts")
}

/// Runs the binary to its end, which must be a good one, and gives its standard output.
pub(crate) fn succeed(arguments: &[&str]) -> String {
    let output = asperity(arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "asperity {}: {}\n{stderr}", arguments.join(" "), output.status);
    String::from_utf8(output.stdout).expect("the binary writes UTF-8")
}

/// Runs a scenario, given with its overrides, and logs it.
pub(crate) fn run(scenario: &[&str], out: &Path) {
    let arguments = [&["run"], scenario, &["--out", text(out)]].concat();
    succeed(&arguments);
}

/// A path as an argument.
pub(crate) fn text(path: &Path) -> &str {
    path.to_str().expect("temporary folders have plain names")
}
