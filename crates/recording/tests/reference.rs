//! What is found in recordings, against the rows of an independent program, whose recordings and rows lie in
//! `fixtures/recordings`. Two programs agree there, so limits are those of printed digits and of the step grid.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use asperity_record::{Direction, Noise, StepRecord};
use asperity_recording::{Description, Detected, Recording};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/recordings").join(name)
}

fn detect(name: &str) -> (Recording, Detected) {
    let description = Description::read(&fixture(name).join("recording.toml")).unwrap();
    let recording = Recording::open(description).unwrap();
    let found = recording.detect(&|_, _| false).unwrap();
    (recording, found)
}

type Row = BTreeMap<String, String>;

fn expected(name: &str, table: &str) -> Vec<Row> {
    let path = fixture(name).join(format!("expected-{table}.csv"));
    let mut reader = csv::Reader::from_path(path).unwrap();
    reader.deserialize().map(Result::unwrap).collect()
}

/// Compares a cell: empty ones are none.
fn same(row: &Row, column: &str, found: impl Into<Option<f64>>, tolerance: f64) {
    let expected: Option<f64> = row[column].parse().ok();
    let found = found.into();
    let is_same = match (expected, found) {
        (Some(expected), Some(found)) => (expected - found).abs() <= tolerance,
        (expected, found) => expected == found,
    };
    assert!(is_same, "{column}: {found:?} instead of {expected:?} in {row:?}");
}

fn number(row: &Row, column: &str) -> f64 {
    row[column].parse().unwrap()
}

#[test]
fn noise_is_that_of_the_reference() {
    for name in ["slip", "shear"] {
        let (_, found) = detect(name);
        let mut sensors: Vec<&Noise> = found.rows.iter().filter_map(|row| row.values.get()).collect();
        sensors.sort_by_key(|noise| (noise.part, noise.sensor));
        let rows = expected(name, "noise");
        assert_eq!(rows.len(), sensors.len());
        for (row, noise) in rows.iter().zip(sensors) {
            assert_eq!(number(row, "sensor"), f64::from(noise.sensor));
            let sigma = number(row, "sigma");
            same(row, "median", noise.median, 1e-3 * sigma);
            same(row, "sigma", noise.sigma, 1e-3 * sigma);
        }
    }
}

/// Times, sizes and errors of every arrival; the loads before it.
#[test]
fn arrivals_are_those_of_the_reference() {
    for (name, count) in [("slip", 110), ("shear", 18)] {
        let (recording, mut found) = detect(name);
        let grid = recording.recorded(&mut found).header.time_grid();
        let records: Vec<StepRecord> = found.steps().collect();
        let rows = expected(name, "arrivals");
        let detaches = |record: &StepRecord, sensor: f64| {
            record
                .switches
                .iter()
                .any(|switch| f64::from(switch.block) == sensor && switch.direction == Direction::Detach)
        };
        let mut seen = 0;
        for row in &rows {
            let (sensor, arrival_s) = (number(row, "sensor"), number(row, "arrival_s"));
            let is_it = |record: &&StepRecord| {
                (grid.time_s(record.step + 1) - arrival_s).abs() < 3e-7 && detaches(record, sensor)
            };
            let record = records.iter().find(is_it).unwrap_or_else(|| panic!("{row:?} is missing"));
            let switch = record.switches.iter().find(|switch| f64::from(switch.block) == sensor).unwrap();
            let measured = switch.measured.unwrap();
            same(row, "arrival_error_s", measured.error_s, 0.01 * number(row, "arrival_error_s"));
            same(row, "step_error", measured.step_error, 0.01 * number(row, "step_error"));
            same(row, "arrival_step", record.step as f64, 20.0);
            if name == "slip" {
                for (column, value) in [("ft_n", record.driving_force_n), ("fn_n", record.normal_load_n)] {
                    same(row, column, value, 1e-5 * value);
                }
                same(row, "ft_fn_error", record.ft_fn_error, 0.01 * number(row, "ft_fn_error"));
            }
            seen += 1;
        }
        assert_eq!(seen, count, "{name}");
    }
}

#[test]
fn load_drops_are_those_of_the_reference() {
    let (_, found) = detect("slip");
    let rows = expected("slip", "load-drops");
    assert_eq!((rows.len(), found.drops.len()), (64, 64));
    for (row, drop) in rows.iter().zip(&found.drops) {
        // A hundredth of a sample.
        same(row, "onset_s", drop.onset_s, 2.5e-6);
        same(row, "end_s", drop.end_s, 2.5e-6);
        same(row, "recurrence_s", drop.recurrence_s, 5e-6);
        let drop_n = number(row, "drop_n");
        for (column, value) in
            [("ft_before_n", drop.ft_before_n), ("ft_after_n", drop.ft_after_n), ("drop_n", drop.drop_n)]
        {
            same(row, column, value, 2e-3 * drop_n);
        }
        same(row, "drop_error_n", drop.drop_error_n, 0.01 * number(row, "drop_error_n"));
        same(row, "ft_fn_before", drop.ft_fn_before, 1e-6);
        same(row, "ft_fn_after", drop.ft_fn_after, 1e-6);
        same(row, "loading_rate_n_per_s", drop.loading_rate_n_per_s, 2e-3 * drop.loading_rate_n_per_s.abs());
        // The model's drive has 8e5 N/m; lines of 8 windows of a position that is printed to 10 nm are no better.
        let stiffness = drop.stiffness_n_per_m.unwrap();
        assert!((5e5..1.2e6).contains(&stiffness), "{stiffness}");
    }
}

/// Each refused recording names file, line, column, value and what is wrong with it.
#[test]
fn a_refused_recording_says_where_and_why() {
    let faults = fixture("faults/faults.csv");
    let rows: Vec<Row> = csv::Reader::from_path(faults).unwrap().deserialize().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 11);
    for row in rows {
        let description = Description::read(&fixture("faults").join(format!("{}.toml", row["recording"])));
        let outcome =
            description.and_then(Recording::open).and_then(|recording| recording.detect(&|_, _| false));
        let told = match outcome {
            Ok(found) => format!("warning: {}", found.warnings[0]),
            Err(error) => error.to_string(),
        };
        // A number in a warning is not as it was written.
        let value = row["value"].trim_end_matches(".000");
        let start = match (row["column"].as_str(), value) {
            ("", _) => String::new(),
            (column, "") => format!("{column}: "),
            (column, value) => format!("{column} = {value}: "),
        };
        let what = row["what"].trim_start_matches("warning: ");
        let expected = format!(".csv:{}: {start}{what} (accepted: ", row["line"]);
        assert!(told.contains(&expected), "{told}\nlacks {expected}");
        assert_eq!(told.starts_with("warning: "), row["what"].starts_with("warning: "), "{told}");
    }
}
