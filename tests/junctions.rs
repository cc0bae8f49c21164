//! Runs with junctions beside the rows of an independent program, `fixtures/reference/junctions`: slip events
//! with counts of breaks and re-pins, and switches. They are never re-blessed.

use std::collections::BTreeMap;
use std::path::Path;

use asperity_record::{Direction, Record};
use asperity_runlog::LogItem;
use asperity_testkit::read_log;

use crate::support::binary::{run, succeed, text, with_sets};

const COUNTS: [&str; 10] = [
    "onset_step",
    "end_step",
    "first_contact",
    "last_contact",
    "max_sliding",
    "contacts_slipped",
    "breaks_onset",
    "breaks_end",
    "repins_onset",
    "repins_end",
];

/// Tables have nine decimals; these are the digits on which the order of additions has no effect.
const LOAD_TOLERANCE: f64 = 1e-7;

#[test]
fn a_chain_gives_the_rows_of_an_independent_program() {
    let sets = ["friction.junction_width=0.1", "time.step_s=1e-7"];
    compare("chain-n50", &with_sets(&["chain-junctions"], &sets));
}

#[test]
fn a_coarse_slab_gives_the_rows_of_an_independent_program() {
    let sets = ["slider.blocks=29", "slider.rows=16", "time.step_s=4e-7", "friction.junction_width=0.1"];
    compare("slab-29x16", &with_sets(&["slab-junctions"], &sets));
}

#[test]
#[ignore = "half a minute of single steps: cargo xtask nightly"]
fn the_default_slab_gives_the_rows_of_an_independent_program() {
    compare("slab-57x31", &["slab-junctions", "--solver", "plain"]);
}

fn compare(table: &str, scenario: &[&str]) {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("run.mcap");
    run(scenario, &log);
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/reference/junctions");
    let stored = |name: &str| Table::of(&std::fs::read_to_string(fixtures.join(name)).expect("it is stored"));

    let events = stored(&format!("{table}.csv"));
    let found = Table::of(&succeed(&["events", text(&log), "--format", "csv"]));
    let is_whole = |row: &usize| found.cell(*row, "open") == "false";
    let whole: Vec<usize> = (0..found.rows.len()).filter(is_whole).collect();
    assert_eq!(whole.len(), events.rows.len(), "{table}: slip events");
    for (number, row) in whole.into_iter().enumerate() {
        for count in COUNTS {
            let ours = count.replace("first_contact", "first_block").replace("last_contact", "last_block");
            let ours = ours.replace("contacts_slipped", "blocks_slipped");
            assert_eq!(found.cell(row, &ours), events.cell(number, count), "{table}, row {number}: {count}");
        }
        for load in ["ft_fn_onset", "ft_fn_end"] {
            let (found, stored) = (found.number(row, load), events.number(number, load));
            assert!(
                (found - stored).abs() <= LOAD_TOLERANCE,
                "{table}, row {number}: {load} {found} {stored}"
            );
        }
    }

    let switches = stored(&format!("{table}.switches.csv"));
    let (mut number, mut different) = (0, 0);
    for item in read_log(&log).expect("the log is whole").0 {
        let LogItem::Record(Record::Step(record)) = item else { continue };
        for switch in &record.switches {
            let up = u32::from(switch.direction == Direction::Detach);
            let ours = [record.step.to_string(), switch.block.to_string(), up.to_string()];
            assert_eq!(ours, ["step", "contact", "up"].map(|name| switches.cell(number, name)), "{table}");
            let slipping = switch.junctions_slipping.expect("a contact of junctions");
            assert_eq!(slipping >= 50, up == 1, "{table}: {slipping} of 100 slip");
            let load = (record.load_ratio() - switches.number(number, "ft_fn")).abs();
            let shear =
                switch.tangential_force_n * 0.4 / switch.threshold_n - switches.number(number, "tau_p");
            let (v, stored) = (switch.velocity_m_per_s, switches.number(number, "v"));
            assert!(load <= LOAD_TOLERANCE && shear.abs() < 2e-6, "{table}, switch {number}");
            // Seven digits are printed.
            different += u32::from((v - stored).abs() > 1e-6 * stored.abs());
            number += 1;
        }
    }
    // The last digits of some velocities depend on the order of additions.
    assert!(number == switches.rows.len() && different <= 5, "{table}: {different} of {number} velocities");
}

