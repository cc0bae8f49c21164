//! Slip events over an area beside the tables of an independent program, `fixtures/reference/area`, row for row.
//!
//! Steps, bounding boxes and counts must be equal; loads are printed there with nine decimals. The tables are
//! never re-blessed: if one differs, this program is wrong until shown otherwise.

use asperity_detect::{Change, Slip, SlipRules, SlipTracker};
use asperity_model::resolve;
use asperity_model::{Plan, RecordingPlan};
use asperity_record::{Extent, Record};
use asperity_simulator::SolverKind;

/// The order in which forces are added moves loads by less than this.
const LOAD_TOLERANCE: f64 = 1e-7;

/// A table: its name, its scenario with changes, switches, and steps in which a contact slides.
struct Table {
    name: &'static str,
    scenario: &'static str,
    sets: &'static [&'static str],
    switches: u64,
    sliding_steps: u64,
}

const SHEET_SIDE: Table = Table {
    name: "sheet-26x6-side",
    scenario: "sheet-coarse",
    sets: &[],
    switches: 3816,
    sliding_steps: 7390,
};

const SHEET_ROW_1: Table = Table {
    name: "sheet-26x6-row1",
    scenario: "sheet-coarse",
    sets: &["drive.across=1", "time.duration_s=1.6"],
    switches: 2244,
    sliding_steps: 7609,
};

const BODY_SIDE: Table = Table {
    name: "body-29x5x16-side",
    scenario: "body-coarse",
    sets: &[],
    switches: 948,
    sliding_steps: 4535,
};

const BODY_ROW_1: Table = Table {
    name: "body-15x4x7-row1",
    scenario: "body-coarse",
    sets: &[
        "slider.blocks=15",
        "slider.across=4",
        "slider.rows=7",
        "slider.width_m=0.03",
        "slider.height_m=0.06",
        "slider.mass_kg=0.3024",
        "slider.relative_damping=0.3",
        "normal_load.total_n=8000",
        "normal_load.tilt=-0.3",
        "normal_load.foundation_stiffness_ratio=0.8",
        "drive.stiffness_n_per_m=1.2e7",
        "drive.height_m=0.02",
        "drive.across=1",
        "drive.velocity_m_per_s=6e-4",
        "friction.static_coefficient=0.45",
        "friction.dynamic_coefficient=0.2",
        "friction.interfacial_stiffness_ratio=2",
        "time.step_s=8e-7",
        "time.duration_s=0.8",
    ],
    switches: 524,
    sliding_steps: 89869,
};

const BODY_LIFT: Table = Table {
    name: "body-15x4x7-lift",
    scenario: "body-coarse",
    sets: &[
        "slider.blocks=15",
        "slider.across=4",
        "slider.rows=7",
        "slider.width_m=0.03",
        "slider.height_m=0.06",
        "slider.mass_kg=0.3024",
        "slider.relative_damping=0.3",
        "normal_load.total_n=2000",
        "normal_load.foundation_stiffness_ratio=0.8",
        "drive.stiffness_n_per_m=1.2e7",
        "drive.height_m=0.06",
        "friction.static_coefficient=0.8",
        "friction.dynamic_coefficient=0.3",
        "friction.interfacial_stiffness_ratio=2",
        "time.step_s=8e-7",
        "time.duration_s=0.5",
    ],
    switches: 900,
    sliding_steps: 267_364,
};

/// A fine body, up to the end of its first global slip.
const FINE_BODY: Table = Table {
    name: "body-57x9x31-side",
    scenario: "body",
    sets: &["time.duration_s=0.4200554"],
    switches: 2402,
    sliding_steps: 5756,
};

const TABLES: [&Table; 5] = [&SHEET_SIDE, &SHEET_ROW_1, &BODY_SIDE, &BODY_ROW_1, &BODY_LIFT];

#[test]
fn the_fast_solver_gives_the_tables() {
    [&SHEET_ROW_1, &BODY_SIDE, &BODY_ROW_1].iter().for_each(|table| compare(table, SolverKind::Fast));
}

/// The tables that are left; `cargo xtask ci` runs them.
mod in_ci {
    use super::*;

    #[test]
    #[ignore = "seconds of two runs: cargo xtask ci"]
    fn the_fast_solver_gives_the_other_tables() {
        [&SHEET_SIDE, &BODY_LIFT].iter().for_each(|table| compare(table, SolverKind::Fast));
    }
}

