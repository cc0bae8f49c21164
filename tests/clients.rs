//! Programs of other people read what asperity writes: the `mcap` and `polars`
//! packages of Python, and `rerun mcap check`.
//!
//! `cargo xtask test` sets them up and says where they are. Without it these
//! tests skip, and say so; with `ASPERITY_NO_SKIPS=1` they fail instead.

#[path = "support/binary.rs"]
mod binary;
#[path = "support/small.rs"]
mod small;

use std::env;
use std::ffi::OsStr;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use binary::{succeed, text};

/// The interpreter of the environment with the clients, unless the test skips.
fn python() -> Option<PathBuf> {
    let reason = match env::var_os("ASPERITY_CLIENTS").map(PathBuf::from) {
        Some(python) if python.exists() => return Some(python),
        Some(python) => format!("ASPERITY_CLIENTS is {}, which is not there", python.display()),
        None => "ASPERITY_CLIENTS is not set; `cargo xtask test` sets it".to_owned(),
    };
    let no_skips = env::var_os("ASPERITY_NO_SKIPS").is_some_and(|value| value == "1");
    assert!(!no_skips, "clients must not be skipped: {reason}");
    // Not eprintln, which the test harness captures: a skip must be seen.
    writeln!(std::io::stderr(), "SKIPPED clients: {reason}").expect("stderr can be written");
    None
}

#[test]
fn python_reads_logs_and_tables() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let log = folder.path().join("run.mcap");
    let tables = folder.path().join("tables");
    small::run(&log);
    succeed(&["reduce", text(&log), "--out", text(&tables)]);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/clients/check.py");
    let output = Command::new(python)
        .args([script.as_path(), &log, &tables])
        .output()
        .expect("the interpreter starts");
    assert!(output.status.success(), "{}", said(&output));
}

#[test]
fn rerun_accepts_whole_logs_only() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let log = folder.path().join("run.mcap");
    small::run(&log);
    let truncated = folder.path().join("truncated.mcap");
    let bytes = fs::read(&log).expect("the log can be read");
    fs::write(&truncated, &bytes[..bytes.len() / 2]).expect("the folder can be written");

    // Its settings go into the temporary folder: the user's are none of our
    // business, and there it can be told not to call home.
    let rerun = |arguments: &[&OsStr]| {
        Command::new(python.with_file_name("rerun"))
            .args(arguments)
            .env("XDG_CONFIG_HOME", folder.path().join("config"))
            .env("XDG_DATA_HOME", folder.path().join("data"))
            .env("XDG_CACHE_HOME", folder.path().join("cache"))
            .output()
            .expect("rerun starts")
    };
    let quiet = rerun(&["analytics".as_ref(), "disable".as_ref()]);
    assert!(quiet.status.success(), "{}", said(&quiet));
    let check = |log: &Path| rerun(&["mcap".as_ref(), "check".as_ref(), log.as_ref()]);
    let good = check(&log);
    assert!(good.status.success(), "{}", said(&good));
    let bad = check(&truncated);
    assert!(bad.status.code().is_some_and(|code| code != 0), "{}", said(&bad));
}

fn said(output: &Output) -> String {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    format!("{}\n{}\n{}", output.status, text(&output.stdout), text(&output.stderr))
}
