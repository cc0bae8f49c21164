//! `asperity recording`: recordings against the rows of an independent program in `fixtures/recordings`, as tables of
//! their logs; and what other commands make of such a log.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::support::binary::{outcome, succeed, text};

fn fixture(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/recordings").join(path)
}

/// Reads a recording into a log of that name.
fn read(name: &str, folder: &Path) -> PathBuf {
    let log = folder.join(format!("{name}.mcap"));
    let description = fixture(&format!("{name}/recording.toml"));
    succeed(&["--quiet", "recording", "read", text(&description), "-o", text(&log)]);
    log
}

type Row = BTreeMap<String, String>;

fn rows(path: &Path) -> Vec<Row> {
    let mut reader = csv::Reader::from_path(path).expect("it is a table");
    reader.deserialize().map(|row| row.expect("it is a row")).collect()
}

fn number(row: &Row, column: &str) -> Option<f64> {
    row[column].parse().ok()
}

#[test]
fn ruptures_and_arrivals_of_a_log_are_those_of_the_reference() {
    let folder = asperity_testkit::folder();
    for name in ["slip", "shear"] {
        let log = read(name, folder.path());
        let checked = succeed(&["check", text(&log)]);
        assert!(checked.contains(": whole: "), "{checked}");
        let tables = folder.path().join(format!("{name}-tables"));
        succeed(&["export", text(&log), "--to", "csv", "-o", text(&tables)]);
        let table = |of: &str| rows(&tables.join(format!("{name}.events.{of}.csv")));
        let expected = |of: &str| rows(&fixture(&format!("{name}/expected-{of}.csv")));

        let (mut found, mut due) = (table("rupture"), expected("ruptures"));
        // Found in the order in which they are certain.
        let by_onset =
            |a: &Row, b: &Row| number(a, "onset_s").partial_cmp(&number(b, "onset_s")).expect("numbers");
        found.sort_by(by_onset);
        due.sort_by(by_onset);
        assert_eq!(found.len(), due.len(), "{name}");
        for (found, due) in found.iter().zip(&due) {
            let blocks =
                ["first_block", "last_block", "nucleation_block", "reached_every_block", "detachments"];
            let sensors =
                ["first_sensor", "last_sensor", "nucleation_sensor", "reached_every_sensor", "detachments"];
            for (block, sensor) in blocks.into_iter().zip(sensors) {
                assert_eq!(found[block], due[sensor], "{block}: {due:?}");
            }
            for (column, share) in [
                ("onset_error_s", 0.01),
                ("length_m", 1e-6),
                ("length_error_m", 1e-6),
                // Times are those of the grid.
                ("front_speed_up_m_per_s", 0.02),
                ("front_speed_down_m_per_s", 0.02),
                ("front_speed_up_error_m_per_s", 0.04),
                ("front_speed_down_error_m_per_s", 0.04),
                ("ft_fn_onset", 1e-5),
                ("ft_fn_error", 0.01),
            ] {
                if due.contains_key(column) {
                    let (found, due) = (number(found, column), number(due, column));
                    let is_near = |(found, due): (f64, f64)| (found - due).abs() <= share * due.abs();
                    assert!(
                        found.is_some() == due.is_some() && found.zip(due).is_none_or(is_near),
                        "{column}"
                    );
                }
            }
            assert_eq!(found["drive_work_j"], "", "no sensor measures energies");
        }

        let (mut found, mut due) = (table("arrival"), expected("arrivals"));
        let by_arrival = |sensor: &'static str| {
            move |row: &Row| {
                (
                    row[sensor].parse::<u32>().expect("a number"),
                    (number(row, "arrival_s").expect("a time") * 1e6) as u64,
                )
            }
        };
        found.sort_by_key(by_arrival("block"));
        due.sort_by_key(by_arrival("sensor"));
        assert_eq!(found.len(), due.len(), "{name}");
        for (found, due) in found.iter().zip(&due) {
            for (column, share, least) in
                [("arrival_s", 0.0, 3e-7), ("stop_s", 0.0, 3e-6), ("step", 0.01, 0.0), ("x_m", 1e-9, 0.0)]
            {
                let [found, due] = [found, due].map(|row| number(row, column).expect("a number"));
                assert!((found - due).abs() <= share * due.abs() + least, "{column}: {found}, not {due}");
            }
        }
    }
}

#[test]
fn a_log_of_a_recording_is_read_as_that_of_a_run() {
    let folder = asperity_testkit::folder();
    let log = read("slip", folder.path());
    let again = folder.path().join("again.mcap");
    succeed(&["--quiet", "recording", "read", text(&fixture("slip/recording.toml")), "-o", text(&again)]);
    assert!(fs::read(&log).expect("a log") == fs::read(&again).expect("a log"), "equal bytes");
    assert!(succeed(&["summary", text(&log)]).contains("first slip                             0.476295 s"));
    assert_eq!(succeed(&["events", text(&log)]).lines().count(), 1 + 23);
    let catalogue = succeed(&["catalogue", text(&log)]);
    assert_eq!(catalogue.lines().count(), 1 + 26);
    // The first rupture began at the first sensor.
    assert!(catalogue.lines().nth(1).expect("a rupture").contains(",0.0181818,"), "{catalogue}");
    let (code, printed, _) = outcome(&["replay", text(&log)]);
    assert!(code == 0 && printed.contains("23 slip events, the same as logged"), "{printed}");
}

#[test]
fn a_description_is_shown_checked_and_refused() {
    let folder = asperity_testkit::folder();
    let shown = folder.path().join("recording.toml");
    fs::write(&shown, succeed(&["recording", "show"])).expect("it can be written");
    // All of its keys are known: only its files are missing.
    let (code, _, said) = outcome(&["recording", "validate", text(&shown)]);
    assert!(code == 2 && said.contains("forces.csv: "), "{said}");
    let valid = succeed(&["recording", "validate", text(&fixture("slip/recording.toml"))]);
    assert!(
        valid.contains("fast: 21 parts of 16802 samples at 1000000 Hz, 8 sensors and 0 channels"),
        "{valid}"
    );
    let log = folder.path().join("lab.mcap");
    let fault = fixture("faults/gap.toml");
    let (code, _, said) = outcome(&["recording", "read", text(&fault), "-o", text(&log)]);
    assert!(code == 2 && said.contains("gap.csv:253: time = 0.300: gap of 0.051 s"), "{said}");
    assert!(!log.exists());
}
