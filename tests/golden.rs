//! The event tables of Chapter 5 are those that were last reviewed and accepted.
//!
//! The runs are repeated and compared with `fixtures/golden` by `asperity diff`, under its exact
//! policy. The effect of an intended change is accepted by `cargo xtask golden --accept REASON` and
//! in no other way: no variable in the environment makes this test pass.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::binary::{asperity, succeed, text};
use crate::support::golden;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().expect("the workspace is there")
}

/// The pipeline of Chapter 5 with its runs and without its figures.
fn runs_alone() -> String {
    let path = root().join("pipelines/chapter5.toml");
    let text = fs::read_to_string(path).expect("the pipeline is there");
    let mut pipeline: toml::Table = text.parse().expect("it is TOML");
    pipeline.retain(|key, _| matches!(key, "title" | "set" | "run"));
    assert_eq!(pipeline.len(), 3, "the pipeline has a title, overrides of all runs, and runs");
    pipeline.to_string()
}

/// The exit code and output of a diff.
fn diff(old: &Path, new: &Path) -> (Option<i32>, String) {
    let output = asperity(&["diff", text(old), text(new)]);
    let said = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), said(&output.stdout) + &said(&output.stderr))
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("the folder can be written");
    for table in golden::tables(from).expect("the tables can be read") {
        let name = table.file_name().expect("tables have names");
        fs::copy(&table, to.join(name)).expect("the folder can be written");
    }
}

#[test]
fn chapter5_gives_the_golden_tables() {
    let folder = asperity_testkit::folder();
    let pipeline = folder.path().join("runs.toml");
    fs::write(&pipeline, runs_alone()).expect("the folder can be written");
    let out = folder.path().join("out");
    succeed(&["reproduce", text(&pipeline), "--out", text(&out)]);
    let tables = folder.path().join("tables");
    fs::create_dir(&tables).expect("the folder can be written");
    for entry in fs::read_dir(out.join("runs")).expect("there are runs") {
        let log = entry.expect("the folder can be read").path();
        let name = log.file_stem().expect("logs have names").to_string_lossy().into_owned();
        fs::write(tables.join(format!("{name}.csv")), succeed(&["events", text(&log)]))
            .expect("the folder can be written");
    }
    let (code, said) = diff(&root().join(golden::TABLES), &tables);
    assert_eq!(
        code,
        Some(0),
        "the events of chapter 5 are not those of {}\n{said}\n`cargo xtask golden` shows this again, with a \
         page; `cargo xtask golden --accept REASON` accepts it",
        golden::TABLES
    );
}

#[test]
fn tables_are_those_that_were_accepted() {
    let changes = fs::read_to_string(root().join(golden::CHANGES)).expect("the record is there");
    let signature = golden::signature(&root().join(golden::TABLES)).expect("the tables can be read");
    assert_eq!(
        golden::newest(&changes),
        Some(&*signature),
        "{} are not those of the newest entry of {} (accepted: changes by `cargo xtask golden --accept REASON`)",
        golden::TABLES,
        golden::CHANGES
    );
}

/// The last digit of one number of 170,000.
#[test]
fn one_digit_is_seen_and_a_lost_table_too() {
    let folder = asperity_testkit::folder();
    let golden = root().join(golden::TABLES);
    let changed = folder.path().join("changed");
    copy(&golden, &changed);
    assert_eq!(diff(&golden, &changed).0, Some(0));

    let table = changed.join("default.csv");
    let csv = fs::read_to_string(&table).expect("there is a default run");
    let mut lines: Vec<String> = csv.lines().map(ToOwned::to_owned).collect();
    let mut cells: Vec<String> = lines[100].split(',').map(ToOwned::to_owned).collect();
    let column = csv.lines().next().and_then(|header| header.split(',').position(|name| name == "ft_fn_end"));
    let cell = &mut cells[column.expect("tables have that column")];
    let number: f64 = cell.parse().expect("it is a number");
    *cell = number.next_up().to_string();
    lines[100] = cells.join(",");
    fs::write(&table, lines.join("\n") + "\n").expect("the folder can be written");
    let (code, said) = diff(&golden, &changed);
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("default") && said.contains("ft_fn_end"), "{said}");

    copy(&golden, &changed);
    fs::remove_file(&table).expect("it was there");
    let (code, said) = diff(&golden, &changed);
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("default"), "{said}");
}