/// The table of `reduce`, computed from the exported states and arrivals.
#[test]
fn slow_slip_of_every_rupture_is_that_of_the_recorded_states() {
    let folder = asperity_testkit::folder();
    let (log, out, all) =
        (folder.path().join("run.mcap"), folder.path().join("out"), folder.path().join("all"));
    let sets = ["time.step_s=1e-7", "time.duration_s=0.1", "recording.fields_s=1e-4"];
    run(&with_sets(&["chain-junctions"], &sets), &log);
    succeed(&["reduce", text(&log), "-o", text(&out), "--quiet"]);
    succeed(&["export", text(&log), "--to", "csv", "-o", text(&all), "--quiet"]);
    let read = |path: std::path::PathBuf| Table::of(&std::fs::read_to_string(path).expect("it is there"));
    let (found, states) = (read(out.join("slow-slip.csv")), read(all.join("run.fields.csv")));
    let arrivals = read(all.join("run.events.arrival.csv"));

    let mut course: Vec<Vec<[f64; 2]>> = vec![Vec::new(); 50];
    for row in 0..states.rows.len() {
        let block: usize = states.cell(row, "block").parse().unwrap();
        course[block - 1].push([states.number(row, "time_s"), states.number(row, "displacement_m")]);
    }
    let mut expected: BTreeMap<u64, [Vec<f64>; 2]> = BTreeMap::new();
    for row in 0..arrivals.rows.len() {
        let (block, arrival_s) = (arrivals.cell(row, "block"), arrivals.number(row, "arrival_s"));
        let others = (0..arrivals.rows.len()).filter(|other| arrivals.cell(*other, "block") == block);
        let later = others.map(|other| arrivals.number(other, "arrival_s")).filter(|at_s| *at_s > arrival_s);
        let next_s = later.fold(f64::INFINITY, f64::min);
        let course = &course[block.parse::<usize>().unwrap() - 1];
        let from_s = arrival_s + 5e-4;
        let after = course.iter().position(|[at_s, _]| *at_s > from_s);
        let Some(after) = after.filter(|after| course[*after][0] <= next_s) else { continue };
        let ([t0, u0], [t1, u1]) = (course[after - 1], course[after]);
        let from_m = u0 + (u1 - u0) * (from_s - t0) / (t1 - t0);
        // The link time is twice the mean healing time, 4 ms.
        for (slot, until_s) in [next_s, next_s.min(arrival_s + 4e-3)].into_iter().enumerate() {
            let last = course.iter().rev().find(|[at_s, _]| *at_s <= until_s).expect("there is one");
            let moved = expected.entry(arrivals.cell(row, "rupture").parse().unwrap()).or_default();
            moved[slot].push(last[1] - from_m);
        }
    }
    let median = |of: &mut Vec<f64>| {
        of.sort_by(f64::total_cmp);
        (of[(of.len() - 1) / 2] + of[of.len() / 2]) / 2.0
    };
    assert!(expected.len() > 5 && expected.len() == found.rows.len(), "{}", expected.len());
    for (row, (rupture, mut moved)) in expected.into_iter().enumerate() {
        assert_eq!(found.cell(row, "rupture"), rupture.to_string());
        assert_eq!(found.cell(row, "contacts"), moved[0].len().to_string());
        for (slot, column) in ["slow_slip_m", "slow_slip_until_link_time_m"].into_iter().enumerate() {
            let (found, expected) = (found.number(row, column), median(&mut moved[slot]));
            assert!((found - expected).abs() < 1e-15, "rupture {rupture}, {column}: {found} {expected}");
        }
        assert_eq!(found.number(row, "largest_slow_slip_m"), *moved[0].last().unwrap(), "rupture {rupture}");
    }
}

