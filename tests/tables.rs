//! Tables of ruptures, beside those of slip events: the output of `reduce` for runs with misleading slip
//! events, and for logs from before there were ruptures.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::support::binary::{ends, run, succeed, text};
use crate::support::parquet::csv_of;
use crate::support::small;
use asperity_testkit::folder;

/// A table as CSV: its heading, and its rows as cells.
struct Table {
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    fn read(path: &Path) -> Table {
        let content = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let mut lines = content.lines().map(|line| line.split(',').map(ToOwned::to_owned).collect());
        Table { columns: lines.next().expect("a heading"), rows: lines.collect() }
    }

    fn place(&self, column: &str) -> usize {
        let place = self.columns.iter().position(|name| name == column);
        place.unwrap_or_else(|| panic!("there is no column {column} in {:?}", self.columns))
    }

    fn column(&self, column: &str) -> Vec<&str> {
        let place = self.place(column);
        self.rows.iter().map(|row| row[place].as_str()).collect()
    }

    fn numbers(&self, column: &str) -> Vec<f64> {
        self.column(column).into_iter().map(|cell| cell.parse().expect("a number")).collect()
    }
}

/// Reduces a log; returns the folder of tables and its stderr.
fn reduce(log: &Path, code: i32) -> (PathBuf, String) {
    let out = log.with_extension("tables");
    let said = ends(code, &["reduce", text(log), "--out", text(&out)], &[]);
    (out, said)
}

/// Precursors as defined on the page, computed from the table of ruptures: number, last block, and whether
/// it is the slip of the whole slider.
fn precursors_of(ruptures: &Table) -> Vec<(String, u32, bool)> {
    let [number, onset, first, last, every] =
        ["rupture", "onset_step", "first_block", "last_block", "reached_every_block"]
            .map(|column| ruptures.place(column));
    let mut rows: Vec<&Vec<String>> = ruptures.rows.iter().collect();
    rows.sort_by_key(|row| row[onset].parse::<u64>().expect("a step"));
    let mut longest = 0;
    let mut found = Vec::new();
    for row in rows {
        let reach: u32 = row[last].parse().expect("a block");
        if row[first] == "1" && reach > longest {
            longest = reach;
            found.push((row[number].clone(), reach, row[every] == "true"));
        }
    }
    found
}

fn check_precursors(tables: &Path) -> Vec<(String, u32, bool)> {
    let ruptures = Table::read(&tables.join("ruptures.csv"));
    let precursors = Table::read(&tables.join("precursor-ruptures.csv"));
    let expected = precursors_of(&ruptures);
    let told: Vec<(String, u32, bool)> = precursors
        .rows
        .iter()
        .map(|row| {
            let cell = |column| row[precursors.place(column)].clone();
            let last_block = cell("last_block").parse().expect("a block");
            (cell("rupture"), last_block, cell("reached_every_block") == "true")
        })
        .collect();
    assert_eq!(told, expected);
    // The summary counts them, without the slip of the whole slider.
    let summary = fs::read(tables.join("summary.json")).expect("it is there");
    let summary: serde_json::Value = serde_json::from_slice(&summary).expect("it is JSON");
    let count = expected.iter().filter(|(.., every)| !every).count();
    assert_eq!(summary["precursor_count"], count);
    let residuals = precursors.numbers("ft_fn").into_iter().zip(precursors.numbers("ft_fn_law"));
    for (residual, (load, law)) in precursors.numbers("residual").into_iter().zip(residuals) {
        assert_eq!(residual, load - law);
    }
    expected
}

