//! The event tables of an independent program, row for row.
//!
//! `fixtures/reference` contains the results of an independent plain-stepping program for the same
//! parameters. Steps and blocks must be equal; loads are printed there with nine decimals. The tables are
//! never re-blessed: if one differs, this program is wrong until shown otherwise.

use std::fs;
use std::path::Path;

use crate::support::binary::{run, succeed, text, with_sets};
use asperity_testkit::run_end;

/// Half a unit of the ninth decimal would do; the loads of a step depend on the
/// order in which forces are added, which moves them by less than this.
const LOAD_TOLERANCE: f64 = 1e-7;

/// How many differing rows a failure shows.
const SHOWN: usize = 10;

/// The tables: name, time step, and scenario with its changes.
const TABLES: [(&str, f64, &str); 9] = [
    ("side-default-coded", 1e-8, "default"),
    ("side-default-stated", 1e-8, "default parameter_set=as-stated"),
    ("side-n10-coded", 1e-8, "ten-blocks"),
    ("side-theta-pos-dt1e-7-coded", 1e-7, "load-on-driven-end time.step_s=1e-7"),
    ("side-beta0225-dt1e-7-coded", 1e-7, "beta-0225 time.step_s=1e-7"),
    (
        "unload-400-100-tend47-dt1e-7-coded",
        1e-7,
        "default time.step_s=1e-7 drive.hold_from_s=2 normal_load.schedule_s=[2,4.7] \
         normal_load.schedule_n=[400,100]",
    ),
    (
        "top-n64-theta05-dt1e-7-coded",
        1e-7,
        "default time.step_s=1e-7 drive.kind=top slider.blocks=64 normal_load.tilt=0.5",
    ),
    (
        "leftright-n41-T4-dt1e-7-coded",
        1e-7,
        "default time.step_s=1e-7 time.duration_s=4 drive.kind=left-right friction.reattach=two-way \
         slider.blocks=41",
    ),
    ("slab-57x31-T06-dt2e-7", 2e-7, "slab"),
];

/// A slab with few single steps.
const COARSE_SLAB: (&str, f64, &str) =
    ("slab-29x16-T06-dt4e-7", 4e-7, "slab slider.blocks=29 slider.rows=16 time.step_s=4e-7");

/// Friction that falls over a slip: the plain solver takes 10^8 and 5 * 10^8 steps for the first two.
const WEAKENING: [(&str, f64, &str); 4] = [
    (
        "slip-weakening/a-side-dc1e-9",
        1e-8,
        "rigid-contacts friction.weakening_slip_m=1e-9 time.step_s=1e-8 time.duration_s=1",
    ),
    (
        "slip-weakening/b-top-n50-tilt03-dc2e-9",
        2e-8,
        "rigid-contacts drive.kind=top slider.blocks=50 normal_load.tilt=0.3 friction.weakening_slip_m=2e-9 \
         time.step_s=2e-8 time.duration_s=10",
    ),
    (
        "slip-weakening/c-springs-n40-dc3e-9",
        1e-7,
        "default parameter_set=as-stated slider.blocks=40 friction.weakening_slip_m=3e-9 time.step_s=1e-7 \
         time.duration_s=2",
    ),
    (
        "slip-weakening/g-memory-n24-tilt-05-dc5e-8",
        1e-7,
        "rigid-contacts slider.blocks=24 normal_load.tilt=-0.5 friction.weakening_slip_m=5e-8 \
         friction.slip_memory_s=1e-3 time.step_s=1e-7 time.duration_s=2",
    ),
];

#[test]
fn the_fast_solver_gives_the_tables_of_slip_weakening() {
    WEAKENING.iter().for_each(|table| check(table, "fast"));
}

#[test]
fn the_plain_solver_gives_the_tables_of_slip_weakening() {
    WEAKENING[2..].iter().for_each(|table| check(table, "plain"));
}

#[test]
fn the_fast_solver_gives_the_tables() {
    TABLES.iter().for_each(|table| check(table, "fast"));
}

#[test]
fn the_fast_solver_gives_the_table_of_a_coarse_slab() {
    check(&COARSE_SLAB, "fast");
}

/// Run by `cargo xtask ci`.
mod in_ci {
    use super::*;

    #[test]
    #[ignore = "half a minute of 5e7 single steps: cargo xtask ci"]
    fn the_plain_solver_gives_the_table_of_a_tilted_load() {
        check(table("side-theta-pos-dt1e-7-coded"), "plain");
    }

    #[test]
    #[ignore = "half a minute of 5e7 single steps: cargo xtask ci"]
    fn the_plain_solver_gives_the_table_of_a_drive_on_top() {
        check(table("top-n64-theta05-dt1e-7-coded"), "plain");
    }
}

#[test]
#[ignore = "minutes of 5e8 single steps: cargo xtask nightly"]
fn the_plain_solver_gives_all_tables() {
    TABLES.iter().chain(&WEAKENING).chain([&COARSE_SLAB]).for_each(|table| check(table, "plain"));
}

fn table(name: &str) -> &'static (&'static str, f64, &'static str) {
    TABLES.iter().find(|table| table.0 == name).expect("it is among them")
}