/// A table of text.
struct Table {
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    fn of(csv: &str) -> Table {
        let mut lines = csv.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<String>>());
        Table { columns: lines.next().expect("a header"), rows: lines.collect() }
    }

    fn cell(&self, row: usize, column: &str) -> &str {
        let at = self.columns.iter().position(|name| name == column);
        &self.rows[row][at.unwrap_or_else(|| panic!("there is no column {column}"))]
    }

    fn number(&self, row: usize, column: &str) -> f64 {
        self.cell(row, column).parse().unwrap_or_else(|error| panic!("{column}: {error}"))
    }
}

/// Runs of `junction-slider`, each number beside that of theory. The load of contact 2 is 199 times that of
/// contact 1, which keeps it still while the bond's dashpot brings block 1 to rest.
const CLOSED_FORMS: &str = r#"
title = "Closed forms"
slow_slip = ["held"]

[[run]]
name = "held"
scenario = "junction-slider"
set = [
  "slider.blocks=2", "slider.length_m=0.02", "slider.width_m=0.005", "slider.height_m=0.0025", "slider.mass_kg=3e-4",
  "slider.relative_damping=5", "normal_load.total_n=6736", "normal_load.tilt=-0.99", "friction.junction_width=0",
  "friction.healing_time_s=0.004", "prestress.first_block_ratio=0.3999", "drive.stiffness_n_per_m=2.5e6",
  "drive.velocity_m_per_s=1.6e-6", "drive.hold_from_s=0.003", "time.step_s=1e-7", "time.duration_s=0.02",
  "recording.fields_s=1e-4",
]

[[run]]
name = "sliding"
scenario = "junction-slider"
set = [
  "slider.length_m=0.01", "slider.width_m=0.01", "slider.height_m=0.01", "slider.mass_kg=1e-3",
  "drive.stiffness_n_per_m=1e8", "drive.velocity_m_per_s=1e-4", "time.step_s=1e-6", "time.duration_s=2",
  "recording.sample_s=1e-3",
]

[[run]]
name = "pulled"
scenario = "junction-slider"
set = [
  "slider.length_m=1e-3", "slider.width_m=1e-3", "slider.height_m=1e-3", "slider.mass_kg=1e-6",
  "drive.velocity_m_per_s=1e-3", "friction.healing_time_s=1", "friction.healing_deviation_s=0",
  "friction.junction_width=0.2", "time.step_s=1e-7", "time.duration_s=6e-3", "recording.sample_s=1e-6",
]

[[study]]
name = "held"
parameter = "slider.blocks"
runs = ["held"]
measures = ["slow_slip_m", "slow_slip_theory_m"]

[[study]]
name = "sliding"
parameter = "slider.blocks"
runs = ["sliding"]
measures = ["steady_ft_fn", "steady_friction_theory_ratio"]

[[study]]
name = "pulled"
parameter = "slider.blocks"
runs = ["pulled"]
measures = ["largest_ft_fn", "peak_friction_theory_ratio"]
"#;

#[test]
fn one_contact_does_what_the_closed_forms_say() {
    let folder = asperity_testkit::folder();
    let (pipeline, out) = (folder.path().join("closed.toml"), folder.path().join("out"));
    std::fs::write(&pipeline, CLOSED_FORMS).expect("the folder can be written");
    succeed(&["reproduce", text(&pipeline), "-o", text(&out), "--quiet"]);
    for (name, within) in [("held", 0.01), ("sliding", 0.001), ("pulled", 0.001)] {
        let table = out.join(format!("tables/study-{name}.csv"));
        let table = std::fs::read_to_string(table).expect("the table is there");
        let row = table.lines().nth(1).expect("a run has a row");
        let numbers: Vec<f64> = row.split(',').rev().take(2).map(|cell| cell.parse().expect(row)).collect();
        assert!((numbers[1] / numbers[0] - 1.0).abs() < within, "{name}: {table}");
    }
    let table = std::fs::read_to_string(out.join("tables/held.slow-slip.csv")).expect("the table is there");
    let study = std::fs::read_to_string(out.join("tables/study-held.csv")).expect("the table is there");
    let measured = study.lines().nth(1).and_then(|row| row.split(',').nth(4)).expect(&study);
    assert!(table.contains(&format!(",{measured},")), "{table}{study}");
}