/// Between a creeping slider's first slip and the slip of the whole slider lie 2.75 s, which are
/// one slip event.
#[test]
fn of_a_slider_that_creeps_the_first_global_slip_is_that_of_the_ruptures() {
    let folder = folder();
    let log = folder.path().join("creep.mcap");
    let set = [
        "time.step_s=2e-7",
        "time.duration_s=2.9",
        "friction.static_coefficient=0.5",
        "friction.dynamic_coefficient=0.45",
        "normal_load.tilt=-0.8",
    ];
    let set = set.map(|pair| ["--set", pair]);
    run(&[&["default"], &set.concat()[..]].concat(), &log);
    let (tables, said) = reduce(&log, 0);
    assert!(said.contains("creep.mcap: the slider creeps: "), "{said}");

    let events = Table::read(&tables.join("events.csv"));
    let global = events.column("blocks_slipped").iter().position(|blocks| *blocks == "100").expect("one");
    // With the creep: at 0.0135 s in steps of 10 ns, at 0.0189 s in these.
    assert!(events.numbers("onset_s")[global] < 0.02, "{:?}", events.rows[global]);
    let precursors = Table::read(&tables.join("precursor-ruptures.csv"));
    let last = precursors.rows.len() - 1;
    assert_eq!(precursors.column("reached_every_block")[last], "true");
    assert!((precursors.numbers("onset_s")[last] - 2.764).abs() < 2e-3, "{:?}", precursors.rows[last]);
    for table in ["ruptures.csv", "precursor-ruptures.csv"] {
        let table = Table::read(&tables.join(table));
        for flag in ["creeps", "events_mislead"] {
            assert!(table.column(flag).iter().all(|cell| *cell == "true"), "{flag}");
        }
    }
    let found = check_precursors(&tables);
    assert_eq!(found.last().map(|(_, reach, every)| (*reach, *every)), Some((100, true)));
}

#[test]
fn in_the_default_slider_slip_events_tell_what_ruptures_do() {
    let folder = folder();
    let log = folder.path().join("default.mcap");
    run(&["default", "--set", "time.step_s=1e-7", "--set", "time.duration_s=2.8"], &log);
    let (tables, said) = reduce(&log, 0);
    assert!(!said.contains("creeps") && !said.contains("mislead"), "{said}");
    let found = check_precursors(&tables);
    assert!(found.len() > 20 && found.last().is_some_and(|last| last.2), "{found:?}");
    // The table of slip events has the same lengths, except for differences below dt.
    let raw = Table::read(&tables.join("precursors.csv"));
    let lengths = |numbers: Vec<f64>| numbers.into_iter().map(f64::to_bits).collect::<BTreeSet<u64>>();
    let ruptures = Table::read(&tables.join("precursor-ruptures.csv"));
    assert_eq!(lengths(raw.numbers("lp_l")), lengths(ruptures.numbers("lp_l")));
    for flag in ["creeps", "events_mislead"] {
        assert!(ruptures.column(flag).iter().all(|cell| *cell == "false"), "{flag}");
    }
    // Parquet contains the same table.
    for name in ["ruptures", "precursor-ruptures"] {
        let csv = fs::read_to_string(tables.join(format!("{name}.csv"))).expect("it is there");
        assert_eq!(csv_of(&tables.join(format!("{name}.parquet"))), csv, "{name}");
    }
    // And the table of a replay has the same rows.
    let replayed = folder.path().join("replayed");
    succeed(&["replay", text(&log), "--out", text(&replayed)]);
    check_rows_of_replay(&replayed.join("default.ruptures.csv"), &tables);
}

/// The table of ruptures of a replay is that of `reduce` without its last columns.
fn check_rows_of_replay(replayed: &Path, tables: &Path) {
    let (replayed, reduced) = (Table::read(replayed), Table::read(&tables.join("ruptures.csv")));
    let more = ["event", "creeps", "events_mislead"];
    assert_eq!([&replayed.columns[..], &more.map(str::to_owned)].concat(), reduced.columns);
    assert!(!replayed.rows.is_empty() && replayed.rows.len() == reduced.rows.len());
    for (one, other) in replayed.rows.iter().zip(&reduced.rows) {
        for (one, other) in one.iter().zip(other) {
            // Small numbers are spelled with an exponent by one of the two.
            let are_one_number = one.parse::<f64>().is_ok_and(|one| Ok(one) == other.parse());
            assert!(one == other || are_one_number, "{one} and {other}");
        }
    }
}