#[test]
#[ignore = "half a minute: cargo xtask nightly"]
fn the_fast_solver_gives_the_table_of_a_fine_body() {
    compare(&FINE_BODY, SolverKind::Fast);
}

#[test]
#[ignore = "a minute of single steps: cargo xtask nightly"]
fn the_plain_solver_gives_the_tables() {
    TABLES.iter().for_each(|table| compare(table, SolverKind::Plain));
}

fn compare(table: &Table, kind: SolverKind) {
    let scenario = resolve(table.scenario, table.sets).unwrap_or_else(|error| panic!("{error}"));
    let plan = Plan { recording: RecordingPlan::default(), ..Plan::new(&scenario) };
    let mut tracker = SlipTracker::new(plan.elastic.layout(), SlipRules::EVERY_SLIP);
    let (mut changes, mut switches) = (Vec::new(), 0);
    let mut solver = kind.start(plan);
    while let Some(record) = solver.next_record().unwrap_or_else(|error| panic!("{error}")) {
        if let Record::Step(record) = record {
            switches += record.switches.len() as u64;
            tracker.observe(&record, &mut changes);
        }
    }
    let end_step = solver.step();
    tracker.conclude(&mut changes);
    let events: Vec<Slip> = changes
        .into_iter()
        .filter_map(|change| match change {
            Change::Ended(slip) => Some(slip),
            Change::Begins(_) => None,
        })
        .collect();
    let sliding_steps =
        events.iter().map(|slip| slip.end.map_or(end_step + 1, |end| end.step) - slip.onset.step);
    let sliding_steps: u64 = sliding_steps.sum();
    let whole: Vec<&Slip> = events.iter().filter(|slip| slip.end.is_some()).collect();
    let path = format!("{}/../../fixtures/reference/area/{}.csv", env!("CARGO_MANIFEST_DIR"), table.name);
    let stored = std::fs::read_to_string(path).expect("the table is stored");
    let mut lines = stored.lines();
    assert_eq!(
        lines.next(),
        Some(
            "event,onset_step,end_step,first_column,last_column,first_row,last_row,contacts_slipped,max_sliding,\
             nucleation_contact,ft_fn_onset,ft_fn_end"
        )
    );
    let rows: Vec<(Vec<u64>, [f64; 2])> = lines.map(row_of_line).collect();
    for ((expected, loads), slip) in rows.iter().zip(&whole) {
        let (found, found_loads) = row_of_slip(slip);
        assert_eq!(&found, expected, "{}: a row", table.name);
        for (found, load) in found_loads.iter().zip(loads) {
            assert!(
                (found - load).abs() <= LOAD_TOLERANCE,
                "{}, row {expected:?}: {found}, not {load}",
                table.name
            );
        }
    }
    assert_eq!(whole.len(), rows.len(), "{}: events that end", table.name);
    assert_eq!(switches, table.switches, "{}: switches", table.name);
    assert_eq!(sliding_steps, table.sliding_steps, "{}: steps with a sliding contact", table.name);
    // The creep of contacts at a corner, or in the air, leaves little time for jumps, but some.
    let has_jumped = solver.counters().jumps > 0;
    assert_eq!(has_jumped, matches!(kind, SolverKind::Fast), "{}: jumps", table.name);
}

fn row_of_line(line: &str) -> (Vec<u64>, [f64; 2]) {
    let cells: Vec<&str> = line.split(',').collect();
    let (counts, loads) = cells.split_at(10);
    let number = |cell: &&str| cell.parse().expect("a whole number");
    let load = |cell: usize| loads[cell].parse().expect("a number");
    (counts.iter().map(number).collect(), [load(0), load(1)])
}

fn row_of_slip(slip: &Slip) -> (Vec<u64>, [f64; 2]) {
    let end = slip.end.expect("it is over");
    let bounds = |extent: &Extent| Some([extent.columns()?, extent.rows()?]);
    let [columns, rows] = bounds(&slip.extent).expect("a contact slid");
    let of_contacts = [
        columns.first,
        columns.last,
        rows.first,
        rows.last,
        slip.extent.count(),
        slip.max_sliding,
        slip.onset.nucleation.block,
    ];
    let steps = [slip.onset.event + 1, slip.onset.step, end.step];
    let counts = steps.into_iter().chain(of_contacts.map(u64::from)).collect();
    (counts, [slip.onset.load_ratio, end.load_ratio])
}
