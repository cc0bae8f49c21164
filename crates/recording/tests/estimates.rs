//! Numbers of a model, against the rows of an independent program in `fixtures/recordings`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use asperity_model::theory::analytic::tilted_law;
use asperity_model::{Scenario, ScenarioSource};
use asperity_record::{Estimate, FirstReach};
use asperity_recording::{Description, Detected, Recording, scenario};

type Row = BTreeMap<String, String>;

fn fixture(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/recordings").join(path)
}

fn rows(path: &str) -> Vec<Row> {
    let mut reader = csv::Reader::from_path(fixture(path)).unwrap();
    reader.deserialize().map(Result::unwrap).collect()
}

fn number(row: &Row, column: &str) -> f64 {
    row[column].parse().unwrap()
}

#[track_caller]
fn near(row: &Row, column: &str, found: f64, tolerance: f64) {
    assert!((found - number(row, column)).abs() <= tolerance, "{column}: {found} instead of {row:?}");
}

fn detect() -> (Recording, Detected) {
    let description = Description::read(&fixture("slip/recording.toml")).unwrap();
    let recording = Recording::open(description).unwrap();
    let found = recording.detect(&|_, _| false).unwrap();
    (recording, found)
}

#[test]
fn the_fit_of_first_reach_is_that_of_the_reference() {
    let points = rows("length-law/points.csv");
    for fit in rows("length-law/fits.csv") {
        let is_of_fit = |row: &&Row| row["run"] == fit["run"] && row["sensors"] == fit["sensors"];
        let of_fit = points.iter().filter(is_of_fit);
        let of_fit: Vec<[f64; 2]> =
            of_fit.map(|row| [number(row, "x_over_l"), number(row, "ft_fn")]).collect();
        let [[dynamic, dynamic_error], [tilt, tilt_error]] = tilted_law(&of_fit).unwrap();
        near(&fit, "mu_d", dynamic, 1e-4 * dynamic);
        near(&fit, "mu_d_error", dynamic_error, 0.01 * dynamic_error);
        near(&fit, "tilt", tilt, 1e-4);
        near(&fit, "tilt_error", tilt_error, 0.01 * tilt_error);
        assert!(tilted_law(&of_fit[..3]).is_none(), "three points have no error");
    }
}

#[test]
fn estimates_and_first_reach_are_those_of_the_reference() {
    let (_, found) = detect();
    let told: Vec<&Estimate> = found.rows.iter().filter_map(|row| row.values.get()).collect();
    let due = rows("slip/expected-estimates.csv");
    assert_eq!(told.len(), due.len(), "{told:?}");
    for row in &due {
        let is_it = |told: &&&Estimate| told.number == row["number"];
        let told = told.iter().find(is_it).unwrap_or_else(|| panic!("{row:?} is missing"));
        let error = number(row, "error");
        near(row, "value", told.value, 0.02 * error);
        near(row, "error", told.error, 0.02 * error);
    }
    let points: Vec<&FirstReach> = found.rows.iter().filter_map(|row| row.values.get()).collect();
    let due = rows("slip/expected-first-reach.csv");
    assert_eq!(points.len(), due.len(), "{points:?}");
    for (point, row) in points.into_iter().zip(&due) {
        assert_eq!(row["sensor"], point.sensor.to_string());
        near(row, "x_over_l", point.x_over_l, 1e-4);
        near(row, "ft_fn", point.ft_fn, 1e-5 * point.ft_fn);
        near(row, "ft_fn_error", point.ft_fn_error, 0.01 * point.ft_fn_error);
    }
}

/// What is not identifiable keeps its default and says so; a value that no scenario can have counts as such.
#[test]
fn a_scenario_has_what_is_identifiable() {
    let (recording, found) = detect();
    let told = found.rows.iter().filter_map(|row| row.values.get::<Estimate>());
    let mut numbers: BTreeMap<String, [f64; 2]> =
        told.map(|told| (told.number.clone(), [told.value, told.error])).collect();
    let loads_n: Vec<f64> = found.steps().map(|step| step.normal_load_n).collect();
    let of = |numbers: &BTreeMap<String, [f64; 2]>| {
        let text = scenario(&recording.description, numbers.clone(), loads_n.clone(), 2.99975);
        let made = Scenario::resolve(&ScenarioSource::new("estimated.toml", text.as_str()));
        (made.unwrap_or_else(|errors| panic!("{errors}\n{text}")), text)
    };
    let (made, text) = of(&numbers);
    assert!((made.drive.velocity_m_per_s - 1e-4).abs() < 1e-8, "{text}");
    assert!((made.friction.dynamic_coefficient - 0.446).abs() < 1e-3, "{text}");
    assert!((made.normal_load.total_n - 400.0).abs() < 0.1 && made.time.duration_s == 3.0, "{text}");
    assert!(text.contains("# +- 1086") && text.contains("loading rate over V, a lower bound"), "{text}");
    assert!(
        text.contains("# friction.static_coefficient: not identifiable, so it keeps its default"),
        "{text}"
    );

    numbers.insert("tilt".to_owned(), [1.2, 0.5]);
    numbers.insert("dynamic_coefficient".to_owned(), [0.8, 0.1]);
    numbers.insert("drive_velocity_m_per_s".to_owned(), [-1e-4, 1e-9]);
    let (made, text) = of(&numbers);
    assert!(text.contains("# normal_load.tilt: not identifiable"), "{text}");
    assert!(made.drive.velocity_m_per_s == 1e-4 && made.friction.static_coefficient > 0.8, "{text}");
}
