//! The recipe of the README for showing run logs and Parquet tables as rows in `git diff`, in a temporary
//! repository.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use crate::support::binary::{ends, outcome, succeed, text};
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
fn git_diff_shows_logs_and_tables_as_rows() {
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
    let tables = |log: &Path, name: &str| {
        let tables = folder.path().join(name);
        succeed(&["reduce", text(log), "--out", text(&tables)]);
        tables
    };
    let (before, after) = (tables(&log, "before"), tables(&other, "after"));
    let names = ["events.parquet", "precursors.parquet"];
    for name in names {
        fs::copy(before.join(name), repository.join(name)).expect("there is such a table");
    }
    git(&["add", "."]);
    git(&["commit", "--quiet", "-m", "before"]);
    let events = [succeed(&["events", text(&log)]), succeed(&["events", text(&other)])];
    fs::copy(&other, &log).expect("the log can be replaced");
    for name in names {
        fs::copy(after.join(name), repository.join(name)).expect("there is such a table");
    }

    let diff = git(&["diff", "--unified=0", "--", "run.mcap"]);
    for (sign, own, others) in [('-', &events[0], &events[1]), ('+', &events[1], &events[0])] {
        let expected: Vec<&str> =
            own.lines().filter(|line| !others.lines().any(|other| other == *line)).collect();
        assert!(!expected.is_empty(), "the runs differ");
        assert_eq!(signed(&diff, sign), expected, "{diff}");
    }
    for name in names {
        let diff = git(&["diff", "--unified=0", "--", name]);
        let csv = fs::read_to_string(after.join(name).with_extension("csv")).expect("there is such a table");
        let added = signed(&diff, '+');
        assert!(!added.is_empty(), "{diff}");
        assert!(added.iter().all(|row| csv.lines().any(|line| line == *row)), "{name}: {diff}");
    }
}

#[test]
fn a_parquet_table_is_printed_as_the_csv_beside_it() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("run.mcap");
    let tables = folder.path().join("tables");
    small::run(&log);
    succeed(&["reduce", text(&log), "--out", text(&tables)]);
    for name in ["events", "load", "precursors", "residuals"] {
        let csv = fs::read_to_string(tables.join(format!("{name}.csv"))).expect("there is such a table");
        let parquet = tables.join(format!("{name}.parquet"));
        assert_eq!(succeed(&["events", text(&parquet)]), csv, "{name}");
    }
    let parquet = tables.join("events.parquet");
    ends(2, &["events", text(&parquet), "--format", "json"], &[]);
    // Half a table is an error, not half of its rows.
    let bytes = fs::read(&parquet).expect("the table can be read");
    let half = folder.path().join("half.parquet");
    fs::write(&half, &bytes[..bytes.len() / 2]).expect("the folder can be written");
    let (code, printed, said) = outcome(&["events", text(&half)]);
    assert!(code == 1 && printed.is_empty(), "{code}: {said}");
}