/// A row of either table; times in steps.
#[derive(Debug)]
struct Row {
    onset_step: u64,
    end_step: Option<u64>,
    first_block: u32,
    last_block: u32,
    max_sliding: u32,
    /// In the tables that have it.
    blocks_slipped: Option<u32>,
    ft_fn_onset: f64,
    ft_fn_end: Option<f64>,
}

impl Row {
    fn agrees(&self, other: &Row) -> bool {
        let counts =
            |row: &Row| (row.onset_step, row.end_step, row.first_block, row.last_block, row.max_sliding);
        let same_load = |a: f64, b: f64| (a - b).abs() <= LOAD_TOLERANCE;
        let same_end = match (self.ft_fn_end, other.ft_fn_end) {
            (Some(a), Some(b)) => same_load(a, b),
            (a, b) => a.is_none() && b.is_none(),
        };
        let same_count = self.blocks_slipped.is_none_or(|count| other.blocks_slipped == Some(count));
        counts(self) == counts(other)
            && same_count
            && same_load(self.ft_fn_onset, other.ft_fn_onset)
            && same_end
    }
}

/// A solver must give the table.
fn check((table, step_s, scenario): &(&str, f64, &str), solver: &str) {
    let words: Vec<&str> = scenario.split_whitespace().collect();
    let scenario = with_sets(&[words[0], "--solver", solver], &words[1..]);
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/reference");
    let stored = fs::read_to_string(fixtures.join(format!("{table}.csv"))).expect("the table is stored");
    let stored = rows(&stored, *step_s);

    let folder = asperity_testkit::folder();
    let log = folder.path().join("run.mcap");
    run(&scenario, &log);
    let found = rows(&succeed(&["events", text(&log), "--format", "csv"]), *step_s);

    let differing: Vec<String> = stored
        .iter()
        .zip(&found)
        .enumerate()
        .filter(|(_, (stored, found))| !stored.agrees(found))
        .take(SHOWN)
        .map(|(number, (stored, found))| format!("row {number}:\n  stored {stored:?}\n  found  {found:?}"))
        .collect();
    assert!(
        differing.is_empty(),
        "{scenario:?}: the first rows that differ from {table}\n{}",
        differing.join("\n")
    );
    assert_eq!(found.len(), stored.len(), "{scenario:?}: number of slip events");
    if let Some(switches) = stored_switches(&fixtures, table) {
        assert_eq!(recorded_switches(&log), switches, "{scenario:?}: number of switches");
    }
}

fn rows(table: &str, step_s: f64) -> Vec<Row> {
    let mut reader = csv::Reader::from_reader(table.as_bytes());
    let columns = reader.headers().expect("a table has a header").clone();
    let step = |time_s: &str| (time_s.parse::<f64>().expect("a time is a number") / step_s).round() as u64;
    let row = |record: csv::StringRecord| {
        let column = |name: &str| columns.iter().position(|column| column == name);
        let cell = |name: &str| &record[column(name).unwrap_or_else(|| panic!("there is no column {name}"))];
        let count_of_steps = |time: &str| match column(&format!("{time}_s")) {
            None => cell(&format!("{time}_step")).parse().ok(),
            Some(_) => Some(cell(&format!("{time}_s"))).filter(|time_s| !time_s.is_empty()).map(step),
        };
        let number = |name: &str| cell(name).parse::<f64>().expect("a load is a number");
        let count = |name: &str| cell(name).parse::<u32>().expect("a block is a whole number");
        let row = Row {
            onset_step: count_of_steps("onset").expect("an event begins"),
            end_step: count_of_steps("end"),
            first_block: count("first_block"),
            last_block: count("last_block"),
            max_sliding: count("max_sliding"),
            blocks_slipped: column("blocks_slipped").map(|_| count("blocks_slipped")),
            ft_fn_onset: number("ft_fn_onset"),
            ft_fn_end: (!cell("ft_fn_end").is_empty()).then(|| number("ft_fn_end")),
        };
        // Our own table has the steps as well, and must agree.
        if column("onset_step").is_some() {
            assert_eq!(cell("onset_step"), row.onset_step.to_string());
            assert_eq!(cell("end_step"), row.end_step.map_or(String::new(), |step| step.to_string()));
        }
        row
    };
    reader.records().map(|record| row(record.expect("the table is CSV"))).collect()
}

/// Of the slabs, as the author of their tables gives them.
const SWITCHES_OF_SLABS: [(&str, u64); 2] = [("slab-29x16-T06-dt4e-7", 138), ("slab-57x31-T06-dt2e-7", 308)];

/// `None` of a table whose author does not give them.
fn stored_switches(fixtures: &Path, table: &str) -> Option<u64> {
    if let Some((_, switches)) = SWITCHES_OF_SLABS.iter().find(|(name, _)| *name == table) {
        return Some(*switches);
    }
    if WEAKENING.iter().any(|(name, ..)| *name == table) {
        return None;
    }
    let list = fs::read_to_string(fixtures.join("switches.txt")).expect("the list is stored");
    let count = list.lines().find_map(|line| line.strip_prefix(table)?.strip_prefix(' '));
    Some(count.expect("the list names the table").trim().parse().expect("the list gives a whole number"))
}

fn recorded_switches(log: &Path) -> u64 {
    run_end(log).switches
}