#[test]
fn of_a_slider_driven_from_both_ends_a_slip_event_holds_several_ruptures() {
    let folder = folder();
    let log = folder.path().join("both.mcap");
    run(&["left-right-driven", "--set", "time.step_s=1e-7", "--set", "time.duration_s=4"], &log);
    let (tables, said) = reduce(&log, 0);
    assert!(said.contains("both.mcap: slip events mislead: "), "{said}");
    let ruptures = Table::read(&tables.join("ruptures.csv"));
    let events: BTreeSet<&str> = ruptures.column("event").into_iter().collect();
    assert!(events.len() * 4 < ruptures.rows.len() * 3, "{} in {}", ruptures.rows.len(), events.len());
    assert!(ruptures.column("events_mislead").iter().all(|cell| *cell == "true"));
    check_precursors(&tables);
}

#[test]
fn a_pipeline_writes_the_precursors_of_a_run_below_one_law_after_the_other() {
    let folder = folder();
    let pipeline = folder.path().join("pipeline.toml");
    let toml = "title = \"one run, two laws\"\n\
                [[run]]\nname = \"plain\"\nscenario = \"ten-blocks\"\n\
                set = [\"parameter_set=as-coded\", \"time.step_s=1e-7\", \"time.duration_s=0.9\"]\n\
                [[run]]\nname = \"other\"\nscenario = \"ten-blocks\"\n\
                set = [\"parameter_set=as-coded\", \"time.step_s=1e-7\", \"time.duration_s=0.7\"]\n\
                [[precursors]]\nrun = \"plain\"\nlaw = \"linear\"\n\
                [[precursors]]\nrun = \"plain\"\nlaw = \"tilted\"\nrules = { min_blocks = 2 }\n";
    fs::write(&pipeline, toml).expect("the folder can be written");
    let out = folder.path().join("out");
    succeed(&["reproduce", text(&pipeline), "--out", text(&out)]);
    let tables = out.join("tables");
    assert!(tables.join("other.ruptures.parquet").exists());
    assert!(!tables.join("other.precursor-ruptures.csv").exists(), "no law was asked for");
    let found = precursors_of(&Table::read(&tables.join("plain.ruptures.csv")));
    let precursors = Table::read(&tables.join("plain.precursor-ruptures.csv"));
    let numbers = |least: u32| found.iter().filter(move |found| found.1 >= least).map(|found| &found.0[..]);
    let expected: Vec<&str> = numbers(1).chain(numbers(2)).collect();
    assert_eq!(precursors.column("rupture"), expected);
    let laws: BTreeSet<&str> = precursors.column("law").into_iter().collect();
    assert_eq!(laws, BTreeSet::from(["linear", "tilted"]));
    let record = fs::read_to_string(out.join("reproduce.json")).expect("it is there");
    let place = |name: &str| record.find(name).unwrap_or_else(|| panic!("no {name} in {record}"));
    assert!(place("plain.ruptures.csv") < place("plain.precursor-ruptures.csv"));
    assert!(place("plain.precursor-ruptures.csv") < place("plain.events.csv"));
}

#[test]
fn shorter_ruptures_are_left_out_of_the_precursors_if_that_is_asked_for() {
    let folder = folder();
    let log = folder.path().join("run.mcap");
    small::run(&log);
    let out = folder.path().join("out");
    succeed(&["reduce", text(&log), "--out", text(&out), "--min-blocks", "3"]);
    let precursors = Table::read(&out.join("precursor-ruptures.csv"));
    let found = precursors_of(&Table::read(&out.join("ruptures.csv")));
    let expected: Vec<&str> = found.iter().filter(|found| found.1 >= 3).map(|found| &found.0[..]).collect();
    assert!(expected.len() < found.len(), "{found:?}");
    assert_eq!(precursors.column("rupture"), expected);
    assert!(precursors.column("min_blocks").iter().all(|cell| *cell == "3"));
}
