//! The recipe of the README for showing run logs as rows in `git diff`, in a temporary repository; and Parquet tables
//! beside their CSV.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use crate::support::binary::{outcome, succeed, text};
use crate::support::parquet::csv_of;
use crate::support::{binary, small};

/// The lines of a diff that begin with a sign, without those that name files.
fn signed(diff: &str, sign: char) -> Vec<&str> {
    let header = String::from(sign).repeat(3);
    diff.lines()
        .filter(|line| line.starts_with(sign) && !line.starts_with(&header))
        .map(|line| &line[1..])
        .collect()
}

fn git(folder: &Path, arguments: &[&str]) -> Output {
    // Settings of the user, such as a pager or another diff, are left out.
    let output = Command::new("git")
        .args(arguments)
        .current_dir(folder)
        .env("GIT_CONFIG_GLOBAL", "/dev/null")
        .env("GIT_CONFIG_SYSTEM", "/dev/null")
        .env_remove("GIT_DIR")
        .env_remove("GIT_INDEX_FILE")
        .output()
        .expect("git starts");
    assert!(output.status.success(), "git {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

#[test]
fn git_diff_shows_logs_as_rows() {
    let folder = asperity_testkit::folder();
    let repository = folder.path().join("repository");
    fs::create_dir(&repository).expect("the folder can be written");
    let git = |arguments: &[&str]| {
        String::from_utf8(git(&repository, arguments).stdout).expect("git writes what it was given")
    };
    git(&["init", "--quiet"]);
    git(&["config", "user.name", "A"]);
    git(&["config", "user.email", "a@example.org"]);
    // The attributes of this project, and the recipe with the binary under test.
    let attributes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../.gitattributes");
    fs::copy(attributes, repository.join(".gitattributes")).expect("the project has attributes");
    let recipe = format!("'{}' events", env!("CARGO_BIN_EXE_asperity"));
    git(&["config", "diff.asperity.textconv", &recipe]);

    let log = repository.join("run.mcap");
    let other = folder.path().join("other.mcap");
    small::run(&log);
    binary::run(&[&small::SCENARIO[..], &["--set", "normal_load.tilt=0.1"]].concat(), &other);
    git(&["add", "."]);
    git(&["commit", "--quiet", "-m", "before"]);
    let events = [succeed(&["events", text(&log)]), succeed(&["events", text(&other)])];
    fs::copy(&other, &log).expect("the log can be replaced");

    let diff = git(&["diff", "--unified=0", "--", "run.mcap"]);
    for (sign, own, others) in [('-', &events[0], &events[1]), ('+', &events[1], &events[0])] {
        let expected: Vec<&str> =
            own.lines().filter(|line| !others.lines().any(|other| other == *line)).collect();
        assert!(!expected.is_empty(), "the runs differ");
        assert_eq!(signed(&diff, sign), expected, "{diff}");
    }
}

#[test]
fn a_parquet_table_is_the_csv_beside_it_and_no_log() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("run.mcap");
    let tables = folder.path().join("tables");
    small::run(&log);
    succeed(&["reduce", text(&log), "--out", text(&tables)]);
    for name in ["events", "load", "precursors", "residuals"] {
        let csv = fs::read_to_string(tables.join(format!("{name}.csv"))).expect("there is such a table");
        assert_eq!(csv_of(&tables.join(format!("{name}.parquet"))), csv, "{name}");
    }
    let (_, printed, said) = outcome(&["events", text(&tables.join("events.parquet"))]);
    assert!(printed.is_empty() && said.contains("which is written for other programs"), "{said}");
}
